"""How a rover speeds up and slows down on one leg: ArduPilot's S-curve from rest to rest.

Every leg is a motion of its own, with limited speed, acceleration and jerk; corners are driven by starting the next motion before the
last one has ended (SCurve.cpp). The short smoothing of the jerk itself (a snap of 15 m/s⁴) is left out: it lasts a tenth of a second.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_NEWTON_STEPS = 8  # each doubles the digits that are right; 8 leave no more than rounding


class Ramp(NamedTuple):
    """Speeding up from rest to a speed, with limited acceleration and jerk; slowing down is the same run backwards.

    A tuple, as a leg's profile is: tens of thousands are made for one plan.

    Parameters
    ----------
    speed_mps : float
        The speed reached, above 0.
    jerk_mps3 : float
        The limit of the jerk, above 0.
    jerk_s : float
        How long the acceleration grows, and again how long it falls.
    duration_s : float
        How long the whole ramp takes.
    """

    speed_mps: float
    jerk_mps3: float
    jerk_s: float
    duration_s: float

    @property
    def length_m(self) -> float:
        """How far it goes meanwhile."""
        return self.speed_mps * self.duration_s / 2

    def travelled_m(self, time_s: float) -> float:
        """Return the distance from the point of rest after a time; beyond the ramp the speed stays."""
        speed_mps, jerk_mps3, jerk_s, duration_s = self
        half_s = duration_s / 2
        if time_s > half_s:
            # The ramp is symmetric: its second half mirrors the first about the half speed.
            rest_s = max(duration_s - time_s, 0.0)
            return speed_mps * (time_s - half_s) + _first_half_m(jerk_mps3, jerk_s, rest_s)
        return _first_half_m(jerk_mps3, jerk_s, time_s)

    def speed_at_mps(self, time_s: float) -> float:
        """Return the speed after a time from rest; beyond the ramp it stays."""
        if time_s > self.duration_s / 2:
            return self.speed_mps - self._early_mps(max(self.duration_s - time_s, 0.0))
        return self._early_mps(max(time_s, 0.0))

    def _early_mps(self, time_s: float) -> float:
        """Return the speed in the first half of the ramp."""
        jerking_s = min(time_s, self.jerk_s)
        return self.jerk_mps3 * jerking_s * (time_s - jerking_s / 2)

    def accel_at_mps2(self, time_s: float) -> float:
        """Return the acceleration in the first half of the ramp."""
        return self.jerk_mps3 * min(time_s, self.jerk_s)

    def time_s(self, distance_m: float) -> float:
        """Return the time to a distance; beyond the ramp the speed stays."""
        jerk_s = self.jerk_s
        jerk_m = self.jerk_mps3 * jerk_s**3 / 6
        if distance_m <= jerk_m:
            return math.cbrt(6 * distance_m / self.jerk_mps3)
        if distance_m > _first_half_m(self.jerk_mps3, jerk_s, self.duration_s / 2):
            return self._late_time_s(distance_m)
        half_s = self.jerk_s / 2
        accel_mps2 = self.jerk_mps3 * self.jerk_s
        return self.jerk_s - half_s + math.sqrt(half_s**2 + 2 * (distance_m - jerk_m) / accel_mps2)

    def time_to_speed_s(self, speed_mps: float) -> float:
        """Return the time to a speed, at most that of the ramp."""
        if speed_mps > self.speed_mps / 2:
            return self.duration_s - self.time_to_speed_s(max(self.speed_mps - speed_mps, 0.0))
        jerk_mps = self.jerk_mps3 * self.jerk_s**2 / 2
        if speed_mps <= jerk_mps:
            return math.sqrt(2 * speed_mps / self.jerk_mps3)
        return self.jerk_s + (speed_mps - jerk_mps) / (self.jerk_mps3 * self.jerk_s)

    def _late_time_s(self, distance_m: float) -> float:
        """Return the time to a distance in the second half and beyond, where the speed hardly changes: by Newton's method."""
        time_s = self.duration_s / 2 + (distance_m - self.length_m / 2) / self.speed_mps
        for _ in range(_NEWTON_STEPS):
            rest_s = max(self.duration_s - time_s, 0.0)
            lost_mps = self.jerk_mps3 * (rest_s**2 / 2 - max(rest_s - self.jerk_s, 0.0) ** 2 / 2)
            time_s += (distance_m - self.travelled_m(time_s)) / (self.speed_mps - lost_mps)
        return time_s


class LegProfile(NamedTuple):
    """One leg driven from rest to rest.

    Parameters
    ----------
    length_m : float
        Its length, above 0.
    ramp : Ramp
        Its start; the end is the same backwards.
    duration_s : float
        How long it takes from rest to rest.
    """

    length_m: float
    ramp: Ramp
    duration_s: float

    @property
    def top_speed_mps(self) -> float:
        """The highest speed on this leg; short legs do not reach the speed asked for."""
        return self.ramp.speed_mps

    def travelled_m(self, time_s: float) -> float:
        """Return the distance from the leg's start after a time since its start."""
        if time_s > self.duration_s / 2:
            return self.length_m - self.ramp.travelled_m(self.duration_s - time_s)
        return self.ramp.travelled_m(time_s)

    def speed_at_mps(self, time_s: float) -> float:
        """Return the speed after a time since the leg's start."""
        return self.ramp.speed_at_mps(min(time_s, self.duration_s - time_s))


def all_travelled_m(
    profiles: Sequence[LegProfile], counts: Sequence[int], times_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return `LegProfile.travelled_m` of several legs at once: of the first for so many times within it, then of the next."""
    rows = [
        (
            one.length_m,
            one.duration_s,
            one.ramp.speed_mps,
            one.ramp.jerk_mps3,
            one.ramp.jerk_s,
            one.ramp.duration_s,
        )
        for one in profiles
    ]
    length_m, duration_s, speed_mps, jerk_mps3, jerk_s, ramp_s = np.repeat(np.array(rows), counts, axis=0).T
    is_late = times_s > duration_s / 2
    from_rest_s = np.where(is_late, duration_s - times_s, times_s)
    half_s = ramp_s / 2
    rising_s = np.where(from_rest_s > half_s, np.maximum(ramp_s - from_rest_s, 0.0), from_rest_s)
    jerking_s = np.minimum(rising_s, jerk_s)
    more_s = rising_s - jerking_s
    away_m = jerk_mps3 * (jerking_s**3 / 6 + jerk_s * more_s * (jerk_s + more_s) / 2)
    away_m += speed_mps * np.maximum(from_rest_s - half_s, 0.0)
    return np.asarray(np.where(is_late, length_m - away_m, away_m))


@lru_cache(maxsize=128)  # lines that are tried have most legs in common; more save nothing
def leg_profile(length_m: float, speed_mps: float, accel_mps2: float, jerk_mps3: float) -> LegProfile:
    """Return the motion along a leg: to the speed asked for, or as fast as half its length allows."""
    lag_s = accel_mps2 / jerk_mps3
    # Length of both ramps = leg: v²/a + v·a/j = L where the acceleration is reached, else 2·v·√(v/j) = L.
    reachable_mps = accel_mps2 / 2 * (math.sqrt(lag_s**2 + 4 * length_m / accel_mps2) - lag_s)
    if reachable_mps < accel_mps2 * lag_s:
        reachable_mps = math.cbrt(length_m**2 * jerk_mps3 / 4)
    return profile_at(length_m, min(speed_mps, reachable_mps), accel_mps2, jerk_mps3)


def profile_at(length_m: float, top_mps: float, accel_mps2: float, jerk_mps3: float) -> LegProfile:
    """Return the motion along a leg with a speed that it reaches."""
    jerk_s = min(accel_mps2 / jerk_mps3, math.sqrt(top_mps / jerk_mps3))
    ramp = Ramp(top_mps, jerk_mps3, jerk_s, jerk_s + top_mps / (jerk_mps3 * jerk_s))
    return LegProfile(length_m, ramp, length_m / top_mps + ramp.duration_s)


def _first_half_m(jerk_mps3: float, jerk_s: float, time_s: float) -> float:
    """Return the distance after a time in the first half of a ramp."""
    if time_s <= jerk_s:
        return jerk_mps3 * time_s**3 / 6
    more_s = time_s - jerk_s
    return jerk_mps3 * jerk_s * (jerk_s**2 / 6 + jerk_s * more_s / 2 + more_s**2 / 2)
