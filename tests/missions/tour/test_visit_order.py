"""Orders of visits, against every permutation and against another way of finding them."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.errors import SituationError
from missions.tour import visit_order
from missions.tour.visit_order import MOST_BY_PROGRAMMING, length_of, shortest_order

seeds = st.integers(0, 2**32 - 1)


def distances(count: int, seed: int) -> np.ndarray:
    """Distances of random places on a coarse grid, so that many orders are equally long."""
    generator = np.random.default_rng(seed)
    places = generator.integers(0, 12, (count, 2)).astype(float)
    return np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))


def shortest_by_trying(distances_m: np.ndarray, *, ends_at_last: bool) -> float:
    last = len(distances_m) - 1
    middle = range(1, last if ends_at_last else last + 1)
    tails = (last,) if ends_at_last else ()
    return min(length_of(distances_m, (0, *order, *tails)) for order in permutations(middle))


@settings(max_examples=60)
@given(st.integers(2, 7), seeds, st.booleans())
def test_the_order_is_the_shortest_of_all(count, seed, ends_at_last):
    distances_m = distances(count, seed)
    found = shortest_order(distances_m, ends_at_last=ends_at_last)
    assert sorted(found.order) == list(range(count))
    assert found.order[0] == 0
    assert not ends_at_last or found.order[-1] == count - 1
    assert found.length_m == pytest.approx(shortest_by_trying(distances_m, ends_at_last=ends_at_last))
    assert found.length_m == pytest.approx(length_of(distances_m, found.order))
    assert found.bound_m == found.length_m


def test_distances_need_not_be_those_of_a_plane():
    # Behind a long wall the neighbour is the farthest away.
    distances_m = np.array([[0, 1, 9, 2], [1, 0, 1, 9], [9, 1, 0, 5], [2, 9, 5, 0]], dtype=float)
    assert shortest_order(distances_m).order == (0, 1, 2, 3)
    assert shortest_order(distances_m, ends_at_last=True).length_m == 7


def test_twelve_targets_are_exact():
    # Places round a circle: the shortest way goes round it.
    around = np.random.default_rng(5).permutation(12)
    angles_rad = np.concatenate(([0], (around + 1) / 13 * 2 * np.pi))
    places = np.column_stack((np.cos(angles_rad), np.sin(angles_rad))) * 100
    distances_m = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    found = shortest_order(distances_m)
    assert found.length_m == pytest.approx(12 * 200 * np.sin(np.pi / 13))
    order = [int(around[place - 1]) for place in found.order[1:]]
    assert order in (list(range(12)), list(range(11, -1, -1)))


def test_more_than_twelve_need_highs(monkeypatch):
    monkeypatch.setattr(visit_order, "find_spec", lambda name: None)
    with pytest.raises(SituationError, match=r"needs HiGHS \(13 given\).*pbpp-rover\[tour\]"):
        shortest_order(distances(MOST_BY_PROGRAMMING + 2, 1))
    assert shortest_order(distances(MOST_BY_PROGRAMMING + 2, 1), ends_at_last=True).length_m > 0


class TestManyTargets:
    @pytest.fixture(autouse=True)
    def _highs(self):
        pytest.importorskip("highspy")

    @settings(max_examples=25)
    @given(st.integers(4, 9), seeds, st.booleans())
    def test_the_integer_program_agrees_with_dynamic_programming(self, count, seed, ends_at_last):
        distances_m = distances(count, seed)
        by_cuts = visit_order._by_cuts(distances_m, ends_at_last=ends_at_last, should_stop=None)
        by_programming = shortest_order(distances_m, ends_at_last=ends_at_last)
        assert by_cuts.length_m == pytest.approx(by_programming.length_m)
        assert by_cuts.bound_m == pytest.approx(by_programming.length_m, abs=1e-5)
        assert sorted(by_cuts.order) == list(range(count))

    def test_thirty_places_round_a_circle(self):
        around = np.random.default_rng(7).permutation(30)
        angles_rad = np.concatenate(([0], (around + 1) / 31 * 2 * np.pi))
        places = np.column_stack((np.cos(angles_rad), np.sin(angles_rad))) * 100
        distances_m = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        found = shortest_order(distances_m)
        assert found.length_m == pytest.approx(30 * 200 * np.sin(np.pi / 31))
        assert found.bound_m == pytest.approx(found.length_m, rel=1e-6)

    def test_far_groups_are_visited_one_after_another(self):
        # Five heaps far from one another: no shortest order comes back to a heap it has left.
        generator = np.random.default_rng(3)
        heaps = np.repeat(np.arange(5), 4)
        centres = np.column_stack((np.arange(5) * 1000.0, np.zeros(5)))
        places = np.concatenate(([[-1000.0, 0.0]], centres[heaps] + generator.uniform(0, 20, (20, 2))))
        mixed = np.concatenate(([0], generator.permutation(20) + 1))
        places = places[mixed]
        distances_m = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        found = shortest_order(distances_m)
        visited = [round(places[place][0] / 1000) for place in found.order[1:]]
        assert visited == sorted(visited)

    @pytest.mark.parametrize("ends_at_last", [False, True])
    def test_stopped_early_it_still_gives_an_order_and_a_bound(self, ends_at_last):
        distances_m = distances(40, 11)
        found = shortest_order(distances_m, ends_at_last=ends_at_last, should_stop=lambda: True)
        best = shortest_order(distances_m, ends_at_last=ends_at_last)
        assert sorted(found.order) == list(range(40))
        assert found.order[0] == 0
        assert not ends_at_last or found.order[-1] == 39
        assert found.bound_m <= best.length_m + 1e-6 <= found.length_m + 2e-6

    def test_without_any_solution_places_are_put_in_one_by_one(self, monkeypatch):
        monkeypatch.setattr(visit_order, "_OPTIONS", (("output_flag", False), ("time_limit", 0.0)))
        found = shortest_order(distances(20, 2))
        assert sorted(found.order) == list(range(20))
        assert found.bound_m <= found.length_m
