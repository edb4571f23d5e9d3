"""How one kind of value is taken apart into columns (`put`) and put together again (`take`), without losing a bit.

The idea is record shredding (Melnik et al., "Dremel", VLDB 2010), with explicit counts in place of repetition levels.  Values
are put together many at a time, column by column: as many as a batch of ticks holds at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import islice
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from runtime.log.exact.columns import Column

Put = Callable[[Any], None]


class Cursor:
    """The values of one column, read from the first to the last."""

    def __init__(self, values: Sequence[Any] | NDArray[Any]) -> None:
        """Begin with the first."""
        self._values, self._at = values, 0

    def take(self, count: int) -> list[Any]:
        """Return the next values as Python's own.  Raises ValueError where there are not so many."""
        part = self._next(count)
        return part.tolist() if isinstance(part, np.ndarray) else list(part)

    def numbers(self, count: int) -> NDArray[np.float64]:
        """Return the next values as an array.  Raises ValueError where there are not so many."""
        return np.asarray(self._next(count), np.float64)

    def _next(self, count: int) -> Sequence[Any] | NDArray[Any]:
        end = self._at + count
        if not self._at <= end <= len(self._values):
            raise ValueError("too few values")
        part, self._at = self._values[self._at : end], end
        return part


Columns = Mapping[str, Cursor]  # by name


class Node(Protocol):
    """Takes one kind of value apart and together."""

    @property
    def put(self) -> Put:
        """What takes a value apart."""
        ...

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return the next values.  Raises ValueError or KeyError when the columns do not hold them."""
        ...


class Record:
    """A dataclass: its fields, in their order; those of a dataclass within it are fetched in the same go."""

    def __init__(self, kind: type, children: Mapping[str, Node]) -> None:
        """Take apart into the children, read back as `kind`."""
        self._kind = kind
        self._children = children
        self.leaves: dict[str, Put] = {}  # by the path of attributes that leads there
        for name, child in children.items():
            if isinstance(child, Record):
                self.leaves |= {f"{name}.{path}": put for path, put in child.leaves.items()}
            else:
                self.leaves[name] = child.put
        self._puts = tuple(self.leaves.values())
        self._get = _getter(tuple(self.leaves))

    def put(self, value: Any) -> None:
        """Write every field."""
        for put, part in zip(self._puts, self._get(value), strict=True):
            put(part)

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return the dataclasses."""
        if not self._children:
            return [self._kind() for _ in range(count)]
        return list(map(self._kind, *(child.take(columns, count) for child in self._children.values())))


def _getter(paths: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    if len(paths) > 1:
        return attrgetter(*paths)
    return lambda value: tuple(attrgetter(path)(value) for path in paths)  # attrgetter returns no tuple for one name


class Optional:
    """A value or None: whether there is one, then the value."""

    def __init__(self, present: Column, child: Node) -> None:
        """Write the flag to `present`."""
        self._name, self._append = present.name, present.values.append
        self._child, self._put = child, child.put

    def put(self, value: Any) -> None:
        """Write the value if there is one."""
        self._append(value is not None)
        if value is not None:
            self._put(value)

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return values and None."""
        present = columns[self._name].take(count)
        some = iter(self._child.take(columns, sum(present)))
        return [next(some) if there else None for there in present]


class Repeated:
    """A tuple of any length: how many, then each."""

    def __init__(self, count: Column, child: Node) -> None:
        """Write the length to `count`."""
        self._name, self._append = count.name, count.values.append
        self._child, self._put = child, child.put

    def put(self, value: tuple[Any, ...]) -> None:
        """Write every element."""
        self._append(len(value))
        for element in value:
            self._put(element)

    def take(self, columns: Columns, count: int) -> Sequence[tuple[Any, ...]]:
        """Return the tuples."""
        lengths = columns[self._name].take(count)
        elements = iter(self._child.take(columns, sum(lengths)))
        return [tuple(islice(elements, length)) for length in lengths]


class Group:
    """A tuple of a fixed length whose elements share one column."""

    def __init__(self, size: int, child: Node) -> None:
        """Hold `size` elements."""
        self._size, self._child, self._put = size, child, child.put

    def put(self, value: tuple[Any, ...]) -> None:
        """Write every element.  Raises ValueError for another length, which would shift all that follows."""
        if len(value) != self._size:
            raise ValueError(f"expected {self._size} values, got {len(value)}")
        for element in value:
            self._put(element)

    def take(self, columns: Columns, count: int) -> Sequence[tuple[Any, ...]]:
        """Return the tuples."""
        elements = iter(self._child.take(columns, self._size * count))
        return list(zip(*[elements] * self._size, strict=True))


class Choice:
    """One of several dataclasses: the name of its class, then the value."""

    def __init__(self, name: Column, children: Mapping[str, Node]) -> None:
        """Write the class name to `name`."""
        self._name, self._append, self._children = name.name, name.values.append, children

    def put(self, value: Any) -> None:
        """Write the value under its class."""
        name = type(value).__name__
        self._append(name)
        self._children[name].put(value)

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return the values."""
        names = columns[self._name].take(count)
        each = {name: iter(self._children[name].take(columns, names.count(name))) for name in dict.fromkeys(names)}
        return [next(each[name]) for name in names]
