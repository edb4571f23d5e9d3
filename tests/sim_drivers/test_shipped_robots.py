import numpy as np
import pytest

from runtime import configuration
from runtime.assembly import assemble


@pytest.mark.parametrize("robot", ["xlerobot", "jackal"])
def test_the_imu_sits_inside_the_camera(robot):
    devices = dict(configuration.load("static_corridor", (f"robot={robot}",)).devices)
    camera, imu = devices["camera"].settings, devices["imu"].settings
    assert (imu.x_m, imu.y_m, imu.z_m) == (camera.x_m, camera.y_m, camera.z_m)


@pytest.mark.parametrize("robot", ["xlerobot", "jackal", "franka"])
def test_camera_and_body_are_the_same_real_emulated_and_simulated(robot):
    scenario = "arm_waypoints" if robot == "franka" else "static_corridor"
    simulated, emulated, real = (configuration.load(scenario, (f"robot={robot}{kind}",)) for kind in ("", "_emulated", "_real"))
    for other in (emulated, real):
        assert (other.robot.radius_m, other.robot.height_m) == (simulated.robot.radius_m, simulated.robot.height_m)
        ours, theirs = (dict(one.devices)["camera"].settings for one in (simulated, other))
        for mount in ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad"):
            assert getattr(ours, mount) == getattr(theirs, mount)


@pytest.mark.parametrize("changes", [("robot=xlerobot",), ("robot.base.wheels=rollers",), ("robot=jackal",)])
def test_a_loop_of_200_hz_gets_every_sensor_on_its_own_beat(changes):
    assembly = assemble(configuration.load("static_corridor", (*changes, "loop.rate_hz=200", "robot.imu.loss_probability=0")), 0)
    assembly.robot.open()
    assembly.world.step_to(1_000_000_000)
    for device, period_ns in ((assembly.robot.devices.imu, 5_000_000), (assembly.robot.devices.base, 10_000_000)):
        samples = device.drain()
        taken = np.array([(sample.stamp.sequence, sample.stamp.captured_ns) for sample in samples])
        assert len(samples) > 90
        np.testing.assert_array_equal(np.diff(taken[:, 1]), period_ns * np.diff(taken[:, 0]))
    assembly.robot.close()
