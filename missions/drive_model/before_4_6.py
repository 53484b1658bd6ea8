"""What ArduPilot Rover before 4.6 does at a corner: it begins the turn sooner, swings out farther, and comes back across its line.

When it begins the turn follows from SCurve.cpp of those releases; how far it then swings out, and how far it comes back across its line,
was measured on a development version of November 2024 (1,192 corners, tests/missions/drive_model/data/corners_before_4_6.csv): each number here
is the largest of the rows of its class, less what the rest of the model gives already, so that every row lies inside.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.drive_model.motion import LegProfile, Ramp
    from missions.drive_model.stray import Stray

TURNS_DEG = (45.0, 75.0, 90.0, 105.0, 120.0, 150.0, 170.0)
"""Measured turns: up to the first it hardly leaves its band; those between two of them count as the sharper one."""

_SAME_TURN_DEG = 1.0
"""So much more is the same turn: rounding of coordinates."""

_SPEEDS_MPS = (1.0, 2.0, 3.0, 5.0)
_RADII_M = (1.0, 2.0, 3.0)
_LONG_M = 30.0
"""The measured speeds and WP_RADIUS, and the shortest of the long legs; between two the worse of both counts."""

_SHARPEST_DEG = ((9.9, TURNS_DEG[-1]), (5.0, 60.0), (0.0, 20.0))
"""On legs of how many metres which turns count as measured: all on 10 m; later firmware drove up to 60° on legs of 5 m no worse than on 10 m."""

_SKID_DEG = 60.0
"""Skid-steered rovers pivoted at all sharper measured turns."""

PIVOT_SWING_FACTOR = 1.9
"""So much more than later firmware a rover strays that pivots between short legs: 0.13 m on 10 m legs, where 0.09 m were reckoned."""

# By speed and WP_RADIUS, for the turns above but the first: beyond the band, how far it swings out after long legs, how far it is on the inside
# of the next leg later on, and how far it swings out on legs of 10 m (there to either side: one corner's swing is the next one's cut).
# Where a gentler turn had more, that.
_MEASURED_M = {
    (1.0, 1.0): ((0.00, 0.00, 0.00, 0.21, 1.34, 2.08), (0.00, 0.00, 0.00, 0.00, 0.00, 0.00), (0.03, 0.03, 0.05, 0.19, 1.33, 2.19)),
    (1.0, 2.0): ((0.00, 0.00, 0.00, 0.21, 1.49, 1.97), (0.00, 0.00, 0.00, 0.00, 0.00, 0.00), (0.03, 0.03, 0.05, 0.16, 1.31, 2.68)),
    (1.0, 3.0): ((0.00, 0.00, 0.00, 0.20, 1.30, 1.87), (0.00, 0.00, 0.00, 0.00, 0.04, 0.04), (0.03, 0.03, 0.05, 0.18, 1.44, 2.36)),
    (2.0, 1.0): ((0.00, 0.00, 0.29, 1.45, 2.57, 4.12), (0.00, 0.00, 0.00, 0.00, 0.07, 0.07), (0.08, 0.08, 0.98, 1.27, 3.19, 4.40)),
    (2.0, 2.0): ((0.00, 0.00, 0.00, 0.00, 1.45, 5.06), (0.00, 0.00, 0.00, 0.00, 0.25, 1.06), (0.08, 0.08, 0.08, 0.08, 1.80, 3.96)),
    (2.0, 3.0): ((0.00, 0.00, 0.00, 0.00, 1.00, 3.79), (0.00, 0.00, 0.00, 0.00, 0.20, 1.44), (0.08, 0.08, 0.08, 0.08, 1.58, 3.72)),
    (3.0, 1.0): ((0.00, 0.71, 1.19, 1.68, 4.92, 4.92), (0.00, 0.60, 1.18, 1.30, 1.63, 1.63), (0.73, 0.73, 1.04, 2.30, 4.47, 5.92)),
    (3.0, 2.0): ((0.00, 0.00, 0.00, 0.59, 2.62, 4.00), (0.00, 0.00, 0.00, 1.35, 1.35, 1.35), (0.73, 0.73, 0.77, 1.41, 3.61, 4.04)),
    (3.0, 3.0): ((0.00, 0.00, 0.00, 0.18, 0.90, 2.62), (0.00, 0.00, 0.00, 0.35, 1.47, 1.47), (0.73, 0.73, 0.94, 1.27, 3.72, 3.72)),
    (5.0, 1.0): ((0.00, 0.38, 0.83, 1.79, 3.32, 4.16), (0.00, 1.02, 1.40, 1.66, 1.75, 1.75), (0.60, 0.86, 1.53, 1.90, 4.45, 4.96)),
    (5.0, 2.0): ((0.00, 0.00, 0.67, 0.77, 2.72, 3.53), (0.00, 0.00, 0.93, 2.11, 2.11, 2.11), (0.60, 0.60, 1.02, 1.59, 3.25, 3.34)),
    (5.0, 3.0): ((0.00, 0.00, 0.00, 1.06, 1.60, 2.26), (0.00, 0.00, 0.00, 0.81, 2.08, 2.08), (0.60, 0.60, 1.07, 1.07, 4.12, 5.68)),
}  # fmt: skip

_GENTLE_M = 0.08
"""How far it swings out beyond its band at gentler turns between short legs."""

_TAIL_HOLD_S, _TAIL_S = 8.0, 15.0
"""So long what is left of a swing stays as it was, and so slowly it dies away then: after 6 s of the slowest two thirds were left."""


def inside_band_m(speed_mps: float) -> float:
    """Return how far it strays to the inside of its cut: measured 0.29, 0.42 and 0.56 m at 1, 2 and 3 m/s, at 5 m/s less; a sixth more across a turn of 75°."""
    return min(0.30 + 0.12 * speed_mps, 0.65)


def half_blend_s(ramp: Ramp, before: LegProfile, after: LegProfile, turn_deg: float) -> float:
    """Return half the time for which the motions of two legs overlap, but for the waypoint radius.

    The next leg starts as soon as its turn-in is longer than what is left of the cruise, half of the leg is driven, and the middle of the
    turn is driven slower than the legs.
    """
    half_s = min(
        ramp.duration_s - ramp.jerk_s / 2, after.duration_s / 4, ramp.time_s(before.length_m / 2) / 2
    )
    slower_mps = ramp.speed_mps / (2 * math.cos(math.radians(turn_deg) / 2) or 1.0)
    return min(half_s, ramp.time_to_speed_s(slower_mps)) if slower_mps < ramp.speed_mps else half_s


@dataclass(frozen=True, slots=True)
class Swing:
    """What a steered rover does after a corner, beyond its band.

    Parameters
    ----------
    outside_m : float
        How far it is carried out.
    later_inside_m, later_outside_m : float
        How far it may be to the inside and to the outside of its next leg long after.
    """

    outside_m: float = 0.0
    later_inside_m: float = 0.0
    later_outside_m: float = 0.0


def swing(turn_deg: float, speed_mps: float, radius_m: float, shorter_leg_m: float) -> Swing:
    """Return what the measured corners bound; a sharper turn than the sharpest of them, or another speed or radius, counts as the nearest."""
    turn = bisect_left(TURNS_DEG, min(abs(turn_deg) - _SAME_TURN_DEG, TURNS_DEG[-1])) - 1
    is_short = shorter_leg_m < _LONG_M
    if turn < 0:
        return Swing(_GENTLE_M if is_short else 0.0)
    cells = [
        [row[turn] for row in _MEASURED_M[cell]]
        for cell in itertools.product(_about(_SPEEDS_MPS, speed_mps), _about(_RADII_M, radius_m))
    ]
    long_m, later_m, short_m = map(max, zip(*cells, strict=True))
    if not is_short:
        return Swing(long_m, later_m)
    widest_m = max(long_m, short_m)
    return Swing(widest_m, max(later_m, widest_m), widest_m)


def left_of(tail: Stray, time_s: float) -> Stray:
    """Return what is left of a tail, a time after its turn was over."""
    return tail.after(time_s - _TAIL_HOLD_S, 1 / _TAIL_S)


def is_bounded(turn_deg: float, shorter_leg_m: float, *, is_steered: bool) -> bool:
    """Whether corners like this that are not pivoted were measured."""
    sharpest_deg = next((deg for least_m, deg in _SHARPEST_DEG if shorter_leg_m >= least_m), 0.0)
    return abs(turn_deg) - _SAME_TURN_DEG <= (sharpest_deg if is_steered else min(sharpest_deg, _SKID_DEG))


def _about(measured: tuple[float, ...], value: float) -> tuple[float, ...]:
    """Return the measured values next to a value, or itself."""
    above = bisect_left(measured, value)
    below = above if measured[above : above + 1] == (value,) else above - 1
    return measured[max(below, 0) : above + 1]
