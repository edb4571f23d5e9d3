"""How a function of arrays becomes a compiled kernel, whose machine code is kept for as long as its sources stay as they are.

numba keeps machine code per file, and takes it as fresh while that file is unchanged.  But kernels of other files are inlined
into it, constants of other files are frozen into it, and its index holds types of other files: after a pull it would run old
code, or fail on a module that has another name by now.  So here the name under which it is kept has a digest of all of that.

Sources are found by their import statements: what a kernel uses, its types included, is imported by its own file, or by one
that this imports, and as `from module import name`.  What was kept for other sources stays on the disk, unused.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

F = TypeVar("F", bound=Callable[..., Any])
FAST = frozenset({"contract", "reassoc", "arcp", "nsz"})  # fast-math flags that leave checks for NaN and infinity alone

_ROOT = Path(__file__).parents[2]
_IMPORT = re.compile(r"^\s*(?:from|import)\s+([\w.]+)", re.MULTILINE)


def kernel(*, inline: bool = False, fast: bool = False, numpy_division: bool = False) -> Callable[[F], F]:
    """Return the decorator that compiles a function at its first call, without the GIL, and keeps its machine code.

    Args:
        inline: whether it is pasted into its callers, in numba's own representation.
        fast: whether sums may be taken in another order (`FAST`).
        numpy_division: whether dividing by zero gives infinity or NaN instead of an error.
    """
    options: dict[str, Any] = {"inline": "always"} if inline else {}
    if fast:
        options["fastmath"] = set(FAST)
    if numpy_division:
        options["error_model"] = "numpy"
    compiled: Callable[[F], F] = numba.njit(cache=True, nogil=True, **options)
    return compiled


def sources_of(path: Path) -> frozenset[Path]:
    """Return a file and all files beside this package that it imports, also by way of others."""
    found, todo = set[Path](), [path]
    while todo:
        source = todo.pop()
        if source not in found:
            found.add(source)
            todo.extend(_imported(source))
    return frozenset(found)


@cache
def digest_of(path: Path) -> str:
    """Return what changes with a file and with all that it imports from here, as hexadecimal digits."""
    digest = hashlib.sha256()
    for source in sorted(sources_of(path)):
        digest.update(source.name.encode() + b"\0" + _hash_of(source))
    return digest.hexdigest()[:16]


@cache
def _imported(source: Path) -> tuple[Path, ...]:
    names = (name.split(".") for name in _IMPORT.findall(source.read_text(encoding="utf-8")))
    modules = (_ROOT.joinpath(*parts) for parts in names if _is_ours(parts[0]))
    files = (path for module in modules for path in (module.with_suffix(".py"), module / "__init__.py"))
    return tuple(path for path in files if path.is_file())


@cache
def _is_ours(package: str) -> bool:
    return (_ROOT / package / "__init__.py").is_file()


@cache
def _hash_of(source: Path) -> bytes:
    return hashlib.sha256(source.read_bytes()).digest()


class _ByDigest:
    """Names what is kept of a function by its line, as numba does, and by the digest of its sources."""

    _py_file: str
    _lineno: int

    def get_disambiguator(self) -> str:
        return f"{self._lineno}-{digest_of(Path(self._py_file).resolve())}"


class InGivenFolder(_ByDigest, UserProvidedCacheLocator):  # type: ignore[misc]
    """Keeps machine code where NUMBA_CACHE_DIR says."""


class BesideSource(_ByDigest, InTreeCacheLocator):  # type: ignore[misc]
    """Keeps machine code in `__pycache__` beside the source."""


class InUsersFolder(_ByDigest, UserWideCacheLocator):  # type: ignore[misc]
    """Keeps machine code in the user's cache folder, where the source's cannot be written to."""


if not numba.config.CACHE_LOCATOR_CLASSES:
    numba.config.CACHE_LOCATOR_CLASSES = ",".join(
        f"{__name__}.{c.__name__}" for c in (InGivenFolder, BesideSource, InUsersFolder)
    )
