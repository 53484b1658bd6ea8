"""The shortest order of visits: exact by dynamic programming up to 12 places, beyond that an integer program for HiGHS.

Up to 12 places: Held and Karp, "A dynamic programming approach to sequencing problems", 1962. More: the integer program of Dantzig,
Fulkerson and Johnson, "Solution of a large-scale traveling-salesman problem", 1954, which HiGHS solves while the cuts that forbid
subtours are added as they are needed. HiGHS (highspy, MIT licence) is kept by the University of Edinburgh and needs nothing but
numpy; being exact it also bounds how far an answer may be from the best where it is stopped early.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from missions.errors import SituationError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

MOST_BY_PROGRAMMING = 12
"""Places that are ordered without HiGHS."""

# Silent, the same answer each time, and a proof; 30 s for each round of cuts is chosen, not measured.
_OPTIONS = (("output_flag", False), ("threads", 1), ("mip_rel_gap", 0.0), ("time_limit", 30.0))
_ROUNDS = 60  # of adding cuts; chosen, not measured. When they are used up the answer stands with the bound that was reached
_FEASIBLE = 2
"""kSolutionStatusFeasible of HiGHS."""


@dataclass(frozen=True, slots=True)
class VisitOrder:
    """In which order places are visited.

    Parameters
    ----------
    order : tuple of int
        Rows of the distances, the start (0) first.
    length_m : float
        How far it is.
    bound_m : float
        No order is shorter than this; equal to the length where the order is proved to be the shortest.
    """

    order: tuple[int, ...]
    length_m: float
    bound_m: float


def shortest_order(
    distances_m: NDArray[np.float64],
    *,
    ends_at_last: bool = False,
    should_stop: Callable[[], bool] | None = None,
) -> VisitOrder:
    """Find the shortest way from the first place over all others.

    Parameters
    ----------
    distances_m : ndarray of float, shape (n, n)
        From place to place, symmetric and finite; at least two places.
    ends_at_last : bool
        Whether it has to end at the last place; else it ends wherever that is shortest.
    should_stop : callable, optional
        Asked now and then; True ends the search with the best order so far.

    Raises
    ------
    SituationError
        More than 12 places to order, and HiGHS is not installed.
    """
    free = len(distances_m) - 1 - ends_at_last
    if free <= 1:
        order = tuple(range(len(distances_m)))
        return VisitOrder(order, *[length_of(distances_m, order)] * 2)
    if free <= MOST_BY_PROGRAMMING:
        order = _by_programming(distances_m, ends_at_last=ends_at_last)
        return VisitOrder(order, *[length_of(distances_m, order)] * 2)
    if find_spec("highspy") is None:
        raise SituationError(
            f"ordering more than {MOST_BY_PROGRAMMING} targets needs HiGHS ({free} given): pip install 'pbpp-rover[tour]'",
            targets=free,
        )
    return _by_cuts(distances_m, ends_at_last=ends_at_last, should_stop=should_stop)


def length_of(distances_m: NDArray[np.float64], order: Sequence[int]) -> float:
    """Return the length of an order in metres."""
    return float(sum(distances_m[a, b] for a, b in pairwise(order)))


def _by_programming(distances_m: NDArray[np.float64], *, ends_at_last: bool) -> tuple[int, ...]:
    """Return the shortest order: for every set of places and every last one of them, the shortest way there."""
    count = len(distances_m) - 1 - ends_at_last
    between_m = distances_m[1 : count + 1, 1 : count + 1]
    shortest_m = np.full((1 << count, count), np.inf)
    before = np.zeros((1 << count, count), dtype=np.int64)
    for place in range(count):
        shortest_m[1 << place, place] = distances_m[0, place + 1]
    for visited in range(1, 1 << count):
        ways_m = shortest_m[visited][:, None] + between_m
        best, best_m = ways_m.argmin(axis=0), ways_m.min(axis=0)
        for place in range(count):
            after = visited | 1 << place
            if after != visited and best_m[place] < shortest_m[after, place]:
                shortest_m[after, place] = best_m[place]
                before[after, place] = best[place]
    visited = (1 << count) - 1
    ends_m = shortest_m[visited] + (distances_m[1 : count + 1, -1] if ends_at_last else 0.0)
    place = int(ends_m.argmin())
    order = [place + 1]
    while visited != 1 << place:
        visited, place = visited & ~(1 << place), int(before[visited, place])
        order.append(place + 1)
    return (0, *reversed(order), *([count + 1] if ends_at_last else []))


def _by_cuts(
    distances_m: NDArray[np.float64], *, ends_at_last: bool, should_stop: Callable[[], bool] | None
) -> VisitOrder:
    """Return the shortest round trip in which the start follows the end: directly, or over a place that is near to all."""
    places = len(distances_m)
    round_m = distances_m
    closing = places - 1
    if not ends_at_last:
        round_m = np.zeros((places + 1, places + 1))
        round_m[:places, :places] = distances_m
        closing = places
    trip = _RoundTripProgram(round_m, closing)
    trip.relax(should_stop)
    successors, bound_m = trip.solve(should_stop)
    order = tuple(place for place in successors if place < places)
    length_m = length_of(distances_m, order)
    closing_m = float(round_m[0, closing])  # the trip's way back from its end, which is no part of the order
    return VisitOrder(order, length_m, min(length_m, bound_m - closing_m))


class _RoundTripProgram:
    """An integer program: which pairs of places follow one another on the shortest round trip.

    Parameters
    ----------
    distances_m : ndarray of float, shape (n, n)
        From place to place.
    closing : int
        The place that the start (0) follows.
    """

    def __init__(self, distances_m: NDArray[np.float64], closing: int) -> None:
        highspy: Any = import_module("highspy")  # an extra

        self.distances_m = distances_m
        self.count = len(distances_m)
        self.closing = closing
        self.pairs = list(combinations(range(self.count), 2))
        self.costs_m = np.array([distances_m[pair] for pair in self.pairs])
        self.integer = highspy.HighsVarType.kInteger
        self.solver: Any = highspy.Highs()
        for option, value in _OPTIONS:
            self.solver.setOptionValue(option, value)
        size = len(self.pairs)
        lower = np.array([float(pair == (0, closing)) for pair in self.pairs])
        self.solver.addVars(size, lower, np.ones(size))
        self.solver.changeColsCost(size, np.arange(size, dtype=np.int32), self.costs_m)
        for place in range(self.count):
            self._add_row(2.0, 2.0, [i for i, pair in enumerate(self.pairs) if place in pair])

    def relax(self, should_stop: Callable[[], bool] | None) -> None:
        """Add the cuts that the linear relaxation asks for: cheap to find, and most of those that are needed."""
        for _ in range(_ROUNDS):
            self.solver.run()
            parts = self._parts(np.asarray(self.solver.getSolution().col_value) > 1e-6)
            if len(parts) == 1 or (should_stop is not None and should_stop()):
                break
            self._forbid(parts)
        size = len(self.pairs)
        self.solver.changeColsIntegrality(
            size, np.arange(size, dtype=np.int32), np.full(size, int(self.integer), dtype=np.uint8)
        )

    def solve(self, should_stop: Callable[[], bool] | None) -> tuple[list[int], float]:
        """Return the round trip from 0 to `closing`, and a lower bound on its length."""
        bound_m = 0.0
        for _ in range(_ROUNDS):
            self.solver.run()
            info = self.solver.getInfo()
            bound_m = max(bound_m, float(info.mip_dual_bound))
            if info.primal_solution_status != _FEASIBLE:  # stopped before any was found
                return self._completed([0, self.closing]), bound_m
            chosen = np.asarray(self.solver.getSolution().col_value) > 0.5
            parts = self._parts(chosen)
            if len(parts) == 1 or (should_stop is not None and should_stop()):
                break
            self._forbid(parts)
        return self._completed(self._trip(chosen)), bound_m

    def _parts(self, chosen: NDArray[np.bool_]) -> list[set[int]]:
        """Return the places that the chosen pairs join, part by part."""
        part_of = {place: {place} for place in range(self.count)}
        for index in np.flatnonzero(chosen):
            a, b = (part_of[place] for place in self.pairs[index])
            if a is not b:
                a |= b
                part_of.update(dict.fromkeys(b, a))
        return list({id(part): part for part in part_of.values()}.values())

    def _forbid(self, parts: list[set[int]]) -> None:
        """Forbid round trips within each part."""
        for part in parts:
            inner = [i for i, (a, b) in enumerate(self.pairs) if a in part and b in part]
            self._add_row(-math.inf, len(part) - 1.0, inner)

    def _trip(self, chosen: NDArray[np.bool_]) -> list[int]:
        """Return the places from 0 to `closing` along the chosen pairs, which may leave others out."""
        neighbours: dict[int, list[int]] = {place: [] for place in range(self.count)}
        for index in np.flatnonzero(chosen):
            a, b = self.pairs[index]
            neighbours[a].append(b)
            neighbours[b].append(a)
        trip = [self.closing, 0]
        while trip[-1] != self.closing or len(trip) == 1:
            a, b = neighbours[trip[-1]]
            trip.append(b if a == trip[-2] else a)
        return trip[1:]

    def _completed(self, trip: list[int]) -> list[int]:
        """Put the places that a trip leaves out where they lengthen it least."""
        for place in sorted(set(range(self.count)) - set(trip)):
            longer_m = [
                self.distances_m[a, place] + self.distances_m[place, b] - self.distances_m[a, b]
                for a, b in pairwise(trip)
            ]
            trip.insert(int(np.argmin(longer_m)) + 1, place)
        return trip

    def _add_row(self, least: float, most: float, columns: list[int]) -> None:
        indices = np.array(columns, dtype=np.int32)
        self.solver.addRow(least, most, len(indices), indices, np.ones(len(indices)))
