"""A drive as legs and corners, each with its motion, its swing and what is left of earlier swings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.drive_model import before_4_6
from missions.drive_model import corner as at_corner

if TYPE_CHECKING:
    from missions.drive_model.corner import Blend
    from missions.drive_model.motion import LegProfile
    from missions.geo import Vector
    from missions.vehicle import Vehicle

KEPT_ACROSS = 0.3
"""What is left to either side, at the least, of an error that a corner turns from sideways to lengthways."""


@dataclass(frozen=True, slots=True)
class Stray:
    """How far beyond its band a rover may be to the left and to the right of its path; it dies away with time.

    Parameters
    ----------
    left_m, right_m : float
        At time 0, which is the middle of the corner it comes from.
    """

    left_m: float = 0.0
    right_m: float = 0.0

    @property
    def widest_m(self) -> float:
        """The larger of the two."""
        return max(self.left_m, self.right_m)

    def after(self, time_s: float, gain_per_s: float) -> Stray:
        """Return what is left of the stray after a time."""
        left = math.exp(-gain_per_s * max(time_s, 0.0))
        return Stray(self.left_m * left, self.right_m * left)

    def turned(self, turn_deg: float) -> Stray:
        """Return the stray as seen from the next leg."""
        cosine = math.cos(math.radians(turn_deg))
        same, other = (cosine, 0.0) if cosine > 0 else (0.0, -cosine)
        least_m = KEPT_ACROSS * self.widest_m * abs(math.sin(math.radians(turn_deg)))
        return Stray(
            max(same * self.left_m + other * self.right_m, least_m),
            max(same * self.right_m + other * self.left_m, least_m),
        )

    def seen_from(self, turn_deg: float) -> Stray:
        """Return the stray as at a right turn: the outside left, the inside right."""
        return self if turn_deg >= 0 else Stray(self.right_m, self.left_m)

    def widened(self, more_m: float) -> Stray:
        """Return the stray with more to either side."""
        return Stray(self.left_m + more_m, self.right_m + more_m)

    def wider(self, other: Stray) -> Stray:
        """Return to each side the larger of two strays."""
        return Stray(max(self.left_m, other.left_m), max(self.right_m, other.right_m))

    def plus(self, other: Stray) -> Stray:
        """Return the sum of two strays."""
        return Stray(self.left_m + other.left_m, self.right_m + other.right_m)

    def swung(self, turn_deg: float, swing_m: float) -> Stray:
        """Return the stray with a swing to the outside of a turn added."""
        if turn_deg >= 0:
            return Stray(self.left_m + swing_m, self.right_m)
        return Stray(self.left_m, self.right_m + swing_m)


@dataclass(frozen=True, slots=True)
class LegPlan:
    """One leg: where it runs, how it is driven, and its straight-line band."""

    first: int
    start: Vector
    end: Vector
    direction: Vector
    profile: LegProfile
    band_m: float

    def at(self, time_s: float) -> Vector:
        """Return the place that the autopilot aims for, at a time since the leg's own start."""
        along_m = self.profile.travelled_m(time_s)
        return (self.start[0] + self.direction[0] * along_m, self.start[1] + self.direction[1] * along_m)


@dataclass(frozen=True, slots=True)
class CornerPlan:
    """One place where a leg ends and the next begins.

    Parameters
    ----------
    waypoint : int
        Its number in the list of points, the last one's where several lie here.
    places : tuple of (float, float)
        The points that lie here.
    turn_deg : float
        Change of course, to the right positive.
    stops, pivots : bool
        Whether the rover comes to rest, whether it then turns on the spot.
    doubtful : bool
        Whether it may as well cut as pivot.
    bounded : bool
        Whether corners like this were within the model when measured.
    blend : Blend
        The overlap of the two legs' motions.
    swing_m, behind_m : float
        How far beyond its band it gets off the next leg to the outside, and behind the waypoint.
    stray_m : float
        How far beyond its band it may be to either side.
    tail : Stray
        How far beyond that it may be long after, as at the turn it is; only before ArduPilot 4.6.
    time_lost_s : float
        Against driving on at full speed.
    """

    waypoint: int
    places: tuple[Vector, ...]
    turn_deg: float
    stops: bool
    pivots: bool
    doubtful: bool
    bounded: bool
    blend: Blend
    swing_m: float
    behind_m: float
    stray_m: float
    tail: Stray
    time_lost_s: float


@dataclass(frozen=True, slots=True)
class Bend:
    """The shape of a route at a corner.

    Parameters
    ----------
    turn_deg : float
        Change of course, to the right positive.
    whole_deg : float
        That of the corners close before it included.
    shorter_run_m : float
        How far the route goes nearly straight on before the corner or after it, whichever is less.
    speed_mps : float
        The larger of the speeds asked for before and after it.
    changes_speed : bool
        Whether another speed is asked for after it, which was measured on straight lines only.
    """

    turn_deg: float
    whole_deg: float
    shorter_run_m: float
    speed_mps: float
    changes_speed: bool = False

    @property
    def widest_deg(self) -> float:
        """The larger of the two turns, where they are to the same side."""
        same_side = self.whole_deg * self.turn_deg > 0
        return min(max(abs(self.turn_deg), abs(self.whole_deg) if same_side else 0.0), 180.0)


@dataclass(frozen=True, slots=True)
class DrivePlan:
    """A drive: n legs, the n - 1 corners between them, and the errors that each leg begins with (`tails`: before 4.6, those that hardly die away)."""

    vehicle: Vehicle
    legs: tuple[LegPlan, ...]
    corners: tuple[CornerPlan, ...]
    strays: tuple[Stray, ...]
    tails: tuple[Stray, ...]

    def span_s(self, leg: int) -> tuple[float, float]:
        """Return the time (since the leg's own start) when only this leg's motion runs: from one blend to the next."""
        begin_s = self.corners[leg - 1].blend.duration_s if leg else 0.0
        end_s = self.legs[leg].profile.duration_s
        if leg < len(self.corners):
            end_s -= self.corners[leg].blend.duration_s
        return begin_s, max(begin_s, end_s)

    def stray_at(self, leg: int, time_s: float) -> Stray:
        """Return what is left of earlier swings at a time since the leg's own start."""
        middle_s = self.corners[leg - 1].blend.duration_s / 2 if leg else at_corner.START_HOLD_S
        stray = self.strays[leg].after(time_s - middle_s, self.vehicle.position_gain_per_s)
        if not self.tails:
            return stray
        return stray.wider(before_4_6.left_of(self.tails[leg], time_s - self.span_s(leg)[0]))

    def stray_after(self, corner: int) -> Stray:
        """Return the stray that the leg after a corner begins with."""
        stray = self.strays[corner + 1]
        return stray.wider(self.tails[corner + 1]) if self.tails else stray
