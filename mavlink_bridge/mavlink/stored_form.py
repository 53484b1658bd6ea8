"""What ArduPilot makes of a list when it stores it, in one place; so that what is read back can be compared with what was sent.

From ArduPilot's ``AP_Mission::mavlink_int_to_mission_cmd`` and from measurement: item 0 of a mission is the vehicle's own home;
frames 5, 6 and 11 read back as 0, 3 and 10; each command keeps some parameters, some of them as whole numbers; altitudes are
stored in whole centimetres; ``current`` and ``autocontinue`` are not stored. A fence keeps ``param1`` and the place, a rally
point the place and whole metres. Positions are degE7 and must be equal to the last digit.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionType
from missions.items import Command, CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_FRAMES = {
    int(CoordinateFrame.MISSION): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_INT): int(CoordinateFrame.GLOBAL),
    int(CoordinateFrame.GLOBAL_RELATIVE_ALT_INT): int(CoordinateFrame.GLOBAL_RELATIVE_ALT),
    int(CoordinateFrame.GLOBAL_TERRAIN_ALT_INT): int(CoordinateFrame.GLOBAL_TERRAIN_ALT),
}

_Stored = float | str | None
_MOST_EXACT_RADIUS_M = 255.0
"""Of circles beyond it ArduPilot keeps tens of metres."""


def _float32(value: float) -> _Stored:
    if math.isnan(value):
        return "nan"
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _whole(value: float) -> _Stored:
    return float(math.trunc(value)) if math.isfinite(value) else str(value)


def _sign(value: float) -> _Stored:
    return -1.0 if value < 0 else 1.0


def _flag(value: float) -> _Stored:
    return 1.0 if value > 0 else 0.0


def _turns(value: float) -> _Stored:
    return math.trunc(value * 256) / 256 if 0 < value < 1 else _whole(value)


def _turn_radius(value: float) -> _Stored:
    if not math.isfinite(value) or abs(value) <= _MOST_EXACT_RADIUS_M:
        return _whole(value)
    return math.copysign(10.0 * math.trunc(min(_MOST_EXACT_RADIUS_M, abs(value) * 0.1)), value)


def _hundredths(value: float) -> _Stored:
    return float(math.trunc(value * 100.0)) if math.isfinite(value) else str(value)


def _odd(value: float) -> _Stored:
    return float(math.trunc(abs(value)) % 2) if math.isfinite(value) else str(value)


def _float16(value: float) -> _Stored:
    if not math.isfinite(value):
        return str(value)
    try:
        return float(struct.unpack("<e", struct.pack("<e", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _dropped(value: float) -> _Stored:  # noqa: ARG001 - one of a family
    return None


_KEEPS_ALL = (_float32, _float32, _float32, _float32)
_KEPT_PARAMS: dict[int, tuple[Callable[[float], _Stored], ...]] = {
    Command.NAV_WAYPOINT: (_whole, _dropped, _dropped, _dropped),
    Command.NAV_LOITER_UNLIM: (_dropped, _dropped, _whole, _dropped),
    Command.NAV_LOITER_TURNS: (_turns, _dropped, _turn_radius, _flag),
    Command.NAV_LOITER_TIME: (_whole, _dropped, _sign, _flag),
    Command.NAV_RETURN_TO_LAUNCH: (_dropped, _dropped, _dropped, _dropped),
    Command.NAV_LAND: (_whole, _dropped, _dropped, _dropped),
    Command.NAV_TAKEOFF: (_whole, _dropped, _dropped, _dropped),
    Command.NAV_GUIDED_ENABLE: (_whole, _dropped, _dropped, _dropped),
    Command.NAV_DELAY: (_float32, _whole, _whole, _whole),
    Command.CONDITION_DELAY: (_float32, _dropped, _dropped, _dropped),
    Command.CONDITION_DISTANCE: (_float32, _dropped, _dropped, _dropped),
    Command.DO_SET_MODE: (_whole, _dropped, _dropped, _dropped),
    Command.DO_JUMP: (_whole, _whole, _dropped, _dropped),
    Command.DO_CHANGE_SPEED: (_whole, _float32, _float32, _dropped),
    Command.DO_SET_HOME: (_whole, _dropped, _dropped, _dropped),
    Command.DO_SET_REVERSE: (_whole, _dropped, _dropped, _dropped),
    Command.DO_FENCE_ENABLE: (_whole, _dropped, _dropped, _dropped),
    Command.NAV_SET_YAW_SPEED: (_float32, _float32, _whole, _dropped),
    30: (_whole, _dropped, _dropped, _dropped),  # NAV_CONTINUE_AND_CHANGE_ALT
    31: (_dropped, _whole, _dropped, _flag),  # NAV_LOITER_TO_ALT
    82: (_whole, _dropped, _dropped, _dropped),  # NAV_SPLINE_WAYPOINT
    83: (_float32, _float32, _whole, _dropped),  # NAV_ALTITUDE_WAIT
    84: (_dropped, _dropped, _dropped, _dropped),  # NAV_VTOL_TAKEOFF
    85: (_whole, _dropped, _dropped, _dropped),  # NAV_VTOL_LAND
    94: (_hundredths, _dropped, _dropped, _dropped),  # NAV_PAYLOAD_PLACE
    115: (_float32, _float32, _whole, _whole),  # CONDITION_YAW
    181: (_whole, _whole, _dropped, _dropped),  # DO_SET_RELAY
    182: (_whole, _whole, _float32, _dropped),  # DO_REPEAT_RELAY
    183: (_whole, _whole, _dropped, _dropped),  # DO_SET_SERVO
    184: (_whole, _whole, _whole, _float32),  # DO_REPEAT_SERVO
    188: (_dropped, _dropped, _dropped, _dropped),  # DO_RETURN_PATH_START
    189: (_dropped, _dropped, _dropped, _dropped),  # DO_LAND_START
    191: (_dropped, _dropped, _dropped, _dropped),  # DO_GO_AROUND
    193: (_whole, _dropped, _dropped, _dropped),  # DO_PAUSE_CONTINUE
    195: (_whole, _dropped, _dropped, _dropped),  # DO_SET_ROI_LOCATION
    197: (_whole, _dropped, _dropped, _dropped),  # DO_SET_ROI_NONE
    201: (_whole, _dropped, _dropped, _dropped),  # DO_SET_ROI
    202: (_whole, _whole, _whole, _whole),  # DO_DIGICAM_CONFIGURE
    203: (_whole, _whole, _whole, _whole),  # DO_DIGICAM_CONTROL
    205: (_float32, _float32, _float32, _dropped),  # DO_MOUNT_CONTROL
    206: (
        _float32,
        _dropped,
        _dropped,
        _dropped,
    ),  # DO_SET_CAM_TRIGG_DIST; newer firmware keeps the third, too
    208: (_whole, _dropped, _dropped, _dropped),  # DO_PARACHUTE
    210: (_whole, _dropped, _dropped, _dropped),  # DO_INVERTED_FLIGHT
    211: (_whole, _whole, _dropped, _dropped),  # DO_GRIPPER
    212: (_whole, _dropped, _dropped, _dropped),  # DO_AUTOTUNE_ENABLE
    215: (_whole, _dropped, _dropped, _dropped),  # DO_SET_RESUME_REPEAT_DIST
    216: (_whole, _dropped, _dropped, _dropped),  # DO_SPRAYER
    217: (_whole, _float32, _float32, _float32),  # DO_SEND_SCRIPT_MESSAGE
    218: (_whole, _whole, _dropped, _dropped),  # DO_AUX_FUNCTION
    222: (_whole, _float32, _float32, _float32),  # DO_GUIDED_LIMITS
    223: (_flag, _flag, _hundredths, _odd),  # DO_ENGINE_CONTROL
    531: (_whole, _float32, _dropped, _dropped),  # SET_CAMERA_ZOOM
    532: (_whole, _float32, _dropped, _dropped),  # SET_CAMERA_FOCUS
    534: (_whole, _whole, _whole, _dropped),  # SET_CAMERA_SOURCE
    600: (_whole, _dropped, _dropped, _dropped),  # JUMP_TAG
    601: (_whole, _whole, _dropped, _dropped),  # DO_JUMP_TAG
    1000: (_whole, _whole, _whole, _whole),  # DO_GIMBAL_MANAGER_PITCHYAW
    2000: (_whole, _float32, _whole, _whole),  # IMAGE_START_CAPTURE
    2001: (_whole, _dropped, _dropped, _dropped),  # IMAGE_STOP_CAPTURE
    2500: (_whole, _dropped, _dropped, _dropped),  # VIDEO_START_CAPTURE
    2501: (_whole, _dropped, _dropped, _dropped),  # VIDEO_STOP_CAPTURE
    3000: (_whole, _dropped, _dropped, _dropped),  # DO_VTOL_TRANSITION
    42600: (_whole, _whole, _float32, _float32),  # DO_WINCH
    42702: (_whole, _whole, _float16, _float16),  # NAV_SCRIPT_TIME
    42703: (_whole, _whole, _whole, _whole),  # NAV_ATTITUDE_TIME
}
STORED_WITH_PLACE = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TURNS,
        Command.NAV_LOITER_TIME,
        Command.NAV_LAND,
        Command.NAV_TAKEOFF,
        Command.NAV_GUIDED_ENABLE,
        Command.DO_SET_HOME,
        30,  # NAV_CONTINUE_AND_CHANGE_ALT
        31,  # NAV_LOITER_TO_ALT
        82,  # NAV_SPLINE_WAYPOINT
        84,  # NAV_VTOL_TAKEOFF
        85,  # NAV_VTOL_LAND
        94,  # NAV_PAYLOAD_PLACE
        188,  # DO_RETURN_PATH_START
        189,  # DO_LAND_START
        191,  # DO_GO_AROUND
        195,  # DO_SET_ROI_LOCATION
        201,  # DO_SET_ROI
    }
)
"""Commands stored with a place and a frame (``AP_Mission::stored_in_location``); others read back with frame 0 and mostly without a place."""

_NAN_TAKEN = frozenset(
    {
        (int(Command.NAV_WAYPOINT), 3),
        (int(Command.NAV_LAND), 3),
        (int(Command.NAV_TAKEOFF), 3),
        (84, 3),
        (85, 2),
        (85, 3),
    }
)
"""Commands and the parameters of theirs, counted from 0, in which ArduPilot takes NaN."""

_POLYGON_VERTICES = frozenset(
    {Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION}
)


@dataclass(frozen=True, slots=True)
class Difference:
    """One item that is not what was wanted.

    Parameters
    ----------
    seq : int
        Its place in the list, for missions with home at 0.
    wanted, found : MissionItem, optional
        None where a list ends before the other.
    """

    seq: int
    wanted: MissionItem | None
    found: MissionItem | None

    def __str__(self) -> str:
        if self.wanted is None:
            return f"item {self.seq} should not be there"
        if self.found is None:
            return f"item {self.seq} is missing"
        return f"item {self.seq} is {_brief(self.found)} instead of {_brief(self.wanted)}"


def _brief(item: MissionItem) -> str:
    params = ", ".join(f"{value:g}" for value in item.params)
    return f"command {int(item.command)} ({params}) at {item.position}, {item.alt_m:g} m in frame {int(item.frame)}"


def sendable_params(item: MissionItem) -> tuple[float, float, float, float]:
    """Return an item's parameters, with 0 for a NaN that ArduPilot would refuse and of which it keeps nothing.

    QGroundControl leaves headings unset (null), and ArduPilot refuses that of NAV_LOITER_UNLIM (ArduPilot #27482).
    """
    keepers = _KEPT_PARAMS.get(int(item.command), _KEEPS_ALL)
    a, b, c, d = (
        0.0
        if math.isnan(value) and keep in (_dropped, _flag) and (int(item.command), i) not in _NAN_TAKEN
        else value
        for i, (value, keep) in enumerate(zip(item.params, keepers, strict=True))
    )
    return a, b, c, d


def is_same_item(a: MissionItem, b: MissionItem, mission_type: MissionType, *, coarse: bool = False) -> bool:
    """Return whether two items are the same once stored; ``coarse`` compares positions as 32-bit floats carry them."""
    if a == b:
        return True
    stored_a, stored_b = _stored(a, mission_type), _stored(b, mission_type)
    if stored_a.fixed != stored_b.fixed:
        return False
    may_lose = stored_a.may_lose_place
    if not (_is_near(stored_a.alt_m, stored_b.alt_m) or (may_lose and 0 in (stored_a.alt_m, stored_b.alt_m))):
        return False
    if may_lose and (0, 0) in (stored_a.place, stored_b.place):
        return True
    if not coarse:
        return stored_a.place == stored_b.place
    return all(
        _float32(x / 1e7) == _float32(y / 1e7) for x, y in zip(stored_a.place, stored_b.place, strict=True)
    )


def differences(
    wanted: Sequence[MissionItem],
    found: Sequence[MissionItem],
    mission_type: MissionType,
    *,
    coarse: bool = False,
) -> tuple[Difference, ...]:
    """Return the items in which a list as read back differs from the one wanted, home left out.

    A mission of only the home item is an empty mission.
    """
    first = 1 if mission_type is MissionType.MISSION else 0
    longest = max(len(wanted), len(found))
    result = []
    for seq in range(first, longest):
        a = wanted[seq] if seq < len(wanted) else None
        b = found[seq] if seq < len(found) else None
        if a is None or b is None or not is_same_item(a, b, mission_type, coarse=coarse):
            result.append(Difference(seq, a, b))
    return tuple(result)


def is_unfinished_write(
    found: Sequence[MissionItem],
    old: Sequence[MissionItem],
    new: Sequence[MissionItem],
    mission_type: MissionType,
    *,
    coarse: bool = False,
) -> bool:
    """Return whether a list can be what an abandoned upload of ``new`` over ``old`` leaves: the old cut short, overwritten from the front.

    ArduPilot cuts a mission to the shorter length at MISSION_COUNT and then writes each item as it comes.
    """
    if not min(len(old), len(new)) <= len(found) <= max(len(old), len(new)):
        return False

    def holds(seq: int, items: Sequence[MissionItem]) -> bool:
        return seq < len(items) and is_same_item(found[seq], items[seq], mission_type, coarse=coarse)

    first = 1 if mission_type is MissionType.MISSION else 0
    return all(holds(seq, new) or holds(seq, old) for seq in range(first, len(found)))


@dataclass(frozen=True, slots=True)
class _StoredItem:
    fixed: tuple[object, ...]
    place: tuple[int, int]
    alt_m: float
    may_lose_place: bool = False


def _stored(item: MissionItem, mission_type: MissionType) -> _StoredItem:
    command = int(item.command)
    place = (item.lat_e7, item.lon_e7)
    if mission_type is MissionType.FENCE:
        keep = _whole if command in _POLYGON_VERTICES else _float32
        param1 = None if command == Command.FENCE_RETURN_POINT else keep(item.params[0])
        return _StoredItem((command, param1), place, 0.0)
    if mission_type is MissionType.RALLY:
        return _StoredItem((command, _whole(item.alt_m)), place, 0.0)
    keepers = _KEPT_PARAMS.get(command, _KEEPS_ALL)
    params = tuple(keep(value) for keep, value in zip(keepers, item.params, strict=True))
    if command not in STORED_WITH_PLACE:
        return _StoredItem((command, params), place, item.alt_m, may_lose_place=True)
    frame = _FRAMES.get(int(item.frame), int(item.frame))
    return _StoredItem((command, frame, params), place, item.alt_m)


def _is_near(a_m: float, b_m: float) -> bool:
    """Return whether two altitudes can be the same whole number of centimetres, cut or rounded."""
    if not (math.isfinite(a_m) and math.isfinite(b_m)):
        return str(a_m) == str(b_m)
    # Cut and rounded differ by at most 1.5 cm; the share is what 32-bit floats lose.
    return abs(a_m - b_m) < 0.0151 + 1e-6 * abs(a_m)
