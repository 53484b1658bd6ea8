"""Lines made of several: what of them is kept, and that the result is as good as the best, and measured as any other."""

from __future__ import annotations

import math

from charts import FIELD, HOME, OUT, box, place, situation_of
from hypothesis import given
from hypothesis import strategies as st

from missions.fitting.cost import Gauge
from missions.fitting.local_search import Fitting
from missions.fitting.polyline import DrawnPoint
from missions.fitting.splice import splices
from missions.geo import LocalPoint
from missions.ground.from_situation import ground_for
from missions.vehicle import vehicle_from_parameters

START, GOAL = LocalPoint(0.0, 0.0), LocalPoint(100.0, 0.0)


def lines(*places):
    ends = {0, len(places) + 1}
    return tuple(
        DrawnPoint(LocalPoint(*place), 1.0, 1.0, is_fixed=number in ends)
        for number, place in enumerate((START, *places, GOAL))
    )


def test_the_first_half_of_one_and_the_second_of_the_other():
    bad_then_good = lines((20.0, 9.0), (40.0, -9.0), (60.0, 1.0), (80.0, 2.0))
    good_then_bad = lines((20.0, 1.0), (40.0, 2.0), (60.0, 9.0), (80.0, -9.0))
    wanted = lines((20.0, 1.0), (40.0, 2.0), (60.0, 1.0), (80.0, 2.0))
    assert wanted in list(splices(good_then_bad, bad_then_good))


def test_lines_far_apart_go_different_ways():
    found = list(splices(lines((50.0, 60.0)), lines((50.0, -60.0))))
    assert all((50.0, 60.0) not in [point.place for point in one] for one in found)


inner = st.lists(st.tuples(st.floats(1.0, 99.0), st.floats(-20.0, 20.0)), max_size=6)


@given(first=inner, second=inner)
def test_begins_with_the_one_and_ends_with_the_other(first, second):
    one, other = lines(*first), lines(*second)
    for made in splices(one, other):
        assert made[0] == one[0]
        assert made[-1] == other[-1]
        assert sum(point.is_fixed for point in made) == 2
        assert made not in (one, other)
        cut = next(index for index in range(len(made)) if made[: index + 1] != one[: index + 1])
        assert made[cut:] == other[len(other) - (len(made) - cut) :]


def test_two_lines_that_fail_at_different_places_make_one_that_keeps_enough():
    """Each goes through one of two ponds and well round the other."""
    ponds = (box(OUT, 20, -5, 30, 5), box(OUT, 60, -5, 70, 5))
    situation = situation_of(FIELD, *ponds, WP_SPEED=2.0, FENCE_ENABLE=1.0, FENCE_TYPE=4.0)
    vehicle = vehicle_from_parameters(situation.parameters)
    fitting = Fitting(Gauge(ground_for(situation, vehicle, (HOME, place(80, 80))), vehicle, 90.0))
    first, second = (
        tuple(point.at(LocalPoint(point.place[0] - 5, point.place[1])) for point in one)
        for one in (
            lines((15.0, 9.0), (40.0, 9.0), (52.0, 0.0), (75.0, 0.0)),
            lines((15.0, 0.0), (40.0, 0.0), (52.0, 9.0), (82.0, 9.0)),
        )
    )
    alone = [fitting.measure(one) for one in (first, second)]
    made, measured = fitting.combine({first: False, second: False})
    assert not any(one.is_enough for one in alone)
    assert measured.is_enough
    assert measured.cost_s < min(one.cost_s for one in alone)
    for end in (0, -1):  # as rounded into the mission
        assert math.dist(made[end].place, first[end].place) < 0.01
    assert fitting.combine({made: True}) == (made, fitting.measure(made))
