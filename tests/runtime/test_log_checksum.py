"""The checksum of a tick is zlib's CRC-32 over names and bytes, whatever the columns hold."""

import zlib

import numpy as np

from runtime.log.exact.checksum import Cells, checksums


def test_it_is_the_crc_of_zlib_over_what_each_tick_holds() -> None:
    random = np.random.default_rng(5)
    ends = np.cumsum(random.integers(0, 4, 9))
    count = int(ends[-1])
    columns = [
        Cells("b numbers", random.normal(size=count), ends),
        Cells("a texts", [f"{k}".zfill(k) + "é" for k in range(count)], ends.tolist()),
        Cells("d images", [random.integers(0, 65536, (3, 1 + k)).astype(np.uint16) for k in range(count)], ends),
        Cells("c flags", random.integers(0, 2, count).astype(np.bool_), ends),
    ]
    expected = []
    for start, end in zip([0, *ends[:-1]], ends, strict=True):
        crc = 0
        for name, values, _ in sorted(columns, key=lambda column: column.name):
            for label in [name.encode()] if end > start else []:
                crc = zlib.crc32(label, crc)
            for value in values[start:end]:
                crc = zlib.crc32(value.encode() if isinstance(value, str) else value.tobytes(), crc)
        expected.append(crc)
    assert checksums(columns, len(ends)) == expected
    assert checksums([], 2) == [0, 0]
