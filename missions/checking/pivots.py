"""Where a skid-steered vehicle turns on the spot so near to a fence that measured ones stood before it: alike for plans and for checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shapely import Point

from missions.ground.start_hazard import nearest_avoided

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.drive_model import Envelope
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

_PIVOTS_FREELY_M = 0.5
"""So much more than the margin, and no error of an estimate of those measured (up to 0.2 m) has it turn within; chosen, not measured."""


def pivot_remarks(ground: Ground, vehicle: Vehicle, forecast: Envelope, items: Sequence[int]) -> list[str]:
    """Return where a skid-steered vehicle may stand before it turns on the spot: measured, 1 to 3 of 8 runs of one field; without avoidance never.

    Parameters
    ----------
    ground : Ground
        The fence, without seams.
    vehicle : Vehicle
        What drives.
    forecast : Envelope
        The drive.
    items : sequence of int
        The mission items of its points.
    """
    if not (vehicle.avoids_fence and vehicle.backs_away):
        return []
    freely_m = vehicle.stops_within_m + _PIVOTS_FREELY_M
    pivots = {
        corner.waypoint: nearest_avoided(ground, Point(forecast.points[corner.waypoint]))
        for corner in forecast.corners
        if corner.pivots
    }
    return [
        f"item {items[waypoint]}: it turns on the spot {away_m:.2f} m from {fence}; within {vehicle.fence.margin_name} {vehicle.stops_within_m:g} m "
        f"plus {_PIVOTS_FREELY_M:g} m a skid-steered rover in tests stood before such a turn and did not resume (1 to 3 of 8 runs); "
        f"ask for a clearance of {freely_m:g} m, or set AVOID_ENABLE {vehicle.avoid_bits & ~1}"
        for waypoint, (away_m, fence) in pivots.items()
        if away_m < freely_m
    ]
