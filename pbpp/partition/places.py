"""Where points lie among slabs, and where the search may start and end."""

from __future__ import annotations

from bisect import bisect_left
from functools import cached_property
from math import dist
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .base import TOLERANCE_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pbpp.geometry import Floats, Point

    from .vertices import Ints, Vertices
    from .window import BlockArrays

_REMEMBERED = 64  # points, as a query asks for its ends again and again; chosen, not measured
_ROUNDINGS = 8.0  # so many last bits of the greatest coordinate a computed distance to an edge may be wrong
_PUSHES = 4  # each twice as far as the one before; chosen, not measured. What still lies on an edge then is taken to its floor


class _Edge(NamedTuple):
    """A floor or a ceiling: its ends from west to east, and its direction."""

    ends: tuple[Point, Point]
    run: float
    rise: float

    def left_of(self, x: float, y: float) -> float:
        """Return how far a point lies to the north side, in metres."""
        (left_x, left_y), _ = self.ends
        return self.run * (y - left_y) - self.rise * (x - left_x)

    def north(self, x: float) -> float:
        """Return the north of the edge at an east, exact at its ends."""
        (left_x, left_y), (right_x, right_y) = self.ends
        return right_y if x >= right_x else left_y + self.rise / self.run * (x - left_x)


class Places:
    """Where points lie among slabs.

    Parameters
    ----------
    vertices : Vertices
        Of free space.
    blocks : BlockArrays
        The blocks.
    height_m : (b,) array
        The greatest height of each block. Those that are closed gaps have no portals: an end in one is in none.

    Attributes
    ----------
    open_east : (b,) array
        East of each block's east side in metres; minus infinity for a closed gap.
    rounding_m : float
        How far from an edge a point is taken to lie beside it for certain.
    """

    def __init__(self, vertices: Vertices, blocks: BlockArrays, height_m: Floats) -> None:
        self._vertices = vertices
        self._floor, self._ceiling, self._west, self._east = blocks
        # The order in which a sweep opens blocks; one over some lines only numbers them in another.
        self._order = np.argsort(self._west, kind="stable")
        self._rising = self._west[self._order]
        self.open_east = np.where(height_m > TOLERANCE_M, self._east, -np.inf)
        self._lines: list[float] = vertices.line_x.tolist()
        self._located: dict[Point, tuple[list[int], bool]] = {}
        bounds_m = float(np.abs(vertices.points).max(initial=1.0))
        self.rounding_m = _ROUNDINGS * float(np.spacing(bounds_m))

    def locate(self, point: Point) -> list[int]:
        """Return the blocks that a point lies in or on the edge of, from west to east and then from south to north."""
        return self._place(point)[0]

    def settle(self, point: Point, tolerance_m: float, components: frozenset[int]) -> Point:
        """Return a point of free space as the search needs it: on the free side of every edge, to the last bit.

        A point that lies beside an edge by a rounding sees the corners at the edge's ends from behind: no path would turn there. The nearer
        it is to the corner, the more.

        Parameters
        ----------
        point : (east, north)
            Metres from the scene's origin.
        tolerance_m : float
            How far from free space it may be.
        components : frozenset of int
            The polygons it may be put in.

        Returns
        -------
        (east, north)
            The point itself if it lies in a block, else one of the nearest block; within `TOLERANCE_M` of a vertex, the vertex.
        """
        vertex = self._vertex_at(point)
        if vertex is not None and int(self._vertices.owner[vertex]) in components:
            return float(self._vertices.x[vertex]), float(self._vertices.y[vertex])
        found, inside = self._place(point)
        if inside and (len(found) == 1 or self.components(found) <= components):
            return point
        blocks, depth_m = self._depths(point, tolerance_m)
        aside_m = np.minimum(point[0] - self._west[blocks], self._east[blocks] - point[0])
        off_m = np.minimum(depth_m, aside_m)
        off_m[~np.isin(self._vertices.owner[self._floor[blocks]], list(components))] = -np.inf
        nearest = int(off_m.argmax()) if len(off_m) else -1
        return (
            point if nearest < 0 or off_m[nearest] < -tolerance_m else self._into(point, int(blocks[nearest]))
        )

    def _into(self, point: Point, block: int) -> Point:
        """Return a point moved into a block, off its edges by no more than rounding."""
        x, y = point
        west, east = float(self._west[block]), float(self._east[block])
        floor, ceiling = self._edge(int(self._floor[block])), self._edge(int(self._ceiling[block]))
        for step in range(_PUSHES):
            moved = False
            for edge, upwards in ((floor, 1.0), (ceiling, -1.0)):
                off_m = upwards * edge.left_of(x, y)
                if off_m < self.rounding_m:
                    push_m = upwards * (2.0 * (1 << step) * self.rounding_m - off_m)
                    x, y = x - edge.rise * push_m, y + edge.run * push_m
                    moved = True
            if not west <= x <= east:
                x = min(max(x, west), east)
                y = min(max(y, floor.north(x)), ceiling.north(x))
                moved = True
            vertex = self._vertex_at((x, y))
            if vertex is not None:
                return float(self._vertices.x[vertex]), float(self._vertices.y[vertex])
            if not moved:
                return x, y
        # Hardly wider than rounding here: on its floor, its ceiling or between them.
        low, high = floor.north(x), ceiling.north(x)
        return x, (0.5 * (low + high) if high - low < TOLERANCE_M else min(max(y, low), high))

    def _vertex_at(self, point: Point) -> int | None:
        """Return the vertex nearest to a point within `TOLERANCE_M`, if there is one."""
        v, (x, y) = self._vertices, point
        line = bisect_left(self._lines, x - TOLERANCE_M)
        nearest, found = TOLERANCE_M, None
        while line < len(self._lines) and self._lines[line] <= x + TOLERANCE_M:
            first, last = v.line_start[line : line + 2].tolist()
            there = v.order[first:last]
            place = int(np.searchsorted(v.y[there], y - TOLERANCE_M))
            for vertex in there[place:].tolist():
                if v.y[vertex] > y + TOLERANCE_M:
                    break
                away_m = dist((v.x[vertex], v.y[vertex]), point)
                if away_m <= nearest:
                    nearest, found = away_m, vertex
            line += 1
        return found

    def _edge(self, edge: int) -> _Edge:
        v = self._vertices
        left, right = sorted((float(v.x[end]), float(v.y[end])) for end in (edge, int(v.next[edge])))
        length_m = dist(left, right)
        return _Edge((left, right), (right[0] - left[0]) / length_m, (right[1] - left[1]) / length_m)

    def _place(self, point: Point) -> tuple[list[int], bool]:
        """Return the blocks that a point lies in or on the edge of, and whether it lies in one for certain."""
        found = self._located.get(point)
        if found is None:
            if len(self._located) >= _REMEMBERED:
                self._located.clear()
            near, depth_m = self._depths(point, TOLERANCE_M)
            certain = (
                (depth_m >= self.rounding_m) & (self._west[near] <= point[0]) & (point[0] <= self._east[near])
            )
            inside = bool(certain.any())
            # A block whose floor or ceiling a point lies behind sees the corners there from behind. Where nothing else is near, it must do.
            least_m = -self.rounding_m if inside else -TOLERANCE_M
            blocks = near[depth_m >= least_m].tolist()
            if len(blocks) > 1:
                # As a sweep over all of free space numbers them.
                blocks.sort(key=lambda block: (self._west[block], self._south(block)))
            found = self._located[point] = blocks, inside
        return found

    def _south(self, block: int) -> float:
        """Return the north of a block's floor half way between its sides."""
        middle = 0.5 * (self._west[block : block + 1] + self._east[block : block + 1])
        return float(self._vertices.edge_north(self._floor[block : block + 1], middle)[0])

    def _depths(self, point: Point, tolerance_m: float) -> tuple[Ints, Floats]:
        """Return the blocks that a point may lie in, and how far it lies above their floors and below their ceilings, in metres.

        Less than nothing outside. Measured square to the edges: beside a steep edge heights say nothing.
        """
        east, north = point
        begun = self._order[: int(self._rising.searchsorted(east + tolerance_m, side="right"))]
        near = begun[self.open_east[begun] >= east - tolerance_m]
        across_x, across_y, offset_m = self.half_planes.take(near, axis=2)
        depth_m = across_x * east
        depth_m += across_y * north
        depth_m += offset_m
        return near, np.minimum(depth_m[0], depth_m[1])

    @cached_property
    def half_planes(self) -> Floats:
        """What lies above the floor and what below the ceiling of each block, (3, 2, b) array: the unit vector inwards and the offset."""
        v = self._vertices
        sides = []
        for edge, inwards in ((self._floor, 1.0), (self._ceiling, -1.0)):
            other = v.next[edge]
            run, rise = v.x[other] - v.x[edge], v.y[other] - v.y[edge]
            length_m = np.hypot(run, rise) * np.where(run < 0.0, -inwards, inwards)
            across_x, across_y = -rise / length_m, run / length_m
            sides.append((across_x, across_y, -(across_x * v.x[edge] + across_y * v.y[edge])))
        return np.ascontiguousarray(np.array(sides).transpose(1, 0, 2))

    def components(self, blocks: Sequence[int]) -> frozenset[int]:
        """Return the polygons that blocks lie in, by their place among those the slabs were made of."""
        return frozenset(self._vertices.owner[self._floor[list(blocks)]].tolist())
