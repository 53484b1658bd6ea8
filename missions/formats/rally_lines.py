"""Rally points of MAVProxy before they were mission items: ``RALLY latitude longitude altitude break-altitude direction flags`` a line."""

from __future__ import annotations

import math

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.bounds import lines_of
from missions.formats.numbers import number
from missions.geo import checked_lat_lon
from missions.rally import RallyPoint
from missions.situation import Known, Situation

_WORD = "RALLY"


def is_rally_text(text: str) -> bool:
    """Return whether a text begins as this format does."""
    return text.lstrip().startswith(_WORD)


def read(text: str, source: str) -> Situation:
    """Read a file's text; how a plane would land there is left out.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    points = tuple(
        _point(line.split(), f"{source}: line {count}")
        for count, line in enumerate(lines_of(text, source), start=1)
        if line.strip() and not line.strip().startswith("#")
    )
    return Situation(rally=Known(points, None, source))


def _point(columns: list[str], where: str) -> RallyPoint:
    if columns[0] != _WORD or len(columns) != 7:
        raise MissionFormatError(
            f"{where}: expected {_WORD} and 6 numbers, found {' '.join(columns)!r}", where=where
        )
    try:
        lat_deg, lon_deg, alt_m, *_ = map(number, columns[1:])
        point = RallyPoint(*checked_lat_lon(lat_deg, lon_deg), alt_m)
    except (ValueError, InvalidPositionError) as error:
        raise MissionFormatError(f"{where}: {error}", where=where) from None
    if not math.isfinite(alt_m):
        raise MissionFormatError(f"{where}: altitude {alt_m}; expected a number of metres", where=where)
    return point
