"""How fast a rover is predicted to be at each place along the lines of its drive: up to speed, slower into corners, at rest where it stops.

Where two legs' motions overlap (ArduPilot's corners) its speed is that of both together. PX4's rover takes a corner at a speed of its own,
and slows down to it and speeds up again with its limits.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from missions.drive_model import pursuit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from missions.drive_model.legs_and_corners import DrivePlan
    from missions.vehicle import Pursuit

_MOMENTS = 24  # of a ramp and of a corner, between which the speed is taken as straight; chosen: 2 % of it
_STEPS = 48  # of a leg of PX4's rover, the same


def speeds_along_mps(
    drive: DrivePlan, points: NDArray[np.float64], along_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the predicted speed at places along the drawn lines.

    Parameters
    ----------
    drive : DrivePlan
        Its legs and corners.
    points : ndarray of float, shape (n, 2)
        What is driven, as `drive` was made of.
    along_m : ndarray of float, shape (m,)
        How far along the lines through the points.

    Returns
    -------
    ndarray of float, shape (m,)
    """
    if not drive.legs:
        return np.zeros(len(along_m))
    marks_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    steers = drive.vehicle.pursuit
    told = _at_corner_speeds(drive, marks_m, steers) if steers is not None else _blended(drive, marks_m)
    places_m, speeds_mps = np.array(list(told)).T
    # Where a leg is shorter than its corners take, one begins before the other has ended.
    return np.asarray(np.interp(along_m, np.maximum.accumulate(places_m), speeds_mps))


def _blended(drive: DrivePlan, marks_m: NDArray[np.float64]) -> Iterator[tuple[float, float]]:
    """Return places and speeds of legs that overlap, in the order of time."""
    for number, leg in enumerate(drive.legs):
        profile, begin_m = leg.profile, float(marks_m[leg.first])
        begin_s, end_s = drive.span_s(number)
        rising_s, falling_s = profile.ramp.duration_s, profile.duration_s - profile.ramp.duration_s
        moments = [
            *np.linspace(begin_s, min(max(begin_s, rising_s), end_s), _MOMENTS),
            *np.linspace(max(begin_s, min(falling_s, end_s)), end_s, _MOMENTS),
        ]
        yield from ((begin_m + profile.travelled_m(t), profile.speed_at_mps(t)) for t in moments)
        if number == len(drive.corners) or not drive.corners[number].blend.duration_s:
            continue
        corner, after = drive.corners[number], drive.legs[number + 1].profile
        middle_m, cosine = float(marks_m[leg.first + 1]), math.cos(math.radians(corner.turn_deg))
        for later_s in np.linspace(0.0, corner.blend.duration_s, _MOMENTS):
            before_s = profile.duration_s - corner.blend.duration_s + later_s
            one_mps, other_mps = profile.speed_at_mps(before_s), after.speed_at_mps(later_s)
            both_mps = math.sqrt(max(0.0, one_mps**2 + other_mps**2 + 2 * one_mps * other_mps * cosine))
            left_m = profile.length_m - profile.travelled_m(before_s)
            yield middle_m - left_m + after.travelled_m(later_s), both_mps


def _at_corner_speeds(
    drive: DrivePlan, marks_m: NDArray[np.float64], steers: Pursuit
) -> Iterator[tuple[float, float]]:
    """Return places and speeds of a rover that slows down to what a corner is taken at."""
    vehicle = drive.vehicle
    tops = [leg.profile.top_speed_mps for leg in drive.legs]
    at_corners = [
        0.0 if corner.stops else pursuit.corner_mps(vehicle, steers, corner.turn_deg, min(pair))
        for corner, pair in zip(drive.corners, pairwise(tops), strict=True)
    ]
    ends_mps = [0.0, *at_corners, 0.0]
    for leg, top_mps, from_mps, to_mps in zip(drive.legs, tops, ends_mps, ends_mps[1:], strict=False):
        begin_m, length_m = float(marks_m[leg.first]), leg.profile.length_m
        for way_m in np.linspace(0.0, length_m, _STEPS):
            reached_mps = math.sqrt(from_mps**2 + 2 * vehicle.accel_max_mps2 * way_m)
            slowing_mps = math.sqrt(to_mps**2 + 2 * vehicle.accel_max_mps2 * (length_m - way_m))
            yield begin_m + way_m, min(top_mps, reached_mps, slowing_mps)
