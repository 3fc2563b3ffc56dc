"""Chunks of blocks, done in order or side by side: their borders are fixed, so who does them changes no number."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Self, TypeVar

Hand = TypeVar("Hand")
Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 2
"""Chunks of each thread that may be done or under way before their results are requested."""

MOST_THREADS = 8
"""What is left in Python would have more of them wait for each other."""


def threads_for(workers: int | None, chunks: int) -> int:
    """How many threads do so many chunks. workers : as asked for; None: one for each core that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(workers or cores, MOST_THREADS, chunks))


def in_order(
    work: Callable[[Hand, Item], Result], items: Iterable[Item], hands: Sequence[Hand]
) -> Generator[Result]:
    """`work(hand, item)` of every item, in the order of the items.

    hands : what a thread works with and no other one at the same time. With one of them everything happens in the thread of
    the caller, when it asks; with more each has a thread, and kernels, which release the interpreter, run side by side.
    An exception of an item is raised in its turn. Closing the iterator waits for the items under way.
    """
    if len(hands) == 1:
        yield from (work(hands[0], item) for item in items)
        return
    free: SimpleQueue[Hand] = SimpleQueue()
    for hand in hands:
        free.put(hand)

    def done(item: Item) -> Result:
        hand = free.get()
        try:
            return work(hand, item)
        finally:
            free.put(hand)

    waiting: deque[Future[Result]] = deque()
    pool = ThreadPoolExecutor(len(hands), thread_name_prefix="chunks")
    try:
        for item in items:
            waiting.append(pool.submit(done, item))
            if len(waiting) >= AHEAD * len(hands):
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)


class Beside:
    """Runs work in a second thread until its result is needed; with one thread, when the result is needed.

    Leaving the `with` waits for work in progress.
    """

    def __init__(self, threads: int) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="beside") if threads > 1 else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def later(self, work: Callable[[], Result]) -> Callable[[], Result]:
        """What gives the result of `work`, or raises; called once."""
        return work if self._pool is None else self._pool.submit(work).result
