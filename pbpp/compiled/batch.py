"""Many queries at once, spread over threads: the compiled search holds no lock while it runs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pbpp.geometry import Floats

ResultT = TypeVar("ResultT")

_AT_ONCE = 64  # queries that a thread takes at a time: some 2 ms, so that all threads end at about the same time; chosen, not measured


def spread(answer: Callable[[Floats], ResultT], ends: Floats) -> Iterator[ResultT]:
    """Yield the answers to pieces of many queries in their order.

    Parameters
    ----------
    answer : callable
        Answers the queries of a piece, an array like `ends`.
    ends : (n, 2, 2) array
        Start and goal of each query.

    Yields
    ------
    result
        What ``answer`` returns for the next piece.
    """
    pieces = [ends[first : first + _AT_ONCE] for first in range(0, len(ends), _AT_ONCE)]
    threads = min(os.cpu_count() or 1, len(pieces))
    if threads < 2:
        yield from map(answer, pieces)
        return
    from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415 - most programs need it not, and it takes 3 ms to load

    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(answer, pieces)
