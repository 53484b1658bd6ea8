"""The search of `pbpp.any_angle`, compiled by numba (extra ``fast``) over flat arrays.

It does the same operations in the same order as the plain search, so that its answers are the same to the last bit; the tests compare them. What
is explained there is not explained again here. numba compiles on the first call (some 20 s) and keeps the result in its cache, from which
a later process loads it in a fraction of a second.
"""

# numba reads loops over indices and explicit comparisons best; min and max of Python and numba part on signed zeros.
# ruff: noqa: PLR0913, PLR0917, C901, PLR0912, PLR0915, PLR1730

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numba
import numpy as np

from .partition.base import TOLERANCE_M

if TYPE_CHECKING:
    from collections.abc import Callable

    from .geometry import Floats, Point
    from .partition.slabs import Slabs
    from .partition.vertices import Ints

__all__ = ["FlatSlabs", "flatten", "search"]

_GOAL, _TURN = -1, -2  # marks in the place of a block's number
_SLACK_M = 1e-10  # as in `any_angle`: the paths must be the same
_EAST, _WEST = 1, 0
_RIGHT, _LEFT = 0, 1  # indices
# Entries of the queue at first; where they do not suffice the search begins again with four times as many.
_CAPACITY = 4096
_MARGIN = 32  # entries kept free for one step's own

_compiled: Callable[..., Any] = numba.njit(cache=True, error_model="numpy")


class FlatSlabs(NamedTuple):
    """Slabs as arrays: what the compiled search reads.

    Parameters
    ----------
    first : (2, b + 1) array of int
        Where the ways of each block begin in the arrays below, westwards and eastwards.
    ways_m : (2, p, 3) array
        East, low and high north of each portal in metres.
    ways : (2, p, 3) array of int
        Its low and its high vertex and the block behind it.
    fans : (n, 6) array
        Of each vertex east and north, and the way to the vertex before it and to the one after it, in metres.
    beside : (4, n) array of int
        The blocks west above, west below, east above and east below of each vertex.
    above, below : (n,) array of int
        The corner straight above and straight below each vertex.
    """

    first: Ints
    ways_m: Floats
    ways: Ints
    fans: Floats
    beside: Ints
    above: Ints
    below: Ints


def flatten(slabs: Slabs) -> FlatSlabs:
    """Return slabs as arrays.

    Parameters
    ----------
    slabs : Slabs
        The partition of free space.

    Returns
    -------
    FlatSlabs
        The same.
    """
    first = np.array([np.cumsum([0, *map(len, side)]) for side in slabs.ways], dtype=np.int64)
    rows = np.array(
        [[way for block in side for way in block] for side in slabs.ways], dtype=np.float64
    ).reshape(2, -1, 6)
    return FlatSlabs(
        first,
        np.ascontiguousarray(rows[:, :, :3]),
        rows[:, :, 3:].astype(np.int64),
        np.array(slabs.vertices.fans, dtype=np.float64).reshape(-1, 6),
        np.array(slabs.beside, dtype=np.int64),
        np.array(slabs.above, dtype=np.int64),
        np.array(slabs.below, dtype=np.int64),
    )


def search(
    flat: FlatSlabs,
    start: Point,
    goal: Point,
    start_blocks: list[int],
    goal_blocks: list[int],
    neighbours: list[int],
) -> tuple[list[int] | None, float, int]:
    """Return the shortest path between two points of free space.

    Parameters
    ----------
    flat : FlatSlabs
        The partition of free space.
    start, goal : (east, north)
        Metres from the scene's origin, in free space or on its boundary.
    start_blocks, goal_blocks : list of int
        The blocks that they lie in.
    neighbours : list of int
        The vertices next to the start on the side line of a block.

    Returns
    -------
    tuple
        The vertices that the path turns at, or None if there is no path; its length in metres; how many nodes were taken from the queue.
    """
    capacity = _CAPACITY
    while True:
        turns, length_m, expanded = _run(
            *flat,
            np.array((*start, *goal), dtype=np.float64),
            np.array(start_blocks, dtype=np.int64),
            np.array(goal_blocks, dtype=np.int64),
            np.array(neighbours, dtype=np.int64),
            capacity,
        )
        if expanded >= 0:
            return turns.tolist() if length_m < inf else None, length_m, expanded
        capacity *= 4  # the queue did not fit: the same again with more room


@_compiled
def _run(
    first: Ints,
    ways_m: Floats,
    ways: Ints,
    fans: Floats,
    beside: Ints,
    above: Ints,
    below: Ints,
    ends: Floats,
    start_blocks: Ints,
    goal_blocks: Ints,
    neighbours: Ints,
    capacity: int,
) -> tuple[Ints, float, int]:
    goal_x, goal_y = ends[2], ends[3]
    best = np.full(2 * len(fans), inf)
    root_m = np.empty((capacity, 3))  # east, north, length up to it
    root_i = np.empty((capacity, 2), dtype=np.int64)  # root before, turn
    node_m = np.empty((capacity, 3))  # f, low slope, high slope
    node_i = np.empty((capacity, 3), dtype=np.int64)  # block or _GOAL or _TURN, direction, root
    heap = np.empty(capacity, dtype=np.int64)
    count = np.zeros(3, dtype=np.int64)  # roots, nodes, length of the heap
    # One expansion adds at most this many nodes and roots beyond a block's ways.
    found_way = np.empty(len(ways_m[0]) + 1, dtype=np.int64)
    found_m = np.empty((len(ways_m[0]) + 1, 2))
    cone_i = np.empty((8, 2), dtype=np.int64)
    cone_m = np.empty((8, 2))

    root_m[0, 0], root_m[0, 1], root_m[0, 2] = ends[0], ends[1], 0.0
    root_i[0, 0], root_i[0, 1] = -1, -1
    count[0] = 1
    expanded = 0
    begun = False
    while True:
        cones = 0
        root = 0
        if not begun:
            begun = True
            same = False
            for block in start_blocks:
                if _holds(goal_blocks, block):
                    same = True
            if same:
                _push_goal(goal_x, goal_y, root_m, node_m, node_i, heap, count, 0)
            else:
                for vertex in neighbours:
                    for side in (_LEFT, _RIGHT):
                        _reach(
                            goal_x,
                            goal_y,
                            fans,
                            best,
                            root_m,
                            root_i,
                            node_m,
                            node_i,
                            heap,
                            count,
                            0,
                            vertex,
                            side,
                        )
                cones = -1
        else:
            if count[2] == 0:
                return np.empty(0, dtype=np.int64), inf, expanded
            node = _pop(node_m, heap, count)
            expanded += 1
            root = node_i[node, 2]
            if node_i[node, 0] == _GOAL:
                return _trace(root_i, root), node_m[node, 0], expanded
            turn = root_i[root, 1]
            if turn >= 0 and root_m[root, 2] > best[turn]:
                continue
            if node_i[node, 0] == _TURN:
                cones = _turn(
                    goal_x,
                    goal_y,
                    fans,
                    beside,
                    above,
                    below,
                    goal_blocks,
                    best,
                    root_m,
                    root_i,
                    node_m,
                    node_i,
                    heap,
                    count,
                    cone_i,
                    cone_m,
                    root,
                )
            else:
                cone_i[0, 0], cone_i[0, 1] = node_i[node, 0], node_i[node, 1]
                cone_m[0, 0], cone_m[0, 1] = node_m[node, 1], node_m[node, 2]
                cones = 1
        start_cones = 2 * len(start_blocks)
        for cone in range(start_cones if cones < 0 else cones):
            if cones < 0:
                block, direction, low, high = start_blocks[cone >> 1], 1 - (cone & 1), -inf, inf
            else:
                block, direction, low, high = (
                    cone_i[cone, 0],
                    cone_i[cone, 1],
                    cone_m[cone, 0],
                    cone_m[cone, 1],
                )
            root_x, root_y, root_g = root_m[root, 0], root_m[root, 1], root_m[root, 2]
            low_side = _RIGHT if direction == _EAST else _LEFT
            steps = 0
            while True:
                if (
                    count[1] + _MARGIN + 4 * (first[direction, block + 1] - first[direction, block])
                    > capacity
                ):
                    return np.empty(0, dtype=np.int64), inf, -1
                if _holds(goal_blocks, block):
                    run = abs(goal_x - root_x)
                    rise = goal_y - root_y
                    if run <= 0.0:
                        seen = high == inf if rise >= 0.0 else low == -inf
                    else:
                        seen = low * run - _SLACK_M <= rise <= high * run + _SLACK_M
                    if seen:
                        _push_goal(goal_x, goal_y, root_m, node_m, node_i, heap, count, root)
                found = 0
                for way in range(first[direction, block], first[direction, block + 1]):
                    east = ways_m[direction, way, 0]
                    run = east - root_x if direction == _EAST else root_x - east
                    if run <= 0.0:
                        continue
                    rise_low, ray_high = ways_m[direction, way, 1] - root_y, high * run + _SLACK_M
                    if ray_high < rise_low:
                        continue
                    rise_high, ray_low = ways_m[direction, way, 2] - root_y, low * run - _SLACK_M
                    if ray_low > rise_high:
                        continue
                    low_end, high_end = ways[direction, way, 0], ways[direction, way, 1]
                    new_low, new_high = low, high
                    if low_end != -1 and rise_low >= ray_low:
                        if low_end >= 0:
                            _reach(
                                goal_x,
                                goal_y,
                                fans,
                                best,
                                root_m,
                                root_i,
                                node_m,
                                node_i,
                                heap,
                                count,
                                root,
                                low_end,
                                low_side,
                            )
                        slope = rise_low / run
                        if slope > low:
                            new_low = slope
                    if high_end != -1 and rise_high <= ray_high:
                        if high_end >= 0:
                            _reach(
                                goal_x,
                                goal_y,
                                fans,
                                best,
                                root_m,
                                root_i,
                                node_m,
                                node_i,
                                heap,
                                count,
                                root,
                                high_end,
                                1 - low_side,
                            )
                        slope = rise_high / run
                        if slope < high:
                            new_high = slope
                    if new_low <= new_high:
                        found_way[found] = way
                        found_m[found, 0], found_m[found, 1] = new_low, new_high
                        found += 1
                if found != 1:
                    break
                way, low, high = found_way[0], found_m[0, 0], found_m[0, 1]
                block = ways[direction, way, 2]
                steps += 1
                if steps % 8 == 0 and count[2] > 0:
                    f_m = _bound(
                        goal_x,
                        goal_y,
                        root_x,
                        root_y,
                        root_g,
                        ways_m[direction, way, 0],
                        ways_m[direction, way, 1],
                        ways_m[direction, way, 2],
                        low,
                        high,
                    )
                    if f_m > node_m[heap[0], 0]:
                        break
            for place in range(found):
                way, low, high = found_way[place], found_m[place, 0], found_m[place, 1]
                f_m = _bound(
                    goal_x,
                    goal_y,
                    root_x,
                    root_y,
                    root_g,
                    ways_m[direction, way, 0],
                    ways_m[direction, way, 1],
                    ways_m[direction, way, 2],
                    low,
                    high,
                )
                _push(node_m, node_i, heap, count, f_m, ways[direction, way, 2], direction, root, low, high)


@_compiled
def _holds(blocks: Ints, block: int) -> bool:
    for one in blocks:  # noqa: SIM110 - compiled
        if one == block:
            return True
    return False


@_compiled
def _trace(root_i: Ints, root: int) -> Ints:
    count = 0
    one = root
    while one > 0:
        one = root_i[one, 0]
        count += 1
    turns = np.empty(count, dtype=np.int64)
    while root > 0:
        count -= 1
        turns[count] = root_i[root, 1] >> 1
        root = root_i[root, 0]
    return turns


@_compiled
def _push(
    node_m: Floats,
    node_i: Ints,
    heap: Ints,
    count: Ints,
    f_m: float,
    block: int,
    direction: int,
    root: int,
    low: float,
    high: float,
) -> None:
    """Queue a node. Nodes are numbered as they come, so their number breaks ties as the plain search does."""
    node = count[1]
    node_m[node, 0], node_m[node, 1], node_m[node, 2] = f_m, low, high
    node_i[node, 0], node_i[node, 1], node_i[node, 2] = block, direction, root
    place = count[2]
    count[1] += 1
    count[2] += 1
    while place > 0:
        parent = (place - 1) >> 1
        if node_m[heap[parent], 0] <= f_m:  # of equals the older one is the lesser
            break
        heap[place] = heap[parent]
        place = parent
    heap[place] = node


@_compiled
def _pop(node_m: Floats, heap: Ints, count: Ints) -> int:
    top = heap[0]
    count[2] -= 1
    size = count[2]
    node = heap[size]
    f_m = node_m[node, 0]
    place = 0
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size:
            left, right = node_m[heap[child], 0], node_m[heap[child + 1], 0]
            if right < left or (right == left and heap[child + 1] < heap[child]):
                child += 1
        other = node_m[heap[child], 0]
        if f_m < other or (f_m == other and node < heap[child]):
            break
        heap[place] = heap[child]
        place = child
    heap[place] = node
    return int(top)


@_compiled
def _push_goal(
    goal_x: float,
    goal_y: float,
    root_m: Floats,
    node_m: Floats,
    node_i: Ints,
    heap: Ints,
    count: Ints,
    root: int,
) -> None:
    east, north = goal_x - root_m[root, 0], goal_y - root_m[root, 1]
    _push(
        node_m,
        node_i,
        heap,
        count,
        root_m[root, 2] + sqrt(east * east + north * north),
        _GOAL,
        0,
        root,
        0.0,
        0.0,
    )


@_compiled
def _reach(
    goal_x: float,
    goal_y: float,
    fans: Floats,
    best: Floats,
    root_m: Floats,
    root_i: Ints,
    node_m: Floats,
    node_i: Ints,
    heap: Ints,
    count: Ints,
    root: int,
    vertex: int,
    side: int,
) -> None:
    x, y = fans[vertex, 0], fans[vertex, 1]
    east, north = x - root_m[root, 0], y - root_m[root, 1]
    slack = _SLACK_M * (abs(east) + abs(north))
    to_before = east * fans[vertex, 3] - north * fans[vertex, 2]
    to_after = east * fans[vertex, 5] - north * fans[vertex, 4]
    if side == _LEFT:
        if to_before < -slack or to_after < -slack:
            return
    elif to_before > slack or to_after > slack:
        return
    g_m = root_m[root, 2] + sqrt(east * east + north * north)
    turn = 2 * vertex + side
    if g_m >= best[turn] or g_m > best[turn ^ 1] + _SLACK_M:
        return
    best[turn] = g_m
    number = count[0]
    count[0] += 1
    root_m[number, 0], root_m[number, 1], root_m[number, 2] = x, y, g_m
    root_i[number, 0], root_i[number, 1] = root, turn
    east, north = goal_x - x, goal_y - y
    _push(node_m, node_i, heap, count, g_m + sqrt(east * east + north * north), _TURN, 0, number, 0.0, 0.0)


@_compiled
def _quarter(east: float, north: float) -> int:
    if east > 0.0:
        return 0
    if east < 0.0:
        return 2
    return 1 if north > 0.0 else 3


@_compiled
def _turn(
    goal_x: float,
    goal_y: float,
    fans: Floats,
    beside: Ints,
    above: Ints,
    below: Ints,
    goal_blocks: Ints,
    best: Floats,
    root_m: Floats,
    root_i: Ints,
    node_m: Floats,
    node_i: Ints,
    heap: Ints,
    count: Ints,
    cone_i: Ints,
    cone_m: Floats,
    root: int,
) -> int:
    vertex, side = root_i[root, 1] >> 1, root_i[root, 1] & 1
    mirror = 1.0 if side == _LEFT else -1.0
    before = root_i[root, 0]
    x, y = fans[vertex, 0], fans[vertex, 1]
    east, north = x - root_m[before, 0], mirror * (y - root_m[before, 1])
    if side == _LEFT:
        edge_east, edge_north = fans[vertex, 2], fans[vertex, 3]
        east_block, west_block = beside[3, vertex], beside[0, vertex]
    else:
        edge_east, edge_north = fans[vertex, 4], fans[vertex, 5]
        east_block, west_block = beside[2, vertex], beside[1, vertex]
    edge_north *= mirror
    cones = 0
    if east * edge_north <= north * edge_east and east * edge_east + north * edge_north > 0.0:
        east, north = edge_east, edge_north
    quarter = _quarter(east, north)
    last = _quarter(edge_east, edge_north)
    while True:
        done = quarter == last
        if quarter == 0 or quarter == 2:  # noqa: PLR1714 - compiled
            if quarter == 0:
                low = north / east if east > 0.0 else -inf
                high = edge_north / edge_east if done else inf
                if high < low:
                    low = high
                block = east_block
            else:
                high = north / -east if east < 0.0 else inf
                low = edge_north / -edge_east if done else -inf
                if low > high:
                    high = low
                block = west_block
            if block >= 0:
                cone_i[cones, 0] = block
                cone_i[cones, 1] = _EAST if quarter == 0 else _WEST
                cone_m[cones, 0] = low if side == _LEFT else -high
                cone_m[cones, 1] = high if side == _LEFT else -low
                cones += 1
        else:
            upwards = (quarter == 1) == (side == _LEFT)
            neighbour = above[vertex] if upwards else below[vertex]
            rise = goal_y - y if upwards else y - goal_y
            row = 0 if upwards else 1
            if (
                abs(goal_x - x) <= TOLERANCE_M
                and rise >= 0.0
                and (_holds(goal_blocks, beside[row, vertex]) or _holds(goal_blocks, beside[row + 2, vertex]))
            ):
                _push_goal(goal_x, goal_y, root_m, node_m, node_i, heap, count, root)
            if neighbour >= 0:
                for turned in (_LEFT, _RIGHT):
                    _reach(
                        goal_x,
                        goal_y,
                        fans,
                        best,
                        root_m,
                        root_i,
                        node_m,
                        node_i,
                        heap,
                        count,
                        root,
                        neighbour,
                        turned,
                    )
        if done:
            return cones
        quarter = (quarter + 1) % 4
        east = 0.0


@_compiled
def _bound(
    goal_x: float,
    goal_y: float,
    root_x: float,
    root_y: float,
    root_g: float,
    east: float,
    south: float,
    north: float,
    low: float,
    high: float,
) -> float:
    run, beyond = abs(east - root_x), abs(goal_x - east)
    rise = goal_y - root_y
    total = run + beyond
    cross = rise * run / total
    seen_low, ray_low = south - root_y, low * run
    if ray_low > seen_low:
        seen_low = ray_low
    seen_high, ray_high = north - root_y, high * run
    if ray_high < seen_high:
        seen_high = ray_high
    if cross < seen_low:
        cross = seen_low
    elif cross > seen_high:
        cross = seen_high
    else:
        return root_g + sqrt(total * total + rise * rise)
    rest = rise - cross
    return root_g + sqrt(run * run + cross * cross) + sqrt(beyond * beyond + rest * rest)
