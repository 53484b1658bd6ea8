"""ArduPilot Rover's parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.firmware import Firmware
from missions.vehicle.model import MAV_TYPE_SURFACE_BOAT, Assumed, FenceParameters, Steering, Vehicle
from missions.vehicle.reader import UNLIMITED_ACCEL_MPS2

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.vehicle.reader import ParameterReader

# Values of SERVOn_FUNCTION (SRV_Channel.h).
_GROUND_STEERING, _THROTTLE, _THROTTLE_LEFT, _THROTTLE_RIGHT = 26.0, 70.0, 73.0, 74.0

_BOAT = 2.0  # of FRAME_CLASS (Rover.h)

_FIRST_MEASURED = Firmware(4, 6, 0, 128 + 6)
"""4.6.0-beta6, the first with the corners that were measured (upstream commit 56b99d4aa5, 24 March 2025)."""

_UNCLEAR_FROM, _UNCLEAR_TO = Firmware(4, 7, 0, 0), Firmware(4, 7, 0, 64)
"""4.7.0-dev, the line of development from November 2024 to March 2026: those corners came within it."""

_MEASURED_HAVE = "FENCE_NTF_FREQ"
"""Came into the line of development soon after those corners (ArduPilot pull request 29744, April 2025): who has it has them, whatever its number."""


def ardupilot_vehicle(read: ParameterReader, mav_type: int | None) -> Vehicle:
    """Return the vehicle of ArduPilot Rover's parameters, each with ArduPilot's meaning of 0."""
    if not read.parameters and read.firmware is None:
        read.assumed.append(Assumed("firmware", 4.6))
    accel_max_mps2 = _accel_mps2(read)
    margin_name, margin_m = _margin(read)
    is_boat = mav_type == MAV_TYPE_SURFACE_BOAT or read.known("FRAME_CLASS") == _BOAT
    return Vehicle(
        waypoint_radius_m=read.value("WP_RADIUS"),
        speed_mps=_speed_mps(read),
        turn_radius_m=read.value("TURN_RADIUS"),
        turn_max_g=read.value("ATC_TURN_MAX_G"),
        accel_max_mps2=accel_max_mps2,
        jerk_mps3=read.value("WP_JERK") or accel_max_mps2,
        position_gain_per_s=read.value("PSC_POS_P"),
        pivot_angle_deg=read.value("WP_PIVOT_ANGLE"),
        pivot_rate_dps=read.value("WP_PIVOT_RATE"),
        turn_rate_max_dps=read.known("ATC_STR_RAT_MAX"),
        turn_accel_max_dps2=min(
            filter(None, map(read.known, ("ATC_STR_ACC_MAX", "ATC_STR_DEC_MAX"))), default=None
        ),
        steering=_steering(read),
        fence=FenceParameters(
            enabled=bool(read.value("FENCE_ENABLE")),
            type_bits=read.bits("FENCE_TYPE"),
            margin_m=margin_m,
            margin_name=margin_name,
            radius_m=read.value("FENCE_RADIUS"),
            union=bool(read.bits("FENCE_OPTIONS") & 2),
            action=read.bits("FENCE_ACTION"),
            avoid_bits=read.bits("AVOID_ENABLE"),
            backs_away=read.value("AVOID_BACKUP_SPD") > 0,
            oa_type=read.bits("OA_TYPE"),
        ),
        boat_drift_m=read.value("LOIT_RADIUS") if is_boat else None,
        assumed=tuple(read.assumed),
        mav_type=mav_type,
        firmware=read.firmware,
        has_measured_corners=_has_measured_corners(read.firmware, read.parameters),
    )


def _has_measured_corners(firmware: Firmware | None, parameters: Mapping[str, float]) -> bool | None:
    """Return whether the firmware blends corners as 4.6 does; None where neither its version nor the names of its parameters say.

    A vehicle of which nothing at all is known is taken for one with ArduPilot's present defaults, as a remark says of each.
    """
    if _MEASURED_HAVE in parameters or (firmware is None and not parameters):
        return True
    if firmware is None or _UNCLEAR_FROM <= firmware < _UNCLEAR_TO:
        return None
    return firmware >= _FIRST_MEASURED


def _margin(read: ParameterReader) -> tuple[str, float]:
    """Return the margin that horizontal fences have, and its name: FENCE_MARGIN_XY where there is one above 0 (from 4.7 on)."""
    flat_m = read.known("FENCE_MARGIN_XY")
    if flat_m:
        return "FENCE_MARGIN_XY", flat_m
    return "FENCE_MARGIN", read.value("FENCE_MARGIN")


def _speed_mps(read: ParameterReader) -> float:
    known_mps, cruise_mps = read.known("WP_SPEED"), read.known("CRUISE_SPEED")
    if known_mps is None and cruise_mps is None:
        return read.value("WP_SPEED")
    if known_mps is None:
        read.assumed.append(Assumed("WP_SPEED", 0.0))
    speed_mps = known_mps or read.value("CRUISE_SPEED")
    if speed_mps <= 0:
        raise VehicleError(
            "WP_SPEED and CRUISE_SPEED are both 0: the vehicle would not move", parameter="WP_SPEED"
        )
    return speed_mps


def _accel_mps2(read: ParameterReader) -> float:
    limits = (read.value("ATC_ACCEL_MAX"), read.known("ATC_DECEL_MAX") or 0.0, read.value("WP_ACCEL"))
    return min((limit for limit in limits if limit > 0), default=UNLIMITED_ACCEL_MPS2)


def _steering(read: ParameterReader) -> Steering:
    functions = {read.known(f"SERVO{channel}_FUNCTION") for channel in range(1, 33)}
    if {_THROTTLE_LEFT, _THROTTLE_RIGHT} <= functions:
        return Steering.SKID
    if not functions & {_GROUND_STEERING, _THROTTLE}:
        read.assumed.append(Assumed("SERVO1_FUNCTION", _GROUND_STEERING))
    return Steering.ACKERMANN
