"""How single values, arrays and images become cells of columns, and cells become them again."""

from __future__ import annotations

import enum
import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, make_dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.samples import frozen_array
from planners.planner import Diagnostics
from runtime.log.exact.columns import Column
from runtime.log.exact.nodes import Columns, Put


class Scalar:
    """An int, a float, a bool or a str: one cell."""

    def __init__(self, column: Column) -> None:
        """Write to the column."""
        self._name = column.name
        self.put: Put = column.values.append

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return the next values."""
        return columns[self._name].take(count)


class Enumeration:
    """A member of an enum, by its name."""

    def __init__(self, column: Column, kind: type[enum.Enum]) -> None:
        """Write to the column, read back as a member of `kind`."""
        self._name, self._kind, self._append = column.name, kind, column.values.append

    def put(self, value: enum.Enum) -> None:
        """Write the member's name."""
        self._append(value.name)

    def take(self, columns: Columns, count: int) -> Sequence[enum.Enum]:
        """Return the members."""
        return [self._kind[name] for name in columns[self._name].take(count)]


class Array:
    """A float64 array: the number of its axes and its shape, then its elements."""

    def __init__(self, shape: Column, elements: Column) -> None:
        """Write to the two columns."""
        self._shape, self._elements = shape, elements

    def put(self, value: NDArray[np.float64]) -> None:
        """Write the array."""
        self._shape.values.append(value.ndim)
        self._shape.values.extend(value.shape)
        self._elements.values.extend(value.ravel().tolist())

    def take(self, columns: Columns, count: int) -> Sequence[NDArray[np.float64]]:
        """Return the arrays, read-only."""
        shapes, elements = columns[self._shape.name], columns[self._elements.name]
        taken = []
        for _ in range(count):
            shape = shapes.take(shapes.take(1)[0])
            taken.append(frozen_array(elements.numbers(math.prod(shape)).reshape(shape)))
        return taken


class Image:
    """A 16-bit image: one cell; nothing where the settings leave images out."""

    def __init__(self, column: Column, recorded: bool) -> None:
        """Write to the column if `recorded`."""
        self._name = column.name
        self.put: Put = column.values.append if recorded else lambda image: None

    def take(self, columns: Columns, count: int) -> Sequence[NDArray[np.uint16]]:
        """Return the images, shape (height, width), read-only."""
        return [frozen_array(np.asarray(image, np.uint16)) for image in columns[self._name].take(count)]


class Digest:
    """A large array that follows from what was sensed: only its CRC-32, enough to find the tick where two runs part."""

    def __init__(self, column: Column) -> None:
        """Write the CRC to the column."""
        self._name, self._append = column.name, column.values.append
        self._last: NDArray[Any] | None = None
        self._crc = 0

    def put(self, value: NDArray[Any]) -> None:
        """Write the CRC; the very array of the tick before is not read again."""
        if value is not self._last:
            self._last, self._crc = value, zlib.crc32(np.ascontiguousarray(value).data)
        self._append(self._crc)

    def take(self, columns: Columns, count: int) -> Sequence[Any]:
        """Return the CRCs in place of the arrays, which cannot be had back."""
        return columns[self._name].take(count)


class Said:
    """Diagnostics, whose fields a planner or shield defines: numbers and flags as float64, all else as text."""

    def __init__(self, name: Column, new_column: Callable[[str, type], Column]) -> None:
        """Write the class name to `name`; the columns of its fields follow when a field is first met."""
        self._name = name
        self._new_column = new_column
        self._columns: dict[tuple[str, type], Column] = {}

    def put(self, value: Any) -> None:
        """Write every field."""
        self._name.values.append(type(value).__name__)
        for name, part in said(value):
            key = (name, type(part))
            if key not in self._columns:
                self._columns[key] = self._new_column(*key)
            self._columns[key].values.append(part)

    def take(self, columns: Columns, count: int) -> Sequence[Diagnostics]:
        """Return diagnostics that say the same, in a class of the same name: theirs may not be installed here.

        All of them are of one class: taken one tick at a time, or they may mix.
        """
        prefix = self._name.name.removesuffix("type")
        told = {name.removeprefix(prefix): cells for name, cells in columns.items() if name.startswith(prefix)}
        return [self._one({name: cells.take(1)[0] for name, cells in told.items()}) for _ in range(count)]

    @staticmethod
    def _one(told: dict[str, Any]) -> Diagnostics:
        kind = told.pop("type")
        values = {name.removesuffix(".text"): value for name, value in told.items()}
        return _class_of(kind, tuple(values))(**values)


@cache
def _class_of(name: str, fields_: tuple[str, ...]) -> type[Diagnostics]:
    return make_dataclass(name, fields_, bases=(Diagnostics,), frozen=True)


def said(diagnostics: Any) -> Iterator[tuple[str, float | str]]:
    """Yield the fields of diagnostics by name, as float where they are numbers or flags, else as text."""
    for name in (field.name for field in fields(diagnostics)):
        value = getattr(diagnostics, name)
        yield name, float(value) if isinstance(value, int | float | np.number | np.bool_) else str(value)
