import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from drivers.interface.stateful import pack, unpack

arrays = hnp.arrays(
    st.sampled_from([np.float64, np.float32, np.int64, np.uint8, np.bool_]), hnp.array_shapes(min_dims=0, min_side=0)
)
names = st.text("abcdefghijklmnopqrstuvwxyz_", min_size=1, max_size=8)


@given(st.dictionaries(names, arrays, max_size=5))
def test_what_was_packed_comes_back_bit_for_bit(state):
    restored = unpack(pack(**state))
    assert restored.keys() == state.keys()
    for name, array in state.items():
        assert restored[name].dtype == array.dtype
        assert restored[name].shape == array.shape
        assert restored[name].tobytes() == array.tobytes()  # NaN payloads and signed zeros included


@given(hnp.arrays(np.float64, (3, 2)))
def test_a_snapshot_is_a_copy(state):
    before = state.copy()
    snapshot = pack(state=state)
    state += 1.0
    np.testing.assert_array_equal(unpack(snapshot)["state"], before)


def test_the_same_state_packs_to_the_same_bytes():
    assert pack(a=1.0, b=[1, 2]) == pack(a=1.0, b=[1, 2])
