"""One route: over targets in a given order, to a plan that ends where the last of them is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from missions.checking.forecast import forecast_drive
from missions.errors import PlanCheckError, StartBlockedError
from missions.finishing.mission_lines import Lines, check_lines, finished, mission_items
from missions.finishing.remarks import drive_remarks, escape_info, lead_away_remarks, moved_target_info
from missions.geo import rounded
from missions.ground.from_situation import ground_for, heading_at, route_ends
from missions.ground.known_fence import fence_warnings, known_fence
from missions.ground.legs import path_length_m
from missions.ground.seams import with_seams
from missions.ground.start_hazard import start_hazard
from missions.planned import Plan
from missions.promise import known_vehicle, promise
from missions.routing.drawn_route import Sought
from missions.routing.fitted_route import FittedRoute
from missions.routing.no_route import NoRoute, explained
from missions.routing.uniform_route import uniform_route, widest_uniform_route
from missions.vehicle.parameter_remarks import parameter_remarks

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.drive_model import Envelope
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.promise import Promise
    from missions.request import Request
    from missions.routing.route_search import DrivenRoute
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_ROUNDING_M = 1e-6  # a micrometre: differences of floating point, nothing that can be driven


def plan_route(
    situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None
) -> Plan:
    """Plan a route over the request's targets in their order, else to the one that the situation holds.

    Raises
    ------
    MissionError
        As `missions.planning.plan.plan`.
    """
    fence = known_fence(situation)
    vehicle = known_vehicle(situation, request)
    start, targets = route_ends(situation, request)
    plain = ground_for(situation, vehicle, (start, *targets))
    ground = with_seams(plain, vehicle)
    asked = promise(situation, request, vehicle)
    warnings = [
        *parameter_remarks(situation),
        *fence_warnings(vehicle, situation),
        *ground.warnings,
        *asked.warnings,
        *_start_remarks(plain, start, vehicle),
    ]
    heading_deg = heading_at(situation, start)
    local_start, *local_targets = (ground.frame.to_local(position) for position in (start, *targets))
    sought = Sought(
        ground, local_start, local_targets, request.method, request.snap_m, request.escape, should_stop
    )
    asked, found = _route(sought, request, asked, vehicle, heading_deg)
    lines, drawn_m, band = _finished(ground, found, asked, vehicle, heading_deg)
    driven_m = max(0.0, band.clearance_m(ground.edge))
    items, seqs = mission_items(lines, vehicle.speed_mps, request.speed_mps)
    reached = tuple(rounded(ground.frame.to_lat_lon(target)) for target in found.targets)
    warnings += lead_away_remarks(found, asked.drawn_m)
    warnings += drive_remarks(vehicle, heading_deg, asked, driven_m, found)
    return Plan(
        items=items,
        path=lines.path,
        seqs=seqs,
        speeds=lines.speeds,
        start=start,
        targets=reached,
        asked_targets=targets,
        method=request.method,
        length_m=path_length_m(lines.path),
        straight_line_m=path_length_m((start, *targets)),
        duration_s=band.duration_s,
        clearance_m=_promised_m(asked, driven_m),
        asked_m=asked.drawn_m,
        drawn_clearance_m=drawn_m,
        driven_clearance_m=driven_m,
        envelope=band,
        blocks=found.blocks,
        fence=fence,
        ground=ground,
        vehicle=vehicle,
        home=situation.home.value if situation.home else None,
        warnings=tuple(dict.fromkeys(warnings)),
        info=(*asked.info, *escape_info(found), *moved_target_info(targets, reached)),
    )


def _route(
    sought: Sought, request: Request, asked: Promise, vehicle: Vehicle, heading_deg: float | None
) -> tuple[Promise, DrivenRoute]:
    """Return the route and what is promised for it.

    Raises
    ------
    StartBlockedError, TargetBlockedError, NoRouteError
        There is none.
    """
    if asked.allowance_m is None:
        fitted = FittedRoute(sought, vehicle, heading_deg)
        found = fitted.widest(asked) if request.widest else fitted.find(asked)
    else:
        found = widest_uniform_route(sought, asked) if request.widest else uniform_route(sought, asked)
    if isinstance(found, NoRoute):
        raise explained(found, vehicle).error()
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


def _promised_m(asked: Promise, driven_m: float) -> float | None:
    """Return the promised clearance: what was asked for, or less where the start leaves less; nothing for drawn lines only."""
    if asked.allowance_m is not None:
        return asked.promised_m if asked.allowance_m else None
    kept_m = math.floor(100 * max(driven_m - asked.error_m, 0.0)) / 100
    return asked.promised_m if driven_m >= asked.required_m - _ROUNDING_M else min(asked.promised_m, kept_m)


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
                f"the {name} is predicted to be driven within {kept_m:.4f} m of a fence; {least_m:.4f} m is required. This is a bug, please report it",
                clearance_m=kept_m,
                asked_m=least_m,
            )
