"""HOLD of PX4's rover with steered wheels: it rolls past the place where the mode changed, and turns a loop back to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.drive_model.stopping import Leaving, Stopping

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model.stopping import Motion
    from missions.stops import Stops
    from missions.vehicle import Vehicle

LOOPED = "from PX4's simulation, not your rover"

_SPEEDS_MPS, _AHEAD_M = (2.0, 3.0), (1.9, 2.3)
"""Measured on v1.17.0 (the line of 1.18: 1.9 and 2.2 m): how far past the place of the mode change it rolls, from 2 and 3 m/s. Slower as from 2 m/s; faster,
where nothing was measured, with the square of the speed."""

ASIDE_M = 2.1
"""How far to one side the loop takes it: 2.03 m in the recorded one, from 2.7 m/s."""

_BACK_M = 0.7
"""It comes back to within so far of the place."""

_REST_S = 3.5
"""After so long at the most it is at rest: 3 to 3.5 s were measured from 2 and 3 m/s on both versions."""


@dataclass(frozen=True)
class HoldLoop:
    """The ground of a HOLD: ahead, to either side, and a little behind. What is known of the vehicle's own stops counts where it is longer.

    Parameters
    ----------
    known : Stopping or None
        Stops that were measured or given; None where there are none.
    """

    known: Stopping | None = None

    def distance_m(self, speed_mps: float) -> float:
        """Return how far ahead it comes from a speed."""
        return float(self.distances_m(np.array([speed_mps]))[0])

    def distances_m(self, speeds_mps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far ahead it comes from each of several speeds."""
        ahead_m = np.interp(speeds_mps, _SPEEDS_MPS, _AHEAD_M) * _beyond(speeds_mps)
        if self.known is not None:
            ahead_m = np.maximum(ahead_m, self.known.distances_m(speeds_mps))
        return np.asarray(ahead_m)

    def aside_m(self, speed_mps: float) -> float:
        """Return how far to a side it comes from a speed."""
        return ASIDE_M * float(_beyond(np.array([speed_mps]))[0])

    def rest_s(self, speed_mps: float) -> float:
        """Return how long it takes to come to rest from a speed."""
        loop_s = _REST_S * float(_beyond(np.array([speed_mps]))[0])
        return loop_s if self.known is None else max(loop_s, self.known.rest_s(speed_mps))

    def source(self, speed_mps: float) -> str:
        """Return in words what the distance rests on at a speed."""
        if self.known is None:
            return LOOPED
        looped_m = HoldLoop().distance_m(speed_mps)
        return LOOPED if looped_m >= self.known.distance_m(speed_mps) else self.known.source(speed_mps)

    def leaves(
        self, moving: Motion, allowed: BaseGeometry, more_m: NDArray[np.float64] | float = 0.0
    ) -> Leaving:
        """Return how each HOLD on a way leaves the allowed area: with the deepest place of its ground; as `Stopping.leaves`."""
        grounds = self._grounds(moving, more_m)
        count = len(grounds)
        beyond_m = np.full(count, -np.inf)
        reach_m: NDArray[np.float64] = np.array(self.distances_m(moving.speeds_mps) + more_m)
        ends = moving.places.copy()
        shapely.prepare(allowed)
        edge = allowed.boundary
        for one in np.flatnonzero(~shapely.covers(allowed, grounds)).tolist():
            outside = shapely.get_coordinates(shapely.difference(grounds[one], allowed))
            if not len(outside):
                continue
            depths_m = np.asarray(shapely.distance(shapely.points(outside), edge))
            deepest = int(depths_m.argmax())
            ends[one] = outside[deepest]
            beyond_m[one] = depths_m[deepest]
            # What is told is how far away the fence is, whichever way the loop comes to it.
            place = shapely.Point(moving.places[one])
            reach_m[one] = beyond_m[one] + (edge.distance(place) if allowed.covers(place) else 0.0)
        return Leaving(reach_m, beyond_m, ends)

    def _grounds(self, moving: Motion, more_m: NDArray[np.float64] | float) -> NDArray[np.object_]:
        """Return a rectangle for each place."""
        ways = moving.ways
        right = np.stack((ways[:, 1], -ways[:, 0]), axis=1)
        ahead_m = np.reshape(self.distances_m(moving.speeds_mps) + more_m, (-1, 1))
        aside_m = (ASIDE_M * _beyond(moving.speeds_mps))[:, None]
        front, back = moving.places + ways * ahead_m, moving.places - ways * _BACK_M
        corners = (
            front + right * aside_m,
            front - right * aside_m,
            back - right * aside_m,
            back + right * aside_m,
        )
        return np.asarray(shapely.polygons(np.stack(corners, axis=1)), dtype=np.object_)


def _beyond(speeds_mps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much more ground it takes at speeds beyond those that were measured."""
    return np.asarray(np.maximum(speeds_mps / _SPEEDS_MPS[-1], 1.0) ** 2)


def ending_of(vehicle: Vehicle, stops: Stops) -> Stopping | HoldLoop:
    """Return what a HOLD does to a vehicle: it rolls straight on, or drives a loop."""
    stopping = Stopping(stops, vehicle.steering)
    if vehicle.pursuit is None:
        return stopping
    return HoldLoop(stopping if stops.given or stops.own else None)
