"""YAML files: nothing is guessed, every complaint names file and key."""

from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime import yaml_files


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "a.yaml", "robot: xlerobot\nloop:\n  rate_hz: 20\n  rate_hz: 50\n")
    with pytest.raises(ConfigurationError, match=r"a\.yaml, line 4: key 'rate_hz' stands twice"):
        yaml_files.parse(path)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("robot: [", r"a\.yaml, line \d+: .*"),
        ("- robot", r"a\.yaml holds list, not keys with values"),
        ("", r"a\.yaml holds NoneType, not keys with values"),
        ("robot: !!python/object:os.system {}", r"a\.yaml, line 1: could not determine a constructor .*"),
    ],
)
def test_broken_files_are_refused_with_a_sentence(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        yaml_files.parse(write(tmp_path, "a.yaml", text))


def test_binary_and_missing_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "b.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="cannot be read"):
        yaml_files.parse(tmp_path / "b.yaml")
    with pytest.raises(ConfigurationError, match="there is no file"):
        yaml_files.find(str(tmp_path / "c.yaml"), "scenarios")


def test_a_file_extends_another_key_by_key(tmp_path: Path) -> None:
    base = write(tmp_path, "base.yaml", "robot: xlerobot\nworld: {scenario: door, width_m: 2.0}\n")
    over = write(tmp_path, "over.yaml", f"extends: {base}\nworld: {{width_m: 3.0}}\n")
    assert yaml_files.read(over, "scenarios") == {"robot": "xlerobot", "world": {"scenario": "door", "width_m": 3.0}}


def test_a_circle_of_extensions_is_found(tmp_path: Path) -> None:
    one, two = tmp_path / "one.yaml", tmp_path / "two.yaml"
    write(tmp_path, "one.yaml", f"extends: {two}\n")
    write(tmp_path, "two.yaml", f"extends: {one}\n")
    with pytest.raises(ConfigurationError, match="circle"):
        yaml_files.read(one, "scenarios")


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"unknown configuration 'dynamic_halway'; did you mean 'dynamic_hallway'\?"):
        yaml_files.find("dynamic_halway", "scenarios")


@pytest.mark.parametrize("text", ["loop.rate_hz", "=3", "a..b=1", ".a=1"])
def test_a_malformed_override_is_refused(text: str) -> None:
    with pytest.raises(ConfigurationError, match="--set"):
        yaml_files.parse_override(text)


def test_an_override_does_not_go_below_a_plain_value() -> None:
    with pytest.raises(ConfigurationError, match="'rate_hz' holds the value 20, no keys"):
        yaml_files.override({"loop": {"rate_hz": 20}}, ("loop", "rate_hz", "x"), 1)


def test_an_override_leaves_the_original_alone() -> None:
    original = {"loop": {"rate_hz": 20}}
    assert yaml_files.override(original, ("loop", "rate_hz"), 50) == {"loop": {"rate_hz": 50}}
    assert original == {"loop": {"rate_hz": 20}}
