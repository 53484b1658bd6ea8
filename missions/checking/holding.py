"""Where a HOLD ends: on a route that is planned or checked, and from where the vehicle is now."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

from missions.drive_model.hold_loop import HoldLoop, ending_of
from missions.drive_model.stopping import HoldCheck, Motion, RollOut, motion
from missions.errors import MissionError
from missions.geo import LocalPoint, destination, distance_m
from missions.ground.from_situation import ground_for
from missions.ground.seams import is_seam
from missions.promise import known_vehicle
from missions.situation import Pose
from missions.stops import NEARLY_MPS
from missions.vehicle import known_ardupilot

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from missions.drive_model import Envelope
    from missions.drive_model.stopping import Leaving, Stopping
    from missions.ground.ground import Ground
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation
    from missions.stops import Rolling, Stops
    from missions.vehicle import Vehicle

_NEGLIGIBLE_M = 0.1
"""So far beyond a fence's line an estimated stop is taken for one before it."""

_PAST_M = 10.0  # the longest blend of a corner measured, 3 m on each leg at 5 m/s, and the lag of MISSION_CURRENT; chosen
_BEHIND_M = 1e-3  # beyond the line, where its zone is looked for

_SLOWED = 0.85
"""At so much of its first speed a roll tells how it will go on: less of it is within the noise of speeds. Chosen."""

TAKES_S = 0.5
"""So long until a HOLD that is sent now is taken: half of it is the age of the position, half a radio's delay. Chosen, not measured."""


def hold_check(band: Envelope, vehicle: Vehicle, ground: Ground, stops: Stops) -> HoldCheck | None:
    """Return what HOLD does anywhere on a drive, straight on in the direction of travel; None where it is not known, or nothing is driven.

    Parameters
    ----------
    band : Envelope
        The drive, in the ground's frame.
    vehicle : Vehicle
        What drives.
    ground : Ground
        The fence; seams of a union do not count, for HOLD rolls across them.
    stops : Stops
        What is known of how far it rolls.
    """
    moving = motion(band, vehicle, ground.avoided_edge)
    if moving is None or not len(moving.places):
        return None
    ground = _without_seams(ground)
    stopping = ending_of(vehicle, stops)
    leaving = stopping.leaves(moving, ground.allowed)
    fastest_mps = float(moving.speeds_mps.max())
    worst = int(leaving.beyond_m.argmax())
    return HoldCheck(
        fastest_mps,
        stopping.distance_m(fastest_mps),
        stopping.source(fastest_mps),
        _roll_out(moving, worst, leaving, ground) if leaving.beyond_m[worst] > _NEGLIGIBLE_M else None,
        stopping.aside_m(fastest_mps) if isinstance(stopping, HoldLoop) else None,
    )


def with_hold(plan: Plan, situation: Situation) -> Plan:
    """Return a plan with what HOLD does on its route, and a warning where one would end beyond a fence."""
    hold = hold_check(plan.envelope, plan.vehicle, plan.ground, situation.stops)
    return replace(plan, hold=hold, warnings=(*plan.warnings, *hold_warnings(hold)))


def hold_warnings(hold: HoldCheck | None) -> list[str]:
    """Return a warning where a HOLD would end beyond a fence."""
    return [hold.sentence] if hold is not None and hold.worst is not None else []


def hold_info(hold: HoldCheck | None) -> list[str]:
    """Return how far the vehicle rolls on, where every HOLD ends within the fence: for those who are about to drive."""
    return [hold.sentence] if hold is not None and hold.worst is None else []


def _roll_out(moving: Motion, at: int, leaving: Leaving, ground: Ground) -> RollOut:
    to_fence_m = max(0.0, float(leaving.reach_m[at] - leaving.beyond_m[at]))
    ahead = moving.places[at] + moving.ways[at] * (to_fence_m + _BEHIND_M)
    behind = Point(ahead if leaving.ends is None else leaving.ends[at])
    forbidding = ground.forbidding(behind)
    nearest, _ = ground.nearest(behind)
    zone = forbidding[0] if forbidding else nearest
    return RollOut(
        at=ground.frame.to_lat_lon(LocalPoint(*moving.places[at].tolist())),
        speed_mps=float(moving.speeds_mps[at]),
        stopping_m=float(leaving.reach_m[at]),
        to_fence_m=to_fence_m,
        fence=zone.name if zone is not None else None,
    )


def _without_seams(ground: Ground) -> Ground:
    barriers = tuple(barrier for barrier in ground.barriers if not is_seam(barrier.name))
    return ground if len(barriers) == len(ground.barriers) else replace(ground, barriers=barriers)


@dataclass(frozen=True, slots=True)
class HoldNow:
    """A HOLD sent now that would end beyond a fence.

    Parameters
    ----------
    roll_out : RollOut
        Where it would end; the way until it is taken counts.
    source : str
        What the stopping distance rests on.
    go_on_m : float or None
        After how far on the route a HOLD ends within the fence, where the predicted track stays within it until there; None: nowhere.
    """

    roll_out: RollOut
    source: str
    go_on_m: float | None


def hold_now(
    situation: Situation, request: Request, plan: Plan | None, *, item: int, age_s: float = 0.0
) -> HoldNow | None:
    """Return what a HOLD sent now would lead to; None where it ends within the fence, where the vehicle stands, and where too little is known.

    Parameters
    ----------
    situation : Situation
        Where the vehicle is, how it moves, and its fence as it is now.
    request : Request
        What is asked of routes.
    plan : Plan or None
        What it drives, where that is known.
    item : int
        The mission item that it is on its way to.
    age_s : float
        How old the position is.
    """
    pose = situation.pose.value if situation.pose is not None else None
    if pose is None or not pose.speed_mps:
        return None
    try:
        vehicle = known_vehicle(situation, request)
        ground = ground_for(situation, vehicle, (pose.position,))
    except MissionError:
        return None
    stopping = ending_of(vehicle, situation.stops)
    moving = _moving(pose, ground)
    leaving = stopping.leaves(moving, ground.allowed, (TAKES_S + age_s) * moving.speeds_mps)
    if leaving.beyond_m[0] <= _NEGLIGIBLE_M:
        return None
    ahead = _ahead(plan, pose, item, ground, vehicle) if plan is not None else None
    return HoldNow(
        _roll_out(moving, 0, leaving, ground),
        stopping.source(pose.speed_mps),
        _go_on_m(ahead, plan.envelope, stopping, ground) if ahead is not None and plan is not None else None,
    )


def resting_pose(situation: Situation, request: Request, rolling: Rolling) -> Pose | None:
    """Return where a vehicle that rolls out will stand; None while that is not known well enough, or it does not roll straight on.

    How its speed falls with the way is that of its own stops, else of measured ones; how far that takes it, this roll tells by itself.

    Parameters
    ----------
    situation : Situation
        Where the vehicle is and how it moves; what is known of its stops.
    request : Request
        What is asked of routes.
    rolling : Rolling
        What was seen of this stop.
    """
    pose = situation.pose.value if situation.pose is not None else None
    if pose is None or rolling.first is None or pose.velocity_mps is None:
        return None
    began, first_mps = rolling.first
    if not NEARLY_MPS < pose.speed_mps <= _SLOWED * first_mps:
        return None
    try:
        stopping = ending_of(known_vehicle(situation, request), situation.stops)
    except MissionError:
        return None
    if isinstance(stopping, HoldLoop) or known_ardupilot(situation) is False:
        return None  # PX4's HOLD steers
    left_m = stopping.distance_m(pose.speed_mps) - stopping.distance_m(NEARLY_MPS)
    so_far_m = stopping.distance_m(first_mps) - stopping.distance_m(pose.speed_mps)
    ahead_m = left_m * distance_m(began, pose.position) / so_far_m if so_far_m > 0 else 0.0
    way_deg = math.degrees(math.atan2(*pose.velocity_mps))
    return Pose(destination(pose.position, ahead_m, way_deg), pose.heading_deg, (0.0, 0.0))


def _moving(pose: Pose, ground: Ground) -> Motion:
    here = np.array([ground.frame.to_local(pose.position)])
    return Motion(here, np.array([pose.speed_mps]), np.array([pose.velocity_mps]) / pose.speed_mps)


def _ahead(plan: Plan, pose: Pose, item: int, ground: Ground, vehicle: Vehicle) -> Motion | None:
    """Return the rest of a drive, from where the vehicle is nearest to it.

    That its own avoidance slows it for the new fence does not count: how soon was not measured. It may be faster now than predicted, and brakes as it can.
    """
    points = ground.frame.to_local_array(plan.path)  # the ground of another fence has another frame
    moving = motion(replace(plan.envelope, points=points), vehicle)
    if moving is None or not len(moving.places):
        return None
    goal = plan.path_index(item)
    before = points[max(goal - 1, 0)]
    first = int(np.hypot(*(moving.places - before).T).argmin())
    # No farther than this leg and the corner after it: the route may come by here again.
    near_m = float(np.hypot(*(points[goal] - before))) + _PAST_M
    near = moving.places[first:][_along_m(moving.places[first:]) <= near_m]
    first += int(np.hypot(*(near - np.array(ground.frame.to_local(pose.position))).T).argmin())
    places = moving.places[first:]
    braked_mps = np.sqrt(np.maximum(pose.speed_mps**2 - 2 * vehicle.accel_max_mps2 * _along_m(places), 0.0))
    return Motion(places, np.maximum(moving.speeds_mps[first:], braked_mps), moving.ways[first:])


def _along_m(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each place is along the way from the first."""
    return np.cumsum(np.hypot(*np.diff(places, axis=0, prepend=places[:1]).T))


def _go_on_m(ahead: Motion, band: Envelope, stopping: Stopping | HoldLoop, ground: Ground) -> float | None:
    """Return how far the vehicle has to go on until a HOLD ends within the fence; None where it leaves the fence before.

    The way is predicted; the room that the prediction needs beside it is kept too.
    """
    room_m = max(
        [leg.half_width_m for leg in band.legs] + [corner.outside_overshoot_m for corner in band.corners]
    )
    places = np.asarray(shapely.points(ahead.places))
    strays = ~shapely.covers(ground.allowed, places) | (shapely.distance(ground.edge, places) < room_m)
    leaving = stopping.leaves(ahead, ground.allowed, TAKES_S * ahead.speeds_mps)
    safe = np.flatnonzero(np.isneginf(leaving.beyond_m) & ~np.maximum.accumulate(strays))
    return float(_along_m(ahead.places)[safe[0]]) if len(safe) else None
