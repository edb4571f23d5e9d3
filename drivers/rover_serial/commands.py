"""The command protocol: one command at a time, asked again until it is acknowledged.

Source: MAVLink, Command Protocol: a sender repeats a command with a higher confirmation number when no acknowledgement comes.
"""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

ANSWER_NS = 400_000_000
TRIES = 5


class Result(enum.IntEnum):
    """MAV_RESULT, and our own for no answer."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    SILENCE = 255

    @classmethod
    def of(cls, number: int) -> Result:
        """Return the result with a number; one that we do not know is a failure."""
        return cls(number) if number in {result.value for result in cls} else cls.FAILED

    @property
    def words(self) -> str:
        """How a sentence says it."""
        return "was not answered" if self is Result.SILENCE else f"was {self.name.lower().replace('_', ' ')}"


@dataclass(slots=True)
class _Asked:
    command: int
    parameters: tuple[float, ...]
    then: Callable[[Result], None]
    sent: int = 0
    due_ns: int = 0


class Commands:
    """A queue of commands."""

    def __init__(self, send: Callable[[int, int, tuple[float, ...]], None]) -> None:
        """Take what sends a command: `send(command, confirmation, parameters)`."""
        self._send = send
        self._queue: deque[_Asked] = deque()

    @property
    def idle(self) -> bool:
        """Whether everything has been answered."""
        return not self._queue

    def ask(self, command: int, parameters: tuple[float, ...], then: Callable[[Result], None]) -> None:
        """Ask for something after all that was asked before; `then` is told what came of it."""
        self._queue.append(_Asked(command, parameters, then))

    def forget(self) -> None:
        """Ask for nothing any more."""
        self._queue.clear()

    def acknowledged(self, command: int, result: Result, now_ns: int) -> None:
        """Take in an acknowledgement."""
        asked = self._queue[0] if self._queue else None
        if asked is None or asked.command != command or not asked.sent:
            return
        if result is Result.IN_PROGRESS:
            asked.due_ns = now_ns + TRIES * ANSWER_NS
            return
        self._queue.popleft()
        asked.then(result)

    def step(self, now_ns: int) -> None:
        """Send what is due."""
        while self._queue:
            asked = self._queue[0]
            if asked.sent and now_ns < asked.due_ns:
                return
            if asked.sent == TRIES:
                self._queue.popleft()
                asked.then(Result.SILENCE)
                continue
            self._send(asked.command, asked.sent, asked.parameters)
            asked.sent += 1
            asked.due_ns = now_ns + ANSWER_NS
            return
