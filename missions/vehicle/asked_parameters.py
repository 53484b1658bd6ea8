"""Which parameters a vehicle is asked for: all that is read of them."""

from __future__ import annotations

from typing import Final

from missions.vehicle import PARAMETER_NAMES

STORAGE_NAMES: Final = ("BRD_SD_MISSION", "BRD_SD_FENCE")
"""How much the vehicle stores."""

_AT_THE_END: Final = ("MIS_DONE_BEHAVE", "RTL_SPEED", "RALLY_INCL_HOME", "RALLY_LIMIT_KM", "FS_ACTION")

ASKED_NAMES: Final = (*PARAMETER_NAMES, *STORAGE_NAMES, *_AT_THE_END)
"""What to ask for where a mission is to be planned and driven."""

CHECKED_NAMES: Final = (*ASKED_NAMES, "CIRC_RADIUS", "BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT")
"""What to ask for where any mission is checked. Vehicles without a battery monitor lack the last, and a name that is missing takes most of a second to find out."""

PX4_ASKED_NAMES: Final = (
    *("CA_AIRFRAME", "NAV_ACC_RAD", "GF_ACTION", "GF_MAX_HOR_DIST"),
    *("RA_ACC_RAD_MAX", "RA_ACC_RAD_GAIN", "RA_WHEEL_BASE", "RA_MAX_STR_ANG"),
    *(
        "RO_SPEED_LIM",
        "RO_MAX_THR_SPEED",
        "RO_SPEED_RED",
        "RO_ACCEL_LIM",
        "RO_DECEL_LIM",
        "RO_JERK_LIM",
        "RO_YAW_RATE_LIM",
    ),
    *("PP_LOOKAHD_GAIN", "PP_LOOKAHD_MIN", "PP_LOOKAHD_MAX"),
)
"""What a PX4 rover is asked for: the names that v1.17 and the line of 1.18 have. Those of version 1.15 would only hold it up."""
