"""A drive as legs and corners, each with its motion, its swing and what is left of earlier swings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from missions.drive_model import before_4_6
from missions.drive_model import corner as at_corner

if TYPE_CHECKING:
    from missions.drive_model.blend import Blend
    from missions.drive_model.motion import LegProfile
    from missions.drive_model.stray import Stray
    from missions.geo import Vector
    from missions.vehicle import Vehicle
    from missions.vehicle.calibration import CornerMore


class LegPlan(NamedTuple):
    """One leg: where it runs, how it is driven, and its straight-line band; a tuple, as `Ramp` is."""

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


class CornerPlan(NamedTuple):
    """One place where a leg ends and the next begins; a tuple, as `Ramp` is.

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
    swings_until_s : float
        When that begins to die away, since the next leg's own start.
    stray_m : float
        How far beyond its band it may be to either side.
    tail : Stray
        How far beyond that it may be long after, as at the turn it is; only before ArduPilot 4.6.
    time_lost_s : float
        Against driving on at full speed.
    more : CornerMore
        What the rover's calibration adds.
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
    swings_until_s: float
    stray_m: float
    tail: Stray
    time_lost_s: float
    more: CornerMore


@dataclass(frozen=True, slots=True)
class DrivePlan:
    """A drive: n legs, the n - 1 corners between them, and the errors that each leg begins with (`tails`: before 4.6, those that hardly die away).

    At its start it needs `start_more_m` more than the swing there, where its first run is too short for it.
    """

    vehicle: Vehicle
    legs: tuple[LegPlan, ...]
    corners: tuple[CornerPlan, ...]
    strays: tuple[Stray, ...]
    tails: tuple[Stray, ...]
    start_more_m: float

    def span_s(self, leg: int) -> tuple[float, float]:
        """Return the time (since the leg's own start) when only this leg's motion runs: from one blend to the next."""
        begin_s = self.corners[leg - 1].blend.duration_s if leg else 0.0
        end_s = self.legs[leg].profile.duration_s
        if leg < len(self.corners):
            end_s -= self.corners[leg].blend.duration_s
        return begin_s, max(begin_s, end_s)

    def stray_at(self, leg: int, time_s: float) -> Stray:
        """Return what is left of earlier swings at a time since the leg's own start."""
        middle_s = self.corners[leg - 1].swings_until_s if leg else at_corner.START_HOLD_S
        stray = self.strays[leg].after(time_s - middle_s, self.vehicle.position_gain_per_s)
        if not self.tails:
            return stray
        return stray.wider(before_4_6.left_of(self.tails[leg], time_s - self.span_s(leg)[0]))

    def stray_after(self, corner: int) -> Stray:
        """Return the stray that the leg after a corner begins with."""
        stray = self.strays[corner + 1]
        return stray.wider(self.tails[corner + 1]) if self.tails else stray
