"""Remarks on a plan beside its figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.geo import distance_m
from missions.ground.legs import ROUNDING_RESERVE_M
from missions.vehicle.parameter_remarks import assumed_remarks
from missions.words import HEADING_UNKNOWN, metres, moved_text, start_near_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.geo import LatLon
    from missions.promise import Promise
    from missions.routing.route_search import DrivenRoute
    from missions.vehicle import Vehicle


def lead_away_remarks(found: DrivenRoute, asked: Promise, start_m: float | None) -> list[str]:
    """Return remarks on how near the start is to a fence, and what the route keeps there: the plan's own figure, where it has one."""
    is_limited = found.lead_away_m is not None and found.lead_away_m < asked.required_m
    if not (found.lead_away or is_limited) or found.start_clearance_m < 0:
        return []
    if found.lead_away_m is None:
        return [start_near_text(found.start_clearance_m, asked.drawn_m, found.start_clearance_m)]
    kept_m = found.lead_away_m if start_m is None else start_m
    return [start_near_text(found.start_clearance_m, asked.promised_m, kept_m)]


def escape_info(found: DrivenRoute) -> list[str]:
    """Return from where a route drives out, as was asked for."""
    if not found.lead_away or found.start_clearance_m >= 0:
        return []
    return [
        f"the start is inside an exclusion or outside the fence, {-found.start_clearance_m:.2f} m from the allowed area: only leg 1, which leads there, is unsafe"
    ]


def moved_target_info(targets: Sequence[LatLon], reached: Sequence[LatLon]) -> list[str]:
    """Return which targets were moved, as was asked for, and how far."""
    return [
        moved_text(f"target {asked}", distance_m(asked, found), found)
        for asked, found in zip(targets, reached, strict=True)
        if distance_m(asked, found) > ROUNDING_RESERVE_M
    ]


def drive_remarks(
    vehicle: Vehicle,
    heading_deg: float | None,
    asked: Promise,
    driven_m: float,
    found: DrivenRoute,
) -> list[str]:
    """Return what the drive model's word rests on."""
    if asked.allowance_m == 0:
        return []
    warnings = []
    if heading_deg is None:
        warnings.append(HEADING_UNKNOWN)
    warnings += assumed_remarks(vehicle)
    # Half a centimetre is not worth a warning; chosen, not measured.
    if asked.allowance_m and driven_m < asked.promised_m - 0.005 and not found.lead_away:
        warnings.append(
            f"predicted clearance while driving {metres(driven_m)}, less than the {metres(asked.promised_m)} promised "
            f"with --corner-allowance {asked.allowance_m:g}"
        )
    return warnings
