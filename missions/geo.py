"""Positions on Earth, and points in the plane.

On Earth a place is a `LatLon`; in the plane it is a `LocalPoint`, and many of them are an array of shape (n, 2), always east before north.
`missions.ground.frame.LocalFrame` leads from one to the other. Headings are degrees clockwise from north in both.
"""

from __future__ import annotations

import math
import re
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import InvalidPositionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from geographiclib.geodesic import Geodesic


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


_MOST_M_PER_LAT_DEG, _MOST_M_PER_LON_DEG = 111_695.0, 111_320.0  # at the poles; on the equator
_ROUNDED_M = 2e-8  # what differences of degrees lose to rounding: the last bit of 360 degrees is 6e-14, 6e-9 m, a few times

_ANGLE = (
    r"([NSEW])?\s*([+-]?)(\d+(?:\.\d*)?|\.\d+)(?:\s*°)?"
    r"(?:(?:(?<=°)\s*|\s+)(\d+(?:\.\d*)?)\s*['′’](?:\s*(\d+(?:\.\d*)?)\s*(?:\"|″|”|''))?)?"
)
"""Letter, sign, degrees, minutes, seconds."""

_POSITION = re.compile(
    rf"{_ANGLE}(?(1)|(?:\s*([NSEW]))?)(?:\s*,\s*|\s+|(?<=[NSEW])){_ANGLE}(?(7)|(?:\s*([NSEW]))?)",
    re.IGNORECASE | re.ASCII,
)
"""Two angles; the letter stands before or behind each."""

_POSITION_FORMS = "LAT,LON such as 40.0713,-105.2299 or 40.0713N 105.2299W"


def parse_lat_lon(text: str) -> LatLon:
    """Read a position: ``LAT,LON`` or ``LAT LON`` in decimal degrees, or degrees, minutes and seconds, both with N, S, E or W or neither.

    With letters either may come first; without them it is the latitude.

    Raises
    ------
    InvalidPositionError
        The text is no position, or its numbers are out of range; where they seem to be swapped the message says so.
    """
    found = _POSITION.fullmatch(text.strip())
    first, second = map(_angle, (found.groups()[:6], found.groups()[6:])) if found else (None, None)
    if first is None or second is None:
        raise InvalidPositionError(f"{text!r} is not a position: expected {_POSITION_FORMS}")
    (lat_deg, lat_axis), (lon_deg, lon_axis) = first, second
    if (lat_axis, lon_axis) == ("longitude", "latitude"):
        lat_deg, lon_deg = lon_deg, lat_deg
    elif lat_axis == lon_axis != "" or (lat_axis == "") != (lon_axis == ""):
        raise InvalidPositionError(f"{text!r} is not a position: expected N or S and E or W, or no letters")
    elif not lat_axis and abs(lon_deg) <= 90 < abs(lat_deg) <= 180:
        raise InvalidPositionError(
            f"latitude {lat_deg:g}° is beyond ±90°; latitude comes first: did you mean {lon_deg},{lat_deg}?",
            lat_deg=lat_deg,
        )
    return checked_lat_lon(lat_deg, lon_deg)


def _angle(parts: Sequence[str | None]) -> tuple[float, str] | None:
    """Return an angle in degrees, and which it is by its letter; None where its parts do not fit together."""
    before, sign, degrees, minutes, seconds, after = (part or "" for part in parts)
    letter = (before or after).upper()
    is_odd = (
        (before and after)
        or (letter and sign)
        or ("." in degrees and minutes)
        or ("." in minutes and seconds)
    )
    if is_odd or float(minutes or 0) >= 60 or float(seconds or 0) >= 60:
        return None
    angle_deg = float(degrees) + float(minutes or 0) / 60 + float(seconds or 0) / 3600
    axis = ("latitude" if letter in "NS" else "longitude") if letter else ""
    return (-angle_deg if sign == "-" or letter in ("S", "W") else angle_deg), axis


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
    return distance_and_bearing(a, b)[0]


def upper_distance_m(a: LatLon, b: LatLon) -> float:
    """Return no less than the geodesic distance, in a hundredth of its time: the way along a meridian and a parallel, each degree as long as WGS 84 has any."""
    lat_deg, lon_deg = abs(b.lat_deg - a.lat_deg), abs(wrap_lon_deg(b.lon_deg - a.lon_deg))
    return _MOST_M_PER_LAT_DEG * lat_deg + _MOST_M_PER_LON_DEG * lon_deg + _ROUNDED_M


def path_length_m(path: Sequence[LatLon]) -> float:
    """Return the length of the lines through positions."""
    return sum(distance_m(a, b) for a, b in pairwise(path))


def bearing_deg(a: LatLon, b: LatLon) -> float:
    """Return the geodesic's bearing at ``a``, in degrees clockwise from north, 0 to 360."""
    return distance_and_bearing(a, b)[1]


def distance_and_bearing(a: LatLon, b: LatLon) -> tuple[float, float]:
    """Return the geodesic distance in metres, and the bearing at ``a`` in degrees clockwise from north, 0 to 360 (0 where both are one)."""
    found = _wgs84().Inverse(*a, *b)
    return (found["s12"], found["azi1"] % 360.0) if found["s12"] else (0.0, 0.0)


def destination(start: LatLon, away_m: float, along_deg: float) -> LatLon:
    """Return the place that a geodesic reaches after a distance in metres, at a bearing from ``start`` in degrees clockwise from north."""
    found = _wgs84().Direct(*start, along_deg, away_m)
    return LatLon(found["lat2"], wrap_lon_deg(found["lon2"]))


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
def _wgs84() -> Geodesic:
    # By the same author as PROJ's geodesics and equal to them within nanometres: loaded in 1 ms where pyproj takes 90 ms of processor time.
    from geographiclib.geodesic import Geodesic  # noqa: PLC0415 - a usage error need not wait for it

    return Geodesic.WGS84
