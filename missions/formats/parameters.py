"""Parameter files (.parm, .param): a name and a value a line, with comma, tab or spaces between, # for remarks; QGroundControl's .params."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import MissionFormatError
from missions.firmware import firmware_from_remark
from missions.formats.bounds import lines_of
from missions.formats.numbers import number as number_of
from missions.formats.texts import read_text
from missions.situation import Reading, Situation
from missions.vehicle import is_ardupilots
from missions.vehicle.parameters import PARAMETERS, PX4_NAMES, Range
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,15}")
_LINE = re.compile(r"^([A-Za-z][A-Za-z0-9_]*)[\s,=:]+([^\s_]+)(?:\s|$)")
_COLUMNS = re.compile(r"[\s,=:]+")
_MOST_LETTERS = 16  # of PARAM_VALUE.param_id

_MOST = 3.4028234663852886e38
"""The largest number of MAVLink's 32-bit floats."""

_STACK = re.compile(r"\s*#\s*Stack:\s*(ArduPilot|PX4)\b", re.IGNORECASE)
_STACKS = {True: "ArduPilot", False: "PX4 Pro"}
"""QGroundControl's words, by whether it is ArduPilot."""

_AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
_MOST_ID = 255
_INT32, _REAL32 = 6, 9
_KINDS = {
    1: Range(0, 2**8 - 1), 2: Range(-(2**7), 2**7 - 1), 3: Range(0, 2**16 - 1), 4: Range(-(2**15), 2**15 - 1),
    5: Range(0, 2**32 - 1), 6: Range(-(2**31), 2**31 - 1), 7: Range(0, 2**64 - 1), 8: Range(-(2**63), 2**63 - 1), 9: None, 10: None,
}  # fmt: skip
"""MAV_PARAM_TYPE: what of a whole-number type is possible; None for floats."""

_EXACT_TO = 1e15  # below it, every whole number is a float of its own
_MOST_NAMED = 5  # chosen: remarks that fit a screen

_NOT_A_PARAMETER = "_HASH_CHECK"
"""A checksum of all parameters that PX4 sends along with them, and MAVProxy writes down."""


def read_parameters(path: Path | str) -> dict[str, float]:
    """Read a parameter file of Mission Planner, MAVProxy or QGroundControl.

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
    """Read a file's text: parameters, and what remarks tell of the autopilot ("# Stack: PX4 Pro", "# Version: 1.17.0" of QGroundControl).

    Of QGroundControl's rows (vehicle, component, name, value, type) those of the autopilot count, which is component 1, or the lowest that there is.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    rows: list[_ParameterRow] = []
    remarks, firmware, told = [], None, None
    for number, line in enumerate(lines_of(text, source), start=1):
        firmware = firmware or firmware_from_remark(line)
        told = _autopilot_of_remark(line) if told is None else told
        content = line.partition("#")[0].strip()
        if not content or _NOT_A_PARAMETER in _COLUMNS.split(content)[:3]:
            continue
        row = _parse(content, f"{source}: line {number}")
        if len(row.name) > _MOST_LETTERS:
            remarks.append(
                f"{source}: line {number}: {row.name} skipped: parameter names have at most {_MOST_LETTERS} characters, this one has {len(row.name)}"
            )
        else:
            rows.append(row)
    system = _vehicle_of(rows)
    kept, left_out = _of_autopilot(rows, source)
    parameters = {row.name: row.value for row in kept}
    named = is_ardupilots(parameters)
    if told is not None and named not in (None, told):
        remarks.append(
            f"{source}: a remark says that this is {_STACKS[told]}, but its parameters are {_STACKS[not told]}'s: the parameters decide"
        )
        told = named
    if (named if told is None else told) is False:
        remarks += _type_remarks(kept)
    return Situation(
        system=system,
        ardupilot=told,
        parameters=parameters,
        firmware=firmware,
        reading=Reading(remarks=(*remarks, *left_out)),
    )


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's parameters by name, as exact as the 32-bit numbers of MAVLink."""
    rows = [f"{name:<16} {value_text(value)}\n" for name, value in sorted(situation.parameters.items())]
    return "".join((*origin_remarks(situation), *rows))


def qgc_text(situation: Situation, types: Mapping[str, int]) -> str:
    """Return the text of a .params file as QGroundControl writes and reads them.

    Parameters
    ----------
    situation : Situation
        The vehicle's ids, its parameters, its autopilot and version where they are known.
    types : mapping of str to int
        MAV_PARAM_TYPE by name, as the vehicle reported it: QGroundControl skips a row of another type.
    """
    system, component = situation.system or 1, situation.component or _AUTOPILOT_COMPONENT
    head = (
        f"# Onboard parameters for Vehicle {system}\n",
        "#\n",
        *origin_remarks(situation),
        "# Vehicle: Rover\n",
        "#\n",
        "# Vehicle-Id Component-Id Name Value Type\n",
    )
    rows = (
        f"{system}\t{component}\t{name}\t{value_text(value)}\t{types.get(name, _REAL32)}\n"
        for name, value in sorted(situation.parameters.items())
    )
    return "".join((*head, *rows))


def origin_remarks(situation: Situation) -> list[str]:
    """Return the lines that a file begins with: whose parameters these are and of which version, as far as that is known."""
    stack = [] if situation.ardupilot is None else [f"# Stack: {_STACKS[situation.ardupilot]}\n"]
    return [*stack, *([f"# Version: {situation.firmware}\n"] if situation.firmware else [])]


def value_text(value: float) -> str:
    """Return a parameter's value as a text from which the same value is read again: PX4's INT32 have up to ten digits, floats of 32 bits nine."""
    is_whole = value == math.floor(value) and abs(value) < _EXACT_TO
    return f"{value:.0f}" if is_whole else f"{value:.9g}"


def is_parameter_name(text: str) -> bool:
    """Return whether a text can be a parameter's name in a file: a letter, then up to 15 letters, digits and underscores."""
    return _NAME.fullmatch(text) is not None


class _ParameterRow(NamedTuple):
    """A parameter of a file; ids and MAV_PARAM_TYPE in QGroundControl's rows only."""

    where: str
    name: str
    value: float
    system: int | None = None
    component: int | None = None
    kind: int | None = None


def _parse(text: str, where: str) -> _ParameterRow:
    columns = [column.strip() for column in (text.split("\t") if "\t" in text else text.split())]
    is_qgc = len(columns) == 5  # vehicle, component, name, value, type
    if is_qgc:
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
    name = match[1].upper()
    if not is_qgc:
        return _ParameterRow(where, name, value)
    system, component = (
        _id(text, word, where) for text, word in zip(columns, ("vehicle", "component"), strict=False)
    )
    return _ParameterRow(where, name, value, system, component, _kind(columns[4], name, value, where))


def _id(text: str, word: str, where: str) -> int:
    if not (text.isdecimal() and int(text) <= _MOST_ID):
        raise MissionFormatError(f"{where}: {text!r} is no {word} id; expected 0 to {_MOST_ID}", where=where)
    return int(text)


def _kind(text: str, name: str, value: float, where: str) -> int:
    """Return the MAV_PARAM_TYPE of a row that holds a value of that type."""
    kind = int(text) if text.isdecimal() else 0
    if kind not in _KINDS:
        raise MissionFormatError(
            f"{where}: {text!r} is no parameter type (MAV_PARAM_TYPE); expected 1 to {max(_KINDS)}",
            where=where,
        )
    whole = _KINDS[kind]
    if whole is not None and (value != math.floor(value) or value not in whole):
        raise MissionFormatError(
            f"{where}: {name} {value:.9g} is no value of type {kind}; expected a whole number, {whole.least:.0f} to {whole.most:.0f}",
            where=where,
        )
    return kind


def _vehicle_of(rows: Sequence[_ParameterRow]) -> int | None:
    """Return which vehicle the rows are of; None where they do not say it."""
    first: int | None = None
    for row in rows:
        first = row.system if first is None else first
        if row.system is not None and row.system != first:
            raise MissionFormatError(
                f"{row.where}: parameters of vehicle {row.system}, but those above are of vehicle {first}",
                where=row.where,
                advice="save the parameters of one vehicle, or keep the lines of one",
            )
    return first


def _of_autopilot(rows: Sequence[_ParameterRow], source: str) -> tuple[list[_ParameterRow], list[str]]:
    """Return the rows of the autopilot, and what is to be said of those of other components."""
    components = {row.component for row in rows if row.component is not None}
    if len(components) < 2:
        return list(rows), []
    chosen = _AUTOPILOT_COMPONENT if _AUTOPILOT_COMPONENT in components else min(components)
    kept = [row for row in rows if row.component in (None, chosen)]
    others = ", ".join(map(str, sorted(components - {chosen})))
    return kept, [
        f"{source}: {counted(len(rows) - len(kept), 'parameter')} of component {others} skipped: only the autopilot's (component {chosen}) count"
    ]


def _type_remarks(rows: Sequence[_ParameterRow]) -> list[str]:
    """Return which of PX4's parameters have another type than PX4 publishes."""
    remarks = []
    for row in rows:
        wanted = PARAMETERS[row.name].is_whole if row.name in PX4_NAMES else None
        if row.kind is not None and wanted is not None and row.kind != (_INT32 if wanted else _REAL32):
            kind, name = (_INT32, "INT32") if wanted else (_REAL32, "FLOAT")
            remarks.append(
                f"{row.where}: {row.name} has type {row.kind}, PX4's is {name} ({kind}): QGroundControl skips such a line"
            )
    more = len(remarks) - _MOST_NAMED
    return [*remarks[:_MOST_NAMED], f"and {more} more of another type"] if more > 0 else remarks


def _autopilot_of_remark(line: str) -> bool | None:
    """Return whether a remark says that the autopilot is ArduPilot ("# Stack: PX4 Pro" of QGroundControl); None where it says nothing."""
    found = _STACK.match(line)
    return None if found is None else found[1].lower() == "ardupilot"


def _number(text: str) -> float:
    return float(int(text, 16)) if text.lower().startswith(("0x", "-0x")) else number_of(text)
