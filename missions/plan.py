"""From a situation and a request to a plan: the one function that the command line, the bridge and replays call."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from missions import clearance
from missions.avoidance import with_avoidance
from missions.clearance import known_vehicle, promise
from missions.drawn import DrawnPoint
from missions.drive_model import beyond_measured, envelope
from missions.driven_route import DrivenRoute, RouteSearch
from missions.errors import NoRouteError, PlanCheckError, RouteError, TargetBlockedError
from missions.geo import bearing_deg, distance_m, rounded
from missions.known_fence import fence_warnings, known_fence
from missions.lines import (
    MAX_LEG_M,
    ROUNDING_RESERVE_M,
    Lines,
    check_lines,
    drawn_leg,
    finished,
    mission_items,
    path_length_m,
    reserve_m,
)
from missions.local_frame import LocalPoint
from missions.narrow import widest_clearance_m
from missions.route import Route, find_route, simplified
from missions.surroundings import MAX_FIELD_M, ground_for, heading_at, route_ends

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.clearance import Promise
    from missions.drive_model import Envelope
    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.ground import Ground
    from missions.items import MissionItem
    from missions.request import Request
    from missions.situation import Situation
    from missions.vehicle import Vehicle

__all__ = [
    "MAX_FIELD_M",
    "MAX_LEG_M",
    "ROUNDING_RESERVE_M",
    "Plan",
    "asked_clearance",
    "drawn_leg",
    "ground_for",
    "plan",
]

_TINY_LEG_M = 1.5
_WIDER_M = (0.3, 0.1, 0.03)
_WIDEST_TRIES = 40
_WIDEST_SHARE = 0.97
"""What of the widest clearance a route keeps: round corners of the last millimetre would need a waypoint every half metre."""

_DRIVEN_SHARES = (1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.2, 0.1, 0.0)
"""What of the widest clearance is tried one after another where the route is to be driven."""

_ROUNDING_M = 1e-6


@dataclass(frozen=True, eq=False)
class Plan:
    """A mission and what it promises.

    Parameters
    ----------
    items : tuple of MissionItem
        For the autopilot, without the home item and without the start: waypoints, and changes of speed between them.
    path : tuple of LatLon
        The drawn lines as rounded into the items, start first.
    seqs : tuple of int
        For each point of the path the seq of its waypoint in the mission (home is 0, and stands for the start).
    speeds : tuple of float or None
        The speed asked for on each leg of the path in m/s; None is the vehicle's own.
    clearance_m : float or None
        Promised for the rover as it drives; None where only drawn lines were asked for.
    asked_m : float
        What the drawn lines have to keep (less where the first ones lead away from a fence nearby); where the route is fitted to the
        drive model, the driven band too: the promise, the position's error and the owner's reserve.
    drawn_clearance_m : float
        The least distance of the drawn lines, as rounded and as the autopilot draws them, to any fence (infinite without a fence near).
    driven_clearance_m : float
        The least distance of the band that the vehicle is foreseen to drive in.
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
    seqs: tuple[int, ...]
    speeds: tuple[float | None, ...]
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

    def path_index(self, seq: int, after: int = 0) -> int:
        """Give which point of the path a mission item drives to; for a change of speed the one that it is for.

        Of an item that is driven to several times the first time from point ``after`` on, else the first of all.
        """
        points = (*range(after, len(self.path)), *range(after))
        exact = (point for point in points if self.seqs[point] == seq)
        later = (point for point in points if self.seqs[point] > seq)
        return next(exact, next(later, len(self.path) - 1))


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
        No route; with the fences, or the corner, to blame.
    PlanCheckError
        The finished route failed its check: a defect of this program, never to be driven.
    """
    fence = known_fence(situation)
    vehicle = known_vehicle(situation, request)
    start, targets = route_ends(situation, request)
    ground = ground_for(situation, vehicle, (start, *targets))
    asked = promise(situation, request, vehicle)
    warnings = [*fence_warnings(vehicle, situation), *ground.warnings, *asked.warnings]

    heading_deg = heading_at(situation, start)
    problem = _Problem(situation, request, ground, vehicle, heading_deg, (start, *targets), should_stop)
    asked, found = problem.uniform(asked) if asked.allowance_m is not None else problem.fitted(asked)
    lines = finished(ground, found.drawing, found.lead_away)
    reached = tuple(map(rounded, ground.frame.to_lat_lons(np.array(found.targets))))
    least_m = asked.required_m + (asked.allowance_m or 0.0)
    drawn_clearance_m = check_lines(ground, lines, found.start_clearance_m, least_m)
    band = _band(ground, lines, vehicle, heading_deg)
    if asked.allowance_m is None:
        _check_band(ground, lines, band, found, asked)
    items, seqs = mission_items(lines, vehicle.speed_mps, request.speed_mps)
    driven_m = max(0.0, band.clearance_m(ground.edge))
    return Plan(
        items=items,
        path=lines.path,
        seqs=seqs,
        speeds=lines.speeds,
        start=start,
        targets=reached,
        method=request.method,
        length_m=path_length_m(lines.path),
        straight_line_m=path_length_m((start, *targets)),
        duration_s=band.duration_s,
        clearance_m=None if asked.allowance_m == 0 else asked.promised_m,
        asked_m=least_m,
        drawn_clearance_m=drawn_clearance_m,
        driven_clearance_m=driven_m,
        envelope=band,
        blocks=found.blocks,
        fence=fence,
        ground=ground,
        vehicle=vehicle,
        home=situation.home.value if situation.home else None,
        warnings=tuple(
            dict.fromkeys(
                [
                    *warnings,
                    *_lead_away_warnings(found, least_m),
                    *_moved_target_warnings(targets, reached),
                    *_drive_warnings(vehicle, heading_deg, asked, driven_m, found),
                ]
            )
        ),
    )


def asked_clearance(situation: Situation, request: Request) -> tuple[Vehicle, float]:
    """Give the situation's vehicle and the clearance that a plan would promise."""
    vehicle = known_vehicle(situation, request)
    return vehicle, promise(situation, request, vehicle).promised_m


@dataclass(frozen=True, eq=False)
class _Problem:
    """Everything a route is sought with."""

    situation: Situation
    request: Request
    ground: Ground
    vehicle: Vehicle
    heading_deg: float | None
    ends: tuple[LatLon, ...]
    should_stop: Callable[[], bool] | None

    @property
    def local(self) -> list[LocalPoint]:
        """Start and targets in the plane."""
        return [self.ground.frame.to_local(position) for position in self.ends]

    def fitted(self, asked: Promise) -> tuple[Promise, DrivenRoute]:
        """Give a route whose driven band keeps what is promised."""
        if not self.request.widest:
            return asked, self._search(asked.required_m).find()
        widest_m = widest_clearance_m(self.ground, self.local, self.should_stop)
        refusal: RouteError | None = None
        for share in _DRIVEN_SHARES:
            required_m = max(0.0, share * (widest_m - clearance.NARROWEST_BAND_M))
            try:
                found = self._search(required_m).find()
            except RouteError as error:
                refusal = error
                continue
            promised_m = max(0.0, required_m - asked.error_m)
            return replace(asked, promised_m=promised_m, error_m=required_m - promised_m), found
        assert refusal is not None
        raise refusal

    def _search(self, required_m: float) -> RouteSearch:
        start, *targets = self.local
        return RouteSearch(
            self.ground,
            start,
            targets,
            required_m,
            reserve_m(self.ground),
            self.vehicle,
            self.heading_deg,
            self.request.snap_m,
            self.request.method,
            self.should_stop,
            self.request.escape,
        )

    def uniform(self, asked: Promise) -> tuple[Promise, DrivenRoute]:
        """Give a route with the same room everywhere on top of the promise."""
        wanted_m = asked.allowance_m or 0.0
        start, *targets = self.local
        find = partial(
            find_route,
            self.ground,
            start,
            targets,
            snap_m=self.request.snap_m,
            method=self.request.method,
            escape=self.request.escape,
            should_stop=self.should_stop,
        )
        rounding_m = reserve_m(self.ground)
        if self.request.widest:
            route, kept_m = _widest_route(find, widest_clearance_m(self.ground, self.local, self.should_stop))
            route = simplified(self.ground, route, _WIDEST_SHARE * kept_m)
            drawn_m = _WIDEST_SHARE * kept_m - rounding_m
            promised_m = max(0.0, drawn_m - wanted_m - asked.error_m)
            asked = replace(asked, promised_m=promised_m, error_m=drawn_m - wanted_m - promised_m)
        else:
            drawn_m = asked.required_m + wanted_m
            route = _sparse_route(self.ground, find, drawn_m + rounding_m)
        drawing = tuple(
            DrawnPoint(east_m, north_m, drawn_m, drawn_m) for east_m, north_m in route.points.tolist()
        )
        reached = tuple(LocalPoint(*route.points[index].tolist()) for index in route.target_indices)
        return asked, DrivenRoute(drawing, route.lead_away, route.start_clearance_m, reached, route.blocks)


def _band(ground: Ground, lines: Lines, vehicle: Vehicle, heading_deg: float | None) -> Envelope:
    """Foresee the drive; a heading that is not known is taken along the first leg."""
    if heading_deg is None:
        heading_deg = bearing_deg(*lines.path[:2])
    band = envelope(
        ground.frame.to_local_array(lines.path),
        vehicle,
        heading_deg=heading_deg,
        speeds=lines.speeds,
        stops=lines.stops,
    )
    return with_avoidance(band, vehicle, ground.edge)


def _check_band(ground: Ground, lines: Lines, band: Envelope, found: DrivenRoute, asked: Promise) -> None:
    """Refuse a plan whose band breaks the promise."""
    clearances_m = band.clearances_m(ground.edge)
    leading = (band.waypoints <= lines.lead_away) & (lines.lead_away > 0)
    near_m = asked.required_m if found.lead_away_m is None else found.lead_away_m
    for name, part, least_m in (
        ("lead-away", leading, near_m),
        ("route", ~leading, asked.required_m),
    ):
        kept_m = float(clearances_m[part].min(initial=np.inf))
        if kept_m < least_m - _ROUNDING_M:
            raise PlanCheckError(
                f"the {name} is foreseen to be driven {kept_m:.4f} m near a fence; {least_m:.4f} m was required. This is a defect",
                clearance_m=kept_m,
                asked_m=least_m,
            )


def _lead_away_warnings(found: DrivenRoute, least_m: float) -> list[str]:
    if not found.lead_away:
        return []
    if found.start_clearance_m < 0:
        return [
            f"the start is on forbidden ground, {-found.start_clearance_m:.2f} m from free ground: the first leg drives out of it"
        ]
    if found.lead_away_m is None:
        distance = f"{found.start_clearance_m:.2f} m from a fence, nearer than {least_m:.2f} m"
        return [f"the start stands {distance}: the route first leads away, never nearer than that"]
    distance = f"{found.start_clearance_m:.2f} m from a fence, too near to leave it with {least_m:.2f} m kept"
    nearest_m = max(found.lead_away_m, 0.0)
    return [
        f"the start stands {distance}: the route first leads away; turning there the vehicle may come as near as {nearest_m:.2f} m"
    ]


def _moved_target_warnings(targets: Sequence[LatLon], reached: Sequence[LatLon]) -> list[str]:
    return [
        f"the target {asked} is blocked: moved {distance_m(asked, found):.2f} m to {found}"
        for asked, found in zip(targets, reached, strict=True)
        if distance_m(asked, found) > ROUNDING_RESERVE_M
    ]


def _drive_warnings(
    vehicle: Vehicle, heading_deg: float | None, asked: Promise, driven_m: float, found: DrivenRoute
) -> list[str]:
    """Say what the drive model's word rests on."""
    if asked.allowance_m == 0:
        return []
    warnings = list(beyond_measured(vehicle))
    if heading_deg is None:
        warnings.append("the vehicle's heading is not told: it is taken to face along the first leg")
    assumed = [f"{one.parameter} {one.value:g}" for one in vehicle.assumed if one.parameter in _DRIVEN_BY]
    if assumed:
        warnings.append(f"how the vehicle drives is not told in full; taken as {', '.join(assumed)}")
    if asked.allowance_m and driven_m < asked.promised_m - 0.005 and not found.lead_away:
        warnings.append(
            f"the drive model foresees {driven_m:.2f} m at the nearest while driving, less than the {asked.promised_m:.2f} m promised "
            f"with an allowance of {asked.allowance_m:g} m"
        )
    return warnings


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


_DRIVEN_BY = frozenset(
    {
        "WP_SPEED",
        "WP_RADIUS",
        "TURN_RADIUS",
        "ATC_TURN_MAX_G",
        "ATC_ACCEL_MAX",
        "WP_PIVOT_ANGLE",
        "SERVO1_FUNCTION",
        "NAV_ACC_RAD",
        "RO_SPEED_LIM",
        "CA_AIRFRAME",
    }
)
"""Parameters whose defaults a driver should see when they stand in for the vehicle's own."""
