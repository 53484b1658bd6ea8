"""What the rover reports about itself, message by message."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import streams
from mavlink_bridge.simulator.personality import version_number
from mavlink_bridge.simulator.sensor import distances_cm, obstacle_distance
from missions.geo import to_e7

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.simulator.rover import Rover
    from missions.firmware import Firmware

# Bits of MAV_SYS_STATUS_SENSOR: enabled and healthy, present, and three single ones.
_SENSORS = 322_011_183
_SENSORS_PRESENT = 322_034_735
_FENCE_SENSOR = 1 << 20
_GPS_SENSOR = 1 << 5
_PREARM_OK = 1 << 28
_EKF_GOOD, _EKF_UNINITIALISED = 831, 1024
_POSITION_ONLY = 65_016  # POSITION_TARGET_TYPEMASK: all ignored but the position
_CAPABILITIES = (
    m.Capability.MISSION_FLOAT
    | m.Capability.PARAM_FLOAT
    | m.Capability.MISSION_INT
    | m.Capability.COMMAND_INT
    | m.Capability.SET_POSITION_TARGET_GLOBAL_INT
    | m.Capability.MAVLINK2
    | m.Capability.MISSION_FENCE
    | m.Capability.MISSION_RALLY
    | m.Capability.PARAM_ENCODE_C_CAST
)
_STANDBY, _ACTIVE, _CALIBRATING = 3, 4, 2
_NO_MISSION, _NOT_STARTED, _ACTIVE_MISSION, _PAUSED, _COMPLETE = 1, 2, 3, 4, 5
_NO_CELL = 65_535
_CELLS, _MORE_CELLS = (
    10,
    4,
)  # of BATTERY_STATUS.voltages and .voltages_ext; 65535 stands for none in the first, 0 in the second
_BOUNDARY = 3  # FENCE_BREACH_BOUNDARY


@dataclass(frozen=True, slots=True)
class TelemetrySource:
    """What telemetry is about: the rover, the items in its mission (home included), its time since boot, whether it has a position.

    Discs are the middle and radius of each in the rover's frame, for a sensor that sees so far. The ids are those of mission, fence and rally points, 0 where none are known; the uid is the board's own, the firmware its version.
    """

    rover: Rover
    mission_count: int
    boot_s: float
    is_ready: bool
    list_ids: tuple[int, int, int] = (0, 0, 0)
    uid: bytes = b""
    firmware: Firmware | None = None
    discs: tuple[tuple[complex, float], ...] = ()
    sensor_m: float = 0.0


def telemetry(message_id: int, state: TelemetrySource) -> m.Message | None:
    """Return a message by its id, None where the rover has no such message."""
    build = _BUILDERS.get(message_id)
    return build(state) if build else None


def _heartbeat(state: TelemetrySource) -> m.Message:
    base_mode = m.ModeFlag.CUSTOM_MODE_ENABLED
    if state.rover.mode in (Mode.MANUAL, Mode.INITIALISING):
        base_mode |= 64
    elif state.rover.mode != Mode.HOLD:
        base_mode |= 8
    if state.rover.is_armed:
        base_mode |= m.ModeFlag.SAFETY_ARMED
    status = {Mode.HOLD: _STANDBY, Mode.INITIALISING: _CALIBRATING}.get(state.rover.mode, _ACTIVE)
    return m.Heartbeat(
        m.MavType.GROUND_ROVER, m.Autopilot.ARDUPILOTMEGA, int(base_mode), state.rover.mode, status
    )


def _sys_status(state: TelemetrySource) -> m.Message:
    enabled = _SENSORS if state.rover.parameters["FENCE_ENABLE"] else _SENSORS & ~_FENCE_SENSOR
    health = _SENSORS | (_PREARM_OK if state.is_ready else 0)
    if not state.is_ready:
        health &= ~(_PREARM_OK | _GPS_SENSOR)
    if state.rover.breached:
        health &= ~_FENCE_SENSOR
    battery = state.rover.battery
    if battery is None:
        return m.SysStatus(_SENSORS_PRESENT, enabled, health)
    millivolts = round(battery.volts * 1000)
    return m.SysStatus(_SENSORS_PRESENT, enabled, health, millivolts, battery.percent)


def _battery_status(state: TelemetrySource) -> m.Message | None:
    battery = state.rover.battery
    if battery is None:
        return None
    count = battery.cells or 1
    cells_mv = count * [round(battery.volts * 1000 / count)]
    first, rest = cells_mv[:_CELLS], cells_mv[_CELLS:]
    return m.BatteryStatus(
        0,
        (*first, *((_CELLS - len(first)) * [_NO_CELL])),
        battery.percent,
        (*rest, *((_MORE_CELLS - len(rest)) * [0])),
    )


def _global_position(state: TelemetrySource) -> m.Message:
    lat_e7, lon_e7 = to_e7(state.rover.estimate) if state.is_ready else (0, 0)
    velocity_mps = state.rover.body.velocity_mps
    return m.GlobalPositionInt(
        _boot_ms(state.boot_s),
        lat_e7,
        lon_e7,
        vx=round(velocity_mps.real * 100),
        vy=round(velocity_mps.imag * 100),
        hdg=round(state.rover.heading_deg * 100) % 36_000,
    )


def _attitude(state: TelemetrySource) -> m.Message:
    yaw_rad = math.remainder(state.rover.body.heading_rad, 2 * math.pi)
    return m.Attitude(_boot_ms(state.boot_s), 0.0, 0.0, yaw_rad)


def _obstacle_distance(state: TelemetrySource) -> m.Message | None:
    body, sees_m = state.rover.body, state.sensor_m
    seen = distances_cm(state.discs, body.position_m, body.heading_rad, sees_m)
    return obstacle_distance(seen, state.boot_s, sees_m) if sees_m else None


def _gps_raw(state: TelemetrySource) -> m.Message:
    time_usec = round(state.boot_s * 1e6)
    if not state.is_ready:
        return m.GpsRawInt(time_usec, 0, 0, 0, 0, satellites_visible=0)
    told = state.rover.receiver
    fix_type, h_acc = (6, 300) if told is None else (told.fix_type, round(1000 * (told.error_m or 0.0)))
    position = to_e7(state.rover.position)
    return m.GpsRawInt(time_usec, fix_type, *position, 0, eph=121, satellites_visible=10, h_acc=h_acc)


def _mission_current(state: TelemetrySource) -> m.Message:
    if state.mission_count <= 1:
        progress = _NO_MISSION
    elif state.rover.mission_run.is_complete:
        progress = _COMPLETE
    elif state.rover.mission_run.seq == 0:
        progress = _NOT_STARTED
    else:
        progress = _ACTIVE_MISSION if state.rover.mode == Mode.AUTO else _PAUSED
    return m.MissionCurrent(
        state.rover.mission_run.seq,
        max(0, state.mission_count - 1),
        progress,
        int(state.rover.mode == Mode.AUTO),
        *state.list_ids,
    )


def _nav_controller(state: TelemetrySource) -> m.Message | None:
    target_m = state.rover.drive.destination_m
    if target_m is None:
        return None
    away_m = target_m - state.rover.body.position_m
    bearing_deg = round(math.degrees(math.atan2(away_m.imag, away_m.real))) % 360
    return m.NavControllerOutput(
        0, bearing_deg, min(65_535, int(abs(away_m))), state.rover.drive.cross_track_m
    )


def _vfr_hud(state: TelemetrySource) -> m.Message:
    speed_mps = abs(state.rover.body.speed_mps)
    throttle = round(abs(state.rover.drive.throttle) * 100)
    return m.VfrHud(
        speed_mps, speed_mps, int(state.rover.heading_deg), throttle if state.rover.is_armed else 0
    )


def _position_target(state: TelemetrySource) -> m.Message | None:
    target = state.rover.destination
    if target is None:
        return None
    return m.PositionTargetGlobalInt(_boot_ms(state.boot_s), 0, _POSITION_ONLY, *to_e7(target), 0.0)


def _fence_status(state: TelemetrySource) -> m.Message | None:
    if not state.rover.parameters["FENCE_ENABLE"]:
        return None
    breached = state.rover.breached
    return m.FenceStatus(
        int(breached),
        min(state.rover.breaches, 65_535),
        _BOUNDARY if breached else 0,
        _boot_ms(state.rover.breach_time_s),
        1,
    )


def _simstate(state: TelemetrySource) -> m.Message:
    return m.Simstate(state.rover.body.heading_rad, *to_e7(state.rover.position))


def _ekf(state: TelemetrySource) -> m.Message:
    return m.EkfStatusReport(_EKF_GOOD if state.is_ready else _EKF_UNINITIALISED)


def _home(state: TelemetrySource) -> m.Message | None:
    return m.HomePosition(*to_e7(state.rover.home)) if state.is_ready else None


def _version(state: TelemetrySource) -> m.Message:
    return m.AutopilotVersion(
        int(_CAPABILITIES), version_number(state.firmware), uid2=tuple(state.uid.ljust(18, b"\0")[:18])
    )


def _boot_ms(boot_s: float) -> int:
    return round(boot_s * 1000) % 2**32


_BUILDERS: dict[int, Callable[[TelemetrySource], m.Message | None]] = {
    streams.HEARTBEAT: _heartbeat,
    streams.SYS_STATUS: _sys_status,
    streams.GPS_RAW_INT: _gps_raw,
    streams.ATTITUDE: _attitude,
    streams.GLOBAL_POSITION_INT: _global_position,
    streams.MISSION_CURRENT: _mission_current,
    streams.NAV_CONTROLLER_OUTPUT: _nav_controller,
    streams.VFR_HUD: _vfr_hud,
    streams.POSITION_TARGET_GLOBAL_INT: _position_target,
    streams.AUTOPILOT_VERSION: _version,
    streams.BATTERY_STATUS: _battery_status,
    streams.FENCE_STATUS: _fence_status,
    streams.SIMSTATE: _simstate,
    streams.EKF_STATUS_REPORT: _ekf,
    streams.HOME_POSITION: _home,
    streams.OBSTACLE_DISTANCE: _obstacle_distance,
}
