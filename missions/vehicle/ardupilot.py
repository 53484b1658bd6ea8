"""ArduPilot Rover's parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed, FenceParameters, Steering, Vehicle
from missions.vehicle.reader import UNLIMITED_ACCEL_MPS2

if TYPE_CHECKING:
    from missions.vehicle.reader import ParameterReader

PARAMETER_NAMES = (
    "WP_RADIUS",
    "WP_SPEED",
    "CRUISE_SPEED",
    "TURN_RADIUS",
    "ATC_TURN_MAX_G",
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
    "FENCE_RADIUS",
    "FENCE_OPTIONS",
    "FENCE_ACTION",
    "AVOID_ENABLE",
    "OA_TYPE",
)
"""The parameters that matter here, for asking a vehicle; steering servos are looked for on the first four outputs."""

_GROUND_STEERING, _THROTTLE, _THROTTLE_LEFT, _THROTTLE_RIGHT = 26.0, 70.0, 73.0, 74.0


def ardupilot_vehicle(read: ParameterReader, mav_type: int | None) -> Vehicle:
    """Give the vehicle of ArduPilot Rover's parameters, each with ArduPilot's meaning of 0."""
    accel_max_mps2 = _accel_mps2(read)
    return Vehicle(
        waypoint_radius_m=read.value("WP_RADIUS", 2.0),
        speed_mps=_speed_mps(read),
        turn_radius_m=read.value("TURN_RADIUS", 0.9),
        turn_max_g=read.value("ATC_TURN_MAX_G", 0.6),
        accel_max_mps2=accel_max_mps2,
        jerk_mps3=read.value("WP_JERK", 0.0) or accel_max_mps2,
        position_gain_per_s=read.value("PSC_POS_P", 0.2, least=0.01),
        pivot_angle_deg=read.value("WP_PIVOT_ANGLE", 60.0),
        pivot_rate_dps=read.value("WP_PIVOT_RATE", 60.0),
        steering=_steering(read),
        fence=FenceParameters(
            enabled=bool(read.value("FENCE_ENABLE", 0)),
            type_bits=read.bits("FENCE_TYPE", 6),
            margin_m=read.value("FENCE_MARGIN", 2.0),
            radius_m=read.value("FENCE_RADIUS", 300.0),
            union=bool(read.bits("FENCE_OPTIONS", 0) & 2),
            action=read.bits("FENCE_ACTION", 1),
        ),
        avoid_bits=read.bits("AVOID_ENABLE", 3),
        oa_type=read.bits("OA_TYPE", 0),
        assumed=tuple(read.assumed),
        mav_type=mav_type,
    )


def _speed_mps(read: ParameterReader) -> float:
    known = read.known("WP_SPEED")
    if known is None and read.known("CRUISE_SPEED") is None:
        return read.value("WP_SPEED", 2.0)
    speed_mps = read.value("WP_SPEED", 0.0) or read.value("CRUISE_SPEED", 2.0)
    if speed_mps <= 0:
        raise VehicleError(
            "WP_SPEED and CRUISE_SPEED are both 0: the vehicle would not move", parameter="WP_SPEED"
        )
    return speed_mps


def _accel_mps2(read: ParameterReader) -> float:
    limits = [
        read.value("ATC_ACCEL_MAX", 1.0),
        read.known("ATC_DECEL_MAX") or 0.0,
        read.value("WP_ACCEL", 0.0),
    ]
    return min((limit for limit in limits if limit > 0), default=UNLIMITED_ACCEL_MPS2)


def _steering(read: ParameterReader) -> Steering:
    functions = {read.known(f"SERVO{channel}_FUNCTION") for channel in range(1, 33)}
    if {_THROTTLE_LEFT, _THROTTLE_RIGHT} <= functions:
        return Steering.SKID
    if not functions & {_GROUND_STEERING, _THROTTLE}:
        read.assumed.append(Assumed("SERVO1_FUNCTION", _GROUND_STEERING))
    return Steering.ACKERMANN
