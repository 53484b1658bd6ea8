"""Where a place lies by the fence: which zone is nearest, and how far it is beyond it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from shapely import Point

from missions.errors import MissionError
from missions.fence import Obstacles, ZoneKind
from missions.ground.from_situation import ground_for
from missions.promise import asked_clearance
from missions.vehicle import Vehicle

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.ground.ground import Barrier, Ground
    from missions.request import Request
    from missions.situation import Situation


@dataclass(frozen=True, slots=True)
class FencePlace:
    """A place by its nearest fence.

    Parameters
    ----------
    fence : str
        The zone's name.
    beyond_m : float
        How far beyond its line, on forbidden ground; negative where it is still before it.
    """

    fence: str
    beyond_m: float


def fence_place(situation: Situation, request: Request, place: LatLon) -> FencePlace | None:
    """Return where a place lies by the fence of a situation; None where no fence is known or it cannot be laid out."""
    try:
        vehicle, _ = asked_clearance(situation, request)
    except MissionError:
        vehicle = Vehicle()
    try:
        ground = ground_for(replace(situation, obstacles=Obstacles()), vehicle, (place,))
    except MissionError:
        return None
    point = Point(ground.frame.to_local(place))
    broken = [FencePlace(one.name, _depth_m(one, point)) for one in ground.forbidding(point)]
    if broken:
        return max(broken, key=lambda found: found.beyond_m)
    return _before(ground, point)


def _before(ground: Ground, point: Point) -> FencePlace | None:
    barrier, distance_m = ground.nearest(point)
    return FencePlace(barrier.name, -distance_m) if barrier is not None else None


def _depth_m(barrier: Barrier, point: Point) -> float:
    if barrier.kind is ZoneKind.EXCLUSION:
        return float(barrier.area.boundary.distance(point))
    return float(barrier.area.distance(point))
