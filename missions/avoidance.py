"""What the vehicle's own avoidance does to its corners: it slows down for a fence ahead, falls behind, and cuts more.

ArduPilot's avoidance (AVOID_ENABLE, FENCE_MARGIN) limits the speed towards a fence to the position gain times the distance that is
left to the margin. A rover that comes to a corner before a fence is slowed while its target point goes on round the corner; it then
steers straight for that. Measured in the simulated rover, corners of 45 to 130 degrees at 2 and 5 m/s: up to 2.2 m more of both legs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model import Envelope
    from missions.vehicle import Vehicle

SPEEDS_MPS = (1.0, 2.0, 5.0)
MORE_M = (0.3, 2.6, 3.9)
"""At these speeds: by so much more of both legs a rover cuts a corner when the margin lies right behind it."""

WITHIN_M = (2.0, 6.5, 8.0)
"""It does not where the margin lies this far behind the corner."""

ASIDE_M = (0.1, 1.0, 1.0)
TAIL_M = 12.0
"""So far inside the next leg it then still is, and so much farther along it comes back to it."""

_LEAST_TURN_DEG = 8.0
_SHARES = (0.0, 0.25, 0.5)
"""Of the turn: the directions in which a fence ahead slows it."""


def with_avoidance(band: Envelope, vehicle: Vehicle, fence: BaseGeometry) -> Envelope:
    """Give an envelope with what corners before a fence need more, where the vehicle's avoidance is on.

    Parameters
    ----------
    band : Envelope
        The drive without avoidance.
    vehicle : Vehicle
        What drives.
    fence : shapely geometry
        The lines it avoids, metres.

    Returns
    -------
    Envelope
        The same where nothing is near, else with one more piece for each corner concerned.
    """
    if not vehicle.stops_within_m or fence.is_empty:
        return band
    cores, bands_m, waypoints = [], [], []
    for number, corner in enumerate(band.corners):
        if corner.stops or abs(corner.turn_deg) < _LEAST_TURN_DEG:
            continue
        place = band.points[corner.waypoint]
        speed_mps = max(band.legs[number].top_speed_mps, band.legs[number + 1].top_speed_mps)
        within_m, more_m, aside_m = (
            float(np.interp(speed_mps, SPEEDS_MPS, table)) for table in (WITHIN_M, MORE_M, ASIDE_M)
        )
        ahead = _Ahead(band.points, corner.waypoint, corner.turn_deg, vehicle.stops_within_m)
        spare_m = ahead.spare_m(fence, within_m)
        if spare_m >= within_m:
            continue
        share = 1 - max(spare_m, 0.0) / within_m
        reach_m = 2 * corner.middle_m + more_m * share
        hull = [
            *_along(band.points[: corner.waypoint + 1][::-1], reach_m),
            *_along(band.points[corner.waypoint :], reach_m + TAIL_M * share),
            _aside(band.points[corner.waypoint :], reach_m, math.copysign(aside_m * share, corner.turn_deg)),
        ]
        cores.append(shapely.convex_hull(shapely.multipoints([place, *hull])))
        bands_m.append(min(band.legs[number].half_width_m, 0.3))
        waypoints.append(corner.waypoint)
    if not cores:
        return band
    return replace(
        band,
        cores=np.array([*band.cores, *cores], dtype=np.object_),
        bands_m=np.array([*band.bands_m, *bands_m]),
        waypoints=np.array([*band.waypoints, *waypoints], dtype=np.int64),
    )


@dataclass(frozen=True, slots=True)
class _Ahead:
    """Where a corner looks to."""

    points: NDArray[np.float64]
    index: int
    turn_deg: float
    margin_m: float

    def spare_m(self, fence: BaseGeometry, within_m: float) -> float:
        """Give how far beyond the corner the margin of a fence ahead begins; infinite beyond a distance."""
        place = self.points[self.index]
        reach_m = self.margin_m + within_m
        if shapely.distance(shapely.Point(place), fence) > reach_m:
            return math.inf
        course_rad = math.atan2(*(place - self.points[self.index - 1]))
        spares_m = [math.inf]
        for share in _SHARES:
            ahead_rad = course_rad + math.radians(self.turn_deg) * share
            there = (place[0] + reach_m * math.sin(ahead_rad), place[1] + reach_m * math.cos(ahead_rad))
            met = shapely.intersection(shapely.LineString([place, there]), fence)
            if not met.is_empty:
                spares_m.append(float(shapely.distance(shapely.Point(place), met)) - self.margin_m)
        return min(spares_m)


def _along(points: NDArray[np.float64], reach_m: float) -> list[tuple[float, float]]:
    """Give the first point of lines and the place at a distance from it, no farther than the next point."""
    (a_east, a_north), (b_east, b_north) = points[:2].tolist()
    length_m = math.dist((a_east, a_north), (b_east, b_north))
    share = min(1.0, reach_m / length_m) if length_m else 1.0
    return [(a_east, a_north), (a_east + (b_east - a_east) * share, a_north + (b_north - a_north) * share)]


def _aside(points: NDArray[np.float64], reach_m: float, right_m: float) -> tuple[float, float]:
    """Give the place at a distance along a leg and so far to its right."""
    start, (east_m, north_m) = _along(points, reach_m)
    length_m = math.dist(start, (east_m, north_m)) or 1.0
    ahead_east, ahead_north = (east_m - start[0]) / length_m, (north_m - start[1]) / length_m
    return (east_m + ahead_north * right_m, north_m - ahead_east * right_m)
