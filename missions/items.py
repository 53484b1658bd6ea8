"""Mission items: what missions, fences and rally lists are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from missions.geo import LatLon, from_e7, to_e7


class Command(IntEnum):
    """MAV_CMD, the ones this project reads or writes."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_GUIDED_ENABLE = 92
    NAV_DELAY = 93
    NAV_LAST = 95
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    DO_SET_MODE = 176
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_REPOSITION = 192
    DO_SET_REVERSE = 194
    DO_FENCE_ENABLE = 207
    NAV_SET_YAW_SPEED = 213
    DO_SET_MISSION_CURRENT = 224
    MISSION_START = 300
    JUMP_TAG = 600
    DO_JUMP_TAG = 601
    COMPONENT_ARM_DISARM = 400
    GET_HOME_POSITION = 410
    REQUEST_MESSAGE = 512
    SET_MESSAGE_INTERVAL = 511
    REQUEST_AUTOPILOT_CAPABILITIES = 520
    FENCE_RETURN_POINT = 5000
    FENCE_POLYGON_VERTEX_INCLUSION = 5001
    FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    FENCE_CIRCLE_INCLUSION = 5003
    FENCE_CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100


class CoordinateFrame(IntEnum):
    """MAV_FRAME, the ones this project reads or writes."""

    GLOBAL = 0
    LOCAL_NED = 1
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    GLOBAL_TERRAIN_ALT = 10
    GLOBAL_TERRAIN_ALT_INT = 11


PLACED_COMMANDS = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TURNS,
        Command.NAV_LOITER_TIME,
    }
)
"""Navigation commands that send a rover to a place."""

_FRAMES_WITHOUT_PLACES = frozenset({CoordinateFrame.LOCAL_NED, CoordinateFrame.MISSION})


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item as MISSION_ITEM_INT carries it; its seq is its place in the list.

    Parameters
    ----------
    command : int
        MAV_CMD.
    frame : int
        MAV_FRAME.
    params : tuple of float
        ``param1`` to ``param4``.
    lat_e7, lon_e7 : int
        The place in degE7; for commands without one, MAVLink's params 5 and 6.
    alt_m : float
        MAVLink's ``z``.
    """

    command: int
    frame: int = CoordinateFrame.GLOBAL_RELATIVE_ALT_INT
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lat_e7: int = 0
    lon_e7: int = 0
    alt_m: float = 0.0
    current: bool = False
    autocontinue: bool = True

    @property
    def position(self) -> LatLon:
        """The place as degrees."""
        return from_e7(self.lat_e7, self.lon_e7)

    @property
    def is_placed(self) -> bool:
        """Whether the item sends a rover to a place on Earth; (0, 0) means "here" in MAVLink, so it does not."""
        return (
            self.command in PLACED_COMMANDS
            and self.frame not in _FRAMES_WITHOUT_PLACES
            and (self.lat_e7, self.lon_e7) != (0, 0)
            and abs(self.lat_e7) <= 900_000_000
            and abs(self.lon_e7) <= 1_800_000_000
        )


def waypoint(position: LatLon) -> MissionItem:
    """Return a NAV_WAYPOINT at a position, altitude 0 above home."""
    lat_e7, lon_e7 = to_e7(position)
    return MissionItem(Command.NAV_WAYPOINT, lat_e7=lat_e7, lon_e7=lon_e7)


def change_speed(speed_mps: float) -> MissionItem:
    """Return a DO_CHANGE_SPEED of the ground speed (param1 1), throttle unchanged (param3 -1)."""
    return MissionItem(Command.DO_CHANGE_SPEED, CoordinateFrame.MISSION, params=(1.0, speed_mps, -1.0, 0.0))


def jump_tag(number: int) -> MissionItem:
    """Return a JUMP_TAG: a mark in a mission, which the autopilot passes over."""
    return MissionItem(Command.JUMP_TAG, CoordinateFrame.MISSION, params=(float(number), 0.0, 0.0, 0.0))


def with_home(items: Sequence[MissionItem], home: LatLon) -> tuple[MissionItem, ...]:
    """Put the home item at seq 0, where ArduPilot keeps its own home (what is sent there is not stored)."""
    lat_e7, lon_e7 = to_e7(home)
    return (
        MissionItem(Command.NAV_WAYPOINT, CoordinateFrame.GLOBAL, lat_e7=lat_e7, lon_e7=lon_e7, current=True),
        *items,
    )


def without_home(items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return a list as ArduPilot holds it without its home item."""
    return tuple(items[1:])


def file_frame(frame: int) -> int:
    """Return a MAV_FRAME as files name it: ground stations write no ``_INT`` frames."""
    return _FILE_FRAMES.get(frame, frame)


_FILE_FRAMES: dict[int, int] = {
    CoordinateFrame.GLOBAL_INT: CoordinateFrame.GLOBAL,
    CoordinateFrame.GLOBAL_RELATIVE_ALT_INT: CoordinateFrame.GLOBAL_RELATIVE_ALT,
    CoordinateFrame.GLOBAL_TERRAIN_ALT_INT: CoordinateFrame.GLOBAL_TERRAIN_ALT,
}


def last_place(items: Sequence[MissionItem]) -> LatLon | None:
    """Return the place of the last navigation item, None without one."""
    return next((item.position for item in reversed(items) if item.is_placed), None)
