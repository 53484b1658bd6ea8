"""From the features of a map's file (GeoJSON, KML, GPX, CSV, shapefile) to a situation."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from missions.errors import InvalidPositionError, MissionFormatError
from missions.fence import Fence
from missions.formats.bounds import MOST_FEATURES, check_bound
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_roles import foreign_property, role_of
from missions.formats.feature_zones import roles_of_zones, zones_of
from missions.formats.features import Role, Shape, numbered
from missions.formats.numbers import has_place, xy_from_file
from missions.geo import to_e7
from missions.items import Command, CoordinateFrame, MissionItem, waypoint
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Reading, Situation

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from missions.formats.choices import Choices
    from missions.formats.features import Feature
    from missions.geo import LatLon


def situation_of(features: Iterable[Feature], source: str, choices: Choices = NO_CHOICES) -> Situation:
    """Read what features mean.

    Raises
    ------
    MissionFormatError
        A feature of which it is not certain what it is, or that cannot be what it is said to be; the message says which and what settles it.
    """
    found: dict[Role, list[Feature]] = {role: [] for role in Role}
    zones: list[tuple[Feature, Role | None]] = []
    unknown_points = []
    drawn = list(itertools.islice(features, MOST_FEATURES + 1))
    check_bound(len(drawn), MOST_FEATURES, "features", source)
    all_features = numbered(drawn)
    if not all_features:
        raise MissionFormatError(f"{source}: contains no features", file=source)
    choices.check_names(all_features, source)
    remarks = []
    for feature in all_features:
        role = role_of(feature, choices)
        is_zone = feature.shape is Shape.POLYGON or feature.radius_m() is not None
        if is_zone:
            zones += [(feature, role)] * (role is not Role.DRAWING)
        elif role is not None:
            found[role].append(feature)
        elif feature.fallback is not None:
            found[feature.fallback].append(feature)
        elif feature.shape is Shape.LINE:
            found[Role.ROUTE].append(feature)
        elif feature.shape is Shape.TRACK:
            raise feature.error(
                f"{feature} is a recorded track, not a planned route",
                advice=f"to use it as a route: {feature.role_option('route')}",
            )
        elif feature.shape is Shape.POINT:
            unknown_points.append(feature)
        if feature.is_hidden and role is Role.DRAWING and choices.role_for(feature) is None:
            remarks.append(f"{feature.where}: {feature} is hidden (visibility 0): skipped")
        elif (foreign := foreign_property(feature)) and choices.role_for(feature) is None:
            remarks.append(f"{feature.where}: {foreign} of {feature} is not a role: skipped")
    sorted_zones, taken = roles_of_zones(zones, choices, unknown_points)
    fence = Fence(
        tuple(zone for pair in sorted_zones for zone in zones_of(*pair)), _lone(found[Role.RETURN_POINT])
    )
    remarks += taken
    home = _lone(found[Role.HOME])
    items = _items(found[Role.WAYPOINT], found[Role.ROUTE])
    rally = tuple(map(_rally_point, found[Role.RALLY_POINT]))
    return Situation(
        fence=Known(fence, None, source) if fence != Fence() else None,
        mission=Known(Mission(items, home), None, source) if items else None,
        rally=Known(rally, None, source) if rally else None,
        home=Known(home, None, source) if home else None,
        reading=Reading(remarks=tuple(remarks)),
    )


def _rally_point(feature: Feature) -> RallyPoint:
    alt_m = feature.number("altitude_m", 0.0)
    if not math.isfinite(alt_m):
        raise feature.error(f"altitude_m {alt_m}; expected a number of metres")
    return RallyPoint(*feature.position, alt_m)


def _lone(features: Sequence[Feature]) -> LatLon | None:
    if len(features) > 1:
        raise features[1].error(f"a second {role_of(features[1])}; expected one at most")
    return features[0].position if features else None


def _items(waypoints: Sequence[Feature], routes: Sequence[Feature]) -> tuple[MissionItem, ...]:
    """Return the mission's items: those given one by one, else the places along the one line."""
    if waypoints:
        return tuple(map(_item, _in_order(waypoints)))
    if len(routes) > 1:
        raise routes[1].error(
            f"a second line, {routes[1]}; expected one route",
            advice=f"leave it out with {routes[1].role_option('ignore')}",
        )
    return tuple(waypoint(position) for feature in routes for position in feature.lines[0])


def _in_order(waypoints: Sequence[Feature]) -> list[Feature]:
    """Put waypoints into the order of their seq; of the file where one has none."""
    if any(feature.properties.get("seq") is None for feature in waypoints):
        return list(waypoints)
    by_seq: dict[int, Feature] = {}
    for feature in waypoints:
        seq = feature.whole("seq", 0)
        if seq in by_seq:
            raise feature.error(f"seq {seq} is used twice")
        by_seq[seq] = feature
    return [by_seq[seq] for seq in sorted(by_seq)]


def _item(feature: Feature) -> MissionItem:
    command = feature.whole("command", Command.NAV_WAYPOINT)
    frame = feature.whole("frame", CoordinateFrame.GLOBAL_RELATIVE_ALT)
    if feature.shape is Shape.POINT:
        if not has_place(command, frame):
            raise feature.error(f"a point, but command {command} has no position")
        lat_e7, lon_e7 = to_e7(feature.position)
    elif feature.properties.get("command") is None:
        raise feature.error("a waypoint without a position; expected a point, or a command that needs none")
    else:
        try:
            lat_e7, lon_e7 = xy_from_file(
                command, frame, feature.number("param5", 0.0), feature.number("param6", 0.0)
            )
        except InvalidPositionError as error:
            raise feature.error(str(error)) from None
    params = [_param(feature, f"param{i}") for i in range(1, 5)]
    return MissionItem(
        command,
        frame,
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
