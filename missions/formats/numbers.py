"""Numbers of mission files, checked as they come in."""

from __future__ import annotations

import math

from missions.errors import InvalidPositionError
from missions.geo import LatLon, checked_lat_lon, to_e7

_INT32_MAX = 2**31 - 1  # degE7 is a 32-bit integer in MAVLink
_COMMANDS_WITHOUT_PLACES = range(96, 5000)


def place_e7(command: int, lat_deg: float, lon_deg: float) -> tuple[int, int]:
    """Return an item's params 5 and 6 as degE7.

    Conditions and DO_ commands may hold anything there that fits the wire.

    Raises
    ------
    InvalidPositionError
        Not a valid position.
    """
    if command not in _COMMANDS_WITHOUT_PLACES:
        return to_e7(checked_lat_lon(lat_deg, lon_deg))
    if not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
        raise InvalidPositionError(f"params 5 and 6 are {lat_deg:g} and {lon_deg:g}; expected numbers")
    if max(abs(lat_deg), abs(lon_deg)) * 1e7 > _INT32_MAX:
        raise InvalidPositionError(
            f"params 5 and 6, {lat_deg:g} and {lon_deg:g}, do not fit into a mission item"
        )
    return to_e7(LatLon(lat_deg, lon_deg))


def number(text: str) -> float:
    """Read a number of a text file.

    Raises
    ------
    ValueError
        It is not such a number.
    """
    if "_" in text:  # 4_0 is 40 to Python, and a slip of the pen to everybody else
        raise ValueError(f"could not convert string to float: {text!r}")
    return float(text)


def whole(value: float, name: str, most: int) -> int:
    """Return a whole number from 0 to ``most``.

    Raises
    ------
    ValueError
        It is not such a number.
    """
    if not (0 <= value <= most and value == int(value)):
        raise ValueError(f"{name} {value:g} is not a whole number from 0 to {most}")
    return int(value)
