"""ArduPilot Rover's parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed, FenceParameters, Steering, Vehicle
from missions.vehicle.reader import LEAST_ACCEL_MPS2, LEAST_MPS, UNLIMITED_ACCEL_MPS2

if TYPE_CHECKING:
    from missions.vehicle.reader import ParameterReader

PARAMETER_NAMES = (
    "WP_RADIUS",
    "WP_SPEED",
    "CRUISE_SPEED",
    "TURN_RADIUS",
    "ATC_TURN_MAX_G",
    "ATC_STR_RAT_MAX",
    "ATC_ACCEL_MAX",
    "ATC_DECEL_MAX",
    "WP_ACCEL",
    "WP_JERK",
    "PSC_POS_P",
    "WP_PIVOT_ANGLE",
    "WP_PIVOT_RATE",
    "SERVO1_FUNCTION",
    "SERVO2_FUNCTION",
    "SERVO3_FUNCTION",
    "SERVO4_FUNCTION",
    "FENCE_ENABLE",
    "FENCE_TYPE",
    "FENCE_MARGIN",
    "FENCE_MARGIN_XY",
    "FENCE_RADIUS",
    "FENCE_OPTIONS",
    "FENCE_ACTION",
    "AVOID_ENABLE",
    "AVOID_BACKUP_SPD",
    "OA_TYPE",
)
"""The parameters that matter here, for asking a vehicle; steering servos are looked for on the first four outputs."""

# Values of SERVOn_FUNCTION (SRV_Channel.h).
_GROUND_STEERING, _THROTTLE, _THROTTLE_LEFT, _THROTTLE_RIGHT = 26.0, 70.0, 73.0, 74.0


_MOST = 100.0
"""More m/s, m/s², m/s³ and g no rover drives; ArduPilot documents WP_SPEED up to 100."""

_MOST_RADIUS_M = 1000.0
"""More metres about a waypoint or before a fence, or degrees a second, mean nothing; ArduPilot documents up to 100."""

_NEVER_PIVOTS_FROM = (4, 7, 0)
"""From this version on WP_PIVOT_ANGLE is 0 where nobody set it (60 before)."""


def ardupilot_vehicle(
    read: ParameterReader, mav_type: int | None, firmware: tuple[int, int, int] | None
) -> Vehicle:
    """Return the vehicle of ArduPilot Rover's parameters, each with ArduPilot's meaning of 0."""
    accel_max_mps2 = _accel_mps2(read)
    steering = _steering(read)
    margin_name, margin_m = _margin(read)
    return Vehicle(
        waypoint_radius_m=read.value("WP_RADIUS", 2.0, most=_MOST_RADIUS_M),
        speed_mps=_speed_mps(read),
        turn_radius_m=read.value("TURN_RADIUS", 0.9, most=_MOST_RADIUS_M),
        turn_max_g=read.value("ATC_TURN_MAX_G", 0.6, most=_MOST),
        accel_max_mps2=accel_max_mps2,
        jerk_mps3=read.limit("WP_JERK", 0.0, least=LEAST_ACCEL_MPS2, most=_MOST) or accel_max_mps2,
        position_gain_per_s=read.value("PSC_POS_P", 0.2, least=0.01, most=_MOST),
        pivot_angle_deg=_pivot_angle_deg(read, steering, firmware),
        pivot_rate_dps=read.value("WP_PIVOT_RATE", 60.0, most=_MOST_RADIUS_M),
        turn_rate_max_dps=read.known("ATC_STR_RAT_MAX", least=0.0, most=_MOST_RADIUS_M),
        steering=steering,
        fence=FenceParameters(
            enabled=bool(read.value("FENCE_ENABLE", 0)),
            type_bits=read.bits("FENCE_TYPE", 6),
            margin_m=margin_m,
            margin_name=margin_name,
            radius_m=read.value("FENCE_RADIUS", 300.0),
            union=bool(read.bits("FENCE_OPTIONS", 0) & 2),
            action=read.bits("FENCE_ACTION", 1),
        ),
        avoid_bits=read.bits("AVOID_ENABLE", 3),
        backs_away=read.value("AVOID_BACKUP_SPD", 0.75) > 0,
        oa_type=read.bits("OA_TYPE", 0),
        assumed=tuple(read.assumed),
        mav_type=mav_type,
        firmware=firmware,
    )


def _margin(read: ParameterReader) -> tuple[str, float]:
    """Return the margin that horizontal fences have, and its name: FENCE_MARGIN_XY where there is one above 0 (from 4.7 on)."""
    flat_m = read.known("FENCE_MARGIN_XY", least=0.0, most=_MOST_RADIUS_M)
    if flat_m:
        return "FENCE_MARGIN_XY", flat_m
    return "FENCE_MARGIN", read.value("FENCE_MARGIN", 2.0, most=_MOST_RADIUS_M)


def _pivot_angle_deg(
    read: ParameterReader, steering: Steering, firmware: tuple[int, int, int] | None
) -> float:
    """Return WP_PIVOT_ANGLE; where neither it nor the version is known, 0: a rover that does not pivot needs more room."""
    pivots_by_default = firmware is not None and firmware < _NEVER_PIVOTS_FROM
    default_deg = 60.0 if pivots_by_default or steering is not Steering.SKID else 0.0
    return read.value("WP_PIVOT_ANGLE", default_deg, most=360.0)


def _speed_mps(read: ParameterReader) -> float:
    known = read.known("WP_SPEED")
    if known is None and read.known("CRUISE_SPEED") is None:
        return read.value("WP_SPEED", 2.0, most=_MOST)
    speed_mps = read.limit("WP_SPEED", 0.0, least=LEAST_MPS, most=_MOST) or read.limit(
        "CRUISE_SPEED", 2.0, least=LEAST_MPS, most=_MOST
    )
    if speed_mps <= 0:
        raise VehicleError(
            "WP_SPEED and CRUISE_SPEED are both 0: the vehicle would not move", parameter="WP_SPEED"
        )
    return speed_mps


def _accel_mps2(read: ParameterReader) -> float:
    limits = [
        read.limit("ATC_ACCEL_MAX", 1.0, least=LEAST_ACCEL_MPS2, most=_MOST),
        read.limit("ATC_DECEL_MAX", 0.0, least=LEAST_ACCEL_MPS2, most=_MOST)
        if "ATC_DECEL_MAX" in read.parameters
        else 0.0,
        read.limit("WP_ACCEL", 0.0, least=LEAST_ACCEL_MPS2, most=_MOST),
    ]
    return min((limit for limit in limits if limit > 0), default=UNLIMITED_ACCEL_MPS2)


def _steering(read: ParameterReader) -> Steering:
    functions = {read.known(f"SERVO{channel}_FUNCTION") for channel in range(1, 33)}
    if {_THROTTLE_LEFT, _THROTTLE_RIGHT} <= functions:
        return Steering.SKID
    if not functions & {_GROUND_STEERING, _THROTTLE}:
        read.assumed.append(Assumed("SERVO1_FUNCTION", _GROUND_STEERING))
    return Steering.ACKERMANN
