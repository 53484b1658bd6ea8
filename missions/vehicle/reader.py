"""Reading parameters one by one, with a note of those that were not there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed

if TYPE_CHECKING:
    from collections.abc import Mapping

UNLIMITED_ACCEL_MPS2 = 20.0
"""What ArduPilot takes where ATC_ACCEL_MAX is 0, "no limit" (AR_WPNav.cpp, AR_WPNAV_ACCEL_MAX)."""


class ParameterReader:
    """Reads parameters one by one and notes which were not there."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.parameters = parameters
        self.assumed: list[Assumed] = []

    def known(self, name: str) -> float | None:
        """Give the parameter, None where it is not there."""
        value = self.parameters.get(name)
        if value is None:
            return None
        if not math.isfinite(value):
            raise VehicleError(f"{name} is {value}, which is no number", parameter=name, value=value)
        return float(value)

    def value(self, name: str, default: float, *, least: float = 0.0) -> float:
        """Give the parameter, or the default and a note of it."""
        value = self.known(name)
        if value is None:
            self.assumed.append(Assumed(name, default))
            return default
        if value < least:
            raise VehicleError(
                f"{name} is {value:g}; it cannot be below {least:g}", parameter=name, value=value
            )
        return value

    def bits(self, name: str, default: int) -> int:
        """Give the parameter as a whole number, or the default and a note of it."""
        return int(self.value(name, default))
