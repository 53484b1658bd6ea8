"""A rover's calibration as a file (TOML) and as plain data: what ``pbpp logs calibrate`` writes and ``--vehicle`` reads."""

from __future__ import annotations

import math
import tomllib
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from missions.errors import MissionError, MissionFormatError
from missions.firmware import read_firmware
from missions.formats.texts import read_text
from missions.situation import Calibration, CornerClass, LegClass, Situation
from missions.vehicle import Steering
from missions.vehicle.calibration import LEAST_CORNERS
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from missions.firmware import Firmware

SUFFIX: Final = ".toml"
_VERSION: Final = 1
_MOST_MORE_M: Final = (
    100.0  # more no rover cuts or swings out, however ill it steers; chosen, catches a slip of the pen
)
_MOST_CORNERS: Final = 2**53
_HEAD = """\
# How vehicle {system} drives, from {drives}; written by `pbpp logs calibrate`, read by --vehicle.
# What is above 0 is added to the drive model's bounds, what is below 0 is taken from them; a class with fewer than {least} corners takes nothing.
"""


def calibration_to_plain(calibration: Calibration | None) -> dict[str, Any] | None:
    """Return a calibration as JSON and TOML have it."""
    if calibration is None:
        return None
    return {**asdict(calibration), "parameters": dict(calibration.parameters)}


def calibration_from_plain(plain: Mapping[str, Any] | None) -> Calibration | None:
    """Return a calibration from plain data.

    Raises
    ------
    ValueError, KeyError, TypeError
        It is none; the message says where.
    """
    if plain is None:
        return None
    return Calibration(
        system=_count(plain, "system", 255),
        drives=_count(plain, "drives"),
        steering=str(Steering(plain["steering"])),
        corners=tuple(_corner_class(one, number) for number, one in enumerate(plain["corners"], start=1)),
        legs=tuple(_leg_class(one) for one in plain["legs"]),
        parameters={str(name): _number(plain["parameters"], name, math.inf) for name in plain["parameters"]},
    )


def _corner_class(plain: Mapping[str, Any], number: int) -> CornerClass:
    found = CornerClass(
        turn_from_deg=_number(plain, "turn_from_deg", 180.0),
        turn_to_deg=_number(plain, "turn_to_deg", 360.0),
        speed_from_mps=_number(plain, "speed_from_mps", 100.0),
        speed_to_mps=_number(plain, "speed_to_mps", 200.0),
        stands=_truth(plain, "stands"),
        corners=_count(plain, "corners"),
        inside_more_m=_number(plain, "inside_more_m", _MOST_MORE_M),
        outside_more_m=_number(plain, "outside_more_m", _MOST_MORE_M),
        beyond_m=_number(plain, "beyond_m", _MOST_MORE_M),
    )
    if found.beyond_m < 0:
        raise ValueError(f"beyond_m of class {number} of corners is {found.beyond_m:g}; expected 0 or more")
    if min(found.inside_more_m, found.outside_more_m) < 0 and found.corners < LEAST_CORNERS:
        raise ValueError(
            f"class {number} of corners narrows a bound with {found.corners} corners; that needs {LEAST_CORNERS}"
        )
    return found


def _leg_class(plain: Mapping[str, Any]) -> LegClass:
    more_m = _number(plain, "more_m", _MOST_MORE_M)
    if more_m < 0:
        raise ValueError(f"more_m is {more_m:g}: legs are not narrowed")
    speeds = (_number(plain, "speed_from_mps", 100.0), _number(plain, "speed_to_mps", 200.0))
    return LegClass(*speeds, _count(plain, "legs"), more_m)


def _number(plain: Mapping[str, Any], name: str, most: float) -> float:
    value = plain[name]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= most:
        raise ValueError(f"{name} is {value!r}; expected a number of at most {most:g}")
    return float(value)


def _count(plain: Mapping[str, Any], name: str, most: int = _MOST_CORNERS) -> int:
    value = plain[name]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise ValueError(f"{name} is {value!r}; expected a whole number of at most {most}")
    return value


def _truth(plain: Mapping[str, Any], name: str) -> bool:
    value = plain[name]
    if not isinstance(value, bool):
        raise TypeError(f"{name} is {value!r}; expected true or false")
    return value


def write(calibration: Calibration, firmware: Firmware | None) -> str:
    """Return the text of a file."""
    plain = calibration_to_plain(calibration)
    assert plain is not None
    lines = [
        _HEAD.format(
            system=calibration.system,
            drives=counted(calibration.drives, "recorded drive"),
            least=LEAST_CORNERS,
        )
    ]
    lines += [f"calibration = {_VERSION}"]
    lines += [f"{name} = {_toml(plain[name])}" for name in ("system", "drives", "steering")]
    if firmware is not None:
        lines.append(f"firmware = {_toml(str(firmware))}")
    for table in ("corners", "legs"):
        for one in plain[table]:
            lines += ["", f"[[{table}]]", *(f"{name} = {_toml(value)}" for name, value in one.items())]
        if not plain[table]:
            lines.insert(1, f"{table} = []")
    lines += [
        "",
        "[parameters]",
        *(f"{name} = {_toml(value)}" for name, value in plain["parameters"].items()),
    ]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def read_calibration(path: Path) -> Situation:
    """Read a file: the rover's calibration, and the parameters that it drove with.

    Raises
    ------
    MissionFormatError
        It cannot be read, or is no calibration.
    """
    text = read_text(path).text
    try:
        plain = tomllib.loads(text)
        if plain.get("calibration") != _VERSION:
            raise ValueError(f"calibration = {plain.get('calibration')!r}; expected {_VERSION}")  # noqa: TRY301 - told as the others
        calibration = calibration_from_plain(plain)
        assert calibration is not None
        firmware = read_firmware(plain["firmware"]) if "firmware" in plain else None
    except (ValueError, LookupError, TypeError, AttributeError, MissionError) as error:
        told = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise MissionFormatError(
            f"{path} is no calibration of a rover: {told}",
            file=str(path),
            advice="write it again: pbpp logs calibrate DATASET -o FILE.toml",
        ) from None
    return Situation(parameters=calibration.parameters, firmware=firmware, calibration=calibration)
