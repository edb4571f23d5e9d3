"""A thread that calls one function after the other, and that nobody ever has to wait for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Generic, TypeVar

T = TypeVar("T")


class Background(Generic[T]):
    """Like an executor with one worker, but a call that hangs does not keep the process from ending."""

    def __init__(self, name: str) -> None:
        """Start the thread; it waits for work."""
        self._work: SimpleQueue[tuple[Future[T], Callable[[], T]] | None] = SimpleQueue()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def submit(self, call: Callable[[], T]) -> Future[T]:
        """Have it called; the future holds what it returns or raises."""
        future: Future[T] = Future()
        self._work.put((future, call))
        return future

    def close(self) -> None:
        """End the thread after the call that it is in."""
        self._work.put(None)

    def _run(self) -> None:
        while (item := self._work.get()) is not None:
            future, call = item
            try:
                future.set_result(call())
            except BaseException as error:  # noqa: BLE001 - it belongs to whoever asks for the result
                future.set_exception(error)
