"""One route: over targets in a given order, to a plan that ends where the last of them is."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from shapely import Point

from missions.checking.forecast import forecast_drive
from missions.checking.pivots import pivot_remarks
from missions.errors import PlanCheckError, StartBlockedError
from missions.finishing.mission_lines import Lines, check_lines, finished, mission_items
from missions.finishing.remarks import drive_remarks, escape_info, lead_away_remarks, moved_target_info
from missions.geo import path_length_m, rounded
from missions.ground.from_situation import ground_for, heading_at, route_ends
from missions.ground.known_fence import fence_warnings, known_fence
from missions.ground.px4_fence import own_promise_info, unenforced_warnings
from missions.ground.seams import with_seams
from missions.ground.start_hazard import start_hazard
from missions.planned import Clearances, Plan
from missions.promise import known_vehicle, promise, stop_warnings
from missions.routing.departure import least_turning_m, turning_hazard
from missions.routing.drawn_route import Sought
from missions.routing.no_route import NoRoute, NoRouteKind, explained
from missions.routing.promised_route import Found, PromisedRoute
from missions.routing.uniform_route import uniform_route, widest_uniform_route
from missions.vehicle.parameter_remarks import parameter_remarks
from missions.words import less_text
from pbpp.uncollected import uncollected

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.drive_model import Envelope
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.promise import Promise
    from missions.request import Request
    from missions.routing.route_search import DrivenRoute
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_ROUNDING_M = 1e-6  # a micrometre: differences of floating point, nothing that can be driven
_LESS_HELPS = frozenset(
    {NoRouteKind.TARGET_BLOCKED, NoRouteKind.NOWHERE_FREE, NoRouteKind.TOO_NARROW, NoRouteKind.CORNER}
)


def plan_route(
    situation: Situation,
    request: Request,
    *,
    should_stop: Callable[[], bool] | None = None,
    compares: bool = True,
) -> Plan:
    """Plan a route over the request's targets in their order, else to the one that the situation holds.

    Raises
    ------
    MissionError
        As `missions.planning.plan.plan`.
    """
    # Long by the warnings, which stand in the order in which they are told.
    fence = known_fence(situation)
    vehicle = known_vehicle(situation, request)
    start, targets = route_ends(situation, request)
    plain = ground_for(situation, vehicle, (start, *targets))
    ground = with_seams(plain, vehicle)
    asked = promise(situation, request, vehicle)
    warnings = [*parameter_remarks(situation), *fence_warnings(vehicle, situation), *ground.warnings]
    warnings += unenforced_warnings(vehicle, situation, plain)
    warnings += [*asked.warnings, *_start_remarks(plain, start, vehicle)]
    heading_deg = heading_at(situation, start)
    sought = _sought(ground, (start, *targets), request, asked, should_stop, compares=compares)
    wanted = asked
    asked, found = _route(sought, request, wanted, vehicle, heading_deg)
    if asked.promised_m < wanted.promised_m:
        warnings += stop_warnings(vehicle, asked)
    lines, drawn_m, band = _finished(ground, found, asked, vehicle, heading_deg)
    driven_m = max(0.0, band.clearance_m(ground.edge))
    items, seqs = mission_items(lines, vehicle.speed_mps, request.speed_mps)
    reached = tuple(rounded(ground.frame.to_lat_lon(target)) for target in found.targets)
    start_m = None if asked.allowance_m is not None else _start_m(band, lines, ground, asked, vehicle)
    warnings += lead_away_remarks(found, asked, start_m)
    warnings += drive_remarks(vehicle, heading_deg, asked, driven_m, found)
    warnings += pivot_remarks(plain, vehicle, band, seqs)
    less = _less_info(request, wanted, asked)
    return Plan(
        items=items,
        path=lines.path,
        seqs=seqs,
        speeds=lines.speeds,
        start=start,
        targets=reached,
        asked_targets=targets,
        method=request.method,
        straight_line_m=path_length_m((start, *targets)),
        keeps=Clearances(
            None if asked.allowance_m == 0 else asked.promised_m, asked.drawn_m, drawn_m, driven_m, start_m
        ),
        envelope=band,
        blocks=found.blocks,
        fence=fence,
        ground=ground,
        vehicle=vehicle,
        home=situation.home.value if situation.home else None,
        warnings=tuple(dict.fromkeys(warnings)),
        info=(
            *asked.info,
            *own_promise_info(vehicle),
            *less,
            *escape_info(found),
            *moved_target_info(targets, reached),
        ),
    )


def _sought(
    ground: Ground,
    ends: Sequence[LatLon],
    request: Request,
    asked: Promise,
    should_stop: Callable[[], bool] | None,
    *,
    compares: bool,
) -> Sought:
    start, *targets = (ground.frame.to_local(position) for position in ends)
    words = "" if request.widest else asked.words
    return Sought(
        ground, start, targets, request.method, request.snap_m, request.escape, should_stop, words, compares
    )


def _less_info(request: Request, wanted: Promise, asked: Promise) -> list[str]:
    """Return that less is promised than was asked, as was allowed."""
    is_less = asked.promised_m < wanted.promised_m and not request.widest
    return [less_text(wanted.words, asked.promised_m)] if is_less else []


def _route(
    sought: Sought, request: Request, asked: Promise, vehicle: Vehicle, heading_deg: float | None
) -> tuple[Promise, DrivenRoute]:
    """Return the route and what is promised for it.

    Raises
    ------
    StartBlockedError, TargetBlockedError, NoRouteError
        There is none.
    """
    found = _looked_for(sought, request, asked, vehicle, heading_deg)
    if isinstance(found, NoRoute):
        raise explained(found, vehicle).error()
    return found


@uncollected()
def _looked_for(
    sought: Sought, request: Request, asked: Promise, vehicle: Vehicle, heading_deg: float | None
) -> Found | NoRoute:
    """Return the route and what is promised for it; else why there is none.

    Thousands of lines are measured for one plan and kept until the route is found. Python's garbage collection would look through all of them again and
    again (without it ten hard plans took 0.88 of the CPU time), and once more at the end if they were not dropped before it is on again.
    """
    if asked.allowance_m is None:
        promised = PromisedRoute(sought, vehicle, heading_deg)
        find, widest = promised.find, promised.widest
    else:
        find, widest = partial(uniform_route, sought), partial(widest_uniform_route, sought)
    found = widest(asked) if request.widest else find(asked)
    if isinstance(found, NoRoute) and request.accepts_less and found.kind in _LESS_HELPS:
        less = widest(asked)
        found = found if isinstance(less, NoRoute) else less
    return found


def _finished(
    ground: Ground, found: DrivenRoute, asked: Promise, vehicle: Vehicle, heading_deg: float | None
) -> tuple[Lines, float, Envelope]:
    """Return the lines as they are uploaded, what they keep as drawn, and their band: both measured anew.

    Raises
    ------
    PlanCheckError
        They do not keep what they have to.
    """
    lines = finished(ground, found.drawing, found.lead_away)
    drawn_clearance_m = check_lines(ground, lines, found.start_clearance_m, asked.drawn_m)
    band = forecast_drive(ground, lines.path, vehicle, heading_deg, speeds=lines.speeds, stops=lines.stops)
    if asked.allowance_m is None:
        _check_band(ground, lines, band, found, asked)
    return lines, drawn_clearance_m, band


def _start_remarks(ground: Ground, start: LatLon, vehicle: Vehicle) -> list[str]:
    """Return remarks on the start.

    Raises
    ------
    StartBlockedError
        From there the vehicle may back into the fence.
    """
    hazard = start_hazard(ground, ground.frame.to_local(start), vehicle)
    if isinstance(hazard, StartBlockedError):
        raise hazard
    return [hazard] if hazard else []


def _start_m(band: Envelope, lines: Lines, ground: Ground, asked: Promise, vehicle: Vehicle) -> float | None:
    """Return what is promised while the vehicle turns at its start and leads away from it, where that is less than beyond.

    Raises
    ------
    StartBlockedError
        There the vehicle's avoidance may back it into the fence.
    """
    driven_m = float(band.clearances_m(ground.edge)[band.waypoints <= lines.lead_away].min(initial=np.inf))
    if driven_m >= asked.required_m - _ROUNDING_M:
        return None
    start = ground.frame.to_local(lines.path[0])
    # So much less the first legs may keep, where no lines keep all of that (`routing.route_search`); none of it is measured so closely.
    if driven_m < least_turning_m(ground, start, vehicle) - 0.1 and ground.allowed.covers(Point(start)):
        text, advice = turning_hazard(vehicle)
        raise StartBlockedError(
            f"turning at the start the vehicle may come as near as {max(driven_m, 0.0):.2f} m to a fence: {text}",
            distance_m=round(driven_m, 3),
            margin_m=vehicle.stops_within_m,
            advice=advice,
        )
    return math.floor(100 * max(driven_m - asked.error_m, 0.0)) / 100


def _check_band(ground: Ground, lines: Lines, band: Envelope, found: DrivenRoute, asked: Promise) -> None:
    """Refuse a plan whose band breaks the promise."""
    clearances_m = band.clearances_m(ground.edge)
    leading = band.waypoints <= lines.lead_away  # the start's own pieces, where no leg leads away
    near_m = asked.required_m if found.lead_away_m is None else found.lead_away_m
    for name, part, least_m in (
        ("lead-away", leading, near_m),
        ("route", ~leading, asked.required_m),
    ):
        kept_m = float(clearances_m[part].min(initial=np.inf))
        if kept_m < least_m - _ROUNDING_M:
            raise PlanCheckError(
                f"the {name} is predicted to be driven within {kept_m:.4f} m of a fence; {least_m:.4f} m is required. This is a bug, please report it",
                clearance_m=kept_m,
                asked_m=least_m,
            )
