"""The chain is librealsense's own, in the paper's order; checked against its filters called one by one."""

import numpy as np
import pytest

from drivers.realsense.filters import FilterChain, FilterSettings
from tests.drivers.realsense.imager import SHAPE, Imager


@pytest.fixture
def imager():
    made = Imager()
    made.start()
    yield made
    made.close()


def scene(index):
    """A wall, a post before it, noise, and two patches without depth: one small, one large."""
    rng = np.random.default_rng(index)
    depth = np.full(SHAPE, 2500, np.uint16)
    depth[:, 300:360] = 1200
    depth += rng.integers(0, 40, SHAPE, dtype=np.uint16)
    depth[100:106, 600:606] = 0
    depth[200:440, 480:720] = 0
    return depth


def image(frame):
    return np.asanyarray(frame.get_data()).copy()


def test_it_does_what_librealsense_does_in_the_order_of_the_paper(imager):
    rs, chain = imager.rs, FilterChain(FilterSettings(hole_filling=1))
    alone = (
        rs.decimation_filter(3), rs.disparity_transform(True), rs.spatial_filter(0.25, 30, 4, 2), rs.temporal_filter(0.40, 20, 3),
        rs.disparity_transform(False), rs.hole_filling_filter(1),
    )  # fmt: skip
    for index in range(4):
        frame = expected = imager.frame(scene(index))
        for each in alone:
            expected = each.process(expected)
        assert np.array_equal(image(chain.process(frame)), image(expected))


def test_without_any_filter_nothing_is_changed(imager):
    chain = FilterChain(FilterSettings(decimation=1, disparity=False, spatial=None, temporal=None))
    assert np.array_equal(image(chain.process(imager.frame(scene(0)))), scene(0))


def test_unknown_stays_unknown_unless_holes_are_to_be_filled(imager):
    frame = imager.frame(scene(0))
    plain = FilterSettings(spatial={"holes": 0}, temporal={"persistency": 0})
    hole = (slice(68, 146), slice(161, 239))  # of the large patch, decimated
    assert (image(FilterChain(plain).process(frame))[hole] == 0).all()
    default = image(FilterChain(FilterSettings()).process(frame))
    assert (default[hole][:, 4:-4] == 0).all()
    filled = image(FilterChain(FilterSettings(hole_filling=1)).process(frame))
    assert (filled[hole] > 2000).all()  # a block before the least range would have become the wall behind it


def test_the_width_after_decimation_is_padded_and_the_intrinsics_go_with_it(imager):
    out = FilterChain(FilterSettings()).process(imager.frame(scene(0)))
    k = out.get_profile().as_video_stream_profile().get_intrinsics()
    assert (k.width, k.height) == (284, 160)
    assert (k.fx, k.ppx) == pytest.approx((434.0 / 3, 424.0 / 3))
    assert out.get_units() == pytest.approx(0.001)
