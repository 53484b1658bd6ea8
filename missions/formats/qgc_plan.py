"""QGroundControl's .plan (JSON): mission version 2, geoFence version 2, rallyPoints version 2."""

from __future__ import annotations

import json
import math
from typing import Any

from missions.errors import InvalidPositionError, MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.formats.numbers import place_e7, whole
from missions.geo import LatLon, checked_lat_lon
from missions.items import MissionItem, file_frame
from missions.situation import Known, Mission, Situation

_FIRMWARE_ARDUPILOT = 3
_VEHICLE_ROVER = 10


def read(text: str, source: str) -> Situation:
    """Read a plan's text.

    Raises
    ------
    MissionFormatError
        With the JSON path and what was expected there.
    """
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise MissionFormatError(
            f"{source}: line {error.lineno}: not JSON: {error.msg}", file=source
        ) from None
    except (RecursionError, ValueError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else error
        raise MissionFormatError(f"{source}: not JSON: {reason}", file=source) from None
    node = _Node(document, source, "")
    if not isinstance(document, dict) or document.get("fileType") != "Plan":
        raise node.error('expected a QGroundControl plan ("fileType": "Plan")')
    mission = _mission(node["mission"]) if "mission" in document else None
    fence = _fence(node["geoFence"]) if "geoFence" in document else None
    rally = (
        tuple(_position(point) for point in node["rallyPoints"].list("points"))
        if "rallyPoints" in document
        else ()
    )
    return Situation(
        fence=Known(fence, None, source) if fence and fence.zones else None,
        mission=Known(mission, None, source) if mission and mission.items else None,
        rally=Known(rally, None, source) if rally else None,
        home=Known(mission.home, None, source) if mission and mission.home else None,
    )


def write(situation: Situation) -> str:
    """Give a plan's text with the situation's mission, fence, rally points and home."""
    mission = situation.mission.value if situation.mission else Mission(())
    home = mission.home or (situation.home.value if situation.home else LatLon(0.0, 0.0))
    fence = situation.fence.value if situation.fence else Fence()
    rally = situation.rally.value if situation.rally else ()
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "PBPP Rover",
        "mission": {
            "version": 2,
            "firmwareType": _FIRMWARE_ARDUPILOT,
            "vehicleType": _VEHICLE_ROVER,
            "globalPlanAltitudeMode": 1,
            "cruiseSpeed": situation.parameters.get("WP_SPEED")
            or situation.parameters.get("CRUISE_SPEED")
            or 2.0,
            "hoverSpeed": 5,
            "plannedHomePosition": [*_pair(home), 0],
            "items": [_item_json(item, number) for number, item in enumerate(mission.items, start=1)],
        },
        "geoFence": {
            "version": 2,
            "polygons": [_polygon_json(zone) for zone in fence.zones if isinstance(zone, PolygonZone)],
            "circles": [_circle_json(zone) for zone in fence.zones if isinstance(zone, CircleZone)],
            **({"breachReturn": [*_pair(fence.return_point), 0]} if fence.return_point else {}),
        },
        "rallyPoints": {"version": 2, "points": [[*_pair(point), 0] for point in rally]},
    }
    return json.dumps(document, indent=4) + "\n"


class _Node:
    """A JSON value that knows where it stands, so that errors can say it."""

    def __init__(self, value: Any, source: str, where: str) -> None:  # noqa: ANN401 - JSON is anything
        self.value, self.source, self.where = value, source, where

    def error(self, problem: str) -> MissionFormatError:
        where = self.where or "top level"
        return MissionFormatError(f"{self.source}: {where}: {problem}", file=self.source, where=where)

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, dict) and key in self.value

    def __getitem__(self, key: str | int) -> _Node:
        step = f"[{key}]" if isinstance(key, int) else f".{key}" if self.where else key
        where = f"{self.where}{step}"
        try:
            return _Node(self.value[key], self.source, where)
        except (KeyError, IndexError, TypeError):
            raise _Node(None, self.source, where).error("missing") from None

    def list(self, key: str) -> list[_Node]:
        node = self[key]
        if not isinstance(node.value, list):
            raise node.error("expected a list")
        return [node[i] for i in range(len(node.value))]

    def number(self) -> float:
        if isinstance(self.value, bool) or not isinstance(self.value, (int, float)):
            raise self.error("expected a number")
        try:
            return float(self.value)
        except OverflowError:
            raise self.error("expected a number of less than 300 digits") from None

    def whole(self, name: str, most: int) -> int:
        try:
            return whole(self.number(), name, most)
        except ValueError as error:
            raise self.error(str(error)) from None


def _position(node: _Node) -> LatLon:
    if not isinstance(node.value, list) or len(node.value) < 2:
        raise node.error("expected [latitude, longitude]")
    try:
        return checked_lat_lon(node[0].number(), node[1].number())
    except InvalidPositionError as error:
        raise node.error(str(error)) from None


def _mission(node: _Node) -> Mission:
    items = tuple(_item(item) for item in node.list("items"))
    home = _position(node["plannedHomePosition"]) if "plannedHomePosition" in node else None
    return Mission(items, home if home != (0.0, 0.0) else None)


def _item(node: _Node) -> MissionItem:
    if node["type"].value != "SimpleItem":
        raise node["type"].error(f"{node['type'].value!r} items are not supported; only SimpleItem")
    params = node.list("params")
    if len(params) != 7:
        raise node["params"].error(f"{len(params)} params; expected 7")
    values = [math.nan if param.value is None else param.number() for param in params]
    command = node["command"].whole("command", 65535)
    lat_deg, lon_deg = (0.0 if math.isnan(value) else value for value in values[4:6])
    try:
        lat_e7, lon_e7 = place_e7(command, lat_deg, lon_deg)
    except InvalidPositionError as error:
        raise node["params"].error(str(error)) from None
    return MissionItem(
        command,
        node["frame"].whole("frame", 255),
        (values[0], values[1], values[2], values[3]),
        lat_e7,
        lon_e7,
        0.0 if math.isnan(values[6]) else values[6],
        autocontinue=bool(node["autoContinue"].value) if "autoContinue" in node else True,
    )


def _fence(node: _Node) -> Fence:
    if node["version"].value != 2:
        raise node["version"].error(f"geoFence version {node['version'].value!r}; expected 2")
    zones: list[Zone] = [_polygon(polygon) for polygon in node.list("polygons")]
    zones += [_circle(circle) for circle in node.list("circles")]
    return Fence(tuple(zones), _position(node["breachReturn"]) if "breachReturn" in node else None)


def _polygon(node: _Node) -> PolygonZone:
    vertices = tuple(_position(vertex) for vertex in node.list("polygon"))
    if len(vertices) < 3:
        raise node["polygon"].error(f"{len(vertices)} vertices; a polygon needs at least 3")
    return PolygonZone(_kind(node), vertices)


def _circle(node: _Node) -> CircleZone:
    circle = node["circle"]
    radius_m = circle["radius"].number()
    if not (math.isfinite(radius_m) and radius_m > 0):
        raise circle["radius"].error(f"{radius_m:g}; a circle's radius must be positive")
    return CircleZone(_kind(node), _position(circle["center"]), radius_m)


def _kind(node: _Node) -> ZoneKind:
    if not isinstance(node["inclusion"].value, bool):
        raise node["inclusion"].error("expected true or false")
    return ZoneKind.INCLUSION if node["inclusion"].value else ZoneKind.EXCLUSION


def _pair(position: LatLon) -> list[float]:
    return [round(position.lat_deg, 9), round(position.lon_deg, 9)]


def _item_json(item: MissionItem, number: int) -> dict[str, Any]:
    places = [item.lat_e7 / 1e7, item.lon_e7 / 1e7, item.alt_m]
    params = [value if math.isfinite(value) else None for value in (*item.params, *places)]
    return {
        "type": "SimpleItem",
        "autoContinue": item.autocontinue,
        "command": item.command,
        "doJumpId": number,
        "frame": file_frame(item.frame),
        "params": params,
    }


def _polygon_json(zone: PolygonZone) -> dict[str, Any]:
    return {
        "inclusion": zone.kind is ZoneKind.INCLUSION,
        "polygon": [_pair(vertex) for vertex in zone.vertices],
        "version": 1,
    }


def _circle_json(zone: CircleZone) -> dict[str, Any]:
    return {
        "circle": {"center": _pair(zone.centre), "radius": zone.radius_m},
        "inclusion": zone.kind is ZoneKind.INCLUSION,
        "version": 1,
    }
