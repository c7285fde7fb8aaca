"""Blocks of a file worked on side by side, and handed on in their order."""

from __future__ import annotations

from collections import deque
from itertools import chain, islice
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

Item = TypeVar("Item")
Done = TypeVar("Done")

MOST_WORKERS = 4
"""Beyond this, reading the file is what takes the time."""


def in_order(work: Callable[[Item], Done], items: Iterable[Item]) -> Iterator[Done]:
    """Do the work of some items at a time, on all processors; a single item needs no thread.

    Memory stays bounded: no more items are taken than there are processors to work on them, and
    one besides.

    Parameters
    ----------
    work : callable
        Spends its time outside the interpreter's lock; no two calls may disturb each other.
    items : iterable
        Taken one after the other by whoever asks for the results.

    Yields
    ------
    object
        What `work` makes of each item, in the order of `items`.
    """
    items = iter(items)
    first = list(islice(items, 2))
    if len(first) < 2:
        yield from map(work, first)
        return
    from concurrent.futures import Future, ThreadPoolExecutor

    import pyarrow as pa

    workers = min(pa.cpu_count(), MOST_WORKERS)  # as many as OMP_NUM_THREADS allows
    waiting: deque[Future[Done]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for item in chain(first, items):
            waiting.append(pool.submit(work, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
