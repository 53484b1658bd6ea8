"""The paper's high-level plan: A* over blocks (sections 3.1 and 3.2).

``CostFunction = g(i) + h(i) + d(i)``: h is the distance from a block's centre to the goal, d the distance between the centres of a
block and the next. The paper's g counts 1 for a step to a side and 1.4 for a diagonal one, as on a unit grid, which mixes steps with
metres. ``cost="literal"`` does just that; ``cost="metric"``, the default, reads g as the sum of d so far, which is what g is on a grid
of unit blocks. Neither makes the path the shortest: the cost is that of a way through the centres.
"""

from __future__ import annotations

from heapq import heappop, heappush
from math import inf, sqrt
from typing import TYPE_CHECKING

from .errors import SearchStoppedError
from .geometry import Point

if TYPE_CHECKING:
    from collections.abc import Callable

    from .partition.base import Partition

Crossing = tuple[Point, Point]
"""The common points of two neighbouring blocks, the paper's adj: a portal's two ends, or one corner twice."""

_SIDE_STEP, _DIAGONAL_STEP = 1.0, 1.4  # the paper's costs of a step over a side and over a corner


class BlockGraph:
    """Blocks with their neighbours.

    Parameters
    ----------
    partition : Partition
        Blocks and portals; if it has ``diagonals``, pairs of blocks with a common corner, they are neighbours too.
    """

    def __init__(self, partition: Partition) -> None:
        self.partition = partition
        self.centers: list[tuple[float, float]] = [(e, n) for e, n in partition.centers.tolist()]
        self.neighbours: list[list[tuple[int, Crossing, float]]] = [[] for _ in self.centers]
        portals = partition.portals
        for (one, two), (first, second) in zip(portals.blocks.tolist(), portals.ends_m.tolist(), strict=True):
            crossing = ((first[0], first[1]), (second[0], second[1]))
            self.neighbours[one].append((two, crossing, _SIDE_STEP))
            self.neighbours[two].append((one, crossing, _SIDE_STEP))
        for one, two, corner in getattr(partition, "diagonals", ()):
            self.neighbours[one].append((two, (corner, corner), _DIAGONAL_STEP))
            self.neighbours[two].append((one, (corner, corner), _DIAGONAL_STEP))


def block_sequence(
    graph: BlockGraph,
    start: Point,
    goal: Point,
    *,
    cost: str = "metric",
    should_stop: Callable[[], bool] | None = None,
) -> tuple[list[int], list[Crossing], int] | None:
    """Return the blocks from start to goal, the paper's Queue.

    Parameters
    ----------
    graph : BlockGraph
        The blocks.
    start, goal : (east, north)
        Metres from the scene's origin.
    cost : {"metric", "literal"}
        How g is read.
    should_stop : callable, optional
        Asked now and then.

    Returns
    -------
    tuple of (list of int, list of Crossing, int) or None
        The blocks, what each has in common with the next, and how many blocks were taken from the queue; None if no sequence
        joins start and goal.

    Raises
    ------
    SearchStoppedError
        If the caller stopped the search.
    """
    goals = frozenset(graph.partition.locate(goal))
    metric = cost == "metric"
    goal_east, goal_north = goal
    least = dict.fromkeys(graph.partition.locate(start), 0.0)
    came: dict[int, tuple[int, Crossing]] = {}
    queue: list[tuple[float, int, float]] = [(0.0, block, 0.0) for block in least]
    expanded = 0
    while queue:
        if should_stop is not None and expanded % 64 == 0 and should_stop():
            raise SearchStoppedError
        _, block, g = heappop(queue)
        if g > least[block]:
            continue
        expanded += 1
        if block in goals:
            return *_trace(block, came), expanded
        east, north = graph.centers[block]
        for other, crossing, step in graph.neighbours[block]:
            other_east, other_north = graph.centers[other]
            d = sqrt((other_east - east) ** 2 + (other_north - north) ** 2)
            new_g = g + (d if metric else step)
            if new_g < least.get(other, inf):
                least[other] = new_g
                came[other] = (block, crossing)
                h = sqrt((goal_east - other_east) ** 2 + (goal_north - other_north) ** 2)
                heappush(queue, (new_g + h + (0.0 if metric else d), other, new_g))
    return None


def _trace(block: int, came: dict[int, tuple[int, Crossing]]) -> tuple[list[int], list[Crossing]]:
    blocks, crossings = [block], []
    while block in came:
        block, crossing = came[block]
        blocks.append(block)
        crossings.append(crossing)
    return blocks[::-1], crossings[::-1]
