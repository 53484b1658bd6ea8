"""The vertices of free space, linked so that each stands in one free fan."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely

from .base import TOLERANCE_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry import Polygon

    from pbpp.geometry import Floats

__all__ = ["Ints", "Vertices"]

Ints = npt.NDArray[np.intp]


class Vertices:
    """The vertices of free space with their neighbours, free space lying on the left of every edge.

    Parameters
    ----------
    polygons : sequence of shapely.Polygon
        Disjoint polygons, metres from the scene's origin.
    """

    def __init__(self, polygons: Sequence[Polygon]) -> None:
        array = np.array(polygons, dtype=object)
        rings, owner = shapely.get_rings(array, return_index=True)
        shell = np.ones(len(rings), dtype=bool)
        shell[1:] = owner[1:] != owner[:-1]
        points, ring = shapely.get_coordinates(rings, return_index=True)
        last = np.ones(len(points), dtype=bool)
        last[:-1] = ring[1:] != ring[:-1]
        ring_of = ring[~last]
        self.points: Floats = points[~last]
        self.owner: Ints = owner[ring_of]
        count = len(self.points)
        place = np.arange(count)
        starts = np.flatnonzero(np.diff(ring_of, prepend=-1))
        ends = np.append(starts, count)[1:] - 1
        after = place + 1
        after[ends] = starts
        before = place - 1
        before[starts] = ends
        forward = (shapely.is_ccw(rings) == shell)[ring_of]
        self.next: Ints = np.where(forward, after, before)
        self.prev: Ints = np.where(forward, before, after)

        east = self.points[:, 0]
        order = np.argsort(east, kind="stable")
        jump = np.diff(east[order], prepend=-np.inf) > TOLERANCE_M
        line = np.cumsum(jump) - 1
        self.line_x: Floats = east[order][jump]
        self.x = np.empty(count)
        self.x[order] = self.line_x[line]
        self.y: Floats = np.ascontiguousarray(self.points[:, 1])
        self.order: Ints = np.lexsort((self.y, self.x))
        self.line_start: Ints = np.append(np.flatnonzero(jump), count)
        self._split_pinches()
        self.corner = self._corners()

    @cached_property
    def fans(self) -> list[tuple[float, float, float, float, float, float]]:
        """Of each vertex east and north, and the way to the vertex before it and to the one after it, in metres."""
        x, y, before, after = self.x, self.y, self.prev, self.next
        columns = (x, y, x[before] - x, y[before] - y, x[after] - x, y[after] - y)
        return list(zip(*(column.tolist() for column in columns), strict=True))

    def _split_pinches(self) -> None:
        """Link the edges at a point shared by several rings so that each free fan there is one vertex."""
        x, y = self.x[self.order], self.y[self.order]
        same = np.flatnonzero((x[1:] == x[:-1]) & (np.diff(y) <= TOLERANCE_M))
        groups: dict[int, list[int]] = {}
        for place in same.tolist():
            groups[place + 1] = [*groups.pop(place, [int(self.order[place])]), int(self.order[place + 1])]
        for members in groups.values():
            before = [int(self.prev[v]) for v in members]
            spokes = [(self._angle(v, int(self.next[v])), 0, v) for v in members]
            spokes += [(self._angle(v, p), 1, p) for v, p in zip(members, before, strict=True)]
            spokes.sort()
            for place, (_, kind, vertex) in enumerate(spokes):
                _, next_kind, neighbour = spokes[(place + 1) % len(spokes)]
                if kind == 0 and next_kind == 1:
                    self.prev[vertex] = neighbour
                    self.next[neighbour] = vertex

    def _angle(self, vertex: int, neighbour: int) -> float:
        east, north = self.points[neighbour] - self.points[vertex]
        return float(np.arctan2(north, east))

    def _corners(self) -> npt.NDArray[np.bool_]:
        """Mark the vertices that a shortest path may turn around: free space fills half a turn or more.

        Where the boundary turns back on itself within rounding, only the sign tells a spike of an obstacle from a slit in it.
        """
        x, y = self.x, self.y
        in_x, in_y = x - x[self.prev], y - y[self.prev]
        out_x, out_y = x[self.next] - x, y[self.next] - y
        turn = in_x * out_y - in_y * out_x
        slack = TOLERANCE_M * (np.abs(in_x) + np.abs(in_y) + np.abs(out_x) + np.abs(out_y))
        onwards = in_x * out_x + in_y * out_y >= 0.0
        return (turn < 0.0) | (onwards & (turn <= slack))
