import struct
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from runtime.log.exact import rvl

IMAGES = hnp.arrays(
    np.uint16, hnp.array_shapes(min_dims=2, max_dims=2, max_side=24), elements=st.sampled_from([0, 0, 0, 1, 8, 999, 1000, 65535])
)


@given(IMAGES)
def test_every_image_comes_back_exactly(image: np.ndarray) -> None:
    assert np.array_equal(rvl.decode(rvl.encode(image)), image)


def test_words_as_the_paper_packs_them() -> None:
    # One row 0 0 5 4 0: two zeros, two others, differences +5 and -1 (in zigzag 10 and 1), one zero, no others.
    # 10 is two groups of three bits, the low one first and flagged: 1010 0001.  Eight groups fill one little-endian word.
    code = rvl.encode(np.array([[0, 0, 5, 4, 0]], np.uint16))
    assert code[:20].tobytes() == struct.pack("<iffii", 0, 0.0, 0.0, 5, 1)
    assert code[20:].tobytes() == struct.pack("<I", 0x22A11100)


def test_a_cut_image_is_refused_wherever_it_is_cut() -> None:
    image = np.random.default_rng(0).integers(0, 65536, (9, 13)).astype(np.uint16)
    code = rvl.encode(image)
    for length in range(len(code)):
        with pytest.raises(ValueError, match="depth image"):
            rvl.decode(code[:length])


def test_noise_never_reads_beyond_the_image() -> None:
    random = np.random.default_rng(1)
    head = rvl.encode(np.zeros((4, 4), np.uint16))[:20]
    for _ in range(200):
        with suppress(ValueError):
            assert rvl.decode(np.concatenate((head, random.integers(0, 256, 24).astype(np.uint8)))).shape == (4, 4)


def test_one_damaged_image_leaves_the_others_whole() -> None:
    images = [np.full((2, k), k, np.uint16) for k in range(1, 5)]
    codes = [rvl.encode(image) for image in images]
    codes[1] = codes[1][:-4]
    codes[2] = codes[2][:7]
    first, *damaged, last = rvl.decode_all(codes)
    assert damaged == [None, None]
    assert np.array_equal(first, images[0])
    assert np.array_equal(last, images[3])
    assert rvl.decode_all([]) == []
