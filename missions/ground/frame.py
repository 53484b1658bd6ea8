"""The planning frame: metres east and north of a field's centre.

An azimuthal equidistant projection of the WGS 84 ellipsoid. Within 10 km of the origin distances agree with the geodesic to
1 mm + 1e-6. ArduPilot drives straight in a flat frame of its own (1.113195e5 m a degree, longitude shortened by the cosine of the
latitude); `autopilot_scale` and `bow_m` are how far the two differ, so that plans can be padded to the safe side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from missions.errors import InvalidPositionError
from missions.geo import (
    LatLon,
    LocalPoint,
    destination,
    distance_and_bearing,
    heading_vector,
    rounded,
    wrap_lon_deg,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MAX_LATITUDE_DEG = 85.0
"""Beyond this the autopilot's flat frame is of no use."""

_WGS84_A_M = 6378137.0  # semi-major axis, by definition
_WGS84_E2 = 6.69437999014e-3  # first eccentricity squared, from the flattening 1/298.257223563
_AUTOPILOT_M_PER_DEG = 1.113195e5  # AP_Math's LATLON_TO_M


_FEW = 2000
"""Positions that geographiclib places sooner, at 40 µs each, than pyproj is loaded (80 ms of processor time; measured, x86-64)."""


class AutopilotScale(NamedTuple):
    """True metres for each metre of the autopilot's flat frame, eastward and northward."""

    east: float
    north: float


def check_latitude(position: LatLon) -> None:
    """Refuse places too near a pole.

    Raises
    ------
    InvalidPositionError
        The place lies beyond ±85° latitude.
    """
    if abs(position.lat_deg) > MAX_LATITUDE_DEG:
        raise InvalidPositionError(
            f"latitude {position.lat_deg:.4f}° is beyond ±{MAX_LATITUDE_DEG:g}°: "
            "this close to a pole the autopilot's flat-earth positions are too inaccurate",
            lat_deg=position.lat_deg,
        )


@dataclass(frozen=True)
class LocalFrame:
    """Metres east and north of an origin.

    Parameters
    ----------
    origin : LatLon
        Where the frame touches the Earth.

    Raises
    ------
    InvalidPositionError
        The origin lies beyond ±85° latitude.
    """

    origin: LatLon

    def __post_init__(self) -> None:
        check_latitude(self.origin)

    def to_local(self, position: LatLon) -> LocalPoint:
        """Return the point of a position."""
        away_m, along_deg = distance_and_bearing(self.origin, position)
        east, north = heading_vector(along_deg)
        return LocalPoint(away_m * east, away_m * north)

    def to_lat_lon(self, point: LocalPoint) -> LatLon:
        """Return the position of a point."""
        along_deg = math.degrees(math.atan2(point.east_m, point.north_m))
        return destination(self.origin, math.hypot(*point), along_deg)

    def to_local_array(self, positions: Sequence[LatLon]) -> NDArray[np.float64]:
        """Return positions as an (n, 2) array, east and north in metres."""
        if len(positions) <= _FEW:
            return np.array([self.to_local(position) for position in positions], dtype=float).reshape(-1, 2)
        from pyproj import Geod  # noqa: PLC0415 - slow to come, quick on many

        lats_deg, lons_deg = np.array(positions, dtype=float).T
        origin_lat_deg, origin_lon_deg = np.broadcast_to(
            np.array([self.origin], dtype=float).T, (2, len(positions))
        )
        along_deg, _, away_m = Geod(ellps="WGS84").inv(origin_lon_deg, origin_lat_deg, lons_deg, lats_deg)
        along = np.radians(along_deg)
        return np.column_stack((away_m * np.sin(along), away_m * np.cos(along)))


def frame_around(positions: Sequence[LatLon]) -> LocalFrame:
    """Return the frame at the centre of the positions' bounding box, the short way round across the antimeridian.

    Raises
    ------
    InvalidPositionError
        There are no positions, or one lies beyond ±85° latitude.
    """
    if not positions:
        raise InvalidPositionError("no position to centre the local frame on")
    lats_deg = [position.lat_deg for position in positions]
    first_lon_deg = positions[0].lon_deg
    lons_deg = [first_lon_deg + wrap_lon_deg(position.lon_deg - first_lon_deg) for position in positions]
    for position in positions:
        check_latitude(position)
    centre = LatLon((min(lats_deg) + max(lats_deg)) / 2, wrap_lon_deg((min(lons_deg) + max(lons_deg)) / 2))
    return LocalFrame(rounded(centre))


def autopilot_scale(lat_deg: float) -> AutopilotScale:
    """Return how many true metres a metre of ArduPilot's flat frame is, at a latitude (0.9933 to 1.0034)."""
    w2 = 1 - _WGS84_E2 * math.sin(math.radians(lat_deg)) ** 2
    equatorial = math.radians(_WGS84_A_M) / _AUTOPILOT_M_PER_DEG
    return AutopilotScale(east=equatorial / math.sqrt(w2), north=equatorial * (1 - _WGS84_E2) / w2**1.5)


def autopilot_distance_m(a: LatLon, b: LatLon) -> float:
    """Return the distance that ArduPilot measures (Location::get_distance): flat, longitude shortened by the cosine of the latitude halfway."""
    middle = math.cos(math.radians((a.lat_deg + b.lat_deg) / 2))
    east_deg = wrap_lon_deg(b.lon_deg - a.lon_deg) * middle
    return math.hypot(b.lat_deg - a.lat_deg, east_deg) * _AUTOPILOT_M_PER_DEG


def bow_m(leg_m: float, lat_deg: float) -> float:
    """Return how far at most the autopilot's straight line bows off the frame's, on a leg of a length.

    A line straight in latitude and longitude with the heading h curves with sin(h) (1 + cos(h)²) tan(latitude) / Earth's radius, most at
    55° from north, where the factor is 1.089 (1 for a line due east).
    """
    return 1.09 * leg_m**2 * math.tan(math.radians(abs(lat_deg))) / (8 * 6.35e6)


def autopilot_line(a: LatLon, b: LatLon, pieces: int) -> list[LatLon]:
    """Return the autopilot's straight line from ``a`` to ``b``, both included, cut into equal pieces."""
    delta_lon_deg = wrap_lon_deg(b.lon_deg - a.lon_deg)
    return [
        LatLon(
            a.lat_deg + (b.lat_deg - a.lat_deg) * i / pieces,
            wrap_lon_deg(a.lon_deg + delta_lon_deg * i / pieces),
        )
        for i in range(pieces + 1)
    ]
