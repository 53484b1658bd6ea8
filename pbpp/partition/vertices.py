"""The vertices of free space, linked so that each stands in one free fan."""

from __future__ import annotations

from copy import copy
from functools import cached_property, cmp_to_key
from math import dist, tau
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from .base import TOLERANCE_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry import Polygon

    from pbpp.geometry import Floats, Point

Ints = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]

# The rounding of an end, 1e-9 m, turns an edge of a millimetre by as much; chosen, not measured.
_ONE_WAY_RAD = 1e-6
# So much of its two products a determinant is wrong by at the most (Shewchuk, "Adaptive precision floating-point arithmetic", 1997, section 4.3).
_ORIENTED = (3.0 + 16.0 * 2.0**-53) * 2.0**-53


class _Spoke(NamedTuple):
    """An edge as it leaves a point where obstacles touch, or nearly touch: its own end there, its other end, its direction."""

    end: Point
    other_end: Point
    angle_rad: float
    starts: bool  # whether the edge starts here
    vertex: int
    neighbour: int


def _in_order(spokes: list[_Spoke]) -> list[_Spoke]:
    """Return edges counter-clockwise, those of one direction side by side: counted from the widest angle between two of them."""
    spokes.sort(key=attrgetter("angle_rad"))
    angles_rad = [spoke.angle_rad for spoke in spokes]
    gaps_rad = [
        after - before for before, after in zip(angles_rad[-1:] + angles_rad, angles_rad, strict=False)
    ]
    gaps_rad[0] += tau
    if min(gaps_rad) > _ONE_WAY_RAD:
        return spokes
    first_rad = angles_rad[gaps_rad.index(max(gaps_rad))]
    turned = [spoke._replace(angle_rad=(spoke.angle_rad - first_rad) % tau) for spoke in spokes]
    return sorted(turned, key=cmp_to_key(_compare))


def _compare(one: _Spoke, other: _Spoke) -> int:
    """Return which of two edges comes first counter-clockwise; edges do not cross, so of two that lie on one line within rounding any place tells."""
    if abs(one.angle_rad - other.angle_rad) > _ONE_WAY_RAD:
        return 1 if one.angle_rad > other.angle_rad else -1
    if dist(one.end, one.other_end) > dist(other.end, other.other_end):
        return -_compare(other, one)
    line = other.end, other.other_end
    return _left_of(line, one.other_end) or _left_of(line, one.end)


def _left_of(line: tuple[Point, Point], point: Point) -> int:
    """Return 1 if a point lies to the left of a line, -1 to the right, 0 on it: exactly."""
    (x, y), (end_x, end_y), (point_x, point_y) = (*line, point)
    one, other = (end_x - x) * (point_y - y), (end_y - y) * (point_x - x)
    left: float = one - other
    if abs(left) > _ORIENTED * (abs(one) + abs(other)):
        return 1 if left > 0.0 else -1
    # Floats are whole numbers over powers of two: over the greatest of these, which all others divide, they are whole.
    ratios = [number.as_integer_ratio() for number in (x, y, end_x, end_y, point_x, point_y)]
    parts = max(below for _, below in ratios)
    x, y, end_x, end_y, point_x, point_y = (above * (parts // below) for above, below in ratios)
    left = (end_x - x) * (point_y - y) - (end_y - y) * (point_x - x)
    return (left > 0) - (left < 0)


def _lines(east: Floats) -> tuple[Floats, Ints, Floats]:
    """Return the vertical lines that rising easts lie on, where each begins among them, and each one's line."""
    jump = np.diff(east, prepend=-np.inf) > TOLERANCE_M
    line_x = east[jump]
    return line_x, np.append(np.flatnonzero(jump), len(east)), line_x[np.cumsum(jump) - 1]


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
        self.names = place = np.arange(count)
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
        self._by_east: Ints = np.argsort(east, kind="stable")
        self.x: Floats = np.empty(count)
        self.line_x, self.line_start, self.x[self._by_east] = _lines(east[self._by_east])
        self.y: Floats = self.points[:, 1].copy()
        self.order: Ints = np.lexsort((self.y, self.x))
        self._split_pinches()
        self.corner = self._corners(place)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.order)

    def changed(self, gone: Ints, rings: Sequence[Floats], owner: int) -> Vertices | None:
        """Return the vertices without some holes of free space and with others, the rest with their numbers.

        Parameters
        ----------
        gone : (k,) array of int
            All vertices of the holes that are no more. Their numbers stay without meaning.
        rings : sequence of (m, 2) array
            The holes that are new, clockwise, the first point not repeated. Their vertices are numbered on from those that are there.
        owner : int
            The polygon that they are in.

        Returns
        -------
        Vertices or None
            The vertices; None if what stays is not the same as before, because vertices come to one vertical line, or to one place, or part there.
        """
        before = len(self.x)
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        total = before + int(sizes.sum())
        added = np.arange(before, total)
        ends = before + np.cumsum(sizes)
        starts = ends - sizes
        is_live = np.ones(total, dtype=bool)
        is_live[gone] = False
        if (
            is_live[self.next[gone]].any() or is_live[self.prev[gone]].any()
        ):  # linked with others where they touch
            return None
        after, prior = np.concatenate((self.next, added + 1)), np.concatenate((self.prev, added - 1))
        after[ends - 1], prior[starts] = starts, ends - 1
        after[gone] = prior[gone] = gone
        new = copy(self)
        new.__dict__.pop("fans", None)
        new.names, new.next, new.prev = np.arange(total), after, prior
        new.points = np.concatenate((self.points, *rings))
        new.owner = np.concatenate((self.owner, np.full(len(added), owner)))
        if not new._placed(self, is_live, added):  # noqa: SLF001 - a copy
            return None
        new.corner = np.concatenate((self.corner, new._corners(added)))  # noqa: SLF001 - a copy
        return new

    def _placed(self, before: Vertices, is_live: Flags, added: Ints) -> bool:
        """Find the lines of added vertices and their places on them; return whether what was there is where it was, and nothing new at its places."""
        easts, norths = self.points[added].T
        order = np.argsort(easts, kind="stable")
        kept = before._by_east[is_live[before._by_east]]
        places = np.searchsorted(self.points[kept, 0], easts[order], side="right")
        self._by_east = np.insert(kept, places, added[order])
        self.x, self.y = np.concatenate((before.x, easts)), np.concatenate((before.y, norths))
        self.line_x, self.line_start, self.x[self._by_east] = _lines(self.points[self._by_east, 0])
        if (self.x[kept] != before.x[kept]).any():
            return False
        live = before.order[is_live[before.order]]
        rising, order = self.x[live], np.lexsort((norths, self.x[added]))
        easts, norths = self.x[added[order]], norths[order]
        first, last = np.searchsorted(rising, easts, "left"), np.searchsorted(rising, easts, "right")
        on_line = [
            begin + int(np.searchsorted(self.y[live[begin:end]], north, "right"))
            for begin, end, north in zip(first.tolist(), last.tolist(), norths.tolist(), strict=True)
        ]
        self.order = np.insert(live, on_line, added[order])
        place = np.array(on_line, dtype=np.intp) + np.arange(len(added))
        place = np.concatenate((place[place > 0] - 1, place[place + 1 < len(self.order)]))
        one, other = self.order[place], self.order[place + 1]
        return not ((self.x[one] == self.x[other]) & (self.y[other] - self.y[one] <= TOLERANCE_M)).any()

    def edge_north(self, edge: Ints, east: Floats) -> Floats:
        """Return the north of edges, each given by the vertex it starts at, at given easts, exact at their ends."""
        first, second = edge, self.next[edge]
        swap = self.x[first] > self.x[second]
        first, second = np.where(swap, second, first), np.where(swap, first, second)
        share = (east - self.x[first]) / (self.x[second] - self.x[first])
        north = self.y[first] + share * (self.y[second] - self.y[first])
        return np.where(share >= 1.0, self.y[second], north)

    @cached_property
    def fans(self) -> list[tuple[float, float, float, float, float, float]]:
        """Of each vertex east and north, and the way to the vertex before it and to the one after it, in metres."""
        x, y, before, after = self.x, self.y, self.prev, self.next
        columns = (x, y, x[before] - x, y[before] - y, x[after] - x, y[after] - y)
        return list(zip(*(column.tolist() for column in columns), strict=True))

    def _split_pinches(self) -> None:
        """Link the edges at a point shared by several rings so that each free fan there is one vertex."""
        x, y = self.x[self.order], self.y[self.order]
        same = (x[1:] == x[:-1]) & (np.diff(y) <= TOLERANCE_M)
        # Runs of vertices one at the other's place.
        edges = np.flatnonzero(np.diff(same, prepend=False, append=False)).reshape(-1, 2)
        if not len(edges):
            return
        sizes = edges[:, 1] - edges[:, 0] + 1
        members = self.order[np.concatenate([np.arange(first, last + 1) for first, last in edges.tolist()])]
        # One point for all: of two heights the sweep would take the wrong fan's vertex for a portal's end.
        self.y[members] = np.repeat(self.y[self.order[edges[:, 0]]], sizes)
        here = np.repeat(members, 2)
        neighbours = np.column_stack((self.next[members], self.prev[members])).ravel()
        way = self.points[neighbours] - self.points[here]
        columns = (
            map(tuple, self.points[here].tolist()),
            map(tuple, self.points[neighbours].tolist()),
            np.arctan2(way[:, 1], way[:, 0]).tolist(),
            [True, False] * len(members),
            here.tolist(),
            neighbours.tolist(),
        )
        spokes = list(map(_Spoke, *columns))
        last = 0
        for size in sizes.tolist():
            first, last = last, last + 2 * size
            self._link(_in_order(spokes[first:last]))

    def _link(self, spokes: list[_Spoke]) -> None:
        """Make the edges beside each free fan of a point neighbours."""
        for one, other in zip(spokes, [*spokes[1:], spokes[0]], strict=True):
            if one.starts == other.starts or (other is not spokes[0] and self._crossed(one, other)):
                raise ValueError("the edges at a point do not bound free fans")
            if one.starts:
                self.prev[one.vertex] = other.neighbour
                self.next[other.neighbour] = one.vertex

    def _crossed(self, one: _Spoke, other: _Spoke) -> bool:
        """Return whether two edges one after the other have changed places where their ends were made one point."""
        if abs(one.angle_rad - other.angle_rad) > _ONE_WAY_RAD:
            return False
        here, end, other_end = (
            (float(self.x[place]), float(self.y[place]))
            for place in (one.vertex, one.neighbour, other.neighbour)
        )
        return _left_of((here, end), other_end) < 0

    def _corners(self, which: Ints) -> npt.NDArray[np.bool_]:
        """Mark those of some vertices that a shortest path may turn around: free space fills half a turn or more.

        Where the boundary turns back on itself within rounding, only the sign tells a spike of an obstacle from a slit in it.
        """
        x, y, before, after = self.x[which], self.y[which], self.prev[which], self.next[which]
        in_x, in_y = x - self.x[before], y - self.y[before]
        out_x, out_y = self.x[after] - x, self.y[after] - y
        turn = in_x * out_y - in_y * out_x
        slack = TOLERANCE_M * (np.abs(in_x) + np.abs(in_y) + np.abs(out_x) + np.abs(out_y))
        onwards = in_x * out_x + in_y * out_y >= 0.0
        if ((in_x == 0.0) & (out_x == 0.0) & ~onwards).any():
            raise ValueError("a spike of the boundary stands on one line")
        corner = (turn < 0.0) | (onwards & (turn <= slack))
        # Edges a rounding apart may have come to lie on each other with their ends on one line: then the points as given decide. Or past each other.
        for place in np.flatnonzero((np.abs(turn) <= slack) & ~onwards).tolist():
            start, here, end = map(tuple, self.points[[before[place], which[place], after[place]]].tolist())
            side = _left_of((start, here), end)
            if side * turn[place] < 0.0:
                raise ValueError("a sliver of the boundary is turned inside out")
            corner[place] = side < 0 or (side == 0 and turn[place] < 0.0)
        return corner
