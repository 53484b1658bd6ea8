"""Parameter files (.parm, .param): a name and a value a line, with comma, tab or spaces between, # for remarks."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from pathlib import Path

_LINE = re.compile(r"^([A-Za-z][A-Za-z0-9_]{0,15})[\s,=:]+([^\s_]+)(?:\s|$)")


def read_parameters(path: Path) -> dict[str, float]:
    """Read a parameter file of Mission Planner, MAVProxy or QGroundControl (its last two columns).

    Raises
    ------
    MissionFormatError
        The file is missing or a line is not a name and a number; says which.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise MissionFormatError(f"{path} cannot be read: {error.strerror}", file=str(path)) from None
    except UnicodeDecodeError:
        raise MissionFormatError(f"{path} is not a text file", file=str(path)) from None
    parameters = {}
    for number, line in enumerate(lines, start=1):
        text = line.partition("#")[0].strip()
        if text:
            name, value = _parse(text, f"{path}: line {number}")
            parameters[name] = value
    return parameters


def _parse(text: str, where: str) -> tuple[str, float]:
    columns = text.split("\t")
    if len(columns) == 5:  # QGroundControl: system, component, name, value, type
        text = f"{columns[2]} {columns[3]}"
    match = _LINE.match(text)
    try:
        value = float(match[2]) if match else math.nan
    except ValueError:
        value = math.nan
    if match is None or not math.isfinite(value):
        raise MissionFormatError(
            f"{where}: expected a parameter's name and a number, found {text!r}", where=where
        )
    return match[1].upper(), value
