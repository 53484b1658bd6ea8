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
    from .window import Patch, Window

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


_BESIDE = ("west_above", "west_below", "east_above", "east_below")


def _longer(records: Records, length: int) -> Records:
    """Return a copy with room for more at the end, made as one of numbers: numpy copies records field by field, ten times as slowly."""
    longer = np.empty((*records.shape[:-1], length), records.dtype)
    width = records.dtype.itemsize // 8 * records.shape[-1]
    longer.view(np.int64)[..., :width] = records.view(np.int64)
    return longer


class FlatSlabs(NamedTuple):
    """Slabs as arrays.

    Parameters
    ----------
    blocks : (b,) array of records
        East of each block's west and east side in metres, and the vertices that its floor and its ceiling start at.
    portals : (p,) array of records
        East, low and high north of each portal in metres, its low and its high vertex, and the blocks west and east of it.
    first, last : (2, b) array of int
        Where the ways of each block begin and end, westwards and eastwards.
    ways : (2, p) array of records
        East, low and high north of each portal in metres, its low and its high vertex and the block behind it.
    corners : (n,) array of records
        Of each vertex east and north, the way to the vertex before it and to the one after it in metres, the blocks around it and the corners
        straight above and straight below it.
    ends_with : (k,) array of int
        The blocks that are open at the end of the sweep: of a whole free space none.
    """

    blocks: Records
    portals: Records
    first: Ints
    last: Ints
    ways: Records
    corners: Records
    ends_with: Ints

    def patched(self, patch: Patch, part: FlatSlabs) -> FlatSlabs:
        """Return a copy with a window of it replaced; it can be searched, its portals are those of the window."""
        count, names = len(patch.blocks.west), patch.window.names
        blocks = np.empty(count, BLOCK)
        for name, column in patch.blocks._asdict().items():
            blocks[name] = column
        old, there = self.ways.shape[1], patch.window.order
        first, last = (np.zeros((2, count), np.int64) for _ in range(2))
        first[:, : len(self.blocks)], last[:, : len(self.blocks)] = self.first, self.last
        first[:, patch.dead] = last[:, patch.dead] = 0
        ways = _longer(self.ways, old + part.ways.shape[1])
        ways[:, old:] = part.ways
        ways["block"][:, old:] = patch.numbers[part.ways["block"]]
        corners = _longer(self.corners, max(int(names.max()) + 1, len(self.corners)))
        around = part.corners[there]
        for name in _BESIDE:
            around[name] = np.where(around[name] >= 0, patch.numbers[around[name]], around[name])
        corners[names[there]] = around
        for was, now, vertices in patch.moved:
            first[1, now], last[1, now] = self.first[1, was], self.last[1, was]
            for other in ways["block"][1, first[1, now] : last[1, now]].tolist():
                behind = ways["block"][0, first[0, other] : last[0, other]]
                behind[behind == was] = now
            for name in _BESIDE[:2]:
                beside = corners[name][vertices]
                corners[name][vertices] = np.where(beside == was, now, beside)
        for direction, changes in enumerate((patch.is_new, patch.is_closed)):
            first[direction, patch.numbers[changes]] = old + part.first[direction, changes]
            last[direction, patch.numbers[changes]] = old + part.last[direction, changes]
        return FlatSlabs(blocks, part.portals, first, last, ways, corners, self.ends_with)


class DirectPath(NamedTuple):
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

    def direct(self, start: Point, goal: Point, origin_m: Floats) -> DirectPath | None:
        """Return the shortest path between two points that lie well inside of one block each."""

    def answers(self, ends: Floats, origin_m: Floats) -> list[DirectPath | None]:
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
        Returns the slabs of free space with the given vertices, or of a window of it.
    searcher : callable
        Returns the search over them.
    """

    sweep: Callable[[Vertices | Window], FlatSlabs]
    searcher: Callable[[FlatSlabs, Vertices, Places], FlatSearch]
