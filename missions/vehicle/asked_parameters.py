"""Which parameters a vehicle is asked for: all that anything here reads."""

from __future__ import annotations

from typing import Final

from missions.vehicle import PARAMETER_NAMES

STORAGE_NAMES: Final = ("BRD_SD_MISSION", "BRD_SD_FENCE")
"""How much the vehicle stores."""

_AT_THE_END: Final = ("MIS_DONE_BEHAVE", "RTL_SPEED", "RALLY_INCL_HOME", "RALLY_LIMIT_KM", "CIRC_RADIUS")
_FAILSAFES: Final = ("FS_ACTION", "BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT")

ASKED_NAMES: Final = (*PARAMETER_NAMES, *STORAGE_NAMES, *_AT_THE_END, *_FAILSAFES)
"""What to ask for where a mission is to be planned, checked or driven."""
