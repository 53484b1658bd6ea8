"""From a situation to the features of a GeoJSON or KML file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.fence import Fence, PolygonZone, Zone
from missions.formats.features import Feature, Role, Shape
from missions.formats.numbers import xy_for_file
from missions.items import file_frame
from missions.situation import Mission

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.rally import RallyPoint
    from missions.situation import Situation


def features_of(situation: Situation) -> tuple[list[Feature], list[Feature]]:
    """Return a situation as features: those of the fence, and all others (mission, home, rally points)."""
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
    others += [_rally_feature(point) for point in rally]
    return zones, others


def _feature(
    shape: Shape, lines: tuple[tuple[LatLon, ...], ...], properties: dict[str, object], name: str
) -> Feature:
    return Feature(shape, lines, properties, (name,))


def _point_feature(role: Role, position: LatLon) -> Feature:
    return _feature(Shape.POINT, ((position,),), {"role": role.value}, role.value)


def _rally_feature(point: RallyPoint) -> Feature:
    properties: dict[str, object] = {"role": Role.RALLY_POINT.value, "altitude_m": point.alt_m}
    return _feature(Shape.POINT, ((point.position,),), properties, Role.RALLY_POINT.value)


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
    properties |= dict(zip(("param5", "param6"), xy_for_file(item), strict=True))
    return _feature(Shape.NOWHERE, (), properties, f"mission item {seq}")
