"""Exact any-angle search over slabs: the globally shortest path, with a certificate.

The search is Polyanya (Cui, Harabor, Grastien: "Compromise-free pathfinding on a navigation mesh", IJCAI 2017) made for slabs. A search
node is a *root*, the last turning point, with a *cone* of directions under which it sees the portal just passed; its f-value is the length to
the root plus the shortest way from there through the seen part of the portal to the goal, as if nothing stood behind. Cones that
move on are Polyanya's observable successors; where a cone meets a corner of an obstacle, a *turn* is queued that makes the corner the
next root: the non-observable successors.

All portals are vertical, so a cone is two slopes, north over distance eastwards (or westwards), and clipping it is one comparison.
The rules that keep it exact in floating point:

- A cone is bounded by vertices, whose own coordinates give the slopes, never by a point interpolated on an edge. An edge that crosses a
  portal's end does not clip the cone at all: what hides behind the edge lies behind its far vertex, and that one clips.
- A path turns only at tangent vertices, those with both boundary neighbours on the turning side, and only towards that side.
- The same turn (vertex and side) reached again at no smaller length is dropped: of two equally long ways to a corner, what the wider cone
  sees in addition has a shortcut past the corner.
- The goal is queued like any other node, and only when it is taken from the queue is the path final.
- A vertex where obstacles touch is split into its free fans by the partition, so no path squeezes through.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf, sqrt
from typing import TYPE_CHECKING

from .partition.base import TOLERANCE_M
from .partition.sweep import Sweep

if TYPE_CHECKING:
    from collections.abc import Callable

    from .geometry import Point
    from .partition.slabs import Slabs
    from .partition.sweep import PortalView

_GOAL = -1
_TURN = -2
_SLACK_M = (
    1e-10  # a vertex this near to a cone's edge counts as seen: rounding must not hide what lies on one line
)
_EAST, _WEST = 1, 0
_LEFT, _RIGHT = 1, 0

Cone = tuple[int, int, float, float]
"""(block, direction, low slope, high slope)"""

Node = tuple[float, int, int, int, int, float, float]
"""(f, tie break, block or _GOAL or _TURN, direction, root, low slope, high slope)"""


@dataclass(frozen=True)
class SearchResult:
    """What the search found.

    Parameters
    ----------
    vertices : tuple of int or None
        The vertices that the path turns at, in order; None if no path was found.
    lower_bound_m : float
        No path is shorter than this.
    expanded : int
        Number of search nodes taken from the queue.
    stopped : bool
        Whether the caller stopped the search.
    """

    vertices: tuple[int, ...] | None
    lower_bound_m: float
    expanded: int
    stopped: bool


def shortest_path(
    slabs: Slabs, start: Point, goal: Point, should_stop: Callable[[], bool] | None = None
) -> SearchResult:
    """Return the shortest path between two points of free space.

    Parameters
    ----------
    slabs : Slabs
        The partition of free space. If it was swept in compiled form, the search runs so too, and gives the same result.
    start, goal : (east, north)
        Metres from the scene's origin, in free space or on its boundary.
    should_stop : callable, optional
        Asked now and then; when it returns True the search ends with the bound reached so far.

    Returns
    -------
    SearchResult
        The path with its certificate.
    """
    if isinstance(slabs.swept, Sweep):
        return _Query(slabs, slabs.swept, start, goal).run(should_stop)
    assert slabs.searcher is not None  # as they are not swept plainly
    blocks = slabs.locate(start)
    neighbours = [vertex for block in blocks for vertex, _ in slabs.line_neighbours(start, block)]
    ends = blocks, slabs.locate(goal), neighbours
    turns, length_m, expanded, stopped = slabs.searcher.search(start, goal, ends, should_stop)
    return SearchResult(None if turns is None else tuple(turns), length_m, expanded, stopped)


class _Query:
    """One query."""

    def __init__(self, slabs: Slabs, swept: Sweep, start: Point, goal: Point) -> None:
        self._slabs, self._swept = slabs, swept
        self._beside = swept.west_above, swept.west_below, swept.east_above, swept.east_below
        self._fans = slabs.vertices.fans
        self._start_blocks = slabs.locate(start)
        self._goal_blocks = frozenset(slabs.locate(goal))
        self._goal_x, self._goal_y = goal
        # One entry for each root: where it is, the length up to it, the root before, its vertex and turning side.
        self._root_x = [start[0]]
        self._root_y = [start[1]]
        self._root_g = [0.0]
        self._root_before = [-1]
        self._root_turn = [-1]
        # At 2 * vertex + side the least length known up to this turn; at the end, for the start, which no turn reaches, none.
        self._best = [inf] * (2 * len(self._fans) + 1)
        self._queue: list[Node] = []
        self._ties = 0

    def run(self, should_stop: Callable[[], bool] | None) -> SearchResult:
        """Search until the goal is taken from the queue, the queue is empty or the caller stops."""
        queue, best, root_g, root_turn = self._queue, self._best, self._root_g, self._root_turn
        self._begin()
        expanded = 0
        while queue:
            if should_stop is not None and expanded % 16 == 0 and should_stop():
                ends = [node for node in queue if node[2] == _GOAL]
                path = self._trace(min(ends)[4]) if ends else None
                return SearchResult(path, min(queue)[0], expanded, stopped=True)
            f_m, _, block, direction, root, low, high = heappop(queue)
            expanded += 1
            if block == _GOAL:
                return SearchResult(self._trace(root), f_m, expanded, stopped=False)
            if root_g[root] > best[root_turn[root]]:
                continue  # the corner has been reached on a shorter way since
            if block == _TURN:
                for cone in self._turn_cones(root):
                    self._follow(root, cone)
            else:
                self._follow(root, (block, direction, low, high))
        return SearchResult(None, inf, expanded, stopped=False)

    def _trace(self, root: int) -> tuple[int, ...]:
        turns: list[int] = []
        while root > 0:
            turns.append(self._root_turn[root] >> 1)
            root = self._root_before[root]
        return tuple(reversed(turns))

    def _push(self, f_m: float, block: int, direction: int, root: int, low: float, high: float) -> None:
        self._ties += 1
        heappush(self._queue, (f_m, self._ties, block, direction, root, low, high))

    def _push_goal(self, root: int) -> None:
        east, north = self._goal_x - self._root_x[root], self._goal_y - self._root_y[root]
        self._push(self._root_g[root] + sqrt(east * east + north * north), _GOAL, 0, root, 0.0, 0.0)

    def _begin(self) -> None:
        """Queue what the start sees."""
        x, y = self._root_x[0], self._root_y[0]
        for block in self._start_blocks:
            if block in self._goal_blocks:
                self._push_goal(0)
                return
        for block in self._start_blocks:
            for vertex, _ in self._slabs.line_neighbours((x, y), block):
                self._reach(0, vertex, _LEFT)
                self._reach(0, vertex, _RIGHT)
        for block in self._start_blocks:
            self._follow(0, (block, _EAST, -inf, inf))
            self._follow(0, (block, _WEST, -inf, inf))

    def _reach(self, root: int, vertex: int, side: int) -> None:
        """Queue a turn around a vertex that a root sees, if the vertex is tangent on that side."""
        x, y, before_east, before_north, after_east, after_north = self._fans[vertex]
        east, north = x - self._root_x[root], y - self._root_y[root]
        slack = _SLACK_M * (abs(east) + abs(north))
        if side:  # to the left: both boundary neighbours must lie there
            if (
                east * before_north - north * before_east < -slack
                or east * after_north - north * after_east < -slack
            ):
                return
        elif (
            east * before_north - north * before_east > slack
            or east * after_north - north * after_east > slack
        ):
            return
        g_m = self._root_g[root] + sqrt(east * east + north * north)
        turn = 2 * vertex + side
        best = self._best
        if g_m >= best[turn] or g_m > best[turn ^ 1] + _SLACK_M:
            return
        best[turn] = g_m
        number = len(self._root_x)
        self._root_x.append(x)
        self._root_y.append(y)
        self._root_g.append(g_m)
        self._root_before.append(root)
        self._root_turn.append(turn)
        east, north = self._goal_x - x, self._goal_y - y
        self._ties += 1
        f_m = g_m + sqrt(east * east + north * north)
        heappush(self._queue, (f_m, self._ties, _TURN, 0, number, 0.0, 0.0))

    def _turn_cones(self, root: int) -> list[Cone]:
        """Return the cones between the way a path came to a corner and the boundary it turns towards.

        A turn to the right is a turn to the left with north and south exchanged, so one order of steps serves both.
        """
        turn = self._root_turn[root]
        vertex, side = turn >> 1, turn & 1
        mirror = 1.0 if side == _LEFT else -1.0
        x, y, *neighbours = self._fans[vertex]
        before = self._root_before[root]
        east, north = x - self._root_x[before], mirror * (y - self._root_y[before])
        edge_east, edge_north = neighbours[:2] if side == _LEFT else neighbours[2:]
        edge_north *= mirror
        west_above, west_below, east_above, east_below = self._beside
        if side == _LEFT:  # turning left one faces what lies below an obstacle eastwards, above it westwards
            east_block, west_block = east_below[vertex], west_above[vertex]
        else:
            east_block, west_block = east_above[vertex], west_below[vertex]
        cones: list[Cone] = []

        def add(block: int, direction: int, low: float, high: float) -> None:
            cones.append((block, direction, low, high) if side == _LEFT else (block, direction, -high, -low))

        # Directions in the order of a left turn: east, up, west, down, east again.
        if east * edge_north <= north * edge_east and east * edge_east + north * edge_north > 0.0:
            # The boundary goes straight on, or bends away within rounding.
            east, north = edge_east, edge_north
        quarter = _quarter(east, north)
        last = _quarter(edge_east, edge_north)
        while True:
            done = quarter == last
            if quarter == 0:
                low = north / east if east > 0.0 else -inf
                high = edge_north / edge_east if done else inf
                add(east_block, _EAST, min(low, high), high)
            elif quarter == 2:
                high = north / -east if east < 0.0 else inf
                low = edge_north / -edge_east if done else -inf
                add(west_block, _WEST, low, max(low, high))
            else:
                self._straight(root, vertex, upwards=(quarter == 1) == (side == _LEFT))
            if done:
                # Where the obstacle fills a side there is no block, and nothing to see.
                return [cone for cone in cones if cone[0] >= 0]
            quarter = (quarter + 1) % 4
            east = 0.0

    def _straight(self, root: int, vertex: int, *, upwards: bool) -> None:
        """Reach what stands on the line of a vertex, straight above or below it."""
        x, y = self._root_x[root], self._root_y[root]
        goal_x, goal_y = self._goal_x, self._goal_y
        west_above, west_below, east_above, east_below = self._beside
        if upwards:
            neighbour, sides, rise = self._swept.above[vertex], (west_above, east_above), goal_y - y
        else:
            neighbour, sides, rise = self._swept.below[vertex], (west_below, east_below), y - goal_y
        if (
            abs(goal_x - x) <= TOLERANCE_M
            and rise >= 0.0
            and any(side[vertex] in self._goal_blocks for side in sides)
        ):
            self._push_goal(root)
        if neighbour >= 0:
            self._reach(root, neighbour, _LEFT)
            self._reach(root, neighbour, _RIGHT)

    def _follow(self, root: int, cone: Cone) -> None:  # noqa: C901, PLR0912, PLR0915 - the inner loop: calls would double its time
        """Follow a cone through blocks as long as there is one way on; queue the cones where it divides."""
        root_x, root_y = self._root_x[root], self._root_y[root]
        block, direction, low, high = cone
        portals, goal_blocks = self._swept.ways[direction], self._goal_blocks
        # Looking east the turn around a portal's low end is to the right; looking west it is to the left.
        low_side, high_side = (_RIGHT, _LEFT) if direction == _EAST else (_LEFT, _RIGHT)
        steps = 0
        queue = self._queue
        while True:
            if block in goal_blocks and self._sees_goal(root_x, root_y, low, high):
                self._push_goal(root)
            others: list[tuple[PortalView, float, float]] | None = None
            only: PortalView | None = None
            only_low = only_high = 0.0
            for way in portals[block]:
                x, portal_low, portal_high, low_end, high_end, _ = way
                run = x - root_x if direction else root_x - x
                if run <= 0.0:
                    continue
                rise_low, ray_high = portal_low - root_y, high * run + _SLACK_M
                if ray_high < rise_low:
                    continue
                rise_high, ray_low = portal_high - root_y, low * run - _SLACK_M
                if ray_low > rise_high:
                    continue
                new_low, new_high = low, high
                if low_end != -1 and rise_low >= ray_low:
                    if low_end >= 0:
                        self._reach(root, low_end, low_side)
                    slope = rise_low / run
                    if slope > low:
                        new_low = slope
                if high_end != -1 and rise_high <= ray_high:
                    if high_end >= 0:
                        self._reach(root, high_end, high_side)
                    slope = rise_high / run
                    if slope < high:
                        new_high = slope
                if new_low > new_high:
                    continue
                if only is None:
                    only, only_low, only_high = way, new_low, new_high
                elif others is None:
                    others = [(way, new_low, new_high)]
                else:
                    others.append((way, new_low, new_high))
            if only is None:
                return
            if others is not None:
                break
            low, high, block = only_low, only_high, only[5]
            steps += 1
            # Looking at the bound now and then keeps a cone from running far ahead of better ones.
            if steps % 8 == 0 and queue and self._bound(root, only, low, high) > queue[0][0]:
                break
        for way, new_low, new_high in [(only, only_low, only_high), *(others or ())]:
            self._push(self._bound(root, way, new_low, new_high), way[5], direction, root, new_low, new_high)

    def _sees_goal(self, root_x: float, root_y: float, low: float, high: float) -> bool:
        """Return whether the goal, in the block that a cone has come to, lies in the cone."""
        run = abs(self._goal_x - root_x)
        rise = self._goal_y - root_y
        if run <= 0.0:
            return high == inf if rise >= 0.0 else low == -inf
        return low * run - _SLACK_M <= rise <= high * run + _SLACK_M

    def _bound(self, root: int, way: PortalView, low: float, high: float) -> float:
        """Return the f-value of a cone on a portal: no path by way of both is shorter.

        A goal on the root's side of the portal is mirrored: the way there and back is as long as to the mirror image.
        """
        x, portal_low, portal_high, *_ = way
        root_x, root_y = self._root_x[root], self._root_y[root]
        run, beyond = abs(x - root_x), abs(self._goal_x - x)
        rise = self._goal_y - root_y
        total = run + beyond
        # Where the straight line crosses the portal's line, in proportion to the distances.
        cross = rise * run / total
        seen_low, seen_high = max(portal_low - root_y, low * run), min(portal_high - root_y, high * run)
        if cross < seen_low:
            cross = seen_low
        elif cross > seen_high:
            cross = seen_high
        else:
            return self._root_g[root] + sqrt(total * total + rise * rise)
        rest = rise - cross
        return self._root_g[root] + sqrt(run * run + cross * cross) + sqrt(beyond * beyond + rest * rest)


class _Goalless(_Query):
    """A search without a goal: it ends where nothing is left to be seen."""

    def __init__(self, slabs: Slabs, swept: Sweep, start: Point) -> None:
        super().__init__(slabs, swept, start, start)
        self._goal_blocks = frozenset()

    def _bound(self, root: int, _way: PortalView, _low: float, _high: float) -> float:
        return self._root_g[root]


class Everywhere(_Goalless):
    """How far all corners of free space are from a point, and by which turns.

    Parameters
    ----------
    slabs, swept
        The partition of free space.
    start : (east, north)
        Metres from the scene's origin, in free space or on its boundary.
    """

    def __init__(self, slabs: Slabs, swept: Sweep, start: Point) -> None:
        super().__init__(slabs, swept, start)
        self.run(None)
        self._root_of: dict[int, int] = {}
        for root, turn in enumerate(self._root_turn):
            if root and self._root_g[root] <= self._best[turn]:
                vertex = turn >> 1
                known = self._root_of.get(vertex)
                if known is None or self._root_g[root] < self._root_g[known]:
                    self._root_of[vertex] = root

    def corners_m(self) -> list[float]:
        """Return how far each vertex of the partition is; infinite where no shortest path turns at it."""
        return [
            self._root_g[self._root_of[vertex]] if vertex in self._root_of else inf
            for vertex in range(len(self._fans))
        ]

    def turns_from(self, vertex: int) -> list[int]:
        """Return the vertices at which the shortest path from a vertex to the point turns, that vertex first."""
        return list(reversed(self._trace(self._root_of[vertex])))


class Sight(_Query):
    """What a point sees: the corners that a path from it may turn at first, and whether it sees another point.

    Parameters
    ----------
    slabs, swept
        The partition of free space.
    start : (east, north)
        Metres from the scene's origin, in free space or on its boundary.
    goal : (east, north), optional
        The other point.
    """

    def __init__(self, slabs: Slabs, swept: Sweep, start: Point, goal: Point | None = None) -> None:
        super().__init__(slabs, swept, start, start if goal is None else goal)
        if goal is None:
            self._goal_blocks = frozenset()

    def corners(self) -> tuple[list[int], list[float]]:
        """Return the corners, and how far each is in metres."""
        self._look()
        turns = self._root_turn[1:]
        return [turn >> 1 for turn in turns], self._root_g[1:]

    def sees_goal(self) -> bool:
        """Return whether the goal is seen."""
        return self._look()

    def _look(self) -> bool:
        """Follow what the start sees to its end, and no turn; return whether the goal was met."""
        self._begin()
        while self._queue:
            _, _, block, direction, root, low, high = heappop(self._queue)
            if block == _GOAL and root == 0:
                return True
            if block not in (_GOAL, _TURN):
                self._follow(root, (block, direction, low, high))
        return False


def _quarter(east: float, north: float) -> int:
    """Return 0 for east, 1 for straight up, 2 for west, 3 for straight down."""
    if east > 0.0:
        return 0
    if east < 0.0:
        return 2
    return 1 if north > 0.0 else 3
