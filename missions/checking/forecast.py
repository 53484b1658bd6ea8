"""How a mission's lines are predicted to be driven: alike for plans and for checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.drive_model import envelope
from missions.drive_model.avoidance import with_avoidance
from missions.geo import bearing_deg

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.drive_model import Envelope
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle


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
