"""A list of points as legs and corners, each with its motion, its swing and what is left of earlier swings."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.drive_model import corner as at_corner
from missions.drive_model.profile import LegProfile, leg_profile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from missions.drive_model.corner import Blend
    from missions.vehicle import Vehicle

Vector = tuple[float, float]

SAME_PLACE_M = 0.3
"""Points nearer to one another are one place for a rover: it can make nothing of a leg between them but a stop."""

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
        """Give what is left after a time."""
        left = math.exp(-gain_per_s * max(time_s, 0.0))
        return Stray(self.left_m * left, self.right_m * left)

    def turned(self, turn_deg: float) -> Stray:
        """Give it as seen from the next leg."""
        cosine = math.cos(math.radians(turn_deg))
        same, other = (cosine, 0.0) if cosine > 0 else (0.0, -cosine)
        least_m = KEPT_ACROSS * self.widest_m * abs(math.sin(math.radians(turn_deg)))
        return Stray(
            max(same * self.left_m + other * self.right_m, least_m),
            max(same * self.right_m + other * self.left_m, least_m),
        )

    def seen_from(self, turn_deg: float) -> Stray:
        """Give it as at a right turn: the outside left, the inside right."""
        return self if turn_deg >= 0 else Stray(self.right_m, self.left_m)

    def widened(self, more_m: float) -> Stray:
        """Give it with more to either side."""
        return Stray(self.left_m + more_m, self.right_m + more_m)

    def swung(self, turn_deg: float, swing_m: float) -> Stray:
        """Give it with a swing to the outside of a turn added."""
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
        """Give the place the autopilot means to be at, at a time since the leg's own start."""
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
    time_lost_s: float


@dataclass(frozen=True, slots=True)
class Route:
    """A drive: n legs, the n - 1 corners between them, and the errors that each leg begins with."""

    vehicle: Vehicle
    legs: tuple[LegPlan, ...]
    corners: tuple[CornerPlan, ...]
    strays: tuple[Stray, ...]

    def span_s(self, leg: int) -> tuple[float, float]:
        """Give the time (since the leg's own start) when only this leg's motion runs: from one blend to the next."""
        begin_s = self.corners[leg - 1].blend.duration_s if leg else 0.0
        end_s = self.legs[leg].profile.duration_s
        if leg < len(self.corners):
            end_s -= self.corners[leg].blend.duration_s
        return begin_s, max(begin_s, end_s)

    def stray_at(self, leg: int, time_s: float) -> Stray:
        """Give what is left of earlier swings at a time since the leg's own start."""
        middle_s = self.corners[leg - 1].blend.duration_s / 2 if leg else at_corner.START_HOLD_S
        return self.strays[leg].after(time_s - middle_s, self.vehicle.position_gain_per_s)


def plan_route(
    points: NDArray[np.float64],
    vehicle: Vehicle,
    speeds: Sequence[float | None] | None,
    stops: Mapping[int, float],
    start: Stray,
) -> Route:
    """Give the legs and corners of a list of points; points that lie on one another are one place, and a stop."""
    groups = _grouped(points)
    legs = tuple(
        _leg(vehicle, before, after, None if speeds is None else speeds[after[0][0] - 1])
        for before, after in itertools.pairwise(groups)
    )
    corners = []
    turned_deg = 0.0
    for group, before, after in zip(groups[1:], legs, legs[1:], strict=False):
        turn_deg = _turn_deg(before.direction, after.direction)
        near = before.profile.length_m < at_corner.NEAR_M
        turned_deg = turned_deg + turn_deg if near else turn_deg
        corners.append(_corner(vehicle, group, (before, after), (turn_deg, turned_deg), stops))
    strays = [start]
    middle_s = at_corner.START_HOLD_S
    for leg, corner in zip(legs, corners, strict=False):
        passed_s = leg.profile.duration_s - middle_s - corner.blend.duration_s / 2
        middle_s = corner.blend.duration_s / 2
        left = strays[-1].after(passed_s, vehicle.position_gain_per_s)
        stray = left.turned(corner.turn_deg).swung(corner.turn_deg, corner.swing_m)
        strays.append(stray.widened(corner.stray_m))
    return Route(vehicle, legs, tuple(corners), tuple(strays))


def _grouped(points: NDArray[np.float64]) -> list[list[tuple[int, Vector]]]:
    groups: list[list[tuple[int, Vector]]] = []
    for number, (east_m, north_m) in enumerate(points.tolist()):
        place = (east_m, north_m)
        if groups and math.dist(place, groups[-1][0][1]) < SAME_PLACE_M:
            groups[-1].append((number, place))
        else:
            groups.append([(number, place)])
    return groups


def _leg(
    vehicle: Vehicle,
    before: list[tuple[int, Vector]],
    after: list[tuple[int, Vector]],
    speed_mps: float | None,
) -> LegPlan:
    (first, start), (_, end) = before[-1], after[0]
    length_m = math.dist(start, end)
    speed_mps = vehicle.speed_mps if speed_mps is None else speed_mps
    profile = leg_profile(length_m, speed_mps, vehicle.accel_max_mps2, vehicle.jerk_mps3)
    direction = ((end[0] - start[0]) / length_m, (end[1] - start[1]) / length_m)
    return LegPlan(first, start, end, direction, profile, at_corner.band_m(vehicle, profile.top_speed_mps))


def _corner(
    vehicle: Vehicle,
    group: list[tuple[int, Vector]],
    legs: tuple[LegPlan, LegPlan],
    turns_deg: tuple[float, float],
    stops: Mapping[int, float],
) -> CornerPlan:
    """Plan one corner; its turns are its own and that of all corners near before it together."""
    before, after = legs
    turn_deg = turns_deg[0]
    pivots = at_corner.pivots(vehicle, turn_deg)
    delay_s = sum(stops.get(number, 0.0) for number, _ in group)
    stopped = len(group) > 1 or any(number in stops for number, _ in group)
    doubtful = at_corner.may_pivot_or_cut(vehicle, turn_deg) and not stopped
    shorter_m = min(before.profile.length_m, after.profile.length_m)
    if pivots and not doubtful:
        blend = at_corner.STANDSTILL
        swing_m = at_corner.pivot_swing_m(shorter_m)
        behind_m = 0.0
    elif stopped:
        blend = at_corner.STANDSTILL
        swing_m = at_corner.start_swing_m(vehicle, turn_deg)
        behind_m = at_corner.start_behind_m(vehicle, turn_deg)
    else:
        blend = at_corner.blend(vehicle, before.profile, after.profile, turn_deg)
        whole_deg = turns_deg[1] if turns_deg[1] * turn_deg > 0 else turn_deg
        wider_deg = min(max(abs(turn_deg), abs(whole_deg)), 180.0)
        swing_m = at_corner.corner_swing_m(vehicle, wider_deg, blend.reach_m, shorter_m)
        behind_m = swing_m / 4
    top_mps = min(before.profile.top_speed_mps, after.profile.top_speed_mps)
    ramps_s = (before.profile.ramp.duration_s + after.profile.ramp.duration_s) / 2
    lost_s = ramps_s - blend.duration_s + at_corner.swing_time_s(swing_m, top_mps) + delay_s
    if stopped or pivots:
        lost_s += at_corner.STOP_LAG_S
    if pivots:
        lost_s += at_corner.pivot_time_s(vehicle, turn_deg)
    return CornerPlan(
        waypoint=group[-1][0],
        places=tuple(place for _, place in group),
        turn_deg=turn_deg,
        stops=stopped or pivots,
        pivots=pivots,
        doubtful=doubtful,
        bounded=at_corner.is_bounded(vehicle, turn_deg, shorter_m),
        blend=blend,
        swing_m=swing_m,
        behind_m=behind_m,
        stray_m=_stray_m(len(group), delay_s),
        time_lost_s=lost_s,
    )


def _stray_m(places: int, delay_s: float) -> float:
    if places > 1:
        return at_corner.SAME_PLACE_STRAY_M
    return at_corner.DELAY_STRAY_M if delay_s > 0 else 0.0


def _turn_deg(before: Vector, after: Vector) -> float:
    cross = before[0] * after[1] - before[1] * after[0]
    dot = before[0] * after[0] + before[1] * after[1]
    return -math.degrees(math.atan2(cross, dot))
