"""Positions as the sections have them: longitude first, and outlines as GeoJSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.console.view.sections import LineString, MultiPolygon, Place

if TYPE_CHECKING:
    from collections.abc import Iterable

    from missions.geo import LatLon
    from missions.picture.outlines import Outline

_DIGITS = 8  # of a degree: a millimetre, below degE7's 11 mm


def place(position: LatLon) -> Place:
    """Return a position as a place."""
    return round(position.lon_deg, _DIGITS), round(position.lat_deg, _DIGITS)


def places(positions: Iterable[LatLon]) -> tuple[Place, ...]:
    """Return positions as places."""
    return tuple(map(place, positions))


def multi_polygon(found: Outline) -> MultiPolygon:
    """Return an outline as GeoJSON."""
    return MultiPolygon(tuple(tuple(places(ring) for ring in rings) for rings in found))


def line(positions: Iterable[LatLon]) -> LineString:
    """Return positions as a GeoJSON line."""
    return LineString(places(positions))


def finite(value: float | None, digits: int = 4) -> float | None:
    """Return a number as JSON has it: rounded, and None where it is infinite or not known."""
    return None if value is None or not math.isfinite(value) else round(value, digits)
