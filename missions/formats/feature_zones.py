"""From polygons and circles with their roles, or without, to zones of a fence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.fence import CircleZone, PolygonZone, Zone, ZoneKind
from missions.formats.feature_roles import may_be_inclusion
from missions.formats.features import Role
from missions.geo import LatLon, to_e7, wrap_lon_deg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from missions.errors import MissionFormatError
    from missions.formats.choices import Choices
    from missions.formats.features import Feature

_M_PER_DEG = 111_320.0
_TOUCHING_DEG = 1e-7  # 1 cm: what was drawn along an edge may lie that far beyond it


def roles_of_zones(
    zones: Sequence[tuple[Feature, Role | None]], choices: Choices, points: Sequence[Feature]
) -> tuple[list[tuple[Feature, Role]], tuple[str, ...]]:
    """Return each zone's role, and remarks on those that were taken for something.

    A lone zone of which nothing is said is an inclusion; of several each must be said, or ``--outermost inclusion`` sorts them.

    Raises
    ------
    MissionFormatError
        What zones or points are is not certain; the message names them, the advice the options that settle it.
    """
    unknown = [feature for feature, role in zones if role is None]
    fields = [feature for feature, role in zones if role is not Role.EXCLUSION]
    if unknown and choices.outermost_is_inclusion:
        if points:
            raise _uncertain((), points, fields)
        outer = _outermost(fields)
        return [
            (feature, role or (Role.INCLUSION if feature is outer else Role.EXCLUSION))
            for feature, role in zones
        ], ()
    remarks: tuple[str, ...] = ()
    if len(zones) == 1 and unknown and may_be_inclusion(unknown[0]):
        lone = unknown.pop()
        taken = f"{lone} is the only zone and nothing says what it is: taken for an inclusion, the area to stay in"
        remarks = (f"{lone.where}: {taken} (otherwise: {lone.role_option('exclusion')})",)
    if unknown or points:
        raise _uncertain(unknown, points, fields)
    return [(feature, role or Role.INCLUSION) for feature, role in zones], remarks


def _uncertain(
    zones: Sequence[Feature], points: Sequence[Feature], fields: Sequence[Feature]
) -> MissionFormatError:
    problems = []
    if zones:
        problems.append(
            f"nothing says whether {_listed(zones)} {'are inclusions or exclusions' if len(zones) > 1 else 'is an inclusion or an exclusion'}"
        )
    if points:
        problems.append(f"nothing says what {_listed(points)} {'are' if len(points) > 1 else 'is'}")
    first = (*zones, *points)[0]
    options, notes = [], []
    if len(zones) > 1 and _find_outermost(fields) is not None:
        options.append("--outermost inclusion")
        notes.append("the others are exclusions then")
    elif zones:
        options += [zone.role_option("exclusion") for zone in zones[:5]]
        notes.append("or =inclusion, =ignore")
    if points:
        options.append("--ignore-points")
        notes += [] if zones else [f"or say what they are, such as {first.role_option('waypoint')}"]
    advice = f"add to the command: {' '.join(options)} ({'; '.join(notes)})"
    return first.error("; ".join(problems), advice=advice.removesuffix(" ()"))


def _listed(features: Sequence[Feature]) -> str:
    names = [str(feature) for feature in features[:10]]
    more = f" and {len(features) - 10} more" if len(features) > 10 else ""
    return ", ".join(names) + more


def _outermost(zones: Sequence[Feature]) -> Feature:
    found = _find_outermost(zones)
    if found is None:
        raise zones[0].error(
            f"--outermost: none of these zones holds all others: {_listed(zones)}",
            advice=f"say what they are one by one: {zones[0].role_option('inclusion')} …",
        )
    return found


def _find_outermost(zones: Sequence[Feature]) -> Feature | None:
    """Return the zone that holds all others, None without one."""
    import shapely  # noqa: PLC0415 - slow to come, only for these

    origin = zones[0].lines[0][0]
    shapes = [_outline(zone, origin) for zone in zones]
    largest = max(range(len(shapes)), key=lambda i: shapes[i].area)
    grown = shapes[largest].buffer(_TOUCHING_DEG)
    try:
        holds_all = all(shapely.covers(grown, shape) for shape in shapes)
    except shapely.GEOSException:
        return None
    return zones[largest] if holds_all else None


def _outline(zone: Feature, origin: LatLon) -> BaseGeometry:
    """Return a zone in degrees about an origin, circles as wide as they are in latitude and longitude."""
    import shapely  # noqa: PLC0415
    from shapely import affinity  # noqa: PLC0415

    points = [_about(position, origin) for position in zone.lines[0]]
    radius_m = zone.radius_m()
    if radius_m is None:
        return shapely.make_valid(shapely.Polygon(points))
    (east, north), cos = points[0], max(0.01, math.cos(math.radians(zone.position.lat_deg)))
    circle = shapely.Point(east, north).buffer(radius_m / _M_PER_DEG)
    return affinity.scale(circle, 1 / cos, 1)


def _about(position: LatLon, origin: LatLon) -> tuple[float, float]:
    # Rounded, for numbers like 1e-316 make GEOS lose whole triangles
    return round(wrap_lon_deg(position.lon_deg - origin.lon_deg), 12), round(position.lat_deg, 12)


def zones_of(feature: Feature, role: Role) -> list[Zone]:
    """Return the zones that a polygon or a circle stands for: the holes of an inclusion are exclusions, an exclusion is cut along its holes.

    Raises
    ------
    MissionFormatError
        The rings of an exclusion with holes cross.
    """
    kind = ZoneKind.EXCLUSION if role is Role.EXCLUSION else ZoneKind.INCLUSION
    radius_m = feature.radius_m()
    if radius_m is not None:
        return [CircleZone(kind, feature.position, radius_m)]
    outer, *holes = feature.lines
    if kind is ZoneKind.EXCLUSION and holes:
        return [PolygonZone(kind, ring) for ring in _cut_along_holes(feature)]
    return [PolygonZone(kind, outer), *(PolygonZone(ZoneKind.EXCLUSION, hole) for hole in holes)]


def _cut_along_holes(feature: Feature) -> list[tuple[LatLon, ...]]:
    """Return rings without holes that together cover a polygon with holes: a fence has no ground inside an exclusion.

    Cuts run along meridians of whole degE7, so that both sides of a cut keep the same line when they are rounded for the vehicle.
    """
    from shapely import Polygon  # noqa: PLC0415

    origin = feature.lines[0][0]
    outer, *holes = ([_about(position, origin) for position in ring] for ring in feature.lines)
    whole = Polygon(outer, holes)
    if not whole.is_valid:
        raise feature.error(
            "an exclusion whose rings cross or touch; draw it anew, or as several without holes"
        )
    waiting, done = [whole], []
    while waiting:
        piece = waiting.pop()
        if piece.interiors:
            waiting += _halves(piece, origin)
        else:
            done.append(tuple(_on_earth(point, origin) for point in piece.exterior.coords[:-1]))
    return done


def _halves(polygon: Polygon, origin: LatLon) -> list[Polygon]:
    from shapely import Polygon, box  # noqa: PLC0415

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


def _on_earth(point: tuple[float, ...], origin: LatLon) -> LatLon:
    return LatLon(point[1], wrap_lon_deg(point[0] + origin.lon_deg))
