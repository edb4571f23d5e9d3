"""Every estimator: a belief is finite, honest about its uncertainty, nobody else's to change, and survives any input."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.samples import Intrinsics, Stamp
from drivers.interface.sensed import Sensed
from estimators.belief import FREE, OCCUPIED, UNKNOWN
from runtime.registry import Part
from tests.contract.facts import all_finite, arrays, signatures
from tests.contract.streams import PERIOD_NS
from tests.contract.subjects import Subject, subjects

ESTIMATORS = pytest.mark.parametrize("subject", subjects(Part.ESTIMATOR), ids=str)
NAN = float("nan")


def assert_sound(belief, sensed: Sensed) -> None:
    """Assert what holds of every belief."""
    assert (belief.tick, belief.stamp_ns) == (sensed.tick.index, sensed.tick.start_ns)
    assert belief.oldest_input_ns <= belief.stamp_ns
    assert all_finite(belief)
    for covariance in (belief.covariance, *(track.covariance for track in belief.tracks)):
        assert np.allclose(covariance, covariance.T, rtol=1e-9, atol=1e-15)
        assert np.linalg.eigvalsh(covariance).min() >= -1e-12
    grid, field = belief.grid, belief.clearance
    assert grid.lattice == field.lattice
    assert set(np.unique(grid.label)) <= {FREE, OCCUPIED, UNKNOWN}
    assert {array.shape for array in arrays(grid) + arrays(field)} == {(grid.lattice.rows, grid.lattice.columns)}
    assert np.array_equal(field.known, grid.label != UNKNOWN)
    assert not field.rate_m_s[~field.overlap].any()
    assert not field.clearance_m[grid.label == OCCUPIED].any()
    assert not any(array.flags.writeable for array in arrays(belief))


@ESTIMATORS
def test_a_belief_is_sound_at_every_tick(subject: Subject):
    estimator = subject.build()
    for (sensed,) in subject.inputs:
        belief = estimator.update(sensed)
        assert_sound(belief, sensed)
        assert belief.faults == ()


@ESTIMATORS
def test_a_belief_grows_out_of_what_is_sensed(subject: Subject):
    """Or the tests here would hold of an estimator that ignores its samples."""
    estimator = subject.build()
    first, *_, last = (estimator.update(sensed) for (sensed,) in subject.inputs)
    truth = subject.inputs[-1][0].truth.map_from_base
    assert last.map_from_base.distance(truth) < 0.05
    assert last.odom_from_base.distance(first.odom_from_base) > 0.5
    assert (last.grid.label == OCCUPIED).sum() > 20
    assert (last.grid.label == FREE).sum() > 500


def change(sensed: Sensed, kind: str, **changes) -> Sensed:
    """Apply a function to fields of every sample of one kind."""

    def one(sample):
        return replace(sample, **{name: function(getattr(sample, name)) for name, function in changes.items()})

    samples = getattr(sensed, kind)
    return replace(sensed, **{kind: tuple(map(one, samples)) if isinstance(samples, tuple) else samples and one(samples)})


def shifted(sensed: Sensed, by_ns: int) -> Sensed:
    """Move every capture time."""
    for kind in ("depth", "imu", "base", "scans", "truth"):
        sensed = change(sensed, kind, stamp=lambda s: Stamp(s.captured_ns + by_ns, s.received_ns + by_ns, s.sequence))
    return sensed


def halved(k: Intrinsics) -> Intrinsics:
    return Intrinsics(k.width // 2, k.height // 2, k.fx / 2, k.fy / 2, k.cx / 2, k.cy / 2)


def one_nan(values: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(values)) == 0, NAN, values)


BAD = {
    "nothing": lambda s: replace(s, depth=None, imu=(), base=(), scans=(), truth=None),
    "zero depth": lambda s: change(s, "depth", depth=np.zeros_like),
    "saturated depth": lambda s: change(s, "depth", depth=lambda d: np.full_like(d, 65_535)),
    "depth within reach": lambda s: change(s, "depth", depth=np.ones_like),
    "other resolution": lambda s: change(s, "depth", depth=lambda d: d[::2, ::2], intrinsics=halved),
    "cut image": lambda s: change(s, "depth", depth=lambda d: d[:-1]),
    "empty image": lambda s: change(s, "depth", depth=lambda d: d[:0]),
    "depth of another type": lambda s: change(s, "depth", depth=lambda d: d.astype(np.float32)),
    "no focal length": lambda s: change(s, "depth", intrinsics=lambda k: replace(k, fx=0.0)),
    "camera nowhere": lambda s: change(s, "depth", base_from_optical=lambda pose: replace(pose, x=NAN)),
    "wheel angle not a number": lambda s: change(s, "base", position_rad=one_nan),
    "wheel rate not a number": lambda s: change(s, "base", velocity_rad_s=one_nan),
    "wheel angle infinite": lambda s: change(s, "base", position_rad=lambda v: np.full_like(v, np.inf)),
    "wheel counter reset": lambda s: change(s, "base", position_rad=lambda v: v + 1e6),
    "a wheel missing": lambda s: change(s, "base", position_rad=lambda v: v[1:], velocity_rad_s=lambda v: v[1:]),
    "gyro not a number": lambda s: change(s, "imu", gyro_rad_s=lambda _: (NAN,) * 3, accel_m_s2=lambda _: (NAN,) * 3),
    "range not a number": lambda s: change(s, "scans", range_m=lambda r: r * NAN),
    "scan empty": lambda s: change(s, "scans", range_m=lambda r: r[:0]),
    "scan turned by infinity": lambda s: change(s, "scans", angle_step_rad=lambda _: np.inf),
    "truth nowhere": lambda s: change(s, "truth", map_from_base=lambda pose: replace(pose, x=NAN)),
    "twice in one tick": lambda s: replace(s, base=s.base * 2, imu=s.imu * 2, scans=s.scans * 2),
    "backwards": lambda s: replace(s, base=s.base[::-1], imu=s.imu[::-1], scans=s.scans[::-1]),
    "the tick before again": lambda s: shifted(s, -PERIOD_NS),
    "long ago": lambda s: shifted(s, -(10**18)),
    "in the future": lambda s: shifted(s, 10**12),
}


@pytest.mark.parametrize("subject", [subject for subject in subjects(Part.ESTIMATOR) if subject.base == "omni"], ids=str)
@pytest.mark.parametrize("bad", BAD)
def test_bad_input_is_survived_and_gone_when_it_is_over(subject: Subject, bad: str):
    """Some ticks of it, from the start and on the way; afterwards the belief is whole again, and nothing was compiled for it."""
    estimator = subject.build()
    estimator.warm_up()
    ready = signatures()
    for index, (good,) in enumerate(subject.inputs[:35]):
        sensed = BAD[bad](good) if index < 6 or 15 <= index < 25 else good
        belief = estimator.update(sensed)
        assert_sound(belief, sensed)
    assert belief.faults == ()
    assert belief.oldest_input_ns > 25 * PERIOD_NS
    assert signatures() == ready
