"""Parameter files (.parm, .param): a name and a value a line, with comma, tab or spaces between, # for remarks."""

from __future__ import annotations

import math
import re
from pathlib import Path

from missions.errors import MissionFormatError
from missions.firmware import firmware_from_remark
from missions.formats.bounds import lines_of
from missions.formats.numbers import number as number_of
from missions.formats.texts import read_text
from missions.situation import Reading, Situation

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")
_LINE = re.compile(r"^([A-Za-z][A-Za-z0-9_]*)[\s,=:]+([^\s_]+)(?:\s|$)")
_COLUMNS = re.compile(r"[\s,=:]+")
_MOST_LETTERS = 16  # of PARAM_VALUE.param_id

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
    return dict(read_path(Path(path)).parameters)


def read_path(path: Path) -> Situation:
    """Read a parameter file of any suffix; the situation's remarks tell what was passed over.

    Raises
    ------
    MissionFormatError
        As `read_parameters`.
    """
    return read(read_text(path).text, str(path))


def read(text: str, source: str) -> Situation:
    """Read a file's text: parameters, and the firmware's version where a remark names it ("# Version: 4.5.7" of QGroundControl).

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    parameters = {}
    remarks, firmware = [], None
    for number, line in enumerate(lines_of(text, source), start=1):
        firmware = firmware or firmware_from_remark(line)
        content = line.partition("#")[0].strip()
        if not content or _NOT_A_PARAMETER in _COLUMNS.split(content)[:3]:
            continue
        name, value = _parse(content, f"{source}: line {number}")
        if len(name) > _MOST_LETTERS:
            remarks.append(
                f"{source}: line {number}: {name} skipped: parameter names have at most {_MOST_LETTERS} characters, this one has {len(name)}"
            )
        else:
            parameters[name] = value
    return Situation(parameters=parameters, firmware=firmware, reading=Reading(remarks=tuple(remarks)))


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
    problem = ""
    try:
        value = _number(match[2]) if match else math.nan
    except (ValueError, OverflowError) as error:
        value, problem = math.nan, f" ({error})" if "decimal comma" in str(error) else ""
    if match is None or not abs(value) <= _MOST:
        raise MissionFormatError(
            f"{where}: expected a parameter's name and a number, found {text!r}{problem}", where=where
        )
    return match[1].upper(), value


def _number(text: str) -> float:
    return float(int(text, 16)) if text.lower().startswith(("0x", "-0x")) else number_of(text)
