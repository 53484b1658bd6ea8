"""The rover's body: what steering and throttle do to it (ArduPilot's SIM_Rover)."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

ESTIMATE_OFFSET_M = 0.1 + 0.1j
"""The rover believes itself so far ahead and to the right of where it is (forward + right·j).

Measured: it drives 0.05 to 0.17 m to the left of its line, and its estimate differs from the truth by 0.03 to 0.11 m on average.
"""

_OFFSET_FROM_MPS = 0.5
"""From this speed on the offset is whole; a rover that stands knows where it is."""

# max_wheel_turn, turning_circle and skid_turn_rate of ArduPilot's SITL (SIM_Rover.h).
_STEERING_LOCK_RAD = math.radians(35.0)
_TURNING_CIRCLE_M = 1.8  # in diameter: twice the 0.9 m of TURN_RADIUS
_SKID_TURN_RATE_RADPS = math.radians(140.0)


@dataclass(slots=True)
class Body:
    """A rover on flat ground without slip.

    Parameters
    ----------
    position_m : complex
        North + east·j.
    heading_rad : float
        Clockwise from north.
    is_skid : bool
        Whether it steers by its wheels' speeds instead of turning them.
    """

    position_m: complex
    heading_rad: float
    is_skid: bool = False
    speed_mps: float = 0.0
    turn_rate_radps: float = 0.0

    @property
    def direction(self) -> complex:
        """The unit vector of its heading."""
        return cmath.rect(1.0, self.heading_rad)

    @property
    def velocity_mps(self) -> complex:
        """Its velocity, north + east·j."""
        return self.speed_mps * self.direction

    @property
    def estimate_m(self) -> complex:
        """Where it believes it is."""
        moving = min(1.0, abs(self.speed_mps) / _OFFSET_FROM_MPS)
        return self.position_m + moving * ESTIMATE_OFFSET_M * self.direction

    def step(self, steering: float, throttle: float, dt_s: float) -> None:
        """Move on by a short time, with steering (positive to the right) and throttle from -1 to 1."""
        max_speed_mps, max_accel_mps2 = (4.0, 14.0) if self.is_skid else (20.0, 10.0)
        accel_mps2 = max_accel_mps2 * (throttle * max_speed_mps - self.speed_mps) / max_speed_mps
        self.turn_rate_radps = self._turn_rate(steering)
        self.position_m += (self.speed_mps + accel_mps2 * dt_s / 2) * dt_s * self._mean_direction(dt_s)
        self.speed_mps += accel_mps2 * dt_s
        self.heading_rad = math.remainder(self.heading_rad + self.turn_rate_radps * dt_s, math.tau)

    def _mean_direction(self, dt_s: float) -> complex:
        return cmath.rect(1.0, self.heading_rad + self.turn_rate_radps * dt_s / 2)

    def _turn_rate(self, steering: float) -> float:
        if self.is_skid:
            return 2 * steering * _SKID_TURN_RATE_RADPS
        lock = math.sin(steering * _STEERING_LOCK_RAD) / math.sin(_STEERING_LOCK_RAD)
        return self.speed_mps * lock / (_TURNING_CIRCLE_M / 2)
