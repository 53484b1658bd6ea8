"""Shortest lengths by another method than the planner's, exact to rounding: a visibility graph that knows which side of each vertex is free.

`visibility_graph` widens free space by 1e-9 m and cuts 1e-6 m out of it about pinches, which is too coarse for ends that lie a nanometre beside an edge. Here
lines are compared with edges by signed distances, in numpy alone. Where several rings share a point it is one node for each free sector there, so no
path passes a pinch. A line that meets a vertex on its way is left out: the path by way of that vertex is as long.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, cmp_to_key

import numpy as np
import shapely

AT_CORNER_M = 4e-9
ON_M = 1e-9
"""An end this near to a vertex or an edge stands on it, as the planner has it."""


@dataclass(frozen=True)
class _End:
    """An end of a path: where it is, and what stands there instead of it or beside it."""

    point: np.ndarray
    nodes: np.ndarray  # the sectors of the vertex that it stands on
    edges: np.ndarray  # the edges that it stands on


class ExactReference:
    """Free space made ready for lengths.

    Parameters
    ----------
    free : shapely geometry
        Polygons near the origin: rounding grows with their coordinates.
    """

    def __init__(self, free):
        parts = [part for part in shapely.get_parts(free) if part.area > 0.0]
        rings = []
        for part in parts:
            for ring, ccw in [(part.exterior, True), *((hole, False) for hole in part.interiors)]:
                points = shapely.get_coordinates(ring)[:-1]
                rings.append(points if ring.is_ccw == ccw else points[::-1])  # free space on the left
        self._a = np.concatenate(rings)
        self._b = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
        self._before = np.concatenate([np.roll(ring, 1, axis=0) for ring in rings])
        self._ring = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
        self._free = shapely.MultiPolygon(parts)
        self._eps = 64 * np.finfo(float).eps * max(1.0, np.abs(self._a).max())
        self._edge = self._b - self._a
        self._edge_m = np.hypot(*self._edge.T)
        self._sectors()
        self._seen = {}

    @cached_property
    def narrowest_m(self):
        """The least distance between a vertex and an edge that do not touch: the width of the narrowest gap, wall or step; 0 where a ring lies on itself."""
        to_a = self._a[:, None] - self._a[None]
        share = np.clip(dot(to_a, self._edge[None]) / self._edge_m**2, 0, 1)
        off = np.hypot(*np.moveaxis(to_a - share[..., None] * self._edge[None], 2, 0))
        touches = off == 0.0
        is_end = (to_a == 0.0).all(axis=2) | (self._a[:, None] == self._b[None]).all(axis=2)
        if (touches & ~is_end & (self._ring[:, None] == self._ring)).any():
            return 0.0
        return float(off[~touches].min(initial=np.inf))

    def _sectors(self):
        """One node for each free sector: where it is, and its first and last direction, counter-clockwise."""
        places, place = np.unique(self._a, axis=0, return_inverse=True)
        place = place.ravel()
        self._node, first, last = [], [], []
        for at in range(len(places)):
            there = np.flatnonzero(place == at)
            ways = [(0, *way) for way in (self._b[there] - places[at]).tolist()]
            ways += [(1, *way) for way in (self._before[there] - places[at]).tolist()]
            if len(there) > 1:
                ways.sort(key=cmp_to_key(counter_clockwise))
            for (kind, *out), (next_kind, *back) in zip(ways, ways[1:] + ways[:1], strict=True):
                if kind == 0 and next_kind == 1:
                    self._node.append(places[at])
                    first.append(out)
                    last.append(back)
        self._node, self._first, self._last = np.array(self._node), np.array(first), np.array(last)

    def _in_sector(self, nodes, way, dist):
        """Return whether ways (k, 2) leave nodes (k,) into their sectors, closed but for rounding."""
        first, last = self._first[nodes], self._last[nodes]
        first_m, last_m = np.hypot(*first.T), np.hypot(*last.T)
        after = cross(first, way) / np.maximum(first_m, dist)
        before = cross(way, last) / np.maximum(last_m, dist)
        along_first = (np.abs(after) <= self._eps) & (dot(first, way) > 0)
        along_last = (np.abs(before) <= self._eps) & (dot(last, way) > 0)
        wide = cross(first, last) < 0.0
        inside = np.where(wide, (after > 0) | (before > 0), (after > 0) & (before > 0))
        return inside | along_first | along_last

    def _clear(self, p, q, skip=()):
        """`_clear_few`, some lines at a time: what fits the processor's memory is done many times as fast."""
        few = max(1, 40_000 // len(self._a))
        return np.concatenate(
            [self._clear_few(p[at : at + few], q[at : at + few], skip) for at in range(0, len(p), few)]
            or [np.zeros(0, dtype=bool)]
        )

    def _clear_few(self, p, q, skip):
        """Return whether lines p (k, 2) to q (k, 2) cross no edge and meet no vertex between their ends; `skip` are edges that p lies on."""
        way = q - p
        length = np.hypot(*way.T)
        length[length == 0.0] = 1.0
        unit = way / length[:, None]
        to_a = self._a[None] - p[:, None]
        to_b = self._b[None] - p[:, None]
        side_a = cross(unit[:, None], to_a)
        side_b = cross(unit[:, None], to_b)
        along_a = dot(unit[:, None], to_a)
        eps = self._eps
        meets = (np.abs(side_a) <= eps) & (along_a > eps) & (along_a < (length - eps)[:, None])
        # The vertex that the line starts or ends at is not between.
        side_p = cross(self._edge[None], -to_a) / self._edge_m
        side_q = cross(self._edge[None], q[:, None] - self._a[None]) / self._edge_m
        apart = (np.minimum(side_a, side_b) < -eps) & (np.maximum(side_a, side_b) > eps)
        parted = (np.minimum(side_p, side_q) < -eps) & (np.maximum(side_p, side_q) > eps)
        crosses = apart & parted
        crosses[:, list(skip)] = False
        return ~(meets.any(axis=1) | crosses.any(axis=1))

    def _from_node(self, node):
        """Return the lengths from a node to all that it sees; looked for when a search comes there, since few nodes lie on the way."""
        if node not in self._seen:
            lengths = np.full(len(self._node), np.inf)
            others = np.arange(len(self._node))
            way = self._node - self._node[node]
            dist = np.hypot(*way.T)
            here = np.full(len(others), node)
            may = (dist > 0) & self._in_sector(here, way, dist) & self._in_sector(others, -way, dist)
            others = others[may]
            ends = np.sort(np.column_stack((here[may], others)))  # there and back the same line
            others = others[self._clear(self._node[ends[:, 0]], self._node[ends[:, 1]])]
            lengths[others] = dist[others]
            self._seen[node] = lengths
        return self._seen[node]

    def places(self, point):
        """Return where an end may stand: itself in free space, else the nearest place; all of them where several are as near within rounding."""
        point = np.asarray(point, dtype=float)
        if self._free.covers(shapely.Point(point)):
            return [point]
        share = np.clip(dot(point - self._a, self._edge) / self._edge_m**2, 0, 1)
        feet = self._a + share[:, None] * self._edge
        away_m = np.hypot(*(feet - point).T)
        feet = feet[away_m <= away_m.min() + ON_M]
        return [foot for one, foot in enumerate(feet) if (np.hypot(*(feet[:one] - foot).T) > ON_M).all()]

    def _end(self, point):
        point = np.asarray(point, dtype=float)
        if not self._free.covers(shapely.Point(point)):
            point = shapely.get_coordinates(shapely.shortest_line(self._free, shapely.Point(point)))[0]
        off = np.hypot(*(self._node - point).T)
        nodes = np.flatnonzero(off <= ON_M)
        share = np.clip(dot(point - self._a, self._edge) / self._edge_m**2, 0, 1)
        foot = self._a + share[:, None] * self._edge
        edges = np.flatnonzero(np.hypot(*(foot - point).T) <= ON_M)
        if len(edges) > 1 and not len(nodes):
            # Beside two edges of a corner by as much as counts as on them: at the corner, to either side where obstacles touch.
            nodes = np.flatnonzero(off <= AT_CORNER_M)
        if len(edges) and not len(nodes):
            point = foot[edges[0]]
        return _End(point, nodes, edges)

    def beside_m(self, point):
        """Return how far an end is from the corner both of whose edges it stands on, being as near to either as counts as on it; 0 if it is so near to no two."""
        end = self._end(point)
        if len(end.edges) < 2 or len(end.nodes):
            return 0.0
        return float(np.hypot(*(self._node - end.point).T).min())

    def _from_end(self, end):
        """Return the lengths from an end to all nodes that it sees."""
        lengths = np.full(len(self._node), np.inf)
        for node in end.nodes:
            lengths = np.minimum(lengths, self._from_node(int(node)))
        lengths[end.nodes] = 0.0
        if len(end.nodes):
            return lengths
        way = self._node - end.point
        dist = np.hypot(*way.T)
        everyone = np.arange(len(dist))
        may = self._in_sector(everyone, -way, dist)
        for edge in end.edges:
            if len(end.edges) == 1:
                may &= cross(self._edge[edge], way) / self._edge_m[edge] >= -2 * ON_M
            ends = np.flatnonzero(
                (self._node == self._a[edge]).all(axis=1) | (self._node == self._b[edge]).all(axis=1)
            )
            along = np.isin(everyone, ends)
            # Along the edge rounding decides nothing: the sector must begin or end with it.
            leaves = (self._node == self._a[edge]).all(axis=1)
            towards = np.where(leaves[:, None], self._first, -self._last)
            aside = np.abs(cross(towards, self._edge[edge])) / self._edge_m[edge]
            same = (aside <= 1e-9 * np.hypot(*towards.T)) & (dot(towards, self._edge[edge]) > 0.0)
            may = np.where(along, same, may)
        clear = np.zeros(len(dist), dtype=bool)
        tried = np.flatnonzero(may)
        clear[tried] = self._clear(np.broadcast_to(end.point, (len(tried), 2)), self._node[tried], end.edges)
        lengths[clear] = dist[clear]
        return lengths

    def length(self, start, goal):
        """Return the length of the shortest path between two points of free space or within rounding of it; infinite if there is none."""
        one, two = self._end(start), self._end(goal)
        best = self._from_end(one)
        last = self._from_end(two)
        direct = np.inf
        if not len(one.nodes) and not len(two.nodes):
            line = shapely.LineString([one.point, two.point])
            if self._sees(one, two):
                direct = line.length
        # What is left at least, less than by which an end may stand beside its place.
        left_m = np.maximum(np.hypot(*(self._node - two.point).T) - 2 * AT_CORNER_M, 0.0)
        done = np.zeros(len(best), dtype=bool)
        while True:
            open_m = np.where(done, np.inf, best + left_m)
            here = int(open_m.argmin())
            if not open_m[here] < min(direct, (best + last).min()):
                break
            done[here] = True
            best = np.minimum(best, best[here] + self._from_node(here))
        return float(min(direct, (best + last).min()))

    def _sees(self, one, two):
        common = np.intersect1d(one.edges, two.edges)
        way = two.point - one.point
        for end, sign in ((one, 1.0), (two, -1.0)):
            if len(end.edges) == 1 and not len(common):
                edge = end.edges[0]
                if cross(self._edge[edge], sign * way) < 0.0:
                    return False
        skip = np.union1d(one.edges, two.edges)
        return bool(self._clear(one.point[None], two.point[None], skip)[0])


def counter_clockwise(one, other):
    """Compare two ways (kind, east, north) by their direction, exactly."""
    (x, y), (u, v) = ([Fraction(part) for part in way[1:]] for way in (one, other))
    half, other_half = (y < 0 or (y == 0 and x < 0)), (v < 0 or (v == 0 and u < 0))
    if half != other_half:
        return half - other_half
    turn = x * v - y * u
    return (turn < 0) - (turn > 0)


def cross(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


def dot(one, other):
    return one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]
