"""Remarks on parameters: impossible values, and defaults that stand in for values that are not known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle import is_ardupilots, known_ardupilot
from missions.vehicle.item_limit import storage_remarks
from missions.vehicle.model import Autopilot, Steering
from missions.vehicle.parameters import PARAMETERS, PX4_NAMES, row_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.situation import Situation
    from missions.vehicle import Vehicle
    from missions.vehicle.parameters import Parameter

_MOST_NAMED = 5  # chosen: remarks that fit a screen; the rest is counted


def parameter_remarks(situation: Situation) -> list[str]:
    """Return remarks on parameters that the vehicle reported with impossible values."""
    return [
        *made_for_remarks(situation),
        *no_number_remarks(situation.no_numbers, situation.parameters),
        *range_remarks(situation.parameters, ardupilot=situation.ardupilot),
        *storage_remarks(situation.parameters),
    ]


def range_remarks(parameters: Mapping[str, float], *, ardupilot: bool | None = None) -> list[str]:
    """Return which of PX4's parameters have values that PX4 does not document.

    PX4 checks nothing: it keeps whatever it is sent, so that a value out of range is more likely a mistake than meant. ArduPilot's recommended ranges are
    narrower than what is driven with, and are not told.

    Parameters
    ----------
    parameters : mapping of str to float
        Those of one vehicle.
    ardupilot : bool, optional
        Whether the autopilot is ArduPilot; default: judged by the names.
    """
    if ardupilot or (ardupilot is None and is_ardupilots(parameters) is not False):
        return []
    remarks = [
        f"{name} is {parameters[name]:.9g}; {trouble}, and PX4 does not check it"
        for name in PX4_NAMES
        if name in parameters and (trouble := _range_trouble(PARAMETERS[name], parameters[name]))
    ]
    more = len(remarks) - _MOST_NAMED
    return [*remarks[:_MOST_NAMED], f"and {more} more parameters out of range"] if more > 0 else remarks


def _range_trouble(row: Parameter, value: float) -> str:
    if row.is_whole and value != round(value):
        return "PX4 keeps a whole number there (INT32)"
    if row.documented is not None and value not in row.documented:
        return f"PX4 documents {row.documented}"
    return ""


def made_for_remarks(situation: Situation) -> list[str]:
    """Return that a file was made for another autopilot than the vehicle's; or that it alone says that this is PX4."""
    made_for = situation.reading.made_for
    if made_for is None or made_for.ardupilot is None:
        return []
    known = known_ardupilot(situation)
    name, own = (
        Autopilot.ARDUPILOT if is_ardupilot else Autopilot.PX4 for is_ardupilot in (made_for.ardupilot, known)
    )
    if known != made_for.ardupilot:
        return [f"{made_for.source} is made for {name} (firmwareType), but the vehicle is {own}"]
    is_alone = situation.ardupilot is None and is_ardupilots(situation.parameters) is None
    if is_alone and not made_for.ardupilot:
        return [
            f"assuming {name}, as {made_for.source} says (firmwareType): none of the vehicle's parameters is known; give them with --vehicle FILE, they take precedence"
        ]
    return []


def no_number_remarks(no_numbers: Mapping[str, str], parameters: Mapping[str, float]) -> list[str]:
    """Return which parameters came as no number, and what counts in their place."""
    remarks = [
        f"{name} received as {came}, which is not a number: "
        + (f"last value {parameters[name]:g} kept" if name in parameters else "unknown")
        for name, came in no_numbers.items()
    ]
    more = len(remarks) - _MOST_NAMED
    return [*remarks[:_MOST_NAMED], f"and {more} more parameters"] if more > 0 else remarks


def assumed_remarks(vehicle: Vehicle) -> list[str]:
    """Return remarks on defaults that stand in for the vehicle's own parameters, and decide how it drives."""
    assumed = [
        f"{one.parameter} {one.value:g}"
        for one in vehicle.assumed
        if one.parameter != "firmware" and row_of(one.parameter).is_told
    ]
    remarks = [f"{one}" for one in vehicle.assumed if one.parameter == "firmware"]
    is_ardupilot = vehicle.autopilot is Autopilot.ARDUPILOT
    # What PX4's has by default says nothing: rovers are set up by their airframe, and 0 or -1 is "not set".
    taken = f"{vehicle.autopilot} defaults used" if is_ardupilot else "assuming"
    if assumed:
        remarks.append(
            f"parameters missing, {taken}: {', '.join(assumed)} (use a --vehicle FILE that has them)"
        )
    if (
        vehicle.steering is Steering.SKID
        and vehicle.autopilot is Autopilot.ARDUPILOT
        and vehicle.pivot_angle_deg == 0
        and any(one.parameter == "WP_PIVOT_ANGLE" for one in vehicle.assumed)
    ):
        remarks.append(
            "WP_PIVOT_ANGLE unknown; assuming 0 (no pivot turns, which needs more room; the default is 0 from ArduPilot 4.7 on, 60 before)"
        )
    return remarks
