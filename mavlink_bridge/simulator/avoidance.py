"""Simple avoidance: what ArduPilot does to the velocity that its position controller asks for near a fence (AC_Avoid).

It knows no union: an inclusion that the rover is in is a wall all round, whatever lies beyond. Within the margin of a wall it asks for a velocity
away from it, split by quadrants of north and east, and the position controller answers by driving backwards, wherever the wall is.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.simulator.controllers import sqrt_controlled
from missions.fence import CircleZone, ZoneKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from mavlink_bridge.simulator.fence_watch import Plane
    from mavlink_bridge.simulator.parameters import ParameterStore
    from missions.fence import Fence

_MOST_ACCEL_MPS2 = 1.0  # AC_AVOID_ACCEL_CMSS_MAX: it reckons with no more braking, whatever the rover can
_BACK_SHARE = 0.4  # of that, for the speed away from a wall (calc_backup_velocity_2D)
_LOOKS_BEYOND_M = 0.02  # farther than the margin and the way to a stop ("2.0f", centimetres)
_CREEPS_PAST_M, _CREEPS_PAST_SEVERAL_M = 0.04, 0.08
"""How far within the margin it comes to rest, and how much further with several inclusions. Measured: 0.03 to 0.07 and 0.07 to 0.10 m; why is not known
to us, it fits an estimate that wobbles so much. So FENCE_MARGIN 0 ends in a breach, and a seam of a union is crept over with 0.05, not with 0.1 m."""

_WOBBLE_M, _WOBBLE_TURN = (
    0.001,
    cmath.rect(1.0, 2.4),
)  # chosen: no estimate stands still, and none lies due south of a corner

_FORGETS_AFTER_S = 0.2  # AC_AVOID_ACCEL_TIMEOUT_MS
_ROUNDED_M = 0.001  # more than four bytes of centimetres are off some kilometres from home
_NOTHING_CM = float(np.finfo(np.float32).eps)  # FLT_EPSILON: what is_positive takes for 0, in cm and cm/s


@dataclass(frozen=True, slots=True)
class AvoidanceSettings:
    """The parameters that avoidance depends on, in plain units."""

    margin_m: float
    position_p: float
    accel_mps2: float
    backup_mps: float
    change_mps2: float
    is_sliding: bool

    @classmethod
    def from_parameters(cls, p: ParameterStore) -> AvoidanceSettings:
        """Read the settings."""
        accel = p["WP_ACCEL"] or p["ATC_ACCEL_MAX"] or 1.0
        return cls(
            margin_m=max(0.0, p.fence_margin_m),
            position_p=p["PSC_POS_P"],
            accel_mps2=min(accel, _MOST_ACCEL_MPS2),
            backup_mps=max(0.0, p["AVOID_BACKUP_SPD"]),
            change_mps2=p["AVOID_ACCEL_MAX"],
            is_sliding=p.whole("AVOID_BEHAVE") == 0,
        )


class _Quadrants:
    """Velocities away from walls: in each quadrant of north and east the largest parts; one along an axis counts in none."""

    def __init__(self, parts: Iterable[complex] = ()) -> None:
        self._largest = [0j] * 4
        for part in parts:
            self.add(part)

    def add(self, velocity_cmps: complex) -> None:
        north, east = velocity_cmps.real, velocity_cmps.imag
        if abs(north) <= _NOTHING_CM or abs(east) <= _NOTHING_CM:
            return
        number = 2 * (north < 0) + (east < 0)
        held = self._largest[number]
        self._largest[number] = complex(
            math.copysign(max(abs(held.real), abs(north)), north),
            math.copysign(max(abs(held.imag), abs(east)), east),
        )

    @property
    def total(self) -> complex:
        return sum(self._largest)


class _Wall:
    """A polygon, in the autopilot's own numbers: centimetres in four bytes.

    Its rounding decides whether a wall that runs due north or east makes the rover back away: only a velocity with both parts counts.
    """

    def __init__(self, corners_m: list[complex], *, keep_in: bool) -> None:
        self.keep_in = keep_in
        corners = np.array([(corner.real * 100, corner.imag * 100) for corner in corners_m], dtype=np.float32)
        self._known = 0j, 0.0, False
        self._free_about = 0j, -math.inf
        self._ends = corners
        self._starts = np.roll(corners, -1, axis=0)
        self._steps = self._ends - self._starts
        self._squares = np.maximum((self._steps**2).sum(axis=1), np.float32(_NOTHING_CM))
        self.edges_m = [
            (complex(*start) / 100, complex(*end) / 100)
            for start, end in zip(self._starts.tolist(), self._ends.tolist(), strict=True)
        ]

    def least_m(self, place_m: complex) -> float:
        """Return what is known of how far the nearest edge is at least, without measuring."""
        looked_from_m, free_m = self._free_about
        return free_m - abs(place_m - looked_from_m) - _ROUNDED_M

    def looked(self, place_m: complex, edge_m: float) -> None:
        """Keep how far the nearest edge is from a place."""
        self._free_about = place_m, edge_m

    def to_edges_cm(self, place_m: complex) -> NDArray[np.float32]:
        """Return the ways to the nearest point of each edge, north and east."""
        place = np.array((place_m.real * 100, place_m.imag * 100), dtype=np.float32)
        share = ((place - self._starts) * self._steps).sum(axis=1) / self._squares
        share = np.minimum(np.maximum(share, np.float32(0)), np.float32(1))
        return np.asarray(self._starts + self._steps * share[:, None] - place)

    def holds(self, place_m: complex, edge_m: float) -> bool:
        """Whether a place lies inside, given how far the nearest edge is: nearer than that to a place once looked at nothing changes."""
        looked_at_m, free_m, is_inside = self._known
        if abs(place_m - looked_at_m) >= free_m:
            is_inside = self._is_inside(place_m)
            self._known = place_m, edge_m, is_inside
        return is_inside

    def _is_inside(self, place_m: complex) -> bool:
        """By even and odd."""
        north, east = place_m.real * 100, place_m.imag * 100
        crossing = (self._starts[:, 1] > east) != (self._ends[:, 1] > east)
        starts, steps = self._starts[crossing], self._steps[crossing]
        share = (east - starts[:, 1]) / steps[:, 1]
        return bool(np.count_nonzero(north < starts[:, 0] + share * steps[:, 0]) % 2)


class Avoidance:
    """What keeps a rover off a fence.

    Parameters
    ----------
    fence : Fence
        The zones; the rover keeps out of exclusions and within each inclusion that it is in.
    plane : Plane
        The rover's frame.
    settings : AvoidanceSettings
        Its parameters.
    home_circle : tuple of complex and float, optional
        Centre and radius of the circle round home.
    """

    def __init__(
        self,
        fence: Fence,
        plane: Plane,
        settings: AvoidanceSettings,
        home_circle: tuple[complex, float] | None = None,
    ) -> None:
        self._settings = settings
        self._walls: list[_Wall] = []
        self._circles: list[tuple[complex, float, bool]] = []
        for zone in sorted(fence.zones, key=lambda zone: zone.kind is not ZoneKind.INCLUSION):
            keep_in = zone.kind is ZoneKind.INCLUSION
            if isinstance(zone, CircleZone):
                self._circles.append((plane.to_flat(zone.centre), zone.radius_m, keep_in))
            else:
                corners_m = [plane.to_flat(vertex) for vertex in zone.vertices]
                self._walls.append(_Wall(corners_m, keep_in=keep_in))
        if home_circle is not None:
            self._circles.append((*home_circle, True))
        several = sum(zone.kind is ZoneKind.INCLUSION for zone in fence.zones) > 1
        self._stops_at_m = settings.margin_m - (_CREEPS_PAST_SEVERAL_M if several else _CREEPS_PAST_M)
        self._wobble_m = complex(_WOBBLE_M)
        self._last_mps = 0j
        self._since_limited_s = math.inf
        self._free_about = 0j, -math.inf
        """From here nothing is nearer than so many metres."""

    def keep_off(self, place_m: complex, velocity_mps: complex, dt_s: float) -> tuple[complex, bool]:
        """Return the velocity that keeps off the fence, and whether the rover is to back away.

        Parameters
        ----------
        place_m : complex
            Where the rover believes it is.
        velocity_mps : complex
            What its position controller asks for.
        dt_s : float
            The time since the last call.
        """
        self._since_limited_s += dt_s
        self._wobble_m *= _WOBBLE_TURN
        place_m += self._wobble_m
        reach_m = self._settings.margin_m + self._stopping_m(abs(velocity_mps)) + _LOOKS_BEYOND_M
        looked_from_m, free_m = self._free_about
        if abs(place_m - looked_from_m) + reach_m < free_m:
            return velocity_mps, False
        wanted_mps, back_cmps = self._past_walls(place_m, velocity_mps, reach_m)
        wanted_mps, back_circles_cmps = self._past_circles(place_m, wanted_mps, reach_m)
        back_mps = _Quadrants([back_cmps, back_circles_cmps]).total / 100
        is_backing = bool(back_mps) and self._settings.backup_mps > 0
        if is_backing:
            back_mps *= min(1.0, self._settings.backup_mps / abs(back_mps))
            wanted_mps = complex(
                _at_least(wanted_mps.real, back_mps.real), _at_least(wanted_mps.imag, back_mps.imag)
            )
        return self._eased(velocity_mps, wanted_mps, dt_s), is_backing

    def _past_walls(self, place_m: complex, velocity_mps: complex, reach_m: float) -> tuple[complex, complex]:
        back = _Quadrants()
        nearest_m = math.inf
        for wall in self._walls:
            if (least_m := wall.least_m(place_m)) > reach_m:
                nearest_m = min(nearest_m, least_m)
                continue
            ways_cm = wall.to_edges_cm(place_m)
            away_cm = np.sqrt((ways_cm**2).sum(axis=1))
            edge_m = float(away_cm.min()) / 100
            wall.looked(place_m, edge_m)
            nearest_m = min(nearest_m, edge_m)
            if edge_m > reach_m or wall.holds(place_m, edge_m) is not wall.keep_in:
                continue
            near = np.flatnonzero(away_cm <= reach_m * 100)
            back.add(self._back_from(ways_cm, away_cm))
            ahead_m = place_m, reach_m * velocity_mps / (abs(velocity_mps) or 1.0)
            for edge in near.tolist():
                if not self._settings.is_sliding:
                    velocity_mps = self._stopped_before(velocity_mps, *ahead_m, wall.edges_m[edge])
                elif away_cm[edge] > 0:
                    way = complex(*ways_cm[edge].tolist()) / float(away_cm[edge])
                    velocity_mps = self._limited(velocity_mps, way, float(away_cm[edge]) / 100)
        self._free_about = place_m, (math.inf if not self._walls else nearest_m)
        return velocity_mps, back.total

    def _back_from(self, ways_cm: NDArray[np.float32], away_cm: NDArray[np.float32]) -> complex:
        """Return the velocity away from the edges of one polygon within whose margin the rover is."""
        into_cm = np.float32(self._stops_at_m * 100) - away_cm
        back = _Quadrants()
        for edge in np.flatnonzero((into_cm > _NOTHING_CM) & (away_cm > 0)).tolist():
            speed_cmps = np.float32(-100 * self._back_speed_mps(float(into_cm[edge]) / 100))
            back.add(complex(*(ways_cm[edge] / away_cm[edge] * speed_cmps).tolist()))
        return back.total

    def _stopped_before(
        self, velocity_mps: complex, place_m: complex, ahead_m: complex, edge_m: tuple[complex, complex]
    ) -> complex:
        """Return the velocity at which it stops the margin before an edge that lies ahead of it, measured along its way."""
        away_m = _meeting_m(place_m, ahead_m, edge_m)
        if away_m is None or not velocity_mps:
            return velocity_mps
        if away_m <= self._stops_at_m:
            return 0j
        return self._limited(velocity_mps, ahead_m / abs(ahead_m), away_m)

    def _limited(self, velocity_mps: complex, way: complex, away_m: float) -> complex:
        """Return a velocity whose part towards a wall is no more than what stops at the margin."""
        most_mps = self._speed_within_mps(max(0.0, away_m - self._stops_at_m))
        towards_mps = (velocity_mps * way.conjugate()).real
        return velocity_mps + way * min(0.0, most_mps - towards_mps)

    def _past_circles(
        self, place_m: complex, velocity_mps: complex, reach_m: float
    ) -> tuple[complex, complex]:
        back = _Quadrants()
        for centre_m, radius_m, keep_in in self._circles:
            off_m = place_m - centre_m
            away_m = radius_m - abs(off_m) if keep_in else abs(off_m) - radius_m
            looked_from_m, free_m = self._free_about
            self._free_about = looked_from_m, min(free_m, abs(away_m))
            if away_m < 0 or away_m > reach_m or radius_m < self._settings.margin_m:
                continue
            outwards = off_m / (abs(off_m) or 1.0)
            towards = outwards if keep_in else -outwards
            if away_m < self._stops_at_m:
                back.add(-100 * self._back_speed_mps(self._stops_at_m - away_m) * towards)
            speed_mps = abs(velocity_mps)
            if not speed_mps:
                continue
            if self._settings.is_sliding:
                velocity_mps = self._limited(velocity_mps, towards, away_m)
                continue
            ahead_m = reach_m * velocity_mps / speed_mps
            if away_m <= self._stops_at_m:
                if (abs(off_m + ahead_m) >= abs(off_m)) is keep_in:
                    return 0j, back.total
                continue
            stops_at_m = -self._stops_at_m if keep_in else self._stops_at_m
            to_m = _meeting_circle_m(off_m, ahead_m, radius_m + stops_at_m)
            if to_m is not None:
                velocity_mps *= min(1.0, self._speed_within_mps(to_m) / speed_mps)
        return velocity_mps, back.total

    def _speed_within_mps(self, left_m: float) -> float:
        settings = self._settings
        return abs(sqrt_controlled(complex(left_m), settings.position_p, settings.accel_mps2))

    def _back_speed_mps(self, into_m: float) -> float:
        settings = self._settings
        return abs(sqrt_controlled(complex(into_m), settings.position_p, _BACK_SHARE * settings.accel_mps2))

    def _stopping_m(self, speed_mps: float) -> float:
        p, accel = self._settings.position_p, self._settings.accel_mps2
        if speed_mps < accel / p:
            return speed_mps / p
        return accel / (2 * p * p) + speed_mps * speed_mps / (2 * accel)

    def _eased(self, asked_mps: complex, wanted_mps: complex, dt_s: float) -> complex:
        """Return the wanted velocity, or one on the way to it that AVOID_ACCEL_MAX allows."""
        most_mps = self._settings.change_mps2 * dt_s
        if asked_mps == wanted_mps or not most_mps:
            return wanted_mps
        if self._since_limited_s > _FORGETS_AFTER_S:
            self._last_mps = asked_mps
        change_mps = wanted_mps - self._last_mps
        if abs(change_mps) > most_mps:
            wanted_mps = self._last_mps + cmath.rect(most_mps, cmath.phase(change_mps))
        self._last_mps = wanted_mps
        if wanted_mps != asked_mps:
            self._since_limited_s = 0.0
        return wanted_mps


def _at_least(wanted: float, back: float) -> float:
    """Return a part of a velocity, or that of backing away where that goes further."""
    if not back:
        return wanted
    return max(wanted, back) if back > 0 else min(wanted, back)


def _meeting_m(place_m: complex, ahead_m: complex, edge_m: tuple[complex, complex]) -> float | None:
    """Return how far ahead an edge is met; None if it is not."""
    start_m, end_m = edge_m
    step_m = end_m - start_m
    across = (ahead_m.conjugate() * step_m).imag
    if not across:
        return None
    off_m = start_m - place_m
    along = (off_m.conjugate() * step_m).imag / across
    share = (off_m.conjugate() * ahead_m).imag / across
    return along * abs(ahead_m) if 0 <= along <= 1 and 0 <= share <= 1 else None


def _meeting_circle_m(off_m: complex, ahead_m: complex, radius_m: float) -> float | None:
    """Return how far ahead a circle is met by a rover at a place off its centre; None if it is not."""
    way = ahead_m / abs(ahead_m)
    middle_m = -(off_m * way.conjugate()).real
    square = radius_m**2 - abs(off_m + middle_m * way) ** 2
    if square < 0:
        return None
    meets_m = [middle_m + sign * math.sqrt(square) for sign in (-1, 1)]
    return next((meet_m for meet_m in meets_m if 0 <= meet_m <= abs(ahead_m)), None)
