"""The drive law: how a rover follows waypoints (ArduPilot's AR_WPNav), sans-IO and deterministic.

A point moves along the legs by their speed profiles; at a corner the next leg starts while the last one still slows down, as soon as the
middle of the turn lies within WP_RADIUS, and both motions add up: that is what cuts the corner. The position controller follows the
point, the steering and throttle controllers follow it, the body follows them, each with its lag: that is what swings out.
"""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

from mavlink_bridge.simulator.controllers import Attitude, Position, Settings
from mavlink_bridge.simulator.scurve import LegMotion, MotionLimits

if TYPE_CHECKING:
    from mavlink_bridge.simulator.avoidance import Avoidance
    from mavlink_bridge.simulator.body import Body

# So near to the next leg a pivot ends; chosen, not measured: ArduPilot's AR_PIVOT_ANGLE_ACCURACY is 5°.
_PIVOT_ACCURACY_RAD = math.radians(10.0)


class Driver:
    """A rover's driver: follows waypoints or stops.

    Parameters
    ----------
    settings : Settings
        Limits and gains.
    body : Body
        What is moved.
    turns_early : bool
        Whether it begins turns as ArduPilot did before 4.6.
    """

    def __init__(self, settings: Settings, body: Body, *, turns_early: bool = False) -> None:
        self.body = body
        self._turns_early = turns_early
        self._attitude = Attitude(settings, body)
        self._position = Position(settings, body, self._attitude)
        self._speed_mps = settings.speed_mps
        self.change_settings(settings)
        self.stop()

    def change_settings(self, settings: Settings) -> None:
        """Take changed parameters; a speed asked for in the mission stays until the next parameter of it."""
        if settings.speed_mps != getattr(self, "_settings", settings).speed_mps:
            self._speed_mps = settings.speed_mps
        self._settings = settings
        self._attitude.settings = settings
        self._apply_speed()

    @property
    def destination_m(self) -> complex | None:
        """Where it drives, None while it stops."""
        return self._destination_m

    @property
    def distance_m(self) -> float:
        """How far the destination is."""
        return 0.0 if self._destination_m is None else abs(self._destination_m - self.body.estimate_m)

    @property
    def has_arrived(self) -> bool:
        """Whether the destination is reached; at a corner it is when the next leg may begin."""
        return self._has_arrived

    @property
    def is_still(self) -> bool:
        """Whether it stops and stands."""
        return (
            self._destination_m is None and self._attitude.throttle == 0 and abs(self.body.speed_mps) < 1e-3
        )

    @property
    def throttle(self) -> float:
        """The throttle, -1 to 1."""
        return self._attitude.throttle

    @property
    def cross_track_m(self) -> float:
        """How far right of the leg it is."""
        if not self._leg.length_m:
            return 0.0
        return float(((self.body.estimate_m - self._leg.origin_m) * self._leg.direction.conjugate()).imag)

    def motors_off(self) -> None:
        """Forget what the controllers hold; the motors do nothing."""
        self._attitude.reset()

    def stop(self) -> None:
        """Brake and stand."""
        self._destination_m: complex | None = None
        self._has_arrived = False
        self._is_fast = False
        self._pivot_to: complex | None = None
        self._pivot_next = False
        self._pivot_since_s = 0.0
        self._time_scale = 1.0
        self._leg = self._last_leg = self._next_leg = LegMotion(
            self.body.estimate_m, self.body.estimate_m, self._limits
        )
        self._position.reset()

    def go_to(self, destination_m: complex, next_m: complex | None) -> None:
        """Drive to a point, and on to the next one without a stop if there is one.

        Called when the last point is reached it goes on from there, else from where the rover can stop.
        """
        if not self._has_arrived:
            origin_m = self._stopping_point()
            self.stop()
            self._pivot_next = False
        else:
            origin_m = self._leg.destination_m
        self._last_leg = self._leg if self._has_arrived else LegMotion(origin_m, origin_m, self._limits)
        if self._is_fast and self._next_leg.length_m and self._next_leg.destination_m == destination_m:
            self._leg = self._next_leg
        else:
            self._last_leg.finish()
            self._leg = LegMotion(origin_m, destination_m, self._limits)
            self._start_pivot(destination_m - origin_m)
        self._destination_m = destination_m
        self._has_arrived = False
        self._is_fast = False
        self._next_leg = LegMotion(destination_m, destination_m, self._limits)
        self._pivot_next = False
        if next_m is not None and next_m != destination_m:
            turn_rad = abs(cmath.phase((next_m - destination_m) * (destination_m - origin_m).conjugate()))
            self._pivot_next = self._pivots(turn_rad)
            if not self._pivot_next:
                self._next_leg = LegMotion(destination_m, next_m, self._limits)
                self._is_fast = True

    def change_speed(self, speed_mps: float) -> None:
        """Drive on with another top speed (DO_CHANGE_SPEED)."""
        self._speed_mps = speed_mps
        self._apply_speed()
        self._leg.change_speed(speed_mps)
        self._next_leg.change_speed(speed_mps)

    def step(self, dt_s: float, avoidance: Avoidance | None = None) -> None:
        """Let a short time pass.

        Parameters
        ----------
        dt_s : float
            The time, 0.02 s on a rover.
        avoidance : Avoidance, optional
            What keeps it off a fence.
        """
        if self._destination_m is None:
            self._attitude.drive(0.0, 0.0, dt_s)
        elif self._pivot_to is not None:
            self._pivot(self._pivot_to, dt_s)
        else:
            accel_mps2 = self._advance(dt_s)
            self._attitude.drive(*self._position.update(accel_mps2, avoidance, dt_s), dt_s)
        self.body.step(self._attitude.steering, self._attitude.throttle, dt_s)

    def coast(self, dt_s: float, *, armed: bool) -> None:
        """Let a short time pass without throttle; the motors of an armed rover take it back no faster than MOT_SLEWRATE."""
        self._attitude.let_go(dt_s if armed else math.inf)
        self.body.step(0.0, self._attitude.throttle, dt_s)

    def _apply_speed(self) -> None:
        limits = self._settings
        self._limits = MotionLimits(self._speed_mps, limits.waypoint_accel_mps2, limits.waypoint_jerk_mps3)
        self._position.settings = limits
        self._position.speed_mps = self._speed_mps

    def _stopping_point(self) -> complex:
        speed_mps = self.body.speed_mps
        return self.body.estimate_m + self.body.direction * speed_mps * abs(speed_mps) / (
            2 * self._settings.decel_mps2
        )

    def _pivots(self, turn_rad: float) -> bool:
        limits = self._settings
        return limits.is_skid and 0 < limits.pivot_angle_rad < turn_rad

    def _start_pivot(self, course: complex) -> None:
        turn_rad = abs(cmath.phase(course * self.body.direction.conjugate())) if course else 0.0
        if self._settings.is_skid and (self._pivot_next or self._pivots(turn_rad)):
            self._pivot_to = course / abs(course)
            self._pivot_since_s = 0.0

    def _pivot(self, course: complex, dt_s: float) -> None:
        limits = self._settings
        error_rad = cmath.phase(course * self.body.direction.conjugate())
        rate = max(
            -limits.pivot_rate_radps, min(limits.pivot_rate_radps, error_rad * limits.steering_angle_p)
        )
        if self._attitude.limited_speed(0.0, dt_s):
            rate = 0.0  # first it comes to a stop, by the speed that was asked for
        self._attitude.drive(rate, 0.0, dt_s)
        if abs(error_rad) < _PIVOT_ACCURACY_RAD:
            if self._pivot_since_s >= limits.pivot_delay_s:
                self._pivot_to = None
                self._position.reset()
            self._pivot_since_s += dt_s

    def _advance(self, dt_s: float) -> complex:
        """Move the target point on; return its acceleration."""
        self._scale_time(dt_s)
        step_s = dt_s * self._time_scale
        self._last_leg.advance(step_s)
        self._leg.advance(step_s)
        gone_m, velocity_mps, accel_mps2 = self._leg.at(self._leg.elapsed_s)
        before = self._last_leg.at(self._last_leg.elapsed_s)
        left_m = before[0] - self._last_leg.length_m * self._last_leg.direction
        self._position.target_m = self._leg.origin_m + gone_m + left_m
        self._position.target_velocity_mps = velocity_mps + before[1]
        if not self._has_arrived:
            self._has_arrived = self._leg_is_over()
        return accel_mps2 + before[2]

    def _scale_time(self, dt_s: float) -> None:
        """Slow the target point down if the rover cannot keep up with it."""
        limits = self._settings
        velocity_mps = self._position.target_velocity_mps
        scale = 1.0
        if velocity_mps:
            course = velocity_mps / abs(velocity_mps)
            ahead_m = (self._position.error_m * course.conjugate()).real
            along_mps = (self.body.velocity_mps * course.conjugate()).real
            scale = 0.05 + (along_mps - limits.position_p * ahead_m) / abs(velocity_mps)
            scale = max(0.1, min(1.0, scale))
        settle_s = limits.waypoint_accel_mps2 / limits.waypoint_jerk_mps3
        self._time_scale += (scale - self._time_scale) * dt_s / max(settle_s, dt_s)

    def _leg_is_over(self) -> bool:
        if self._is_fast:
            return self._leg.is_finished or self._may_turn()
        if not self._leg.is_finished:
            return False
        past_m = (self.body.estimate_m - self._leg.destination_m) * self._leg.direction.conjugate()
        return self.distance_m <= self._settings.radius_m or past_m.real >= 0

    def _may_turn(self) -> bool:
        """Whether the next leg may begin: the middle of the turn lies within the waypoint's radius (SCurve.cpp)."""
        leg, after = self._leg, self._next_leg
        from_s = leg.slowing_from_s - (after.turn_in_s if self._turns_early else 0.0)
        if leg.elapsed_s < from_s or leg.left_s >= after.duration_s / 2:
            return False
        if self._turns_early and abs(leg.at(leg.elapsed_s)[0]) < leg.length_m / 2:
            return False
        half_s = leg.left_s / 2
        before = leg.at(leg.elapsed_s + half_s)
        behind = after.at(half_s)
        middle_m = before[0] - leg.length_m * leg.direction + behind[0]
        turn_radius_m = 0.0 if self._settings.is_skid else self._settings.turn_radius_m
        return (
            abs(middle_m) < max(self._settings.radius_m, turn_radius_m)
            and abs(before[1] + behind[1]) < self._speed_mps
            and abs(before[2] + behind[2]) < self._settings.lateral_accel_mps2
        )
