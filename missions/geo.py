"""Positions on Earth, and points in the plane.

On Earth a place is a `LatLon`; in the plane it is a `LocalPoint`, and many of them are an array of shape (n, 2), always east before north.
`missions.ground.frame.LocalFrame` leads from one to the other. Headings are degrees clockwise from north in both.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import InvalidPositionError

if TYPE_CHECKING:
    from pyproj import Geod


class LatLon(NamedTuple):
    """A position on Earth (WGS 84), decimal degrees."""

    lat_deg: float
    lon_deg: float

    def __str__(self) -> str:
        return f"{self.lat_deg:.7f},{self.lon_deg:.7f}"


class LocalPoint(NamedTuple):
    """A point in the plane of a `missions.ground.frame.LocalFrame`, metres."""

    east_m: float
    north_m: float


Vector = tuple[float, float]
"""East and north in the plane: a `LocalPoint`, the way from one to another in metres, or a direction of length 1."""


def checked_lat_lon(lat_deg: float, lon_deg: float) -> LatLon:
    """Return a `LatLon` of two numbers from outside.

    Raises
    ------
    InvalidPositionError
        Not finite, latitude beyond ±90° or longitude beyond ±180°.
    """
    if not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
        raise InvalidPositionError(f"position {lat_deg},{lon_deg} is not a pair of numbers")
    if abs(lat_deg) > 90:
        raise InvalidPositionError(f"latitude {lat_deg:g}° is beyond ±90°", lat_deg=lat_deg)
    if abs(lon_deg) > 180:
        raise InvalidPositionError(f"longitude {lon_deg:g}° is beyond ±180°", lon_deg=lon_deg)
    return LatLon(lat_deg, lon_deg)


def parse_lat_lon(text: str) -> LatLon:
    """Read ``LAT,LON`` in decimal degrees.

    Raises
    ------
    InvalidPositionError
        The text is not two numbers with a comma between them, or they are out of range.
    """
    parts = text.split(",")
    try:
        lat_deg, lon_deg = (float(part.replace("_", "?")) for part in parts)  # 4_0 is 40 to Python
    except ValueError:
        raise InvalidPositionError(
            f"{text!r} is not a position: expected LAT,LON in decimal degrees, like 40.0713,-105.2299"
        ) from None
    return checked_lat_lon(lat_deg, lon_deg)


def from_e7(lat_e7: int, lon_e7: int) -> LatLon:
    """Return the position of a MAVLink degE7 pair."""
    return LatLon(lat_e7 / 1e7, lon_e7 / 1e7)


def to_e7(position: LatLon) -> tuple[int, int]:
    """Return MAVLink's degE7 pair, rounded to the nearest (at most 5.6 mm off)."""
    return round(position.lat_deg * 1e7), round(position.lon_deg * 1e7)


def rounded(position: LatLon) -> LatLon:
    """Return the position as it stands in a mission item."""
    return from_e7(*to_e7(position))


def distance_m(a: LatLon, b: LatLon) -> float:
    """Return the geodesic distance in metres."""
    return float(_geod().inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2])


def bearing_deg(a: LatLon, b: LatLon) -> float:
    """Return the geodesic's bearing at ``a``, in degrees clockwise from north, 0 to 360."""
    return float(_geod().inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[0]) % 360.0


def heading_vector(heading_deg: float) -> Vector:
    """Return the direction of length 1 in the plane that a heading clockwise from north leads in."""
    return (math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg)))


def change_deg(before: Vector, after: Vector) -> float:
    """Return how the course changes from one direction in the plane to another, positive to the right."""
    cross = before[0] * after[1] - before[1] * after[0]
    return -math.degrees(math.atan2(cross, before[0] * after[0] + before[1] * after[1]))


def wrap_lon_deg(lon_deg: float) -> float:
    """Bring a longitude into -180 (inclusive) to 180 (exclusive)."""
    return (lon_deg + 180.0) % 360.0 - 180.0


@cache
def _geod() -> Geod:
    from pyproj import Geod  # noqa: PLC0415 - 100 ms that a usage error need not wait for

    return Geod(ellps="WGS84")
