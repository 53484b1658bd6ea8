"""The planning frame: metres east and north of a field's centre.

An azimuthal equidistant projection of the WGS 84 ellipsoid. Within 10 km of the origin distances agree with the geodesic to
1 mm + 1e-6. ArduPilot drives straight in a flat frame of its own (1.113195e5 m a degree, longitude shortened by the cosine of the
latitude); `autopilot_scale` and `bow_m` are how far the two differ, so that plans can be padded to the safe side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pyproj import Proj

from missions.errors import InvalidPositionError
from missions.geo import LatLon, LocalPoint, rounded, wrap_lon_deg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

MAX_LATITUDE_DEG = 85.0
"""Beyond this the autopilot's flat frame is of no use."""

_WGS84_A_M = 6378137.0  # semi-major axis, by definition
_WGS84_E2 = 6.69437999014e-3  # first eccentricity squared, from the flattening 1/298.257223563
_AUTOPILOT_M_PER_DEG = 1.113195e5  # AP_Math's LATLON_TO_M


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

    @cached_property
    def _proj(self) -> Proj:
        return Proj(proj="aeqd", ellps="WGS84", lat_0=self.origin.lat_deg, lon_0=self.origin.lon_deg)

    def to_local(self, position: LatLon) -> LocalPoint:
        """Return the point of a position."""
        return LocalPoint(*self._proj(position.lon_deg, position.lat_deg))

    def to_lat_lon(self, point: LocalPoint) -> LatLon:
        """Return the position of a point."""
        lon_deg, lat_deg = self._proj(point.east_m, point.north_m, inverse=True)
        return LatLon(lat_deg, wrap_lon_deg(lon_deg))

    def to_local_array(self, positions: Sequence[LatLon]) -> NDArray[np.float64]:
        """Return positions as an (n, 2) array, east and north in metres."""
        # Lists: of an array of one older pyproj and numpy warn that it is taken for a number.
        lons_deg = [lon_deg for _, lon_deg in positions]
        lats_deg = [lat_deg for lat_deg, _ in positions]
        return np.column_stack(self._proj(lons_deg, lats_deg)).reshape(-1, 2)


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
    return LocalFrame(rounded(centre))  # PROJ takes 0.6 mm from an origin, or from the equator, for 0


def autopilot_scale(lat_deg: float) -> AutopilotScale:
    """Return how many true metres a metre of ArduPilot's flat frame is, at a latitude (0.9933 to 1.0034)."""
    w2 = 1 - _WGS84_E2 * math.sin(math.radians(lat_deg)) ** 2
    equatorial = math.radians(_WGS84_A_M) / _AUTOPILOT_M_PER_DEG
    return AutopilotScale(east=equatorial / math.sqrt(w2), north=equatorial * (1 - _WGS84_E2) / w2**1.5)


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
