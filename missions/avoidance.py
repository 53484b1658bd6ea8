"""What the vehicle's own avoidance does to its corners: it slows down for a fence ahead, falls behind, and cuts more.

ArduPilot's avoidance (AVOID_ENABLE, FENCE_MARGIN) limits the speed towards a fence to the position gain times the distance that is
left to the margin. A rover that comes to a corner before a fence is slowed while its target point goes on round the corner; it then
steers straight for that. Measured in the simulated rover, corners of 45 to 130 degrees at 2 and 5 m/s: up to 2.2 m more of both legs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
import shapely.ops

from missions.drive_model.corner import INSIDE_BAND_M

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model import Envelope
    from missions.vehicle import Vehicle

    Edges = tuple[NDArray[np.float64], NDArray[np.float64]]

SPEEDS_MPS = (1.0, 2.0, 5.0)
MORE_M = (0.3, 2.6, 3.9)
"""At these speeds: by so much more of both legs a rover cuts a corner when the margin lies right behind it."""

WITHIN_M = (2.0, 6.5, 8.0)
"""It does not where the margin lies this far behind the corner."""

ASIDE_M = (0.1, 1.0, 1.0)
TAIL_M = 12.0
"""So far inside the next leg it then still is, and so much farther along it comes back to it."""

_LEAST_TURN_DEG = 8.0
_NEGLIGIBLE_M = 0.1
_SLOW_MPS = 0.7
_OUT_DEG = 20.0
"""It may look so far to the outside of its course when it comes to a corner."""

_IN_THE_TURN = np.array([(0.25, 2.0), (0.5, 2.0), (0.75, 1.5), (1.0, 1.0)])
"""Shares of the turn, and how much it tells when avoidance slows it there: speed missing of that meant, times this."""


def with_avoidance(band: Envelope, vehicle: Vehicle, fence: BaseGeometry) -> Envelope:
    """Give an envelope with what corners before a fence need more, where the vehicle's avoidance is on.

    Parameters
    ----------
    band : Envelope
        The drive without avoidance.
    vehicle : Vehicle
        What drives.
    fence : shapely geometry
        The lines it avoids, metres.

    Returns
    -------
    Envelope
        The same where nothing is near, else with one more piece for each corner concerned.
    """
    if not vehicle.stops_within_m or fence.is_empty:
        return band
    edges = _edges(fence)
    more = [
        piece
        for number, corner in enumerate(band.corners)
        if not corner.stops and abs(corner.turn_deg) >= _LEAST_TURN_DEG
        for piece in _pieces(band, number, vehicle, edges)
    ]
    if not more:
        return band
    return replace(
        band,
        cores=np.array([*band.cores, *(piece.core for piece in more)], dtype=np.object_),
        bands_m=np.array([*band.bands_m, *(piece.band_m for piece in more)]),
        waypoints=np.array([*band.waypoints, *(piece.waypoint for piece in more)], dtype=np.int64),
    )


@dataclass(frozen=True, slots=True)
class _Piece:
    """One more piece of an envelope."""

    core: BaseGeometry
    band_m: float
    waypoint: int


def _pieces(band: Envelope, number: int, vehicle: Vehicle, edges: Edges) -> list[_Piece]:
    """Give what a corner needs more: its cut, and the tail of it at the next corner."""
    corner, before, after = band.corners[number], band.legs[number], band.legs[number + 1]
    place = band.points[corner.waypoint]
    bend = _Bend(band.points[before.first], place, band.points[after.first + 1], corner.turn_deg)
    speed_mps = max(before.top_speed_mps, after.top_speed_mps)
    within_m, more_m, aside_m = (
        float(np.interp(speed_mps, SPEEDS_MPS, table)) for table in (WITHIN_M, MORE_M, ASIDE_M)
    )
    ahead = _Ahead(bend, corner.middle_m, vehicle, edges)
    share = max(ahead.before(within_m), ahead.within())
    if not share:
        return []
    band_m = min(before.half_width_m, INSIDE_BAND_M)
    left_m, cut = bend.cut(2 * corner.middle_m + more_m * share, aside_m * share)
    pieces = [_Piece(cut, band_m, corner.waypoint)]
    if left_m > _NEGLIGIBLE_M and number + 2 < len(band.legs):
        # The next leg ends before the rover is back on it: it comes to the next corner so far aside, and leaves it so.
        first = band.legs[number + 2].first
        leg = shapely.LineString(band.points[[first, first + 1]])
        tail = shapely.ops.substring(leg, 0.0, min(TAIL_M * left_m / ASIDE_M[-1], leg.length))
        pieces.append(_Piece(tail, band_m + left_m, band.corners[number + 1].waypoint))
    return pieces


@dataclass(frozen=True, slots=True)
class _Bend:
    """A corner between two legs, in the plane."""

    before: NDArray[np.float64]
    place: NDArray[np.float64]
    after: NDArray[np.float64]
    turn_deg: float

    @property
    def course_rad(self) -> float:
        """The course to the corner."""
        east_m, north_m = self.place - self.before
        return math.atan2(east_m, north_m)

    def cut(self, reach_m: float, aside_m: float) -> tuple[float, BaseGeometry]:
        """Give the ground of a cut, and how far aside the rover still is where the next leg ends."""
        back, back_m = _unit(self.before - self.place)
        ahead, ahead_m = _unit(self.after - self.place)
        inside = math.copysign(1.0, self.turn_deg) * np.array([ahead[1], -ahead[0]])
        near_m, far_m = min(reach_m, ahead_m), min(reach_m + TAIL_M, ahead_m)
        left_m = aside_m * (1 - (far_m - near_m) / TAIL_M)
        corners = [
            self.place,
            self.place + min(reach_m, back_m) * back,
            self.place + near_m * ahead + aside_m * inside,
            self.place + far_m * ahead + left_m * inside,
            self.place + far_m * ahead,
        ]
        return left_m, shapely.MultiPoint(corners).convex_hull


def _unit(step: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    length_m = float(np.hypot(*step))
    return step / (length_m or 1.0), length_m


@dataclass(frozen=True, slots=True)
class _Ahead:
    """What lies ahead of a rover at a corner; the answers are 1 where avoidance slows it most, 0 where it does not."""

    bend: _Bend
    middle_m: float
    vehicle: Vehicle
    edges: Edges

    def before(self, within_m: float) -> float:
        """Tell from how near the margin lies behind the corner."""
        out_rad = -math.copysign(math.radians(_OUT_DEG), self.bend.turn_deg)
        ways_rad = self.bend.course_rad + np.array([0.0, out_rad])
        return max(0.0, 1 - float(self._spares_m(self.bend.place, ways_rad).min()) / within_m)

    def within(self) -> float:
        """Tell from the speed that avoidance allows in the turn, and the speed meant there."""
        turn_rad = math.radians(self.bend.turn_deg)
        half_mps = math.sqrt(2 * self.vehicle.accel_max_mps2 * self.middle_m)
        meant_mps = 2 * half_mps * math.cos(turn_rad / 2)
        if meant_mps <= _SLOW_MPS:
            return 0.0
        inside_rad = self.bend.course_rad + turn_rad / 2 + math.copysign(math.pi / 2, turn_rad)
        inside_m = 2 * self.middle_m * abs(math.sin(turn_rad / 2))
        middle = self.bend.place + inside_m * np.array([math.sin(inside_rad), math.cos(inside_rad)])
        spares_m = self._spares_m(middle, self.bend.course_rad + _IN_THE_TURN[:, 0] * turn_rad)
        allowed_mps = spares_m * self.vehicle.position_gain_per_s
        return float(np.clip(_IN_THE_TURN[:, 1] * (1 - allowed_mps / meant_mps), 0.0, 1.0).max())

    def _spares_m(self, place: NDArray[np.float64], ways_rad: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give how far ahead of a place the margin of a fence begins, for each way; infinite where there is none."""
        starts, steps = self.edges
        ahead = np.column_stack((np.sin(ways_rad), np.cos(ways_rad)))[:, None, :]
        off = starts - place
        with np.errstate(divide="ignore", invalid="ignore"):  # an edge along the way is met at its neighbours
            cross = ahead[..., 0] * steps[:, 1] - ahead[..., 1] * steps[:, 0]
            away_m = (off[:, 0] * steps[:, 1] - off[:, 1] * steps[:, 0]) / cross
            share = (off[:, 0] * ahead[..., 1] - off[:, 1] * ahead[..., 0]) / cross
        met = (away_m >= 0) & (share >= 0) & (share <= 1)
        found: NDArray[np.float64] = np.where(met, away_m, np.inf).min(axis=1, initial=np.inf)
        return np.maximum(found - self.vehicle.stops_within_m, 0.0)


def _edges(fence: BaseGeometry) -> Edges:
    """Give the straight pieces of lines: where they start, and the way to their ends."""
    points, lines = shapely.get_coordinates(shapely.get_parts(fence), return_index=True)
    joined = lines[1:] == lines[:-1]
    return points[:-1][joined], np.diff(points, axis=0)[joined]
