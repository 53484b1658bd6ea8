"""Many queries at once, spread over threads: the compiled search holds no lock while it runs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pbpp.geometry import Floats
    from pbpp.partition.flat import Spots

ResultT = TypeVar("ResultT")

_AT_ONCE = 64  # queries that a thread takes at a time: some 2 ms, so that all threads end at about the same time; chosen, not measured


def spread(answer: Callable[[Floats, Spots], ResultT], ends: Floats, spots: Spots) -> Iterator[ResultT]:
    """Yield the answers to pieces of many queries in their order.

    Parameters
    ----------
    answer : callable
        Answers the queries of a piece, with an array like `ends` and their spots.
    ends : (n, 2, 2) array
        Start and goal of each query.
    spots : Spots
        Where they begin and end; `NO_SPOTS` where that is to be looked for.

    Yields
    ------
    result
        What ``answer`` returns for the next piece.
    """
    starts = range(0, len(ends), _AT_ONCE)
    pieces = [ends[first : first + _AT_ONCE] for first in starts]
    spots_of = [spots._replace(of=spots.of[first : first + _AT_ONCE]) for first in starts]
    threads = min(os.cpu_count() or 1, len(pieces))
    if threads < 2:
        yield from map(answer, pieces, spots_of)
        return
    from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415 - most programs need it not, and it takes 3 ms to load

    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(answer, pieces, spots_of)
