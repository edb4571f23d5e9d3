"""An arm's joint state as snapshot bytes."""

from __future__ import annotations

import numpy as np

from drivers.interface.samples import JointSample, Stamp, frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import U8


def pack_joints(joints: JointSample | None) -> U8:
    """Return the sample as bytes, shape (n,); empty for None."""
    if joints is None:
        return np.zeros(0, dtype=np.uint8)
    stamp = joints.stamp
    packed = pack(
        times_ns=(stamp.captured_ns, stamp.received_ns, stamp.sequence),
        clock=stamp.clock,
        state=np.stack((joints.position_rad, joints.velocity_rad_s, joints.torque_nm)),
    )
    return np.frombuffer(packed, dtype=np.uint8)


def unpack_joints(packed: U8) -> JointSample | None:
    """Return the sample that `pack_joints` was given."""
    if packed.size == 0:
        return None
    state = unpack(packed.tobytes())
    captured_ns, received_ns, sequence = state["times_ns"].tolist()
    stamp = Stamp(captured_ns, received_ns, sequence, str(state["clock"]))
    return JointSample(stamp, *(frozen_array(row.copy()) for row in state["state"]))
