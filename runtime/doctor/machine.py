"""The machine: may it keep time, does it run at full speed, is there room for the recording, and what is installed."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from runtime.doctor.findings import Finding, Verdict
from runtime.log.header import code_version, library_versions, machine
from runtime.realtime import realtime
from runtime.sections import RealtimeSection

LEAST_FREE_BYTES = 200_000_000  # about a quarter of an hour of recording
FREE_BYTES = 5_000_000_000
WRITE_BYTES = 32_000_000
LEAST_WRITE_BYTES_S = 20_000_000  # ten times what a recording needs


def examine_machine(logs: Path, asked: RealtimeSection, root: Path = Path("/")) -> list[Finding]:
    """Return what there is to say of this machine; `root` is where /sys and /proc are looked for."""
    return [
        *_privileges(asked),
        _governor(root),
        *_jetson(root),
        _room(logs),
        _write_speed(logs),
        *_versions(),
    ]


def _found(check: str, verdict: Verdict, told: str) -> Finding:
    return Finding("machine", check, verdict, told)


def _privileges(asked: RealtimeSection) -> list[Finding]:
    """Ask for SCHED_FIFO and locked memory, one at a time, and give them back."""
    found = []
    for check, settings, wanted in (
        ("SCHED_FIFO", RealtimeSection(priority=asked.priority or 1, freeze_garbage=False), asked.priority is not None),
        ("mlockall", RealtimeSection(lock_memory=True, freeze_garbage=False), asked.lock_memory),
    ):
        with realtime(settings) as refused:
            verdict = Verdict.GOOD if not refused else Verdict.WARNING if wanted else Verdict.NOTE
            told = f"refused ({refused[0].rpartition(': ')[2]})" if refused else "granted"
            found.append(_found(check, verdict, told + ("" if wanted else "; the configuration does not ask for it")))
    limit, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    found.append(_found("rtprio limit", Verdict.NOTE, str(limit)))
    return found


def _governor(root: Path) -> Finding:
    files = sorted((root / "sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq/scaling_governor"))
    names = sorted({path.read_text(encoding="utf-8").strip() for path in files})
    if not names:
        return _found("CPU governor", Verdict.NOTE, "the system names none (a virtual machine, or a fixed clock)")
    slow = [name for name in names if name != "performance"]
    return _found("CPU governor", Verdict.WARNING if slow else Verdict.GOOD, ", ".join(names))


def _jetson(root: Path) -> list[Finding]:
    model = root / "proc/device-tree/model"
    if not model.exists() or "jetson" not in model.read_text(encoding="utf-8", errors="replace").lower():
        return []
    try:
        told = subprocess.run(["nvpmodel", "-q"], capture_output=True, text=True, timeout=10, check=True).stdout
    except (OSError, subprocess.SubprocessError) as error:
        return [_found("Jetson power mode", Verdict.WARNING, f"nvpmodel does not tell: {error}")]
    mode = " ".join(told.split())
    return [_found("Jetson power mode", Verdict.GOOD if "MAXN" in mode else Verdict.WARNING, mode)]


def _room(logs: Path) -> Finding:
    free = shutil.disk_usage(_existing(logs)).free
    verdict = Verdict.FORBIDS if free < LEAST_FREE_BYTES else Verdict.WARNING if free < FREE_BYTES else Verdict.GOOD
    return _found("disk space", verdict, f"{free / 1e9:.1f} GB free for {logs}/")


def _write_speed(logs: Path) -> Finding:
    """Write what a recording writes in ten seconds, down to the disk."""
    try:
        with tempfile.TemporaryFile(dir=_existing(logs)) as file:
            began_s = time.perf_counter()
            file.write(os.urandom(WRITE_BYTES))
            file.flush()
            os.fsync(file.fileno())
            bytes_s = WRITE_BYTES / (time.perf_counter() - began_s)
    except OSError as error:
        return _found("write speed", Verdict.FORBIDS, f"{logs}/ cannot be written: {error.strerror}")
    verdict = Verdict.WARNING if bytes_s < LEAST_WRITE_BYTES_S else Verdict.GOOD
    return _found("write speed", verdict, f"{bytes_s / 1e6:.0f} MB/s to {logs}/")


def _versions() -> list[Finding]:
    version, modified = code_version()
    return [
        _found("trundle", Verdict.NOTE, version + (" (modified)" if modified else "")),
        _found("system", Verdict.NOTE, machine()),
        _found("libraries", Verdict.NOTE, ", ".join(library_versions())),
    ]


def _existing(folder: Path) -> Path:
    """Return the folder, or what it will be made in."""
    folder = folder.absolute()
    return next(path for path in (folder, *folder.parents) if path.is_dir())
