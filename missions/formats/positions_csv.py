"""Tables of positions (.csv): a position a row, the first row names the columns."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.bounds import MOST_COLUMNS, MOST_FEATURES, check_bound
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_reading import situation_of
from missions.formats.features import Feature, Role, Shape
from missions.formats.numbers import number, swapped_hint
from missions.geo import checked_lat_lon

if TYPE_CHECKING:
    from missions.formats.choices import Choices
    from missions.situation import Situation

_LAT = ("lat", "latitude", "lat_deg", "latitude_deg", "breite", "breitengrad")
_LON = ("lon", "lng", "long", "longitude", "lon_deg", "longitude_deg", "länge", "längengrad")
_ORDER = "latitude and longitude as line 1 names them"


def read(text: str, source: str, choices: Choices = NO_CHOICES) -> Situation:
    """Read a file's text: its rows are waypoints in their order, unless a column ``role`` says otherwise (and ``radius_m`` a circle).

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    check_bound(text.count("\n"), MOST_FEATURES, "rows", source)
    first = text.partition("\n")[0]
    delimiter = max(";\t,", key=first.count)
    check_bound(first.count(delimiter), MOST_COLUMNS, "columns", source)
    rows = csv.reader(io.StringIO(text), delimiter=delimiter)
    try:
        numbered = [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise MissionFormatError(f"{source}: line {rows.line_num}: {error}", file=source) from None
    if not numbered:
        raise MissionFormatError(f"{source}: the file is empty", file=source)
    heads = [cell.strip().casefold() for cell in numbered[0][1]]
    lat, lon = (_column(heads, names, source) for names in (_LAT, _LON))
    features = [_feature(heads, lat, lon, row, f"{source}: line {line}") for line, row in numbered[1:]]
    return situation_of(features, source, choices)


def _column(heads: list[str], names: tuple[str, ...], source: str) -> int:
    found = [index for index, head in enumerate(heads) if head in names]
    if len(found) != 1:
        raise MissionFormatError(
            f"{source}: line 1: {len(found)} columns named {' or '.join(names[:2])}; the first line names the columns, such as lat,lon,name",
            file=source,
            line=1,
        )
    return found[0]


def _feature(heads: list[str], lat: int, lon: int, row: list[str], where: str) -> Feature:
    if len(row) != len(heads):
        raise MissionFormatError(f"{where}: {len(row)} columns; expected {len(heads)}", where=where)
    cells = [cell.strip() for cell in row]
    try:
        lat_deg, lon_deg = number(cells[lat]), number(cells[lon])
    except ValueError as error:
        raise MissionFormatError(f"{where}: {error}; expected decimal degrees", where=where) from None
    try:
        position = checked_lat_lon(lat_deg, lon_deg)
    except InvalidPositionError as error:
        raise MissionFormatError(
            f"{where}: {error}{swapped_hint(lat_deg, lon_deg, _ORDER)}", where=where
        ) from None
    properties: dict[str, object] = {
        head: cell
        for index, (head, cell) in enumerate(zip(heads, cells, strict=True))
        if cell and index not in (lat, lon)
    }
    name = str(properties.pop("name", ""))
    return Feature(Shape.POINT, ((position,),), properties, (name,), where, fallback=Role.WAYPOINT)


def write(situation: Situation) -> str:
    """Return the text of a file with the places of the situation's mission; commands without a place are left out.

    Raises
    ------
    MissionFormatError
        The mission has no place.
    """
    assert situation.mission is not None
    items = enumerate(situation.mission.value.items, start=1)
    rows = [
        f"{item.position.lat_deg:.8f},{item.position.lon_deg:.8f},waypoint {seq}\n"
        for seq, item in items
        if item.is_placed
    ]
    if not rows:
        raise MissionFormatError("a .csv file contains positions, but no mission item has one")
    return "".join(["lat,lon,name\n", *rows])
