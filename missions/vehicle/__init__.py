"""The vehicle: what its parameters set: how it drives and guards its fence, and its footprint."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle.ardupilot import ardupilot_vehicle
from missions.vehicle.model import Assumed, Autopilot, FenceParameters, Footprint, Pursuit, Steering, Vehicle
from missions.vehicle.parameters import PARAMETER_NAMES
from missions.vehicle.px4 import px4_vehicle
from missions.vehicle.reader import ParameterReader, bits, real_number, whole_number

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.firmware import Firmware

__all__ = [
    "PARAMETER_NAMES",
    "PX4_PREFIXES",
    "Assumed",
    "Autopilot",
    "FenceParameters",
    "Footprint",
    "Pursuit",
    "Steering",
    "Vehicle",
    "bits",
    "real_number",
    "vehicle_from_parameters",
    "whole_number",
]


def vehicle_from_parameters(
    parameters: Mapping[str, float],
    *,
    mav_type: int | None = None,
    firmware: Firmware | None = None,
    ardupilot: bool | None = None,
) -> Vehicle:
    """Return the vehicle that a set of autopilot parameters describes.

    Parameters
    ----------
    parameters : mapping of str to float
        Names and values as in PARAM_VALUE or a parameter file; may hold others, may lack some or all.
    mav_type : int, optional
        MAV_TYPE of the vehicle's heartbeat.
    firmware : Firmware, optional
        The autopilot's version.
    ardupilot : bool, optional
        Whether its heartbeat said that the autopilot is ArduPilot; default: judged by the names.

    Returns
    -------
    Vehicle
        PX4's where only PX4's names are there, else ArduPilot's. What was not known stands in ``assumed``.

    Raises
    ------
    VehicleError
        A value that is not a number or out of its range, with its name.
    """
    has_px4s = any(name.startswith(PX4_PREFIXES) for name in parameters)
    has_ardupilots = any(name.startswith(_ARDUPILOT_PREFIXES) for name in parameters)
    reader = ParameterReader(parameters, firmware)
    is_ardupilot = ardupilot if ardupilot is not None else has_ardupilots or not has_px4s
    made_by = ardupilot_vehicle if is_ardupilot else px4_vehicle
    return made_by(reader, mav_type)


PX4_PREFIXES = ("NAV_ACC_RAD", "RA_", "RD_", "RO_", "GF_", "PP_LOOKAHD_")
_ARDUPILOT_PREFIXES = ("WP_", "CRUISE_", "ATC_", "TURN_RADIUS", "FENCE_", "AVOID_", "OA_")
