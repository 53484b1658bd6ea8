"""Moves at a corner: what they change, and what they leave alone."""

from __future__ import annotations

import math

import pytest

from missions.fitting import moves
from missions.fitting import polyline as drawn
from missions.fitting.polyline import Drawing, DrawnPoint
from missions.geo import LocalPoint

MOST_TURN_AT_A_CHANGE_DEG = 8.0


def lines(*places: tuple[float, float], fixed: tuple[int, ...] = ()) -> Drawing:
    ends = {0, len(places) - 1, *fixed}
    return tuple(
        DrawnPoint(LocalPoint(*place), 2.0, 2.0, is_fixed=number in ends)
        for number, place in enumerate(places)
    )


RIGHT_ANGLE = lines((0, 0), (0, 60), (60, 60))
TWO_CORNERS = lines((0, 0), (0, 40), (6, 46), (60, 46))


def changes(drawing: Drawing) -> list[int]:
    """Return the points at which another speed is asked for."""
    speeds = drawn.speeds(drawing)
    return [number for number in range(1, len(speeds)) if speeds[number] != speeds[number - 1]]


def slow_span_m(drawing: Drawing) -> tuple[float, float]:
    """Return from where to where along the lines they are slow."""
    along = drawn.distances_m(drawing)
    slow = [number for number, point in enumerate(drawing) if point.speed_mps is not None]
    return along[slow[0] - 1], along[slow[-1]]


@pytest.mark.parametrize(
    ("drawing", "index", "place", "at_m"),
    [
        (RIGHT_ANGLE, 1, (0.0, 60.0), 60.0),
        (RIGHT_ANGLE, 1, (0.0, 57.0), 57.0),
        (RIGHT_ANGLE, 2, (8.0, 60.0), 68.0),
        (TWO_CORNERS, 2, (3.0, 43.0), 44.2),
    ],
)
def test_a_slow_stretch_holds_the_place_and_begins_and_ends_on_a_straight_line(
    drawing: Drawing, index: int, place: tuple[float, float], at_m: float
) -> None:
    found = list(moves.slowed(drawing, index, place, 5.0))
    assert {point.speed_mps for one in found for point in one} == {None, 3.0, 2.0, 1.0}
    for one in found:
        begin_m, end_m = slow_span_m(one)
        assert begin_m < at_m < end_m
        for number in changes(one):
            assert abs(drawn.turn_deg(one, number)) <= MOST_TURN_AT_A_CHANGE_DEG
        assert drawn.distances_m(one)[-1] == pytest.approx(drawn.distances_m(drawing)[-1])


def test_nothing_is_slower_than_slow() -> None:
    assert not list(moves.slowed(RIGHT_ANGLE, 1, (0.0, 60.0), 1.0))
    assert moves.crawling(RIGHT_ANGLE, [(0.0, 60.0)], 1.0) == RIGHT_ANGLE


def test_crawling_takes_a_good_way_about_each_spot() -> None:
    slow = moves.crawling(RIGHT_ANGLE, [(0.0, 60.0), (40.0, 60.0)], 5.0)
    begin_m, end_m = slow_span_m(slow)
    assert begin_m <= 60.0 - 18.0
    assert end_m >= 100.0 + 17.0
    assert all(abs(drawn.turn_deg(slow, number)) <= MOST_TURN_AT_A_CHANGE_DEG for number in changes(slow))


def test_a_slow_stretch_is_shortened_along_its_line() -> None:
    slow = next(moves.slowed(RIGHT_ANGLE, 1, (0.0, 30.0), 5.0))
    number = changes(slow)[0]
    eased = list(moves.eased(slow, number, 2.0))
    norths_m = sorted(one[number].place.north_m for one in eased)
    assert norths_m == pytest.approx([slow[number].place.north_m - 2.0, slow[number].place.north_m + 2.0])
    assert all(one[number].place.east_m == pytest.approx(0.0) for one in eased)


def test_a_corner_is_eased_inwards_and_along() -> None:
    eased = list(moves.eased(RIGHT_ANGLE, 1, 1.0))
    assert len(eased) == 3
    assert eased[0][1].place == pytest.approx((math.sqrt(0.5), 60 - math.sqrt(0.5)))


FIXED = lines((0, 0), (0, 60), (60, 60), fixed=(1,))


@pytest.mark.parametrize(
    "move",
    [
        lambda drawing: moves.moved(drawing, 1, 1.0),
        lambda drawing: moves.eased(drawing, 1, 1.0),
        lambda drawing: moves.together(drawing, 1, 1.0),
        lambda drawing: moves.prolonged(drawing, 1),
        lambda drawing: moves.without(drawing, 1),
        lambda drawing: moves.merged(drawing, 1),
        lambda drawing: moves.split(drawing, 1),
    ],
)
def test_a_target_stays_where_it_is(move) -> None:
    assert not list(move(FIXED))


@pytest.mark.parametrize("index", [0, 2])
def test_ends_stay(index: int) -> None:
    for found in (
        moves.moved(RIGHT_ANGLE, index, 1.0),
        moves.stopped(RIGHT_ANGLE, index),
        moves.split(RIGHT_ANGLE, index),
    ):
        assert not list(found)
    for one in moves.approached(RIGHT_ANGLE, index):
        assert (one[0], one[-1]) == (RIGHT_ANGLE[0], RIGHT_ANGLE[-1])


def test_a_corner_is_moved_outwards_first() -> None:
    first = next(moves.moved(RIGHT_ANGLE, 1, 1.0))
    assert first[1].place.east_m < 0
    assert first[1].place.north_m > 60
    straight = lines((0, 0), (0, 30), (0, 60))
    assert next(moves.moved(straight, 1, 1.0))[1].place.east_m != 0


def test_two_corners_become_one_where_their_legs_meet() -> None:
    merged = next(moves.merged(TWO_CORNERS, 1))
    assert [point.place for point in merged] == [(0, 0), pytest.approx((0, 46)), (60, 46)]


def test_a_hairpin_is_split_into_three_and_round_its_end() -> None:
    hairpin = lines((0, 0), (0, 60), (1, 0))
    counts = {len(one) for one in moves.split(hairpin, 1)}
    assert counts == {4, 5}


def test_a_stop_is_asked_for_at_the_corner_alone() -> None:
    (stopped,) = moves.stopped(RIGHT_ANGLE, 1)
    assert drawn.stops(stopped) == {1: moves.STOP_S}


def test_a_start_is_left_the_way_the_vehicle_faces() -> None:
    first = next(moves.headed(RIGHT_ANGLE, 90.0))
    assert first[1].place == pytest.approx((5.0, 0.0))
    assert first[0] == RIGHT_ANGLE[0]
    assert not first[1].is_fixed


def test_a_fixed_point_is_approached_from_other_sides_and_stays() -> None:
    for one in moves.approached(replace_stop(FIXED), 1):
        assert any(point.place == (0, 60) and point.stop_s == 2.0 for point in one)
        assert drawn.stops(one) == {[point.place for point in one].index((0, 60)): 2.0}


def replace_stop(drawing: Drawing) -> Drawing:
    return (drawing[0], drawing[1]._replace(stop_s=2.0), drawing[2])


def test_a_leg_is_bent_away_from_a_fence() -> None:
    bent = list(moves.bent(RIGHT_ANGLE, 1, (0.0, 30.0), (-1.0, 0.0), 0.5))
    assert [one[1].place.east_m for one in bent] == pytest.approx([-0.55, -0.85, -1.3])
    assert not list(moves.bent(RIGHT_ANGLE, 1, (0.0, 59.0), (-1.0, 0.0), 0.5))


def test_two_corners_become_one_farther_out_each_time() -> None:
    drawing = lines((0, 0), (0, 40), (6, 46), (60, 46))
    found = list(moves.rejoined(drawing, 1))
    assert [len(one) for one in found] == [3] * 6
    assert found[0][1].place == pytest.approx((0.0, 46.0))
    out_m = [math.dist(one[1].place, found[0][1].place) for one in found]
    assert out_m == pytest.approx([0.0, *moves.REJOINED_M])
    assert all(one[1].place[0] <= 0.0 and one[1].place[1] >= 46.0 for one in found)


def test_fixed_points_are_not_rejoined() -> None:
    assert not list(moves.rejoined(lines((0, 0), (0, 40), (6, 46), (60, 46), fixed=(2,)), 1))


def test_a_slow_stretch_is_driven_faster_whole_or_in_part() -> None:
    slow = tuple(point._replace(speed_mps=1.0) for point in RIGHT_ANGLE)
    found = list(moves.quickened(slow, 1, 5.0))
    speeds = {tuple(drawn.speeds(one)) for one in found}
    assert {(None, None), (None, 1.0), (3.0, 3.0), (1.0, None, 1.0, 1.0), (1.0, 2.0, 1.0)} <= speeds
    for one in found:
        assert drawn.distances_m(one)[-1] == pytest.approx(120.0)
        assert {point.place for point in RIGHT_ANGLE} <= {point.place for point in one}


def test_what_is_not_slow_is_not_quickened() -> None:
    assert not list(moves.quickened(RIGHT_ANGLE, 1, 5.0))
    slowest = tuple(point._replace(speed_mps=2.0) for point in RIGHT_ANGLE)
    assert all(one[1].speed_mps != 3.0 for one in moves.quickened(slowest, 1, 3.0))
