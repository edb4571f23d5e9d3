"""Real-time set-up of this process, in one place, optional; says what it could not get and undoes itself."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from runtime.sections import RealtimeSection

_MCL_CURRENT, _MCL_FUTURE = 1, 2
_SWITCH_INTERVAL_S = 5e-4  # how long a background thread may hold the interpreter when the loop wants it; Python's own: 5 ms


@contextmanager
def realtime(settings: RealtimeSection) -> Iterator[tuple[str, ...]]:
    """Within the block the process has what the settings ask for; yields one sentence for each thing it was refused."""
    refused: list[str] = []
    scheduler, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    affinity, interval_s = os.sched_getaffinity(0), sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    locked = _apply(settings, refused)
    if settings.freeze_garbage:
        gc.collect()
        gc.freeze()
    try:
        yield tuple(refused)
    finally:
        sys.setswitchinterval(interval_s)
        if settings.freeze_garbage:
            gc.unfreeze()
        if settings.cpus:
            os.sched_setaffinity(0, affinity)
        if settings.priority is not None:
            os.sched_setscheduler(0, scheduler, parameters)
        if locked:
            ctypes.CDLL(None).munlockall()


def _apply(settings: RealtimeSection, refused: list[str]) -> bool:
    if settings.cpus:
        try:
            os.sched_setaffinity(0, settings.cpus)
        except OSError as error:
            refused.append(f"loop.system.cpus {list(settings.cpus)}: {error.strerror}")
    if settings.priority is not None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(settings.priority))
        except OSError as error:
            refused.append(f"loop.system.priority {settings.priority}: {error.strerror}")
    if not settings.lock_memory:
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE):
        refused.append(f"loop.system.lock_memory: {os.strerror(ctypes.get_errno())}")
        return False
    return True
