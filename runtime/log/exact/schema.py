"""Which columns a dataclass of the loop is taken apart into: read off its type hints, so that the two cannot differ."""

from __future__ import annotations

import enum
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from planners.planner import Diagnostics
from runtime.log.exact import leaves, nodes
from runtime.log.exact.columns import Column, Kind

_KINDS = {int: Kind.INT, float: Kind.FLOAT, bool: Kind.FLAG, str: Kind.TEXT}


class Schema:
    """The columns of one dataclass, all under one entity, and the way to and from them."""

    def __init__(self, entity: str, kind: Any, images: bool = True) -> None:
        """Derive the columns of `kind` (any type hint that the loop's dataclasses use).

        Raises:
            TypeError: a hint that the log has no columns for.
        """
        self.entity, self._images = entity, images
        self.columns: dict[str, Column] = {}
        self._rows = 0
        self._root = self._node("", kind)

    def put(self, value: Any) -> None:
        """Add one tick."""
        self._root.put(value)
        self._rows += 1
        for column in self.columns.values():
            column.ends.append(len(column.values))

    def take(self, cells: Mapping[str, Sequence[Any] | NDArray[Any]], ticks: int = 1) -> Any:
        """Return what one tick's cells, by column name, were made of; of several ticks, a list.

        Raises:
            ValueError: cells are missing, or are none that `put` writes.
        """
        columns = _Columns((name, nodes.Cursor(values)) for name, values in cells.items())
        try:
            taken = self._root.take(columns, ticks)
        except (LookupError, TypeError, ValueError) as error:
            raise ValueError(f"the log holds too few values of {self.entity}, or others than were written") from error
        return taken[0] if ticks == 1 else taken

    def clear(self) -> None:
        """Start a new batch."""
        self._rows = 0
        for column in self.columns.values():
            column.values.clear()
            column.ends.clear()

    def _column(self, name: str, kind: Kind) -> Column:
        name = name or "value"
        if name not in self.columns:  # one met only now was empty in the rows before
            self.columns[name] = Column(name, kind, ends=[0] * self._rows)
        return self.columns[name]

    def _node(self, name: str, hint: Any) -> nodes.Node:
        if hint in _KINDS:
            return leaves.Scalar(self._column(name, _KINDS[hint]))
        if get_origin(hint) in {types.UnionType, Union}:
            return self._union(name, get_args(hint))
        if get_origin(hint) is tuple:
            return self._tuple(name, get_args(hint))
        if get_origin(hint) is np.ndarray:
            return self._array(name, get_args(get_args(hint)[1])[0])
        if isinstance(hint, type) and issubclass(hint, enum.Enum):
            return leaves.Enumeration(self._column(name, Kind.TEXT), hint)
        if hint is Diagnostics:
            return leaves.Said(self._column(_join(name, "type"), Kind.TEXT), self._said(name))
        if isinstance(hint, type) and is_dataclass(hint):
            hints = get_type_hints(hint)
            return nodes.Record(hint, {f.name: self._node(_join(name, f.name), hints[f.name]) for f in fields(hint)})
        raise TypeError(f"the log has no columns for {hint} ({self.entity} {name})")

    def _union(self, name: str, hints: tuple[Any, ...]) -> nodes.Node:
        some = tuple(hint for hint in hints if hint is not type(None))
        if len(some) < len(hints):
            child = self._node(name, some[0]) if len(some) == 1 else self._union(name, some)
            return nodes.Optional(self._column(_join(name, "present"), Kind.FLAG), child)
        children = {hint.__name__: self._node(_join(name, hint.__name__), hint) for hint in some}
        return nodes.Choice(self._column(_join(name, "type"), Kind.TEXT), children)

    def _tuple(self, name: str, hints: tuple[Any, ...]) -> nodes.Node:
        if hints[-1] is Ellipsis:
            return nodes.Repeated(self._column(_join(name, "count"), Kind.INT), self._node(name, hints[0]))
        if len(set(hints)) > 1:
            raise TypeError(f"the log has no columns for a tuple of mixed types ({self.entity} {name})")
        return nodes.Group(len(hints), self._node(name, hints[0]))

    def _array(self, name: str, dtype: Any) -> nodes.Node:
        if dtype is np.float64:
            return leaves.Array(self._column(_join(name, "shape"), Kind.INT), self._column(name, Kind.FLOAT))
        if dtype is np.uint16:
            return leaves.Image(self._column(name, Kind.IMAGE), self._images)
        return leaves.Digest(self._column(_join(name, "crc32"), Kind.INT))

    def _said(self, name: str) -> Any:
        def column(field: str, kind: type) -> Column:
            if kind is float:
                return self._column(_join(name, field), Kind.FLOAT)
            return self._column(_join(_join(name, field), "text"), Kind.TEXT)

        return column


class _Columns(dict[str, nodes.Cursor]):
    """Columns by name; one that is not there is empty."""

    def __missing__(self, name: str) -> nodes.Cursor:
        """Return no values."""
        return nodes.Cursor(())


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
