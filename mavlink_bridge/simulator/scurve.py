"""The speed along one leg: from rest to rest with limited acceleration and jerk (ArduPilot's SCurve)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

SNAP_MPS4 = 15.0
"""ArduPilot's limit of the jerk's own change (AR_WPNAV_SNAP_MAX)."""


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What a leg may not exceed: speed (m/s), acceleration (m/s²), jerk (m/s³)."""

    speed_mps: float
    accel_mps2: float
    jerk_mps3: float


@dataclass(frozen=True, slots=True)
class _Piece:
    """A stretch of constant jerk, from a moment and a state on."""

    start_s: float
    distance_m: float
    speed_mps: float
    accel_mps2: float
    jerk_mps3: float

    def at(self, time_s: float) -> tuple[float, float, float]:
        t = time_s - self.start_s
        a, j = self.accel_mps2, self.jerk_mps3
        speed_mps = self.speed_mps + t * (a + t * j / 2)
        return self.distance_m + t * (self.speed_mps + t * (a / 2 + t * j / 6)), speed_mps, a + t * j


class LegMotion:
    """A straight leg and the time spent on it; the point and its speed are complex, north + east·j.

    Parameters
    ----------
    origin_m, destination_m : complex
        Its ends.
    limits : MotionLimits
        What may not be exceeded.
    """

    def __init__(self, origin_m: complex, destination_m: complex, limits: MotionLimits) -> None:
        self.origin_m = origin_m
        self.destination_m = destination_m
        self.length_m = abs(destination_m - origin_m)
        self.direction = (destination_m - origin_m) / self.length_m if self.length_m else 0j
        self.elapsed_s = 0.0
        self._limits = _softened(limits)
        self._plan(0.0, 0.0, 0.0)

    @property
    def is_finished(self) -> bool:
        """Whether its time is over."""
        return self.elapsed_s >= self.duration_s

    @property
    def left_s(self) -> float:
        """What is left of its time."""
        return max(0.0, self.duration_s - self.elapsed_s)

    def advance(self, dt_s: float) -> None:
        """Let time pass."""
        self.elapsed_s = min(self.elapsed_s + dt_s, self.duration_s)

    def finish(self) -> None:
        """Go to its end."""
        self.elapsed_s = self.duration_s

    def at(self, time_s: float) -> tuple[complex, complex, complex]:
        """Return how far it has gone from its origin, its velocity and its acceleration at a moment."""
        if not self._pieces:
            return 0j, 0j, 0j
        if time_s >= self.duration_s:
            return self.length_m * self.direction, 0j, 0j
        piece = next(piece for piece in reversed(self._pieces) if piece.start_s <= max(time_s, 0.0))
        distance_m, speed_mps, accel_mps2 = piece.at(max(time_s, 0.0))
        return distance_m * self.direction, speed_mps * self.direction, accel_mps2 * self.direction

    def change_speed(self, speed_mps: float) -> None:
        """Drive on with another top speed: from here if the leg has not begun or is at its top speed, else not at all."""
        self._limits = replace(self._limits, speed_mps=speed_mps)
        if not self.length_m or self.elapsed_s >= self.slowing_from_s:
            return
        if self.elapsed_s == 0.0:
            self._plan(0.0, 0.0, 0.0)
            return
        at_s = max(self.elapsed_s, self.at_speed_from_s)
        gone_m, velocity_mps, _ = self.at(at_s)
        kept = [piece for piece in self._pieces if piece.start_s < at_s]
        self._plan(at_s, abs(gone_m), abs(velocity_mps), kept)

    def _plan(self, from_s: float, gone_m: float, speed_mps: float, kept: list[_Piece] | None = None) -> None:
        """Lay out ramps to the top speed and to rest, with the stretch of top speed between them."""
        self._pieces = list(kept or [])
        top_mps = self._top_speed(self.length_m - gone_m, speed_mps)
        ramp_m = self._ramp_length(speed_mps, top_mps) + self._ramp_length(top_mps, 0.0)
        cruise_m = max(0.0, self.length_m - gone_m - ramp_m)
        at_s, at_m = self._ramp(from_s, gone_m, speed_mps, top_mps)
        self.at_speed_from_s = at_s
        self.turn_in_s = at_s - self._ramp_times(abs(top_mps - speed_mps))[0]
        if cruise_m > 0 and top_mps > 0:
            self._pieces.append(_Piece(at_s, at_m, top_mps, 0.0, 0.0))
            at_s, at_m = at_s + cruise_m / top_mps, at_m + cruise_m
        self.slowing_from_s = at_s
        self.duration_s, _ = self._ramp(at_s, at_m, top_mps, 0.0)

    def _ramp(self, from_s: float, from_m: float, speed_mps: float, to_mps: float) -> tuple[float, float]:
        change_mps = to_mps - speed_mps
        if not change_mps:
            return from_s, from_m
        jerk = math.copysign(self._limits.jerk_mps3, change_mps)
        jerk_s, level_s = self._ramp_times(abs(change_mps))
        state = (from_m, speed_mps, 0.0)
        for span_s, piece_jerk in ((jerk_s, jerk), (level_s, 0.0), (jerk_s, -jerk)):
            piece = _Piece(from_s, *state, piece_jerk)
            self._pieces.append(piece)
            from_s += span_s
            state = piece.at(from_s)
        return from_s, state[0]

    def _ramp_times(self, change_mps: float) -> tuple[float, float]:
        accel, jerk = self._limits.accel_mps2, self._limits.jerk_mps3
        if change_mps < accel * accel / jerk:
            return math.sqrt(change_mps / jerk), 0.0
        return accel / jerk, change_mps / accel - accel / jerk

    def _ramp_length(self, speed_mps: float, to_mps: float) -> float:
        jerk_s, level_s = self._ramp_times(abs(to_mps - speed_mps))
        return (speed_mps + to_mps) / 2 * (2 * jerk_s + level_s)

    def _top_speed(self, length_m: float, speed_mps: float) -> float:
        """Return the limit, or what a short leg allows: the largest speed whose ramps fit, by bisection."""
        low_mps, high_mps = speed_mps, self._limits.speed_mps

        def ramps_m(top_mps: float) -> float:
            return self._ramp_length(speed_mps, top_mps) + self._ramp_length(top_mps, 0.0)

        if high_mps <= low_mps or ramps_m(high_mps) <= length_m:
            return high_mps
        for _ in range(50):
            middle_mps = (low_mps + high_mps) / 2
            low_mps, high_mps = (
                (middle_mps, high_mps) if ramps_m(middle_mps) <= length_m else (low_mps, middle_mps)
            )
        return low_mps


def _softened(limits: MotionLimits) -> MotionLimits:
    """Return limits whose constant jerk takes as long as the real one, which rises and falls by the snap limit."""
    rise_s = math.pi * limits.jerk_mps3 / (2 * SNAP_MPS4)
    ramp_s = limits.accel_mps2 / limits.jerk_mps3 + rise_s
    return replace(limits, jerk_mps3=limits.accel_mps2 / ramp_s)
