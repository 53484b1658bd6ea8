"""Which parameters a vehicle is asked for: all that is read of them."""

from __future__ import annotations

from typing import Final

from missions.vehicle import PARAMETER_NAMES
from missions.vehicle.parameters import PARAMETERS, PX4_NAMES

STORAGE_NAMES: Final = ("BRD_SD_MISSION", "BRD_SD_FENCE")
"""How much the vehicle stores."""

_AT_THE_END: Final = ("MIS_DONE_BEHAVE", "RTL_SPEED", "RALLY_INCL_HOME", "RALLY_LIMIT_KM", "FS_ACTION")

ASKED_NAMES: Final = (*PARAMETER_NAMES, *STORAGE_NAMES, *_AT_THE_END)
"""What to ask for where a mission is to be planned and driven."""

CHECKED_NAMES: Final = (*ASKED_NAMES, "CIRC_RADIUS", "BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT")
"""What to ask for where any mission is checked. Vehicles without a battery monitor lack the last, and a name that is missing takes most of a second to find out."""

PX4_ASKED_NAMES: Final = tuple(name for name in PX4_NAMES if PARAMETERS[name].until is None)
"""What to ask PX4 for: all that is read of it, but for names that only older versions have."""
