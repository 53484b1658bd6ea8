"""What GeoJSON and KML share: features with a shape, properties and names, and what they mean (docs/files.md).

What a feature is, its *role*, is said by its property ``role`` (or an alias), else by its name, else by the names of the folders it lies
in, innermost first. A polygon of which nothing is said is an inclusion if it is the only zone, and an error otherwise.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.formats.numbers import number, place_e7, whole
from missions.geo import LatLon, to_e7
from missions.items import Command, CoordinateFrame, MissionItem, file_frame, waypoint
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


class Shape(StrEnum):
    """The shapes that are understood."""

    POINT = "point"
    LINE = "line"
    POLYGON = "polygon"
    NOWHERE = "feature without a geometry"


class Role(StrEnum):
    """What a feature is."""

    INCLUSION = "inclusion"
    EXCLUSION = "exclusion"
    ROUTE = "route"
    WAYPOINT = "waypoint"
    HOME = "home"
    RALLY_POINT = "rally point"
    RETURN_POINT = "return point"
    DRAWING = "drawing"


@dataclass(frozen=True, slots=True)
class Feature:
    """A shape with what is said of it.

    Parameters
    ----------
    shape : Shape
        Of what kind it is.
    lines : tuple of tuples of LatLon
        A point's one position, a line's positions, a polygon's open rings (the outer one first).
    properties : mapping of str to object
        Numbers, texts or booleans by name.
    names : tuple of str
        Its name and those of the folders it lies in, innermost first.
    where : str
        File and place, for errors.
    """

    shape: Shape
    lines: tuple[tuple[LatLon, ...], ...] = ()
    properties: Mapping[str, object] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    where: str = ""

    def error(self, problem: str) -> MissionFormatError:
        """Give an error that says where."""
        return MissionFormatError(f"{self.where}: {problem}", where=self.where)

    @property
    def position(self) -> LatLon:
        """A point's position."""
        return self.lines[0][0]


_ROLES = {role.value: role for role in Role} | {
    **dict.fromkeys(("include", "keep in", "keepin", "stay in"), Role.INCLUSION),
    **dict.fromkeys(
        ("exclude", "excluded", "keep out", "keepout", "stay out", "no go", "nogo", "forbidden", "obstacle"),
        Role.EXCLUSION,
    ),
    **dict.fromkeys(("mission", "path"), Role.ROUTE),
    "mission item": Role.WAYPOINT,
    "rally": Role.RALLY_POINT,
    "breach return": Role.RETURN_POINT,
}
_SURE_KEYS = ("role", "fence")
_LIKELY_KEYS = ("fence_type", "zone", "kind", "type")
_TRUE, _FALSE = ("true", "1", "yes"), ("false", "0", "no")
_RADIUS_KEYS = ("radius_m", "radius")
_WHOLE_NAMES = frozenset({Role.HOME, Role.RETURN_POINT})
"""A field called "Home meadow" is no home."""

_ZONES = frozenset({Role.INCLUSION, Role.EXCLUSION})
_POSSIBLE = {
    Shape.POLYGON: _ZONES | {Role.DRAWING},
    Shape.LINE: frozenset({Role.ROUTE, Role.DRAWING}),
    Shape.POINT: frozenset({Role.WAYPOINT, Role.HOME, Role.RALLY_POINT, Role.RETURN_POINT, Role.DRAWING}),
    Shape.NOWHERE: frozenset({Role.WAYPOINT, Role.DRAWING}),
}


def situation_of(features: Iterable[Feature], source: str) -> Situation:
    """Read what features mean.

    Raises
    ------
    MissionFormatError
        A feature means nothing, or what cannot be; says which and what was expected.
    """
    found: dict[Role, list[Feature]] = {role: [] for role in Role}
    zones: list[tuple[Feature, Role | None]] = []
    for feature in features:
        role = _role(feature)
        if feature.shape is Shape.POLYGON or _radius_m(feature) is not None:
            zones += [(feature, role)] * (role is not Role.DRAWING)
        elif role is not None:
            found[role].append(feature)
        elif feature.shape is Shape.LINE:
            found[Role.ROUTE].append(feature)
        elif feature.shape is Shape.POINT:
            raise feature.error(
                "a point of which is not said what it is; expected a radius (metres) and a role of inclusion or exclusion, "
                'or a role like "waypoint", "home" or "drawing"'
            )
    home = _lone(found[Role.HOME])
    fence = _fence(zones, _lone(found[Role.RETURN_POINT]))
    items = _items(found[Role.WAYPOINT], found[Role.ROUTE])
    rally = tuple(feature.position for feature in found[Role.RALLY_POINT])
    return Situation(
        fence=Known(fence, None, source) if fence != Fence() else None,
        mission=Known(Mission(items, home), None, source) if items else None,
        rally=Known(rally, None, source) if rally else None,
        home=Known(home, None, source) if home else None,
    )


def features_of(situation: Situation) -> tuple[list[Feature], list[Feature]]:
    """Give a situation as features: those of the fence, and all others (mission, home, rally points)."""
    fence = situation.fence.value if situation.fence else Fence()
    zones = [_zone_feature(*pair) for pair in zip(fence.zones, fence.zone_names(), strict=True)]
    if fence.return_point:
        zones.append(_point_feature(Role.RETURN_POINT, fence.return_point))
    mission = situation.mission.value if situation.mission else Mission(())
    home = mission.home or (situation.home.value if situation.home else None)
    others = [_point_feature(Role.HOME, home)] if home else []
    route = tuple(item.position for item in mission.items if item.is_placed)
    if len(route) > 1:
        others.append(_feature(Shape.LINE, (route,), {"role": Role.ROUTE.value}, "route"))
    others += [_item_feature(item, seq) for seq, item in enumerate(mission.items, start=1)]
    rally = situation.rally.value if situation.rally else ()
    others += [_point_feature(Role.RALLY_POINT, point) for point in rally]
    return zones, others


def _role(feature: Feature) -> Role | None:
    """Tell what a feature is: what its properties say, else its name, else its folders."""
    possible = _POSSIBLE[feature.shape]
    if feature.shape is Shape.POINT and _radius_m(feature) is not None:
        possible = _ZONES | {Role.DRAWING}
    said = _said_roles(feature)
    if len(said) > 1:
        raise feature.error(f"said to be {' and '.join(sorted(said))} at once")
    role = next(iter(said), None) or _named_role(feature, possible | _ZONES)
    if role is not None and role not in possible:
        reason = "; a circle is a point with a radius (metres)" if feature.shape is Shape.POINT else ""
        expected = ", ".join(sorted(possible))
        raise feature.error(f"a {feature.shape} cannot be {role!s}{reason}; expected {expected}")
    return role


def _said_roles(feature: Feature) -> set[Role]:
    roles = set()
    for key, value in feature.properties.items():
        word, lower = _plain(str(value)), key.lower()
        if value is None or not word:
            continue
        if lower in _SURE_KEYS or (lower in _LIKELY_KEYS and word in _ROLES):
            if word not in _ROLES:
                raise feature.error(f"{key} {value!r}; expected one of {', '.join(Role)}")
            roles.add(_ROLES[word])
        elif lower in ("inclusion", "exclusion"):
            if word not in _TRUE + _FALSE:
                raise feature.error(f"{key} {value!r}; expected true or false")
            roles.add(Role.INCLUSION if (lower == "inclusion") == (word in _TRUE) else Role.EXCLUSION)
    return roles


def _named_role(feature: Feature, possible: Iterable[Role]) -> Role | None:
    """Find words that tell a role in the names; the innermost name that has one counts."""
    for name in map(_plain, feature.names):
        roles = {
            role
            for word, role in _ROLES.items()
            if role in possible and role is not Role.DRAWING  # what is left out must be said to be
            if (name == word if role in _WHOLE_NAMES else re.search(rf"(?<![a-z]){word}s?(?![a-z])", name))
        }
        if len(roles) > 1:
            raise feature.error(
                f"the name {name!r} tells of {' and '.join(sorted(roles))}; expected one of them"
            )
        if roles:
            return roles.pop()
    return None


def _plain(word: str) -> str:
    return re.sub(r"[\s_-]+", " ", word.strip().lower())


def _lone(features: Sequence[Feature]) -> LatLon | None:
    if len(features) > 1:
        raise features[1].error(f"a second {_role(features[1])}; expected one at most")
    return features[0].position if features else None


def _fence(zones: Sequence[tuple[Feature, Role | None]], return_point: LatLon | None) -> Fence:
    read: list[Zone] = []
    for feature, said in zones:
        if said is None and len(zones) > 1:
            raise feature.error(
                'of several zones each must say what it is; expected a role (or "fence") of inclusion or exclusion'
            )
        kind = ZoneKind.EXCLUSION if said is Role.EXCLUSION else ZoneKind.INCLUSION
        radius_m = _radius_m(feature)
        if radius_m is not None and feature.shape is Shape.POINT:
            read.append(CircleZone(kind, feature.position, radius_m))
        else:
            read += _polygons(feature, kind)
    return Fence(tuple(read), return_point)


def _polygons(feature: Feature, kind: ZoneKind) -> list[Zone]:
    """Give the zone of a polygon, and an exclusion for every hole of an inclusion."""
    outer, *holes = feature.lines
    if holes and kind is ZoneKind.EXCLUSION:
        raise feature.error(
            "an exclusion with a hole; expected one without: a fence has no ground inside an exclusion"
        )
    for ring in feature.lines:
        if len(ring) < 3:
            raise feature.error(f"a ring of {len(ring)} vertices; a polygon needs at least 3")
    return [PolygonZone(kind, outer), *(PolygonZone(ZoneKind.EXCLUSION, hole) for hole in holes)]


def _items(waypoints: Sequence[Feature], routes: Sequence[Feature]) -> tuple[MissionItem, ...]:
    """Give the mission's items: those said one by one, else the places along the one line."""
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
        seq = _whole(feature, "seq", 0)
        if seq in by_seq:
            raise feature.error(f"a second item of seq {seq}")
        by_seq[seq] = feature
    return [by_seq[seq] for seq in sorted(by_seq)]


def _item(feature: Feature) -> MissionItem:
    command = _whole(feature, "command", Command.NAV_WAYPOINT)
    if feature.shape is Shape.POINT:
        lat_e7, lon_e7 = to_e7(feature.position)
    else:
        try:
            lat_e7, lon_e7 = place_e7(
                command, _number(feature, "param5", 0.0), _number(feature, "param6", 0.0)
            )
        except InvalidPositionError as error:
            raise feature.error(str(error)) from None
    params = [_param(feature, f"param{i}") for i in range(1, 5)]
    return MissionItem(
        command,
        _whole(feature, "frame", CoordinateFrame.GLOBAL_RELATIVE_ALT),
        (params[0], params[1], params[2], params[3]),
        lat_e7,
        lon_e7,
        _number(feature, "altitude_m", 0.0),
        autocontinue=bool(_whole(feature, "autocontinue", 1)),
    )


def _param(feature: Feature, key: str) -> float:
    """Give a parameter; null is MAVLink's "not a number"."""
    null = key in feature.properties and feature.properties[key] is None
    return math.nan if null else _number(feature, key, 0.0)


def _radius_m(feature: Feature) -> float | None:
    """Give a circle's radius; None where none is said."""
    if feature.shape is not Shape.POINT:
        return None
    said = (key for key in feature.properties if key.lower() in _RADIUS_KEYS)
    key = next((key for key in said if feature.properties[key] not in (None, "")), None)
    if key is None:
        return None
    radius_m = _number(feature, key, math.nan)
    if not (math.isfinite(radius_m) and radius_m > 0):
        raise feature.error(f"{key} {radius_m:g}; a circle's radius must be positive")
    return radius_m


def _number(feature: Feature, key: str, default: float) -> float:
    value = feature.properties.get(key)
    try:
        return default if value is None else number(str(int(value) if isinstance(value, bool) else value))
    except ValueError:
        raise feature.error(f"{key} {value!r}; expected a number") from None


def _whole(feature: Feature, key: str, default: int) -> int:
    try:
        return whole(_number(feature, key, default), key, 65535)
    except ValueError as error:
        raise feature.error(str(error)) from None


def _feature(
    shape: Shape, lines: tuple[tuple[LatLon, ...], ...], properties: dict[str, object], name: str
) -> Feature:
    return Feature(shape, lines, properties, (name,))


def _point_feature(role: Role, position: LatLon) -> Feature:
    return _feature(Shape.POINT, ((position,),), {"role": role.value}, role.value)


def _zone_feature(zone: Zone, name: str) -> Feature:
    if isinstance(zone, PolygonZone):
        return _feature(Shape.POLYGON, (zone.vertices,), {"role": zone.kind.value}, name)
    return _feature(
        Shape.POINT, ((zone.centre,),), {"role": zone.kind.value, "radius_m": zone.radius_m}, name
    )


def _item_feature(item: MissionItem, seq: int) -> Feature:
    properties: dict[str, object] = {
        "role": Role.WAYPOINT.value,
        "seq": seq,
        "command": int(item.command),
        "frame": file_frame(item.frame),
        **{f"param{i}": value for i, value in enumerate(item.params, start=1)},
        "altitude_m": item.alt_m,
        "autocontinue": int(item.autocontinue),
    }
    if item.is_placed:
        return _feature(Shape.POINT, ((item.position,),), properties, f"waypoint {seq}")
    properties |= {"param5": item.lat_e7 / 1e7, "param6": item.lon_e7 / 1e7}
    return _feature(Shape.NOWHERE, (), properties, f"mission item {seq}")
