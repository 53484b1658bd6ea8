"""Missions followed item by item."""

from __future__ import annotations

import math

import pytest
from strategies import offset

from missions.checking.execution import MOST_LEGS, Course, follow_mission
from missions.geo import LatLon, rounded
from missions.items import CoordinateFrame, MissionItem, waypoint
from missions.situation import Mission

HOME = LatLon(40.071374, -105.22993)
PLACES = [rounded(offset(HOME, 20.0 * number, 7.0 * number**2)) for number in range(8)]


def go(number: int, delay_s: float = 0.0, command: int = 16, param3: float = 0.0) -> MissionItem:
    item = waypoint(PLACES[number])
    return MissionItem(command, item.frame, (delay_s, 0.0, param3, 0.0), item.lat_e7, item.lon_e7)


def do(command: int, *params: float) -> MissionItem:
    padded = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    return MissionItem(command, CoordinateFrame.MISSION, padded)


def jump(seq: int, times: int) -> MissionItem:
    return do(177, seq, times)


def follow(*items: MissionItem, start: LatLon | None = HOME, **options) -> Course:
    return follow_mission(Mission(items, HOME), start, home=HOME, **options)


def seqs(course: Course) -> list[tuple[int, int]]:
    return [(leg.first_item, leg.last_item) for leg in course.legs]


def speeds(course: Course) -> list[float | None]:
    return [leg.speed_mps for leg in course.legs]


def test_legs_run_from_the_start_from_place_to_place():
    course = follow(go(1), go(2), go(3))
    assert seqs(course) == [(0, 1), (1, 2), (2, 3)]
    assert [leg.end for leg in course.legs] == PLACES[1:4]
    assert course.legs[0].start == HOME
    assert all(a.end == b.start for a, b in zip(course.legs, course.legs[1:], strict=False))
    assert not course.troubles
    assert not course.notes


def test_without_a_start_the_first_leg_begins_at_the_first_place():
    assert seqs(follow(go(1), go(2), start=None)) == [(1, 2)]


def test_a_speed_counts_from_the_leg_after_it_on():
    course = follow(go(1), do(178, 1, 3.0, -1), go(2), go(3), do(178, 1, 0.5), go(4))
    assert speeds(course) == [None, 3.0, 3.0, 0.5]


def test_a_speed_that_the_autopilot_refuses_changes_nothing():
    course = follow(do(178, 1, -2), go(1), do(178, 1, math.nan), go(2), do(178, 1, 0), go(3))
    assert speeds(course) == [None, None, None]


def test_a_speed_under_a_condition_may_come_late_or_never():
    course = follow(
        do(178, 1, 2),
        go(1),
        do(114, 5),
        do(178, 1, 1),
        go(2),
        do(112, 9),
        do(178, 1, 4),
        go(3),
        do(178, 1, 1),
        go(4),
    )
    assert speeds(course) == [2.0, 2.0, 4.0, 1.0]
    assert speeds(follow(do(112, 3), do(178, 1, 1.0), go(1), own_speed_mps=2.5)) == [2.5]


def test_delays_and_loiters_stop():
    course = follow(go(1, 4.0), go(2, 7.0, 19), go(3), do(93, 5.0), go(4), do(93, -1.0), go(5, math.nan))
    assert [leg.stop_s for leg in course.legs] == [4.0, 7.0, 5.0, 0.0, None]


def test_a_waypoint_without_a_place_is_a_stop():
    here = MissionItem(16, params=(3.0, 0.0, 0.0, 0.0))
    course = follow(here, go(1), here, go(2))
    assert seqs(course) == [(0, 2), (2, 4)]
    assert [leg.stop_s for leg in course.legs] == [3.0, None]


def test_a_jump_is_taken_as_often_as_it_says():
    course = follow(go(1), go(2), jump(1, 2), go(3))
    assert seqs(course) == [(0, 1), (1, 2), (2, 1), (1, 2), (2, 1), (1, 2), (2, 4)]
    assert [leg.jump_item for leg in course.legs] == [None, None, 3, None, 3, None, None]
    assert not course.is_endless


def test_a_jump_without_end_is_followed_once_round():
    course = follow(go(1), go(2), jump(1, -1), go(3))
    assert seqs(course) == [(0, 1), (1, 2), (2, 1), (1, 2)]
    assert course.is_endless
    assert any("item 3 repeats forever" in note for note in course.notes)


def test_a_jump_ahead_and_one_of_no_times():
    assert seqs(follow(go(1), jump(4, -1), go(2), go(3))) == [(0, 1), (1, 4)]
    assert seqs(follow(go(1), jump(1, 0), go(2))) == [(0, 1), (1, 3)]


def test_nested_jumps_count_on():
    # The autopilot never sets its counts back: the inner jump is taken twice in all.
    course = follow(go(1), go(2), jump(2, 2), jump(1, 1))
    assert seqs(course) == [(0, 1), (1, 2), (2, 2), (2, 2), (2, 1), (1, 2)]


def test_jumps_to_tags():
    course = follow(go(1), do(600, 7), go(2), do(601, 7, 1), go(3))
    assert seqs(course) == [(0, 1), (1, 3), (3, 3), (3, 5)]
    assert "jumps to tag 8" in follow(go(1), do(601, 8, 1), go(2)).troubles[0]


@pytest.mark.parametrize("seq", [0, 9, -1, math.nan])
def test_a_jump_to_nowhere_is_not_understood(seq):
    course = follow(go(1), jump(seq, 1), go(2))
    assert len(course.troubles) == 1
    assert "item 2 jumps to item" in course.troubles[0]


def test_jumps_that_only_lead_to_one_another_end():
    course = follow(go(1), jump(3, -1), jump(2, -1), go(2))
    assert seqs(course) == [(0, 1)]
    assert course.is_endless


def test_a_circle_of_counted_jumps_without_a_place_is_not_understood():
    course = follow(go(1), jump(3, 9999), jump(2, 9999), go(2))
    assert "in a loop without a waypoint" in course.troubles[0]


def test_an_endless_last_jump_needs_no_words():
    course = follow(go(1), go(2), jump(1, -1))
    assert course.is_endless
    assert not course.notes


def test_many_repeats_are_cut_short():
    course = follow(go(1), go(2), jump(1, 5000), go(3))
    assert len(course.legs) < 20
    assert seqs(course)[-1] == (2, 4)
    assert any(str(MOST_LEGS) in note for note in course.notes)


def test_a_mission_longer_than_can_be_followed_is_not_understood():
    course = follow(*[go(1 + number % 7) for number in range(MOST_LEGS + 5)])
    assert len(course.legs) == MOST_LEGS
    assert "was not checked" in course.troubles[0]


def test_rtl_leads_home_and_the_mission_goes_on():
    course = follow(do(178, 1, 1.0), go(1), do(20), go(2), return_speed_mps=0.7)
    assert [(leg.end, leg.is_return) for leg in course.legs] == [
        (PLACES[1], False),
        (HOME, True),
        (PLACES[2], False),
    ]
    assert speeds(course) == [1.0, 0.7, None]


def test_rtl_follows_a_home_that_was_moved():
    moved = MissionItem(
        179, params=(0.0,) * 4, lat_e7=waypoint(PLACES[5]).lat_e7, lon_e7=waypoint(PLACES[5]).lon_e7
    )
    assert follow(go(1), moved, go(2), do(20)).legs[-1].end == PLACES[5]
    assert follow(go(1), do(179, 1), go(2), do(20)).legs[-1].end == PLACES[1]


def test_rtl_without_a_home_is_not_understood():
    course = follow_mission(Mission((go(1), do(20))), HOME)
    assert "home is unknown" in course.troubles[0]
    assert len(course.legs) == 1


def test_what_a_rover_does_not_do_is_said():
    course = follow(do(22), go(1), go(2, command=21))
    assert seqs(course) == [(0, 2)]
    assert len(course.notes) == 2
    assert not course.troubles


@pytest.mark.parametrize("command", [82, 84, 92, 94, 213, 42702, 42703])
def test_what_drives_nobody_knows_where_is_not_understood(command):
    course = follow(go(1), go(2, command=command), go(3))
    assert len(course.troubles) == 1
    assert course.troubles[0].startswith("item 2 ")


def test_a_place_in_another_frame_is_not_understood():
    local = MissionItem(16, CoordinateFrame.LOCAL_NED, lat_e7=100000, lon_e7=200000)
    assert "frame 1" in follow(go(1), local).troubles[0]


def test_loiter_without_end_is_the_end():
    course = follow(go(1), go(2, command=17), go(3))
    assert seqs(course) == [(0, 1), (1, 2)]
    assert course.ends_in_loiter
    assert "never reached" in course.notes[0]
    assert not follow(go(1), go(2, command=17)).notes


def test_circles_have_a_radius():
    course = follow(go(1, 3, 18, param3=-8.0), go(2, 1, 18), circle_m=12.0)
    assert [leg.circle_m for leg in course.legs] == [8.0, 12.0]


def test_reverse_and_the_fence_turned_off_are_noted():
    course = follow(do(194, 1), go(1), do(194, 0), do(207, 0), go(2), do(207, 1), do(183, 1, 1500))
    assert len(course.notes) == 2
    assert "reverse" in course.notes[0]
    assert "fence off" in course.notes[1]
