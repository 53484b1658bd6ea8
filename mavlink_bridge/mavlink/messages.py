"""MAVLink messages as plain frozen data, with MAVLink's own names for messages and fields.

A class's name is the message's name in camel case (``MissionItemInt`` is MISSION_ITEM_INT). Fields keep the wire's units: degE7 for
``lat``, ``lon``, ``x``, ``y`` of the INT messages, millimetres for ``alt``, centidegrees for ``hdg``. A class may list only some of
the wire's fields; the others are sent as 0. Everything behind the codec speaks these classes, so nothing but the codec needs pymavlink.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum, IntFlag


class MissionType(IntEnum):
    """MAV_MISSION_TYPE: which list a transfer is about."""

    MISSION = 0
    FENCE = 1
    RALLY = 2
    ALL = 255


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT, the answer in a MISSION_ACK."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


class MavResult(IntEnum):
    """MAV_RESULT, the answer in a COMMAND_ACK."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    COMMAND_LONG_ONLY = 7
    COMMAND_INT_ONLY = 8
    UNSUPPORTED_MAV_FRAME = 9


class MavType(IntEnum):
    """The values of MAV_TYPE this project looks at."""

    GCS = 6
    GROUND_ROVER = 10
    SURFACE_BOAT = 11
    ONBOARD_CONTROLLER = 18


class Autopilot(IntEnum):
    """The values of MAV_AUTOPILOT this project looks at."""

    GENERIC = 0
    ARDUPILOTMEGA = 3
    INVALID = 8
    PX4 = 12


class ModeFlag(IntFlag):
    """MAV_MODE_FLAG, the bits of HEARTBEAT.base_mode this project looks at."""

    CUSTOM_MODE_ENABLED = 1
    SAFETY_ARMED = 128


class Capability(IntFlag):
    """MAV_PROTOCOL_CAPABILITY, the bits this project looks at."""

    MISSION_FLOAT = 1
    PARAM_FLOAT = 2
    MISSION_INT = 4
    COMMAND_INT = 8
    PARAM_ENCODE_BYTEWISE = 16
    FTP = 32
    SET_POSITION_TARGET_GLOBAL_INT = 256
    MAVLINK2 = 8192
    MISSION_FENCE = 16384
    MISSION_RALLY = 32768
    PARAM_ENCODE_C_CAST = 131072


@dataclass(frozen=True, slots=True)
class Message:
    """The root of all messages."""


@dataclass(frozen=True, slots=True)
class Addressed(Message):
    """A message that begins with whom it is for."""

    target_system: int
    target_component: int


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """HEARTBEAT (0)."""

    type: int
    autopilot: int
    base_mode: int = 0
    custom_mode: int = 0
    system_status: int = 0
    mavlink_version: int = 3


@dataclass(frozen=True, slots=True)
class SysStatus(Message):
    """SYS_STATUS (1), its sensor bits and the battery: mV (65535: unknown), % (-1: unknown)."""

    onboard_control_sensors_present: int
    onboard_control_sensors_enabled: int
    onboard_control_sensors_health: int
    voltage_battery: int = 65535
    battery_remaining: int = -1


@dataclass(frozen=True, slots=True)
class SetMode(Message):
    """SET_MODE (11)."""

    target_system: int
    base_mode: int
    custom_mode: int


@dataclass(frozen=True, slots=True)
class ParamRequestRead(Addressed):
    """PARAM_REQUEST_READ (20); ``param_index`` -1 asks by name."""

    param_id: str
    param_index: int = -1


@dataclass(frozen=True, slots=True)
class ParamRequestList(Addressed):
    """PARAM_REQUEST_LIST (21)."""


@dataclass(frozen=True, slots=True)
class ParamValue(Message):
    """PARAM_VALUE (22)."""

    param_id: str
    param_value: float
    param_type: int
    param_count: int
    param_index: int


@dataclass(frozen=True, slots=True)
class ParamSet(Addressed):
    """PARAM_SET (23)."""

    param_id: str
    param_value: float
    param_type: int


@dataclass(frozen=True, slots=True)
class GpsRawInt(Message):
    """GPS_RAW_INT (24); ``h_acc`` in mm, 0 where not filled."""

    time_usec: int
    fix_type: int
    lat: int
    lon: int
    alt: int
    eph: int = 65535
    satellites_visible: int = 255
    h_acc: int = 0


@dataclass(frozen=True, slots=True)
class Attitude(Message):
    """ATTITUDE (30): rad, rad/s."""

    time_boot_ms: int
    roll: float
    pitch: float
    yaw: float
    rollspeed: float = 0.0
    pitchspeed: float = 0.0
    yawspeed: float = 0.0


@dataclass(frozen=True, slots=True)
class GlobalPositionInt(Message):
    """GLOBAL_POSITION_INT (33): degE7, mm, cm/s, centidegrees (65535: heading unknown)."""

    time_boot_ms: int
    lat: int
    lon: int
    alt: int = 0
    relative_alt: int = 0
    vx: int = 0
    vy: int = 0
    vz: int = 0
    hdg: int = 65535


@dataclass(frozen=True, slots=True)
class MissionWritePartialList(Addressed):
    """MISSION_WRITE_PARTIAL_LIST (38)."""

    start_index: int
    end_index: int
    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class MissionItem(Addressed):
    """MISSION_ITEM (39), the old form with float degrees in ``x`` and ``y``."""

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: float
    y: float
    z: float
    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class MissionRequest(Addressed):
    """MISSION_REQUEST (40)."""

    seq: int
    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class MissionSetCurrent(Addressed):
    """MISSION_SET_CURRENT (41)."""

    seq: int


@dataclass(frozen=True, slots=True)
class MissionCurrent(Message):
    """MISSION_CURRENT (42); the ids change with the lists, and are 0 where the autopilot does not fill them."""

    seq: int
    total: int = 0
    mission_state: int = 0
    mission_mode: int = 0
    mission_id: int = 0
    fence_id: int = 0
    rally_points_id: int = 0


@dataclass(frozen=True, slots=True)
class MissionRequestList(Addressed):
    """MISSION_REQUEST_LIST (43)."""

    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class MissionCount(Addressed):
    """MISSION_COUNT (44); the id changes with the list, and is 0 where the autopilot does not fill it."""

    count: int
    mission_type: int = 0
    opaque_id: int = 0


@dataclass(frozen=True, slots=True)
class MissionClearAll(Addressed):
    """MISSION_CLEAR_ALL (45)."""

    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class MissionItemReached(Message):
    """MISSION_ITEM_REACHED (46)."""

    seq: int


@dataclass(frozen=True, slots=True)
class MissionAck(Addressed):
    """MISSION_ACK (47); the id is that of the list as it is now, and 0 where the autopilot does not fill it."""

    type: int
    mission_type: int = 0
    opaque_id: int = 0


@dataclass(frozen=True, slots=True)
class MissionRequestInt(Addressed):
    """MISSION_REQUEST_INT (51)."""

    seq: int
    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class NavControllerOutput(Message):
    """NAV_CONTROLLER_OUTPUT (62), what a rover fills."""

    nav_bearing: int
    target_bearing: int
    wp_dist: int
    xtrack_error: float = 0.0


@dataclass(frozen=True, slots=True)
class RequestDataStream(Addressed):
    """REQUEST_DATA_STREAM (66)."""

    req_stream_id: int
    req_message_rate: int
    start_stop: int


@dataclass(frozen=True, slots=True)
class MissionItemInt(Addressed):
    """MISSION_ITEM_INT (73)."""

    seq: int
    frame: int
    command: int
    current: int
    autocontinue: int
    param1: float
    param2: float
    param3: float
    param4: float
    x: int
    y: int
    z: float
    mission_type: int = 0


@dataclass(frozen=True, slots=True)
class VfrHud(Message):
    """VFR_HUD (74), what a rover fills."""

    airspeed: float
    groundspeed: float
    heading: int
    throttle: int


@dataclass(frozen=True, slots=True)
class CommandInt(Addressed):
    """COMMAND_INT (75)."""

    frame: int
    command: int
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    current: int = 0
    autocontinue: int = 0


@dataclass(frozen=True, slots=True)
class CommandLong(Addressed):
    """COMMAND_LONG (76)."""

    command: int
    confirmation: int = 0
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    param5: float = 0.0
    param6: float = 0.0
    param7: float = 0.0


@dataclass(frozen=True, slots=True)
class CommandAck(Message):
    """COMMAND_ACK (77); targets are 0 where the sender does not fill them."""

    command: int
    result: int
    progress: int = 0
    result_param2: int = 0
    target_system: int = 0
    target_component: int = 0


@dataclass(frozen=True, slots=True)
class SetPositionTargetGlobalInt(Message):
    """SET_POSITION_TARGET_GLOBAL_INT (86)."""

    time_boot_ms: int
    target_system: int
    target_component: int
    coordinate_frame: int
    type_mask: int
    lat_int: int
    lon_int: int
    alt: float
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    afx: float = 0.0
    afy: float = 0.0
    afz: float = 0.0
    yaw: float = 0.0
    yaw_rate: float = 0.0


@dataclass(frozen=True, slots=True)
class PositionTargetGlobalInt(Message):
    """POSITION_TARGET_GLOBAL_INT (87), the vehicle's echo of where it drives."""

    time_boot_ms: int
    coordinate_frame: int
    type_mask: int
    lat_int: int
    lon_int: int
    alt: float


@dataclass(frozen=True, slots=True)
class AutopilotVersion(Message):
    """AUTOPILOT_VERSION (148); a version is major, minor, patch and type, a byte each from the top, and ids of 0 are unknown."""

    capabilities: int
    flight_sw_version: int = 0
    middleware_sw_version: int = 0
    os_sw_version: int = 0
    board_version: int = 0
    flight_custom_version: tuple[int, ...] = (0,) * 8
    middleware_custom_version: tuple[int, ...] = (0,) * 8
    os_custom_version: tuple[int, ...] = (0,) * 8
    vendor_id: int = 0
    product_id: int = 0
    uid: int = 0
    uid2: tuple[int, ...] = (0,) * 18


AUTOPILOT_VERSION_ID = 148
"""For asking for it (MAV_CMD_REQUEST_MESSAGE); it is not sent unasked."""


@dataclass(frozen=True, slots=True)
class BatteryStatus(Message):
    """BATTERY_STATUS (147): mV of each cell, or of the whole in the first (65535: none; of cells 11 to 14 0), % (-1: unknown)."""

    id: int
    voltages: tuple[int, ...] = (65535,) * 10
    battery_remaining: int = -1
    voltages_ext: tuple[int, ...] = (0,) * 4

    @property
    def whole_mv(self) -> int | None:
        """All cells together; None where no cell is told."""
        cells = [one for one in self.voltages if one != 65535]
        cells += [one for one in self.voltages_ext if one not in (0, 65535)]
        return sum(cells) if cells else None


@dataclass(frozen=True, slots=True)
class FenceStatus(Message):
    """FENCE_STATUS (162)."""

    breach_status: int
    breach_count: int
    breach_type: int
    breach_time: int
    breach_mitigation: int = 0


@dataclass(frozen=True, slots=True)
class Simstate(Message):
    """SIMSTATE (164), the simulator's true position (degE7; yaw in rad)."""

    yaw: float
    lat: int
    lng: int


@dataclass(frozen=True, slots=True)
class EkfStatusReport(Message):
    """EKF_STATUS_REPORT (193), its flags."""

    flags: int


@dataclass(frozen=True, slots=True)
class HomePosition(Message):
    """HOME_POSITION (242): degE7, mm."""

    latitude: int
    longitude: int
    altitude: int = 0


@dataclass(frozen=True, slots=True)
class ObstacleDistance(Message):
    """OBSTACLE_DISTANCE (330): cm by direction, clockwise (65535: not known, ``max_distance`` + 1: nothing there); degrees."""

    time_usec: int
    sensor_type: int
    distances: tuple[int, ...]
    increment: int
    min_distance: int
    max_distance: int
    increment_f: float = 0.0
    angle_offset: float = 0.0
    frame: int = 0


@dataclass(frozen=True, slots=True)
class Statustext(Message):
    """STATUSTEXT (253), at most 50 characters a message."""

    severity: int
    text: str


@dataclass(frozen=True, slots=True)
class Frame:
    """A message and who sent it: MAVLink's system and component id."""

    system: int
    component: int
    message: Message


def wire_name(message_class: type[Message]) -> str:
    """Return the MAVLink name of a message class: ``MissionItemInt`` is ``MISSION_ITEM_INT``."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", message_class.__name__).upper()


MESSAGES: dict[str, type[Message]] = {
    wire_name(cls): cls
    for cls in list(vars().values())
    if isinstance(cls, type) and issubclass(cls, Message) and cls not in (Message, Addressed)
}
"""Every message this project speaks, by its MAVLink name."""
