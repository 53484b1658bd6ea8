"""The taut path through a sequence of blocks: the shortest that crosses the given edges in their order.

A funnel is carried from edge to edge: an apex, up to which the path is fixed, and the two sides between which it must go on. Where
a side would cross the other one, the path turns there and the funnel starts anew from that point (Lee and Preparata 1984, in the
form with two scalars for the sides by Mononen).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .block_search import Crossing
    from .geometry import Point


def taut_path(
    start: Point, goal: Point, crossings: Sequence[Crossing], centers: Sequence[Point]
) -> list[Point]:
    """Return the shortest path that crosses the common edges of a sequence of blocks.

    Parameters
    ----------
    start, goal : (east, north)
        In the first and the last block, metres.
    crossings : sequence of ((east, north), (east, north))
        What each block has in common with the next: an edge's two ends, or one corner twice.
    centers : sequence of (east, north)
        A point inside each block: from it follows which end of an edge is on the left on leaving it.

    Returns
    -------
    list of (east, north)
        Start, turning points, goal.
    """
    gates = [_sided(crossing, center) for crossing, center in zip(crossings, centers, strict=False)]
    gates.append((goal, goal))
    path = [start]
    apex = left = right = start
    left_gate = right_gate = -1
    gate = 0
    while gate < len(gates):
        new_left, new_right = gates[gate]
        if _turn(apex, right, new_right) >= 0.0:
            if apex == right or _turn(apex, left, new_right) <= 0.0:
                right, right_gate = new_right, gate
            else:  # the right side has crossed the left one: turn there
                path.append(left)
                apex, gate = left, left_gate + 1
                right = left
                right_gate = left_gate
                continue
        if _turn(apex, left, new_left) <= 0.0:
            if apex == left or _turn(apex, right, new_left) >= 0.0:
                left, left_gate = new_left, gate
            else:
                path.append(right)
                apex, gate = right, right_gate + 1
                left = right
                left_gate = right_gate
                continue
        gate += 1
    path.append(goal)
    return [point for place, point in enumerate(path) if place == 0 or point != path[place - 1]]


def _sided(crossing: Crossing, center: Point) -> Crossing:
    """Return an edge's left and right end as seen from a block."""
    first, second = crossing
    return (first, second) if _turn(center, second, first) >= 0.0 else (second, first)


def _turn(origin: Point, one: Point, two: Point) -> float:
    """Return a positive number if two lies to the left of the way from origin to one."""
    return (one[0] - origin[0]) * (two[1] - origin[1]) - (one[1] - origin[1]) * (two[0] - origin[0])
