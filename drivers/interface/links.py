"""What several devices of one robot share: one camera process for depth and IMU, one autopilot link for base and IMU."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar, cast


class Openable(Protocol):
    """Anything with a life."""

    def open(self) -> None:
        """Connect."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


T = TypeVar("T", bound=Openable)


class _Shared(Generic[T]):
    """One shared object and how many hold it open."""

    def __init__(self, it: T) -> None:
        self.it = it
        self.users = 0


class Lease(Generic[T]):
    """One device's hold on a shared object: the first to open it opens it, the last to close it closes it."""

    def __init__(self, shared: _Shared[T]) -> None:
        """Hold it, not yet open."""
        self._shared = shared
        self._held = False

    @property
    def it(self) -> T:
        """The shared object."""
        return self._shared.it

    @property
    def held(self) -> bool:
        """Whether this device holds it open."""
        return self._held

    def open(self) -> None:
        """Open it, unless another device has already; again by the same device does nothing.  Raises what its `open` raises."""
        if self._held:
            return
        if not self._shared.users:
            self._shared.it.open()
        self._shared.users += 1
        self._held = True

    def close(self) -> None:
        """Let go of it; when no other device holds it, it is closed."""
        if not self._held:
            return
        self._held = False
        self._shared.users -= 1
        if not self._shared.users:
            self._shared.it.close()


class Links:
    """The shared objects of one robot, by a key that says which wire it is.

    >>> class Wire:
    ...     def open(self): print("opened")
    ...     def close(self): print("closed")
    >>> links = Links()
    >>> depth, imu = (links.get("camera 815412070000", Wire) for _ in range(2))
    >>> depth.it is imu.it
    True
    >>> depth.open(); imu.open(); depth.close(); depth.close(); imu.close()
    opened
    closed
    """

    def __init__(self) -> None:
        """Start with none."""
        self._shared: dict[str, _Shared[Any]] = {}

    def get(self, key: str, make: Callable[[], T]) -> Lease[T]:
        """Return a lease on the object under a key; `make` is called by the first who asks."""
        shared = self._shared.get(key)
        if shared is None:
            shared = self._shared[key] = _Shared(make())
        return Lease(cast(_Shared[T], shared))
