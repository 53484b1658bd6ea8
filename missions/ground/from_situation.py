"""What a plan starts from: the ends of the route, the heading, and the ground about them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import NoRouteError, SituationError
from missions.geo import LatLon, distance_m, upper_distance_m
from missions.ground.frame import check_latitude, frame_around
from missions.ground.ground import Ground, check_ground, lay_out
from missions.ground.known_fence import known_fence
from missions.ground.obstacles import with_obstacles
from missions.ground.seams import with_seams
from missions.items import last_place

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.request import Request
    from missions.situation import Situation
    from missions.vehicle import Vehicle

MAX_FIELD_M = 100_000.0
"""No place of a plan is further from the fence's centre: the local plane's distances are good for a field, not for a country."""


def route_ends(situation: Situation, request: Request) -> tuple[LatLon, tuple[LatLon, ...]]:
    """Return start and targets: those of the request, else those of the situation.

    Raises
    ------
    SituationError
        One of them is not known.
    """
    start = request.start
    if start is None and situation.pose is not None:
        start = situation.pose.value.position
    if start is None and situation.home is not None:
        start = situation.home.value
    if start is None:
        raise SituationError("start unknown: no vehicle position and no home; use --start LAT,LON")
    targets = request.targets
    if not targets and situation.target is not None:
        targets = (situation.target.value,)
    if not targets and situation.mission is not None:
        place = last_place(situation.mission.value.items)
        targets = (place,) if place else ()
    if not targets:
        raise SituationError("target unknown: none was sent and no mission has one; use --target LAT,LON")
    return start, targets


def heading_at(situation: Situation, start: LatLon) -> float | None:
    """Return the vehicle's heading where the route starts from where it stands, in degrees clockwise from north."""
    pose = situation.pose
    return pose.value.heading_deg if pose is not None and pose.value.position == start else None


def ground_for(situation: Situation, vehicle: Vehicle, ends: Sequence[LatLon]) -> Ground:
    """Lay the situation's fence out in the plane as the vehicle's parameters require, with the obstacles that were reported.

    Raises
    ------
    FenceMissingError, FenceError, InvalidPositionError, SituationError, NoRouteError
        As `missions.planning.plan.plan`.
    """
    fence = known_fence(situation)
    frame = frame_around(fence.places)
    home = situation.home.value if situation.home and vehicle.fence.enforces_home_circle else None
    named = [*(("", position) for position in fence.places), *([("home ", home)] if home else [])]
    for name, position in named:
        if (away_m := _beyond_m(frame.origin, position)) is not None:
            raise SituationError(f"{name}{_too_far(position, frame.origin, away_m)}", distance_m=away_m)
        check_latitude(position)
    near = [end for end in ends if _beyond_m(frame.origin, end) is None]
    for end in near:
        check_latitude(end)
    ground = lay_out(
        fence,
        frame,
        union=vehicle.fence.union,
        home=home,
        home_radius_m=vehicle.fence.radius_m if vehicle.fence.enforces_home_circle else None,
        home_radius_name=vehicle.fence.radius_name,
        around=near,
    )
    check_ground(ground)
    ground = with_obstacles(ground, situation.obstacles)
    check_ground(ground)
    for end in ends:  # last: a fence that cannot be used is no matter of the target
        _check_reach(end, frame.origin)
    return ground


def route_ground(situation: Situation, vehicle: Vehicle, ends: Sequence[LatLon]) -> Ground:
    """Return the ground for a route: as `ground_for`, and the seams at which the vehicle would stop are obstacles too."""
    return with_seams(ground_for(situation, vehicle, ends), vehicle)


def _beyond_m(centre: LatLon, place: LatLon) -> float | None:
    """Return how far away a place is, None where a plane about the centre holds it."""
    if upper_distance_m(centre, place) <= MAX_FIELD_M:
        return None
    away_m = distance_m(centre, place)
    return away_m if away_m > MAX_FIELD_M else None


def _check_reach(end: LatLon, centre: LatLon) -> None:
    """Refuse a start or target so far away that no plane holds it and the fence: nothing can be driven there.

    Raises
    ------
    NoRouteError
        It is too far away.
    """
    if (away_m := _beyond_m(centre, end)) is not None:
        advice = "check the position (LAT,LON, latitude first) and the fence file"
        if (swapped := _swapped(end)) is not None and _beyond_m(centre, swapped) is None:
            advice = f"latitude comes first: did you mean {swapped}?"
        raise NoRouteError(f"no route: {_too_far(end, centre, away_m)}", distance_m=away_m, advice=advice)


def _swapped(position: LatLon) -> LatLon | None:
    """Return a position with latitude and longitude exchanged; None where that is none."""
    lat_deg, lon_deg = position.lon_deg, position.lat_deg
    return LatLon(lat_deg, lon_deg) if abs(lat_deg) <= 90.0 else None


def _too_far(position: LatLon, centre: LatLon, away_m: float) -> str:
    return (
        f"{position} is {away_m / 1000:.0f} km from the fence's centre {centre}; "
        f"the limit is {MAX_FIELD_M / 1000:.0f} km"
    )
