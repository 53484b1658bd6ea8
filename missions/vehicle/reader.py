"""Reading parameters: each as what it can mean, or refused by its name; the one place where a parameter becomes a number of its own."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed

if TYPE_CHECKING:
    from collections.abc import Mapping

UNLIMITED_ACCEL_MPS2 = 20.0
"""What ArduPilot takes where ATC_ACCEL_MAX is 0, "no limit" (AR_WPNav.cpp, AR_WPNAV_ACCEL_MAX)."""

MOST = 10_000.0
"""More metres, metres a second or degrees than any rover's parameter can mean: FENCE_RADIUS, the longest of all, ends there (AC_Fence)."""

LEAST_MPS = 0.05
"""The least speed between waypoints that ArduPilot goes down to (AR_WPNav.cpp, AR_WPNAV_SPEED_MIN)."""

LEAST_ACCEL_MPS2 = 0.01
"""A rover that takes minutes to its speed: at less, no leg is driven within the day. The same number of m/s³ for its jerk."""

_MOST_WHOLE = 32_767
"""ArduPilot keeps enumerations and bit masks in 8 or 16 bits."""


def real_number(
    parameters: Mapping[str, float], name: str, default: float, *, least: float = 0.0, most: float = MOST
) -> float:
    """Return a parameter, or the default where it is not known.

    Raises
    ------
    VehicleError
        It is not a number, or out of range; the message says what is possible.
    """
    value = parameters.get(name)
    if value is None:
        return default
    if not math.isfinite(value):
        raise VehicleError(f"{name} is {value}, which is not a number", parameter=name, value=value)
    if not least <= value <= most:
        raise VehicleError(
            f"{name} is {value:g}; possible are {least:g} to {most:g}",
            parameter=name,
            value=value,
            least=least,
            most=most,
        )
    return float(value)


def whole_number(
    parameters: Mapping[str, float], name: str, default: int, *, least: int = 0, most: int = _MOST_WHOLE
) -> int:
    """Return a parameter that is a whole number, rounded as ArduPilot rounds what it is sent; raises as `real_number`."""
    return round(real_number(parameters, name, default, least=least, most=most))


def bits(parameters: Mapping[str, float], name: str, default: int) -> int:
    """Return a parameter that is a bit mask; raises as `real_number`."""
    return whole_number(parameters, name, default)


class ParameterReader:
    """Reads parameters one by one and notes which were not there."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.parameters = parameters
        self.assumed: list[Assumed] = []

    def known(self, name: str, *, least: float = -MOST, most: float = MOST) -> float | None:
        """Return the parameter, None where it is not there."""
        if name not in self.parameters:
            return None
        return real_number(self.parameters, name, 0.0, least=least, most=most)

    def value(self, name: str, default: float, *, least: float = 0.0, most: float = MOST) -> float:
        """Return the parameter, or the default and a note of it."""
        if name not in self.parameters:
            self.assumed.append(Assumed(name, default))
        return real_number(self.parameters, name, default, least=least, most=most)

    def limit(self, name: str, default: float, *, least: float, most: float) -> float:
        """Return a parameter whose 0 has a meaning of its own, and which nothing drives with between 0 and ``least``."""
        value = self.value(name, default, most=most)
        if 0 < value < least:
            raise VehicleError(
                f"{name} is {value:g}; possible are 0 and {least:g} to {most:g}",
                parameter=name,
                value=value,
                least=least,
                most=most,
            )
        return value

    def bits(self, name: str, default: int) -> int:
        """Return the parameter as a whole number, or the default and a note of it."""
        self.value(name, default, most=_MOST_WHOLE)
        return bits(self.parameters, name, default)
