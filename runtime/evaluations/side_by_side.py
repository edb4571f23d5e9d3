"""Work that does not depend on each other, done in processes of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

C = TypeVar("C", bound=Hashable)
R = TypeVar("R")


def side_by_side(todo: tuple[C, ...], work: Callable[[C], R], jobs: int, done: Callable[[C, R], None]) -> dict[C, R]:
    """Do `work`, a function of a module, for all cases, `jobs` at a time; `done` hears of each as it ends.

    The result is in the order of the cases and does not depend on which came first.
    """
    results: dict[C, R] = {}
    for case, result in _each(todo, work, jobs):
        results[case] = result
        done(case, result)
    return {case: results[case] for case in todo}


def _each(todo: tuple[C, ...], work: Callable[[C], R], jobs: int) -> Iterator[tuple[C, R]]:
    if jobs == 1:
        yield from ((case, work(case)) for case in todo)
        return
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core a process: more threads would only push each other aside
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(work, case): case for case in todo}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
