"""The search of `pbpp.any_angle`, compiled by numba over flat arrays.

It does the same operations in the same order as the plain search, so that its answers are the same to the last bit; the tests compare them. What
is explained there is not explained again here. numba compiles on the first call (about 10 s of the CPU) and keeps the result in its cache, from which
a later process loads it in a fraction of a second. All that is compiled stands in this one module: the cache of a function does not see that a
function it calls has changed in another file.
"""

# numba reads loops over indices and explicit comparisons best; min and max of Python and numba part on signed zeros.
# ruff: noqa: PLR0913, PLR0917, PLR1730

from __future__ import annotations

from functools import partial
from math import inf, sqrt
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from pbpp.partition.base import TOLERANCE_M
from pbpp.partition.flat import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from pbpp.geometry import Floats, Point
    from pbpp.partition.flat import FlatSlabs, Records
    from pbpp.partition.vertices import Ints

__all__ = ["search"]

_GOAL, _TURN = -1, -2  # marks in the place of a block's number
_SLACK_M = 1e-10  # as in `any_angle`: the paths must be the same
_EAST, _WEST = 1, 0
_RIGHT, _LEFT = 0, 1  # indices
# Entries of the queue at first; where they do not suffice it becomes four times as long. Twice as many took 6 microseconds more for each query: arrays
# of 128 KB and more come from the operating system anew.
_CAPACITY = 2048
_MARGIN = 32  # entries kept free for one step's own
_MOST_CONES = 8  # of a turn

_ROOT = record("x y g_m", "before turn")
_NODE = record("f_m low high", "block direction root")  # a cone, or a mark in the place of its block
_CONE = record("low high", "block direction steps")
_WAY = record("low high", "way")  # a way out of a block, as far as it is seen

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy"}
_compiled: Callable[..., Any] = numba.njit(**_OPTIONS)
# What makes no arrays does not count references to those it is given: counted at every call, they took three quarters of the time. Such a function
# must not return an array. In the others a record is no reference: it is read before its array is let go.
_OPTIONS |= {"_nrt": False}
_uncounted: Callable[..., Any] = numba.njit(**_OPTIONS)
_inlined: Callable[..., Any] = numba.njit(**_OPTIONS, forceinline=True)


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
    ints = map(partial(np.array, dtype=np.int64), (start_blocks, goal_blocks, neighbours))
    roots, nodes = np.empty(_CAPACITY, _ROOT), np.empty(_CAPACITY, _NODE)
    cones = np.empty(_MOST_CONES + 2 * len(start_blocks), _CONE)
    turns, length_m, expanded = _run(
        *flat, start, goal, *ints, roots, nodes, cones, np.empty(flat.ways.shape[1], _WAY)
    )
    return turns.tolist() if length_m < inf else None, length_m, expanded


@_compiled
def _run(
    first: Ints,
    ways: Records,
    corners: Records,
    start: Point,
    goal: Point,
    start_blocks: Ints,
    goal_blocks: Ints,
    neighbours: Ints,
    roots: Records,
    nodes: Records,
    cones: Records,
    seen: Records,
) -> tuple[Ints, float, int]:
    best = np.full(2 * len(corners), inf)  # of each turn the least length known
    heap = np.empty(len(nodes), dtype=np.int64)
    sizes = np.array([1, 0, 0])  # of the roots, of the nodes, of the heap
    roots[0].x, roots[0].y, roots[0].g_m, roots[0].before, roots[0].turn = start[0], start[1], 0.0, -1, -1
    root, expanded, followed, lacking = 0, 0, 0, 0
    count = _begin(
        corners, goal, start_blocks, goal_blocks, neighbours, best, roots, nodes, heap, sizes, cones
    )
    while True:
        if sizes[1] + _MARGIN + lacking > len(nodes):
            length = 4 * len(nodes) + lacking
            roots = _longer(roots, sizes[0], length)
            nodes = _longer(nodes, sizes[1], length)
            heap = _longer(heap, sizes[2], length)
        if followed < count:
            cone = cones[followed]
            lacking = _follow(
                first, ways, corners, goal, goal_blocks, best, roots, nodes, heap, sizes, seen, root, cone
            )
            followed += lacking == 0
            continue
        if sizes[2] == 0:
            return np.empty(0, dtype=np.int64), inf, expanded
        number = _pop(nodes, heap, sizes)
        expanded += 1
        followed = 0
        root = nodes[number].root
        if nodes[number].block == _GOAL:
            return _trace(roots, root), nodes[number].f_m, expanded
        if roots[root].turn >= 0 and roots[root].g_m > best[roots[root].turn]:
            count = 0
        elif nodes[number].block == _TURN:
            count = _turn(corners, goal, goal_blocks, best, roots, nodes, heap, sizes, cones, root)
        else:
            count = _resumed(nodes[number], cones[0])


@_uncounted
def _resumed(node: Any, cone: Any) -> int:  # noqa: ANN401 - records
    """Make a queued cone the only one to follow, and return how many that is."""
    cone.block, cone.direction, cone.steps = node.block, node.direction, 0
    cone.low, cone.high = node.low, node.high
    return 1


@_uncounted
def _begin(
    corners: Records,
    goal: Point,
    start_blocks: Ints,
    goal_blocks: Ints,
    neighbours: Ints,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    cones: Records,
) -> int:
    """Queue the corners next to the start, find the cones that it sees, and return how many there are."""
    for block in start_blocks:
        if _holds(goal_blocks, block):
            _push_goal(goal, roots, nodes, heap, sizes, 0)
            return 0
    for vertex in neighbours:
        _reach(corners, goal, best, roots, nodes, heap, sizes, 0, vertex, _LEFT)
        _reach(corners, goal, best, roots, nodes, heap, sizes, 0, vertex, _RIGHT)
    count = 0
    for block in start_blocks:
        for direction in (_EAST, _WEST):
            cones[count].block, cones[count].direction = block, direction
            cones[count].low, cones[count].high, cones[count].steps = -inf, inf, 0
            count += 1
    return count


@_compiled
def _longer(array: Records, used: int, length: int) -> Records:
    longer = np.empty(length, dtype=array.dtype)
    longer[:used] = array[:used]
    return longer


@_inlined
def _follow(
    first: Ints,
    ways: Records,
    corners: Records,
    goal: Point,
    goal_blocks: Ints,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    seen: Records,
    root: int,
    cone: Any,  # noqa: ANN401 - a record
) -> int:
    """Follow a cone as long as there is one way on and queue those it divides into.

    Return how many entries it lacks room for: 0, or the cone is left where it has come to, to be followed again.
    """
    block, direction, low, high, steps = cone.block, cone.direction, cone.low, cone.high, cone.steps
    while True:
        entries = 4 * (first[direction, block + 1] - first[direction, block])
        if sizes[1] + _MARGIN + entries > len(nodes):
            cone.block, cone.low, cone.high, cone.steps = block, low, high, steps
            return int(entries)
        if _holds(goal_blocks, block) and _sees_goal(goal, roots[root], low, high):
            _push_goal(goal, roots, nodes, heap, sizes, root)
        count = _look(
            first,
            ways,
            corners,
            goal,
            best,
            roots,
            nodes,
            heap,
            sizes,
            seen,
            root,
            block,
            direction,
            low,
            high,
        )
        if count != 1:
            break
        low, high = seen[0].low, seen[0].high
        way = ways[direction, seen[0].way]
        block = way.block
        steps += 1
        if steps % 8 == 0 and sizes[2] > 0 and _bound(goal, roots[root], way, low, high) > nodes[heap[0]].f_m:
            break
    for one in seen[:count]:
        way = ways[direction, one.way]
        f_m = _bound(goal, roots[root], way, one.low, one.high)
        _push(nodes, heap, sizes, f_m, way.block, direction, root, one.low, one.high)
    return 0


@_inlined
def _look(
    first: Ints,
    ways: Records,
    corners: Records,
    goal: Point,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    seen: Records,
    root: int,
    block: int,
    direction: int,
    low: float,
    high: float,
) -> int:
    """Find the ways out of a block that a cone sees, reach the corners beside them, and return how many there are."""
    root_x, root_y = roots[root].x, roots[root].y
    low_side = _RIGHT if direction == _EAST else _LEFT
    count = 0
    for place in range(first[direction, block], first[direction, block + 1]):
        way = ways[direction, place]
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
                _reach(corners, goal, best, roots, nodes, heap, sizes, root, way.low_end, low_side)
            slope = rise_low / run
            if slope > low:
                new_low = slope
        if way.high_end != -1 and rise_high <= ray_high:
            if way.high_end >= 0:
                _reach(corners, goal, best, roots, nodes, heap, sizes, root, way.high_end, 1 - low_side)
            slope = rise_high / run
            if slope < high:
                new_high = slope
        if new_low <= new_high:
            seen[count].way, seen[count].low, seen[count].high = place, new_low, new_high
            count += 1
    return count


@_inlined
def _holds(blocks: Ints, block: int) -> bool:
    for one in blocks:  # noqa: SIM110 - compiled
        if one == block:
            return True
    return False


@_inlined
def _sees_goal(goal: Point, root: Any, low: float, high: float) -> bool:  # noqa: ANN401 - a record
    run = abs(goal[0] - root.x)
    rise = goal[1] - root.y
    if run <= 0.0:
        return high == inf if rise >= 0.0 else low == -inf
    return bool(low * run - _SLACK_M <= rise <= high * run + _SLACK_M)


@_compiled
def _trace(roots: Records, root: int) -> Ints:
    count = 0
    one = root
    while one > 0:
        one = roots[one].before
        count += 1
    turns = np.empty(count, dtype=np.int64)
    while root > 0:
        count -= 1
        turns[count] = roots[root].turn >> 1
        root = roots[root].before
    return turns


@_uncounted
def _push(
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    f_m: float,
    block: int,
    direction: int,
    root: int,
    low: float,
    high: float,
) -> None:
    """Queue a node. Nodes are numbered as they come, so their number breaks ties as the plain search does."""
    number, place = sizes[1], sizes[2]
    node = nodes[number]
    node.f_m, node.low, node.high, node.block, node.direction, node.root = (
        f_m,
        low,
        high,
        block,
        direction,
        root,
    )
    sizes[1] += 1
    sizes[2] += 1
    while place > 0:
        parent = (place - 1) >> 1
        if nodes[heap[parent]].f_m <= f_m:  # of equals the older one is the lesser
            break
        heap[place] = heap[parent]
        place = parent
    heap[place] = number


@_uncounted
def _pop(nodes: Records, heap: Ints, sizes: Ints) -> int:
    top = heap[0]
    sizes[2] -= 1
    size = sizes[2]
    number = heap[size]
    f_m = nodes[number].f_m
    place = 0
    while True:
        child = 2 * place + 1
        if child >= size:
            break
        if child + 1 < size:
            left, right = nodes[heap[child]].f_m, nodes[heap[child + 1]].f_m
            if right < left or (right == left and heap[child + 1] < heap[child]):
                child += 1
        other = nodes[heap[child]].f_m
        if f_m < other or (f_m == other and number < heap[child]):
            break
        heap[place] = heap[child]
        place = child
    heap[place] = number
    return int(top)


@_uncounted
def _push_goal(goal: Point, roots: Records, nodes: Records, heap: Ints, sizes: Ints, root: int) -> None:
    east, north = goal[0] - roots[root].x, goal[1] - roots[root].y
    f_m = roots[root].g_m + sqrt(east * east + north * north)
    _push(nodes, heap, sizes, f_m, _GOAL, 0, root, 0.0, 0.0)


@_inlined
def _reach(
    corners: Records,
    goal: Point,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    root: int,
    vertex: int,
    side: int,
) -> None:
    corner = corners[vertex]
    east, north = corner.x - roots[root].x, corner.y - roots[root].y
    slack = _SLACK_M * (abs(east) + abs(north))
    to_before = east * corner.before_north - north * corner.before_east
    to_after = east * corner.after_north - north * corner.after_east
    if side == _LEFT:
        if to_before < -slack or to_after < -slack:
            return
    elif to_before > slack or to_after > slack:
        return
    g_m = roots[root].g_m + sqrt(east * east + north * north)
    turn = 2 * vertex + side
    if g_m >= best[turn] or g_m > best[turn ^ 1] + _SLACK_M:
        return
    best[turn] = g_m
    number = sizes[0]
    sizes[0] += 1
    new = roots[number]
    new.x, new.y, new.g_m, new.before, new.turn = corner.x, corner.y, g_m, root, turn
    east, north = goal[0] - corner.x, goal[1] - corner.y
    f_m = g_m + sqrt(east * east + north * north)
    _push(nodes, heap, sizes, f_m, _TURN, 0, number, 0.0, 0.0)


@_inlined
def _quarter(east: float, north: float) -> int:
    if east > 0.0:
        return 0
    if east < 0.0:
        return 2
    return 1 if north > 0.0 else 3


@_uncounted
def _turn(
    corners: Records,
    goal: Point,
    goal_blocks: Ints,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    cones: Records,
    root: int,
) -> int:
    """Find the cones between the way a path came to a corner and the boundary it turns towards, and return how many there are."""
    vertex, side = roots[root].turn >> 1, roots[root].turn & 1
    corner, before = corners[vertex], roots[roots[root].before]
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
            cone = cones[count]
            cone.block, cone.direction = (east_block, _EAST) if quarter == 0 else (west_block, _WEST)
            cone.low, cone.high = (low, high) if side == _LEFT else (-high, -low)
            cone.steps = 0
            count += cone.block >= 0
        else:
            upwards = (quarter == 1) == (side == _LEFT)
            _straight(corners, goal, goal_blocks, best, roots, nodes, heap, sizes, root, vertex, upwards)
        if done:
            return count
        quarter = (quarter + 1) % 4
        east = 0.0


@_uncounted
def _straight(
    corners: Records,
    goal: Point,
    goal_blocks: Ints,
    best: Floats,
    roots: Records,
    nodes: Records,
    heap: Ints,
    sizes: Ints,
    root: int,
    vertex: int,
    upwards: bool,  # noqa: FBT001 - compiled
) -> None:
    """Reach what stands on the line of a vertex, straight above or below it."""
    corner = corners[vertex]
    if upwards:
        neighbour, west, east, rise = corner.above, corner.west_above, corner.east_above, goal[1] - corner.y
    else:
        neighbour, west, east, rise = corner.below, corner.west_below, corner.east_below, corner.y - goal[1]
    if (
        abs(goal[0] - corner.x) <= TOLERANCE_M
        and rise >= 0.0
        and (_holds(goal_blocks, west) or _holds(goal_blocks, east))
    ):
        _push_goal(goal, roots, nodes, heap, sizes, root)
    if neighbour >= 0:
        _reach(corners, goal, best, roots, nodes, heap, sizes, root, neighbour, _LEFT)
        _reach(corners, goal, best, roots, nodes, heap, sizes, root, neighbour, _RIGHT)


@_inlined
def _bound(goal: Point, root: Any, way: Any, low: float, high: float) -> float:  # noqa: ANN401 - records
    g_m: float = root.g_m
    run, beyond = abs(way.east - root.x), abs(goal[0] - way.east)
    rise = goal[1] - root.y
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
