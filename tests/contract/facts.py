"""What the contract suite compares by: every bit of a value, every array in it, every compiled signature."""

import math
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

OURS = ("drivers", "estimators", "planners", "sim_drivers")


def parts_of(value: Any) -> tuple[Any, ...]:
    """Return what a record or a sequence consists of; nothing for a leaf."""
    if is_dataclass(value):
        return tuple(getattr(value, field.name) for field in fields(value))
    return tuple(value) if isinstance(value, tuple | list) else ()


def leaves(value: Any) -> Iterator[Any]:
    """Yield every array, number and text in a value, depth first."""
    if is_dataclass(value) or isinstance(value, tuple | list):
        for part in parts_of(value):
            yield from leaves(part)
    else:
        yield value


def arrays(value: Any) -> list[np.ndarray]:
    return [leaf for leaf in leaves(value) if isinstance(leaf, np.ndarray)]


def all_finite(value: Any) -> bool:
    numbers = [leaf for leaf in leaves(value) if isinstance(leaf, np.ndarray | float)]
    return all(bool(np.isfinite(number).all()) for number in numbers)


def facts(value: Any) -> Any:
    """Return something that compares equal exactly when two values are the same to the bit (a NaN equals itself)."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, float):
        return "nan" if math.isnan(value) else value.hex()
    if is_dataclass(value) or isinstance(value, tuple | list):
        return type(value).__name__, *(facts(part) for part in parts_of(value))
    return value


def _kernels() -> dict[str, Dispatcher]:
    modules = [module for name, module in sys.modules.items() if name.partition(".")[0] in OURS]
    kernels = [value for module in modules for value in vars(module).values() if isinstance(value, Dispatcher)]
    return {f"{kernel.__module__}.{kernel.__name__}": kernel for kernel in kernels}


def forget_kernels() -> None:
    """Make every kernel as uncompiled as it is at start-up; what is cached on disk is only loaded again."""
    for kernel in _kernels().values():
        kernel._reset_overloads()


def signatures() -> set[tuple[str, str]]:
    """Return every kernel with every signature that it is ready for, compiled now or loaded from the cache."""
    return {(name, str(signature)) for name, kernel in _kernels().items() for signature in kernel.overloads}
