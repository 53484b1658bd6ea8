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
_MOST_AT_ONCE = 20_000  # places times edges: of more, parts of the way look only at what lies about them; chosen, it changes no answer
_TOUCHING_M2 = 1e-9  # a ray through the end of an edge meets it, rounding or not
_MAY_MEET_M2 = 1e-3  # the same, by products that are less exact; chosen, it changes no answer
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
        is_edge = lines[1:] == lines[:-1]
        starts, ends = points[:-1][is_edge], points[1:][is_edge]
        self.lows, self.highs = np.minimum(starts, ends), np.maximum(starts, ends)
        """The box about each, shape (n, 2)."""
        self.starts: NDArray[np.complex128] = _complex(starts)
        self.steps: NDArray[np.complex128] = _complex(ends) - self.starts
        """Where each begins, and its way, east + j north."""

    @property
    def is_empty(self) -> bool:
        """Whether there is none."""
        return not len(self.starts)


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
        self._lows, self._highs = fence.lows, fence.highs
        within_m = self.counts_within_m(vehicle.speed_mps)
        near = self._touch(places.min(axis=0), places.max(axis=0), within_m)
        self._lows, self._highs = self._lows[near], self._highs[near]
        self._starts, self._steps = fence.starts[near], fence.steps[near]

    def counts_within_m(self, top_mps: float) -> float:
        """Return the distance beyond which an edge does not slow a rover that drives at a speed."""
        return self._stops_within_m + max(top_mps / self._gain_per_s, top_mps**2 / self._accel_mps2)

    def speeds_mps(
        self, places: NDArray[np.float64], ways: NDArray[np.float64], top_mps: float
    ) -> NDArray[np.float64]:
        """Return the speed that is allowed at each place in its own direction (sqrt_controller of what is left to the margin); exact up to ``top_mps``, and above no less."""
        reach_m = self.counts_within_m(top_mps) + _SPARE_M
        at_once = max(_MOST_AT_ONCE // max(len(self._starts), 1), 1)
        ahead_m = np.concatenate(
            [
                self._ahead_m(places[begin : begin + at_once], ways[begin : begin + at_once], reach_m)
                for begin in range(0, max(len(places), 1), at_once)
            ]
        )
        left_m = np.maximum(ahead_m - self._stops_within_m, 0.0)
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
        near = self._highs >= np.subtract(low, reach_m)
        near &= self._lows <= np.add(high, reach_m)
        return np.asarray(near[:, 0] & near[:, 1])

    def _ahead_m(
        self, places: NDArray[np.float64], ways: NDArray[np.float64], reach_m: float
    ) -> NDArray[np.float64]:
        """Return how far ahead the first edge lies, exact up to a reach and beyond no less; infinite without one."""
        if not len(places):
            return np.zeros(0)
        ends = np.concatenate([places, places + reach_m * ways])
        near = self._touch(ends.min(axis=0), ends.max(axis=0), _SPARE_M)
        starts, steps = self._starts[near], self._steps[near]
        # Most rays pass most edges by, both ends on one side: only where they may meet the distance is taken.
        lefts = np.column_stack((-ways[:, 1], ways[:, 0]))
        own_m = (lefts * (places - places[0])).sum(axis=1)
        aside_m = lefts @ (_plane(starts) - places[0]).T - own_m[:, None]
        rays, edges = np.nonzero(aside_m * (aside_m + lefts @ _plane(steps).T) <= _MAY_MEET_M2)
        back = _complex(ways)[rays].conj()
        off, steps = (starts[edges] - _complex(places)[rays]) * back, steps[edges] * back
        with np.errstate(divide="ignore", invalid="ignore"):  # an edge along the way is met at its neighbours
            share = -off.imag / steps.imag
            away_m = off.real + share * steps.real
        met = (away_m >= 0) & (share >= 0) & (share <= 1)
        first_m = np.full(len(places), np.inf)
        np.minimum.at(first_m, rays[met], away_m[met])
        return first_m


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
            aside_m, turned_m = off.imag, turned.imag
            # Both ends on one side: passed by. An edge along the way is met at its neighbours.
            if aside_m * (aside_m + turned_m) <= _TOUCHING_M2 and turned_m:
                share = -aside_m / turned_m
                if 0 <= share <= 1:
                    away_m = off.real + share * turned.real
                    if 0 <= away_m < first_m:
                        first_m = away_m
        return first_m


def _complex(points: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return points, shape (n, 2), as east + j north."""
    return np.ascontiguousarray(points).view(np.complex128)[:, 0]


def _plane(numbers: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return east + j north as points, shape (n, 2)."""
    return np.ascontiguousarray(numbers).view(np.float64).reshape(-1, 2)
