"""ArduRover's inner controllers: steering rate, throttle, position; their parameters and their lags are what bends the track."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from mavlink_bridge.simulator.body import Body
    from mavlink_bridge.simulator.parameters import ParameterStore

GRAVITY_MPS2 = 9.80665  # standard gravity; ArduPilot's GRAVITY_MSS


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters the drive law depends on, in plain units.

    ``deceleration`` falls back to the acceleration, the waypoint acceleration and jerk to one another, as ArduPilot does.
    """

    # Many attributes: one for each of the autopilot's parameters that bends the track.

    speed_mps: float
    accel_mps2: float
    decel_mps2: float
    waypoint_accel_mps2: float
    waypoint_jerk_mps3: float
    radius_m: float
    turn_radius_m: float
    lateral_accel_mps2: float
    pivot_angle_rad: float
    pivot_rate_radps: float
    pivot_delay_s: float
    cruise_throttle_per_mps: float
    stop_speed_mps: float
    steering_accel_radps2: float
    steering_rate_radps: float
    steering_angle_p: float
    rate_gains: tuple[float, float, float, float]
    speed_gains: tuple[float, float, float, float]
    position_p: float
    velocity_p: float
    velocity_filter_hz: float
    speed_scale_base_mps: float
    slew_per_s: float
    is_skid: bool

    @classmethod
    def from_parameters(cls, parameters: ParameterStore) -> Settings:
        """Read the settings."""
        p = parameters
        accel = p["ATC_ACCEL_MAX"] or 1.0
        waypoint_accel = p["WP_ACCEL"] or accel
        speed = p["WP_SPEED"] or p["CRUISE_SPEED"]
        return cls(
            speed_mps=speed,
            accel_mps2=accel,
            decel_mps2=p["ATC_DECEL_MAX"] or accel,
            waypoint_accel_mps2=waypoint_accel,
            waypoint_jerk_mps3=p["WP_JERK"] or waypoint_accel,
            radius_m=p["WP_RADIUS"],
            turn_radius_m=p["TURN_RADIUS"],
            lateral_accel_mps2=p["ATC_TURN_MAX_G"] * GRAVITY_MPS2,
            pivot_angle_rad=math.radians(p["WP_PIVOT_ANGLE"]),
            pivot_rate_radps=math.radians(p["WP_PIVOT_RATE"]),
            pivot_delay_s=p["WP_PIVOT_DELAY"],
            cruise_throttle_per_mps=p["CRUISE_THROTTLE"] / 100.0 / (p["CRUISE_SPEED"] or 1.0),
            stop_speed_mps=p["ATC_STOP_SPEED"],
            steering_accel_radps2=math.radians(p["ATC_STR_ACC_MAX"]),
            steering_rate_radps=math.radians(p["ATC_STR_RAT_MAX"]),
            steering_angle_p=p["ATC_STR_ANG_P"],
            rate_gains=_gains(p, "ATC_STR_RAT"),
            speed_gains=_gains(p, "ATC_SPEED"),
            position_p=p["PSC_POS_P"],
            velocity_p=p["PSC_VEL_P"],
            velocity_filter_hz=p["PSC_VEL_FLTE"],
            speed_scale_base_mps=p["MOT_SPD_SCA_BASE"],
            slew_per_s=p["MOT_SLEWRATE"] / 100.0 or math.inf,
            is_skid=(p["SERVO1_FUNCTION"], p["SERVO3_FUNCTION"]) == (73.0, 74.0),
        )


_COMPASS_RAD = 1e-3
"""No compass is more exact (chosen, not measured). AR_PosControl turns by what the target lies aside, so that facing exactly away is a balance that
a real vehicle does not keep; a simulated skid-steered rover without pivot stood there for ever."""


class KeepsOff(Protocol):
    """What keeps a rover off a fence."""

    def keep_off(self, place_m: complex, velocity_mps: complex, dt_s: float) -> tuple[complex, bool]:
        """Return the velocity that does, and whether the rover is to back away."""
        ...


class _Pid:
    """Proportional, integral, feed forward; the error passes a low-pass filter first (AC_PID)."""

    def __init__(self, gains: tuple[float, float, float, float], filter_hz: float = 10.0) -> None:
        self._p, self._i, self._feed_forward, self._max_integral = gains
        self._filter_s = 1 / (2 * math.pi * filter_hz)
        self.reset()

    def reset(self) -> None:
        self._error: float | None = None
        self._integral = 0.0

    def update(self, target: float, actual: float, dt_s: float, *, limited: bool) -> float:
        error = target - actual
        if self._error is not None:
            error = self._error + (error - self._error) * dt_s / (dt_s + self._filter_s)
        self._error = error
        step = error * self._i * dt_s
        if not limited or step * self._integral < 0:
            self._integral = max(-self._max_integral, min(self._max_integral, self._integral + step))
        return self._p * error + self._integral + self._feed_forward * target


class Attitude:
    """AR_AttitudeControl with the motors behind it: turn rate and speed in, steering and throttle to the body."""

    def __init__(self, settings: Settings, body: Body) -> None:
        self.settings = settings
        self._body = body
        self._rate_pid = _Pid(settings.rate_gains)
        self._speed_pid = _Pid(settings.speed_gains)
        self._turn_rate_radps = 0.0
        self.speed_mps = 0.0
        self._steering_asked = 0.0
        self.steering = 0.0
        self.throttle = 0.0

    def reset(self, throttle: float = 0.0) -> None:
        """Forget everything: the controllers are off."""
        self._rate_pid.reset()
        self._speed_pid.reset()
        self._turn_rate_radps = self._body.turn_rate_radps
        self.speed_mps = self._body.speed_mps
        self.steering, self.throttle = 0.0, throttle

    def let_go(self, dt_s: float) -> None:
        """Take the throttle back to 0 as fast as the motors may."""
        self.reset(
            throttle=math.copysign(
                max(0.0, abs(self.throttle) - self.settings.slew_per_s * dt_s), self.throttle
            )
        )

    def limited_speed(self, speed_mps: float, dt_s: float) -> float:
        """Return the speed that the acceleration limits allow next, on the way to the one asked."""
        limits = self.settings
        gaining = abs(speed_mps) > abs(self.speed_mps) and speed_mps * self.speed_mps >= 0
        step_mps = (limits.accel_mps2 if gaining else limits.decel_mps2) * dt_s
        return max(self.speed_mps - step_mps, min(self.speed_mps + step_mps, speed_mps))

    def drive(self, turn_rate_radps: float, speed_mps: float, dt_s: float) -> None:
        """Set steering and throttle for a turn rate (positive to the right) and a speed."""
        self.steering = self._steer(turn_rate_radps, dt_s)
        self.throttle = self._push(speed_mps, dt_s)

    def _steer(self, turn_rate_radps: float, dt_s: float) -> float:
        limits, body = self.settings, self._body
        step = limits.steering_accel_radps2 * dt_s
        rate = max(self._turn_rate_radps - step, min(self._turn_rate_radps + step, turn_rate_radps))
        lateral = max(limits.lateral_accel_mps2 / max(abs(body.speed_mps), 0.1), math.radians(1.0))
        most = min(limits.steering_rate_radps, lateral)
        self._turn_rate_radps = max(-most, min(most, rate))
        slow = abs(body.speed_mps) <= limits.speed_scale_base_mps
        limited = abs(self._steering_asked) >= 1.0 or (slow and not limits.is_skid)
        steering = self._rate_pid.update(self._turn_rate_radps, body.turn_rate_radps, dt_s, limited=limited)
        steering = self._steering_asked = max(-1.0, min(1.0, steering))
        if limits.is_skid:
            return steering
        if body.speed_mps < 0:
            steering = -steering
        return steering if slow else steering * limits.speed_scale_base_mps / abs(body.speed_mps)

    def _push(self, speed_mps: float, dt_s: float) -> float:
        limits, body = self.settings, self._body
        self.speed_mps = self.limited_speed(speed_mps, dt_s)
        if speed_mps == 0 and self.speed_mps == 0 and abs(body.speed_mps) <= limits.stop_speed_mps:
            self._speed_pid.reset()
            return 0.0
        limited = abs(self.throttle) >= 1.0
        throttle = self._speed_pid.update(self.speed_mps, body.speed_mps, dt_s, limited=limited)
        return max(-1.0, min(1.0, throttle + self.speed_mps * limits.cruise_throttle_per_mps))


class Position:
    """AR_PosControl: from a moving target point to a turn rate and a speed."""

    def __init__(self, settings: Settings, body: Body, attitude: Attitude) -> None:
        self.settings = settings
        self.speed_mps = settings.speed_mps
        self._body = body
        self._attitude = attitude
        self.target_m = body.estimate_m
        self.target_velocity_mps = 0j
        self._velocity_error: complex | None = None

    @property
    def error_m(self) -> complex:
        """From where it believes it is to the target point."""
        return self.target_m - self._body.estimate_m

    def reset(self) -> None:
        """Aim at where the rover is."""
        self.target_m = self._body.estimate_m
        self.target_velocity_mps = 0j
        self._velocity_error = None

    def update(self, accel_mps2: complex, avoidance: KeepsOff | None, dt_s: float) -> tuple[float, float]:
        """Return turn rate and speed for the target point, its velocity and its acceleration."""
        limits, body = self.settings, self._body
        most_accel = min(limits.accel_mps2, limits.lateral_accel_mps2)
        velocity_mps = self.target_velocity_mps + sqrt_controlled(self.error_m, limits.position_p, most_accel)
        if abs(velocity_mps) > self.speed_mps:
            velocity_mps *= self.speed_mps / abs(velocity_mps)
        is_backing = False
        if avoidance is not None:
            velocity_mps, is_backing = avoidance.keep_off(body.estimate_m, velocity_mps, dt_s)
        error_mps = velocity_mps - body.velocity_mps
        if self._velocity_error is not None:
            filter_s = 1 / (2 * math.pi * limits.velocity_filter_hz)
            error_mps = self._velocity_error + (error_mps - self._velocity_error) * dt_s / (dt_s + filter_s)
        self._velocity_error = error_mps
        facing = body.direction
        if (velocity_mps * facing.conjugate()).real < 0 and abs((velocity_mps * facing.conjugate()).imag) < (
            _COMPASS_RAD * abs(velocity_mps)
        ):
            facing *= cmath.rect(1.0, _COMPASS_RAD)
        ahead = velocity_mps * facing.conjugate()
        if (
            not self.target_velocity_mps
        ):  # the target point stands: what is left is driven straight, however slowly (since 4.5)
            return 0.0, self._attitude.limited_speed(ahead.real, dt_s)
        wanted = (limits.velocity_p * error_mps + accel_mps2) * facing.conjugate()
        turn_speed_mps = math.sqrt(limits.lateral_accel_mps2 * 0.5 * self._turn_radius())
        least_mps = min(abs(velocity_mps), turn_speed_mps)
        # Backing away is always backwards, as if the fence lay ahead.
        speed_mps = min(-least_mps, ahead.real) if is_backing else max(least_mps, ahead.real)
        speed_mps = self._attitude.limited_speed(speed_mps, dt_s)
        divisor = -max(-speed_mps, 1.0) if speed_mps < 0 else max(speed_mps, 1.0)
        return wanted.imag / divisor, speed_mps

    def _turn_radius(self) -> float:
        return 0.0 if self.settings.is_skid else self.settings.turn_radius_m


def sqrt_controlled(error: complex, p: float, most_accel: float) -> complex:
    """Return p times the error, but for a large error no more than can be braked (AP's sqrt_controller)."""
    size = abs(error)
    if size == 0:
        return 0j
    linear = most_accel / (p * p)
    rate = math.sqrt(2 * most_accel * (size - linear / 2)) if size > linear else p * size
    return cmath.rect(rate, cmath.phase(error))


def _gains(p: ParameterStore, prefix: str) -> tuple[float, float, float, float]:
    return p[f"{prefix}_P"], p[f"{prefix}_I"], p[f"{prefix}_FF"], p[f"{prefix}_IMAX"]
