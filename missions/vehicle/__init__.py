"""The vehicle: what its parameters set: how it drives and guards its fence, and its footprint."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle.ardupilot import ardupilot_vehicle
from missions.vehicle.model import (
    GROUND_TYPES,
    Assumed,
    Autopilot,
    FenceParameters,
    Footprint,
    Pursuit,
    Steering,
    Vehicle,
)
from missions.vehicle.parameters import PARAMETER_NAMES
from missions.vehicle.px4 import px4_vehicle
from missions.vehicle.reader import ParameterReader, bits, real_number, whole_number

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from missions.firmware import Firmware
    from missions.situation import Situation

__all__ = [
    "GROUND_TYPES",
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
    "is_ardupilots",
    "known_ardupilot",
    "known_type",
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
    told = ardupilot if ardupilot is not None else is_ardupilots(parameters)
    made_by = px4_vehicle if told is False else ardupilot_vehicle
    return made_by(ParameterReader(parameters, firmware), mav_type)


def is_ardupilots(parameters: Iterable[str]) -> bool | None:
    """Return whether parameters are ArduPilot's, by their names; False for PX4's, None where no name says it."""
    names = tuple(parameters)
    if any(name.startswith(_ARDUPILOT_PREFIXES) for name in names):
        return True
    return False if any(name.startswith(PX4_PREFIXES) for name in names) else None


def known_ardupilot(situation: Situation) -> bool | None:
    """Return whether a situation's autopilot is ArduPilot, PX4 is False: by what it reports, its parameters' names, what a file was made for, in that order."""
    known = situation.ardupilot if situation.ardupilot is not None else is_ardupilots(situation.parameters)
    made_for = situation.reading.made_for
    return made_for.ardupilot if known is None and made_for is not None else known


def known_type(situation: Situation) -> int | None:
    """Return a situation's MAV_TYPE; where none was heard that of a boat or a rover which a file was made for."""
    made_for = situation.reading.made_for
    if situation.vehicle_type is not None or made_for is None:
        return situation.vehicle_type
    return made_for.vehicle_type if made_for.vehicle_type in GROUND_TYPES else None


PX4_PREFIXES = ("CA_AIRFRAME", "NAV_ACC_RAD", "RA_", "RD_", "RO_", "GF_", "PP_LOOKAHD_")
_ARDUPILOT_PREFIXES = ("WP_", "CRUISE_", "ATC_", "TURN_RADIUS", "FENCE_", "AVOID_", "OA_")
