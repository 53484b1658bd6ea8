"""What the vehicle's avoidance sees: how far ahead a fence lies, and what speed that leaves it (AC_Avoid, AR_PosControl).

Inside, a point or a way is one complex number, east + j north: turning a way is then a multiplication, and edges are met many at once.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.vehicle import Vehicle

_MOVED_M = 5.0
"""So far a place may move until the edges near it are looked for again."""

_MOST_ACCEL_MPS2 = 1.0
"""ArduPilot's avoidance reckons with no more braking, whatever the vehicle can (AC_Avoid.h, AC_AVOID_ACCEL_CMSS_MAX)."""

_SPARE_M = 0.1  # beyond the farthest edge that counts: chosen, so that rounding loses none
_TOUCHING_M2 = 1e-9  # a ray through the end of an edge meets it, rounding or not
_FEW = 24  # more edges than this are quicker in numpy than one by one; chosen, it changes no answer


class FenceEdges:
    """The straight edges of a fence.

    Parameters
    ----------
    fence : shapely geometry
        Its lines, metres.
    """

    def __init__(self, fence: BaseGeometry) -> None:
        points, lines = shapely.get_coordinates(shapely.get_parts(fence), return_index=True)
        self.ends: NDArray[np.float64] = np.stack((points[:-1], points[1:]), axis=1)[lines[1:] == lines[:-1]]
        """Where each begins and ends, shape (n, 2, 2)."""

    @property
    def is_empty(self) -> bool:
        """Whether there is none."""
        return not len(self.ends)


class FenceAhead:
    """The straight edges of a fence that a drive has to do with.

    Parameters
    ----------
    fence : FenceEdges
        What it avoids.
    places : ndarray of float, shape (n, 2)
        Where it drives, east and north in metres.
    vehicle : Vehicle
        What drives.
    """

    def __init__(self, fence: FenceEdges, places: NDArray[np.float64], vehicle: Vehicle) -> None:
        self._stops_within_m = vehicle.stops_within_m
        self._gain_per_s = vehicle.position_gain_per_s
        self._accel_mps2 = min(vehicle.accel_max_mps2, _MOST_ACCEL_MPS2)
        self._linear_m = self._accel_mps2 / self._gain_per_s**2
        self._edges = fence.ends
        within_m = self.counts_within_m(vehicle.speed_mps)
        self._edges = self._edges[self._touch(places.min(axis=0), places.max(axis=0), within_m)]
        self._starts = _complex(self._edges[:, 0])
        self._steps = _complex(self._edges[:, 1]) - self._starts

    def counts_within_m(self, top_mps: float) -> float:
        """Return the distance beyond which an edge does not slow a rover that drives at a speed."""
        return self._stops_within_m + max(top_mps / self._gain_per_s, top_mps**2 / self._accel_mps2)

    def speeds_mps(self, places: NDArray[np.float64], ways: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the speed that is allowed at each place in its own direction (sqrt_controller of what is left to the margin)."""
        left_m = np.maximum(self._ahead_m(_complex(places), _complex(ways)) - self._stops_within_m, 0.0)
        far_mps = np.sqrt(2 * self._accel_mps2 * np.maximum(left_m - self._linear_m / 2, 0.0))
        return np.where(left_m <= self._linear_m, self._gain_per_s * left_m, far_mps)

    def speeds_about(self, top_mps: float) -> Callable[[complex, complex], float]:
        """Return the speed that is allowed at one place in one direction, both east + j north, as a function; exact up to ``top_mps``, and above no less.

        It looks only at edges near the last places asked for.
        """
        reach_m = self.counts_within_m(top_mps) + _SPARE_M + _MOVED_M
        stops_within_m, gain_per_s, linear_m = self._stops_within_m, self._gain_per_s, self._linear_m
        twice_mps2 = 2 * self._accel_mps2
        centre, edges = complex(math.inf), _Edges(self._starts[:0], self._steps[:0])

        def allowed_mps(place: complex, way: complex) -> float:
            nonlocal centre, edges
            if not abs(place - centre) <= _MOVED_M:
                centre = place
                here = (place.real, place.imag)
                near = self._touch(here, here, reach_m)
                edges = _Edges(self._starts[near], self._steps[near])
            left_m = edges.ahead_m(place, way) - stops_within_m
            if left_m <= 0:
                return 0.0
            if left_m <= linear_m:
                return gain_per_s * left_m
            return math.sqrt(twice_mps2 * (left_m - linear_m / 2))

        return allowed_mps

    def _touch(self, low: ArrayLike, high: ArrayLike, reach_m: float) -> NDArray[np.bool_]:
        """Return which edges may come within reach of a box."""
        starts, ends = self._edges[:, 0], self._edges[:, 1]
        near = np.maximum(starts, ends) >= np.subtract(low, reach_m)
        near &= np.minimum(starts, ends) <= np.add(high, reach_m)
        return np.asarray(near.all(axis=1))

    def _ahead_m(self, places: NDArray[np.complex128], ways: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return how far ahead the first edge lies; infinite without one."""
        back = ways.conj()[:, None]
        off = (self._starts - places[:, None]) * back
        steps = self._steps * back
        with np.errstate(divide="ignore", invalid="ignore"):  # an edge along the way is met at its neighbours
            share = -off.imag / steps.imag
            away_m = off.real + share * steps.real
        met = (away_m >= 0) & (share >= 0) & (share <= 1)
        return np.asarray(np.where(met, away_m, np.inf).min(axis=1, initial=np.inf))


class _Edges:
    """The edges near a place, in numpy and one by one: they are asked for so often that a few are best looked at one by one."""

    def __init__(self, starts: NDArray[np.complex128], steps: NDArray[np.complex128]) -> None:
        self._starts, self._steps = starts, steps
        self._pairs = list(zip(starts.tolist(), steps.tolist(), strict=True))

    def ahead_m(self, place: complex, way: complex) -> float:
        """Return how far ahead of one place the first edge lies; infinite without one."""
        back = way.conjugate()
        edges = self._pairs
        if len(edges) > _FEW:
            aside_m = ((self._starts - place) * back).imag
            crossing = aside_m * (aside_m + (self._steps * back).imag) <= _TOUCHING_M2
            edges = [edges[edge] for edge in np.flatnonzero(crossing).tolist()]
        first_m = math.inf
        for start, step in edges:
            off, turned = (start - place) * back, step * back
            if turned.imag:  # an edge along the way is met at its neighbours
                share = -off.imag / turned.imag
                if 0 <= share <= 1:
                    away_m = off.real + share * turned.real
                    if 0 <= away_m < first_m:
                        first_m = away_m
        return first_m


def _complex(points: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return points, shape (n, 2), as east + j north."""
    return np.ascontiguousarray(points).view(np.complex128)[:, 0]
