"""The results of an evaluation, kept as they come: one that was interrupted goes on where it was.

A JSON text a line: first whose results they are, then a case with its result each.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pydantic import TypeAdapter, ValidationError

from drivers.interface.errors import ConfigurationError

C = TypeVar("C", bound=Hashable)
R = TypeVar("R")


class Journal:
    """A file of results; whoever is killed while writing loses the line he was at."""

    def __init__(self, path: Path, owner: str) -> None:
        """Open the file, a new one or one of the same `owner`: what its results are of, and which code made them.

        Raises:
            ConfigurationError: it holds something else, or cannot be read or written.
        """
        self._path = path
        self._results: dict[str, Any] = {}
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            if text:
                self._take(_whole_lines(text), owner)
            else:
                text = json.dumps({"of": owner}) + "\n"
            path.write_text("".join(f"{line}\n" for line in _whole_lines(text)), encoding="utf-8")
        except OSError as error:
            raise ConfigurationError(f"--journal {path} cannot be used: {error.strerror}") from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(f"--journal {path} is no journal of an evaluation") from error

    def known(self, todo: tuple[C, ...], work: Callable[[C], R]) -> dict[C, R]:
        """Return the results of `work` that the file holds of these cases.

        Raises:
            ConfigurationError: a result is not one of `work`.
        """
        result_type: TypeAdapter[R] = TypeAdapter(get_type_hints(work)["return"])
        found = {case: self._results.get(_key(case)) for case in todo}
        try:
            return {case: result_type.validate_python(result) for case, result in found.items() if result is not None}
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise ConfigurationError(f"--journal {self._path}: a result's {where}: {first['msg']}") from error

    def add(self, case: Hashable, result: object) -> None:
        """Write one more result.

        Raises:
            ConfigurationError: it cannot be written any more.
        """
        line = json.dumps({"case": json.loads(_key(case)), "result": _plain(result)})
        try:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise ConfigurationError(f"--journal {self._path} cannot be written: {error.strerror}") from error

    def _take(self, lines: list[str], owner: str) -> None:
        try:
            first, *others = (json.loads(line) for line in lines)
            found = first["of"]
            self._results = {_sorted(one["case"]): one["result"] for one in others}
        except (ValueError, KeyError, TypeError) as error:
            raise ConfigurationError(f"--journal {self._path} is no journal of an evaluation") from error
        if found != owner:
            raise ConfigurationError(f"--journal {self._path} is of {found}, not of {owner}; name another file")


def _whole_lines(text: str) -> list[str]:
    return [line.removesuffix("\n") for line in text.splitlines(keepends=True) if line.endswith("\n")]


def _plain(value: object) -> Any:
    return TypeAdapter(type(value)).dump_python(value)


def _sorted(case: object) -> str:
    return json.dumps(case, sort_keys=True)


def _key(case: Hashable) -> str:
    return _sorted(json.loads(TypeAdapter(type(case)).dump_json(case)))
