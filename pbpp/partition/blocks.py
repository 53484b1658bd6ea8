"""The paper's blocks: free space cut by the vertical and horizontal extension lines of its vertices (section 2.2).

The paper draws rectangles only and leaves open where a line ends and what a slanted edge does. Read here as follows:

- A line ends at the first obstacle or boundary ("the intersection of the line and the boundary"); going on behind the obstacle
  would add blocks and change nothing.
- Every vertex lies on a vertical and on a horizontal line, so no vertex is inside a block and a slanted edge crosses the grid of
  lines as a full chord. What is left of a block is convex: a slab between two horizontal lines.
- The four corners LB, LU, RB, RU become up to six where a slanted edge cuts a block.

So the blocks of one slab are what the horizontal lines HL that cross it leave, stacked from south to north.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

from pbpp.errors import TooManyBlocksError

from .base import TOLERANCE_M, Portals
from .slabs import Slabs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry import Polygon

    from pbpp.geometry import Floats, Point

    from .vertices import Ints

MAX_BLOCKS = 200_000
"""More blocks than this are refused: they grow much faster than the vertices, and nothing is gained."""


class Blocks:
    """The block partition of free space.

    Parameters
    ----------
    polygons : sequence of shapely.Polygon
        Disjoint polygons, metres from the scene's origin.
    slabs : Slabs, optional
        Their slabs, if they are there already.

    Raises
    ------
    TooManyBlocksError
        If there would be more than `MAX_BLOCKS`.
    """

    name = "blocks"

    def __init__(self, polygons: Sequence[Polygon], slabs: Slabs | None = None) -> None:
        self.slabs = slabs if slabs is not None else Slabs(polygons)
        swapped = [shapely.transform(one, lambda points: points[:, ::-1]) for one in polygons]
        self._across = Slabs(swapped)
        cuts = self._cuts()
        counts = np.array([len(one) for one in cuts], dtype=np.intp) + 1
        self._first: Ints = np.concatenate(([0], np.cumsum(counts)))
        self._slab: Ints = np.repeat(np.arange(len(counts)), counts)
        low, high = self.slabs.north_range
        self._south = np.concatenate([np.append(bottom, cut) for bottom, cut in zip(low, cuts, strict=True)])
        self._north = np.concatenate([np.append(cut, top) for top, cut in zip(high, cuts, strict=True)])

    def __len__(self) -> int:
        return len(self._slab)

    @cached_property
    def vertical_lines(self) -> Floats:
        """VL, (p, 2, 2) array: the pieces of vertical extension lines between vertices and edges."""
        return self.slabs.portals.ends_m

    @cached_property
    def horizontal_lines(self) -> Floats:
        """HL, (q, 2, 2) array: the pieces of horizontal extension lines between vertices and edges."""
        return self._across.portals.ends_m[:, :, ::-1]

    @cached_property
    def obstacle_vertices(self) -> Floats:
        """V_ob, (n, 2) array: the vertices of free space."""
        return self.slabs.vertices.points

    @cached_property
    def intersections(self) -> Floats:
        """V_intersect, (m, 2) array: where vertical and horizontal lines cross."""
        return np.array([(point[0], point[1]) for _, _, point in self.diagonals]).reshape(-1, 2)[::2]

    @cached_property
    def centers(self) -> Floats:
        """CP, (b, 2) array: the middle of each block, half way up on the middle of its chord."""
        height = 0.5 * (self._south + self._north)
        west, east = self.slabs.chord(self._slab, height)
        return np.column_stack((0.5 * (west + east), height))

    def outline(self, block: int) -> Floats:
        """Return the corners of a block, (3 to 6, 2) array, counter-clockwise, metres from the scene's origin."""
        south, north = float(self._south[block]), float(self._north[block])
        slab = self.slabs.outline(int(self._slab[block]))
        # The corners between the cuts, and the ends of the two cuts, in order around the middle.
        kept = slab[(slab[:, 1] > south + TOLERANCE_M) & (slab[:, 1] < north - TOLERANCE_M)]
        ends = []
        for height in (south, north):
            west, east = self.slabs.chord(self._slab[block : block + 1], np.array([height]))
            ends += [(west[0], height), (east[0], height)]
        corners = np.unique(np.concatenate((kept, np.array(ends))), axis=0)
        from_middle = corners - corners.mean(axis=0)
        return np.asarray(
            corners[np.argsort(np.arctan2(from_middle[:, 1], from_middle[:, 0]), kind="stable")]
        )

    def corners(self, block: int) -> tuple[Point, Point, Point, Point]:
        """Return LB, LU, RB, RU of the smallest upright rectangle around a block: the block itself if no edge is slanted."""
        west, south = self.outline(block).min(axis=0).tolist()
        east, north = self.outline(block).max(axis=0).tolist()
        return (west, south), (west, north), (east, south), (east, north)

    def locate(self, point: Point) -> list[int]:
        """Return the blocks that a point lies in or on the edge of, in rising order."""
        found: list[int] = []
        for slab in self.slabs.locate(point):
            first, last = int(self._first[slab]), int(self._first[slab + 1])
            inside = (self._south[first:last] <= point[1] + TOLERANCE_M) & (
                self._north[first:last] >= point[1] - TOLERANCE_M
            )
            found += (first + np.flatnonzero(inside)).tolist()
        return found

    @cached_property
    def portals(self) -> Portals:
        """The edges that neighbouring blocks share, the horizontal ones first."""
        stacked = np.flatnonzero(self._slab[1:] == self._slab[:-1])
        height = self._north[stacked]
        west, east = self.slabs.chord(self._slab[stacked], height)
        wide = east - west > TOLERANCE_M
        ends = np.stack((np.column_stack((west, height)), np.column_stack((east, height))), axis=1)[wide]
        pairs = np.column_stack((stacked, stacked + 1))[wide]
        blocks_beside, ends_beside, _ = self._beside
        return Portals(np.concatenate((pairs, blocks_beside)), np.concatenate((ends, ends_beside)))

    @cached_property
    def diagonals(self) -> list[tuple[int, int, Point]]:
        """The pairs of blocks that share only a corner, with that corner.

        The corner is a crossing of lines, so it is not in V_ob: the paper's rule for exploring a diagonal block (section 3.2).
        """
        blocks, ends, follows = self._beside
        found: list[tuple[int, int, Point]] = []
        for upper in np.flatnonzero(follows).tolist():
            (west, east), (west_above, east_above) = blocks[upper - 1].tolist(), blocks[upper].tolist()
            corner = (float(ends[upper, 0, 0]), float(ends[upper, 0, 1]))
            found += [(west, east_above, corner), (west_above, east, corner)]
        return found

    @cached_property
    def _beside(self) -> tuple[Ints, Floats, npt.NDArray[np.bool_]]:
        """Portals on vertical lines, and which of them begin where the one before ends, at a crossing with a horizontal line."""
        portals = self.slabs.portals
        pairs: list[Ints] = []
        ends: list[Floats] = []
        follows: list[bool] = []
        for (west, east), (low, high) in zip(portals.blocks.tolist(), portals.ends_m, strict=True):
            cuts = self._north[self._first[west] : self._first[west + 1] - 1]
            inner = cuts[(cuts > low[1] + TOLERANCE_M) & (cuts < high[1] - TOLERANCE_M)]
            norths = np.concatenate(([low[1]], inner, [high[1]]))
            middles = 0.5 * (norths[:-1] + norths[1:])
            pairs.append(np.column_stack((self._within(west, middles), self._within(east, middles))))
            easts = np.full(len(middles), low[0])
            ends.append(
                np.stack(
                    (np.column_stack((easts, norths[:-1])), np.column_stack((easts, norths[1:]))), axis=1
                )
            )
            follows += [False] + [True] * len(inner)
        if not pairs:
            return np.empty((0, 2), dtype=np.intp), np.empty((0, 2, 2)), np.empty(0, dtype=bool)
        return np.concatenate(pairs), np.concatenate(ends), np.array(follows)

    def _within(self, slab: int, norths: Floats) -> Ints:
        first, last = int(self._first[slab]), int(self._first[slab + 1])
        return first + np.searchsorted(self._north[first : last - 1], norths)

    def _cuts(self) -> list[Floats]:
        """Return the norths at which horizontal lines cross each slab, rising."""
        lines = self._across.portals.ends_m  # (q, 2, 2): north, east
        order = np.argsort(lines[:, 0, 0], kind="stable")
        north, west_end, east_end = lines[order, 0, 0], lines[order, 0, 1], lines[order, 1, 1]
        low, high = self.slabs.north_range
        first = np.searchsorted(north, low + TOLERANCE_M)
        last = np.searchsorted(north, high - TOLERANCE_M)
        cuts: list[Floats] = []
        total = len(self.slabs)
        for slab, (begin, end) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
            heights = north[begin:end]
            west, east = self.slabs.chord(np.full(len(heights), slab), heights)
            middle = 0.5 * (west + east)
            heights = heights[(west_end[begin:end] < middle) & (east_end[begin:end] > middle)]
            heights = heights[np.diff(heights, prepend=-np.inf) > TOLERANCE_M]
            cuts.append(heights)
            total += len(heights)
            if total > MAX_BLOCKS:
                raise TooManyBlocksError(total, MAX_BLOCKS)
        return cuts
