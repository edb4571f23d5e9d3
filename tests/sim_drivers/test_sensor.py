"""What every simulated sensor promises, whatever it measures."""

import numpy as np
import pytest

from drivers.interface.devices import DepthCamera, DeviceSetup, DeviceState, Imu, RangeScanner, TruthSource
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from sim_drivers.depth_camera import SimDepthCamera
from sim_drivers.imu import SimImu
from sim_drivers.range_scan import SimRangeScanner
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle
from sim_drivers.truth import SimTruth
from sim_drivers.world import MujocoWorld, WorldSettings

SENSORS = [(SimDepthCamera, DepthCamera), (SimImu, Imu), (SimRangeScanner, RangeScanner), (SimTruth, TruthSource)]
WALKER = Mover("walker", Shape.cylinder(0.25, 1.7), np.array([[0.0, 3.0, 0.0, 0.0], [5.0, 1.0, 1.0, 0.0]]))
SCENE = Scene("test", SE2(), (), 60.0, (StaticObstacle("wall", Shape.box(0.2, 9.0, 2.0), SE2(4.0, 0.0, 0.0)),), (WALKER,))


def built(kind, seed=1):
    world = MujocoWorld(SCENE, WorldSettings())
    device = kind(kind.Settings(), DeviceSetup("device", seed, lambda: world.now_ns, world))
    world.compile()
    return world, device


def read(device):
    """Everything new, as a list, however the device is read."""
    if hasattr(device, "latest"):
        sample = device.latest()
        return [] if sample is None else [sample]
    return list(device.drain())


def run(world, device, seconds=0.5, period_ns=50_000_000):
    got = []
    for _ in range(round(seconds * 1e9) // period_ns):
        world.step_to(world.now_ns + period_ns)
        got += read(device)
    return got


@pytest.fixture(params=SENSORS, ids=lambda pair: pair[0].__name__)
def sensor(request):
    return request.param


def test_it_stands_behind_its_contract(sensor):
    kind, contract = sensor
    _, device = built(kind)
    assert isinstance(device, contract)


def test_it_needs_a_world(sensor):
    with pytest.raises(ConfigurationError, match=r"robot\.device .* world\.scenario"):
        sensor[0](sensor[0].Settings(), DeviceSetup("device", 1, lambda: 0))


def test_nothing_comes_before_opening_and_nothing_from_before(sensor):
    world, device = built(sensor[0])
    assert read(device) == []
    world.step_to(300_000_000)
    assert read(device) == []
    device.open()
    assert read(device) == []
    samples = run(world, device)
    assert samples
    assert min(sample.stamp.captured_ns for sample in samples) > 300_000_000


def test_stop_and_close_work_in_every_state_twice(sensor):
    world, device = built(sensor[0])
    for prepare in (lambda: None, device.open, device.close, device.open):
        prepare()
        for _ in range(2):
            device.stop()
        for _ in range(2):
            device.close()
        assert device.health().state is DeviceState.CLOSED
        world.step_to(world.now_ns + 200_000_000)
        assert read(device) == []


def test_it_can_be_opened_again_and_counts_anew(sensor):
    world, device = built(sensor[0])
    device.open()
    run(world, device)
    device.close()
    counted = device.health().received
    device.open()
    assert device.health().received == 0 < counted
    assert run(world, device)[0].stamp.sequence < 20


def test_samples_are_visible_from_their_time_of_reception_on_and_in_order(sensor):
    world, device = built(sensor[0])
    device.open()
    last = -1
    for _ in range(20):
        world.step_to(world.now_ns + 20_000_000)
        for sample in read(device):
            assert sample.stamp.captured_ns <= sample.stamp.received_ns <= world.now_ns
            assert sample.stamp.sequence >= last  # the truth stays until there is a newer one
            last = sample.stamp.sequence
    health = device.health()
    assert health.received > 0
    assert health.expected_period_ns == device.period_ns


@pytest.mark.parametrize("kind", [SimImu, SimRangeScanner])
def test_what_is_lost_is_counted_and_leaves_a_gap(kind):
    world = MujocoWorld(SCENE, WorldSettings())
    device = kind(kind.Settings(loss_probability=0.2), DeviceSetup("device", 1, lambda: world.now_ns, world))
    world.compile()
    device.open()
    sequence = [sample.stamp.sequence for sample in run(world, device, 3.0)]
    lost = sequence[-1] + 1 - len(sequence)
    assert np.all(np.diff(sequence) >= 1)
    assert 0 <= device.health().dropped - lost <= 3  # what is on its way may be lost, too
    assert 0.1 < lost / sequence[-1] < 0.3


def test_the_same_seed_gives_the_same_run_bit_for_bit(sensor):
    def samples(seed):
        world, device = built(sensor[0], seed)
        device.open()
        return [repr_exact(sample) for sample in run(world, device)]

    assert samples(1) == samples(1)
    if sensor[0] is not SimTruth:  # which draws nothing
        assert samples(1) != samples(2)


def repr_exact(sample):
    """Every field of a sample, arrays as bytes."""
    fields = {name: getattr(sample, name) for name in sample.__slots__}
    return {name: value.tobytes() if isinstance(value, np.ndarray) else value for name, value in fields.items()}
