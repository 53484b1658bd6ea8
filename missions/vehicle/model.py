"""What is known of a vehicle: how it drives, what its fence does, how large it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.firmware import Firmware

if TYPE_CHECKING:
    from missions.situation import Calibration

MAV_TYPE_GROUND_ROVER = 10  # MAV_TYPE of MAVLink's common.xml
MAV_TYPE_SURFACE_BOAT = 11  # the same
GROUND_TYPES = frozenset({MAV_TYPE_GROUND_ROVER, MAV_TYPE_SURFACE_BOAT})
"""What is planned for."""

_DELAY_STANDS = Firmware(1, 18, 0, 0)  # PX4, its line of development included: measured in August 2026


class Autopilot(StrEnum):
    """Whose parameters they are."""

    ARDUPILOT = "ArduPilot"
    PX4 = "PX4"


class Steering(StrEnum):
    """Steered wheels, or two sides driven apart (which can pivot on the spot)."""

    ACKERMANN = "ackermann"
    SKID = "skid"


@dataclass(frozen=True, slots=True)
class FenceParameters:
    """How the autopilot treats its fence, and what its avoidance does there.

    Parameters
    ----------
    enabled : bool
        FENCE_ENABLE; on PX4 whether GF_ACTION does anything.
    type_bits : int
        FENCE_TYPE: 2 the circle about home, 4 polygons and circles.
    margin_m : float
        FENCE_MARGIN, or FENCE_MARGIN_XY where that is above 0: ArduPilot's avoidance stops a rover this far from an enabled fence.
    margin_name : str
        Which of the two it is.
    radius_m : float
        The radius of the circle about home; 0 where there is none.
    radius_name : str
        FENCE_RADIUS, on PX4 GF_MAX_HOR_DIST.
    union : bool
        FENCE_OPTIONS bit 1: inside any inclusion zone is inside; otherwise it must be inside all.
    action : int
        FENCE_ACTION (PX4: GF_ACTION).
    avoid_bits : int
        AVOID_ENABLE: 1 keeps off fences.
    oa_type : int
        OA_TYPE: 0 none, 1 BendyRuler, 2 Dijkstra, 3 both.
    backs_away : bool
        AVOID_BACKUP_SPD above 0: inside the margin its avoidance drives it backwards.
    """

    enabled: bool = False
    type_bits: int = 6
    margin_m: float = 2.0
    margin_name: str = "FENCE_MARGIN"
    radius_m: float = 300.0
    radius_name: str = "FENCE_RADIUS"
    union: bool = False
    action: int = 1
    avoid_bits: int = 3
    oa_type: int = 0
    backs_away: bool = True

    @property
    def enforces_zones(self) -> bool:
        """Whether the autopilot acts on polygons and circles of the fence."""
        return self.enabled and bool(self.type_bits & 4)

    @property
    def enforces_home_circle(self) -> bool:
        """Whether the autopilot acts on the circle of `radius_m` about home."""
        return self.enabled and bool(self.type_bits & 2) and self.radius_m > 0


@dataclass(frozen=True, slots=True)
class Pursuit:
    """What PX4 steers a rover with steered wheels by: pure pursuit, and how it takes corners.

    Parameters
    ----------
    acceptance_m : float
        NAV_ACC_RAD: how near to a waypoint the next leg begins at the latest.
    acceptance_max_m : float or None
        RA_ACC_RAD_MAX: how far before it at the earliest; -1 always NAV_ACC_RAD. None where it is not known: the worse of -1 and 3 counts.
    acceptance_gain : float
        RA_ACC_RAD_GAIN.
    wheel_base_m, steering_angle_rad : float
        RA_WHEEL_BASE and RA_MAX_STR_ANG.
    full_speed_mps : float or None
        RO_MAX_THR_SPEED, of which corners take a share; None where it is not known.
    speed_reduction : float
        RO_SPEED_RED: how much slower a corner is taken; -1 not at all.
    lookahead_gain_s, lookahead_least_m, lookahead_most_m : float
        PP_LOOKAHD_GAIN, PP_LOOKAHD_MIN and PP_LOOKAHD_MAX.
    """

    acceptance_m: float = 0.5
    acceptance_max_m: float | None = 3.0
    acceptance_gain: float = 2.0
    wheel_base_m: float = 0.321
    steering_angle_rad: float = 0.5236
    full_speed_mps: float | None = 3.2
    speed_reduction: float = 1.0
    lookahead_gain_s: float = 1.0
    lookahead_least_m: float = 1.0
    lookahead_most_m: float = 10.0


@dataclass(frozen=True, slots=True)
class Assumed:
    """A parameter that was not known, and the value taken in its place."""

    parameter: str
    value: float

    def __str__(self) -> str:
        return f"{self.parameter} unknown; assuming {self.value:g}"


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A rover as its parameters describe it; the defaults are those of ArduPilot Rover.

    Parameters
    ----------
    waypoint_radius_m : float
        WP_RADIUS (PX4: the larger of NAV_ACC_RAD and RA_ACC_RAD_MAX).
    speed_mps : float
        WP_SPEED, CRUISE_SPEED where that is 0.
    turn_radius_m : float
        TURN_RADIUS (PX4: from wheel base and largest steering angle; 0 on skid steer).
    turn_max_g : float
        ATC_TURN_MAX_G, in units of gravity.
    accel_max_mps2, jerk_mps3 : float
        The limits along a leg: WP_ACCEL within ATC_ACCEL_MAX and ATC_DECEL_MAX, and WP_JERK, each with ArduPilot's
        meaning of 0.
    position_gain_per_s : float
        PSC_POS_P: a lateral error dies away with the time constant ``1 / position_gain_per_s``.
    pivot_angle_deg : float
        WP_PIVOT_ANGLE: on skid steer, corners sharper than this are turned on the spot; 0 never.
    pivot_rate_dps : float
        WP_PIVOT_RATE.
    turn_rate_max_dps : float or None
        ATC_STR_RAT_MAX, 0 for no limit; None where it is not known.
    turn_accel_max_dps2 : float or None
        The least of ATC_STR_ACC_MAX and ATC_STR_DEC_MAX that is a limit; None where none is known.
    steering : Steering
        From SERVOn_FUNCTION: throttle left and right (73, 74) is skid steer.
    fence : FenceParameters
        How it treats its fence, its avoidance included.
    boat_drift_m : float or None
        LOIT_RADIUS of a boat (FRAME_CLASS 2, or MAV_TYPE_SURFACE_BOAT), which drifts so far where it stops; None on wheels.
    assumed : tuple of Assumed
        What was not known, with the value taken.
    mav_type : int or None
        MAV_TYPE of its heartbeat, where one was heard.
    firmware : Firmware or None
        The autopilot's version, where it is known.
    has_measured_corners : bool or None
        Whether its firmware blends corners as ArduPilot does since 4.6; None where that is not known.
    pursuit : Pursuit or None
        How PX4 steers it; None on ArduPilot, and on skid steer.
    calibration : Calibration or None
        What its own recorded drives show beside the drive model.
    """

    # Many attributes: each is one of the vehicle's parameters that the drive depends on, or what is known of it besides.

    waypoint_radius_m: float = 2.0
    speed_mps: float = 2.0
    turn_radius_m: float = 0.9
    turn_max_g: float = 0.6
    accel_max_mps2: float = 1.0
    jerk_mps3: float = 1.0
    position_gain_per_s: float = 0.2
    pivot_angle_deg: float = 60.0
    pivot_rate_dps: float = 60.0
    steering: Steering = Steering.ACKERMANN
    autopilot: Autopilot = Autopilot.ARDUPILOT
    fence: FenceParameters = field(default_factory=FenceParameters)
    assumed: tuple[Assumed, ...] = ()
    mav_type: int | None = None
    firmware: Firmware | None = None
    turn_rate_max_dps: float | None = None
    turn_accel_max_dps2: float | None = None
    boat_drift_m: float | None = None
    has_measured_corners: bool | None = True
    pursuit: Pursuit | None = None
    calibration: Calibration | None = None

    @property
    def home_items(self) -> int:
        """How many items of its mission are home: ArduPilot's first one, none on PX4."""
        return int(self.autopilot is Autopilot.ARDUPILOT)

    @property
    def is_rover(self) -> bool:
        """Whether its heartbeat, where one was heard, is that of a rover or a boat."""
        return self.mav_type is None or self.mav_type in GROUND_TYPES

    @property
    def can_pivot(self) -> bool:
        """Whether it turns on the spot at sharp corners."""
        return self.steering is Steering.SKID and self.pivot_angle_deg > 0

    @property
    def stands_for_delays(self) -> bool:
        """Whether a DELAY item stops it: PX4's steered rovers stand from 1.18 on, before they circle about the waypoint."""
        return self.pursuit is None or (self.firmware is not None and self.firmware >= _DELAY_STANDS)

    @property
    def avoid_bits(self) -> int:
        """`FenceParameters.avoid_bits`."""
        return self.fence.avoid_bits

    @property
    def oa_type(self) -> int:
        """`FenceParameters.oa_type`."""
        return self.fence.oa_type

    @property
    def backs_away(self) -> bool:
        """`FenceParameters.backs_away`."""
        return self.fence.backs_away

    @property
    def avoids_fence(self) -> bool:
        """Whether its own avoidance stops it in AUTO, for good, nearer than its margin to a fence."""
        return (
            self.autopilot is Autopilot.ARDUPILOT and self.fence.enforces_zones and bool(self.avoid_bits & 1)
        )

    @property
    def stops_within_m(self) -> float:
        """How near to a fence it stops in AUTO for good; 0 where its avoidance is off."""
        return self.fence.margin_m if self.avoids_fence else 0.0


@dataclass(frozen=True, slots=True)
class Footprint:
    """The rectangle a vehicle covers, and where in it the point sits whose position is known.

    Parameters
    ----------
    length_m, width_m : float
        The whole vehicle, bumpers and tools included; 0 and 0 is a point.
    gps_forward_m, gps_right_m : float
        The GPS antenna from the middle of the rectangle.
    """

    length_m: float = 0.0
    width_m: float = 0.0
    gps_forward_m: float = 0.0
    gps_right_m: float = 0.0

    def __post_init__(self) -> None:
        sizes = (self.length_m, self.width_m, abs(self.gps_forward_m), abs(self.gps_right_m))
        if not all(math.isfinite(size) and size >= 0 for size in sizes):
            raise VehicleError(
                f"a footprint of {self.length_m:g} x {self.width_m:g} m with the GPS at "
                f"{self.gps_forward_m:g}, {self.gps_right_m:g} m is not possible",
                length_m=self.length_m,
                width_m=self.width_m,
            )

    @property
    def half_width_m(self) -> float:
        """How far it reaches to the side of its track when driving straight on."""
        return self.width_m / 2 + abs(self.gps_right_m)

    @property
    def swept_radius_m(self) -> float:
        """How far it reaches to any side of its track when it turns: its farthest corner from the GPS."""
        return math.hypot(self.length_m / 2 + abs(self.gps_forward_m), self.half_width_m)
