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

    from missions.drive_model import Corner, Envelope
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
_SLOW_MPS = 0.7
_OUT_DEG = 20.0
"""It may look so far to the outside of its course when it comes to a corner."""

_IN_THE_TURN = ((0.25, 2.0), (0.5, 2.0), (0.75, 1.5), (1.0, 1.0))
"""Shares of the turn, and how much it tells when avoidance slows it there: speed missing of that meant, times this."""


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
        ahead = _Ahead(band.points, corner, vehicle, fence)
        share = max(ahead.before(within_m), ahead.within())
        if not share:
            continue
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
    """What lies ahead of a rover at a corner; the answers are 1 where avoidance slows it most, 0 where it does not."""

    points: NDArray[np.float64]
    corner: Corner
    vehicle: Vehicle
    fence: BaseGeometry

    @property
    def course_rad(self) -> float:
        """The course to the corner."""
        east_m, north_m = self.points[self.corner.waypoint] - self.points[self.corner.waypoint - 1]
        return math.atan2(east_m, north_m)

    def before(self, within_m: float) -> float:
        """Tell from how near the margin lies behind the corner."""
        place = self.points[self.corner.waypoint]
        out_rad = -math.copysign(math.radians(_OUT_DEG), self.corner.turn_deg)
        spare_m = min(self._spare_m(place, self.course_rad + by_rad, within_m) for by_rad in (0.0, out_rad))
        return max(0.0, 1 - max(spare_m, 0.0) / within_m)

    def within(self) -> float:
        """Tell from the speed that avoidance allows in the turn, and the speed meant there."""
        turn_rad = math.radians(self.corner.turn_deg)
        half_mps = math.sqrt(2 * self.vehicle.accel_max_mps2 * self.corner.middle_m)
        meant_mps = 2 * half_mps * math.cos(turn_rad / 2)
        inside_rad = self.course_rad + turn_rad / 2 + math.copysign(math.pi / 2, turn_rad)
        inside_m = 2 * self.corner.middle_m * abs(math.sin(turn_rad / 2))
        middle = self.points[self.corner.waypoint] + inside_m * np.array(
            [math.sin(inside_rad), math.cos(inside_rad)]
        )
        gain_per_s = self.vehicle.position_gain_per_s
        most = 0.0
        for share, weight in _IN_THE_TURN if meant_mps > _SLOW_MPS else ():
            spare_m = self._spare_m(middle, self.course_rad + share * turn_rad, meant_mps / gain_per_s)
            most = max(most, weight * (1 - max(spare_m, 0.0) * gain_per_s / meant_mps))
        return min(most, 1.0)

    def _spare_m(self, place: NDArray[np.float64], way_rad: float, within_m: float) -> float:
        """Give how far ahead of a place the margin of a fence begins; infinite beyond a distance."""
        reach_m = self.vehicle.stops_within_m + within_m
        here = shapely.Point(place)
        if not shapely.dwithin(here, self.fence, reach_m):
            return math.inf
        there = (place[0] + reach_m * math.sin(way_rad), place[1] + reach_m * math.cos(way_rad))
        met = shapely.intersection(shapely.LineString([place, there]), self.fence)
        return math.inf if met.is_empty else float(shapely.distance(here, met)) - self.vehicle.stops_within_m


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
