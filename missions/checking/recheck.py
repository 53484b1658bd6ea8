"""Checking again what was planned: from where the vehicle is now, against the fence as it is now."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from shapely import LineString, Point

from missions.errors import MissionError
from missions.geo import distance_m
from missions.ground.from_situation import route_ground
from missions.ground.legs import drawn_leg
from missions.promise import asked_clearance

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

_TOLERANCE_M = 0.02  # more than rounding to degE7 moves a line (at most 5.6 mm a point); chosen, not measured


@dataclass(frozen=True, slots=True)
class Recheck:
    """What straight lines keep to the fence.

    Parameters
    ----------
    clearance_m : float
        Their least distance to forbidden ground; 0 where they cross it.
    asked_m : float
        What they have to keep.
    fence : str
        The zone that is nearest.
    moved_m : float
        How far the vehicle is from where the plan begins.
    """

    clearance_m: float
    asked_m: float
    fence: str
    moved_m: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether they keep it."""
        return self.clearance_m >= self.asked_m - _TOLERANCE_M


def recheck(plan: Plan, situation: Situation, item: int) -> Recheck:
    """Check the rest of a plan: from the vehicle's place to where mission item ``item`` leads, and on from there.

    On the first line the vehicle may be off the drawn one: there it has to keep what was predicted for the driven track. Where the plan
    leads away from a fence nearby, that line has to come no nearer than the vehicle is.
    """
    pose = situation.pose
    here = pose.value.position if pose is not None else plan.start
    try:
        ground = route_ground(situation, plan.vehicle, (here, *plan.targets))
    except MissionError as error:
        return Recheck(0.0, plan.asked_m, str(error))
    rest = plan.path[plan.path_index(item) :]
    here_m = ground.clearance_m(Point(ground.frame.to_local(here)))
    first_asked_m = min(plan.asked_m, plan.driven_clearance_m, here_m)
    lines = [(drawn_leg(ground, here, rest[0]), first_asked_m)]
    lines += [(drawn_leg(ground, a, b), plan.asked_m) for a, b in itertools.pairwise(rest)]
    worst, asked_m = min(lines, key=lambda line: ground.clearance_m(line[0]) - line[1])
    moved_m = distance_m(here, plan.start)
    return Recheck(ground.clearance_m(worst), asked_m, _nearest(ground, worst), moved_m)


def straight_line(situation: Situation, request: Request, target: LatLon) -> Recheck | None:
    """Check the straight line from the vehicle to a target; None where the fence or the place is not known."""
    pose = situation.pose
    if pose is None:
        return None
    try:
        vehicle, promised_m = asked_clearance(situation, request)
        ground = route_ground(situation, vehicle, (pose.value.position, target))
    except MissionError:
        return None
    line = drawn_leg(ground, pose.value.position, target)
    return Recheck(ground.clearance_m(line), promised_m, _nearest(ground, line))


def _nearest(ground: Ground, line: LineString | Point) -> str:
    barrier, _ = ground.nearest(line)
    return barrier.name if barrier else "no fence"
