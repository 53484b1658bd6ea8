"""Which parameters of ArduPilot Rover lead to RTL when nobody is there to help, and which should not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.vehicle import Vehicle


@dataclass(frozen=True, slots=True)
class Failsafe:
    """A parameter that decides what a failsafe does.

    Parameters
    ----------
    parameter : str
        Its name.
    advised : float
        What to set it to.
    meaning : str
        What that does.
    now : float or None
        What it is; None where it is not known.
    """

    parameter: str
    advised: float
    meaning: str
    now: float | None

    def __str__(self) -> str:
        now = "" if self.now is None else " (as it is)" if self.is_set else f" (now {self.now:g})"
        return f"{self.parameter} {self.advised:g}{now}: {self.meaning}"

    @property
    def is_set(self) -> bool:
        """Whether it is as advised."""
        return self.now == self.advised

    def document(self) -> dict[str, object]:
        """Return it for a JSON document."""
        return {
            "parameter": self.parameter,
            "advised": self.advised,
            "now": self.now,
            "meaning": self.meaning,
        }


_ADVISED = (
    ("FS_ACTION", 1.0, "RTL on a failsafe"),
    (
        "FS_GCS_ENABLE",
        1.0,
        "failsafe when the ground station's heartbeat is lost; pbpp sends no such heartbeat, for it is no ground station",
    ),
    ("FS_THR_ENABLE", 1.0, "failsafe when the transmitter is lost"),
    ("BATT_FS_LOW_ACT", 1.0, "RTL on a low battery, at BATT_LOW_VOLT or BATT_LOW_MAH"),
    ("FENCE_ACTION", 2.0, "Hold after a breach: outside the fence no line was checked"),
    ("RTL_SPEED", 0.0, "RTL at WP_SPEED, for which the corridor is predicted"),
)
"""Rover/failsafe.cpp and Rover/Parameters.cpp of ArduPilot: 1 is RTL, 2 Hold; FS_GCS_ENABLE and FS_THR_ENABLE 2 would go on with the mission in AUTO."""


def failsafe_advice(parameters: Mapping[str, float], vehicle: Vehicle) -> tuple[Failsafe, ...]:
    """Return what to set so that a vehicle drives home on its own, and what it is set to."""
    straight = (
        (("OA_TYPE", 0.0, "RTL drives straight: the lines are free, a path of its own may not be"),)
        if vehicle.oa_type
        else ()
    )
    return tuple(
        Failsafe(name, advised, meaning, parameters.get(name))
        for name, advised, meaning in (*_ADVISED, *straight)
    )
