"""What the vehicle's avoidance sees: how far ahead a fence lies, and what speed that leaves it (AC_Avoid, AR_PosControl).

Inside, a point or a way is one complex number, east + j north: turning a way is then a multiplication, and edges are met many at once.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.vehicle import Vehicle

_SQUARE_M = 5.0
"""Edges near a place are looked for once for all places in a square of this size."""

_MOST_ACCEL_MPS2 = 1.0
"""ArduPilot's avoidance reckons with no more braking, whatever the vehicle can (AC_Avoid.h, AC_AVOID_ACCEL_CMSS_MAX)."""

_SPARE_M = 0.1  # beyond the farthest edge that counts: chosen, so that rounding loses none
_MOST_AT_ONCE = 20_000  # places times edges: of more, parts of the way look only at what lies about them; chosen, it changes no answer
_TOUCHING_M2 = 1e-9  # a ray through the end of an edge meets it, rounding or not
_MAY_MEET_M2 = 1e-3  # the same, by products that are less exact; chosen, it changes no answer
_FEW = 32  # more edges than this are quicker in numpy than one by one; chosen, it changes no answer


class BoxedEdges(NamedTuple):
    """Straight edges, each with the box about it.

    Parameters
    ----------
    lows, highs : ndarray of float, shape (n, 2)
        Of the boxes, east and north in metres.
    starts, steps : ndarray of complex, shape (n,)
        Where each begins, and its way, east + j north.
    """

    lows: NDArray[np.float64]
    highs: NDArray[np.float64]
    starts: NDArray[np.complex128]
    steps: NDArray[np.complex128]

    def within(self, low: ArrayLike, high: ArrayLike, reach_m: float) -> BoxedEdges:
        """Return those that may come within reach of a box."""
        near = self.highs >= np.subtract(low, reach_m)
        near &= self.lows <= np.add(high, reach_m)
        chosen = near[:, 0] & near[:, 1]
        return BoxedEdges(self.lows[chosen], self.highs[chosen], self.starts[chosen], self.steps[chosen])


class FenceEdges:
    """The straight edges of a fence, and which of them lie near the places that were asked for.

    Parameters
    ----------
    fence : shapely geometry
        Its lines, metres.
    """

    def __init__(self, fence: BaseGeometry) -> None:
        points, lines = shapely.get_coordinates(shapely.get_parts(fence), return_index=True)
        is_edge = lines[1:] == lines[:-1]
        starts, ends = points[:-1][is_edge], points[1:][is_edge]
        steps = _complex(ends) - _complex(starts)
        self.boxed = BoxedEdges(np.minimum(starts, ends), np.maximum(starts, ends), _complex(starts), steps)
        self._squares: dict[tuple[int, int, int], _Edges] = {}

    @property
    def is_empty(self) -> bool:
        """Whether there is none."""
        return not len(self.boxed.starts)

    def about(self, column: int, row: int, reach_m: int) -> _Edges:
        """Return the edges that may come within reach of a square of `_SQUARE_M`, counted from the place 0, 0."""
        square = (column, row, reach_m)
        if square not in self._squares:
            low = np.multiply((column, row), _SQUARE_M)
            near = self.boxed.within(low, low + _SQUARE_M, reach_m)
            self._squares[square] = _Edges(near.starts, near.steps)
        return self._squares[square]


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
        self._fence = fence
        within_m = self.counts_within_m(vehicle.speed_mps)
        self._near = fence.boxed.within(places.min(axis=0), places.max(axis=0), within_m)

    def counts_within_m(self, top_mps: float) -> float:
        """Return the distance beyond which an edge does not slow a rover that drives at a speed."""
        return self._stops_within_m + max(top_mps / self._gain_per_s, top_mps**2 / self._accel_mps2)

    def speeds_mps(
        self, places: NDArray[np.float64], ways: NDArray[np.float64], top_mps: float
    ) -> NDArray[np.float64]:
        """Return the speed that is allowed at each place in its own direction (sqrt_controller of what is left to the margin); exact up to ``top_mps``, and above no less."""
        reach_m = self.counts_within_m(top_mps) + _SPARE_M
        at_once = max(_MOST_AT_ONCE // max(len(self._near.starts), 1), 1)
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

        It looks only at edges near the place; those of a square are known for all drives that ask for them.
        """
        reach_m = math.ceil(self.counts_within_m(top_mps) + _SPARE_M)
        stops_within_m, gain_per_s, linear_m = self._stops_within_m, self._gain_per_s, self._linear_m
        twice_mps2 = 2 * self._accel_mps2
        about = self._fence.about
        here, ahead_m = (0, 0), about(0, 0, reach_m).ahead_m

        def allowed_mps(place: complex, way: complex) -> float:
            nonlocal here, ahead_m
            there = (int(place.real // _SQUARE_M), int(place.imag // _SQUARE_M))
            if there != here:
                here, ahead_m = there, about(*there, reach_m).ahead_m
            left_m = ahead_m(place, way) - stops_within_m
            if left_m <= 0:
                return 0.0
            if left_m <= linear_m:
                return gain_per_s * left_m
            return math.sqrt(twice_mps2 * (left_m - linear_m / 2))

        return allowed_mps

    def _ahead_m(
        self, places: NDArray[np.float64], ways: NDArray[np.float64], reach_m: float
    ) -> NDArray[np.float64]:
        """Return how far ahead the first edge lies, exact up to a reach and beyond no less; infinite without one."""
        if not len(places):
            return np.zeros(0)
        ends = np.concatenate([places, places + reach_m * ways])
        _, _, starts, steps = self._near.within(ends.min(axis=0), ends.max(axis=0), _SPARE_M)
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
        # As numbers: products of these take half as long as those of complex ones, to the same bits.
        self._numbers = list(map(tuple, np.column_stack((_plane(starts), _plane(steps))).tolist()))

    def ahead_m(self, place: complex, way: complex) -> float:
        """Return how far ahead of one place the first edge lies; infinite without one."""
        edges = self._numbers
        if len(edges) > _FEW:
            back = way.conjugate()
            aside_m = ((self._starts - place) * back).imag
            crossing = aside_m * (aside_m + (self._steps * back).imag) <= _TOUCHING_M2
            edges = [edges[edge] for edge in np.flatnonzero(crossing).tolist()]
        east_m, north_m, east, north = place.real, place.imag, way.real, way.imag
        first_m = math.inf
        for start_east, start_north, step_east, step_north in edges:
            off_east, off_north = start_east - east_m, start_north - north_m
            aside_m = off_north * east - off_east * north
            turned_m = step_north * east - step_east * north
            # Both ends on one side: passed by. An edge along the way is met at its neighbours.
            if aside_m * (aside_m + turned_m) <= _TOUCHING_M2 and turned_m:
                share = -aside_m / turned_m
                if 0 <= share <= 1:
                    away_m = off_east * east + off_north * north
                    away_m += share * (step_east * east + step_north * north)
                    if 0 <= away_m < first_m:
                        first_m = away_m
        return first_m


def _complex(points: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return points, shape (n, 2), as east + j north."""
    return np.ascontiguousarray(points).view(np.complex128)[:, 0]


def _plane(numbers: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return east + j north as points, shape (n, 2)."""
    return np.ascontiguousarray(numbers).view(np.float64).reshape(-1, 2)
