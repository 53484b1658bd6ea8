"""Zones as shapes: which one holds the others, and exclusions cut along their holes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely
from shapely import Polygon, affinity, box

from missions.geo import LatLon, to_e7, wrap_lon_deg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from missions.formats.features import Feature

_M_PER_DEG = 111_320.0
_TOUCHING_DEG = 1e-7  # 1 cm: what was drawn along an edge may lie that far beyond it


def find_outermost(zones: Sequence[Feature]) -> Feature | None:
    """Return the zone that holds all others, None without one."""
    origin = zones[0].lines[0][0]
    shapes = [_outline(zone, origin) for zone in zones]
    largest = max(range(len(shapes)), key=lambda i: shapes[i].area)
    grown = shapes[largest].buffer(_TOUCHING_DEG)
    try:
        holds_all = all(shapely.covers(grown, shape) for shape in shapes)
    except shapely.GEOSException:
        return None
    return zones[largest] if holds_all else None


def cut_along_holes(feature: Feature) -> list[tuple[LatLon, ...]]:
    """Return rings without holes that together cover a polygon with holes: a fence has no ground inside an exclusion.

    Cuts run along meridians of whole degE7, so that both sides of a cut keep the same line when they are rounded for the vehicle.
    """
    origin = feature.lines[0][0]
    outer, *holes = ([_about(position, origin) for position in ring] for ring in feature.lines)
    whole = Polygon(outer, holes)
    if not whole.is_valid:
        raise feature.error(
            "an exclusion whose rings cross or touch; draw it again, or as several without holes"
        )
    waiting, done = [whole], []
    while waiting:
        piece = waiting.pop()
        if piece.interiors:
            waiting += _halves(piece, origin)
        else:
            done.append(tuple(_on_earth(point, origin) for point in piece.exterior.coords[:-1]))
    return done


def _outline(zone: Feature, origin: LatLon) -> BaseGeometry:
    """Return a zone in degrees about an origin, circles as wide as they are in latitude and longitude."""
    points = [_about(position, origin) for position in zone.lines[0]]
    radius_m = zone.radius_m()
    if radius_m is None:
        return shapely.make_valid(Polygon(points))
    (east, north), cos = points[0], max(0.01, math.cos(math.radians(zone.position.lat_deg)))
    circle = shapely.Point(east, north).buffer(radius_m / _M_PER_DEG)
    return affinity.scale(circle, 1 / cos, 1)


def _halves(polygon: Polygon, origin: LatLon) -> list[Polygon]:

    west, south, east, north = polygon.bounds
    hole_west, _, hole_east, _ = polygon.interiors[0].bounds
    middle = LatLon(0.0, origin.lon_deg + (hole_west + hole_east) / 2)
    cut = to_e7(middle)[1] / 1e7 - origin.lon_deg
    sides = (box(west - 1, south - 1, cut, north + 1), box(cut, south - 1, east + 1, north + 1))
    pieces = [polygon.intersection(side) for side in sides]
    return [
        part
        for piece in pieces
        for part in getattr(piece, "geoms", [piece])
        if isinstance(part, Polygon) and part.area > 0
    ]


def _about(position: LatLon, origin: LatLon) -> tuple[float, float]:
    # Rounded, for numbers like 1e-316 make GEOS lose whole triangles
    return round(wrap_lon_deg(position.lon_deg - origin.lon_deg), 12), round(position.lat_deg, 12)


def _on_earth(point: tuple[float, ...], origin: LatLon) -> LatLon:
    return LatLon(point[1], wrap_lon_deg(point[0] + origin.lon_deg))
