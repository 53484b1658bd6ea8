"""Measuring lines step by step: each step only adds, the order of them loses nothing, and what was measured is known."""

from __future__ import annotations

import gc
import itertools
import math
import sys
import weakref
from dataclasses import replace

import numpy as np
import pytest
import shapely
from charts import FIELD, HOME, OUT, WALL, box, place, situation_of
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.drive_model import envelope
from missions.fence import Fence
from missions.fitting import cost, moves
from missions.fitting import local_search as fitting
from missions.fitting.cost import ENOUGH_M, Gauge
from missions.fitting.polyline import Drawing, DrawnPoint
from missions.geo import LocalPoint
from missions.ground.frame import frame_around
from missions.ground.from_situation import ground_for
from missions.ground.ground import lay_out
from missions.vehicle import vehicle_from_parameters

STEERED = {"WP_SPEED": 5.0, "WP_RADIUS": 3.0, "FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "AVOID_ENABLE": 3.0}
AVOIDING = {**STEERED, "FENCE_MARGIN": 1.0}
POND = box(OUT, 30, -70, 60, 20)


def gauge_of(*zones, heading_deg: float | None = 0.0, **parameters: float) -> Gauge:
    situation = situation_of(*zones, **parameters)
    vehicle = vehicle_from_parameters(situation.parameters)
    return Gauge(ground_for(situation, vehicle, (HOME, place(80, 80))), vehicle, heading_deg)


def lines(*places: tuple[float, float], required_m: float = 2.0) -> Drawing:
    points = [DrawnPoint(LocalPoint(*place), required_m, required_m) for place in places]
    return tuple(point._replace(is_fixed=at in (0, len(points) - 1)) for at, point in enumerate(points))


ways = st.lists(
    st.tuples(st.floats(-90.0, 90.0), st.floats(-90.0, 90.0)), min_size=2, max_size=7, unique=True
).filter(lambda places: all(math.dist(a, b) > 1.0 for a, b in itertools.pairwise(places)))


@settings(max_examples=60)
@given(places=ways, begin=st.integers(0, 2), cut=st.integers(0, 2))
def test_each_step_only_adds(places: list[tuple[float, float]], begin: int, cut: int) -> None:
    drawing = lines(*places)
    begin, end = min(begin, len(places) - 2), max(len(places) - cut, min(begin, len(places) - 2) + 2)
    trial = gauge_of(FIELD, WALL, POND, **AVOIDING).trial(drawing, begin, end)
    goes_on = True
    while goes_on:
        cost_s, missing_m, may_be = trial.cost_s, trial.missing_m, trial.may_be_enough
        goes_on = trial.refine()
        assert trial.cost_s >= cost_s
        assert (trial.missing_m >= missing_m).all()
        assert may_be or not trial.may_be_enough
    assert trial.is_finished
    assert not trial.refine()
    assert len(trial.missing_m) == end - begin
    assert not (begin and trial.missing_m[0])
    assert not (end < len(drawing) and trial.missing_m[-1])


@settings(max_examples=40)
@given(places=ways)
def test_what_is_missing_is_what_the_band_lacks(places: list[tuple[float, float]]) -> None:
    gauge = gauge_of(FIELD, WALL, **STEERED, FENCE_MARGIN=0.0)
    fence = replace(gauge.vehicle.fence, avoid_bits=0)
    gauge = Gauge(gauge.ground, replace(gauge.vehicle, fence=fence), 0.0)
    measured = gauge.measure(lines(*places))
    band = envelope(places, gauge.vehicle, heading_deg=0.0)
    kept_m = [shapely.distance(core, gauge.ground.edge) for core in band.cores] - band.bands_m
    for number, missing_m in enumerate(measured.missing_m):
        least_m = kept_m[band.waypoints == number].min(initial=np.inf)
        assert missing_m >= max(2.0 - least_m, 0.0) - 1e-9
        if missing_m > ENOUGH_M and least_m < 2.0:
            assert not math.isnan(measured.worst[number][0])
    assert measured.is_enough == (max(measured.missing_m) <= ENOUGH_M)
    assert measured.missing_m[measured.worst_index] == max(measured.missing_m)
    assert measured.cost_s >= band.duration_s + 100 * sum(measured.missing_m)


def test_what_was_measured_is_known() -> None:
    gauge = gauge_of(FIELD, WALL, **AVOIDING)
    drawing = lines((-50, 0), (-20, 70), (20, 70), (80, 0))
    assert gauge.trial(drawing, 0, 3) is gauge.trial(drawing, 0, 3)
    assert gauge.trial(drawing, 0, 3) is not gauge.trial(drawing[:3], 0, 3)
    assert gauge.measure(drawing) is gauge.measure(drawing)


def test_lines_through_a_wall_are_dear_at_the_first_look() -> None:
    gauge = gauge_of(FIELD, WALL, **AVOIDING)
    through = gauge.trial(lines((-50, 0), (50, 0)), 0, 2)
    assert through.cost_s > 10_000.0
    assert not through.may_be_enough


def test_without_a_fence_nothing_is_missing() -> None:
    vehicle = vehicle_from_parameters(AVOIDING)
    open_ground = lay_out(Fence(()), frame_around([HOME]), around=[HOME])
    gauge = Gauge(open_ground, vehicle, None)
    measured = gauge.measure(lines((-50, 0), (50, 0), (50, 50)))
    assert measured.missing_m == (0.0, 0.0, 0.0)
    assert all(math.isnan(east_m) for east_m, _ in measured.worst)


@settings(max_examples=30)
@given(
    moves=st.lists(
        st.tuples(st.floats(-25.0, 25.0), st.floats(-25.0, 25.0)), min_size=1, max_size=12, unique=True
    )
)
def test_the_best_first_are_those_that_measuring_all_gives(moves: list[tuple[float, float]]) -> None:
    gauge = gauge_of(FIELD, WALL, POND, **AVOIDING)
    drawing = lines((-50, 0), (-7, 62), (7, 62), (20, 0))
    known_s = gauge.measure(drawing).cost_s
    moved = [lines((-50, 0), (-7 + east_m, 62 + north_m), (7, 62), (20, 0)) for east_m, north_m in moves]
    tried = [fitting._Tried(known_s, number, gauge.trial(one, 0, 4), one) for number, one in enumerate(moved)]
    found = [one.number for one in fitting._best_first(tried)]
    fresh = gauge_of(FIELD, WALL, POND, **AVOIDING)
    gains_s = [known_s - fresh.measure(one).cost_s for one in moved]
    gaining = [number for number, gain_s in enumerate(gains_s) if gain_s > fitting._LEAST_GAIN_S]
    assert found == sorted(gaining, key=lambda number: -gains_s[number])


@pytest.mark.parametrize(
    ("east_m", "missing_m", "is_good"), [(12.0, 0.0, True), (5.5, 0.0, False), (5.5, 10.0, True)]
)
def test_good_is_told_without_more_steps_than_it_takes(
    east_m: float, missing_m: float, *, is_good: bool
) -> None:
    gauge = gauge_of(FIELD, box(OUT, -5, -80, 3, 60), **AVOIDING, heading_deg=180.0)
    drawing = lines((east_m, 40), (east_m, -40), required_m=3.0)
    tried = fitting._Tried(1e6, 0, gauge.trial(drawing, 0, 2), drawing)
    assert tried.misses_at_most(missing_m) is is_good
    assert tried.trial.is_finished is is_good


def test_candidates_come_in_the_same_order_however_far_each_was_measured_before() -> None:
    """So those after the first that suffices need not be measured until ranking them takes it."""
    drawing = lines((-50, 0), (-20, 70), (20, 70), (80, 0))
    candidates = [*moves.moved(drawing, 1, 3.0), *moves.moved(drawing, 2, 3.0), *moves.without(drawing, 1)]
    orders = []
    for steps in (0, 1, 2, 9):
        gauge = gauge_of(FIELD, WALL, POND, **AVOIDING)
        known_s = gauge.trial(drawing, 0, 4).finish().cost_s + 3.0
        trials = [gauge.trial(one, 0, len(one)) for one in candidates]
        for trial in trials:
            for _ in range(steps):
                trial.refine()
        tried = [
            fitting._Tried(known_s, number, trial, one)
            for number, (trial, one) in enumerate(zip(trials, candidates, strict=True))
        ]
        orders.append([(one.number, one.gain_s) for one in fitting._best_first(tried)])
    assert len(orders[0]) > 3
    assert all(order == orders[0] for order in orders)


def test_lines_fitted_after_others_by_the_same_gauge_are_those_of_a_fresh_one() -> None:
    first, second = (
        lines((-50, 0), (-20, north_m), (20, north_m), (80, 0), required_m=required_m)
        for north_m, required_m in ((64, 2.0), (63, 2.5))
    )
    gauge = gauge_of(FIELD, WALL, **AVOIDING)
    after = [fitting.Fitting(gauge).fit(one) for one in (first, second, first)]
    fresh = [fitting.Fitting(gauge_of(FIELD, WALL, **AVOIDING)).fit(one) for one in (first, second)]
    assert after == [*fresh, fresh[0]]


def test_a_gauge_that_forgets_fits_the_same_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    drawing = lines((-50, 0), (-20, 64), (20, 64), (80, 0))
    known = fitting.Fitting(gauge_of(FIELD, WALL, **AVOIDING)).fit(drawing)
    monkeypatch.setattr(cost, "MOST_KNOWN", 20)
    forgetful = gauge_of(FIELD, WALL, **AVOIDING)
    assert fitting.Fitting(forgetful).fit(drawing) == known
    assert len(forgetful._trials) <= 20


def test_what_is_forgotten_is_freed_at_once() -> None:
    """Plans are made without garbage collection: measured lines must be no cycle."""
    gauge = gauge_of(FIELD, WALL, **AVOIDING)
    drawing = lines((-50, 0), (-20, 70), (20, 70), (80, 0))
    gc.disable()
    try:
        for steps in (0, 2, 9):
            trial = gauge.trial(drawing, 0, 4)
            for _ in range(steps):
                trial.refine()
            drive = weakref.ref(trial._drive) if steps else None
            gauge._trials.clear()
            count = sys.getrefcount(trial)
            del trial
            assert count == 2
            assert drive is None or drive() is None
    finally:
        gc.enable()


def test_what_was_measured_goes_with_the_gauge() -> None:
    """A plan keeps tens of thousands of objects that no garbage collection is to look through: they may hold one another in no circle."""
    gauge = gauge_of(FIELD, WALL, POND, **AVOIDING)
    gauge.measure(lines((0, 0), (30, 0), (30, 30)))
    left = weakref.ref(gauge)
    gc.disable()
    try:
        del gauge
        assert left() is None
    finally:
        gc.enable()
