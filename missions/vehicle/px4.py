"""PX4's rover parameters, of its present names (RO_, RA_, RD_) and those of version 1.15."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed, Autopilot, FenceParameters, Steering, Vehicle
from missions.vehicle.reader import UNLIMITED_ACCEL_MPS2

if TYPE_CHECKING:
    from missions.vehicle.reader import ParameterReader


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
    return Vehicle(
        waypoint_radius_m=nav_acceptance_m if skid else max(nav_acceptance_m, read.value("RA_ACC_RAD_MAX")),
        speed_mps=_speed_mps(read, skid=skid),
        turn_radius_m=0.0 if skid else _turn_radius_m(read),
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
            action=action,
            avoid_bits=0,
            backs_away=False,
        ),
        assumed=tuple(read.assumed),
        mav_type=mav_type,
        firmware=read.firmware,
    )


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
