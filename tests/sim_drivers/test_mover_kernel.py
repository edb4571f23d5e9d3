import numpy as np

from sim_drivers.mover_kernel import pack_movers, place_movers
from sim_drivers.scene import Mover, Shape


def test_the_kernel_places_movers_as_the_scene_says() -> None:
    rng = np.random.default_rng(5)
    movers = []
    for index in range(8):
        frames = rng.normal(size=(rng.integers(1, 12) + index % 2, 4))  # a looped one has two key frames or more
        frames[:, 0] = np.cumsum(rng.uniform(0.1, 2.0, len(frames))) - 3.0
        movers.append(Mover(f"m{index}", Shape.cylinder(0.3, 1.7), frames, looped=bool(index % 2)))
    order = rng.permutation(8)
    keyframes, spans = pack_movers(movers, order.tolist())
    position, quaternion = np.full((8, 3), 0.85), np.zeros((8, 4))
    times = np.concatenate((rng.uniform(-5.0, 40.0, 200), keyframes[:, 0]))
    for time_s in times:
        place_movers(float(time_s), keyframes, spans, position, quaternion)
        for mover, mocap in zip(movers, order, strict=True):
            pose = mover.pose_at(float(time_s))
            np.testing.assert_allclose(position[mocap], [pose.x, pose.y, 0.85], atol=1e-12)
            np.testing.assert_allclose(2 * np.arctan2(quaternion[mocap, 3], quaternion[mocap, 0]), pose.yaw, atol=1e-9)


def test_a_scene_without_movers_is_placed_too() -> None:
    keyframes, spans = pack_movers((), ())
    place_movers(1.0, keyframes, spans, np.zeros((0, 3)), np.zeros((0, 4)))
    assert keyframes.shape == (0, 4)
    assert spans.shape == (0, 4)
