"""Gaps: where the fences on both sides of a leg come nearest to one another, and a straight leg through between them.

**How.** From a place on a leg the leg is followed both ways until a fence ends it. The fence on its left and that on its right, within
reach, are joined by their shortest line: that is the gap. A straight leg is laid across the middle of that line at a right angle, with a few
lengths before and behind it, and the corners that it replaces go.

**Why.** A rover keeps its line best where the line is straight (no cut, no new swing), so it should turn in the open before and behind. And
the moves of one corner cannot find this: with a corner on either side of a gate, moving only one of them turns the leg across the gate and
makes the band worse, so a descent stops there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import shapely

from missions.fitting import polyline as drawn
from missions.fitting.polyline import Drawing, DrawnPoint, shifted
from missions.geo import LocalPoint

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shapely.geometry.base import BaseGeometry

    from missions.geo import Vector

REACH_M = 8.0
"""How far around a place the fences on both sides are looked at, and how far beside the new leg old corners give way to it.

Chosen, not measured: it bounds what counts as a gap.
"""

ENDS_M = (6.0, 12.0, 20.0, 30.0)
"""How far before and behind the narrowest place the straight leg may begin and end; swings die away over 25 m at 5 m/s (docs/drive-model.md)."""

_APART_M = 3.0  # old corners this near to the new leg's ends go too: nearer turns are one turn to a rover (`moves.APART_M`)
_SHY = 0.95  # of the way to a fence ahead: stops short of it, so that the fence ahead is on neither side


@dataclass(frozen=True, slots=True)
class Gap:
    """A gap between the fences on both sides of a leg.

    Parameters
    ----------
    middle : LocalPoint
        Half-way between the fences where they are nearest, in metres.
    through : (float, float)
        The unit vector across that shortest line, the way that the leg leads.
    """

    middle: LocalPoint
    through: Vector

    def off(self, point: DrawnPoint) -> tuple[float, float]:
        """Return how far behind the narrowest place a point lies, and how far beside the way through."""
        east_m, north_m = point.place.east_m - self.middle.east_m, point.place.north_m - self.middle.north_m
        along_m = east_m * self.through[0] + north_m * self.through[1]
        return along_m, abs(east_m * self.through[1] - north_m * self.through[0])


def find_gap(edge: BaseGeometry, place: LocalPoint, ahead: Vector) -> Gap | None:
    """Find the narrow place that a leg leads through.

    Parameters
    ----------
    edge : shapely geometry
        The boundary of the allowed ground, in metres.
    place : LocalPoint
        A place on the leg.
    ahead : (float, float)
        The leg's direction, a unit vector.

    Returns
    -------
    Gap or None
        None where one of the sides has no fence near.
    """
    begin, end = (shifted(place, ahead, _free_m(edge, place, ahead, way_m)) for way_m in (-REACH_M, REACH_M))
    sides = []
    for right_m in (REACH_M, -REACH_M):
        across = (ahead[1], -ahead[0])
        box = shapely.Polygon([begin, end, shifted(end, across, right_m), shifted(begin, across, right_m)])
        sides.append(shapely.intersection(edge, box))
    if sides[0].is_empty or sides[1].is_empty:
        return None
    (east_a, north_a), (east_b, north_b) = shapely.get_coordinates(shapely.shortest_line(*sides)).tolist()
    width_m = math.dist((east_a, north_a), (east_b, north_b))
    if not width_m:
        return None
    through = ((north_a - north_b) / width_m, (east_b - east_a) / width_m)
    if through[0] * ahead[0] + through[1] * ahead[1] < 0:
        through = (-through[0], -through[1])
    return Gap(LocalPoint((east_a + east_b) / 2, (north_a + north_b) / 2), through)


def _free_m(edge: BaseGeometry, place: LocalPoint, ahead: Vector, way_m: float) -> float:
    """Return how far a leg can be followed in one direction without meeting a fence: what lies behind a fence is on no side."""
    ray = shapely.LineString([place, shifted(place, ahead, way_m)])
    met = shapely.intersection(ray, edge)
    return way_m if met.is_empty else _SHY * math.copysign(shapely.distance(shapely.Point(place), met), way_m)


def straight_through(drawing: Drawing, index: int, gap: Gap) -> Iterator[Drawing]:
    """Return lines with one straight leg through a narrow place, instead of the corners near it.

    Parameters
    ----------
    drawing : Drawing
        The lines.
    index : int
        The point that comes too near to a fence, or the end of the leg that does.
    gap : Gap
        The gap.
    """
    off = [gap.off(point) for point in drawing]

    def gives_way(number: int, before_m: float, behind_m: float) -> bool:
        along_m, beside_m = off[number]
        is_near = -before_m - _APART_M < along_m < behind_m + _APART_M and beside_m < REACH_M
        return is_near and not drawn.is_end_or_fixed(drawing, number)

    for before_m in ENDS_M:
        for behind_m in ENDS_M:
            first = last = max(index, 1)
            while gives_way(first - 1, before_m, behind_m):
                first -= 1
            while gives_way(last, before_m, behind_m):
                last += 1
            point = drawing[last]._replace(is_fixed=False, stop_s=None)
            ends = (
                point.at(shifted(gap.middle, gap.through, -before_m)),
                point.at(shifted(gap.middle, gap.through, behind_m)),
            )
            yield (*drawing[:first], *ends, *drawing[last:])
