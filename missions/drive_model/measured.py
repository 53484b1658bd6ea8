"""What the drive model was measured on, and which vehicles lie outside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle import Autopilot, Steering
from missions.vehicle.model import MAV_TYPE_SURFACE_BOAT

if TYPE_CHECKING:
    from missions.vehicle import Vehicle

TOP_SPEED_MPS = {Steering.ACKERMANN: 5.0, Steering.SKID: 3.0}


def beyond_measured(vehicle: Vehicle) -> tuple[str, ...]:
    """Say in what a vehicle lies outside the measurements that the drive model rests on.

    The formulas go on beyond them (a larger turning radius swings out farther, a weaker position gain strays farther), but nothing was
    measured there.

    Returns
    -------
    tuple of str
        One sentence each; empty where the vehicle is of the measured kind.
    """
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
            vehicle.steering is Steering.ACKERMANN and vehicle.turn_radius_m > 1.0,
            f"swings were measured at a turning radius of 0.9 m and are scaled to {vehicle.turn_radius_m:g} m",
        ),
        (vehicle.turn_max_g < 0.5, f"turns were measured with 0.6 g allowed, not {vehicle.turn_max_g:g} g"),
        (
            not 0.5 <= vehicle.accel_max_mps2 <= 2.0 or not 0.5 <= vehicle.jerk_mps3 <= 2.0,
            f"corners were measured with 1 m/s² and 1 m/s³, not {vehicle.accel_max_mps2:g} m/s² and {vehicle.jerk_mps3:g} m/s³",
        ),
        (
            not 0.15 <= vehicle.position_gain_per_s <= 0.3,
            f"straying was measured at a position gain (PSC_POS_P) of 0.2, not {vehicle.position_gain_per_s:g}",
        ),
    )
    return tuple(sentence for outside, sentence in checks if outside)
