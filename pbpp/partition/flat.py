"""Slabs as arrays: what the compiled sweep writes and the compiled search reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Callable

    from pbpp.geometry import Floats, Point

    from .places import Places
    from .vertices import Ints, Vertices

__all__ = [
    "BLOCK",
    "CORNER",
    "PORTAL",
    "WAY",
    "Answer",
    "Engine",
    "FlatSearch",
    "FlatSlabs",
    "Records",
    "record",
]

Records = npt.NDArray[Any]
"""An array of records: numba reads their fields as attributes."""


def record(metres: str, indices: str) -> np.dtype[np.void]:
    """Return the type of records with so named fields: lengths and slopes, then indices."""
    return np.dtype(
        [*((name, np.float64) for name in metres.split()), *((name, np.int64) for name in indices.split())],
    )


BLOCK = record("west east", "floor ceiling")
PORTAL = record("east low high", "low_end high_end west_block east_block")
WAY = record("east south north", "low_end high_end block")
CORNER = record(
    "x y before_east before_north after_east after_north",
    "west_above west_below east_above east_below above below",
)


class FlatSlabs(NamedTuple):
    """Slabs as arrays.

    Parameters
    ----------
    blocks : (b,) array of records
        East of each block's west and east side in metres, and the vertices that its floor and its ceiling start at.
    portals : (p,) array of records
        East, low and high north of each portal in metres, its low and its high vertex, and the blocks west and east of it.
    first : (2, b + 1) array of int
        Where the ways of each block begin, westwards and eastwards.
    ways : (2, p) array of records
        East, low and high north of each portal in metres, its low and its high vertex and the block behind it.
    corners : (n,) array of records
        Of each vertex east and north, the way to the vertex before it and to the one after it in metres, the blocks around it and the corners
        straight above and straight below it.
    """

    blocks: Records
    portals: Records
    first: Ints
    ways: Records
    corners: Records


class Answer(NamedTuple):
    """A shortest path.

    Parameters
    ----------
    turns : (n, 2) array
        Start, all points that the path turns at or passes straight, goal: east and north in metres on the map.
    points : (m, 2) array
        The same without those on the straight way between their neighbours.
    length_m : float
        The length of the latter in metres.
    expanded : int
        How many nodes were taken from the queue.
    """

    turns: Floats
    points: Floats
    length_m: float
    expanded: int


class FlatSearch(Protocol):
    """The search over flat slabs; the methods of `pbpp.compiled.search.Searcher`."""

    def search(
        self,
        start: Point,
        goal: Point,
        ends: tuple[list[int], list[int], list[int]],
        should_stop: Callable[[], bool] | None,
    ) -> tuple[list[int] | None, float, int, bool]:
        """Return the shortest path between two points of free space, wherever in it they lie."""

    def direct(self, start: Point, goal: Point, origin_m: Floats) -> Answer | None:
        """Return the shortest path between two points that lie well inside of one block each."""

    def answers(self, ends: Floats, origin_m: Floats) -> list[Answer | None]:
        """Return the paths of many queries as `direct` does."""

    def lengths_m(
        self, ends: Floats, origin_m: Floats, should_stop: Callable[[], bool] | None = None
    ) -> Floats:
        """Return the lengths of the paths of many queries."""


class Engine(NamedTuple):
    """What makes flat slabs and searches them: `pbpp.compiled`, which stands on this room.

    Parameters
    ----------
    sweep : callable
        Returns the slabs of free space with the given vertices.
    searcher : callable
        Returns the search over them.
    """

    sweep: Callable[[Vertices], FlatSlabs]
    searcher: Callable[[FlatSlabs, Vertices, Places], FlatSearch]
