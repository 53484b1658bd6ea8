"""What differs between versions of ArduPilot Rover: when they begin a turn, which parameters they have, whether skid steering pivots.

Measured apart from the drive model: `tests/mavlink_bridge/simulator/test_fidelity.py` lists the corners before 4.6 that are not followed.
"""

from __future__ import annotations

from collections.abc import Mapping

from missions.firmware import Firmware

_NEW_TURNS = Firmware(4, 6, 0, 134)
"""4.6.0-beta6 has SCurve.cpp's change of March 2025: the next leg starts only once the present one brakes."""

_RELEASED_4_7 = Firmware(4, 7, 0, 64)
_NAMES_SINCE_4_7 = frozenset({"ATC_STR_DEC_MAX", "FENCE_MARGIN_XY", "FENCE_NTF_FREQ"})

DEVELOPMENT = Firmware(4, 7, 0, 0)
"""What it says that it is where it was given no version: 4.7.0-dev of October 2025, which has all names, and pivots."""


def turns_early(firmware: Firmware | None) -> bool:
    """Whether the version begins turns as those before 4.6 do."""
    return firmware is not None and firmware < _NEW_TURNS


def missing_names(firmware: Firmware | None) -> frozenset[str]:
    """Return the parameters that the version does not have."""
    return _NAMES_SINCE_4_7 if firmware is not None and firmware < DEVELOPMENT else frozenset()


def version_number(firmware: Firmware | None) -> int:
    """Return the version as AUTOPILOT_VERSION tells it, a byte each from the top."""
    told = firmware or DEVELOPMENT
    return told.major << 24 | told.minor << 16 | told.patch << 8 | told.stage


def own_defaults(firmware: Firmware | None) -> Mapping[str, float]:
    """Return the defaults that are not those of `DEVELOPMENT`: since 4.7 skid steering does not pivot."""
    return {"WP_PIVOT_ANGLE": 0.0} if firmware is not None and firmware >= _RELEASED_4_7 else {}
