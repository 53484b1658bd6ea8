"""Lines made of several: what of them is kept, and that the result is as good as the best, and measured as any other."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from missions.fitting.polyline import DrawnPoint
from missions.fitting.splice import splices
from missions.geo import LocalPoint

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
