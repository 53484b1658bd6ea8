"""What a rover does at a corner: how it cuts it, how far it swings out, what time it loses.

The blend of two legs follows from the vehicle's parameters (SCurve.cpp, AR_WPNav.cpp); how far the rover strays from it was measured
on ArduPilot Rover 4.7 (docs/drive-model.md) and stands in the constants here.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import TYPE_CHECKING

from missions.drive_model import before_4_6, pursuit
from missions.drive_model.blend import Blend
from missions.vehicle import Autopilot, Steering
from missions.vehicle.calibration import leg_more_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.drive_model.motion import LegProfile
    from missions.drive_model.stray import Bend
    from missions.vehicle import Vehicle

GRAVITY_MPS2 = 9.80665  # standard gravity; ArduPilot's GRAVITY_MSS

BAND_AT_REST_M = 0.20  # the part of the band that does not grow with speed: measured (docs/drive-model.md, 2)
BAND_HEADING_ERROR = 0.01
"""A heading known wrong by this angle (rad) holds a rover off its line by ``speed * angle / position gain``."""

INSIDE_BAND_M = 0.30
"""On the inside of a cut a rover strays no farther than this: at speed it runs wide of the blend, not inside it."""

DELAY_STRAY_M = 0.1
"""More than the band, to either side, where it stops for a delay."""

SAME_PLACE_STRAY_M = 0.35
"""More than the band, to either side, where two waypoints lie on one another."""

SWING_PER_TURN_RADIUS = 2.45
"""How far a rover with steered wheels swings out where it turns right round, in turning radii (2.2 m at 0.9 m)."""

TURN_BACK_DEG = (168.0, 180.0)
TURN_BACK_SWING = 1.28
"""Between these turns it swings out farther, by up to so many turning radii: 3.6 m in all after 180° at 1 m/s; from 2 m/s on less (tests/missions/drive_model/data/turns_back.csv)."""

TURN_BACK_BEHIND = 0.6
"""At 180° it comes so much of that behind its waypoint, 2.08 m at 1 m/s; a quarter up to 168° (tests/missions/drive_model/data/turns_back.csv)."""

EARLY_BEHIND_MORE = 0.25
"""So much more before 4.6: half of what it swings out up to 168°."""

SLOW_MPS = 1.0
SLOW_SKID_SWING_M, SLOW_SKID_TURN_DEG = 0.3, 45.0
"""Slower skid-steered rovers swing out so far at corners that they do not pivot at: 0.49 m after 45° at 0.2 to 0.5 m/s, band included; at gentler ones less."""

SWING_LENGTHS = 2.5
"""A swing is widest within so many turning radii along the next leg; only then it dies away."""

NEAR_M = 3.0
"""Corners nearer to one another than this are one turn to steered wheels."""

STRAIGHT_ON_DEG = 10.0
"""Legs that turn less than this are one leg where short legs are asked for."""

# Fitted to the rows of 5 and 10 m legs in benchmarks/data (docs/drive-model.md, 3).
SHORT_LEG_M = 5.0
PIVOT_SWING_M = 0.7
"""How swings grow on short legs: by e^(-leg / 5 m) of 150 %, and of 0.7 m where it pivots."""

# Measured starts, and stops for a delay, less the band (docs/drive-model.md, 3).
START_SWING_M = (
    (0.0, 0.0),
    (90.0, 0.9),
    (135.0, 1.5),
    (150.0, 1.75),
    (165.0, 2.3),
    (176.5, 2.7),
    (180.0, 2.7),
)
EARLY_START_SWING_M = (*START_SWING_M[:-1], (178.0, 3.2), (180.0, 3.2))
START_BEHIND_M = (
    (0.0, 0.0),
    (90.0, 0.0),
    (135.0, 0.3),
    (170.0, 1.4),
    (176.5, 3.6),
    (178.0, 10.0),
    (180.0, 10.0),
)
"""Heading error in degrees at a start or after a stop; how far off the line (the second: with firmware before 4.6), and how far behind the point, at a turning radius
of 0.9 m.

Exactly back the way ahead and the way round balance: ArduPilot drove on for 8.2 m before it turned, half a degree off for 4.5 m, and its compass is a degree
off or more (tests/missions/drive_model/data/short_starts.csv).
"""

UNKNOWN_START_DEG = 176.5
"""A heading that is not known is taken as so far off: nearer to exactly back it is by chance alone."""

SKID_START_SWING_M = (
    (0.0, 0.0),
    (20.0, 0.31),
    (45.0, 0.51),
    (90.0, 0.68),
    (120.0, 0.75),
    (150.0, 0.79),
    (170.0, 0.98),
    (180.0, 0.98),
)
SKID_START_BEHIND_M = ((0.0, 0.0), (90.0, 0.0), (120.0, 0.75), (170.0, 0.98), (180.0, 0.98))
"""The same for skid steer that does not pivot: it turns where it stands. Its starts were not measured; taken as the largest swings of its corners that were
driven through, as turned (500 rows of 0.2 to 3 m/s, tests/missions/drive_model/data/corners_by_parameters.csv), and as far behind as aside. Without the band."""

MEASURED_TURN_RADIUS_M = 0.9
"""Swings of steered wheels grow with the turning radius beyond this; below it they are taken as measured. TURN_RADIUS does nothing on skid steer (AR_WPNav::set_turn_params)."""

START_HOLD_S = 1.5
"""A swing at the start, or after a stop, begins to die away only then."""

SWING_HOLD_S = 1.0
"""So long after the middle of its blend does a swing at a corner begin to die away (tests/missions/drive_model/data/turns_back.csv)."""

END_OVERRUN_M, EARLY_END_OVERRUN_M = 0.8, 1.2
"""Past the last waypoint, the farthest measured, and with firmware before 4.6 (docs/drive-model.md, 3)."""

STOP_LAG_S = 2.0
"""Time to settle at a stop (docs/drive-model.md, 5)."""

# Measured: all but two of the 83 rows that left the band by more than 0.1 m turn sharper, on shorter legs (docs/drive-model.md).
UNBOUNDED_TURN_DEG = 115.0
UNBOUNDED_LEG_M = 15.0
SHORT_START_M, EARLY_SHORT_START_M, START_TURNED_M, UNSETTLED_M = 3.0, 5.0, 0.4, 0.9
"""A steered rover that swings out so far at its start (it faces 45 degrees away) has not settled after so short a run (the second: with firmware
before 4.6): with a corner there its corridor is so much wider, and reaches so much farther back (tests/missions/drive_model/data/short_starts.csv: real starts on legs of 0.8 m and more)."""

BACK_SWING_M = 2.5
EARLY_UNSETTLED_M = ((0.8, 3.9), (1.2, 1.9), (1.5, 1.3), (2.0, 0.9), (8.0, 0.9), (10.0, 0.0))
"""The same for firmware before 4.6 where it faces back (it swings out so far), by the length of the run; from the same rows, with 0.2 m more."""

EARLY_STOP_RUN_M = 25.0
"""Stops for a delay were measured before 4.6 on legs of 25 m and more (tests/missions/drive_model/data/turns_back.csv)."""

PIVOT_DOUBT_DEG = 2.0
"""Corners this near to the pivot angle may be cut or pivoted: rounding of coordinates decides."""


_Table = tuple[tuple[float, ...], ...]
(
    _START_SWINGS,
    _EARLY_START_SWINGS,
    _START_BEHINDS,
    _SKID_START_SWINGS,
    _SKID_START_BEHINDS,
    _EARLY_UNSETTLED,
) = (
    tuple(zip(*rows, strict=True))
    for rows in (
        START_SWING_M,
        EARLY_START_SWING_M,
        START_BEHIND_M,
        SKID_START_SWING_M,
        SKID_START_BEHIND_M,
        EARLY_UNSETTLED_M,
    )
)
"""As columns."""


STANDSTILL = Blend(0.0, 0.0)


def band_m(vehicle: Vehicle, speed_mps: float) -> float:
    """Return how far a rover strays to either side of the path that its autopilot aims for."""
    more_m = leg_more_m(vehicle, speed_mps)
    if vehicle.autopilot is Autopilot.PX4:
        return pursuit.BAND_M + more_m
    return BAND_AT_REST_M + BAND_HEADING_ERROR * speed_mps / vehicle.position_gain_per_s + more_m


def inside_band_m(vehicle: Vehicle, speed_mps: float, band_m: float) -> float:
    """Return how far a rover strays to the inside of a cut, of the path that its autopilot aims for."""
    if vehicle.autopilot is Autopilot.PX4:
        return band_m
    return before_4_6.inside_band_m(speed_mps) if is_early(vehicle) else min(band_m, INSIDE_BAND_M)


def is_early(vehicle: Vehicle) -> bool:
    """Whether its firmware begins turns as ArduPilot did before 4.6."""
    return vehicle.has_measured_corners is False and vehicle.autopilot is Autopilot.ARDUPILOT


def blend(vehicle: Vehicle, before: LegProfile, after: LegProfile, turn_deg: float) -> Blend:
    """Return the overlap of two legs' motions at a corner.

    The next leg starts as early as the middle of the turn lies within the waypoint radius and its acceleration within
    ATC_TURN_MAX_G, at the earliest when the present leg begins to brake (SCurve::advance_target_along_track), and sooner before 4.6.
    """
    if vehicle.pursuit is not None:
        return pursuit.blend(vehicle.pursuit, before, after, turn_deg)
    ramp = before.ramp if before.ramp.duration_s <= after.ramp.duration_s else after.ramp
    half_s = ramp.duration_s / 2
    sine = math.sin(math.radians(abs(turn_deg)) / 2)
    lateral_mps2 = vehicle.turn_max_g * GRAVITY_MPS2
    if 2 * ramp.accel_at_mps2(half_s) * sine > lateral_mps2 > 0:
        half_s = lateral_mps2 / (2 * ramp.jerk_mps3 * sine)
    elif is_early(vehicle):
        half_s = before_4_6.half_blend_s(ramp, before, after, turn_deg)
    reach_m = ramp.travelled_m(half_s)
    # On skid steer the turning radius does not count (AR_WPNav::set_turn_params).
    radius_m = vehicle.waypoint_radius_m
    if vehicle.steering is Steering.ACKERMANN:
        radius_m = max(radius_m, vehicle.turn_radius_m)
    if 2 * reach_m * sine > radius_m:
        reach_m = radius_m / (2 * sine)
        half_s = ramp.time_s(reach_m)
    return Blend(2 * half_s, reach_m)


def corner_swing_m(vehicle: Vehicle, bend: Bend, reach_m: float) -> float:
    """Return how far a rover is carried out beyond its band after a corner that it does not stop at.

    Steered wheels cannot follow a sharp blend; a blend that starts early gives room back. On short legs a rover is still swinging from
    one corner when the next begins.
    """
    if vehicle.pursuit is not None:
        return pursuit.corner_swing_m(vehicle, vehicle.pursuit, bend.widest_deg)
    slow_m = 0.0
    if vehicle.steering is Steering.SKID and bend.speed_mps < SLOW_MPS:
        slow_m = SLOW_SKID_SWING_M * min(bend.widest_deg / SLOW_SKID_TURN_DEG, 1.0)
    if vehicle.can_pivot:
        return slow_m
    radius_m = _swing_radius_m(vehicle)
    # The exponents and their bounds are fitted to benchmarks/data (docs/drive-model.md, 3): 2.5 where the blend or a leg is short, to 6.
    short = math.exp(-bend.shorter_run_m / SHORT_LEG_M)
    early = _interpolated(reach_m, (0.2 * radius_m, 0.6 * radius_m), (0.0, 1.0))
    half_turn = math.sin(math.radians(bend.widest_deg) / 2) ** 2
    exponent = 2.5 + 3.5 * early * max(1 - 3 * short, 0.0)
    back = _interpolated(bend.widest_deg, TURN_BACK_DEG, (0.0, TURN_BACK_SWING))
    swing_m = radius_m * (SWING_PER_TURN_RADIUS * half_turn**exponent + back) * (1 + 1.5 * short)
    return max(float(swing_m), slow_m)


def behind_share(vehicle: Vehicle, turn_deg: float) -> float:
    """Return how far behind its waypoint a rover comes, as a share of what it swings out."""
    share = _interpolated(abs(turn_deg), TURN_BACK_DEG, (0.25, TURN_BACK_BEHIND))
    return share + EARLY_BEHIND_MORE if is_early(vehicle) else share


def swing_hold_s(vehicle: Vehicle, swing_m: float, *, stopped: bool, pivots: bool) -> float:
    """Return how long after the middle of its blend a rover goes on swinging out; it swings out little where it does so briefly."""
    follows_blend = vehicle.autopilot is Autopilot.ARDUPILOT and not is_early(vehicle)
    if pivots or not (stopped or follows_blend):
        return 0.0
    return (START_HOLD_S if stopped else SWING_HOLD_S) * min(swing_m / _swing_radius_m(vehicle), 1.0)


def swing_length_m(vehicle: Vehicle) -> float:
    """Return how far along its next leg a rover comes before a swing is at its widest."""
    if vehicle.pursuit is not None:
        return 2 * pursuit.turning_circle_m(vehicle, vehicle.pursuit)
    return SWING_LENGTHS * _swing_radius_m(vehicle)


def pivot_swing_m(vehicle: Vehicle, shorter_leg_m: float) -> float:
    """Return how far beyond its band a rover strays that pivots between short legs."""
    factor = before_4_6.PIVOT_SWING_FACTOR if is_early(vehicle) else 1.0
    return factor * PIVOT_SWING_M * math.exp(-shorter_leg_m / SHORT_LEG_M)


def early_swing(vehicle: Vehicle, bend: Bend) -> before_4_6.Swing:
    """Return how far a rover with firmware before 4.6 is carried out after a corner that it does not stop at, and what is left of it long after."""
    if vehicle.steering is Steering.SKID:
        return before_4_6.Swing(
            pivot_swing_m(vehicle, bend.shorter_run_m) if may_pivot_or_cut(vehicle, bend.turn_deg) else 0.0
        )
    radius_m = max(vehicle.waypoint_radius_m, vehicle.turn_radius_m)
    return before_4_6.swing(bend.widest_deg, bend.speed_mps, radius_m, bend.shorter_run_m)


def start_swing_m(vehicle: Vehicle, error_deg: float) -> float:
    """Return how far off its line, beyond its band, a rover swings that starts with its heading wrong."""
    if vehicle.pursuit is not None:
        return pursuit.start_swing_m(vehicle, vehicle.pursuit, error_deg)
    steered = _EARLY_START_SWINGS if is_early(vehicle) else _START_SWINGS
    return _start(vehicle, error_deg, steered, _SKID_START_SWINGS)


def start_behind_m(vehicle: Vehicle, error_deg: float) -> float:
    """Return how far behind its start a rover comes that starts with its heading wrong."""
    if vehicle.pursuit is not None:
        return pursuit.start_behind_m(vehicle, vehicle.pursuit, error_deg)
    return _start(vehicle, error_deg, _START_BEHINDS, _SKID_START_BEHINDS)


def pivots(vehicle: Vehicle, turn_deg: float) -> bool:
    """Whether the vehicle stops at such a corner and turns on the spot."""
    return vehicle.can_pivot and abs(turn_deg) > vehicle.pivot_angle_deg


def is_bounded(vehicle: Vehicle, turn_deg: float, shorter_leg_m: float, *, stops: bool) -> bool:
    """Whether corners like this kept within the model when measured; steered wheels between sharp turns on short legs did not."""
    if vehicle.pursuit is not None:
        return stops or pursuit.is_bounded(turn_deg, shorter_leg_m)
    if is_early(vehicle):
        is_steered = vehicle.steering is Steering.ACKERMANN
        if pivots(vehicle, turn_deg):
            return True
        if stops and is_steered:
            return shorter_leg_m >= EARLY_STOP_RUN_M
        return before_4_6.is_bounded(turn_deg, shorter_leg_m, is_steered=is_steered)
    sharp = abs(turn_deg) > UNBOUNDED_TURN_DEG and shorter_leg_m < UNBOUNDED_LEG_M
    return vehicle.steering is Steering.SKID or not sharp


def unsettled_m(vehicle: Vehicle, swung_m: float, run_m: float) -> float:
    """Return how much more room a run from rest needs that is too short for what the rover swings out at its start."""
    if vehicle.autopilot is not Autopilot.ARDUPILOT or vehicle.steering is not Steering.ACKERMANN:
        return 0.0
    short_m = EARLY_SHORT_START_M if is_early(vehicle) else SHORT_START_M
    usual_m = UNSETTLED_M if swung_m > START_TURNED_M and run_m < short_m else 0.0
    wider = _swing_radius_m(vehicle) / MEASURED_TURN_RADIUS_M
    if is_early(vehicle) and swung_m > BACK_SWING_M * wider:
        return max(usual_m, _interpolated(run_m / wider, *_EARLY_UNSETTLED) * wider)
    return usual_m


def pivot_time_s(vehicle: Vehicle, turn_deg: float) -> float:
    """Return how long a turn on the spot takes; a rate of 0 is no limit."""
    return abs(turn_deg) / vehicle.pivot_rate_dps if vehicle.pivot_rate_dps > 0 else 0.0


def may_pivot_or_cut(vehicle: Vehicle, turn_deg: float) -> bool:
    """Whether the corner is so near to the pivot angle that either may happen."""
    return vehicle.can_pivot and abs(abs(turn_deg) - vehicle.pivot_angle_deg) < PIVOT_DOUBT_DEG


def overrun_m(vehicle: Vehicle) -> float:
    """Return how far past the last waypoint it may stop."""
    if vehicle.pursuit is not None:
        return pursuit.END_OVERRUN_M
    return EARLY_END_OVERRUN_M if is_early(vehicle) else END_OVERRUN_M


def swing_time_s(swing_m: float, speed_mps: float) -> float:
    """Return the time lost on the way out and back, beyond that of the motion."""
    # No source is recorded for these two; docs/drive-model.md ("How well it holds") has the time errors that they leave.
    return swing_m * (0.7 + 0.4 / max(speed_mps, 0.5))


def _interpolated(value: float, values: Sequence[float], results: Sequence[float]) -> float:
    """Return as `numpy.interp` does for one number, which takes it ten times as long."""
    after = bisect_right(values, value)
    if not after or after == len(values):
        return results[max(after - 1, 0)]
    slope = (results[after] - results[after - 1]) / (values[after] - values[after - 1])
    return slope * (value - values[after - 1]) + results[after - 1]


def _start(vehicle: Vehicle, error_deg: float, steered: _Table, skid: _Table) -> float:
    if vehicle.can_pivot:
        return 0.0  # it pivots, or strays no farther than its band
    errors_deg, distances_m = skid if vehicle.steering is Steering.SKID else steered
    wider = _swing_radius_m(vehicle) / MEASURED_TURN_RADIUS_M
    return _interpolated(abs(error_deg), errors_deg, distances_m) * wider


def _swing_radius_m(vehicle: Vehicle) -> float:
    """Return the turning radius that swings grow with."""
    own_m = vehicle.turn_radius_m if vehicle.steering is Steering.ACKERMANN else 0.0
    return max(own_m, MEASURED_TURN_RADIUS_M)
