"""YAML in, plain mappings out: no duplicate keys, `extends` resolved, overrides applied; nothing is validated here."""

from __future__ import annotations

import copy
from collections.abc import Hashable
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from drivers.interface.errors import ConfigurationError, unknown_name

Mapping = dict[str, Any]
SHIPPED = Path(str(files("configs")))


class _StrictLoader(yaml.SafeLoader):
    """SafeLoader that refuses a key that stands twice (YAML 1.2, section 3.2.1.1: keys are unique)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node)
            if key in seen:
                raise ConfigurationError(f"line {key_node.start_mark.line + 1}: key '{key}' stands twice")
            seen.add(key)
        return super().construct_mapping(node, deep)


def shipped(folder: str) -> tuple[str, ...]:
    """Return the names of the shipped files in a folder of `configs`, sorted."""
    return tuple(sorted(path.stem for path in (SHIPPED / folder).glob("*.yaml")))


def find(name_or_path: str, folder: str) -> Path:
    """Return the file that a path or the name of a shipped one means.

    Raises:
        ConfigurationError: there is no such file; the message lists the shipped names.
    """
    path = Path(name_or_path)
    if path.suffix in {".yaml", ".yml"} or len(path.parts) > 1:
        if not path.is_file():
            raise ConfigurationError(f"there is no file '{path}'")
        return path
    if name_or_path not in shipped(folder):
        raise unknown_name("configuration" if folder == "scenarios" else folder[:-1], name_or_path, shipped(folder))
    return SHIPPED / folder / f"{name_or_path}.yaml"


def read(path: Path, folder: str) -> Mapping:
    """Read one file and what it extends (a path or a shipped name of the same folder).

    Raises:
        ConfigurationError: it cannot be read, is no mapping, or extends itself.
    """
    chain: list[Path] = []
    merged: Mapping = {}
    following: Path | None = path
    while following is not None:
        if following in chain:
            raise ConfigurationError(f"{path}: 'extends' leads in a circle over {following}")
        chain.append(following)
        content = parse(following)
        base = content.pop("extends", None)
        merged = merge(content, merged)
        following = None if base is None else find(str(base), folder)
    return merged


def parse(path: Path) -> Mapping:
    """Parse one file.  Raises ConfigurationError with the file's name and the line."""
    try:
        content = copy.deepcopy(_loaded(path.read_text(encoding="utf-8")))
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise ConfigurationError(f"{path}, line {line}: {error.problem}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}") from error
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}, {error}") from error
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path} holds {type(content).__name__}, not keys with values")
    return content


@lru_cache(maxsize=64)  # an evaluation reads the same few files for every run
def _loaded(text: str) -> Any:
    return yaml.load(text, Loader=_StrictLoader)


def merge(base: Mapping, over: Mapping) -> Mapping:
    """Return `base` with `over` laid on top, mapping by mapping.

    >>> merge({"a": {"b": 1, "c": 2}}, {"a": {"c": 3}})
    {'a': {'b': 1, 'c': 3}}
    """
    result = copy.deepcopy(base)
    for key, value in over.items():
        below = result.get(key)
        result[key] = merge(below, value) if isinstance(below, dict) and isinstance(value, dict) else copy.deepcopy(value)
    return result


def parse_import(text: str) -> tuple[str, tuple[tuple[tuple[str, ...], str], ...]]:
    """Split `NAME:FILE#WORLD`, a world of a file that others made, into the configuration's name and what it sets.

    >>> parse_import("barn:worlds.json#30")
    ('barn', ((('world', 'path'), 'worlds.json'), (('world', 'world'), '30')))
    >>> parse_import("door")
    ('door', ())

    Raises:
        ConfigurationError: the file is missing from it.
    """
    name, colon, address = text.partition(":")
    if not colon or len(Path(name).parts) != 1:
        return text, ()
    file, mark, world = address.rpartition("#") if "#" in address else (address, "", "")
    if not file or (mark and not world):
        raise ConfigurationError(f"an imported world is written NAME:FILE or NAME:FILE#WORLD, not '{text}'")
    path = (("world", "path"), file)
    return name, (path, (("world", "world"), world)) if mark else (path,)


def parse_override(text: str) -> tuple[tuple[str, ...], Any]:
    """Split `a.b=c` into the keys and the value (read as YAML).

    >>> parse_override("loop.rate_hz=50")
    (('loop', 'rate_hz'), 50)

    Raises:
        ConfigurationError: it is not of that form.
    """
    key, equals, value = text.partition("=")
    keys = tuple(key.strip().split("."))
    if not equals or not all(keys):
        raise ConfigurationError(f"--set takes a.b=c, not '{text}'")
    try:
        return keys, yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise ConfigurationError(f"--set {key}: '{value}' is not a YAML value") from error


def override(content: Mapping, keys: tuple[str, ...], value: Any) -> Mapping:
    """Return the content with one value replaced, making the mappings on the way.

    Raises:
        ConfigurationError: a key on the way holds a plain value.
    """
    head, *rest = keys
    if not rest:
        return content | {head: value}
    below = content.get(head, {})
    if not isinstance(below, dict):
        raise ConfigurationError(f"--set {'.'.join(keys)}: '{head}' holds the value {below!r}, no keys")
    return content | {head: override(below, tuple(rest), value)}
