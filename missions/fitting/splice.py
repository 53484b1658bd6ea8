"""Lines made of several: along one drawing and, from some point on, along another one.

Routes that were fitted on the same field in several ways mostly fail, or are slow, at different places: what one of them has found for a hard
place, another one may lack. As the hard places lie one behind the other, lines that follow the one there and the other elsewhere have the best
of both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.fitting import polyline as drawn

if TYPE_CHECKING:
    from collections.abc import Iterator

    from missions.fitting.polyline import Drawing

_SKIPPED = 2  # points of the second drawing left out at the most, where its next one lies too near; chosen, not measured
_AHEAD_M = 0.05  # points of the second drawing that lie so little farther on are behind
_BESIDE_M = (
    25.0  # from a place on the one to the other: farther apart they go different ways; chosen, not measured
)


def splices(first: Drawing, second: Drawing) -> Iterator[Drawing]:
    """Return the lines that follow one drawing up to one of its points, and then another one; targets are met as often as before."""
    along_m = drawn.distances_m(second)
    fixed = sum(point.is_fixed for point in second)
    for index in range(len(first) - 1):
        there_m, beside_m = _nearest(second, along_m, first, index)
        if beside_m > _BESIDE_M:
            continue
        ahead = next((number for number, at_m in enumerate(along_m) if at_m > there_m + _AHEAD_M), None)
        if ahead is None:
            continue
        for begin in range(ahead, min(ahead + _SKIPPED, len(second))):
            lines = (*first[: index + 1], *second[begin:])
            if sum(point.is_fixed for point in lines) == fixed and lines not in (first, second):
                yield lines


def _nearest(lines: Drawing, along_m: list[float], other: Drawing, index: int) -> tuple[float, float]:
    """Return how far along lines the place nearest to another drawing's point lies, and how far beside it."""
    here = other[index].place
    best = (0.0, math.inf)
    for number in range(1, len(lines)):
        begin, ahead = lines[number - 1].place, drawn.direction(lines[number - 1], lines[number])
        length_m = along_m[number] - along_m[number - 1]
        on_m = (here[0] - begin[0]) * ahead[0] + (here[1] - begin[1]) * ahead[1]
        on_m = min(max(on_m, 0.0), length_m)
        beside_m = math.dist(here, drawn.shifted(begin, ahead, on_m))
        if beside_m < best[1]:
            best = (along_m[number - 1] + on_m, beside_m)
    return best
