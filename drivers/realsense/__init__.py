"""An Intel RealSense camera: live, from a `.bag`, or emulated, always through librealsense's own filters.

`driver.py` and `imu.py` are the devices, `link.py` the process that they share, `session.py` what that process does; `depth.py`,
`colour.py` and `motion.py` read one kind of frame each, `filters.py` is the chain of post-processing, `device_clock.py` turns the
camera's time into ours, `live.py`, `recorded.py` and `emulated.py` are where frames come from.
"""
