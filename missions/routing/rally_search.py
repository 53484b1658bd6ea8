"""Which few of many places to choose so that, wherever one stands, the nearest of them can be seen.

It is no set cover: the autopilot does not take a place that sees it, but the nearest, so a place more may spoil what others did. One and two places
are tried exhaustively; more are exchanged one by one as long as fewer metres are left, from several beginnings.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

_BEGINNINGS, _LAST_BEGINNINGS = 8, 40
"""Sets from which exchanges begin, for each number of places, and for the greatest. Chosen: a set that is found late is better than none."""
_MOST_ROUNDS = 12  # of exchanges from one beginning; chosen, they mostly end after three
_WHOLE_M = 1e-9  # of pieces left


@dataclass(frozen=True, eq=False)
class Candidates:
    """Places to choose from, and what each sees of a route.

    Parameters
    ----------
    away_m : (c, n) array
        How far each place is from the middle of each piece of the route.
    sees : (c, n) array of bool
        Whether the lines from all of a piece to a place are free.
    within_m : (n,) array
        Places whose distances differ by no more may each be the nearest from some point of the piece.
    lengths_m : (n,) array
        How long the pieces are.
    """

    away_m: NDArray[np.float64]
    sees: NDArray[np.bool_]
    within_m: NDArray[np.float64]
    lengths_m: NDArray[np.float64]

    def left_m(self, chosen: list[int]) -> float:
        """Return from how much of the route the line to a nearest place is not free."""
        return float(self.lengths_m[self.spoilt(chosen)].sum())

    def spoilt(self, chosen: list[int]) -> NDArray[np.bool_]:
        """Return which pieces have a line that is not free to a place that may be the nearest."""
        away_m = self.away_m[chosen]
        near = away_m <= away_m.min(axis=0) + self.within_m
        return np.asarray((near & ~self.sees[chosen]).any(axis=0))

    def with_each(self, others: list[int]) -> NDArray[np.float64]:
        """Return what `left_m` is with each place in addition to others."""
        if not others:
            return np.asarray((~self.sees) @ self.lengths_m)
        away_m = self.away_m[others]
        least_m = away_m.min(axis=0)
        nearest_m = np.minimum(self.away_m, least_m)
        spoilt = ~self.sees & (self.away_m <= nearest_m + self.within_m)
        for one in others:  # another place takes away from what is nearest
            blind = ~self.sees[one]
            if blind.any():
                spoilt[:, blind] |= self.away_m[one][blind] <= nearest_m[:, blind] + self.within_m[blind]
        return np.asarray(spoilt @ self.lengths_m)

    @cached_property
    def count(self) -> int:
        """How many places there are."""
        return len(self.away_m)


def fewest(
    candidates: Candidates,
    most: int,
    should_stop: Callable[[], bool] | None = None,
    before: Sequence[int] = (),
) -> tuple[list[int], float]:
    """Return the fewest places found with which nothing of the route is left, else those with which least is, and how many metres.

    Parameters
    ----------
    candidates : Candidates
        To choose from.
    most : int
        How many may be chosen.
    should_stop : callable, optional
        Asked now and then; True ends the search with what was found.
    before : sequence of int
        Places that were found before: only as many and more are looked for.
    """
    best: tuple[list[int], float] = (list(before), float(candidates.lengths_m.sum()))
    if not candidates.count:
        return best
    for count in range(max(1, len(before)), most + 1):
        beginnings = _LAST_BEGINNINGS if count == most else _BEGINNINGS
        if count == 2:
            chosen, left_m = _pair(candidates)
        else:
            chosen, left_m = _exchanged(candidates, best[0], count, beginnings, should_stop)
        if left_m < best[1] or not best[0]:
            best = (chosen, left_m)
        if best[1] <= _WHOLE_M or (should_stop is not None and should_stop()):
            break
    return best


def _pair(candidates: Candidates) -> tuple[list[int], float]:
    """Return the best two places."""
    left_m = [candidates.with_each([one]) for one in range(candidates.count)]
    one, other = divmod(int(np.argmin(left_m)), candidates.count)
    return [one, other], float(left_m[one][other])


def _exchanged(
    candidates: Candidates,
    before: list[int],
    count: int,
    beginnings: int,
    should_stop: Callable[[], bool] | None,
) -> tuple[list[int], float]:
    """Return the best so many places that exchanges lead to."""
    chance = np.random.default_rng(count)
    best: tuple[list[int], float] = ([], float("inf"))
    for beginning in range(beginnings if count > 1 else 1):
        chosen = list(before) if beginning == 0 else []
        while len(chosen) < count:
            left_m = candidates.with_each(chosen)
            few = np.argsort(left_m, kind="stable")[: 1 if beginning == 0 else 10]
            chosen.append(int(few[chance.integers(len(few))]))
        found = _improved(candidates, chosen)
        if found[1] < best[1]:
            best = found
        if best[1] <= _WHOLE_M or (should_stop is not None and should_stop()):
            break
    return best


def _improved(candidates: Candidates, chosen: list[int]) -> tuple[list[int], float]:
    """Exchange single places as long as less is left."""
    least_m = candidates.left_m(chosen)
    for _ in range(_MOST_ROUNDS):
        before_m = least_m
        for place in range(len(chosen)):
            if least_m <= _WHOLE_M:
                return chosen, least_m
            others = chosen[:place] + chosen[place + 1 :]
            left_m = candidates.with_each(others)
            best = int(np.argmin(left_m))
            if left_m[best] < least_m - _WHOLE_M:
                chosen, least_m = [*others, best], float(left_m[best])
        if least_m >= before_m - _WHOLE_M:
            break
    return chosen, least_m
