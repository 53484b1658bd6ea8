"""From a situation and a request to a plan: the one function that the command line, the bridge and replays call."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from shapely import LineString, Point

from missions.drive_model import Envelope, envelope
from missions.errors import (
    NoRouteError,
    PlanCheckError,
    SituationError,
    TargetBlockedError,
)
from missions.fence import PolygonZone
from missions.geo import distance_m, rounded
from missions.ground import EDGE_BOW_M, Ground, check_ground, lay_out
from missions.items import MissionItem, last_place, waypoint
from missions.known_fence import fence_warnings, known_fence
from missions.local_frame import (
    MAX_LATITUDE_DEG,
    LocalPoint,
    autopilot_line,
    bow_m,
    check_latitude,
    frame_around,
)
from missions.narrow import widest_clearance_m
from missions.route import Route, find_route, simplified
from missions.vehicle import vehicle_from_parameters

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.request import Request
    from missions.situation import Situation
    from missions.vehicle import Vehicle

MAX_LEG_M = 1000.0
"""Longer legs are split: the autopilot's straight line bows off ours with the square of the length."""

ROUNDING_RESERVE_M = 0.01
"""Rounding to degE7 moves a waypoint by 8 mm at most."""

MAX_FIELD_M = 100_000.0

_SAMPLE_M = 50.0
_TINY_LEG_M = 1.5
_WIDER_M = (0.3, 0.1, 0.03)
_WIDEST_TRIES = 40
_WIDEST_SHARE = 0.97
"""What of the widest clearance a route keeps: round corners of the last millimetre would need a waypoint every half metre."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A mission and what it promises.

    Parameters
    ----------
    items : tuple of MissionItem
        Waypoints for the autopilot, without the home item and without the start.
    path : tuple of LatLon
        The drawn lines as rounded into the items, start first.
    clearance_m : float or None
        Promised for the rover as it drives; None where only drawn lines were asked for.
    asked_m : float
        What the drawn lines have to keep (less where the first ones lead away from a fence nearby).
    drawn_clearance_m : float
        The least distance of the drawn lines, as rounded and as the autopilot draws them, to any fence (infinite without a fence near).
    driven_clearance_m : float
        The predicted least distance of the driven track.
    blocks : int
        Blocks of the partition that was searched.
    fence, ground : Fence, Ground
        What was planned around.
    vehicle : Vehicle
        What was known of the vehicle.
    envelope : Envelope
        The band that the vehicle is foreseen to stay in, and its times.
    home : LatLon or None
        For the mission's home item.
    """

    items: tuple[MissionItem, ...]
    path: tuple[LatLon, ...]
    start: LatLon
    targets: tuple[LatLon, ...]
    method: str
    length_m: float
    straight_line_m: float
    duration_s: float
    clearance_m: float | None
    asked_m: float
    drawn_clearance_m: float
    driven_clearance_m: float
    blocks: int
    fence: Fence
    ground: Ground
    vehicle: Vehicle
    envelope: Envelope
    home: LatLon | None
    warnings: tuple[str, ...]


def plan(situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None) -> Plan:
    """Plan a mission around the situation's fence.

    Raises
    ------
    FenceMissingError
        No fence is known.
    SituationError
        Start or target is not known, or home where FENCE_RADIUS is enforced around it.
    FenceError, VehicleError, InvalidPositionError
        The fence, a parameter or a position cannot be used.
    StartBlockedError, TargetBlockedError, NoRouteError
        No route; with the fences to blame.
    PlanCheckError
        The finished route failed its check: a defect of this program, never to be driven.
    """
    fence = known_fence(situation)
    vehicle = vehicle_from_parameters(situation.parameters, mav_type=situation.vehicle_type)
    start, targets = _ends(situation, request)
    home = situation.home.value if situation.home else None
    ground = ground_for(situation, vehicle, (start, *targets))
    promised_m, allowance_m, warnings = _clearance(request, vehicle)
    warnings = [*fence_warnings(vehicle, situation), *ground.warnings, *warnings]

    local = [ground.frame.to_local(position) for position in (start, *targets)]
    reserve_m = _reserve_m(ground)
    find = partial(
        find_route,
        ground,
        local[0],
        local[1:],
        snap_m=request.snap_m,
        method=request.method,
        should_stop=should_stop,
    )
    if request.widest:
        route, kept_m = _widest_route(find, widest_clearance_m(ground, local, should_stop))
        route = simplified(ground, route, _WIDEST_SHARE * kept_m)
        drawn_m = _WIDEST_SHARE * kept_m - reserve_m
        promised_m = max(0.0, drawn_m - allowance_m)
    else:
        drawn_m = promised_m + allowance_m
        route = _sparse_route(ground, find, drawn_m + reserve_m)
    if route.lead_away:
        warnings.append(
            f"the start stands {route.start_clearance_m:.2f} m from a fence, nearer than {drawn_m:.2f} m: "
            "the route first leads away, never nearer than that"
        )
    reached = tuple(map(rounded, ground.frame.to_lat_lons(route.points[list(route.target_indices)])))
    warnings += [
        f"the target {asked} is blocked: moved {distance_m(asked, found):.2f} m to {found}"
        for asked, found in zip(targets, reached, strict=True)
        if distance_m(asked, found) > ROUNDING_RESERVE_M
    ]
    path, lead_away = _rounded_path(ground, route)
    clearance_m = _check(ground, path, lead_away, route.start_clearance_m, drawn_m)
    forecast = envelope(
        ground.frame.to_local_array(path), vehicle, heading_deg=_heading_deg(situation, start)
    )
    driven_m = max(0.0, forecast.clearance_m(ground.edge))
    if allowance_m and driven_m < promised_m - 0.005 and not route.lead_away:
        warnings.append(
            f"the drive model foresees {driven_m:.2f} m at the nearest while driving, less than the {promised_m:.2f} m promised by the rule of thumb"
        )
    return Plan(
        items=tuple(waypoint(position) for position in path[1:]),
        path=path,
        start=start,
        targets=reached,
        method=request.method,
        length_m=_length_m(path),
        straight_line_m=_length_m((start, *targets)),
        duration_s=forecast.duration_s,
        clearance_m=promised_m if allowance_m else None,
        asked_m=drawn_m,
        drawn_clearance_m=clearance_m,
        driven_clearance_m=driven_m,
        envelope=forecast,
        blocks=route.blocks,
        fence=fence,
        ground=ground,
        vehicle=vehicle,
        home=home,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _ends(situation: Situation, request: Request) -> tuple[LatLon, tuple[LatLon, ...]]:
    start = request.start
    if start is None and situation.pose is not None:
        start = situation.pose.value.position
    if start is None and situation.home is not None:
        start = situation.home.value
    if start is None:
        raise SituationError("the start is not known: no position and no home; give one (--start LAT,LON)")
    targets = request.targets
    if not targets and situation.target is not None:
        targets = (situation.target.value,)
    if not targets and situation.mission is not None:
        place = last_place(situation.mission.value.items)
        targets = (place,) if place else ()
    if not targets:
        raise SituationError(
            "the target is not known: none was sent and no mission holds one; give one (--target LAT,LON)"
        )
    return start, targets


def _heading_deg(situation: Situation, start: LatLon) -> float | None:
    """Give the vehicle's heading where the route starts from where it stands."""
    pose = situation.pose
    return pose.value.heading_deg if pose is not None and pose.value.position == start else None


def ground_for(situation: Situation, vehicle: Vehicle, ends: Sequence[LatLon]) -> Ground:
    """Lay the situation's fence out in the plane as the vehicle's parameters say.

    Raises
    ------
    FenceMissingError, FenceError, InvalidPositionError, SituationError
        As `plan`.
    """
    fence = known_fence(situation)
    positions = [
        position
        for zone in fence.zones
        for position in (zone.vertices if isinstance(zone, PolygonZone) else (zone.centre,))
    ]
    frame = frame_around(positions)
    home = situation.home.value if situation.home and vehicle.fence.enforces_home_circle else None
    named = [*(("", position) for position in (*positions, *ends)), *([("home ", home)] if home else [])]
    for name, position in named:
        check_latitude(position)
        if (away_m := distance_m(frame.origin, position)) > MAX_FIELD_M:
            raise SituationError(
                f"{name}{position} is {away_m / 1000:.0f} km from the fence's centre {frame.origin}; "
                f"at most {MAX_FIELD_M / 1000:.0f} km can be planned",
                distance_m=away_m,
            )
    ground = lay_out(
        fence,
        frame,
        union=vehicle.fence.union,
        home=home,
        home_radius_m=vehicle.fence.radius_m if vehicle.fence.enforces_home_circle else None,
        around=ends,
    )
    check_ground(ground)
    return ground


def asked_clearance(situation: Situation, request: Request) -> tuple[Vehicle, float]:
    """Give the situation's vehicle and the clearance that a plan would promise."""
    vehicle = vehicle_from_parameters(situation.parameters, mav_type=situation.vehicle_type)
    return vehicle, _clearance(request, vehicle)[0]


def _clearance(request: Request, vehicle: Vehicle) -> tuple[float, float, list[str]]:
    """Give the clearance promised, the allowance on top, and what to say about them."""
    warnings = []
    promised_m = request.clearance_m
    if promised_m is None:
        promised_m = max(vehicle.fence.margin_m + 0.5, 1.0)
    elif vehicle.stops_within_m > promised_m:
        warnings.append(
            f"nearer than FENCE_MARGIN {vehicle.stops_within_m:g} m to the fence the vehicle stops in AUTO for good "
            f"(AVOID_ENABLE); the clearance of {promised_m:g} m is less"
        )
    allowance_m = request.corner_allowance_m
    if allowance_m is None:
        allowance_m = vehicle.waypoint_radius_m
        warnings.append(
            f"{allowance_m:g} m (WP_RADIUS) are kept on top of the clearance everywhere for cut corners: a rule of thumb"
        )
    named = {"FENCE_MARGIN": request.clearance_m is None, "WP_RADIUS": request.corner_allowance_m is None}
    warnings += [str(assumed) for assumed in vehicle.assumed if named.get(assumed.parameter)]
    return promised_m, allowance_m, warnings


def _sparse_route(ground: Ground, find: Callable[..., Route], clearance_m: float) -> Route:
    """Give the route at a clearance; where it winds round corners in tiny legs, one a little wider off with fewer waypoints."""
    route = find(clearance_m=clearance_m)
    for wider_m in _WIDER_M:
        if not _has_tiny_legs(route):
            break
        try:
            wider = find(clearance_m=clearance_m + wider_m)
        except (NoRouteError, TargetBlockedError):
            continue
        if wider.lead_away == route.lead_away:
            return simplified(ground, wider, clearance_m)
    return route


def _has_tiny_legs(route: Route) -> bool:
    legs_m = np.hypot(*np.diff(route.points, axis=0).T)
    return bool((legs_m[route.lead_away :] < _TINY_LEG_M).sum() > 1)


def _widest_route(find: Callable[..., Route], clearance_m: float) -> tuple[Route, float]:
    """Give the route at the widest clearance, and that clearance: a little less where corners are mitred in the narrowest place."""
    for _ in range(_WIDEST_TRIES):
        try:
            return find(clearance_m=clearance_m), clearance_m
        except (NoRouteError, TargetBlockedError):
            clearance_m *= 0.98
    return find(clearance_m=clearance_m), clearance_m


def _reserve_m(ground: Ground) -> float:
    east_min_m, north_min_m, east_max_m, north_max_m = ground.allowed.bounds
    diagonal_m = math.hypot(east_max_m - east_min_m, north_max_m - north_min_m)
    farthest_lat_deg = min(abs(ground.frame.origin.lat_deg) + diagonal_m / 1.1e5, MAX_LATITUDE_DEG)
    return ROUNDING_RESERVE_M + bow_m(min(diagonal_m, MAX_LEG_M), farthest_lat_deg)


def _rounded_path(ground: Ground, route: Route) -> tuple[tuple[LatLon, ...], int]:
    """Split long legs, round to degE7, drop waypoints that fall together; tell how many of the first legs lead away."""
    path = [rounded(ground.frame.to_lat_lon(LocalPoint(*route.points[0].tolist())))]
    lead_away = 0
    for number, (a, b) in enumerate(pairwise(route.points)):
        pieces = max(1, math.ceil(math.dist(a, b) / MAX_LEG_M))
        for position in ground.frame.to_lat_lons(a + (b - a) * (np.arange(1, pieces + 1) / pieces)[:, None]):
            if rounded(position) != path[-1]:
                path.append(rounded(position))
                lead_away += number < route.lead_away
    return tuple(path) if len(path) > 1 else (path[0], path[0]), lead_away


def _length_m(path: Sequence[LatLon]) -> float:
    return sum(distance_m(a, b) for a, b in pairwise(path))


def _check(
    ground: Ground, path: Sequence[LatLon], lead_away: int, start_clearance_m: float, drawn_m: float
) -> float:
    """Measure the finished lines, as the autopilot draws them, and give their least clearance."""
    clearances_m = [ground.clearance_m(drawn_leg(ground, a, b)) for a, b in pairwise(path)]
    if not ground.edge.is_empty:  # it may stand so far off the autopilot's
        clearances_m = [max(0.0, clearance_m - EDGE_BOW_M) for clearance_m in clearances_m]
    asked_m = {"lead-away": min(start_clearance_m, drawn_m) - ROUNDING_RESERVE_M, "route": drawn_m}
    for name, found in (("lead-away", clearances_m[:lead_away]), ("route", clearances_m[lead_away:])):
        if found and min(found) < asked_m[name] - 1e-6:
            raise PlanCheckError(
                f"the {name} comes {min(found):.4f} m near a fence; at least {asked_m[name]:.4f} m was asked. This is a defect",
                clearance_m=min(found),
                asked_m=asked_m[name],
            )
    return min(clearances_m)


def drawn_leg(ground: Ground, a: LatLon, b: LatLon) -> LineString | Point:
    """Give the autopilot's straight line between two positions, in the plane."""
    pieces = max(1, math.ceil(distance_m(a, b) / _SAMPLE_M))
    line = ground.frame.to_local_array(autopilot_line(a, b, pieces))
    return Point(line[0]) if a == b else LineString(line)
