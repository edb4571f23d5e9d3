"""Reading worlds that others have made: every complaint names the file and what is wrong with it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from pydantic import ConfigDict, Field, ValidationError

from drivers.interface.errors import ConfigurationError
from drivers.interface.settings import Settings

M = TypeVar("M", bound=Settings)
W = TypeVar("W")


def read_text(path: Path) -> str:
    """Return what stands in a file of text.

    Raises:
        ConfigurationError: it cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}") from error


def read_json(path: Path, model: type[M]) -> M:
    """Return a JSON file's content, validated.

    Raises:
        ConfigurationError: it cannot be read, is no JSON, or holds something else than the model says.
    """
    text = read_text(path)
    try:
        validated = _validated(text, model)
    except json.JSONDecodeError as error:
        raise ConfigurationError(f"{path}, line {error.lineno}: it is no JSON: {error.msg}") from error
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigurationError(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from error
    assert isinstance(validated, model)
    return validated


@lru_cache(maxsize=4)  # a run draws its world twice, an evaluation those of one file again and again
def _validated(text: str, model: type[Settings]) -> Settings:
    return model.model_validate(json.loads(text))


def chosen_world(path: Path, worlds: Mapping[str, W], number: int | None) -> W:
    """Return the world of this number; without one, the only one that there is.

    Raises:
        ConfigurationError: there is no such world, or there are several to choose from; the sentence names the valid numbers.
    """
    known = ", ".join(sorted(worlds, key=lambda name: (len(name), name))) or "none"
    if number is None and len(worlds) == 1:
        return next(iter(worlds.values()))
    if number is None:
        raise ConfigurationError(f"{path} holds several worlds, so world.world must name one of them. Known: {known}")
    if str(number) not in worlds:
        raise ConfigurationError(f"{path}: there is no world {number} in it. Known: {known}")
    return worlds[str(number)]


class _AnyWorlds(Settings):
    """Any file of worlds by number, whatever else it holds."""

    model_config = ConfigDict(extra="ignore")

    worlds: dict[int, object] = Field(min_length=1)


def world_numbers(path: Path) -> tuple[int, ...]:
    """Return the numbers of the worlds in a file, in order.

    Raises:
        ConfigurationError: it cannot be read, or holds no worlds.
    """
    return tuple(sorted(read_json(path, _AnyWorlds).worlds))
