"""The three lists that PX4 keeps, each replaced as a whole with the last item of an upload; what it refuses, and what reads back.

Written from the measured rows alone (docs/px4.md), apart from what the protocol machines know of PX4: it is their second opinion.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from missions.items import Command, CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from collections.abc import Sequence

LIMITS = {MissionType.MISSION: 10_000, MissionType.FENCE: 64, MissionType.RALLY: 32}
"""Items of each list; of missions those of PX4's own simulator."""

_ABSOLUTE = (CoordinateFrame.GLOBAL, CoordinateFrame.GLOBAL_INT)
_RELATIVE = (CoordinateFrame.GLOBAL_RELATIVE_ALT, CoordinateFrame.GLOBAL_RELATIVE_ALT_INT)
_GLOBAL = (*_ABSOLUTE, *_RELATIVE)
_VERTICES = (Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION)
_CIRCLES = (Command.FENCE_CIRCLE_INCLUSION, Command.FENCE_CIRCLE_EXCLUSION)
_FENCE = (*_VERTICES, *_CIRCLES, Command.FENCE_RETURN_POINT)
_PLACED = (
    Command.NAV_WAYPOINT,
    Command.NAV_LOITER_UNLIM,
    Command.NAV_LOITER_TIME,
    Command.NAV_LAND,
    Command.NAV_TAKEOFF,
    31,  # NAV_LOITER_TO_ALT
)
_DO_LAND_START = 189
_PLAIN = (
    Command.NAV_RETURN_TO_LAUNCH,
    Command.NAV_DELAY,
    Command.CONDITION_DELAY,
    Command.DO_JUMP,
    Command.DO_CHANGE_SPEED,
    Command.DO_SET_HOME,
    _DO_LAND_START,
)
_UNSET_XY = (0, 2**31 - 1, -(2**31))

_REFUSED_1_18: dict[int, str] = {
    Command.NAV_WAYPOINT: "3",
    Command.NAV_LAND: "3",
    31: "3",
    Command.NAV_LOITER_UNLIM: "12",
    Command.NAV_TAKEOFF: "123",
    Command.NAV_DELAY: "567",
    Command.CONDITION_DELAY: "234567",
    Command.DO_JUMP: "34567",
    Command.DO_CHANGE_SPEED: "4567",
    Command.NAV_RETURN_TO_LAUNCH: "1234567",
    _DO_LAND_START: "1234",
    Command.FENCE_POLYGON_VERTEX_INCLUSION: "2347",
    Command.FENCE_POLYGON_VERTEX_EXCLUSION: "2347",
    Command.FENCE_CIRCLE_INCLUSION: "2347",
    Command.FENCE_CIRCLE_EXCLUSION: "2347",
    Command.FENCE_RETURN_POINT: "1234",
    Command.RALLY_POINT: "1234",
}
"""Which parameters have to be 0 or NaN, 5 to 7 being x, y and z; measured one by one."""

_PARAM_RESULTS = (
    MissionResult.INVALID_PARAM1,
    MissionResult.INVALID_PARAM2,
    MissionResult.INVALID_PARAM3,
    MissionResult.INVALID_PARAM4,
    MissionResult.INVALID_PARAM5_X,
    MissionResult.INVALID_PARAM6_Y,
    MissionResult.INVALID_PARAM7,
)


class Px4List:
    """One list and the upload that may replace it.

    Parameters
    ----------
    mission_type : MissionType
        Which list.
    checks_unused : bool
        Whether unused parameters must be 0 or NaN, as from 1.18 on.

    Attributes
    ----------
    items : tuple of MissionItem
        What it holds, as it reads back.
    current : int, optional
        The item of the newest list that was marked as the current one.
    changes : int
        How often it was replaced: the same list uploaded again replaces nothing.
    """

    def __init__(self, mission_type: MissionType, *, checks_unused: bool) -> None:
        self.mission_type = mission_type
        self.limit = LIMITS[mission_type]
        self.items: tuple[MissionItem, ...] = ()
        self.id = 0
        self.current: int | None = None
        self.changes = 0
        self._checks_unused = checks_unused
        self._incoming: list[MissionItem] = []
        self._incoming_id = 0
        self._incoming_current: int | None = None

    def __len__(self) -> int:
        return len(self.items)

    def read(self, seq: int) -> MissionItem:
        """Return an item as it reads back."""
        return self.items[seq]

    def begin(self) -> None:
        """Begin an upload beside what is held."""
        self._incoming, self._incoming_id, self._incoming_current = [], 0, None

    def take(self, item: MissionItem, *, current: int) -> MissionResult:
        """Take the next item of an upload."""
        result = self._result(item)
        if result is not MissionResult.ACCEPTED:
            return result
        self._incoming_id = zlib.crc32(_as_bytes(item), self._incoming_id)
        if current:
            self._incoming_current = len(self._incoming)
        self._incoming.append(self._kept(item))
        return MissionResult.ACCEPTED

    def finish(self) -> int:
        """Replace what is held by what came, if that is something else; return the new id."""
        if self._incoming_id != self.id:
            self._replace(tuple(self._incoming), self._incoming_id, self._incoming_current)
        return self._incoming_id

    def clear(self) -> None:
        """Hold nothing."""
        self._replace((), 0, None)

    def _replace(self, items: tuple[MissionItem, ...], list_id: int, current: int | None) -> None:
        self.items, self.id, self.current = items, list_id, current
        self.changes += 1

    def _result(self, item: MissionItem) -> MissionResult:
        result = _command_result(item, self.mission_type, checks_unused=self._checks_unused)
        if result is MissionResult.ACCEPTED and self._checks_unused:
            return _unused_result(item)
        return result

    def _kept(self, item: MissionItem) -> MissionItem:
        return kept(item, self.mission_type, delays_as_one=self._checks_unused)


def _command_result(item: MissionItem, mission_type: MissionType, *, checks_unused: bool) -> MissionResult:
    command, frame = item.command, item.frame
    is_list_item = command in _FENCE or command == Command.RALLY_POINT
    if frame not in _GLOBAL and frame != CoordinateFrame.MISSION:
        return MissionResult.UNSUPPORTED_FRAME
    if frame == CoordinateFrame.MISSION:
        plain = _PLAIN if checks_unused else (*_PLAIN, Command.CONDITION_DISTANCE)
        if command not in plain:
            return MissionResult.UNSUPPORTED
    elif command in _PLAIN:
        is_unset = item.lat_e7 in _UNSET_XY[1:] and item.lon_e7 in _UNSET_XY[1:]
        return MissionResult.INVALID_PARAM5_X if checks_unused and not is_unset else MissionResult.UNSUPPORTED
    elif command not in _PLACED and not is_list_item:
        return MissionResult.UNSUPPORTED
    if mission_type is MissionType.MISSION and is_list_item:
        return MissionResult.ERROR
    if mission_type is MissionType.FENCE and command in _VERTICES and not item.params[0] >= 2.5:
        return MissionResult.ERROR  # NaN comes here too
    return MissionResult.ACCEPTED


def _unused_result(item: MissionItem) -> MissionResult:
    values = (*item.params, item.lat_e7, item.lon_e7, item.alt_m)
    for digit in _REFUSED_1_18.get(item.command, ""):
        value = values[int(digit) - 1]
        is_unset = value in _UNSET_XY if digit in "56" else value == 0 or math.isnan(value)
        if not is_unset:
            return _PARAM_RESULTS[int(digit) - 1]
    return MissionResult.ACCEPTED


def kept(item: MissionItem, mission_type: MissionType, *, delays_as_one: bool) -> MissionItem:
    """Return an item as it reads back; ``delays_as_one`` keeps CONDITION_DELAY as NAV_DELAY."""
    params = tuple(_float32(value) for value in item.params)
    z_m = _float32(item.alt_m)
    if item.frame == CoordinateFrame.MISSION:
        command = item.command
        if command == Command.CONDITION_DELAY and delays_as_one:
            command = Command.NAV_DELAY
        if command == Command.DO_JUMP:
            params = (*map(_whole, params[:2]), *params[2:])
        return replace(
            item,
            command=command,
            params=_four(params),
            lat_e7=_through_float(item.lat_e7),
            lon_e7=_through_float(item.lon_e7),
            alt_m=z_m,
            current=False,
        )
    frame = CoordinateFrame.GLOBAL_INT if item.frame in _ABSOLUTE else CoordinateFrame.GLOBAL_RELATIVE_ALT_INT
    if mission_type is MissionType.MISSION:
        params = _kept_of_placed(item.command, _four(params))
    elif item.command in _VERTICES:
        params = (float(int(params[0] + 0.5)), 0.0, 0.0, 0.0)
    else:
        params = (params[0] if item.command in _CIRCLES else 0.0, 0.0, 0.0, 0.0)
    auto = item.autocontinue if mission_type is not MissionType.FENCE else False
    return replace(item, frame=frame, params=_four(params), alt_m=z_m, current=False, autocontinue=auto)


def _kept_of_placed(
    command: int, params: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Return what a command with a place keeps: waypoints as measured, the others as read in PX4's source."""
    one, two, three, four = params
    match command:
        case Command.NAV_WAYPOINT:
            return one, two, 0.0, _through_radians(four)
        case Command.NAV_LOITER_UNLIM:
            return 0.0, 0.0, three, _through_radians(four)
        case Command.NAV_LOITER_TIME:
            return one, float(two > 0), three, float(four > 0)
        case Command.NAV_LAND:
            return 0.0, _whole(two), 0.0, _through_radians(four)
        case Command.NAV_TAKEOFF:
            return 0.0, 0.0, 0.0, _through_radians(four)
        case _:
            return float(one > 0), two, 0.0, float(four > 0)


def _four(values: Sequence[float]) -> tuple[float, float, float, float]:
    one, two, three, four = values
    return one, two, three, four


def _float32(value: float) -> float:
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _whole(value: float) -> float:
    return float(math.trunc(value)) if math.isfinite(value) else 0.0


def _through_radians(deg: float) -> float:
    if not math.isfinite(deg):
        return math.nan
    rad = _float32(_float32(math.radians(deg)) % _float32(math.tau))
    return _float32(math.degrees(rad))


def _through_float(value: int) -> int:
    as_float = _float32(float(value))
    return -(2**31) if as_float >= 2.0**31 else int(as_float)


def _as_bytes(item: MissionItem) -> bytes:
    numbers = (*map(_float32, item.params), _float32(item.alt_m))
    return struct.pack(
        "<BHB5fii", item.frame, item.command, item.autocontinue, *numbers, item.lat_e7, item.lon_e7
    )
