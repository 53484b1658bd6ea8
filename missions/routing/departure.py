"""Leaving the start: which ways a vehicle can take from where it stands and faces, and what it keeps to the fences meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from shapely import Point

from missions.drive_model import envelope
from missions.drive_model.corner import START_BEHIND_M, band_m
from missions.fitting.polyline import shifted
from missions.geo import heading_vector
from missions.ground.start_hazard import LEAVES_FROM_M
from missions.vehicle import Steering

if TYPE_CHECKING:
    from collections.abc import Iterator

    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

# Chosen, not measured: a first leg every 15° from the heading on, and its lengths.
WAYS = 24
LENGTHS_M = (16.0, 8.0, 4.0)
ROOM_M = START_BEHIND_M[-1][1] + 1.0
"""With so much more room than it has to keep a vehicle can turn any way: the farthest that it comes behind its start, and its band."""


_MEASURED_START_MPS = 2.0
"""Of the measured starts near a margin (docs/drive-model.md)."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A straight first leg.

    Parameters
    ----------
    there : LocalPoint
        Where it leads.
    kept_m : float
        What the driven band keeps to any fence.
    turn_deg : float
        How far the vehicle has to turn for it.
    """

    there: LocalPoint
    kept_m: float
    turn_deg: float


class Departures:
    """First legs in all directions, each predicted when it is asked for.

    Parameters
    ----------
    ground : Ground
        The field.
    vehicle : Vehicle
        What drives.
    start : LocalPoint
        Where it stands.
    heading_deg : float or None
        Where it faces, clockwise from north; None is along each leg.
    """

    def __init__(
        self, ground: Ground, vehicle: Vehicle, start: LocalPoint, heading_deg: float | None
    ) -> None:
        self._others = _all_round(ground, vehicle, start, heading_deg)
        self._found: list[Departure] = []

    def any_keeps(self, clearance_m: float) -> bool:
        """Return whether one of them keeps so much: mostly one of the first does."""
        if any(one.kept_m >= clearance_m for one in self._found):
            return True
        for one in self._others:
            self._found.append(one)
            if one.kept_m >= clearance_m:
                return True
        return False

    def best_first(self) -> list[Departure]:
        """Return all of them, the one that keeps most first."""
        self._found += self._others
        return sorted(self._found, key=lambda one: -one.kept_m)


def _all_round(
    ground: Ground, vehicle: Vehicle, start: LocalPoint, heading_deg: float | None
) -> Iterator[Departure]:
    for number in range(WAYS):
        # Ways beside the present heading: straight on is the first of them.
        course_deg = (heading_deg or 0.0) + 360.0 * number / WAYS
        for length_m in LENGTHS_M:
            there = shifted(start, heading_vector(course_deg), length_m)
            facing_deg = course_deg if heading_deg is None else heading_deg
            band = envelope([start, there], vehicle, heading_deg=facing_deg % 360.0)
            turn_deg = abs((course_deg - facing_deg + 180.0) % 360.0 - 180.0)
            yield Departure(there, band.clearance_m(ground.edge), turn_deg)


def least_turning_m(ground: Ground, start: LocalPoint, vehicle: Vehicle) -> float:
    """Return what the driven band must keep while a vehicle turns into its way; 0 where nothing follows from less.

    A steered rover whose swing takes it within the margin of its avoidance is where those that started there backed into the fence. The band of
    a straight line does not count: from a little more than the margin on they left as usual. It counts as for a speed at which that was measured: a
    simulated rover of 5 m/s, allowed the straying of 5 m/s, backed into the fence.
    """
    if not (vehicle.avoids_fence and vehicle.backs_away and vehicle.steering is Steering.ACKERMANN):
        return 0.0
    away_m = min(ground.clearance_m(Point(start)), vehicle.stops_within_m + LEAVES_FROM_M)
    return max(away_m - band_m(vehicle, min(vehicle.speed_mps, _MEASURED_START_MPS)), 0.0)


def turning_hazard(vehicle: Vehicle) -> tuple[str, str]:
    """Return what avoidance does to a vehicle that keeps less while it turns, and what helps."""
    return (
        f"within {vehicle.fence.margin_name} {vehicle.stops_within_m:g} m its avoidance takes over, and backs it up towards the fence",
        "turn it by hand to face the route, or move it, or set AVOID_BACKUP_SPD 0 or AVOID_ENABLE 0 until it has turned",
    )
