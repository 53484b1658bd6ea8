"""What the drive model was measured on, and which vehicles lie outside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle import Autopilot, Steering
from missions.vehicle.model import MAV_TYPE_SURFACE_BOAT

if TYPE_CHECKING:
    from missions.vehicle import Vehicle

TOP_SPEED_MPS = {Steering.ACKERMANN: 5.0, Steering.SKID: 3.0}
"""The fastest rows of benchmarks/data: the skid-steered model's own top speed was 4 m/s (docs/drive-model.md)."""


SLOW_MPS = 1.0
"""Slower steered rovers swing out farther and farther: the firmware turns lateral acceleration into turn rate with at least 1 m/s."""

TURN_RATE_DPS = 120.0
"""ATC_STR_RAT_MAX as it was measured: ArduPilot's default."""

OLDEST_FIRMWARE = (4, 6, 0)
"""The first with the corners that were measured (upstream commit 56b99d4aa5, March 2025)."""


def beyond_measured(vehicle: Vehicle, slowest_mps: float | None = None) -> tuple[str, ...]:
    """Return in what a vehicle lies outside the measurements that the drive model rests on.

    The formulas go on beyond them (a larger turning radius swings out farther, a weaker position gain strays farther), but nothing was
    measured there.

    Parameters
    ----------
    vehicle : Vehicle
        What drives.
    slowest_mps : float, optional
        The least speed that is asked for on its way; default its own.

    Returns
    -------
    tuple of str
        One sentence each; empty where the vehicle is of the measured kind.
    """
    least_mps = vehicle.speed_mps if slowest_mps is None else min(slowest_mps, vehicle.speed_mps)
    firmware = vehicle.firmware or OLDEST_FIRMWARE
    top_mps = TOP_SPEED_MPS[vehicle.steering]
    checks = (
        (
            vehicle.autopilot is not Autopilot.ARDUPILOT,
            f"the drive model was measured on ArduPilot Rover, not on {vehicle.autopilot}",
        ),
        (vehicle.mav_type == MAV_TYPE_SURFACE_BOAT, "the drive model was measured on wheels, not on a boat"),
        (
            vehicle.speed_mps > top_mps,
            f"{vehicle.steering} steering was measured up to {top_mps:g} m/s, not at {vehicle.speed_mps:g} m/s",
        ),
        (
            vehicle.autopilot is Autopilot.ARDUPILOT
            and vehicle.steering is Steering.ACKERMANN
            and least_mps < SLOW_MPS,
            (
                f"the promise was not measured for steered rovers below {SLOW_MPS:g} m/s, and this one drives {least_mps:g} m/s: there they swing out "
                "farther and farther (after 90° 0.7 m at 1 m/s, 1.8 m at 0.5, 3.2 m at 0.3) and count waypoints as reached that they passed at a "
                f"distance; drive {SLOW_MPS:g} m/s or more"
            ),
        ),
        (
            vehicle.autopilot is Autopilot.ARDUPILOT and firmware < OLDEST_FIRMWARE,
            (
                f"the promise was not measured for ArduPilot {'.'.join(map(str, firmware))}: before 4.6 rovers cut corners up to twice as deep, and "
                "swing out as far as 5.4 m after sharp ones"
            ),
        ),
        (
            vehicle.steering is Steering.SKID
            and vehicle.firmware is None
            and any(one.parameter == "WP_PIVOT_ANGLE" for one in vehicle.assumed),
            (
                "WP_PIVOT_ANGLE is not known, nor the firmware's version: taken as 0, which needs more room (no turning on the spot; the default from "
                "ArduPilot 4.7 on, 60 before)"
            ),
        ),
        *_beyond_limits(vehicle),
    )
    return tuple(sentence for outside, sentence in checks if outside)


def _beyond_limits(vehicle: Vehicle) -> tuple[tuple[bool, str], ...]:
    """Return which of the vehicle's limits and gains were not measured."""
    turn_rate_dps = vehicle.turn_rate_max_dps or TURN_RATE_DPS  # 0 is no limit
    return (
        (
            vehicle.autopilot is Autopilot.ARDUPILOT and turn_rate_dps < TURN_RATE_DPS,
            f"turns were measured with ATC_STR_RAT_MAX {TURN_RATE_DPS:g}°/s, not {turn_rate_dps:g}°/s: slower ones swing out farther",
        ),
        (
            vehicle.steering is Steering.ACKERMANN and vehicle.turn_radius_m > 1.0,
            f"swings were measured at a turning radius of 0.9 m and are scaled to {vehicle.turn_radius_m:g} m",
        ),
        (vehicle.turn_max_g < 0.5, f"turns were measured with 0.6 g allowed, not {vehicle.turn_max_g:g} g"),
        (
            not 0.5 <= vehicle.accel_max_mps2 <= 2.0 or not 0.5 <= vehicle.jerk_mps3 <= 2.0,
            f"corners were measured with 1 m/s² and 1 m/s³, not {vehicle.accel_max_mps2:g} m/s² and {vehicle.jerk_mps3:g} m/s³",
        ),
        (
            not 0.15 <= vehicle.position_gain_per_s <= 0.3,  # chosen around the one measured value
            f"straying was measured at a position gain (PSC_POS_P) of 0.2, not {vehicle.position_gain_per_s:g}",
        ),
    )
