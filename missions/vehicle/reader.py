"""Reading parameters: each as what it can mean, or refused by its name; the one place where a parameter becomes a number of its own."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle.model import Assumed
from missions.vehicle.parameters import MOST, MOST_WHOLE, row_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.firmware import Firmware

UNLIMITED_ACCEL_MPS2 = 20.0
"""What ArduPilot takes where ATC_ACCEL_MAX is 0, "no limit" (AR_WPNav.cpp, AR_WPNAV_ACCEL_MAX)."""


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
    parameters: Mapping[str, float], name: str, default: int, *, least: int = 0, most: int = MOST_WHOLE
) -> int:
    """Return a parameter that is a whole number, rounded as ArduPilot rounds what it is sent; raises as `real_number`."""
    return round(real_number(parameters, name, default, least=least, most=most))


def bits(parameters: Mapping[str, float], name: str, default: int) -> int:
    """Return a parameter that is a bit mask; raises as `real_number`."""
    return whole_number(parameters, name, default)


class ParameterReader:
    """Reads parameters one by one as their table has them, and notes which were not there.

    Parameters
    ----------
    parameters : mapping of str to float
        Names and values.
    firmware : Firmware or None
        The version, which decides what some have by default.
    """

    def __init__(self, parameters: Mapping[str, float], firmware: Firmware | None = None) -> None:
        self.parameters = parameters
        self.firmware = firmware
        self.assumed: list[Assumed] = []

    def known(self, name: str) -> float | None:
        """Return the parameter, None where it is not there.

        Raises
        ------
        VehicleError
            It is not a number, or nothing drives with it.
        """
        if name not in self.parameters:
            return None
        row = row_of(name)
        value = real_number(self.parameters, name, 0.0, least=row.possible.least, most=row.possible.most)
        if 0 < value < row.no_less:
            raise VehicleError(
                f"{name} is {value:g}; possible are 0 and {row.no_less:g} to {row.possible.most:g}",
                parameter=name,
                value=value,
                least=row.no_less,
                most=row.possible.most,
            )
        return value

    def value(self, name: str) -> float:
        """Return the parameter, or its default and a note of it; raises as `known`."""
        known = self.known(name)
        if known is not None:
            return known
        default = row_of(name).default_of(self.firmware)
        assert default is not None
        self.assumed.append(Assumed(name, default))
        return default

    def bits(self, name: str) -> int:
        """Return the parameter as a whole number, or its default and a note of it; raises as `known`."""
        return round(self.value(name))
