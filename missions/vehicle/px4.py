"""PX4's rover parameters, of its present names (RO_, RA_, RD_) and those of version 1.15."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed, Autopilot, FenceParameters, Pursuit, Steering, Vehicle
from missions.vehicle.reader import UNLIMITED_ACCEL_MPS2

if TYPE_CHECKING:
    from missions.vehicle.reader import ParameterReader

_SETTLES_PER_S = 0.4
"""How fast an error beside the line dies away: pure pursuit's e-fold is its lookahead, PP_LOOKAHD_GAIN (1 s) times the speed; taken as 2.5 s, chosen."""


def px4_vehicle(read: ParameterReader, mav_type: int | None) -> Vehicle:
    """Return the vehicle of PX4's rover parameters; -1 is no limit."""
    steering = _steering(read)
    nav_acceptance_m = read.value("NAV_ACC_RAD")
    skid = steering is Steering.SKID
    accel_max_mps2 = _limit(
        read, ("RO_ACCEL_LIM", "RO_DECEL_LIM", "RD_MAX_ACCEL" if skid else "RA_MAX_ACCEL")
    )
    jerk_mps3 = _limit(read, ("RO_JERK_LIM", "RD_MAX_JERK" if skid else "RA_MAX_JERK"))
    action = read.bits("GF_ACTION")
    turn_radius_m = 0.0 if skid else _turn_radius_m(read)
    pursuit = None if skid else _pursuit(read, nav_acceptance_m)
    return Vehicle(
        waypoint_radius_m=nav_acceptance_m if pursuit is None else max(nav_acceptance_m, _most_m(pursuit)),
        speed_mps=_speed_mps(read, skid=skid),
        turn_radius_m=turn_radius_m,
        position_gain_per_s=_SETTLES_PER_S,
        accel_max_mps2=accel_max_mps2,
        jerk_mps3=jerk_mps3,
        pivot_angle_deg=math.degrees(read.value("RD_TRANS_DRV_TRN")) if skid else 0.0,
        pivot_rate_dps=read.known("RO_YAW_RATE_LIM") or 90.0,
        steering=steering,
        autopilot=Autopilot.PX4,
        fence=FenceParameters(
            enabled=action > 0,
            margin_m=0.0,
            radius_m=read.value("GF_MAX_HOR_DIST"),
            radius_name="GF_MAX_HOR_DIST",
            action=action,
            avoid_bits=0,
            backs_away=False,
        ),
        assumed=tuple(read.assumed),
        mav_type=mav_type,
        firmware=read.firmware,
        pursuit=pursuit,
    )


def _pursuit(read: ParameterReader, nav_acceptance_m: float) -> Pursuit:
    return Pursuit(
        acceptance_m=nav_acceptance_m,
        acceptance_max_m=read.known("RA_ACC_RAD_MAX"),
        acceptance_gain=read.value("RA_ACC_RAD_GAIN"),
        wheel_base_m=read.value("RA_WHEEL_BASE"),
        steering_angle_rad=read.value("RA_MAX_STR_ANG"),
        full_speed_mps=read.known("RO_MAX_THR_SPEED"),
        speed_reduction=read.value("RO_SPEED_RED"),
        lookahead_gain_s=read.value("PP_LOOKAHD_GAIN"),
        lookahead_least_m=read.value("PP_LOOKAHD_MIN"),
        lookahead_most_m=read.value("PP_LOOKAHD_MAX"),
    )


def _most_m(pursuit: Pursuit) -> float:
    """Return how far before a waypoint the next leg begins at the earliest; PX4's default where that is not known."""
    return 3.0 if pursuit.acceptance_max_m is None else pursuit.acceptance_max_m


def _steering(read: ParameterReader) -> Steering:
    # A rover build of PX4 has the parameters of all its rovers; the airframe decides which one drives.
    airframe = read.known("CA_AIRFRAME")
    if airframe in {6.0, 13.0}:
        return Steering.SKID
    if airframe == 5.0:
        return Steering.ACKERMANN
    differential = any(name.startswith("RD_") for name in read.parameters)
    ackermann = any(name.startswith("RA_") for name in read.parameters)
    if differential and not ackermann:
        return Steering.SKID
    if differential or not ackermann:
        read.assumed.append(Assumed("CA_AIRFRAME", 5.0))
    return Steering.ACKERMANN


def _speed_mps(read: ParameterReader, *, skid: bool) -> float:
    """Return the first speed that is set: of the mission, of the limit, at full throttle."""
    mission = "RD_MISS_SPD_DEF" if skid else "RA_MISS_VEL_DEF"
    for name in (mission, "RO_SPEED_LIM", "RO_MAX_THR_SPEED"):
        speed_mps = read.known(name)
        if speed_mps is not None and speed_mps > 0:
            return speed_mps
    read.assumed.append(Assumed("RO_SPEED_LIM", 2.0))
    return 2.0


def _turn_radius_m(read: ParameterReader) -> float:
    wheel_base_m = read.value("RA_WHEEL_BASE")
    steering_angle_rad = read.value("RA_MAX_STR_ANG")
    if not 0 < steering_angle_rad < math.pi / 2:
        raise VehicleError(
            f"RA_MAX_STR_ANG is {steering_angle_rad:g} rad; it must be between 0 and 1.57",
            parameter="RA_MAX_STR_ANG",
            value=steering_angle_rad,
        )
    return wheel_base_m / math.tan(steering_angle_rad)


def _limit(read: ParameterReader, names: tuple[str, ...]) -> float:
    """Return the least of some limits, where -1 means no limit."""
    known = [limit for limit in (read.known(name) for name in names) if limit is not None]
    if not known:
        read.assumed.append(Assumed(names[0], UNLIMITED_ACCEL_MPS2))
    return min((limit for limit in known if limit > 0), default=UNLIMITED_ACCEL_MPS2)
