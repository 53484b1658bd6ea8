"""From the features of a GeoJSON or KML file to a situation.

A polygon without a role is an inclusion if it is the only zone, and an error otherwise.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError
from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.formats.feature_roles import role_of
from missions.formats.features import Role, Shape
from missions.formats.numbers import place_e7
from missions.geo import to_e7
from missions.items import Command, CoordinateFrame, MissionItem, waypoint
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from missions.formats.features import Feature
    from missions.geo import LatLon


def situation_of(features: Iterable[Feature], source: str) -> Situation:
    """Read what features mean.

    Raises
    ------
    MissionFormatError
        A feature without a role, or with an impossible one; the message says which and what was expected.
    """
    found: dict[Role, list[Feature]] = {role: [] for role in Role}
    zones: list[tuple[Feature, Role | None]] = []
    for feature in features:
        role = role_of(feature)
        if feature.shape is Shape.POLYGON or feature.radius_m() is not None:
            zones += [(feature, role)] * (role is not Role.DRAWING)
        elif role is not None:
            found[role].append(feature)
        elif feature.shape is Shape.LINE:
            found[Role.ROUTE].append(feature)
        elif feature.shape is Shape.POINT:
            called = f" ({feature.names[0]!r})" if feature.names else ""
            raise feature.error(
                f"a point{called} of which is not said what it is; expected a radius (metres) and a role of inclusion or exclusion, "
                'or a role like "waypoint" or "home"; to leave it out, a role "drawing" or a folder of that name'
            )
    home = _lone(found[Role.HOME])
    fence = _fence(zones, _lone(found[Role.RETURN_POINT]))
    items = _items(found[Role.WAYPOINT], found[Role.ROUTE])
    rally = tuple(map(_rally_point, found[Role.RALLY_POINT]))
    return Situation(
        fence=Known(fence, None, source) if fence != Fence() else None,
        mission=Known(Mission(items, home), None, source) if items else None,
        rally=Known(rally, None, source) if rally else None,
        home=Known(home, None, source) if home else None,
    )


def _rally_point(feature: Feature) -> RallyPoint:
    alt_m = feature.number("altitude_m", 0.0)
    if not math.isfinite(alt_m):
        raise feature.error(f"altitude_m {alt_m}; expected metres")
    return RallyPoint(*feature.position, alt_m)


def _lone(features: Sequence[Feature]) -> LatLon | None:
    if len(features) > 1:
        raise features[1].error(f"a second {role_of(features[1])}; expected one at most")
    return features[0].position if features else None


def _fence(zones: Sequence[tuple[Feature, Role | None]], return_point: LatLon | None) -> Fence:
    read: list[Zone] = []
    for feature, said in zones:
        if said is None and len(zones) > 1:
            raise feature.error(
                'of several zones each must say what it is; expected a role (or "fence") of inclusion or exclusion'
            )
        kind = ZoneKind.EXCLUSION if said is Role.EXCLUSION else ZoneKind.INCLUSION
        radius_m = feature.radius_m()
        if radius_m is not None and feature.shape is Shape.POINT:
            read.append(CircleZone(kind, feature.position, radius_m))
        else:
            read += _polygons(feature, kind)
    return Fence(tuple(read), return_point)


def _polygons(feature: Feature, kind: ZoneKind) -> list[Zone]:
    """Return the zone of a polygon, and an exclusion for every hole of an inclusion."""
    outer, *holes = feature.lines
    if holes and kind is ZoneKind.EXCLUSION:
        raise feature.error(
            "an exclusion with a hole; expected one without: a fence has no ground inside an exclusion"
        )
    return [PolygonZone(kind, outer), *(PolygonZone(ZoneKind.EXCLUSION, hole) for hole in holes)]


def _items(waypoints: Sequence[Feature], routes: Sequence[Feature]) -> tuple[MissionItem, ...]:
    """Return the mission's items: those given one by one, else the places along the one line."""
    if waypoints:
        return tuple(map(_item, _in_order(waypoints)))
    if len(routes) > 1:
        raise routes[1].error('a second line; expected one route (a role of "drawing" has others left out)')
    return tuple(waypoint(position) for feature in routes for position in feature.lines[0])


def _in_order(waypoints: Sequence[Feature]) -> list[Feature]:
    """Put waypoints into the order of their seq; of the file where one has none."""
    if any(feature.properties.get("seq") is None for feature in waypoints):
        return list(waypoints)
    by_seq: dict[int, Feature] = {}
    for feature in waypoints:
        seq = feature.whole("seq", 0)
        if seq in by_seq:
            raise feature.error(f"a second item of seq {seq}")
        by_seq[seq] = feature
    return [by_seq[seq] for seq in sorted(by_seq)]


def _item(feature: Feature) -> MissionItem:
    command = feature.whole("command", Command.NAV_WAYPOINT)
    if feature.shape is Shape.POINT:
        lat_e7, lon_e7 = to_e7(feature.position)
    elif feature.properties.get("command") is None:
        raise feature.error("a waypoint without a place; expected a point, or a command that needs none")
    else:
        try:
            lat_e7, lon_e7 = place_e7(command, feature.number("param5", 0.0), feature.number("param6", 0.0))
        except InvalidPositionError as error:
            raise feature.error(str(error)) from None
    params = [_param(feature, f"param{i}") for i in range(1, 5)]
    return MissionItem(
        command,
        feature.whole("frame", CoordinateFrame.GLOBAL_RELATIVE_ALT),
        (params[0], params[1], params[2], params[3]),
        lat_e7,
        lon_e7,
        feature.number("altitude_m", 0.0),
        autocontinue=bool(feature.whole("autocontinue", 1)),
    )


def _param(feature: Feature, key: str) -> float:
    """Return a parameter; null is MAVLink's "not a number"."""
    null = key in feature.properties and feature.properties[key] is None
    return math.nan if null else feature.number(key, 0.0)
