"""A recording process is killed at a random moment: what is older than the flush interval is there, whole."""

from pathlib import Path

import pytest

from tests.runtime.kill import lost_after_kill


@pytest.mark.parametrize("seed", range(5))
def test_what_is_older_than_the_flush_interval_survives_a_kill(tmp_path: Path, seed: int) -> None:
    assert lost_after_kill(tmp_path, seed, shared=True) == ""
