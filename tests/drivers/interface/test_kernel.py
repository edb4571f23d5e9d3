"""Machine code of a kernel is kept while its sources stay as they are, and no longer."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

from drivers.interface.kernel import sources_of

ROOT = Path(__file__).parents[3]
PROBE = """
import sys

sys.path.insert(0, sys.argv[1])
from planners.outer import outer

print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""
HEAD = "from drivers.interface.kernel import kernel\n"


def _package(root: Path, helper: str, *, imports: str) -> None:
    """Write a tree with the decorator of ours and two kernels, one of which calls the other."""
    for package in ("drivers", "drivers/interface", "planners"):
        (root / package).mkdir(parents=True, exist_ok=True)
        (root / package / "__init__.py").write_text("")
    decorator = ROOT / "drivers" / "interface" / "kernel.py"
    (root / "drivers" / "interface" / "kernel.py").write_text(decorator.read_text())
    inner, outer = "def inner(x):\n    return GAIN * x\n", "def outer(x):\n    return inner(x)\n"
    (root / "planners" / f"{imports}.py").write_text(f"{HEAD}\nGAIN = {helper}\n\n\n@kernel()\n{inner}")
    (root / "planners" / "outer.py").write_text(f"{HEAD}from planners.{imports} import inner\n\n\n@kernel()\n{outer}")


def _run(root: Path) -> tuple[float, int]:
    probe = subprocess.run([sys.executable, "-c", PROBE, str(root)], cwd=root, capture_output=True, text=True, check=True)
    value, hits = probe.stdout.split()
    return float(value), int(hits)


def test_a_changed_kernel_is_compiled_into_its_unchanged_callers(tmp_path: Path) -> None:
    """The caller's own file is the same; numba alone would run the old constant."""
    _package(tmp_path, "2.0", imports="helper")
    assert _run(tmp_path) == (2.0, 0)
    assert _run(tmp_path) == (2.0, 1)  # kept
    _package(tmp_path, "3.0", imports="helper")
    assert _run(tmp_path) == (3.0, 0)


@pytest.mark.parametrize("package", ["estimators", "planners", "sim_drivers"])
def test_whatever_a_kernel_uses_of_ours_is_among_its_sources(package: str) -> None:
    """Functions, types and modules that its module's names stand for come from files of which the digest is made."""
    for path in (ROOT / package).rglob("*.py"):
        if "interface.kernel import" not in path.read_text():
            continue
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        assert _files_used(module) <= sources_of(path), path


def _files_used(module: ModuleType) -> set[Path]:
    used = [value.py_func if isinstance(value, Dispatcher) else value for value in vars(module).values()]
    named = [value for value in used if inspect.isfunction(value) or inspect.isclass(value)]
    modules = [value for value in used if inspect.ismodule(value) and getattr(value, "__file__", None)]
    files = (Path(inspect.getfile(value)) for value in (*named, *modules) if getattr(value, "__module__", "") != "builtins")
    return {file for file in files if file.is_relative_to(ROOT) and ".venv" not in file.parts}
