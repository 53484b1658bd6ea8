"""The one table of a vehicle's parameters: what each changes here, by default and by version, and where it was measured.

From it come what is read and refused (`missions.vehicle.reader`), what a live vehicle is asked for, what lies outside the measurements
(`missions.drive_model.calibrated_range`), and the page docs/parameters.md.

ArduPilot's ranges and the version that a name is there from are those of its published parameter files (github.com/ArduPilot/ParameterRepository,
commit 48513edd, Rover-4.4 to Rover-4.7). Its defaults are those that the releases 4.5.3, 4.6.2 and 4.7 report, as kept in the templates of the
ArduPilot Methodic Configurator 5.0.1; 4.4, of which there is no such list, is taken to have those of 4.5. The same figures stand in
tests/missions/vehicle/data/ardupilot_parameters.csv as they were taken from there. Releases: Rover-4.5.7 is commit 52bed8d54200, Rover-4.6.3 3fc7011a7d3d,
Rover-4.7.1 dbe792162d06.

PX4 checks no parameter, so its published metadata (module.yaml and *_params.c of github.com/PX4/PX4-Autopilot) is all that says which values make sense:
types and ranges stand in tests/missions/vehicle/data/px4_parameters.csv with file and commit, made by tools/px4_parameters.py.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from missions.firmware import Firmware
from missions.vehicle.model import Autopilot

MOST = 10_000.0
"""More metres, metres a second or degrees than any rover's parameter can mean: FENCE_RADIUS, the longest of all, ends there (AC_Fence)."""

LEAST_MPS = 0.05
"""The least speed between waypoints that ArduPilot goes down to (AR_WPNav.cpp, AR_WPNAV_SPEED_MIN)."""

LEAST_ACCEL_MPS2 = 0.01
"""A rover that takes minutes to its speed: at less, no leg is driven within the day. The same number of m/s³ for its jerk."""

MOST_WHOLE = 32_767
"""ArduPilot keeps enumerations and bit masks in 8 or 16 bits."""

_MOST_FAST = 100.0
"""More m/s, m/s², m/s³ and g no rover drives; ArduPilot documents WP_SPEED up to 100."""

_MOST_WIDE = 1000.0
"""More metres about a waypoint or before a fence, or degrees a second, mean nothing; ArduPilot documents up to 100."""

_FROM_4_7 = Firmware(
    4, 7, 0, 0
)  # development included: what it has by default changed within it, and the newer needs more room


@dataclass(frozen=True, slots=True)
class Range:
    """From the least to the most."""

    least: float = 0.0
    most: float = MOST

    def __contains__(self, value: float) -> bool:
        # Vehicles tell parameters as float32, 0.9 as 0.8999999762: less than 1e-7 of it off.
        return self.least - 1e-7 * abs(self.least) <= value <= self.most + 1e-7 * abs(self.most)

    def __str__(self) -> str:
        if self.most == math.inf:
            return f"{self.least:g} or more"
        if self.least == self.most:
            return f"{self.least:g}"
        return f"{self.least:g} to {self.most:g}"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter.

    Parameters
    ----------
    name : str
        As the autopilot calls it.
    default : float or None
        What it has where nobody set it; None where nothing is taken for it.
    changes : str
        What it changes here.
    possible : Range
        What it can mean; anything else is refused by name.
    no_less : float
        Between 0, which has a meaning of its own, and this nothing is driven with: refused.
    documented : Range or None
        The autopilot's own.
    is_whole : bool
        Whether PX4 keeps it as INT32: sent by its bits, and no fraction is possible. ArduPilot takes floats for all.
    since, until : Firmware or None
        The version that has it first, or last; None: all that are known here.
    before : tuple of Firmware and float, or None
        Before this version the default was this.
    measured, measured_skid : Range or None
        Where the drive model was measured, with steered wheels and with skid steering; None where it makes no difference or is no number of its own.
        Open above where a larger value only limits less than the measured one.
    measured_before_4_6 : Range or None
        Where corners of firmware before 4.6 were measured, within the others; None where that is the same.
    is_told : bool
        Whether a driver should see its default where that stands in for the vehicle's own value.
    autopilot : Autopilot
        Whose it is.
    """

    name: str
    default: float | None
    changes: str
    possible: Range = Range()
    no_less: float = 0.0
    documented: Range | None = None
    is_whole: bool = False
    since: Firmware | None = None
    until: Firmware | None = None
    before: tuple[Firmware, float] | None = None
    measured: Range | None = None
    measured_skid: Range | None = None
    measured_before_4_6: Range | None = None
    is_told: bool = False
    autopilot: Autopilot = Autopilot.ARDUPILOT

    def default_of(self, firmware: Firmware | None) -> float | None:
        """Return the default of a version; of an unknown one the newest."""
        if self.before is not None and firmware is not None and firmware < self.before[0]:
            return self.before[1]
        return self.default


_FAST, _WIDE, _WHOLE = Range(most=_MOST_FAST), Range(most=_MOST_WIDE), Range(most=MOST_WHOLE)
_ANY = Range(-MOST)

_ARDUPILOT = (
    Parameter("WP_SPEED", 2.0, "speed between waypoints; 0 is CRUISE_SPEED", _FAST, LEAST_MPS, Range(0, 100),
              measured=Range(1, 5), measured_skid=Range(0.2, 3), measured_before_4_6=Range(1, 5), is_told=True),
    Parameter("CRUISE_SPEED", 2.0, "speed where WP_SPEED is 0", _FAST, LEAST_MPS, Range(0, 100)),
    Parameter("WP_RADIUS", 2.0, "how early a corner is begun", _WIDE, documented=Range(0, 100),
              measured=Range(0.9, 5), measured_skid=Range(0.9, 5), measured_before_4_6=Range(1, 3), is_told=True),
    Parameter("TURN_RADIUS", 0.9, "with steered wheels the smallest WP_RADIUS that counts; swings grow with it", _WIDE, documented=Range(0, 10),
              measured=Range(0.27, 2), measured_before_4_6=Range(0.9, 0.9), is_told=True),
    Parameter("ATC_TURN_MAX_G", 0.6, "least speed in a corner", _FAST, documented=Range(0.1, 10),
              measured=Range(0.2, math.inf), measured_skid=Range(0.2, math.inf), measured_before_4_6=Range(0.6, math.inf), is_told=True),
    Parameter("ATC_ACCEL_MAX", 1.0, "how deep a corner is cut: half of it cuts 1.9 times as deep at 2 m/s; 0 is no limit", _FAST,
              LEAST_ACCEL_MPS2, Range(0, 10), measured=Range(0.5, 2), measured_skid=Range(0.5, 2), measured_before_4_6=Range(1, 1), is_told=True),
    Parameter("ATC_DECEL_MAX", 0.0, "as ATC_ACCEL_MAX, where it is less; 0 is ATC_ACCEL_MAX", _FAST, LEAST_ACCEL_MPS2, Range(0, 10)),
    Parameter("WP_ACCEL", 0.0, "as ATC_ACCEL_MAX, where it is less; 0 is ATC_ACCEL_MAX", _FAST, LEAST_ACCEL_MPS2, Range(0, 100)),
    Parameter("WP_JERK", 0.0, "how gently speed changes; 0 is as much as the acceleration", _FAST, LEAST_ACCEL_MPS2, Range(0, 100),
              measured=Range(0.5, 2), measured_skid=Range(0.5, 2), measured_before_4_6=Range(1, 1)),
    Parameter("ATC_STR_RAT_MAX", 120.0, "how fast it turns: with 40 it swings out twice as far after 150°; 0 is no limit", _WIDE,
              documented=Range(0, 1000), measured=Range(120, math.inf), measured_skid=Range(120, math.inf)),
    Parameter("ATC_STR_ACC_MAX", 120.0, "how fast a turn begins; 0 is no limit", Range(), documented=Range(0, 1000),
              measured=Range(120, math.inf), measured_skid=Range(120, math.inf)),
    Parameter("ATC_STR_DEC_MAX", 0.0, "how fast a turn ends; 0 is ATC_STR_ACC_MAX", Range(), documented=Range(0, 1000), since=_FROM_4_7,
              measured=Range(120, math.inf), measured_skid=Range(120, math.inf)),
    Parameter("ATC_STR_RAT_FF", None, "steering tune: how far steered rovers below 1 m/s swing out", documented=Range(0, 3)),
    Parameter("PSC_POS_P", 0.2, "how fast it comes back to its line", Range(0.01, _MOST_FAST), documented=Range(0.5, 2),
              measured=Range(0.15, 0.3), measured_skid=Range(0.15, 0.3), measured_before_4_6=Range(0.2, 0.2)),  # chosen around the one measured value
    Parameter("PSC_VEL_P", None, "the same as ATC_STR_RAT_FF", documented=Range(0.1, 6)),
    Parameter("WP_PIVOT_ANGLE", 0.0, "on skid steer, corners sharper than this are turned on the spot; 0 never", Range(most=360.0),
              documented=Range(0, 360), before=(_FROM_4_7, 60.0), is_told=True),
    Parameter("WP_PIVOT_RATE", 60.0, "how long that takes", _WIDE, documented=Range(0, 360)),
    *(Parameter(f"SERVO{channel}_FUNCTION", None, "73 and 74: skid steer, else steered wheels", _ANY, is_told=channel == 1) for channel in range(1, 5)),
    Parameter("FRAME_CLASS", None, "2: a boat, which drifts where it stops", _WHOLE),
    Parameter("LOIT_RADIUS", 2.0, "how far a boat drifts where it stops", _WIDE, documented=Range(0, 20)),
    Parameter("FENCE_ENABLE", 0.0, "whether the autopilot enforces the fence", _WHOLE),
    Parameter("FENCE_TYPE", 6.0, "which fences: 2 the circle around home, 4 polygons and circles", _WHOLE),
    Parameter("FENCE_MARGIN", 2.0, "how far from a fence its avoidance stops it", _WIDE, documented=Range(1, 10),
              measured=Range(0.1, 5), measured_skid=Range(0.1, 5)),
    Parameter("FENCE_MARGIN_XY", None, "above 0: used instead of FENCE_MARGIN", _WIDE, documented=Range(0, 50), since=_FROM_4_7),
    Parameter("FENCE_NTF_FREQ", None, "nothing; firmware that has it drives the corners that were measured", documented=Range(0, 10),
              since=_FROM_4_7),
    Parameter("FENCE_RADIUS", 300.0, "radius of the circle around home", documented=Range(30, 10_000)),
    Parameter("FENCE_OPTIONS", 0.0, "bit 1 (2): inclusions are a union; bit 2 (4): messages within the margin, nothing else", _WHOLE,
              since=_FROM_4_7),
    Parameter("FENCE_ACTION", 1.0, "0 report, 1 RTL, 2 HOLD, 3 SmartRTL or RTL, 4 SmartRTL, 5 disarm, 6 (since 4.7) LOITER; HOLD where that is not possible",
              _WHOLE),
    Parameter("AVOID_ENABLE", 3.0, "bit 0 (1): avoidance keeps the rover off fences", _WHOLE),
    Parameter("AVOID_BACKUP_SPD", 0.75, "above 0: the rover backs up within the margin", documented=Range(0, 2)),
    Parameter("OA_TYPE", 0.0, "1 BendyRuler, 2 Dijkstra, 3 both: it leaves the route by itself", _WHOLE),
)  # fmt: skip


_PX4_TOLD = frozenset({"CA_AIRFRAME", "NAV_ACC_RAD", "RO_SPEED_LIM"})
_PX4_1_15, _PX4_1_17 = Firmware(1, 15, 255), Firmware(1, 17, 255)
_TO_100, _LIMIT, _TENTH = Range(0, 100), Range(-1, 100), Range(0.1, 100)  # as PX4 documents most of them


def _px4(
    name: str,
    default: float | None,
    changes: str,
    documented: Range | None,
    possible: Range = _ANY,
    measured: Range | None = None,
    *,
    is_whole: bool = False,
    until: Firmware | None = None,
) -> Parameter:
    return Parameter(
        name,
        default,
        changes,
        possible,
        documented=documented,
        is_whole=is_whole,
        until=until,
        measured=measured,
        is_told=name in _PX4_TOLD,
        autopilot=Autopilot.PX4,
    )


_PX4 = (
    _px4("CA_AIRFRAME", None, "6 or 13: skid steer, 5: steered wheels", None, is_whole=True),
    _px4("NAV_ACC_RAD", 10.0, "how near to a waypoint the next leg begins at the latest", Range(0.05, 200), Range(), Range(0.5, 0.5)),
    _px4("RA_ACC_RAD_MAX", None, "how far before a waypoint the next leg begins at the earliest; with -1 NAV_ACC_RAD alone counts. Measured with -1 and 3; where it is not "
         "known, the worse of both is assumed", _LIMIT, Range(-1.0)),
    _px4("RA_ACC_RAD_GAIN", 1.0, "how early sharp corners are begun", Range(1, 100), Range(), Range(2, 2)),
    _px4("RA_MISS_VEL_DEF", None, "speed of missions with steered wheels", _TO_100, until=_PX4_1_15),
    _px4("RD_MISS_SPD_DEF", None, "speed of missions on skid steer", _TO_100, until=_PX4_1_15),
    _px4("RO_SPEED_LIM", None, "speed where that is not set; missions drive no faster", _LIMIT, measured=Range(1, 3)),
    _px4("RO_MAX_THR_SPEED", None, "speed where neither is set; corners are taken with a share of it", _TO_100, measured=Range(3.2, 3.2)),
    _px4("RO_SPEED_RED", -1.0, "how much slower corners are taken; -1 not at all. Measured with -1 and 1", _LIMIT),
    _px4("RO_ACCEL_LIM", None, "acceleration; -1 is no limit", _LIMIT),
    _px4("RO_DECEL_LIM", None, "the same, braking", _LIMIT),
    _px4("RO_JERK_LIM", None, "jerk; -1 is no limit", _LIMIT),
    *(
        _px4(name, None, f"{what}; -1 is no limit", Range(least, 100), until=_PX4_1_15)
        for name, what, least in (("RA_MAX_ACCEL", "acceleration", -1), ("RD_MAX_ACCEL", "acceleration", 0), ("RA_MAX_JERK", "jerk", -1), ("RD_MAX_JERK", "jerk", 0))
    ),
    _px4("RA_WHEEL_BASE", 0.5, "turning radius, with the steering angle; 0 is not set", _TO_100, Range(), Range(0.321, 0.321)),
    _px4("RA_MAX_STR_ANG", 0.5236, "turning radius, with the wheel base; 0 is not set", Range(0, 1.5708), Range(), Range(0.523, 0.524)),
    _px4("PP_LOOKAHD_GAIN", 1.0, "how far ahead on its line it steers at, by its speed", _TENTH, Range(), Range(1, 1)),
    _px4("PP_LOOKAHD_MIN", 1.0, "the shortest such distance", _TENTH, Range(), Range(1, 1)),
    _px4("PP_LOOKAHD_MAX", 10.0, "the longest such distance", _TENTH, Range(), Range(3, math.inf)),
    _px4("RD_TRANS_DRV_TRN", math.radians(10.0), "corners sharper than this are turned on the spot", Range(0.001, 3.14159), Range()),
    _px4("RO_YAW_RATE_LIM", None, "how long that takes", Range()),
    _px4("GF_ACTION", 2.0, "what the autopilot does in a breach: 0 nothing, 1 a warning, 2 HOLD, 3 RTL, 4 termination, 5 LAND", Range(0, 5), _WHOLE, is_whole=True),
    _px4("GF_MAX_HOR_DIST", 0.0, "radius of the circle around home", Range(), Range()),
    _px4("GF_SOURCE", None, "nothing here; which position counts for the fence: 0 the estimate, 1 GPS", Range(0, 1), is_whole=True),
    _px4("GF_PREDICT", None, "nothing on a rover, as measured", None, is_whole=True, until=_PX4_1_17),
)  # fmt: skip


def _by_name(rows: Iterable[Parameter]) -> dict[str, Parameter]:
    return {row.name: row for row in rows}


PARAMETERS = _by_name((*_ARDUPILOT, *_PX4))
"""Every parameter that matters here, by name."""

PARAMETER_NAMES = tuple(row.name for row in _ARDUPILOT)
"""What a live ArduPilot vehicle is asked for; steering servos are looked for on the first four outputs."""

PX4_NAMES = tuple(row.name for row in _PX4)
"""All that is known of PX4's."""


def row_of(name: str) -> Parameter:
    """Return a parameter's row; an output beyond the fourth is read like the first."""
    if name in PARAMETERS:
        return PARAMETERS[name]
    return replace(PARAMETERS["SERVO1_FUNCTION"], name=name)
