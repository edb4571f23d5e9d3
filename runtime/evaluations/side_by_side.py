"""Work that does not depend on each other, done in processes of its own."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from typing import TypeVar

from drivers.io.parent import end_with_parent
from runtime.evaluations.journal import Journal

C = TypeVar("C", bound=Hashable)
R = TypeVar("R")


def _nothing() -> None:
    pass


@dataclass(frozen=True, slots=True)
class Workers:
    """Who does the work: how many at a time, who hears of each end, and where results are kept as they come."""

    jobs: int = 1
    done: Callable[[], None] = _nothing
    journal: Journal | None = None


def side_by_side(todo: tuple[C, ...], work: Callable[[C], R], workers: Workers) -> dict[C, R]:
    """Do `work`, a function of a module with an annotated result, for all cases that the journal does not know yet.

    The result is in the order of the cases and does not depend on which came first.

    Raises:
        ConfigurationError: a result of the journal is not one of `work`, or it cannot be written any more.
    """
    results = {} if workers.journal is None else workers.journal.known(todo, work)
    for _ in results:
        workers.done()
    for case, result in _each(tuple(case for case in todo if case not in results), work, workers.jobs):
        results[case] = result
        if workers.journal is not None:
            workers.journal.add(case, result)
        workers.done()
    return {case: results[case] for case in todo}


def _each(todo: tuple[C, ...], work: Callable[[C], R], jobs: int) -> Iterator[tuple[C, R]]:
    if jobs == 1:
        yield from ((case, work(case)) for case in todo)
        return
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core a process: more threads would only push each other aside
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_begin) as pool:
        futures = {pool.submit(work, case): case for case in todo}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _begin() -> None:
    """End when the evaluation is killed, instead of running on with nobody to take the result; and keep to one core."""
    end_with_parent()
    started_by = parent_process()
    if started_by is None or not started_by.is_alive():
        sys.exit("the evaluation ended before its worker began")
    _on_one_core()


def _on_one_core() -> None:
    """Keep OpenCV, which no variable of the environment tells, to the worker's own core, and look for garbage less often.

    Runs leave little that only the collector finds; looking for it at Python's own pace takes 3 % of their time.
    """
    import cv2  # noqa: PLC0415 - in the worker process, not in the one that hands out the work

    cv2.setNumThreads(1)
    gc.set_threshold(50_000, 20, 50)
