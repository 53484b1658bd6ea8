"""From a situation and a request to a plan: the one function that the command line, the bridge and replays call."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from missions.drive_model import envelope
from missions.drive_model.avoidance import with_avoidance
from missions.errors import PlanCheckError, RouteError, StartBlockedError
from missions.geo import bearing_deg, rounded
from missions.ground.from_situation import ground_for, heading_at, route_ends
from missions.ground.known_fence import fence_warnings, known_fence
from missions.ground.legs import path_length_m
from missions.ground.seams import explained, with_seams
from missions.ground.start_hazard import start_hazard
from missions.planned import Plan
from missions.planning.mission_lines import Lines, check_lines, finished, mission_items
from missions.planning.warnings import drive_remarks, lead_away_remarks, moved_target_remarks
from missions.promise import known_vehicle, promise
from missions.routing.fitted_route import FittedRoute
from missions.routing.uniform_route import uniform_route
from missions.vehicle.parameter_remarks import parameter_remarks

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.drive_model import Envelope
    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.promise import Promise
    from missions.request import Request
    from missions.routing.route_search import DrivenRoute
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_ROUNDING_M = 1e-6  # a micrometre: differences of floating point, nothing that can be driven


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
    plain = ground_for(situation, vehicle, (start, *targets))
    ground = with_seams(plain, vehicle)
    asked = promise(situation, request, vehicle)
    warnings = [
        *parameter_remarks(situation),
        *fence_warnings(vehicle, situation),
        *ground.warnings,
        *asked.warnings,
    ]

    heading_deg = heading_at(situation, start)
    ends = [ground.frame.to_local(position) for position in (start, *targets)]
    warnings += _start_remarks(plain, ends[0], vehicle)
    try:
        if asked.allowance_m is None:
            asked, found = FittedRoute(ground, ends, request, vehicle, heading_deg, should_stop).find(asked)
        else:
            asked, found = uniform_route(ground, ends, asked, request, should_stop)
    except RouteError as error:
        raise explained(error, vehicle) from None
    lines = finished(ground, found.drawing, found.lead_away)
    reached = tuple(rounded(ground.frame.to_lat_lon(target)) for target in found.targets)
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
        clearance_m=_promised_m(asked, driven_m),
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
                    *lead_away_remarks(found, least_m),
                    *moved_target_remarks(targets, reached),
                    *drive_remarks(
                        vehicle,
                        min(filter(None, lines.speeds), default=None),
                        heading_deg,
                        asked,
                        driven_m,
                        found,
                    ),
                ]
            )
        ),
    )


def _start_remarks(ground: Ground, start: LocalPoint, vehicle: Vehicle) -> list[str]:
    """Return remarks on the start.

    Raises
    ------
    StartBlockedError
        From there the vehicle may back into the fence.
    """
    hazard = start_hazard(ground, start, vehicle)
    if isinstance(hazard, StartBlockedError):
        raise hazard
    return [hazard] if hazard else []


def _promised_m(asked: Promise, driven_m: float) -> float | None:
    """Return the promised clearance: what was asked for, or less where the start leaves less; nothing for drawn lines only."""
    if asked.allowance_m is not None:
        return asked.promised_m if asked.allowance_m else None
    kept_m = math.floor(100 * max(driven_m - asked.error_m, 0.0)) / 100
    return asked.promised_m if driven_m >= asked.required_m - _ROUNDING_M else min(asked.promised_m, kept_m)


def _band(ground: Ground, lines: Lines, vehicle: Vehicle, heading_deg: float | None) -> Envelope:
    """Predict the drive; a heading that is not known is taken along the first leg."""
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
                f"the {name} is predicted to be driven within {kept_m:.4f} m of a fence; {least_m:.4f} m was required. This is a defect",
                clearance_m=kept_m,
                asked_m=least_m,
            )
