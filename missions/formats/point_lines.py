"""Points as text, ``latitude longitude`` a line with spaces, a tab or a comma between, # for remarks: what .fen and .poly files are made of."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.fence import CircleZone, PolygonZone, ZoneKind
from missions.formats.bounds import lines_of
from missions.formats.numbers import number, swapped_hint
from missions.geo import checked_lat_lon

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.fence import Fence
    from missions.geo import LatLon

_POINT = re.compile(r"[-+]?\d+[.,]?\d*\s*[\s,;]\s*[-+]?\d+[.,]?\d*")
_DECIMAL_COMMAS = re.compile(r"[-+]?\d+,\d+\s*[\s,;]\s*[-+]?\d+,\d+")


def read_points(text: str, source: str) -> list[tuple[int, LatLon]]:
    """Read points, each with the number of its line.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    points = []
    for count, line in enumerate(lines_of(text, source), start=1):
        content = line.partition("#")[0].strip()
        if content:
            points.append((count, _point(content, f"{source}: line {count}")))
    return points


def is_point_text(text: str) -> bool:
    """Return whether a text begins with a point."""
    lines = (line.partition("#")[0].strip() for line in text[:10_000].splitlines())
    return _POINT.fullmatch(next(filter(None, lines), "")) is not None


def format_points(points: Sequence[LatLon]) -> str:
    """Return the text of points, eight decimals each (1 mm)."""
    return "".join(f"{point.lat_deg:.8f} {point.lon_deg:.8f}\n" for point in points)


def lone_inclusion(fence: Fence, suffix: str) -> PolygonZone:
    """Return the zone of a fence that is one inclusion polygon.

    Raises
    ------
    MissionFormatError
        The fence is anything else; the message says what it is.
    """
    zone = fence.zones[0] if len(fence.zones) == 1 else None
    if isinstance(zone, PolygonZone) and zone.kind is ZoneKind.INCLUSION:
        return zone
    counts = [
        f"{count} {kind} {name}{'s' * (count > 1)}"
        for kind in ZoneKind
        for shape, name in ((PolygonZone, "polygon"), (CircleZone, "circle"))
        if (count := fence.count(kind, shape))
    ]
    raise MissionFormatError(
        f"a {suffix} file contains exactly one inclusion polygon; the fence has {', '.join(counts) or 'no zone'}"
    )


def _point(content: str, where: str) -> LatLon:
    columns = content.replace(",", " ").split()
    try:
        lat_deg, lon_deg = map(number, columns)
    except ValueError:
        comma = "; write decimals with a point" if _DECIMAL_COMMAS.fullmatch(content) else ""
        raise MissionFormatError(
            f"{where}: {content!r}; expected latitude and longitude in decimal degrees with a space or a comma between{comma}",
            where=where,
        ) from None
    try:
        return checked_lat_lon(lat_deg, lon_deg)
    except InvalidPositionError as error:
        hint = swapped_hint(lat_deg, lon_deg, "latitude, longitude")
        raise MissionFormatError(f"{where}: {error}{hint}", where=where) from None
