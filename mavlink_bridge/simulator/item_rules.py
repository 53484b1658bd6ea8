"""Which mission items ArduRover takes, and the form in which it keeps them."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_bridge.mavlink.messages import MissionResult
from mavlink_bridge.mavlink.stored_form import STORED_WITH_PLACE
from mavlink_bridge.simulator.parameters import float32
from mavlink_bridge.simulator.stored_commands import KEPT, NAN_ALLOWED, kept_beyond_params, uint8
from missions.items import Command, CoordinateFrame, MissionItem

MAX_ALT_M = 83_000.0
"""Beyond it ArduPilot's Location cannot hold an altitude."""

_RELATIVE_FRAMES = (CoordinateFrame.GLOBAL_RELATIVE_ALT, CoordinateFrame.GLOBAL_RELATIVE_ALT_INT)
_ABSOLUTE_FRAMES = (CoordinateFrame.GLOBAL, CoordinateFrame.GLOBAL_INT, CoordinateFrame.MISSION)
_TERRAIN_FRAMES = (CoordinateFrame.GLOBAL_TERRAIN_ALT, CoordinateFrame.GLOBAL_TERRAIN_ALT_INT)
_FENCE_FRAMES = (*_RELATIVE_FRAMES, *_TERRAIN_FRAMES, CoordinateFrame.GLOBAL, CoordinateFrame.GLOBAL_INT)
_FENCE_VERTICES = (Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION)
_FENCE_CIRCLES = (Command.FENCE_CIRCLE_INCLUSION, Command.FENCE_CIRCLE_EXCLUSION)
_STORED_AS: dict[int, int] = {
    Command.FENCE_POLYGON_VERTEX_INCLUSION: 98,
    Command.FENCE_POLYGON_VERTEX_EXCLUSION: 97,
    Command.FENCE_RETURN_POINT: 95,
    Command.FENCE_CIRCLE_EXCLUSION: 93,
    Command.FENCE_CIRCLE_INCLUSION: 92,
}
"""The numbers by which ArduPilot's texts name fence items (AC_PolyFence_loader; not measured)."""

_RESERVED = (0, 1)
"""ArduPilot marks 16-bit command numbers in its storage with them."""

_RESULT_OF_PARAM = (
    MissionResult.INVALID_PARAM1,
    MissionResult.INVALID_PARAM2,
    MissionResult.INVALID_PARAM3,
    MissionResult.INVALID_PARAM4,
)


def mission_item_result(item: MissionItem, count: int) -> MissionResult:
    """Return whether a mission item is taken into a list that will have ``count`` items, home included."""
    if item.command not in KEPT:
        return MissionResult.INVALID if item.command in _RESERVED else MissionResult.UNSUPPORTED
    for index, param in enumerate(item.params):
        nan_allowed = (item.command, index) in NAN_ALLOWED
        if math.isinf(param) or (math.isnan(param) and not nan_allowed):
            return _RESULT_OF_PARAM[index]
    if item.command == Command.DO_JUMP and not 0 < item.params[0] < count:
        return MissionResult.ERROR
    if item.command in STORED_WITH_PLACE:
        frames = _RELATIVE_FRAMES + _ABSOLUTE_FRAMES + _TERRAIN_FRAMES
        return _place_result(item, MAX_ALT_M, item.frame in frames)
    return MissionResult.ACCEPTED


def kept_mission_item(item: MissionItem) -> MissionItem:
    """Return a mission item as it reads back: frame 3, 0 or 10, altitude in whole centimetres, unused parameters 0."""
    params = KEPT[item.command](item.params)
    if item.command not in STORED_WITH_PLACE:
        return MissionItem(item.command, CoordinateFrame.GLOBAL, params, *kept_beyond_params(item))
    if item.frame in _RELATIVE_FRAMES:
        frame = CoordinateFrame.GLOBAL_RELATIVE_ALT
    elif item.frame in _TERRAIN_FRAMES:
        frame = CoordinateFrame.GLOBAL_TERRAIN_ALT
    else:
        frame = CoordinateFrame.GLOBAL
    alt_m = float32(int(item.alt_m * 100.0) / 100.0)
    return MissionItem(item.command, frame, params, item.lat_e7, item.lon_e7, alt_m)


def fence_item_result(item: MissionItem) -> MissionResult:
    """Return whether a fence item is taken as it comes; the fence as a whole is judged after its last item."""
    if item.frame not in _FENCE_FRAMES:
        return MissionResult.UNSUPPORTED_FRAME
    if item.command in _FENCE_VERTICES:
        return MissionResult.INVALID_PARAM1 if item.params[0] > 255 else MissionResult.ACCEPTED
    if item.command in _FENCE_CIRCLES or item.command == Command.FENCE_RETURN_POINT:
        return MissionResult.ACCEPTED
    return MissionResult.UNSUPPORTED


def kept_fence_item(item: MissionItem) -> MissionItem:
    """Return a fence item as it reads back: frame 0, z 0, only param1."""
    if item.command in _FENCE_VERTICES:
        param1 = float(uint8(item.params[0]))
    else:
        param1 = float32(item.params[0]) if item.command in _FENCE_CIRCLES else 0.0
    return MissionItem(
        item.command,
        CoordinateFrame.GLOBAL,
        (param1, 0.0, 0.0, 0.0),
        item.lat_e7,
        item.lon_e7,
        autocontinue=False,
    )


def fence_problem(items: list[MissionItem]) -> str | None:
    """Return what ArduPilot finds wrong with a fence of kept items, in its words; None for a good one."""
    expected, of_count, of_command = 0, 0, 0
    return_points = 0
    for item in items:
        if item.command in _FENCE_VERTICES:
            count = int(item.params[0])
            if count < 3:
                return f"Invalid vertex count ({count})"
            if expected == 0:
                expected, of_count, of_command = count, count, item.command
            elif item.command != of_command:
                return f"Received incorrect vertex type (want={_STORED_AS[of_command]} got={_STORED_AS[item.command]})"
            elif count != of_count:
                return f"Unexpected vertex count want={of_count} got={count}"
            expected -= 1
        elif expected:
            return f"Received incorrect type (want={_STORED_AS[of_command]} got={_STORED_AS[item.command]})"
        elif item.command in _FENCE_CIRCLES:
            if not item.params[0] > 0:
                return "Non-positive circle radius"
        else:
            return_points += 1
            if return_points > 1:
                return "Multiple return points"
        if not _on_earth(item):
            return "Bad lat or lon"
    return "Incorrect item count" if expected else None


def fence_bytes(items: list[MissionItem]) -> int:
    """Return the storage a good fence needs: 4, 2 + 8 n for a polygon, 13 for a circle, 9 for a return point."""
    size = 4
    left = 0
    for item in items:
        if item.command in _FENCE_VERTICES:
            if left == 0:
                left = int(item.params[0])
                size += 2
            left -= 1
            size += 8
        else:
            size += 13 if item.command in _FENCE_CIRCLES else 9
    return size


def rally_item_result(item: MissionItem) -> MissionResult:
    """Return whether a rally point is taken."""
    if item.command != Command.RALLY_POINT:
        return MissionResult.UNSUPPORTED
    return _place_result(item, 32_767.0, item.frame in _RELATIVE_FRAMES)


def kept_rally_item(item: MissionItem) -> MissionItem:
    """Return a rally point as it reads back: whole metres of altitude."""
    return replace(
        item,
        frame=CoordinateFrame.GLOBAL_RELATIVE_ALT,
        params=(0.0, 0.0, 0.0, 0.0),
        alt_m=float(int(item.alt_m)),
        current=False,
        autocontinue=False,
    )


def _place_result(item: MissionItem, max_alt_m: float, frame_known: bool) -> MissionResult:  # noqa: FBT001
    if abs(item.lat_e7) > 900_000_000:
        return MissionResult.INVALID_PARAM5_X
    if abs(item.lon_e7) > 1_800_000_000:
        return MissionResult.INVALID_PARAM6_Y
    if not abs(item.alt_m) < max_alt_m:  # NaN comes here too
        return MissionResult.INVALID_PARAM7
    return MissionResult.ACCEPTED if frame_known else MissionResult.UNSUPPORTED_FRAME


def _on_earth(item: MissionItem) -> bool:
    return abs(item.lat_e7) <= 900_000_000 and abs(item.lon_e7) <= 1_800_000_000
