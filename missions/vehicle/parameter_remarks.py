"""Remarks on parameters: impossible values, and defaults that stand in for values that are not known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle.item_limit import storage_remarks
from missions.vehicle.model import Autopilot, Steering
from missions.vehicle.parameters import row_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.situation import Situation
    from missions.vehicle import Vehicle

_MOST_NAMED = 5  # chosen: remarks that fit a screen; the rest is counted


def parameter_remarks(situation: Situation) -> list[str]:
    """Return remarks on parameters that the vehicle reported with impossible values."""
    return [
        *no_number_remarks(situation.no_numbers, situation.parameters),
        *storage_remarks(situation.parameters),
    ]


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
    if assumed:
        remarks.append(
            f"parameters missing, {vehicle.autopilot} defaults used: {', '.join(assumed)} (use a --vehicle FILE.parm that has them)"
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
