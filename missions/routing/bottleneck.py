"""Narrow ground: the widest route there is, and between which fences its narrowest place lies."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

import pbpp
from missions.fence import ZoneKind
from missions.geo import LocalPoint

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.ground.ground import Ground


_LESS_M = (0.0, 0.02, 0.1, 0.5)
"""Less than the widest clearance, one after the other: straight legs turn round corners of fences at a little more than they keep. Chosen."""


@dataclass(frozen=True, slots=True)
class NarrowestPlace:
    """The narrowest place of the widest route between two points.

    Parameters
    ----------
    clearance_m : float
        The most clearance any route between them keeps; infinite without a fence.
    between : tuple of str
        The fences that face each other there; one where an end stands near a fence.
    at : LatLon or None
        The place.
    """

    clearance_m: float
    between: tuple[str, ...]
    at: LatLon | None

    @property
    def where(self) -> str:
        """Return where the narrowest place is, after a comma; empty where that is not known."""
        if self.at is None:
            return ""
        fences = " and ".join(dict.fromkeys(self.between))
        between = "between" if len(set(self.between)) > 1 else "at"
        return f", narrowest {between} {fences} at {self.at}" if fences else f", narrowest at {self.at}"

    def __str__(self) -> str:
        return (
            f"the widest keeps {self.clearance_m:.2f} m{self.where}"
            if self.at
            else "no fence limits the width"
        )


def narrowest_place(
    ground: Ground,
    start: LocalPoint,
    goal: LocalPoint,
    should_stop: Callable[[], bool] | None = None,
) -> NarrowestPlace | None:
    """Find the widest route between two points and its narrowest place; None where there is no route at all."""
    inclusions, exclusions = ground.areas(ZoneKind.INCLUSION), ground.areas(ZoneKind.EXCLUSION)
    try:
        way = pbpp.widest(inclusions, exclusions, start, goal, union=ground.union, should_stop=should_stop)
    except pbpp.PlanningError:
        return None
    if not way.parts:
        return NarrowestPlace(way.clearance_m, (), None)
    middle = np.mean(way.points, axis=0)
    at = ground.frame.to_lat_lon(LocalPoint(float(middle[0]), float(middle[1])))
    return NarrowestPlace(way.clearance_m, tuple(_part_name(ground, part) for part in way.parts), at)


def widest_line(
    ground: Ground,
    start: LocalPoint,
    goal: LocalPoint,
    place: NarrowestPlace,
    should_stop: Callable[[], bool] | None = None,
) -> NDArray[np.float64] | None:
    """Return the shortest straight legs by a narrowest place that keep what can be kept there, shape (n, 2); None where none could be laid."""
    inclusions, exclusions = ground.areas(ZoneKind.INCLUSION), ground.areas(ZoneKind.EXCLUSION)
    for less_m in _LESS_M:
        clearance_m = max(0.0, place.clearance_m - less_m)
        planner = pbpp.Planner(inclusions, exclusions, clearance_m=clearance_m, union=ground.union)
        try:
            return planner.plan(start, goal, should_stop=should_stop).points
        except (pbpp.NoPathError, pbpp.StartBlockedError, pbpp.GoalBlockedError):
            continue
    return None


def widest_clearance_m(
    ground: Ground, points: Sequence[LocalPoint], should_stop: Callable[[], bool] | None = None
) -> float:
    """Return the greatest clearance that a route over all points keeps; 0 where there is no route."""
    return kept_m([narrowest_place(ground, a, b, should_stop) for a, b in pairwise(points)])


def kept_m(places: Sequence[NarrowestPlace | None]) -> float:
    """Return what a route by all these places keeps; 0 where there is no route."""
    return min((place.clearance_m if place else 0.0 for place in places), default=0.0)


def _part_name(ground: Ground, part: tuple[str, int]) -> str:
    kind, index = part
    names = [barrier.name for barrier in ground.barriers if barrier.kind == kind]
    return names[index] if names else "the edge of the field"
