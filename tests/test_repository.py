"""What a machine keeps about the repository itself."""

import ast
import importlib.metadata
import re
import shutil
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("configs", "drivers", "estimators", "planners", "runtime", "sim_drivers")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
REGISTRIES = re.compile(rb"(pypi\.org|pythonhosted\.org|npmjs\.|anaconda\.org|debian\.org|docker\.io)")
MACHINE_PATHS = re.compile(rb"(^|[^A-Za-z0-9_.])/(home|root|work|Users)/")
ENTRY_POINTS = [
    pytest.param(group, name, target, id=f"{group}:{name}")
    for group, names in PROJECT["entry-points"].items()
    for name, target in names.items()
]


@cache
def tracked_files() -> tuple[Path, ...]:
    """What git tracks; outside a checkout, everything beside this file's root that is not built."""
    if not (ROOT / ".git").exists():
        return tuple(path for folder in (*PACKAGES, "tests") for path in (ROOT / folder).rglob("*.*") if path.is_file())
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    return tuple(path for name in listed.decode().split("\0") if name and (path := ROOT / name).is_file())


def ours() -> list[Path]:
    return [path for path in tracked_files() if path != Path(__file__) and path.suffix != ".png"]


def python_files() -> list[Path]:
    return [path for path in tracked_files() if path.suffix == ".py"]


def normalised(distribution: str) -> str:
    return re.sub(r"[-_.]+", "-", distribution).lower()


def requirement_name(requirement: str) -> str:
    return normalised(re.split(r"[^A-Za-z0-9_.-]", requirement)[0])


@pytest.mark.parametrize("pattern", [REGISTRIES, MACHINE_PATHS], ids=["registry", "path"])
def test_no_tracked_file_names_a_registry_or_a_machine(pattern):
    assert [str(path.relative_to(ROOT)) for path in ours() if pattern.search(path.read_bytes())] == []


def test_pins_are_names_and_versions_only():
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert [line for line in lines if not re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9.]+", line)] == []
    wanted = [*PROJECT["dependencies"], *(item for extra in PROJECT["optional-dependencies"].values() for item in extra)]
    assert {requirement_name(item) for item in wanted} - {"trundle"} - {requirement_name(line) for line in lines} == set()


def test_the_licence_is_there_in_full():
    text = (ROOT / "LICENSE").read_text()
    assert "Apache License" in text
    assert "END OF TERMS AND CONDITIONS" in text


def test_ci_is_one_command():
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    assert script.read_text().rstrip().endswith("make test")


@pytest.mark.parametrize(("group", "name", "target"), ENTRY_POINTS)
def test_every_entry_point_loads_and_has_settings(group, name, target):
    loaded = importlib.metadata.EntryPoint(name, target, group).load()
    assert isinstance(loaded, type)
    assert loaded.__doc__
    assert hasattr(loaded, "Settings")


def test_the_command_line_loads():
    (target,) = PROJECT["scripts"].values()
    assert callable(importlib.metadata.EntryPoint("trundle", target, "console_scripts").load())


@pytest.mark.parametrize("name", PROJECT["entry-points"]["trundle.planners"])
def test_every_planner_folder_has_the_same_files(name):
    folder = ROOT / "planners" / name
    assert {"planner.py", "settings.py", "README.md"} <= {path.name for path in folder.iterdir()}
    decorated = [path.name for path in folder.glob("*.py") if "interface.kernel import" in path.read_text()]
    assert all(name.endswith("kernels.py") for name in decorated)  # compiled code stands in files that say so


def test_every_import_is_declared_and_every_dependency_is_imported():
    trees = [ast.parse(path.read_text()) for path in python_files() if path.relative_to(ROOT).parts[0] in PACKAGES]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    modules = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    modules |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) if node.module is not None}
    foreign = {module.split(".")[0] for module in modules} - set(PACKAGES) - set(sys.stdlib_module_names)
    providers = importlib.metadata.packages_distributions()
    imported = {name: {normalised(distribution) for distribution in providers[name]} for name in foreign}
    base = {requirement_name(item) for item in PROJECT["dependencies"]}
    extras = {requirement_name(item) for items in PROJECT["optional-dependencies"].values() for item in items}
    assert {name for name, distributions in imported.items() if not distributions & (base | extras)} == set()
    assert base - set().union(*imported.values()) == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_typed(package):
    assert (ROOT / package / "py.typed").is_file()


def test_no_file_is_too_long_to_read():
    lengths = {str(path.relative_to(ROOT)): len(path.read_text().splitlines()) for path in python_files()}
    assert {name: length for name, length in lengths.items() if length > 400} == {}


def test_nothing_large_is_tracked():
    assert [path.name for path in tracked_files() if path.stat().st_size > 1_500_000] == []


FORBIDDEN_IMPORTS = {
    "drivers/interface/bad.py": "from drivers import keyboard",
    "drivers/bad.py": "import sim_drivers.world",
    "sim_drivers/bad.py": "from drivers.keyboard import KeyboardOperator",
    "estimators/bad.py": "import drivers.recorded_depth",
    "estimators/worse.py": "import planners.planner",
    "planners/bad.py": "import sim_drivers.world",
    "planners/worse.py": "import runtime.faults",
    "configs/bad.py": "import estimators.belief",
}
ALLOWED_IMPORTS = {
    "drivers/good.py": "import drivers.interface.samples",
    "sim_drivers/good.py": "import drivers.interface.samples",
    "estimators/good.py": "import drivers.interface.samples",
    "planners/good.py": "import estimators.belief\nimport drivers.interface.samples",
    "runtime/good.py": "import drivers.keyboard, sim_drivers.world, estimators.belief, planners.planner",
}


def lint_imports_with(tmp_path: Path, files: dict[str, str]) -> str:
    """Run the layer contracts over a copy of the packages with some files added."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name, text in files.items():
        (tmp_path / name).write_text(text + "\n")
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()", "--no-cache"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def test_the_layer_contracts_allow_what_the_design_allows(tmp_path):
    assert "0 broken" in lint_imports_with(tmp_path, ALLOWED_IMPORTS)


def test_the_layer_contracts_catch_every_forbidden_import(tmp_path):
    output = lint_imports_with(tmp_path, FORBIDDEN_IMPORTS)
    assert "0 kept, 6 broken" in output
    for name in FORBIDDEN_IMPORTS:
        module = name.removesuffix(".py").replace("/", ".")
        assert f"{module} -> " in output, f"{name} was not caught"
