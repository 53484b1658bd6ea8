"""The paper's hierarchical step (section 3.3): where to cross from one block to the next.

With A and B the ends of the common edge and Gp the goal:

1. ``|BG|² >= |AG|² + |AB|²``: the angle at A is not acute, A is the nearest point; cross at A, moved by the robot's radius towards B.
2. ``|AG|² >= |BG|² + |AB|²``: the same with B.
3. else: cross at the foot Q of the perpendicular from Gp.

Three things are read otherwise than printed. The paper moves the point to ``|A_x - range|``, which goes the wrong way when B lies to the
east or north: here it always moves towards the other end. Its third condition ``|AG|² + |BG|² >= |AB|²`` is nearly always true: it
is the else branch. Its area formula gives only the distance to Q: Q itself comes from a projection, kept `range_m` away from both ends. An
edge shorter than two radii has no such point; it is crossed in its middle, and `passable` is False.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .block_search import Crossing
    from .geometry import Point


def crossing_point(crossing: Crossing, goal: Point, range_m: float = 0.0) -> Point:
    """Return where the path crosses from one block to the next.

    Parameters
    ----------
    crossing : ((east, north), (east, north))
        The ends A and B of the common edge, or one corner twice.
    goal : (east, north)
        The goal Gp, in metres.
    range_m : float, default 0.0
        The robot's radius in metres; 0 where free space is already shrunk by it.

    Returns
    -------
    (east, north)
        A point of the edge, `range_m` or more from its ends if it is long enough.
    """
    a, b = crossing
    ab2, ag2, bg2 = _square(a, b), _square(a, goal), _square(b, goal)
    if ab2 == 0.0:
        return a
    length_m = sqrt(ab2)
    if length_m <= 2.0 * range_m:
        along_m = 0.5 * length_m
    elif bg2 >= ag2 + ab2:
        along_m = range_m
    elif ag2 >= bg2 + ab2:
        along_m = length_m - range_m
    else:
        foot_m = ((goal[0] - a[0]) * (b[0] - a[0]) + (goal[1] - a[1]) * (b[1] - a[1])) / length_m
        along_m = min(max(foot_m, range_m), length_m - range_m)
    if along_m == length_m:
        return b
    share = along_m / length_m
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])


def passable(crossing: Crossing, range_m: float) -> bool:
    """Return whether an edge is long enough for a robot of that radius in metres; a corner is only for a point."""
    return _square(*crossing) >= 4.0 * range_m * range_m


def _square(one: Point, two: Point) -> float:
    return (one[0] - two[0]) ** 2 + (one[1] - two[1]) ** 2
