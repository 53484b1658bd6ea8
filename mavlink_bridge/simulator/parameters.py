"""The parameters of the simulated rover: ArduRover 4.7's, as far as something here depends on them or clients ask for them."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError
from mavlink_bridge.simulator.personality import missing_names, own_defaults

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from missions.firmware import Firmware

# fmt: off
DEFAULTS: dict[str, float] = {
    "ACRO_TURN_RATE": 180.0, "ARMING_CHECK": 1.0, "ATC_ACCEL_MAX": 1.0, "ATC_BRAKE": 1.0, "ATC_DECEL_MAX":
    0.0, "ATC_SPEED_D": 0.0, "ATC_SPEED_FF": 0.0, "ATC_SPEED_FLTD": 0.0, "ATC_SPEED_FLTE": 10.0,
    "ATC_SPEED_FLTT": 0.0, "ATC_SPEED_I": 0.2, "ATC_SPEED_IMAX": 1.0, "ATC_SPEED_P": 0.1,
    "ATC_STOP_SPEED": 0.1, "ATC_STR_ACC_MAX": 120.0, "ATC_STR_ANG_P": 2.0, "ATC_STR_DEC_MAX": 0.0,
    "ATC_STR_RAT_D": 0.0, "ATC_STR_RAT_FF": 0.75, "ATC_STR_RAT_FLTD": 0.0, "ATC_STR_RAT_FLTE": 10.0,
    "ATC_STR_RAT_FLTT": 0.0, "ATC_STR_RAT_I": 0.2, "ATC_STR_RAT_IMAX": 1.0, "ATC_STR_RAT_MAX": 120.0,
    "ATC_STR_RAT_P": 0.2, "ATC_TURN_MAX_G": 0.6, "AVOID_ACCEL_MAX": 3.0, "AVOID_BACKUP_DZ": 0.1,
    "AVOID_BACKUP_SPD": 0.75, "AVOID_BEHAVE": 1.0, "AVOID_ENABLE": 3.0, "AVOID_MARGIN": 2.0,
    "BRD_SD_FENCE": 0, "BRD_SD_MISSION": 0, "CRUISE_SPEED": 5.0, "CRUISE_THROTTLE": 30.0, "EK3_ENABLE": 1.0, "EK3_SRC1_POSXY": 3.0,
    "EK3_SRC1_VELXY": 3.0, "EK3_SRC1_YAW": 1.0, "FENCE_ACTION": 1.0, "FENCE_ENABLE": 0, "FENCE_MARGIN":
    2.0, "FENCE_MARGIN_XY": 0.0, "FENCE_NTF_FREQ": 1.0, "FENCE_OPTIONS": 0, "FENCE_RADIUS": 300.0, "FENCE_TOTAL": 0, "FENCE_TYPE":
    6, "FORMAT_VERSION": 16.0, "FRAME_CLASS": 1.0, "FRAME_TYPE": 0.0, "FS_ACTION": 2.0, "FS_CRASH_CHECK":
    0.0, "FS_EKF_ACTION": 1.0, "FS_EKF_THRESH": 0.8, "FS_GCS_ENABLE": 0.0, "FS_GCS_TIMEOUT": 5.0,
    "FS_OPTIONS": 0.0, "FS_THR_ENABLE": 1.0, "FS_THR_VALUE": 910.0, "FS_TIMEOUT": 1.5, "GUID_OPTIONS":
    0.0, "INITIAL_MODE": 0.0, "LOIT_RADIUS": 2.0, "LOIT_SPEED_GAIN": 0.5, "LOIT_TYPE": 0.0,
    "MAV_GCS_SYSID": 255.0, "MAV_OPTIONS": 0.0, "MAV_SYSID": 1.0, "MAV_TELEM_DELAY": 0.0,
    "MIS_DONE_BEHAVE": 0.0, "MIS_OPTIONS": 0.0, "MIS_RESTART": 0.0, "MIS_TOTAL": 0, "MODE1": 0.0,
    "MODE_CH": 8.0, "MOT_SAFE_DISARM": 0.0, "MOT_SLEWRATE": 100.0, "MOT_SPD_SCA_BASE": 1.0,
    "MOT_STR_THR_MIX": 0.5, "MOT_THR_MAX": 100.0, "MOT_THR_MIN": 0.0, "OA_TYPE": 0.0, "PSC_POS_P": 0.2,
    "PSC_VEL_D": 0.0, "PSC_VEL_FF": 0.0, "PSC_VEL_FLTD": 5.0, "PSC_VEL_FLTE": 5.0, "PSC_VEL_I": 0.0,
    "PSC_VEL_IMAX": 1.0, "PSC_VEL_P": 1.0, "RALLY_INCL_HOME": 1.0, "RALLY_LIMIT_KM": 0.5, "RALLY_TOTAL":
    0, "RTL_SPEED": 0.0, "SCHED_LOOP_RATE": 50.0, "SERVO1_FUNCTION": 26.0, "SERVO1_MAX": 2000.0,
    "SERVO1_MIN": 1000.0, "SERVO1_REVERSED": 0.0, "SERVO1_TRIM": 1500.0, "SERVO2_FUNCTION": 0.0,
    "SERVO3_FUNCTION": 70.0, "SERVO3_MAX": 2000.0, "SERVO3_MIN": 1000.0, "SERVO3_REVERSED": 0.0,
    "SERVO3_TRIM": 1500.0, "SERVO4_FUNCTION": 0.0, "SPEED_MAX": 0.0, "TURN_RADIUS": 0.9, "WP_ACCEL": 0.0,
    "WP_JERK": 0.0, "WP_PIVOT_ANGLE": 60.0, "WP_PIVOT_DELAY": 0.0, "WP_PIVOT_RATE": 60.0, "WP_RADIUS":
    3.0, "WP_SPEED": 5.0,
}
# fmt: on
"""Read from ArduRover 4.7.0-dev (24 October 2025), software in the loop; FENCE_MARGIN_XY came later, and at 0 changes nothing."""

REAL32 = 9
"""MAV_PARAM_TYPE_REAL32."""

_INT8, _INT16 = 2, 4  # MAV_PARAM_TYPE_INT8 and _INT16
_TYPES = {
    "FENCE_ACTION": _INT8, "FENCE_ENABLE": _INT8, "FENCE_OPTIONS": _INT16, "FENCE_TOTAL": _INT8, "FENCE_TYPE": _INT8,
    "AVOID_BEHAVE": _INT8, "AVOID_ENABLE": _INT8, "OA_TYPE": _INT8, "EK3_ENABLE": _INT8, "EK3_SRC1_POSXY": _INT8,
    "MIS_TOTAL": _INT16, "MIS_RESTART": _INT8, "RALLY_TOTAL": _INT8, "INITIAL_MODE": _INT8, "SERVO1_FUNCTION": _INT16,
    "SERVO3_FUNCTION": _INT16, "SERVO1_MIN": _INT16, "SERVO1_MAX": _INT16, "SERVO3_MIN": _INT16, "SERVO3_MAX": _INT16,
    "MAV_SYSID": _INT16, "MAV_GCS_SYSID": _INT16, "SCHED_LOOP_RATE": _INT16,
}  # fmt: skip


def float32(value: float) -> float:
    """Return the value as it is after a trip through a float of four bytes."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


class ParameterStore:
    """Parameters by name, in a fixed order.

    Parameters
    ----------
    overrides : mapping of str to float
        What differs from `DEFAULTS`.
    firmware : Firmware or None
        The version whose defaults and names it has; None: those of `DEFAULTS`.

    Raises
    ------
    BridgeError
        An override of a parameter the rover does not have.
    """

    def __init__(self, overrides: Mapping[str, float], firmware: Firmware | None = None) -> None:
        missing = missing_names(firmware)
        unknown = sorted(set(overrides) - set(DEFAULTS) | set(overrides) & missing)
        if unknown:
            raise BridgeError(
                f"the simulated rover has no parameter {', '.join(unknown)}; it has {len(DEFAULTS)},"
                " all listed in docs/simulator.md",
                parameters=unknown,
            )
        values = DEFAULTS | dict(own_defaults(firmware)) | dict(overrides)
        self._values = {name: float32(value) for name, value in values.items()}
        self._names = tuple(name for name in self._values if name not in missing)

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def flag(self, name: str, bit: int) -> bool:
        """Whether the bit of that value is set in a bit mask."""
        return bool(self.whole(name) & bit)

    def whole(self, name: str) -> int:
        """Return an enumeration or a bit mask; 0 of what is no number."""
        value = self._values[name]
        return int(value) if math.isfinite(value) else 0

    @property
    def fence_margin_m(self) -> float:
        """FENCE_MARGIN_XY where that is above 0, else FENCE_MARGIN (AC_Fence, from 4.7 on)."""
        return self._values["FENCE_MARGIN_XY"] or self._values["FENCE_MARGIN"]

    def set(self, name: str, value: float) -> None:
        """Change a value; an integer parameter drops the fraction."""
        self._values[name] = float(int(value)) if kind(name) != REAL32 else float32(value)

    def name_at(self, index: int) -> str | None:
        """Return the name at an index of the list, None past its ends."""
        return self._names[index] if 0 <= index < len(self._names) else None

    def index_of(self, name: str) -> int:
        """Return a parameter's place in the list."""
        return self._names.index(name)


def kind(name: str) -> int:
    """Return a parameter's MAV_PARAM_TYPE."""
    return _TYPES.get(name, REAL32)
