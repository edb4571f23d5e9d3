"""How one kind of value is taken apart into columns (`put`) and put together again (`take`), without losing a bit.

The idea is record shredding (Melnik et al., "Dremel", VLDB 2010), with explicit counts in place of repetition levels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from operator import attrgetter
from typing import Any, Protocol

from runtime.log.columns import Column

Row = Mapping[str, Iterator[Any]]  # the cells of one tick, by column name
Put = Callable[[Any], None]


class Node(Protocol):
    """Takes one kind of value apart and together."""

    @property
    def put(self) -> Put:
        """What takes a value apart."""
        ...

    def take(self, row: Row) -> Any:
        """Return the next value.  Raises StopIteration when the row holds none."""
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

    def take(self, row: Row) -> Any:
        """Return the dataclass."""
        return self._kind(**{name: child.take(row) for name, child in self._children.items()})


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

    def take(self, row: Row) -> Any:
        """Return the value or None."""
        return self._child.take(row) if next(row[self._name]) else None


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

    def take(self, row: Row) -> tuple[Any, ...]:
        """Return the tuple."""
        return tuple(self._child.take(row) for _ in range(next(row[self._name])))


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

    def take(self, row: Row) -> tuple[Any, ...]:
        """Return the tuple."""
        return tuple(self._child.take(row) for _ in range(self._size))


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

    def take(self, row: Row) -> Any:
        """Return the value."""
        return self._children[next(row[self._name])].take(row)
