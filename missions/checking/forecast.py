"""How a mission's lines are predicted to be driven: alike for plans and for checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shapely import Point

from missions.drive_model import envelope
from missions.drive_model.avoidance import with_avoidance
from missions.geo import bearing_deg
from missions.ground.start_hazard import nearest_avoided

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.drive_model import Envelope
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

_PIVOTS_FREELY_M = 0.5
"""So much more than the margin, and no error of an estimate of those measured (up to 0.2 m) has it turn within; chosen, not measured."""


def forecast_drive(
    ground: Ground,
    path: Sequence[LatLon],
    vehicle: Vehicle,
    heading_deg: float | None,
    *,
    speeds: Sequence[float | None],
    stops: Mapping[int, float],
) -> Envelope:
    """Predict the drive, with the vehicle's own avoidance.

    Parameters
    ----------
    ground : Ground
        The field.
    path : sequence of LatLon
        The drawn lines, start first.
    vehicle : Vehicle
        What drives them.
    heading_deg : float or None
        Where it faces at the start, clockwise from north; one that is not known is taken along the first leg.
    speeds, stops
        As `missions.drive_model.envelope` takes them.
    """
    if heading_deg is None:
        heading_deg = bearing_deg(*path[:2])
    points = ground.frame.to_local_array(path)
    band = envelope(points, vehicle, heading_deg=heading_deg, speeds=speeds, stops=stops)
    return with_avoidance(band, vehicle, ground.avoided_edge)


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
