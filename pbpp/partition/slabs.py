"""Slabs: the paper's blocks merged along the vertical, which leaves O(n) of them.

Only the vertical extension lines VL of the paper (section 2.2) are drawn: from every vertex up and down to the first obstacle or
boundary. What lies between two neighbouring lines, a floor edge and a ceiling edge is one block, a trapezoid. All portals are
pieces of vertical lines, which is what makes the exact search in `pbpp.any_angle` cheap.

One sweep from west to east keeps the open blocks in their order from south to north. Vertices on one vertical line (rectilinear maps
have many) are taken together, so no block has zero width. A vertex where two obstacles touch splits free space there: its rings are
linked anew, so that each of its free fans is a vertex of its own.
"""

from __future__ import annotations

from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from .base import TOLERANCE_M, Portals
from .places import Places
from .sweep import Sweep
from .vertices import Ints, Vertices

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry import Polygon

    from pbpp.geometry import Floats, Point

    from .flat import Engine, FlatSearch, FlatSlabs

__all__ = ["Slabs"]


class Slabs:
    """The slab partition of free space.

    Parameters
    ----------
    polygons : sequence of shapely.Polygon
        Disjoint polygons, metres from the scene's origin.

    engine : Engine, optional
        The compiled sweep and search; they give the same.

    Attributes
    ----------
    vertices : Vertices
        Of free space.
    swept : Sweep or FlatSlabs
        What the search reads: lists, or arrays if compiled.
    """

    name = "slabs"

    def __init__(self, polygons: Sequence[Polygon], engine: Engine | None = None) -> None:
        self.vertices = Vertices(polygons)
        self.swept: Sweep | FlatSlabs
        self._engine = engine
        if engine is not None:
            self.swept = flat = engine.sweep(self.vertices)
            self._floor, self._ceiling = flat.blocks["floor"], flat.blocks["ceiling"]
            self._west, self._east = flat.blocks["west"], flat.blocks["east"]
        else:
            self.swept = lists = Sweep(self.vertices)
            lists.run()
            self._floor = np.array(lists.floor, dtype=np.intp)
            self._ceiling = np.array(lists.ceiling, dtype=np.intp)
            self._west = np.array(lists.west)
            self._east = np.array(lists.east)

    def __len__(self) -> int:
        return len(self._west)

    @cached_property
    def _sides(self) -> tuple[Floats, Floats, Floats, Floats]:
        """North of floor west, floor east, ceiling west, ceiling east of each block."""
        return (
            self._edge_north(self._floor, self._west),
            self._edge_north(self._floor, self._east),
            self._edge_north(self._ceiling, self._west),
            self._edge_north(self._ceiling, self._east),
        )

    def _edge_north(self, edge: Ints, east: Floats) -> Floats:
        """Return the north of edges at given easts, exact at their ends."""
        v = self.vertices
        first, second = edge, v.next[edge]
        swap = v.x[first] > v.x[second]
        first, second = np.where(swap, second, first), np.where(swap, first, second)
        share = (east - v.x[first]) / (v.x[second] - v.x[first])
        north = v.y[first] + share * (v.y[second] - v.y[first])
        return np.where(share >= 1.0, v.y[second], north)

    @property
    def area_m2(self) -> float:
        """Sum of the areas of all blocks in square metres."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        heights = (ceiling_west - floor_west) + (ceiling_east - floor_east)
        return float(0.5 * np.dot(heights, self._east - self._west))

    @property
    def north_range(self) -> tuple[Floats, Floats]:
        """Lowest and highest north of each block."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        return np.minimum(floor_west, floor_east), np.maximum(ceiling_west, ceiling_east)

    @cached_property
    def centers(self) -> Floats:
        """CP, (b, 2) array: the middle of each block."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        north = 0.25 * (floor_west + floor_east + ceiling_west + ceiling_east)
        return np.column_stack((0.5 * (self._west + self._east), north))

    def chord(self, block: Ints, north: Floats) -> tuple[Floats, Floats]:
        """Return the west and east ends of blocks' horizontal chords at given norths."""
        west, east = self._west[block].copy(), self._east[block].copy()
        floor_west, floor_east, ceiling_west, ceiling_east = (side[block] for side in self._sides)
        for at_west, at_east, above in ((floor_west, floor_east, True), (ceiling_west, ceiling_east, False)):
            rise = at_east - at_west
            slanted = np.abs(rise) > TOLERANCE_M
            share = np.divide(north - at_west, rise, out=np.zeros_like(north), where=slanted)
            cross = self._west[block] + np.clip(share, 0.0, 1.0) * (self._east[block] - self._west[block])
            # Above a rising floor, and below a falling ceiling, lies the west; else the east.
            ends_east = slanted & ((rise > 0.0) == above)
            east = np.where(ends_east, np.minimum(east, cross), east)
            west = np.where(slanted & ~ends_east, np.maximum(west, cross), west)
        return west, east

    @property
    def least_height_m(self) -> float:
        """The least height of any side of a block in metres: 0 but for rounding."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        heights = np.concatenate((ceiling_west - floor_west, ceiling_east - floor_east))
        return float(heights.min(initial=0.0))

    @property
    def unjoined_m(self) -> float:
        """How much of the blocks' sides is neither portal nor vertical boundary in metres, at least: 0 but for rounding.

        Less than nothing where a portal leads through a boundary.
        """
        v = self.vertices
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        sides_m = float((ceiling_west - floor_west).sum() + (ceiling_east - floor_east).sum())
        upright_m = float(np.abs(v.y[v.next] - v.y)[v.x[v.next] == v.x].sum())
        return sides_m - upright_m - 2.0 * self._portals_m

    @property
    def _portals_m(self) -> float:
        """Sum of the lengths of all portals in metres."""
        portals = self.swept.portals
        # Added up in one order, so that both sweeps pass the check or none does.
        if isinstance(portals, list):
            length_m: float = sum(map(itemgetter(2), portals)) - sum(map(itemgetter(1), portals))
        else:
            length_m = sum(portals["high"].tolist()) - sum(portals["low"].tolist())
        return length_m

    @cached_property
    def portals(self) -> Portals:
        """The portals between blocks."""
        portals = self.swept.portals
        if isinstance(portals, list):
            rows = np.array(portals, dtype=np.float64).reshape(-1, 5)
            east, low, high = rows[:, :3].T
            blocks = rows[:, 3:].astype(np.intp)
        else:
            east, low, high = portals["east"], portals["low"], portals["high"]
            blocks = np.column_stack((portals["west_block"], portals["east_block"]))
        ends = np.stack((np.column_stack((east, low)), np.column_stack((east, high))), axis=1)
        return Portals(blocks, ends)

    def outline(self, block: int) -> Floats:
        """Return the corners of a block, (3 or 4, 2) array, counter-clockwise, metres from the scene's origin."""
        floor_west, floor_east, ceiling_west, ceiling_east = (float(side[block]) for side in self._sides)
        west, east = float(self._west[block]), float(self._east[block])
        corners = [(west, floor_west), (east, floor_east)]
        if ceiling_east > floor_east:
            corners.append((east, ceiling_east))
        if ceiling_west > floor_west:
            corners.append((west, ceiling_west))
        return np.array(corners)

    @cached_property
    def places(self) -> Places:
        """Where points lie among the blocks."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        height_m = np.maximum(ceiling_west - floor_west, ceiling_east - floor_east)
        return Places(self.vertices, (self._floor, self._ceiling), (self._west, self._east), height_m)

    @cached_property
    def searcher(self) -> FlatSearch | None:
        """The compiled search over them; None if they were swept plainly."""
        if self._engine is None or isinstance(self.swept, Sweep):
            return None
        return self._engine.searcher(self.swept, self.vertices, self.places)

    def locate(self, point: Point) -> list[int]:
        """Return the blocks that a point lies in or on the edge of, in rising order."""
        return self.places.locate(point)

    def components(self, blocks: Sequence[int]) -> frozenset[int]:
        """Return the polygons that blocks lie in, by their place among those the slabs were made of."""
        return self.places.components(blocks)

    def line_neighbours(self, point: Point, block: int) -> list[tuple[int, bool]]:
        """Return the vertices next to a point on the side line of a block that it stands on.

        Parameters
        ----------
        point : (east, north)
            A point in the block or on its edge, metres from the scene's origin.
        block : int
            The block.

        Returns
        -------
        list of (vertex, upwards)
            The corners at the nearest place above and at the nearest place below; none if the point stands on neither side line.
        """
        v = self.vertices
        east, north = point
        found: list[tuple[int, bool]] = []
        floor_west, floor_east, ceiling_west, ceiling_east = (float(side[block]) for side in self._sides)
        for side, low, high in (
            (float(self._west[block]), floor_west, ceiling_west),
            (float(self._east[block]), floor_east, ceiling_east),
        ):
            if abs(side - east) > TOLERANCE_M:
                continue
            line = int(np.searchsorted(v.line_x, side))
            there = v.order[v.line_start[line] : v.line_start[line + 1]]
            there = there[v.corner[there] & (v.y[there] >= low) & (v.y[there] <= high)]
            up = there[v.y[there] > north + TOLERANCE_M]
            down = there[v.y[there] < north - TOLERANCE_M]
            found += [(int(one), True) for one in up[v.y[up] == v.y[up].min()]] if len(up) else []
            found += [(int(one), False) for one in down[v.y[down] == v.y[down].max()]] if len(down) else []
        return found
