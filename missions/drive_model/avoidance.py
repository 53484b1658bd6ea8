"""What the vehicle's own avoidance does to its corners: it slows down for a fence ahead, falls behind, and cuts more.

ArduPilot's avoidance (AVOID_ENABLE, FENCE_MARGIN) limits the speed towards a fence to the position gain times the distance that is
left to the margin. A rover that comes to a corner before a fence is slowed while its target point goes on round the corner, and
drives beside the line until the error dies away. The target point waits for it in part (AR_WPNav's time scaling). Target point and
rover are followed here, the rover as a point without inertia, to see how far it gets behind. In this module a point or a way is one complex
number, east + j north: turning a way is then a multiplication.
"""

from __future__ import annotations

import cmath
import math
from bisect import bisect_left
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model.corner import GRAVITY_MPS2, INSIDE_BAND_M
from missions.drive_model.fence_ahead import FenceAhead, FenceEdges
from missions.drive_model.motion import all_travelled_m
from missions.errors import VehicleError
from missions.vehicle import Steering

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model import Envelope
    from missions.drive_model.legs_and_corners import DrivePlan
    from missions.vehicle import Vehicle

LAG_RESERVE = 1.3
"""So many times what it is reckoned to be behind counts."""

NEGLIGIBLE_M = 0.1
"""Less is within the band of any drive."""

ASIDE_DEG = 5.0
"""It may look so far to either side of the way that it is meant to go."""

# Steps of the pursuit: chosen, not measured; how well the whole holds against driven tracks stands in docs/drive-model.md, 4.
STEP_S = 0.3
_LONGEST_S = 7 * 86400.0
"""No rover drives a mission for longer, and a drive is followed step by step; chosen, not measured."""
_SETTLE_S = 1.0  # of the target's time scale: acceleration over jerk in AR_WPNav, 1 s with the measured 1 m/s² and 1 m/s³
_LEAST_SCALE = 0.1  # of the target's time scale, as in AR_WPNav: its time never stands still
_LEAST_MPS = 0.05  # so that nothing is divided by 0
_SAMPLES_A_PIECE = 3  # in the convex hull of one piece of ground, 0.9 s
_SLOWED_SHARE = 0.97  # allowed less than this share of its speed a rover counts as slowed
_NO_LAG_M = 0.1  # nearer than this it has caught up: no more than a band holds
_LEAST_TURN_DEG = 8.0  # gentler corners are straight on
_ABOUT_CORNER_S = 7.0  # before and after a corner; chosen, not measured
_SIDES = np.exp(1j * np.radians([0.0, ASIDE_DEG, -ASIDE_DEG]))


def with_avoidance(band: Envelope, vehicle: Vehicle, fence: BaseGeometry) -> Envelope:
    """Return an envelope with the extra room that corners before a fence need where the vehicle's avoidance is on.

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
        The same where nothing is near, else with more pieces where the rover falls behind.
    """
    if not vehicle.avoids_fence or not band.legs:
        return band
    middles_m = [
        [corner.middle_m for corner in band.corners],
        [corner.least_middle_m for corner in band.corners],
    ]
    found = ground_behind(band.points, band.motion, middles_m, vehicle, FenceEdges(fence))
    if not found:
        return band
    own = (band.cores, band.bands_m, band.waypoints)
    cores, bands_m, waypoints = (np.concatenate(columns) for columns in zip(own, *found, strict=True))
    return replace(band, cores=cores, bands_m=bands_m, waypoints=waypoints)


def ground_behind(
    points: NDArray[np.float64],
    motion: DrivePlan,
    middles_m: Iterable[Sequence[float]],
    vehicle: Vehicle,
    edges: FenceEdges,
) -> list[Ground]:
    """Return the ground that corners need besides the band where the vehicle's avoidance slows it.

    Parameters
    ----------
    points : ndarray of float, shape (n, 2)
        What is driven.
    motion : DrivePlan
        Its legs and corners.
    middles_m : iterable of sequences of float
        How far from each corner the middle of its cut lies along the legs, at the most and at the least.
    vehicle : Vehicle
        What drives.
    edges : FenceEdges
        Of the lines it avoids; for many drives they are looked for once.

    Returns
    -------
    list of (ndarray, ndarray, ndarray)
        Convex pieces, their bands and waypoints; empty where it falls behind nowhere.
    """
    if not vehicle.avoids_fence or not motion.legs or edges.is_empty:
        return []
    found = []
    for either_m in sorted(set(map(tuple, middles_m))):
        target = TargetPoint(points, motion, either_m)
        lags = target.lags(vehicle, FenceAhead(edges, _plane(target.places), vehicle))
        if lags and len((pieces := target.pieces(lags))[0]):
            found.append(pieces)
    return found


class TargetPoint:
    """How the target point moves along all legs: each leg's motion begins while the one before still ends.

    Parameters
    ----------
    points : ndarray of float, shape (n, 2)
        What is driven.
    motion : DrivePlan
        Its legs and corners.
    middles_m : sequence of float
        How far from each corner the middle of its cut lies along the legs.
    """

    def __init__(self, points: NDArray[np.float64], motion: DrivePlan, middles_m: Sequence[float]) -> None:
        self.motion = motion
        profiles = [leg.profile for leg in motion.legs]
        begins_s = [0.0]
        self._passed_s = []
        """When it passes each corner."""
        for number, middle_m in enumerate(middles_m):
            ramps = (profiles[number].ramp, profiles[number + 1].ramp)
            half_s = min(ramps, key=lambda ramp: ramp.duration_s).time_s(middle_m)
            self._passed_s.append(begins_s[-1] + profiles[number].duration_s - half_s)
            begins_s.append(self._passed_s[-1] - half_s)
        whole_s = begins_s[-1] + profiles[-1].duration_s
        if not whole_s <= _LONGEST_S:
            raise VehicleError(
                f"at its speeds the drive takes {whole_s / 86400:.3g} days; at most {_LONGEST_S / 86400:g} days can be predicted",
                duration_s=whole_s,
            )
        self.times_s = np.arange(0.0, whole_s + STEP_S, STEP_S)
        along = points[:, 0] + 1j * points[:, 1]
        self.places: NDArray[np.complex128] = np.full(len(self.times_s), along[0])
        # Of each leg's own time, steps from its begin on, and its end.
        counts = [math.ceil(profile.duration_s / STEP_S) + 1 for profile in profiles]
        ends = np.cumsum(counts)
        legs_s = (np.arange(ends[-1]) - np.repeat(ends - counts, counts)) * STEP_S
        legs_s[ends - 1] = [profile.duration_s for profile in profiles]
        legs_m = all_travelled_m(profiles, counts, legs_s)
        for leg, profile, begin_s, count, end in zip(
            motion.legs, profiles, begins_s, counts, ends, strict=True
        ):
            step = along[leg.first + 1] - along[leg.first]
            leg_s, shares = legs_s[end - count : end], legs_m[end - count : end] / profile.length_m
            self.places += np.interp(self.times_s - begin_s, leg_s, shares) * step

    def lags(self, vehicle: Vehicle, fence: FenceAhead) -> list[complex]:
        """Return at each time how far the rover is behind, east and north; an empty list where it never is."""
        steps = np.diff(self.places)
        moved_m = np.maximum(np.abs(steps), _LEAST_MPS * STEP_S)
        is_slowed = np.zeros(len(steps), dtype=np.bool_)
        near = self._near_corners()[:-1]
        if not near.any():
            return []
        places, ways = self.places[:-1][near], (steps / moved_m)[near]
        sides = np.concatenate([side * ways for side in _SIDES])
        allowed_mps = fence.speeds_mps(
            _plane(np.tile(places, len(_SIDES))), _plane(sides), float(moved_m.max()) / STEP_S
        )
        is_slowed[near] = (allowed_mps.reshape(len(_SIDES), -1) < _SLOWED_SHARE * moved_m[near] / STEP_S).any(
            axis=0
        )
        if not is_slowed.any():
            return []
        return _followed(self.places.tolist(), is_slowed.tolist(), vehicle, fence)

    def _near_corners(self) -> NDArray[np.bool_]:
        """Return which times lie near a corner: falling behind on a straight line does not matter."""
        near = np.zeros(len(self.times_s), dtype=np.bool_)
        for corner, passed_s in zip(self.motion.corners, self._passed_s, strict=True):
            if not corner.stops and abs(corner.turn_deg) >= _LEAST_TURN_DEG:
                near |= np.abs(self.times_s - passed_s) <= _ABOUT_CORNER_S
        return near

    def pieces(self, lags: list[complex]) -> Ground:
        """Return the ground between target point and rover where the rover is behind, piece by piece, with its band and waypoint."""
        behind = np.array(lags)
        far = np.flatnonzero(np.abs(behind) >= NEGLIGIBLE_M)
        # A piece holds the first sample of the next one too.
        is_far = np.zeros(len(behind) // _SAMPLES_A_PIECE + 1, dtype=np.bool_)
        is_far[far // _SAMPLES_A_PIECE] = True
        is_far[np.maximum(far - 1, 0) // _SAMPLES_A_PIECE] = True
        begins = np.flatnonzero(is_far) * _SAMPLES_A_PIECE
        samples = np.minimum(begins[:, None] + np.arange(_SAMPLES_A_PIECE + 1), len(behind) - 1)
        targets = self.places[samples]
        ground = np.concatenate([targets, targets - LAG_RESERVE * behind[samples]], axis=1)
        # Lines take far less to make than as many points, and their hulls are the same.
        lines = shapely.linestrings(_plane(ground).reshape(*ground.shape, 2))
        cores = np.asarray(shapely.convex_hull(lines))
        passed_s, begins_s = np.array(self._passed_s), self.times_s[begins]
        half_widths_m = np.array([leg.band_m for leg in self.motion.legs])
        bands_m = np.minimum(half_widths_m[np.searchsorted(passed_s, begins_s)], INSIDE_BAND_M)
        nearest = np.abs(passed_s - begins_s[:, None]).argmin(axis=1)
        return cores, bands_m, np.array([corner.waypoint for corner in self.motion.corners])[nearest]


Ground = tuple["NDArray[np.object_]", "NDArray[np.float64]", "NDArray[np.int64]"]
"""Convex pieces, how far each is to be grown, and the waypoint that each belongs to."""


def _plane(numbers: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return complex numbers as points, shape (n, 2)."""
    return numbers.view(np.float64).reshape(-1, 2)


def _followed(
    places: list[complex], is_slowed: list[bool], vehicle: Vehicle, fence: FenceAhead
) -> list[complex]:
    """Follow a target point as AR_PosControl does, within the speed that is allowed at the rover's own place.

    The target's acceleration is passed on as it is. A rover that is slowed turns too fast by it, and drives to the inside of the turn.
    The rover turns as its controllers demand, and takes on the speed wanted at once. Written out in one loop: half of all planning of
    narrow routes was spent in here when each step called functions of its own.
    """
    lags = [0j] * len(is_slowed)
    velocities = [(after - before) / STEP_S for before, after in pairwise(places)]
    velocities.append(velocities[-1])
    top_mps = max(map(abs, velocities))
    gain_per_s, allowed_speed_mps = vehicle.position_gain_per_s, fence.speeds_about(top_mps)
    is_steered = vehicle.steering is Steering.ACKERMANN
    turn_radius_m = max(vehicle.turn_radius_m, 0.1)
    turn_mps = math.sqrt(vehicle.turn_max_g * GRAVITY_MPS2 / 2 * vehicle.turn_radius_m) if is_steered else 0.0
    slowed = [sample for sample, is_so in enumerate(is_slowed) if is_so]
    behind, driven, scale, at = 0j, 0j, 1.0, 0.0
    while (sample := int(at)) < len(is_slowed):
        velocity = velocities[sample]
        if not is_slowed[sample] and abs(behind) < _NO_LAG_M:
            following = bisect_left(slowed, sample)
            if following == len(slowed):
                break
            behind, scale, at = 0j, 1.0, float(slowed[following])
            driven = velocities[slowed[following] - 1]
            continue
        here = places[sample] + (at - sample) * STEP_S * velocity - behind
        wanted = velocity + gain_per_s * behind
        wanted_mps = abs(wanted) or 1.0
        most_mps = min(allowed_speed_mps(here, wanted / wanted_mps), top_mps, wanted_mps)
        wanted *= most_mps / wanted_mps
        wanted_mps = abs(wanted)
        now_mps = abs(driven)
        heading = driven / now_mps if now_mps > _LEAST_MPS else wanted / (wanted_mps or 1.0)
        accel = (velocities[sample + 1] - velocity) / STEP_S
        turn_radps = ((wanted + accel) * heading.conjugate()).imag / max(1.0, now_mps)
        if is_steered:
            most_radps = now_mps / turn_radius_m
            turn_radps = min(max(turn_radps, -most_radps), most_radps)
        heading *= cmath.rect(1.0, turn_radps * STEP_S)
        driven = heading * max(min(wanted_mps, turn_mps), (wanted * heading.conjugate()).real, 0.0)
        # How fast time runs for the target point: it waits for a rover that cannot keep up (AR_WPNav). 0.05 as in the simulator's `drive`.
        target_mps = max(abs(velocity), _LEAST_MPS)
        along_mps = ((driven - gain_per_s * behind) * velocity.conjugate()).real / target_mps
        runs = min(max(0.05 + along_mps / target_mps, _LEAST_SCALE), 1.0)
        scale += (runs - scale) * STEP_S / _SETTLE_S
        behind += (scale * velocity - driven) * STEP_S
        if abs(behind) > abs(lags[sample]):
            lags[sample] = behind
        at += scale
    return lags
