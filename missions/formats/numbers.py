"""Numbers of mission files, checked as they come in."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.mission_commands import COMMANDS_WITH_PLACE, USED_PARAMS
from missions.geo import checked_lat_lon, to_e7
from missions.items import CoordinateFrame

if TYPE_CHECKING:
    from missions.items import MissionItem

_INT32_MAX = 2**31 - 1  # what params 5 and 6 are on the wire
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+")


def xy_from_file(command: int, frame: int, param5: float, param6: float) -> tuple[int, int]:
    """Return an item's params 5 and 6 as MISSION_ITEM_INT carries them.

    A place goes as degE7, anything else as the whole number that it is: ArduPilot, QGroundControl and MAVSDK do not scale it. Where
    the command uses neither, what is no whole number is dropped.

    Raises
    ------
    InvalidPositionError
        Not a valid position, or not a number that fits the wire.
    """
    if has_place(command, frame):
        return to_e7(checked_lat_lon(param5, param6))
    return _whole_param(command, 5, param5), _whole_param(command, 6, param6)


def _whole_param(command: int, number: int, value: float) -> int:
    if math.isfinite(value) and value == round(value) and abs(value) <= _INT32_MAX:
        return round(value)
    if str(number) not in USED_PARAMS.get(
        command, "56"
    ):  # what a ground station left there, such as an old place
        return 0
    raise InvalidPositionError(
        f"param{number} is {value:.10g}; command {command} has no position, so a mission item holds a whole number there"
    )


def xy_for_file(item: MissionItem) -> tuple[float, float]:
    """Return an item's params 5 and 6 as files hold them: degrees where the command has a place."""
    scale = 1e7 if has_place(item.command, item.frame) else 1.0
    return item.lat_e7 / scale, item.lon_e7 / scale


def has_place(command: int, frame: int) -> bool:
    """Return whether a command's params 5 and 6 are a place, by MAVLink's definitions; of a command without one its frame tells."""
    if command in USED_PARAMS:
        return command in COMMANDS_WITH_PLACE
    return frame != CoordinateFrame.MISSION


def without_nan(item: MissionItem) -> MissionItem:
    """Return an item for files and vehicles that refuse NaN.

    A heading that is not set becomes 0, and so does what a command does not use: ArduPilot keeps no param4 as a heading, and QGroundControl
    writes null for all three.

    Raises
    ------
    MissionFormatError
        Another parameter is NaN.
    """
    if not any(map(math.isnan, item.params)):
        return item
    used = USED_PARAMS.get(item.command, "1234")
    if item.command in COMMANDS_WITH_PLACE:
        used = used.replace("4", "")
    for i, value in enumerate(item.params, start=1):
        if math.isnan(value) and str(i) in used:
            raise MissionFormatError(
                f"param{i} of command {int(item.command)} is not set (NaN), but this format needs a number",
                advice="set it in the ground station, or save as .plan or .geojson",
            )
    params = item.params
    a, b, c, d = (0.0 if math.isnan(value) else value for value in params)
    return replace(item, params=(a, b, c, d))


def swapped_hint(lat_deg: float, lon_deg: float, order: str) -> str:
    """Return what to add to an error of a position whose numbers would be one the other way round."""
    if 90 < abs(lat_deg) <= 180 and abs(lon_deg) <= 90:
        return f"; expected {order}: are they swapped?"
    return ""


def number(text: str) -> float:
    """Read a number of a text file.

    Raises
    ------
    ValueError
        It is not such a number.
    """
    if "_" in text:  # 4_0 is 40 to Python, and a slip of the pen to everybody else
        raise ValueError(f"{text!r} is not a number")
    if _DECIMAL_COMMA.fullmatch(text.strip()):
        raise ValueError(f"{text!r} has a decimal comma; write it with a decimal point")
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a number") from None


def whole(value: float, name: str, most: int) -> int:
    """Return a whole number from 0 to ``most``.

    Raises
    ------
    ValueError
        It is not such a number.
    """
    if not (math.isfinite(value) and 0 <= value <= most and value == int(value)):
        raise ValueError(f"{name} {value:g} is not a whole number from 0 to {most}")
    return int(value)
