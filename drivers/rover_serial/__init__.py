"""A rover whose autopilot (ArduPilot Rover or PX4) is told where to go over MAVLink 2: serial port, pseudo-terminal, TCP or UDP.

`driver.py` and `imu.py` are the devices, which share one `link.py`; `session.py` is what its process does on the wire:
`greeting.py` finds out who is there and what it sends, `arming.py` arms it, `telemetry.py` makes samples of what it says, and
`autopilots.py` holds what the two do differently.  `frames.py`, `signing.py`, `messages.py`, `commands.py` and `timesync.py` are
the protocol, `wire.py` the bytes.
"""
