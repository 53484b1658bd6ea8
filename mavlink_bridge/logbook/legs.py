"""A drive leg by leg: how far the rover was off each leg's middle, how deep it cut each corner and how far it swung out, beside what was predicted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from missions.geo import change_deg

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from missions.drive_model import Envelope

_MIDDLE: Final = (1 / 3, 2 / 3)
"""Which part of a leg tells of driving straight on: away from both its corners. Chosen, not measured."""

_LEAST_LEG_M: Final = 0.3
"""Shorter legs are one place to a rover (`missions.drive_model.from_points`), and nothing is measured beside them."""


@dataclass(frozen=True, slots=True)
class GradedLeg:
    """One leg of a drive, with the corner at its end.

    Parameters
    ----------
    item : int
        The mission item (by seq) that it leads to.
    length_m : float
    speed_mps : float
        The speed in force: the mission's, or of a DO_CHANGE_SPEED that a station sent since.
    driven_mps : float or None
        The fastest it was in its middle third; None where no position lies there, and below where nothing could be predicted.
    foreseen_driven_mps : float or None
    straight_m : float or None
        The farthest off its line in its middle third; None where no position lies there.
    foreseen_straight_m : float or None
        What was predicted for the leg; None, here and below, where nothing could be predicted.
    turn_deg : float or None
        The change of course at its end, to the right positive; None at the last leg.
    stands : bool or None
        Whether the rover was predicted to stop or to turn on the spot there.
    inside_cut_m, outside_overshoot_m : float or None
        How far off the two legs it was to the inside and to the outside of the turn, from the middle of one leg to the middle of the next.
    foreseen_inside_cut_m, foreseen_outside_overshoot_m : float or None
    inside_beyond_m, outside_beyond_m : float or None
        How far outside the predicted corridor it was there, on the inside and on the outside of the turn.
    is_bounded : bool or None
        Whether corners like this kept within the drive model when it was measured.
    gap_m : float
        The farthest from one position to the next: between them a cut may have been deeper.
    is_whole : bool
        Whether the rover drove the leg and on, past the middle of the next.
    """

    item: int
    length_m: float
    speed_mps: float
    driven_mps: float | None
    foreseen_driven_mps: float | None
    straight_m: float | None
    foreseen_straight_m: float | None
    turn_deg: float | None
    stands: bool | None
    inside_cut_m: float | None
    outside_overshoot_m: float | None
    foreseen_inside_cut_m: float | None
    foreseen_outside_overshoot_m: float | None
    inside_beyond_m: float | None
    outside_beyond_m: float | None
    is_bounded: bool | None
    gap_m: float
    is_whole: bool


class LegMeter:
    """Measures a track beside the legs of a drive, batch by batch; keeps no positions.

    Parameters
    ----------
    points : ndarray of float, shape (n + 1, 2)
        Where the drive began, then its waypoints, in metres.
    """

    def __init__(self, points: NDArray[np.float64]) -> None:
        self._points = points
        steps = np.diff(points, axis=0)
        self._lengths_m = np.hypot(*steps.T)
        self._directions = steps / np.maximum(self._lengths_m, 1e-9)[:, None]
        count = len(self._lengths_m)
        self._turns_deg = np.array(
            [
                change_deg((before[0], before[1]), (after[0], after[1]))
                for before, after in zip(
                    self._directions[:-1].tolist(), self._directions[1:].tolist(), strict=True
                )
            ]
        )
        self._straight_m = np.full(count, np.nan)
        self._driven_mps = np.full(count, np.nan)
        self._inside_m = np.zeros(count)  # of the corner at each leg's end
        self._outside_m = np.zeros(count)
        self._beyond_m = np.zeros((2, count))  # inside and outside
        self._gaps_m = np.zeros(count)
        self._is_passed = np.zeros(count + 1, dtype=bool)  # by leg: some position lies beyond its middle

    def take(
        self,
        track: NDArray[np.float64],
        speeds_mps: NDArray[np.float64],
        legs: NDArray[np.intp],
        beyond_m: NDArray[np.float64] | None,
    ) -> None:
        """Take positions.

        Parameters
        ----------
        track : ndarray of float, shape (n + 1, 2)
            The position before, then those driven since.
        speeds_mps : ndarray of float, shape (n,)
            As the vehicle reported them.
        legs : ndarray of int, shape (n,)
            Which leg each was driven on, by the mission item then. The autopilot begins the next leg before its corner.
        beyond_m : ndarray of float, shape (n,), or None
            How far each lies outside the predicted corridor.
        """
        places = track[1:]
        steps_m = np.hypot(*np.diff(track, axis=0).T)
        nearest, share, aside_m = self._beside(places, legs)
        is_middle = (share > _MIDDLE[0]) & (share < _MIDDLE[1])
        np.fmax.at(self._straight_m, nearest[is_middle], np.abs(aside_m[is_middle]))
        np.fmax.at(self._driven_mps, nearest[is_middle], speeds_mps[is_middle])
        np.maximum.at(self._gaps_m, nearest, steps_m)
        corner = np.where(share >= 0.5, nearest, nearest - 1)  # the corner at the end of which leg
        self._is_passed[nearest[share >= 0.5]] = True
        is_corner = (corner >= 0) & (corner < len(self._turns_deg))
        corner, aside_m = corner[is_corner], aside_m[is_corner]
        inwards_m = np.where(self._turns_deg[corner] >= 0, aside_m, -aside_m)
        np.maximum.at(self._inside_m, corner, inwards_m)
        np.maximum.at(self._outside_m, corner, -inwards_m)
        if beyond_m is not None:
            side = np.where(inwards_m >= 0, 0, 1)
            np.maximum.at(self._beyond_m, (side, corner), beyond_m[is_corner])

    def _beside(
        self, places: NDArray[np.float64], legs: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        """Return the nearest leg of those about the one driven, what share of it lies behind, and how far right of its line each place is."""
        best = legs.copy()
        found_m = np.full(len(places), np.inf)
        share, aside_m = np.zeros(len(places)), np.zeros(len(places))
        for other in (0, -1, 1):
            leg = np.clip(legs + other, 0, len(self._lengths_m) - 1)
            away, ahead = places - self._points[leg], self._directions[leg]
            along_m = np.einsum("ij,ij->i", away, ahead)
            right_m = away[:, 0] * ahead[:, 1] - away[:, 1] * ahead[:, 0]
            beyond_m = along_m - np.clip(along_m, 0.0, self._lengths_m[leg])
            away_m = np.hypot(right_m, beyond_m)
            is_nearer = (away_m < found_m - 1e-9) & (self._lengths_m[leg] >= _LEAST_LEG_M)
            best[is_nearer], found_m[is_nearer] = leg[is_nearer], away_m[is_nearer]
            share[is_nearer] = (along_m / np.maximum(self._lengths_m[leg], 1e-9))[is_nearer]
            aside_m[is_nearer] = right_m[is_nearer]
        return best, share, aside_m

    def finish(
        self,
        items: Sequence[int],
        speeds_mps: Sequence[float],
        forecast: Envelope | None,
        mixed: Collection[int] = (),
    ) -> tuple[GradedLeg, ...]:
        """Return the legs that were driven to.

        Parameters
        ----------
        items : sequence of int
            The seq that each leg leads to, as far as the vehicle came.
        speeds_mps : sequence of float
            In force on each leg.
        forecast : Envelope or None
            What was predicted for all of it.
        mixed : collection of int
            Legs on which the speed in force changed: the corner at their end may have been driven at either.
        """
        told_corners = {corner.waypoint: corner for corner in forecast.corners} if forecast else {}
        told_legs = {leg.first: leg for leg in forecast.legs} if forecast else {}
        graded = []
        for number, (item, speed_mps) in enumerate(zip(items, speeds_mps, strict=True)):
            corner, leg = told_corners.get(number + 1), told_legs.get(number)
            has_corner = number < len(self._turns_deg)
            straight_m, driven_mps = float(self._straight_m[number]), float(self._driven_mps[number])
            graded.append(
                GradedLeg(
                    item=item,
                    length_m=float(self._lengths_m[number]),
                    speed_mps=speed_mps,
                    driven_mps=None if np.isnan(driven_mps) else driven_mps,
                    foreseen_driven_mps=None if leg is None else leg.top_speed_mps,
                    straight_m=None if np.isnan(straight_m) else straight_m,
                    foreseen_straight_m=None if leg is None else max(leg.left_m, leg.right_m),
                    turn_deg=float(self._turns_deg[number]) if has_corner else None,
                    stands=None if corner is None else corner.stops,
                    inside_cut_m=float(self._inside_m[number]) if has_corner else None,
                    outside_overshoot_m=float(self._outside_m[number]) if has_corner else None,
                    foreseen_inside_cut_m=None if corner is None else corner.inside_cut_m,
                    foreseen_outside_overshoot_m=None if corner is None else corner.outside_overshoot_m,
                    inside_beyond_m=None if corner is None else float(self._beyond_m[0, number]),
                    outside_beyond_m=None if corner is None else float(self._beyond_m[1, number]),
                    is_bounded=None if corner is None else corner.bounded and number not in mixed,
                    gap_m=float(self._gaps_m[number : number + 2].max()),
                    is_whole=bool(
                        self._is_passed[number] and (self._is_passed[number + 1] or not has_corner)
                    ),
                )
            )
        return tuple(graded)
