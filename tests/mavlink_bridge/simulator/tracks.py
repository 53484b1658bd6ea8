"""Drive chains of corners with the bare drive law and measure them the way the reference was measured.

Points are complex, north + east·j. A corner's window runs from the middle of the leg before to the middle of the leg after it; its
inside cut and outside overshoot are the largest distances from the two legs on either side.
"""

from __future__ import annotations

import cmath
import itertools
import math
from dataclasses import dataclass

import numpy as np

from mavlink_bridge.simulator.body import Body
from mavlink_bridge.simulator.controllers import Settings
from mavlink_bridge.simulator.drive import Driver
from mavlink_bridge.simulator.parameters import ParameterStore

TICK_S = 0.02
SKID = {
    "SERVO1_FUNCTION": 73.0,
    "SERVO3_FUNCTION": 74.0,
    "ATC_STR_RAT_FF": 0.2,
    "CRUISE_SPEED": 3.0,
    "CRUISE_THROTTLE": 75.0,
}
"""What ArduPilot's rover-skid.parm sets."""


@dataclass(frozen=True)
class Corner:
    """What was measured of one corner."""

    inside_cut_m: float
    outside_overshoot_m: float
    nearest_m: float
    least_speed_mps: float


@dataclass(frozen=True)
class Track:
    """Positions, speeds and the number of the point driven to, at every tick."""

    points_m: np.ndarray
    speeds_mps: np.ndarray
    towards: np.ndarray

    @property
    def time_s(self) -> float:
        """How long it took."""
        return len(self.points_m) * TICK_S


def chain(turns_deg: list[float], legs_m: list[float]) -> list[complex]:
    """Return the points of a chain of legs with turns between them; it begins to the north."""
    heading = 0.0
    points = [0j]
    for leg_m, turn_deg in zip(legs_m, [*turns_deg, 0.0], strict=True):
        points.append(points[-1] + leg_m * cmath.rect(1.0, heading))
        heading += math.radians(turn_deg)
    return points


def settings(vehicle: str, **parameters: float) -> Settings:
    """Return the settings of a vehicle, ``ackermann`` or ``skid``."""
    return Settings.from_parameters(ParameterStore({**(SKID if vehicle == "skid" else {}), **parameters}))


def drive(
    points_m: list[complex], limits: Settings, *, heading_rad: float | None = None, turns_early: bool = False
) -> Track:
    """Drive along points without stops; return the track."""
    first_rad = cmath.phase(points_m[1] - points_m[0]) if heading_rad is None else heading_rad
    body = Body(points_m[0], first_rad, limits.is_skid)
    driver = Driver(limits, body, turns_early=turns_early)
    after = [*points_m[2:], None, None]
    index = 1
    rows = []
    driver.go_to(points_m[1], after[0])
    while index < len(points_m):
        driver.step(TICK_S)
        rows.append((body.position_m, body.speed_mps, index))
        assert len(rows) * TICK_S < 5000.0
        if driver.has_arrived:
            index += 1
            if index < len(points_m):
                driver.go_to(points_m[index], after[index - 1])
    positions, speeds, towards = zip(*rows, strict=True)
    return Track(np.array(positions), np.array(speeds), np.array(towards))


def corners(track: Track, points_m: list[complex]) -> list[Corner]:
    """Measure every corner of a chain."""
    middles = _middles(track, points_m)
    found = []
    for index in range(1, len(points_m) - 1):
        window = slice(middles[index - 1], middles[index] + 1)
        path = track.points_m[window] - points_m[index]
        found.append(_corner(path, track.speeds_mps[window], *points_m[index - 1 : index + 2]))
    return found


def _middles(track: Track, points_m: list[complex]) -> list[int]:
    middles: list[int] = []
    for index, (start, end) in enumerate(itertools.pairwise(points_m), start=1):
        along_m = ((track.points_m - start) * ((end - start) / abs(end - start)).conjugate()).real
        here = (track.towards >= index) & (track.towards <= index + 1) & (along_m >= abs(end - start) / 2)
        here[: middles[-1] if middles else 0] = False
        assert here.any()
        middles.append(int(np.argmax(here)))
    return middles


def _corner(path: np.ndarray, speeds: np.ndarray, before: complex, at: complex, after: complex) -> Corner:
    come, go = (at - before) / abs(at - before), (after - at) / abs(after - at)
    side = math.copysign(1.0, cmath.phase(go / come))
    first, second = path * come.conjugate(), path * go.conjugate()
    from_first = np.where(first.real > 0, abs(first), abs(first.imag))
    from_second = np.where(second.real < 0, abs(second), abs(second.imag))
    distance = np.minimum(from_first, from_second)
    right = np.where(from_first <= from_second, first.imag, second.imag) * side
    inside = (right > 0) & ~((first.real > 0) & (second.real < 0))
    return Corner(
        float(np.max(distance, where=inside, initial=0.0)),
        float(np.max(distance, where=~inside, initial=0.0)),
        float(abs(path).min()),
        float(speeds.min()),
    )
