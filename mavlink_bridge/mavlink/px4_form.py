"""What PX4 makes of a list when it stores it, and what it wants to be sent.

Measured on v1.17.0 and on the line of 1.18; what is kept of NAV_LOITER_TIME, NAV_LOITER_TO_ALT, NAV_LAND and NAV_TAKEOFF is read from the source of
1.17. Items with a place come back in frames 5 and 6, all others in frame 2 (MISSION), where x and y are kept as floats of 32 bits. Unused parameters are
dropped of items with a place and kept of the others, so they are sent as 0: PX4 1.18 refuses a list with any other number there.
"""

from __future__ import annotations

import csv
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.stored_form import KEEPERS, StoredForm, StoredItem
from missions.items import Command, CoordinateFrame, MissionItem

_MISSION_FRAME = int(CoordinateFrame.MISSION)
_FRAMES = {
    int(CoordinateFrame.GLOBAL): int(CoordinateFrame.GLOBAL_INT),
    int(CoordinateFrame.GLOBAL_RELATIVE_ALT): int(CoordinateFrame.GLOBAL_RELATIVE_ALT_INT),
}
_INT32_MIN, _INT32_MAX = -(2**31), 2**31 - 1
_UNSET = frozenset({0, _INT32_MIN, _INT32_MAX})
"""Numbers of x and y that mean "not used"."""

_POLYGON_VERTICES = (Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION)
_CIRCLES = (Command.FENCE_CIRCLE_INCLUSION, Command.FENCE_CIRCLE_EXCLUSION)
_float32 = KEEPERS["float32"]


@dataclass(frozen=True, slots=True)
class _Stored:
    """A mission command's row of ``px4_commands.csv``."""

    keeps: tuple[str, ...]
    may_be_set: frozenset[str]
    has_place: bool


@cache
def px4_commands() -> dict[int, _Stored]:
    """Return the mission commands that are known of PX4: what it keeps of their parameters, which of them 1.18 lets be set, and whether they have a place."""
    path = Path(__file__).with_name("px4_commands.csv")
    with path.open(encoding="ascii", newline="") as file:
        return {
            int(row["command"]): _Stored(
                tuple(row[f"keeps{number}"] or "dropped" for number in range(1, 5)),
                frozenset(row["may_be_set"].split()),
                bool(row["has_place"]),
            )
            for row in csv.DictReader(file)
        }


def sent_e7(value: int) -> int:
    """Return what comes back of an x or y of frame 2, which is kept as a float of 32 bits: INT32_MAX as INT32_MIN."""
    kept = struct.unpack("<f", struct.pack("<f", float(value)))[0]
    return _INT32_MIN if kept > _INT32_MAX else int(kept)


def _sendable(item: MissionItem, mission_type: MissionType) -> MissionItem:
    """Return an item with 0 wherever PX4 uses nothing: 1.18 refuses other numbers there. NaN is another way to say "nothing", and stays."""
    command = int(item.command)
    if mission_type is MissionType.FENCE:
        if command == Command.FENCE_RETURN_POINT:
            return _with_unused(item, frozenset("xyz"))
        return replace(_with_unused(item, frozenset("1xy")), alt_m=0.0)
    if mission_type is MissionType.RALLY:
        return _with_unused(item, frozenset("xyz"))
    known = px4_commands().get(command)
    if known is None:
        return item
    # NaN as a whole number is undefined, and so is what would be stored.
    one, two, three, four = (
        0.0 if keep == "whole" and math.isnan(value) else value
        for keep, value in zip(known.keeps, item.params, strict=True)
    )
    item = replace(item, params=(one, two, three, four))
    if known.has_place:
        return _with_unused(item, known.may_be_set | frozenset("xy"))
    return replace(_with_unused(item, known.may_be_set), frame=_MISSION_FRAME)


def _with_unused(item: MissionItem, used: frozenset[str]) -> MissionItem:
    one, two, three, four = (
        value if str(number) in used or math.isnan(value) else 0.0
        for number, value in enumerate(item.params, 1)
    )
    return replace(
        item,
        params=(one, two, three, four),
        lat_e7=item.lat_e7 if "x" in used or item.lat_e7 in _UNSET else 0,
        lon_e7=item.lon_e7 if "y" in used or item.lon_e7 in _UNSET else 0,
        alt_m=item.alt_m if "z" in used or math.isnan(item.alt_m) else 0.0,
    )


def _arranged(items: Sequence[MissionItem], mission_type: MissionType) -> tuple[MissionItem, ...]:
    """Return a fence with its circles last: PX4 misreads the vertices that follow a circle. In a mission the first item is made the current one.

    Where no item is the current one, PX4 goes on with a new mission at the number at which the old one was.
    """
    if mission_type is MissionType.FENCE:
        return tuple(sorted(items, key=lambda item: item.command in _CIRCLES))
    if mission_type is MissionType.MISSION:
        return tuple(replace(item, current=seq == 0) for seq, item in enumerate(items))
    return tuple(items)


def _stored(item: MissionItem, mission_type: MissionType, renamed: dict[int, int]) -> StoredItem:
    command, frame = int(item.command), _FRAMES.get(int(item.frame), int(item.frame))
    place = (item.lat_e7, item.lon_e7)
    alt = _float32(item.alt_m)
    if mission_type is MissionType.FENCE:
        param1 = None if command == Command.FENCE_RETURN_POINT else _fence_param(item)
        return StoredItem((command, frame, param1, alt), place)
    if mission_type is MissionType.RALLY:
        return StoredItem((command, frame, alt), place)
    known = px4_commands().get(command)
    keeps = known.keeps if known is not None else ("float32",) * 4
    params = tuple(
        None if keep == "yaw" else KEEPERS[keep](value)
        for keep, value in zip(keeps, item.params, strict=True)
    )
    yaws = [value for keep, value in zip(keeps, item.params, strict=True) if keep == "yaw"]
    yaw_deg = yaws[0] if yaws and math.isfinite(yaws[0]) else (math.nan if yaws else 0.0)
    fixed = (renamed.get(command, command), frame, params, alt, item.autocontinue)
    if frame == _MISSION_FRAME:
        return StoredItem(fixed, (sent_e7(item.lat_e7), sent_e7(item.lon_e7)), yaw_deg=yaw_deg)
    return StoredItem(fixed, place, yaw_deg=yaw_deg)


def _fence_param(item: MissionItem) -> object:
    """Return what is kept of a fence item's param1: a vertex's number of vertices is rounded, a circle's radius is a float."""
    value = item.params[0]
    if item.command in _POLYGON_VERTICES and math.isfinite(value):
        return math.floor(value + 0.5)
    return _float32(value)


PX4_1_17_FORM = StoredForm(
    has_home_item=False, stored=partial(_stored, renamed={}), sendable=_sendable, arranged=_arranged
)
PX4_1_18_FORM = StoredForm(
    has_home_item=False,
    stored=partial(_stored, renamed={int(Command.CONDITION_DELAY): int(Command.NAV_DELAY)}),
    sendable=_sendable,
    arranged=_arranged,
)
"""CONDITION_DELAY is kept as NAV_DELAY since 1.18."""
