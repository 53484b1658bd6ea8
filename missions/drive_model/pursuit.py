"""What PX4's rover with steered wheels does at a corner: pure pursuit, which turns early and swings out where it turns late.

Where it turns follows from its parameters (PX4's source, v1.17.0: the switching radius as computed was measured, 0.5 to 3 m). How far it cuts and swings
out was measured on PX4's own rover simulation, v1.17.0 and the line of 1.18 of August 2026 (64 corners of 30 to 180° at 1 to 3 m/s,
tests/missions/drive_model/data/px4_corners.csv): hardly any difference between those speeds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from missions.drive_model.blend import Blend

if TYPE_CHECKING:
    from missions.drive_model.motion import LegProfile
    from missions.geo import Vector
    from missions.vehicle import Pursuit, Vehicle

BAND_M = 0.45
"""How far it strays from straight lines and from the arc of a corner: 0.43 m inside that arc at the most (150°, NAV_ACC_RAD alone), 0.37 m on straight lines."""

_SWING_RADII, _UNSLOWED_RADII = 2.0, 2.5
"""The circle that it turns on in turning radii (wheel base / tan steering angle, 0.556 m): every row lies inside with 1.11 m, 1.9 m after a U-turn included;
where it does not slow down for corners (RO_SPEED_RED -1) with 1.39 m."""

EITHER_SIDE_DEG = 165.0
"""A turn back sharper than this may be turned to either side. Chosen, not measured: small errors decide on the side."""

_BACK_SWING = 0.2
"""The share of a start's swing by which it comes across its line on its way back: all recorded starts lie within (tests/missions/drive_model/data/px4_drives.csv)."""

BEHIND_M = 2.0
"""How far behind its start it comes that faces the wrong way, 1.1 m of turning circle: it turned on ground of 2 m."""

END_OVERRUN_M = 0.6
"""It stops 0.1 to 0.6 m from the last waypoint."""

_LONG_LEG_M, _SHORT_LEG_M = 15.0, 4.0
_SHORT_LEG_DEG = 90.0
"""Corners were measured between legs of 15 and 20 m, those of 90° between legs of 4 m too (stairs at 2 m/s: within 0.35 m)."""

_STRAIGHT_ON_DEG = 10.0
_TOLERANCE_DEG = 1.0  # so much more is the same turn: rounding of coordinates
_SAME_LENGTH_M = 0.1  # the same of lengths
_ARC_STEP_DEG = 15.0  # of the turn, between two points of an arc; chosen: 0.01 m of a circle of 1.1 m
_NO_TURN_DEG = 0.1


def switch_radius_m(pursuit: Pursuit, turn_deg: float) -> float:
    """Return how far before a waypoint the rover turns to the next leg."""
    most_m = pursuit.acceptance_max_m
    if most_m is None or most_m < pursuit.acceptance_m:
        return pursuit.acceptance_m
    half_rad = math.radians(180.0 - min(abs(turn_deg), 180.0)) / 2
    sine = math.sin(pursuit.steering_angle_rad)
    early_m = (
        pursuit.acceptance_gain * pursuit.wheel_base_m / sine / math.tan(half_rad)
        if half_rad > 1e-9
        else math.inf
    )
    return min(most_m, max(pursuit.acceptance_m, early_m))


def corner_mps(vehicle: Vehicle, pursuit: Pursuit, turn_deg: float, cruise_mps: float) -> float:
    """Return how fast a corner is taken: RO_MAX_THR_SPEED less RO_SPEED_RED times the turn's share of 180°, never faster than the cruise."""
    if pursuit.speed_reduction < 0:
        return cruise_mps
    full_mps = vehicle.speed_mps if pursuit.full_speed_mps is None else pursuit.full_speed_mps
    wanted_mps = full_mps * (1 - min(1.0, pursuit.speed_reduction * min(abs(turn_deg), 180.0) / 180.0))
    least_mps = math.radians(vehicle.pivot_rate_dps) * vehicle.turn_radius_m
    return min(cruise_mps, max(wanted_mps, least_mps))


def turning_circle_m(vehicle: Vehicle, pursuit: Pursuit) -> float:
    """Return the radius of the circle that it really turns on."""
    return (_SWING_RADII if pursuit.speed_reduction > 0 else _UNSLOWED_RADII) * vehicle.turn_radius_m


def corner_swing_m(vehicle: Vehicle, pursuit: Pursuit, turn_deg: float) -> float:
    """Return how far beyond its band it is carried out after a corner: its circle, begun at the switching radius, beyond the next leg."""
    turn_rad = math.radians(min(abs(turn_deg), 180.0))
    circle_m = turning_circle_m(vehicle, pursuit)
    return max(
        0.0, circle_m * (1 - math.cos(turn_rad)) - switch_radius_m(pursuit, turn_deg) * math.sin(turn_rad)
    )


def swing_length_m(vehicle: Vehicle, pursuit: Pursuit, turn_deg: float) -> float:
    """Return how far along the next leg a swing is at its widest."""
    return switch_radius_m(pursuit, turn_deg) + 2 * turning_circle_m(vehicle, pursuit)


def start_swing_m(vehicle: Vehicle, pursuit: Pursuit, error_deg: float) -> float:
    """Return how far off its line, beyond its band, it comes that starts facing the wrong way: its circle until it faces along the line."""
    error_rad = math.radians(min(abs(error_deg), 180.0))
    return turning_circle_m(vehicle, pursuit) * (1 - math.cos(error_rad))


def start_back_swing_m(vehicle: Vehicle, pursuit: Pursuit, error_deg: float) -> float:
    """Return how far it then comes across its line, beyond its band: 0.35 m after 143°, 0.14 m after 126° (14 recorded starts)."""
    return _BACK_SWING * start_swing_m(vehicle, pursuit, error_deg)


def start_behind_m(vehicle: Vehicle, pursuit: Pursuit, error_deg: float) -> float:
    """Return how far behind its start it comes: all of it from 135° on, nothing up to 90°."""
    share = min(1.0, max(0.0, (abs(error_deg) - 90.0) / 45.0))
    measured_m = 1.11  # the circle of the measured rover
    return share * BEHIND_M * max(1.0, turning_circle_m(vehicle, pursuit) / measured_m)


def blend(pursuit: Pursuit, before: LegProfile, after: LegProfile, turn_deg: float) -> Blend:
    """Return the overlap of two legs' motions whose middle lies where that of the arc does; for times only."""
    turned_rad = math.radians(min(max(abs(turn_deg), _NO_TURN_DEG), 180.0)) / 2
    radius_m = min(switch_radius_m(pursuit, turn_deg), before.length_m / 2, after.length_m / 2)
    reach_m = radius_m * (1 - math.cos(turned_rad)) / (2 * math.sin(turned_rad) ** 2)
    ramp = before.ramp if before.ramp.duration_s <= after.ramp.duration_s else after.ramp
    return Blend(2 * ramp.time_s(reach_m), reach_m)


def time_lost_s(vehicle: Vehicle, pursuit: Pursuit, turn_deg: float, cruise_mps: float) -> float:
    """Return the time that slowing down for a corner and speeding up again takes, with RO_DECEL_LIM and RO_ACCEL_LIM."""
    slower_mps = cruise_mps - corner_mps(vehicle, pursuit, turn_deg, cruise_mps)
    return slower_mps**2 / (cruise_mps * vehicle.accel_max_mps2)


def is_bounded(turn_deg: float, shorter_leg_m: float) -> bool:
    """Whether corners like this were measured."""
    turn_deg = abs(turn_deg) - _TOLERANCE_DEG
    least_m = _SHORT_LEG_M if turn_deg <= _SHORT_LEG_DEG else _LONG_LEG_M
    return turn_deg <= _STRAIGHT_ON_DEG or shorter_leg_m > least_m - _SAME_LENGTH_M


def cut_m(pursuit: Pursuit, turn_deg: float) -> float:
    """Return how far from the legs the arc of a corner runs, on their inside: at the most, in its middle."""
    half_rad = math.radians(min(max(abs(turn_deg), _NO_TURN_DEG), 180.0)) / 2
    return switch_radius_m(pursuit, turn_deg) * (1 - math.cos(half_rad)) / math.tan(half_rad)


def cut_arc(corner: Vector, before: Vector, after: Vector, turn_deg: float, radius_m: float) -> list[Vector]:
    """Return places on the arc that touches both legs at a distance from their corner.

    Parameters
    ----------
    corner : (float, float)
        The waypoint.
    before, after : (float, float)
        The directions of the legs.
    turn_deg : float
        Change of course, to the right positive.
    radius_m : float
        How far from the corner the arc begins and ends.
    """
    begin = (corner[0] - before[0] * radius_m, corner[1] - before[1] * radius_m)
    end = (corner[0] + after[0] * radius_m, corner[1] + after[1] * radius_m)
    turned_rad = math.radians(abs(turn_deg))
    if turned_rad > math.pi - 1e-3 or turned_rad < math.radians(_NO_TURN_DEG):
        return [begin, corner, end]
    return [*_circle(begin, before, turn_deg, radius_m / math.tan(turned_rad / 2))[:-1], end]


def late_arc(
    corner: Vector, before: Vector, turn_deg: float, radius_m: float, circle_m: float
) -> list[Vector]:
    """Return places on the circle that it turns on, begun at the switching radius, until it faces along the next leg."""
    begin = (corner[0] - before[0] * radius_m, corner[1] - before[1] * radius_m)
    return _circle(begin, before, turn_deg, circle_m)


def _circle(begin: Vector, direction: Vector, turn_deg: float, circle_m: float) -> list[Vector]:
    """Return places on a circle's arc, outside it by no more than its chords lie inside."""
    side = 1.0 if turn_deg >= 0 else -1.0
    right = (direction[1] * side, -direction[0] * side)
    steps = max(1, math.ceil(abs(turn_deg) / _ARC_STEP_DEG))
    places = []
    for step in range(steps + 1):
        angle_rad = math.radians(abs(turn_deg)) * step / steps
        along_m, aside_m = circle_m * math.sin(angle_rad), circle_m * (1 - math.cos(angle_rad))
        places.append(
            (
                begin[0] + direction[0] * along_m + right[0] * aside_m,
                begin[1] + direction[1] * along_m + right[1] * aside_m,
            )
        )
    return places
