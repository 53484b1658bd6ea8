"""Which mission commands ArduRover stores, and what of each: all that ``AP_Mission::mavlink_int_to_mission_cmd`` takes.

Read from ArduPilot's source (AP_Mission.cpp and .h, 4.7.0-dev): how `mission_cmd_to_mavlink_int` gives back what the packed structures hold.
What a stored command makes the rover do is another matter: `mission_run` does some of them, `NOT_DRIVEN` lists the others.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path

from mavlink_bridge.simulator.parameters import float32
from missions.items import Command, MissionItem

Params = tuple[float, float, float, float]

NAN_ALLOWED = frozenset(
    {(Command.NAV_WAYPOINT, 3), (Command.NAV_LAND, 3), (Command.NAV_TAKEOFF, 3), (84, 3), (85, 2), (85, 3)}
)
"""Commands and the parameters of theirs, counted from 0, that may be NaN."""


def uint8(value: float) -> int:
    """Return what eight bits hold of a number."""
    return int(value) & 0xFF if math.isfinite(value) else 0


def _none(_: float) -> float:
    return 0.0


def _uint8(value: float) -> float:
    return float(uint8(value))


def _uint16(value: float) -> float:
    return float(max(0, min(65_535, int(value)))) if math.isfinite(value) else 0.0


def _int8(value: float) -> float:
    return float(max(-128, min(127, int(value))))


def _int16(value: float) -> float:
    return float(max(-32_768, min(32_767, int(value))))


def _whole(value: float) -> float:
    return float(int(value))


def _float16(value: float) -> float:
    try:
        return float(struct.unpack("<e", struct.pack("<e", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def _flag(value: float) -> float:
    return float(value > 0)


def _hundredths(value: float) -> float:
    return float32(_uint16(value * 100.0) * 0.01)


def _fields(*fields: Callable[[float], float]) -> Callable[[Params], Params]:
    """Return what keeps each of the four parameters in its field."""

    def keep(params: Params) -> Params:
        a, b, c, d = (field(param) for field, param in zip(fields, params, strict=True))
        return (a, b, c, d)

    return keep


def _kept_radius(params: Params) -> Params:
    return (0.0, 0.0, math.copysign(_uint16(abs(params[2])), params[2]), 0.0)


def _kept_turns(params: Params) -> Params:
    # Turns and radius share 16 bits: parts of one turn count in 256ths, a radius beyond 255 m in tens of metres.
    turns = int(params[0] * 256) / 256 if 0 < params[0] < 1 else min(255.0, _uint16(params[0]))
    radius_m = abs(params[2])
    kept_m = int(radius_m) if radius_m <= 255 else 10 * int(min(255.0, radius_m * 0.1))
    return (turns, 0.0, math.copysign(kept_m, params[2]), _flag(params[3]))


def _kept_time(params: Params) -> Params:
    return (_uint16(params[0]), 0.0, -1.0 if params[2] < 0 else 1.0, _flag(params[3]))


def _kept_land(params: Params) -> Params:
    return (_uint16(params[0]), 0.0, 0.0, -1.0 if params[3] < 0 else 1.0)


def _kept_loiter_to_alt(params: Params) -> Params:
    return (0.0, math.copysign(_uint16(abs(params[1])), params[1]), 0.0, _flag(params[3]))


def _kept_engine(params: Params) -> Params:
    allows_disarmed = float(int(abs(params[3])) & 1)  # ENGINE_CONTROL_OPTIONS_ALLOW_START_WHILE_DISARMED
    return (_flag(params[0]), _flag(params[1]), _hundredths(params[2]), allows_disarmed)


def _kept_attitude(params: Params) -> Params:
    seconds, roll_deg, pitch_deg, yaw_deg = params
    return (
        _uint16(seconds),
        _int16(roll_deg) if abs(roll_deg) <= 180 else 0.0,
        _int8(pitch_deg) if abs(pitch_deg) <= 90 else 0.0,
        _int16(yaw_deg) if -180 <= yaw_deg <= 360 else 0.0,
    )


_FIELDS = {
    field.__name__.lstrip("_"): field
    for field in (_none, _uint8, _uint16, _int8, _int16, _whole, _float16, float32, _hundredths)
}


def _kept_in_fields() -> dict[int, Callable[[Params], Params]]:
    """Return the commands that keep each parameter in a field of its own, from the table beside this module."""
    table = Path(__file__).with_name("stored_commands.csv").read_text(encoding="ascii")
    rows = [line.split(",") for line in table.splitlines()[1:]]
    return {
        int(command): _fields(*(_FIELDS[name or "none"] for name in names)) for command, _, *names in rows
    }


KEPT: dict[int, Callable[[Params], Params]] = _kept_in_fields() | {
    Command.NAV_LOITER_UNLIM: _kept_radius,
    Command.NAV_LOITER_TURNS: _kept_turns,
    Command.NAV_LOITER_TIME: _kept_time,
    Command.NAV_LAND: _kept_land,
    31: _kept_loiter_to_alt,  # NAV_LOITER_TO_ALT
    223: _kept_engine,  # DO_ENGINE_CONTROL
    42703: _kept_attitude,  # NAV_ATTITUDE_TIME
}
"""What ArduPilot keeps of a mission command's four parameters; a command that is not here is unsupported."""

NOT_DRIVEN = frozenset(KEPT) - {
    Command.NAV_WAYPOINT,
    Command.NAV_LOITER_UNLIM,
    Command.NAV_LOITER_TURNS,
    Command.NAV_LOITER_TIME,
    Command.NAV_RETURN_TO_LAUNCH,
    Command.NAV_LAND,
    Command.NAV_TAKEOFF,
    Command.NAV_DELAY,
    Command.DO_JUMP,
    Command.DO_CHANGE_SPEED,
}
"""Commands that are stored and given back, and passed over where the rover comes to them."""

_MOUNT_MAVLINK_TARGETING = 2.0  # MAV_MOUNT_MODE_MAVLINK_TARGETING


def kept_beyond_params(item: MissionItem) -> tuple[int, int, float]:
    """Return what is kept of x, y and z of a command that is stored without a place: ArduPilot puts other fields there."""
    x, y, z = item.lat_e7, item.lon_e7, item.alt_m
    if item.command == 202:  # DO_DIGICAM_CONFIGURE: exposure, command id, engine cutoff
        return x & 0xFF, y & 0xFF, float32(z)
    if item.command == 203:  # DO_DIGICAM_CONTROL: shoot, command id
        return x & 0xFF, y & 0xFF, 0.0
    if item.command == 205:  # DO_MOUNT_CONTROL: always by angles
        return 0, 0, _MOUNT_MAVLINK_TARGETING
    if item.command == 1000:  # DO_GIMBAL_MANAGER_PITCHYAW: flags, gimbal
        return x & 0xFF, 0, _uint8(z)
    if item.command == 42702:  # NAV_SCRIPT_TIME: two more arguments
        return _signed16(x), _signed16(y), 0.0
    if item.command == 42703:  # NAV_ATTITUDE_TIME: climb rate
        return x, 0, 0.0
    return 0, 0, 0.0


def _signed16(value: int) -> int:
    return (value + 0x8000) % 0x1_0000 - 0x8000
