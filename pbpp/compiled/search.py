"""The search of `pbpp.any_angle`, compiled by numba over flat arrays, for one query and for many at once.

It does the same operations in the same order as the plain search, so that its answers are the same to the last bit; the tests compare them. What
is explained there is not explained again here. A search reads and writes nothing but arrays that Python holds, so it can be left and gone on with:
where they are full, longer ones are made and kept for the next query, and a caller is asked now and then whether to stop.
"""

# numba reads loops over indices and explicit comparisons best; min and max of Python and numba part on signed zeros.
# ruff: noqa: PLR0913, PLR0917, PLR1730

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pbpp.compiled.jit import compiled as _compiled
from pbpp.compiled.jit import inlined as _inlined
from pbpp.compiled.jit import released as _released
from pbpp.compiled.jit import uncounted as _uncounted
from pbpp.errors import SearchStoppedError
from pbpp.partition.base import TOLERANCE_M
from pbpp.partition.flat import DirectPath, record
from pbpp.planned_path import STRAIGHT_M

if TYPE_CHECKING:
    from collections.abc import Callable

    from pbpp.geometry import Floats, Point
    from pbpp.partition.flat import FlatSlabs, Records
    from pbpp.partition.places import Places
    from pbpp.partition.vertices import Ints, Vertices

_GOAL, _TURN = -1, -2  # marks in the place of a block's number
_SLACK_M = 1e-10  # as in `any_angle`: the paths must be the same
_EAST, _WEST = 1, 0
_RIGHT, _LEFT = 0, 1  # indices
# Entries of the queue at first; where they do not suffice it becomes four times as long, and stays so for later queries.
_CAPACITY = 2048
_MARGIN = 32  # entries kept free for one step's own
_MOST_CONES = 8  # of a turn
_PATH = 256  # points of a path at first
_BLOCKS_IN_BUCKET = 16  # so many begin in one on average; chosen, not measured
_CHUNK = 1024  # nodes between two questions whether to stop: some 0.3 ms

_ROOT = record("x y g_m", "before turn")
_NODE = record("f_m low high", "block direction root")  # a cone, or a mark in the place of its block
_ENTRY = record("f_m", "node")  # of the heap
_CONE = record("low high", "block direction steps")
_WAY = record("low high", "way")  # a way out of a block, as far as it is seen
# Of a block its sides, east minus infinity if it is closed, what lies above its floor and below its ceiling, and the polygon that it lies in.
_HALF_PLANES = ("floor_x", "floor_y", "floor_m", "ceiling_x", "ceiling_y", "ceiling_m")
_PLACE = record(" ".join(("west", "east", *_HALF_PLANES)), "owner")
_RESULT = record(
    "length_m", "status expanded turned kept"
)  # of one of many queries: in the last two where its points end

# What is counted in `_Work.sizes`. The last two: entries that the search lacks room for beyond the margin, and the node
# with which it has reached the goal.
(
    _ROOTS,
    _NODES,
    _HEAP,
    _EXPANDED,
    _CONES,
    _FOLLOWED,
    _ROOT_NOW,
    _STARTS,
    _GOALS,
    _NEIGHBOURS,
    _LACKING,
    _TAKEN,
) = range(12)
# How a search ended, or why it was left.
_FOUND, _NO_PATH, _FULL, _PAUSED, _UNUSUAL, _LONG = range(6)
_NEXT, _GOING, _ENDED = range(3)  # how far a query of many is
_START_ROW, _GOAL_ROW, _NEIGHBOUR_ROW = 0, 1, 2  # of `_Work.ends`


class _Map(NamedTuple):
    """What queries read."""

    first: Ints
    last: Ints
    ways: Records
    corners: Records
    points: Floats  # of the vertices as given
    places: Records
    bucket_first: Ints
    bucket: Ints  # the blocks that lie in each upright strip of the map, in rising order
    grid: Floats  # west side of the strips, how many there are to a metre; how far from an edge a point lies inside for certain


class _Work(NamedTuple):
    """What a search writes."""

    roots: Records
    nodes: Records
    heap: Records
    cones: Records
    seen: Records
    best: Floats  # of each turn the least length known; infinite again after a search
    ends: Ints  # (3, k): the blocks of start and goal, and the vertices next to the start
    goal: Floats
    sizes: Ints


class Searcher:
    """The compiled search of one map. Threads may use it at once: each takes arrays of its own.

    Parameters
    ----------
    flat : FlatSlabs
        The slabs of free space.
    vertices : Vertices
        Its vertices.
    places : Places
        Where points lie among the slabs.
    """

    def __init__(self, flat: FlatSlabs, vertices: Vertices, places: Places) -> None:
        of_block = np.empty(len(flat.blocks), _PLACE)
        of_block["west"], of_block["east"] = flat.blocks["west"], places.open_east
        columns = places.half_planes.transpose(1, 0, 2).reshape(6, -1)
        for name, column in zip(_HALF_PLANES, columns, strict=True):
            of_block[name] = column
        of_block["owner"] = vertices.owner[flat.blocks["floor"]]
        strips = 1 + len(of_block) // _BLOCKS_IN_BUCKET
        west, width_m = (
            (float(vertices.x.min()), float(np.ptp(vertices.x))) if len(vertices.x) else (0.0, 0.0)
        )
        grid = np.array(
            [west, strips / width_m if width_m > 0.0 else 0.0, 2.0 * TOLERANCE_M + places.rounding_m]
        )
        bucket_first = np.zeros(strips + 1, np.int64)
        _count(of_block, grid, bucket_first)
        bucket = np.empty(int(bucket_first[-1]), np.int64)
        _fill(of_block, grid, bucket_first, bucket)
        self._map = _Map(
            flat.first,
            flat.last,
            flat.ways,
            flat.corners,
            vertices.points,
            of_block,
            bucket_first,
            bucket,
            grid,
        )
        self._idle: list[_Work] = []

    def search(
        self,
        start: Point,
        goal: Point,
        ends: tuple[list[int], list[int], list[int]],
        should_stop: Callable[[], bool] | None,
    ) -> tuple[list[int] | None, float, int, bool]:
        """Return the shortest path between two points of free space, wherever in it they lie.

        Parameters
        ----------
        start, goal : (east, north)
            Metres from the scene's origin, in free space or on its boundary.
        ends : three lists of int
            The blocks that start and goal lie in, and the vertices next to the start on the side line of a block.
        should_stop : callable, optional
            Asked now and then; when it returns True the search ends with the bound reached so far.

        Returns
        -------
        tuple
            The vertices that the path turns at, or None if none was found; a length in metres that no path is shorter than; how many nodes were taken
            from the queue; whether the caller stopped the search.
        """
        work = self._take()
        longest = max(map(len, ends))
        if longest > work.ends.shape[1]:
            cones = np.empty(_MOST_CONES + 2 * longest, _CONE)
            work = work._replace(ends=np.empty((3, longest), np.int64), cones=cones)
        for row, (size, numbers) in enumerate(zip((_STARTS, _GOALS, _NEIGHBOURS), ends, strict=True)):
            work.ends[row, : len(numbers)] = numbers
            work.sizes[size] = len(numbers)
        try:
            _begin(self._map, work, *start, *goal)
            chunk = -1 if should_stop is None else 0
            while (status := _search(self._map, work, chunk)) in {_FULL, _PAUSED}:
                if status == _FULL:
                    work = _longer(work)
                elif should_stop is not None and should_stop():
                    break
                else:
                    chunk = _CHUNK
            expanded = int(work.sizes[_EXPANDED])
            if status == _NO_PATH:
                return None, inf, expanded, False
            root, bound_m = _reached(work)
            return None if root < 0 else _trace(work, root).tolist(), bound_m, expanded, status == _PAUSED
        finally:
            _clear(work)
            self._idle.append(work)

    def direct(self, start: Point, goal: Point, origin_m: Floats) -> DirectPath | None:
        """Return the shortest path between two points that lie well inside of one block each.

        Parameters
        ----------
        start, goal : (east, north)
            Metres on the map.
        origin_m : (2,) array
            Where the scene's origin lies on it.

        Returns
        -------
        DirectPath or None
            The path; None if there is none, or if an end lies near an edge: then `search` must be asked.
        """
        return self.answers(np.array((start, goal)).reshape(1, 2, 2), origin_m)[0]

    def answers(self, ends: Floats, origin_m: Floats) -> list[DirectPath | None]:
        """Return the paths of many queries as `direct` does, from an (n, 2, 2) array of starts and goals."""
        results, turns, points = self._answered(ends, origin_m, keeps=True)
        found: list[DirectPath | None] = []
        turned = kept = 0
        for length_m, status, expanded, last_turned, last_kept in results.tolist():
            answer = DirectPath(turns[turned:last_turned], points[kept:last_kept], length_m, expanded)
            found.append(answer if status == _FOUND else None)
            turned, kept = last_turned, last_kept
        return found

    def lengths_m(
        self, ends: Floats, origin_m: Floats, should_stop: Callable[[], bool] | None = None
    ) -> Floats:
        """Return the lengths in metres of the paths of many queries, infinite where `direct` returns None.

        Raises
        ------
        SearchStoppedError
            If the caller stopped it.
        """
        lengths_m: Floats = self._answered(ends, origin_m, keeps=False, should_stop=should_stop)[0][
            "length_m"
        ]
        return lengths_m

    def _answered(
        self,
        ends: Floats,
        origin_m: Floats,
        *,
        keeps: bool,
        should_stop: Callable[[], bool] | None = None,
    ) -> tuple[Records, Floats, Floats]:
        """Return a record for each query, the points of all paths one after the other, and of these those not on a straight way."""
        results, paths = np.empty(len(ends), _RESULT), np.empty((2, _PATH, 2))
        at = np.array([0, _NEXT, 0])
        chunk = -1 if should_stop is None else _CHUNK
        east, north = origin_m.tolist()
        work = self._take()
        try:
            while _many(self._map, work, ends, east, north, results, paths, keeps, at, chunk) < len(ends):
                if at[2] == _LONG:
                    longer = np.empty((2, 2 * paths.shape[1] + len(work.roots), 2))
                    longer[:, : paths.shape[1]] = paths
                    paths = longer
                elif at[2] == _FULL:
                    work = _longer(work)
                elif should_stop is not None and should_stop():
                    raise SearchStoppedError
        finally:
            _clear(work)
            self._idle.append(work)
        return results, paths[0], paths[1]

    def _take(self) -> _Work:
        try:
            return self._idle.pop()
        except IndexError:
            return _Work(
                np.empty(_CAPACITY, _ROOT),
                np.empty(_CAPACITY, _NODE),
                np.empty(_CAPACITY, _ENTRY),
                np.empty(2 * _MOST_CONES, _CONE),
                np.empty(self._map.ways.shape[1], _WAY),
                np.full(2 * len(self._map.corners), inf),
                np.empty((3, _MOST_CONES // 2), np.int64),
                np.empty(2),
                np.zeros(12, np.int64),
            )


def _longer(work: _Work) -> _Work:
    """Return arrays four times as long that hold what these hold."""
    length = 4 * len(work.nodes) + int(work.sizes[_LACKING])
    roots, nodes, heap = (np.empty(length, of) for of in (_ROOT, _NODE, _ENTRY))
    for longer, array, used in (
        (roots, work.roots, _ROOTS),
        (nodes, work.nodes, _NODES),
        (heap, work.heap, _HEAP),
    ):
        longer[: work.sizes[used]] = array[: work.sizes[used]]
    return work._replace(roots=roots, nodes=nodes, heap=heap)


@_inlined
def _strip(grid: Floats, strips: int, x: float) -> int:
    place = (x - grid[0]) * grid[1]
    if place >= strips:
        return strips - 1
    return int(place) if place > 0.0 else 0


@_compiled
def _count(places: Records, grid: Floats, bucket_first: Ints) -> None:
    """Count the blocks in each strip; then sum up."""
    strips = len(bucket_first) - 1
    for block in places:
        if block.east > -inf:
            first = _strip(grid, strips, block.west - 2.0 * TOLERANCE_M)
            for strip in range(first, _strip(grid, strips, block.east + 2.0 * TOLERANCE_M) + 1):
                bucket_first[strip + 1] += 1
    for strip in range(strips):
        bucket_first[strip + 1] += bucket_first[strip]


@_compiled
def _fill(places: Records, grid: Floats, bucket_first: Ints, bucket: Ints) -> None:
    strips = len(bucket_first) - 1
    free = bucket_first.copy()
    for number in range(len(places)):
        block = places[number]
        if block.east > -inf:
            first = _strip(grid, strips, block.west - 2.0 * TOLERANCE_M)
            for strip in range(first, _strip(grid, strips, block.east + 2.0 * TOLERANCE_M) + 1):
                bucket[free[strip]] = number
                free[strip] += 1


@_uncounted
def _locate(the_map: _Map, x: float, y: float) -> int:
    """Return the block that a point lies in; -1 if it lies in none or near any edge: then rounding decides, and `Places` must be asked."""
    found = -1
    inside_m = the_map.grid[2]
    strip = _strip(the_map.grid, len(the_map.bucket_first) - 1, x)
    for number in the_map.bucket[the_map.bucket_first[strip] : the_map.bucket_first[strip + 1]]:
        block = the_map.places[number]
        if block.west > x + TOLERANCE_M or block.east < x - TOLERANCE_M:
            continue
        floor_m = block.floor_x * x + block.floor_y * y + block.floor_m
        ceiling_m = block.ceiling_x * x + block.ceiling_y * y + block.ceiling_m
        if floor_m < -TOLERANCE_M or ceiling_m < -TOLERANCE_M:
            continue
        if (
            found >= 0
            or floor_m < inside_m
            or ceiling_m < inside_m
            or x - block.west < inside_m
            or block.east - x < inside_m
        ):
            return -1
        found = number
    return int(found)


@_released
def _many(
    the_map: _Map,
    work: _Work,
    ends: Floats,
    origin_x: float,
    origin_y: float,
    results: Records,
    paths: Floats,
    keeps: bool,  # noqa: FBT001 - compiled
    at: Ints,
    chunk: int,
) -> int:
    """Answer queries from the one in `at` on; return how many of them are done. If not all are, the last of `at` says why."""
    sizes = work.sizes
    left = chunk
    while at[0] < len(ends):
        number = at[0]
        result, start, goal = results[number], ends[number, 0], ends[number, 1]
        turned = kept = 0
        if keeps and number > 0:
            turned, kept = results[number - 1].turned, results[number - 1].kept
        result.turned, result.kept, result.length_m = turned, kept, inf
        if at[1] == _NEXT:
            start_x, start_y, goal_x, goal_y = (
                start[0] - origin_x,
                start[1] - origin_y,
                goal[0] - origin_x,
                goal[1] - origin_y,
            )
            here, there = _locate(the_map, start_x, start_y), _locate(the_map, goal_x, goal_y)
            if here < 0 or there < 0 or the_map.places[here].owner != the_map.places[there].owner:
                result.status, result.expanded = _UNUSUAL, 0
                at[0] += 1
                continue
            work.ends[_START_ROW, 0], work.ends[_GOAL_ROW, 0] = here, there
            sizes[_STARTS], sizes[_GOALS], sizes[_NEIGHBOURS] = 1, 1, 0
            _begin(the_map, work, start_x, start_y, goal_x, goal_y)
            at[1] = _GOING
        if at[1] == _GOING:
            result.status = _search(the_map, work, left)
            if result.status == _FULL or result.status == _PAUSED:  # noqa: PLR1714 - compiled
                at[2] = result.status
                return int(number)
            at[1] = _ENDED
            if chunk >= 0:
                left = max(left - sizes[_EXPANDED], 0)
        if result.status == _FOUND:
            root = work.nodes[sizes[_TAKEN]].root
            if turned + _turns(work, root) + 2 > paths.shape[1]:
                at[2] = _LONG
                return int(number)
            result.turned, result.kept, result.length_m = _draw(
                the_map, work, root, start, goal, origin_x, origin_y, paths, turned, kept
            )
        result.expanded = sizes[_EXPANDED]
        _clear(work)
        at[0], at[1] = number + 1, _NEXT
    return len(ends)


@_uncounted
def _turns(work: _Work, root: int) -> int:
    count = 0
    while root > 0:
        root = work.roots[root].before
        count += 1
    return count


@_compiled
def _trace(work: _Work, root: int) -> Ints:
    """Return the vertices that the path to a root turns at."""
    count = _turns(work, root)
    turns = np.empty(count, dtype=np.int64)
    while root > 0:
        count -= 1
        turns[count] = work.roots[root].turn >> 1
        root = work.roots[root].before
    return turns


@_uncounted
def _draw(
    the_map: _Map,
    work: _Work,
    root: int,
    start: Floats,
    goal: Floats,
    origin_x: float,
    origin_y: float,
    paths: Floats,
    turned: int,
    kept: int,
) -> tuple[int, int, float]:
    """Write a path's points, and those that `straightened` keeps of them, behind those of the queries before; return where they end, and the length."""
    turns, points = paths[0], paths[1]
    count = _turns(work, root)
    place = turned + count
    while root > 0:
        vertex = work.roots[root].turn >> 1
        turns[place, 0], turns[place, 1] = (
            the_map.points[vertex, 0] + origin_x,
            the_map.points[vertex, 1] + origin_y,
        )
        root = work.roots[root].before
        place -= 1
    turns[place, 0], turns[place, 1] = start[0], start[1]
    last = turned + count + 1
    turns[last, 0], turns[last, 1] = goal[0], goal[1]
    points[kept, 0], points[kept, 1] = start[0], start[1]
    length_m = 0.0
    for here in range(turned + 1, last + 1):
        way_east, way_north = turns[here, 0] - points[kept, 0], turns[here, 1] - points[kept, 1]
        if here < last:
            rest_east, rest_north = turns[here + 1, 0] - turns[here, 0], turns[here + 1, 1] - turns[here, 1]
            east, north = turns[here + 1, 0] - points[kept, 0], turns[here + 1, 1] - points[kept, 1]
            aside_m = abs(way_east * rest_north - way_north * rest_east)
            onwards = way_east * rest_east + way_north * rest_north >= 0.0
            if (way_east == 0.0 and way_north == 0.0) or (
                onwards and aside_m <= STRAIGHT_M * sqrt(east * east + north * north)
            ):
                continue
        length_m += sqrt(way_east * way_east + way_north * way_north)
        kept += 1
        points[kept, 0], points[kept, 1] = turns[here, 0], turns[here, 1]
    return last + 1, kept + 1, length_m


@_uncounted
def _clear(work: _Work) -> None:
    """Forget the lengths that a search has come to know."""
    for root in work.roots[1 : work.sizes[_ROOTS]]:
        work.best[root.turn] = inf
    work.sizes[_ROOTS] = 1


@_uncounted
def _reached(work: _Work) -> tuple[int, float]:
    """Return the root from which the goal was reached, -1 if it was not, and a length that no path is shorter than."""
    if work.sizes[_TAKEN] >= 0:
        node = work.nodes[work.sizes[_TAKEN]]
        return int(node.root), float(node.f_m)
    least, f_m = -1, inf
    for entry in work.heap[: work.sizes[_HEAP]]:
        if work.nodes[entry.node].block == _GOAL and (
            entry.f_m < f_m or (entry.f_m == f_m and (least < 0 or entry.node < least))
        ):
            least, f_m = entry.node, entry.f_m
    return int(work.nodes[least].root) if least >= 0 else -1, float(work.heap[0].f_m)


@_uncounted
def _search(the_map: _Map, work: _Work, chunk: int) -> int:
    """Go on with a search until it ends, or for so many nodes (-1: without a limit)."""
    sizes, roots, nodes, best = work.sizes, work.roots, work.nodes, work.best
    goal_x, goal_y = work.goal[0], work.goal[1]
    root = sizes[_ROOT_NOW]
    last = sizes[_EXPANDED] + chunk
    while True:
        if sizes[_NODES] + _MARGIN + sizes[_LACKING] > len(nodes):
            sizes[_ROOT_NOW] = root
            return _FULL
        if sizes[_FOLLOWED] < sizes[_CONES]:
            sizes[_LACKING] = _follow(the_map, work, goal_x, goal_y, root, work.cones[sizes[_FOLLOWED]])
            sizes[_FOLLOWED] += sizes[_LACKING] == 0
            continue
        if sizes[_HEAP] == 0:
            return _NO_PATH
        if chunk >= 0 and sizes[_EXPANDED] >= last:
            return _PAUSED
        number = _pop(work)
        sizes[_EXPANDED] += 1
        sizes[_FOLLOWED] = 0
        node = nodes[number]
        root = node.root
        if node.block == _GOAL:
            sizes[_TAKEN] = number
            return _FOUND
        if roots[root].turn >= 0 and roots[root].g_m > best[roots[root].turn]:
            sizes[_CONES] = 0
        elif node.block == _TURN:
            sizes[_CONES] = _turn(the_map, work, goal_x, goal_y, root)
        else:
            cone = work.cones[0]
            cone.block, cone.direction, cone.steps = node.block, node.direction, 0
            cone.low, cone.high = node.low, node.high
            sizes[_CONES] = 1


@_uncounted
def _begin(the_map: _Map, work: _Work, start_x: float, start_y: float, goal_x: float, goal_y: float) -> None:
    """Queue the corners next to the start, and find the cones that it sees."""
    sizes, root, starts = work.sizes, work.roots[0], work.ends[_START_ROW]
    root.x, root.y, root.g_m, root.before, root.turn = start_x, start_y, 0.0, -1, -1
    work.goal[0], work.goal[1] = goal_x, goal_y
    sizes[_ROOTS], sizes[_NODES], sizes[_HEAP], sizes[_EXPANDED], sizes[_LACKING] = 1, 0, 0, 0, 0
    sizes[_CONES], sizes[_FOLLOWED], sizes[_ROOT_NOW], sizes[_TAKEN] = 0, 0, 0, -1
    for block in starts[: sizes[_STARTS]]:
        if _holds_goal(work, block):
            _push_goal(work, goal_x, goal_y, 0)
            return
    for vertex in work.ends[_NEIGHBOUR_ROW, : sizes[_NEIGHBOURS]]:
        _reach(the_map, work, goal_x, goal_y, 0, vertex, _LEFT)
        _reach(the_map, work, goal_x, goal_y, 0, vertex, _RIGHT)
    for block in starts[: sizes[_STARTS]]:
        for direction in (_EAST, _WEST):
            cone = work.cones[sizes[_CONES]]
            cone.block, cone.direction, cone.low, cone.high, cone.steps = block, direction, -inf, inf, 0
            sizes[_CONES] += 1


@_inlined
def _follow(
    the_map: _Map,
    work: _Work,
    goal_x: float,
    goal_y: float,
    root: int,
    cone: Any,  # noqa: ANN401 - a record
) -> int:
    """Follow a cone as long as there is one way on and queue those it divides into.

    Return how many entries it lacks room for: 0, or the cone is left where it has come to, to be followed again.
    """
    first, last, sizes, nodes = the_map.first, the_map.last, work.sizes, work.nodes
    block, direction, low, high, steps = cone.block, cone.direction, cone.low, cone.high, cone.steps
    while True:
        entries = 4 * (last[direction, block] - first[direction, block])
        if sizes[_NODES] + _MARGIN + entries > len(nodes):
            cone.block, cone.low, cone.high, cone.steps = block, low, high, steps
            return int(entries)
        if _holds_goal(work, block) and _sees_goal(goal_x, goal_y, work.roots[root], low, high):
            _push_goal(work, goal_x, goal_y, root)
        count = _look(the_map, work, goal_x, goal_y, root, block, direction, low, high)
        if count != 1:
            break
        low, high = work.seen[0].low, work.seen[0].high
        way = the_map.ways[direction, work.seen[0].way]
        block = way.block
        steps += 1
        if (
            steps % 8 == 0
            and sizes[_HEAP] > 0
            and _bound(goal_x, goal_y, work.roots[root], way, low, high) > work.heap[0].f_m
        ):
            break
    for one in work.seen[:count]:
        way = the_map.ways[direction, one.way]
        f_m = _bound(goal_x, goal_y, work.roots[root], way, one.low, one.high)
        _push(work, f_m, way.block, direction, root, one.low, one.high)
    return 0


@_inlined
def _look(
    the_map: _Map,
    work: _Work,
    goal_x: float,
    goal_y: float,
    root: int,
    block: int,
    direction: int,
    low: float,
    high: float,
) -> int:
    """Find the ways out of a block that a cone sees, reach the corners beside them, and return how many there are."""
    seen = work.seen
    root_x, root_y = work.roots[root].x, work.roots[root].y
    low_side = _RIGHT if direction == _EAST else _LEFT
    count = 0
    for place in range(the_map.first[direction, block], the_map.last[direction, block]):
        way = the_map.ways[direction, place]
        run = way.east - root_x if direction == _EAST else root_x - way.east
        if run <= 0.0:
            continue
        rise_low, ray_high = way.south - root_y, high * run + _SLACK_M
        if ray_high < rise_low:
            continue
        rise_high, ray_low = way.north - root_y, low * run - _SLACK_M
        if ray_low > rise_high:
            continue
        new_low, new_high = low, high
        if way.low_end != -1 and rise_low >= ray_low:
            if way.low_end >= 0:
                _reach(the_map, work, goal_x, goal_y, root, way.low_end, low_side)
            slope = rise_low / run
            if slope > low:
                new_low = slope
        if way.high_end != -1 and rise_high <= ray_high:
            if way.high_end >= 0:
                _reach(the_map, work, goal_x, goal_y, root, way.high_end, 1 - low_side)
            slope = rise_high / run
            if slope < high:
                new_high = slope
        if new_low <= new_high:
            seen[count].way, seen[count].low, seen[count].high = place, new_low, new_high
            count += 1
    return count


@_inlined
def _holds_goal(work: _Work, block: int) -> bool:
    for place in range(work.sizes[_GOALS]):  # noqa: SIM110 - compiled
        if work.ends[_GOAL_ROW, place] == block:
            return True
    return False


@_inlined
def _sees_goal(goal_x: float, goal_y: float, root: Any, low: float, high: float) -> bool:  # noqa: ANN401 - a record
    run = abs(goal_x - root.x)
    rise = goal_y - root.y
    if run <= 0.0:
        return high == inf if rise >= 0.0 else low == -inf
    return bool(low * run - _SLACK_M <= rise <= high * run + _SLACK_M)


@_uncounted
def _push(work: _Work, f_m: float, block: int, direction: int, root: int, low: float, high: float) -> None:
    """Queue a node. Nodes are numbered as they come, so their number breaks ties as the plain search does."""
    heap, number, place = work.heap, work.sizes[_NODES], work.sizes[_HEAP]
    node = work.nodes[number]
    node.f_m, node.low, node.high, node.block, node.direction, node.root = (
        f_m,
        low,
        high,
        block,
        direction,
        root,
    )
    work.sizes[_NODES] += 1
    work.sizes[_HEAP] += 1
    while place > 0:
        parent = (place - 1) >> 1
        if heap[parent].f_m <= f_m:  # of equals the older one is the lesser
            break
        heap[place].f_m, heap[place].node = heap[parent].f_m, heap[parent].node
        place = parent
    heap[place].f_m, heap[place].node = f_m, number


@_uncounted
def _pop(work: _Work) -> int:
    heap = work.heap
    top = heap[0].node
    work.sizes[_HEAP] -= 1
    size = work.sizes[_HEAP]
    f_m, number = heap[size].f_m, heap[size].node
    place = 0
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size:
            left, right = heap[child].f_m, heap[child + 1].f_m
            if right < left or (right == left and heap[child + 1].node < heap[child].node):
                child += 1
        other = heap[child].f_m
        if f_m < other or (f_m == other and number < heap[child].node):
            break
        heap[place].f_m, heap[place].node = other, heap[child].node
        place = child
    heap[place].f_m, heap[place].node = f_m, number
    return int(top)


@_uncounted
def _push_goal(work: _Work, goal_x: float, goal_y: float, root: int) -> None:
    east, north = goal_x - work.roots[root].x, goal_y - work.roots[root].y
    _push(work, work.roots[root].g_m + sqrt(east * east + north * north), _GOAL, 0, root, 0.0, 0.0)


@_uncounted
def _reach(
    the_map: _Map, work: _Work, goal_x: float, goal_y: float, root: int, vertex: int, side: int
) -> None:
    corner, here, best = the_map.corners[vertex], work.roots[root], work.best
    east, north = corner.x - here.x, corner.y - here.y
    slack = _SLACK_M * (abs(east) + abs(north))
    to_before = east * corner.before_north - north * corner.before_east
    to_after = east * corner.after_north - north * corner.after_east
    if side == _LEFT:
        if to_before < -slack or to_after < -slack:
            return
    elif to_before > slack or to_after > slack:
        return
    g_m = here.g_m + sqrt(east * east + north * north)
    turn = 2 * vertex + side
    if g_m >= best[turn] or g_m > best[turn ^ 1] + _SLACK_M:
        return
    best[turn] = g_m
    number = work.sizes[_ROOTS]
    work.sizes[_ROOTS] += 1
    new = work.roots[number]
    new.x, new.y, new.g_m, new.before, new.turn = corner.x, corner.y, g_m, root, turn
    east, north = goal_x - corner.x, goal_y - corner.y
    _push(work, g_m + sqrt(east * east + north * north), _TURN, 0, number, 0.0, 0.0)


@_inlined
def _quarter(east: float, north: float) -> int:
    if east > 0.0:
        return 0
    if east < 0.0:
        return 2
    return 1 if north > 0.0 else 3


@_uncounted
def _turn(the_map: _Map, work: _Work, goal_x: float, goal_y: float, root: int) -> int:
    """Find the cones between the way a path came to a corner and the boundary it turns towards, and return how many there are."""
    here = work.roots[root]
    vertex, side = here.turn >> 1, here.turn & 1
    corner, before = the_map.corners[vertex], work.roots[here.before]
    mirror = 1.0 if side == _LEFT else -1.0
    east, north = corner.x - before.x, mirror * (corner.y - before.y)
    if side == _LEFT:
        edge_east, edge_north = corner.before_east, corner.before_north
        east_block, west_block = corner.east_below, corner.west_above
    else:
        edge_east, edge_north = corner.after_east, -corner.after_north
        east_block, west_block = corner.east_above, corner.west_below
    count = 0
    if east * edge_north <= north * edge_east and east * edge_east + north * edge_north > 0.0:
        east, north = edge_east, edge_north
    quarter, last = _quarter(east, north), _quarter(edge_east, edge_north)
    while True:
        done = quarter == last
        if quarter == 0 or quarter == 2:  # noqa: PLR1714 - compiled
            if quarter == 0:
                low = north / east if east > 0.0 else -inf
                high = edge_north / edge_east if done else inf
                if high < low:
                    low = high
            else:
                high = north / -east if east < 0.0 else inf
                low = edge_north / -edge_east if done else -inf
                if low > high:
                    high = low
            cone = work.cones[count]
            cone.block, cone.direction = (east_block, _EAST) if quarter == 0 else (west_block, _WEST)
            cone.low, cone.high = (low, high) if side == _LEFT else (-high, -low)
            cone.steps = 0
            count += cone.block >= 0
        else:
            _straight(the_map, work, goal_x, goal_y, root, vertex, (quarter == 1) == (side == _LEFT))
        if done:
            return count
        quarter = (quarter + 1) % 4
        east = 0.0


@_uncounted
def _straight(
    the_map: _Map,
    work: _Work,
    goal_x: float,
    goal_y: float,
    root: int,
    vertex: int,
    upwards: bool,  # noqa: FBT001 - compiled
) -> None:
    """Reach what stands on the line of a vertex, straight above or below it."""
    corner = the_map.corners[vertex]
    if upwards:
        neighbour, west, east, rise = corner.above, corner.west_above, corner.east_above, goal_y - corner.y
    else:
        neighbour, west, east, rise = corner.below, corner.west_below, corner.east_below, corner.y - goal_y
    if (
        abs(goal_x - corner.x) <= TOLERANCE_M
        and rise >= 0.0
        and (_holds_goal(work, west) or _holds_goal(work, east))
    ):
        _push_goal(work, goal_x, goal_y, root)
    if neighbour >= 0:
        _reach(the_map, work, goal_x, goal_y, root, neighbour, _LEFT)
        _reach(the_map, work, goal_x, goal_y, root, neighbour, _RIGHT)


@_inlined
def _bound(goal_x: float, goal_y: float, root: Any, way: Any, low: float, high: float) -> float:  # noqa: ANN401 - records
    g_m: float = root.g_m
    run, beyond = abs(way.east - root.x), abs(goal_x - way.east)
    rise = goal_y - root.y
    total = run + beyond
    cross = rise * run / total
    seen_low, ray_low = way.south - root.y, low * run
    if ray_low > seen_low:
        seen_low = ray_low
    seen_high, ray_high = way.north - root.y, high * run
    if ray_high < seen_high:
        seen_high = ray_high
    if cross < seen_low:
        cross = seen_low
    elif cross > seen_high:
        cross = seen_high
    else:
        return g_m + sqrt(total * total + rise * rise)
    rest = rise - cross
    return g_m + sqrt(run * run + cross * cross) + sqrt(beyond * beyond + rest * rest)
