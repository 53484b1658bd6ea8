"""Parameter files (.parm, .param): a name and a value a line, with comma, tab or spaces between, # for remarks."""

from __future__ import annotations

import math
import re
from pathlib import Path

from missions.errors import MissionFormatError
from missions.firmware import firmware_from_remark
from missions.formats.files import read_text
from missions.situation import Situation

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")
_LINE = re.compile(r"^([A-Za-z][A-Za-z0-9_]{0,15})[\s,=:]+([^\s_]+)(?:\s|$)")

_MOST = 3.4028234663852886e38
"""The largest number of MAVLink's 32-bit floats."""

_NOT_A_PARAMETER = "_HASH_CHECK"
"""A checksum of all parameters that PX4 sends along with them, and MAVProxy writes down."""


def read_parameters(path: Path | str) -> dict[str, float]:
    """Read a parameter file of Mission Planner, MAVProxy or QGroundControl (its last two columns).

    Raises
    ------
    MissionFormatError
        The file is missing or a line is not a name and a number; the message says which.
    """
    return dict(read_parameter_file(path).parameters)


def read_parameter_file(path: Path | str) -> Situation:
    """Read a parameter file as `read_parameters` does, with the firmware's version where one of its remarks names it."""
    return read(read_text(Path(path)), str(path))


def read(text: str, source: str) -> Situation:
    """Read a file's text: parameters, and the firmware's version where a remark names it ("# Version: 4.5.7" of QGroundControl).

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    parameters = {}
    firmware = None
    for number, line in enumerate(text.splitlines(), start=1):
        firmware = firmware or firmware_from_remark(line)
        content = line.partition("#")[0].strip()
        if content and not content.startswith(_NOT_A_PARAMETER):
            name, value = _parse(content, f"{source}: line {number}")
            parameters[name] = value
    return Situation(parameters=parameters, firmware=firmware)


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's parameters by name, as exact as the 32-bit floats of MAVLink."""
    rows = [f"{name:<16} {value:.9g}\n" for name, value in sorted(situation.parameters.items())]
    remark = f"# Version: {situation.firmware}\n" if situation.firmware else ""
    return remark + "".join(rows)


def is_parameter_name(text: str) -> bool:
    """Return whether a text can be a parameter's name in a file: a letter, then up to 15 letters, digits and underscores."""
    return _NAME.fullmatch(text) is not None


def _parse(text: str, where: str) -> tuple[str, float]:
    columns = text.split("\t")
    if len(columns) == 5:  # QGroundControl: system, component, name, value, type
        text = f"{columns[2]} {columns[3]}"
    match = _LINE.match(text)
    try:
        value = _number(match[2]) if match else math.nan
    except (ValueError, OverflowError):
        value = math.nan
    if match is None or not abs(value) <= _MOST:
        raise MissionFormatError(
            f"{where}: expected a parameter's name and a number, found {text!r}", where=where
        )
    return match[1].upper(), value


def _number(text: str) -> float:
    return float(int(text, 16)) if text.lower().startswith(("0x", "-0x")) else float(text)
