"""Remarks on parameters with impossible values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.vehicle.item_limit import storage_remarks

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.situation import Situation

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
        f"{name} came as {came}, which is not a number: "
        + (f"it stays at {parameters[name]:g}, its last value" if name in parameters else "not known")
        for name, came in no_numbers.items()
    ]
    more = len(remarks) - _MOST_NAMED
    return [*remarks[:_MOST_NAMED], f"and {more} more parameters"] if more > 0 else remarks
