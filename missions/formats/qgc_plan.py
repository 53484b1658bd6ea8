"""QGroundControl's .plan (JSON): mission version 2, geoFence version 2, rallyPoints version 2; older fences and rally points are passed over."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from missions.errors import InvalidPositionError
from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.formats.json_node import parse_json
from missions.formats.numbers import xy_for_file, xy_from_file
from missions.geo import LatLon
from missions.items import Command, MissionItem, file_frame
from missions.rally import RallyPoint
from missions.situation import Known, MadeFor, Mission, Reading, Situation
from missions.vehicle import GROUND_TYPES, known_ardupilot, known_type

if TYPE_CHECKING:
    from missions.formats.json_node import JsonNode

_TRANSECTS = "TransectStyleComplexItem"
_MOST_ITEMS = 65535  # seq is 16 bits in MAVLink
_FIRMWARES = {3: True, 12: False}
"""firmwareType, which is MAV_AUTOPILOT, and whether it is ArduPilot."""

_ARDUPILOT, _PX4 = _FIRMWARES
_ROVER = 10  # MAV_TYPE_GROUND_ROVER
_ON_THE_GROUND = {None, 0, *GROUND_TYPES}  # not said, generic, or what is planned for
_SPEEDS = ("WP_SPEED", "CRUISE_SPEED", "RA_MISS_VEL_DEF", "RD_MISS_SPD_DEF", "RO_SPEED_LIM")
"""What says how fast a mission is driven, of either autopilot; the first that is above 0 counts."""


def read(text: str, source: str) -> Situation:
    """Read a plan's text.

    Raises
    ------
    MissionFormatError
        With the JSON path and what was expected there.
    """
    node = parse_json(text, source)
    if "fileType" not in node or node["fileType"].value != "Plan":
        raise node.error('expected a QGroundControl plan ("fileType": "Plan")')
    _check_version(node, 1)
    remarks: list[str] = []
    mission = _mission(node["mission"]) if "mission" in node else None
    made_for = _made_for(node, source)
    if mission and mission.items and made_for and made_for.vehicle_type not in _ON_THE_GROUND:
        remarks.append(
            f"{source} is made for vehicle type {made_for.vehicle_type} (vehicleType), not for a rover ({_ROVER}): its mission is read as a rover's"
        )
    fence = _fence(node["geoFence"]) if _is_of_version_2(node, "geoFence", remarks) else None
    rally = _rally(node["rallyPoints"]) if _is_of_version_2(node, "rallyPoints", remarks) else ()
    return Situation(
        fence=Known(fence, None, source) if fence and fence.zones else None,
        mission=Known(mission, None, source) if mission and mission.items else None,
        rally=Known(rally, None, source) if rally else None,
        home=Known(mission.home, None, source) if mission and mission.home else None,
        reading=Reading(remarks=tuple(remarks), made_for=made_for),
    )


def write(situation: Situation) -> str:
    """Return a plan's text with the situation's mission, fence, rally points and home."""
    mission = situation.mission.value if situation.mission else Mission(())
    home = mission.home or (situation.home.value if situation.home else LatLon(0.0, 0.0))
    fence = situation.fence.value if situation.fence else Fence()
    rally = situation.rally.value if situation.rally else ()
    speeds = (situation.parameters.get(name, 0.0) for name in _SPEEDS)
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "PBPP Rover",
        "mission": {
            "version": 2,
            "firmwareType": _PX4 if known_ardupilot(situation) is False else _ARDUPILOT,
            "vehicleType": known_type(situation) or _ROVER,
            "globalPlanAltitudeMode": 1,
            "cruiseSpeed": next((speed for speed in speeds if speed > 0), 2.0),
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
        "rallyPoints": {"version": 2, "points": [[*_pair(point.position), point.alt_m] for point in rally]},
    }
    return json.dumps(document, indent=4) + "\n"


def _made_for(node: JsonNode, source: str) -> MadeFor | None:
    """Return which vehicle a plan is made for; None where it does not say it."""
    if "mission" not in node:
        return None
    mission = node["mission"]
    firmware, vehicle = (
        mission[key].whole(f"the {key}", 255) if key in mission and mission[key].value is not None else None
        for key in ("firmwareType", "vehicleType")
    )
    if firmware is None and vehicle is None:
        return None
    return MadeFor(source, None if firmware is None else _FIRMWARES.get(firmware), vehicle)


def _check_version(node: JsonNode, expected: int) -> None:
    if "version" in node and node["version"].value != expected:
        raise node["version"].error(f"version {node['version'].value!r}; expected {expected}")


def _is_of_version_2(plan: JsonNode, key: str, remarks: list[str]) -> bool:
    """Return whether a part of a plan is there; an empty one, and one of version 1, is passed over as QGroundControl does."""
    if key not in plan or plan[key].value is None:
        return False
    node = plan[key]
    if not isinstance(node.value, dict):
        raise node.error("expected an object")
    if node.value == {} or node.value.get("version") == 1:
        what = "is empty" if node.value == {} else "has version 1, which QGroundControl does not read either"
        remarks.append(f"{node.source}: {key} {what}: skipped")
        return False
    if (key == "geoFence" or "version" in node) and node["version"].value != 2:
        raise node["version"].error(f"{key} version {node['version'].value!r}; expected 2")
    return True


def _rally(node: JsonNode) -> tuple[RallyPoint, ...]:
    return tuple(map(_rally_point, _members(node, "points")))


def _members(node: JsonNode, key: str) -> list[JsonNode]:
    """Return the members of a list that may be missing."""
    return node[key].members() if key in node and node[key].value is not None else []


def _rally_point(node: JsonNode) -> RallyPoint:
    position = node.lat_lon()
    if len(node.value) < 3 or node[2].value is None:
        return RallyPoint(*position)
    alt_m = node[2].number()
    if not math.isfinite(alt_m):
        raise node[2].error(f"altitude {alt_m}; expected a number of metres")
    return RallyPoint(*position, alt_m)


def _mission(node: JsonNode) -> Mission:
    _check_version(node, 2)
    nodes = [simple for item in node["items"].members() for simple in _simple_items(item)]
    seq_of_id = _seq_of_id(nodes)
    items = tuple(_jump_by_seq(item, _item(item), seq_of_id) for item in nodes)
    home = node["plannedHomePosition"].lat_lon() if "plannedHomePosition" in node else None
    return Mission(items, home if home != (0.0, 0.0) else None)


def _simple_items(node: JsonNode) -> list[JsonNode]:
    """Return a simple item itself, or the simple items that a survey or a corridor scan stands for."""
    if node["type"].value == "SimpleItem":
        return [node]
    if _TRANSECTS in node and "Items" in node[_TRANSECTS]:
        return node[_TRANSECTS]["Items"].members()
    kind = node["complexItemType"].value if "complexItemType" in node else node["type"].value
    raise node["type"].error(
        f"pattern {kind!r}, which QGroundControl saves without its items; supported: simple items, surveys and corridor scans",
        advice="delete the pattern, or upload the plan from QGroundControl and download the mission from the vehicle (pbpp download mission)",
    )


def _seq_of_id(nodes: list[JsonNode]) -> dict[int, int | None]:
    """Return the seq of each item by its doJumpId; None where two items have the same."""
    seqs: dict[int, int | None] = {}
    for seq, node in enumerate(nodes, start=1):
        if "doJumpId" in node:
            jump_id = node["doJumpId"].whole("doJumpId", _MOST_ITEMS)
            seqs[jump_id] = None if jump_id in seqs else seq
    return seqs


def _jump_by_seq(node: JsonNode, item: MissionItem, seq_of_id: dict[int, int | None]) -> MissionItem:
    """Let a DO_JUMP name its goal by seq, as on the wire: a plan names it by doJumpId."""
    if item.command != Command.DO_JUMP:
        return item
    jump_id = node["params"][0].whole("the doJumpId to jump to", _MOST_ITEMS)
    seq = seq_of_id.get(jump_id)
    if seq is None:
        raise node["params"][0].error(
            f"expected the doJumpId of exactly one item; {jump_id} belongs to none or several"
        )
    return replace(item, params=(float(seq), *item.params[1:]))


def _item(node: JsonNode) -> MissionItem:
    params = node["params"].members()
    if "coordinate" in node:  # as QGroundControl wrote items in 2016 and still reads them
        params += node["coordinate"].members()
    if len(params) != 7:
        raise node["params"].error(f"{len(params)} params; expected 7")
    values = [math.nan if param.value is None else param.number() for param in params]
    command = node["command"].whole("command", 65535)
    frame = node["frame"].whole("frame", 255)
    param5, param6 = (0.0 if math.isnan(value) else value for value in values[4:6])
    try:
        lat_e7, lon_e7 = xy_from_file(command, frame, param5, param6)
    except InvalidPositionError as error:
        raise node["params"].error(str(error)) from None
    return MissionItem(
        command,
        frame,
        (values[0], values[1], values[2], values[3]),
        lat_e7,
        lon_e7,
        0.0 if math.isnan(values[6]) else values[6],
        autocontinue=bool(node["autoContinue"].value) if "autoContinue" in node else True,
    )


def _fence(node: JsonNode) -> Fence:
    zones: list[Zone] = [_polygon(polygon) for polygon in _members(node, "polygons")]
    zones += [_circle(circle) for circle in _members(node, "circles")]
    has_return_point = "breachReturn" in node and node["breachReturn"].value is not None
    return Fence(tuple(zones), node["breachReturn"].lat_lon() if has_return_point else None)


def _polygon(node: JsonNode) -> PolygonZone:
    vertices = tuple(vertex.lat_lon() for vertex in node["polygon"].members())
    if len(vertices) < 3:
        raise node["polygon"].error(f"{len(vertices)} vertices; a polygon needs at least 3")
    return PolygonZone(_kind(node), vertices)


def _circle(node: JsonNode) -> CircleZone:
    circle = node["circle"]
    radius_m = circle["radius"].number()
    if not (math.isfinite(radius_m) and radius_m > 0):
        raise circle["radius"].error(f"{radius_m:g}; a circle's radius must be positive")
    return CircleZone(_kind(node), circle["center"].lat_lon(), radius_m)


def _kind(node: JsonNode) -> ZoneKind:
    if not isinstance(node["inclusion"].value, bool):
        raise node["inclusion"].error("expected true or false")
    return ZoneKind.INCLUSION if node["inclusion"].value else ZoneKind.EXCLUSION


def _pair(position: LatLon) -> list[float]:
    return [round(position.lat_deg, 9), round(position.lon_deg, 9)]


def _item_json(item: MissionItem, number: int) -> dict[str, Any]:
    values = (*item.params, *xy_for_file(item), item.alt_m)
    params = [value if math.isfinite(value) else None for value in values]
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
