"""How PX4's rover with steered wheels drives: pure pursuit along lines, speed by the distance left and the heading error, and its body.

Written from PX4's source (v1.17.0: pure pursuit, the Ackermann rover's position control, the trajectory library) and fitted to what was measured where the
source does not say; apart from the drive model of `missions`, which is to hold against it.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavlink_bridge.simulator.px4.parameters import Px4Parameters

_CIRCLE_M = 0.85
"""The tightest circle of the simulated body; by its parameters it would be 0.56 m. Fitted, with the two below, to the 64 measured corners and the HOLD loop."""

_STEERING_LAG_S = 0.3
_SPEED_LAG_S = 0.15
"""How its speed follows; fitted as the others."""

_YAW_GAIN_PER_S = 3.0
"""How fast its wheels follow, and how fast it turns for a heading error."""

_FASTER_MPS = 0.2
"""Set to 1, 2 and 3 m/s it was driven at about 1.2, 2.2 and 3.2."""

_WAIT_MPS, _WAIT_SHARE = 1.75, 0.6
"""How fast it circles while it waits: set to 1, 2 and 3 m/s it drove 23 to 24, 29 and 33 to 38 m in 10 s. Fitted: so much, and this share of the set speed."""

_LEAST_MPS = 0.05  # below it stands; chosen


@dataclass(slots=True)
class PursuitBody:
    """Where it is (north + east·j, metres), where it looks (clockwise from north), how fast it is, and how it turns (1/m, to the right positive)."""

    position_m: complex
    heading_rad: float
    speed_mps: float = 0.0
    curvature: float = 0.0
    ramped_mps: float = 0.0  # the speed that it is to have, behind its limits; its own lags


@dataclass(frozen=True, slots=True)
class Aim:
    """What it drives to.

    Parameters
    ----------
    start_m, goal_m : complex
        The line: from the last waypoint to the next.
    cruise_mps, arrival_mps : float
        How fast it may drive, and how fast it may be at the goal; 0: it stops there.
    """

    start_m: complex
    goal_m: complex
    cruise_mps: float
    arrival_mps: float = 0.0


def turn_rad(before_m: complex, at_m: complex, after_m: complex) -> float:
    """Return the change of course at a waypoint, 0 to pi."""
    if at_m in {before_m, after_m}:
        return 0.0
    return abs(cmath.phase((after_m - at_m) / (at_m - before_m)))


class PursuitDrive:
    """Drives a body.

    Parameters
    ----------
    parameters : Px4Parameters or mapping of str to float
        Read whenever they matter.
    """

    def __init__(self, parameters: Px4Parameters | Mapping[str, float]) -> None:
        self._parameters = parameters

    def reached_m(self, turned_rad: float | None) -> float:
        """Return how near a waypoint counts as reached, by the turn behind it; None: it is the last one."""
        p = self._parameters
        least_m, most_m = p["NAV_ACC_RAD"], p["RA_ACC_RAD_MAX"]
        if turned_rad is None or most_m < least_m:
            return least_m
        circle_m = p["RA_WHEEL_BASE"] / math.sin(p["RA_MAX_STR_ANG"])
        half = math.tan((math.pi - turned_rad) / 2)
        wanted_m = p["RA_ACC_RAD_GAIN"] * circle_m / half if half > 1e-9 else math.inf
        return min(most_m, max(least_m, wanted_m))

    def corner_mps(self, turned_rad: float, cruise_mps: float) -> float:
        """Return how fast it may be at a corner."""
        p = self._parameters
        if p["RO_SPEED_RED"] <= 0:
            return cruise_mps
        wanted_mps = p["RO_MAX_THR_SPEED"] * (1 - min(1.0, p["RO_SPEED_RED"] * turned_rad / math.pi))
        return min(cruise_mps, max(wanted_mps, self._least_mps))

    def step(self, body: PursuitBody, aim: Aim | None, dt_s: float) -> None:
        """Let a short time pass; without an aim it brakes."""
        if aim is None:
            self._turn(body, body.heading_rad, 0.0, dt_s)
            return
        bearing_rad = self._bearing_rad(body, aim)
        error_rad = math.remainder(bearing_rad - body.heading_rad, math.tau)
        self._turn(body, bearing_rad, self._wanted_mps(body, aim, error_rad), dt_s)

    def circle(self, body: PursuitBody, place_m: complex, cruise_mps: float, dt_s: float) -> None:
        """Drive on about a place for a short time, as it does while it waits."""
        fast_mps = _WAIT_MPS + _WAIT_SHARE * cruise_mps
        self._turn(
            body,
            cmath.phase(place_m - body.position_m) if place_m != body.position_m else 0.0,
            fast_mps,
            dt_s,
        )

    def _turn(self, body: PursuitBody, bearing_rad: float, wanted_mps: float, dt_s: float) -> None:
        """Move on, turning to a bearing, with a speed that is wanted."""
        self._change_speed(body, wanted_mps, dt_s)
        rate_radps = _YAW_GAIN_PER_S * math.remainder(bearing_rad - body.heading_rad, math.tau)
        most_radps = math.radians(self._parameters["RO_YAW_RATE_LIM"])
        rate_radps = max(-most_radps, min(most_radps, rate_radps))
        wanted = rate_radps / body.speed_mps if body.speed_mps > _LEAST_MPS else 0.0
        wanted = max(-1 / _CIRCLE_M, min(1 / _CIRCLE_M, wanted))
        body.curvature += (wanted - body.curvature) * min(1.0, dt_s / _STEERING_LAG_S)
        moved_m = body.speed_mps * dt_s
        turned_rad = moved_m * body.curvature
        body.position_m += cmath.rect(moved_m, body.heading_rad + turned_rad / 2)
        body.heading_rad = math.remainder(body.heading_rad + turned_rad, math.tau)

    @property
    def _least_mps(self) -> float:
        """How slow it drives at the least where it turns: wheel base times yaw rate limit by the tangent of the steering angle."""
        p = self._parameters
        return p["RA_WHEEL_BASE"] * math.radians(p["RO_YAW_RATE_LIM"]) / math.tan(p["RA_MAX_STR_ANG"])

    def _wanted_mps(self, body: PursuitBody, aim: Aim, error_rad: float) -> float:
        p = self._parameters
        away_m = abs(aim.goal_m - body.position_m)
        if aim.arrival_mps == 0 and away_m <= p["NAV_ACC_RAD"]:
            return 0.0
        speed_mps = min(aim.cruise_mps, self._speed_for(away_m, aim.arrival_mps))
        if p["RO_SPEED_RED"] > 0:
            share = min(1.0, p["RO_SPEED_RED"] * abs(error_rad) / math.pi)
            least_mps = min(speed_mps, self._least_mps)
            speed_mps = max(least_mps, min(speed_mps, p["RO_MAX_THR_SPEED"] * (1 - share)))
        return speed_mps + _FASTER_MPS

    def _speed_for(self, away_m: float, arrival_mps: float) -> float:
        """Return the speed from which it can brake to another within a distance, by its jerk and deceleration."""
        decel, jerk = self._parameters["RO_DECEL_LIM"], self._parameters["RO_JERK_LIM"]
        if decel <= 0 or jerk <= 0:
            return math.inf
        half = 2 * decel**2 / jerk
        return max(arrival_mps, math.sqrt(half**2 + 2 * decel * away_m + arrival_mps**2) - half)

    def _change_speed(self, body: PursuitBody, wanted_mps: float, dt_s: float) -> None:
        up, down = self._parameters["RO_ACCEL_LIM"], self._parameters["RO_DECEL_LIM"]
        most_mps = body.ramped_mps + up * dt_s if up > 0 else math.inf
        least_mps = body.ramped_mps - down * dt_s if down > 0 else 0.0
        body.ramped_mps = max(0.0, least_mps, min(wanted_mps, most_mps))
        body.speed_mps += (body.ramped_mps - body.speed_mps) * min(1.0, dt_s / _SPEED_LAG_S)
        if wanted_mps == 0 and body.speed_mps < _LEAST_MPS:
            body.speed_mps = body.ramped_mps = 0.0

    def _bearing_rad(self, body: PursuitBody, aim: Aim) -> float:
        """Return where to steer: at the place on the line so far ahead; near the goal, or with no line, at the goal itself."""
        p = self._parameters
        ahead_m = max(p["PP_LOOKAHD_MIN"], min(p["PP_LOOKAHD_MAX"], p["PP_LOOKAHD_GAIN"] * aim.cruise_mps))
        to_goal_m = aim.goal_m - body.position_m
        line_m = aim.goal_m - aim.start_m
        if abs(to_goal_m) < ahead_m or abs(line_m) < _LEAST_MPS:
            return cmath.phase(to_goal_m) if to_goal_m else body.heading_rad
        along = line_m / abs(line_m)
        from_start_m = (body.position_m - aim.start_m) / along
        aside_m = from_start_m.imag
        if abs(aside_m) >= ahead_m:
            return cmath.phase(aim.start_m + along * from_start_m.real - body.position_m)
        target_m = aim.start_m + along * (from_start_m.real + math.sqrt(ahead_m**2 - aside_m**2))
        return cmath.phase(target_m - body.position_m)
