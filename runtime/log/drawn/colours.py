"""The colours of the recording: one meaning, one colour, told apart also by the colour-blind (the IBM palette)."""

Rgb = tuple[int, int, int]

ASKED: Rgb = (255, 176, 0)  # what the planner wants: its command, its path
SENT: Rgb = (100, 143, 255)  # what is done: the command sent, the robot
MOVING: Rgb = (220, 38, 127)  # what moves and could be hit
ROUTE: Rgb = (120, 94, 240)
GOAL: Rgb = (46, 204, 113)
TRUTH: Rgb = (225, 228, 232)
STAGES: tuple[Rgb, ...] = (
    (100, 143, 255),
    (64, 200, 200),
    (120, 94, 240),
    (255, 176, 0),
    (220, 38, 127),
    (46, 204, 113),
    (150, 156, 166),
)
RESPONSES: tuple[Rgb, ...] = ((46, 160, 90), (150, 156, 166), (255, 176, 0), (254, 97, 0), (220, 38, 60))  # mild to severe
