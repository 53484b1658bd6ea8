"""Missions with their ways home inside: what stands behind the drive, and that nothing but a choice leads there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from charts import HOME, IN, OUT, Chart, box, place

from missions.checking.check import check_mission
from missions.checking.execution import follow_mission
from missions.checking.home_part import drive_end, home_parts, jump_to_end
from missions.errors import MissionTooLongError, NoRouteError, RequestError, RouteError
from missions.fence import Fence
from missions.firmware import Firmware
from missions.geo import distance_m
from missions.items import Command, MissionItem, change_speed, jump_tag, waypoint
from missions.planning.plan import plan
from missions.request import RepairMission, Tour
from missions.situation import Known, Mission, Situation

MAP = Chart(HOME)
FIELD = box(IN, -60, -60, 160, 160)
WALL = box(OUT, 40, -40, 44, 160)
TARGET = place(100, 100)


def situation_of(*zones, home=HOME, **parameters: float) -> Situation:
    return Situation(
        fence=Known(Fence((FIELD, *zones)), None, "test"),
        parameters=parameters,
        firmware=Firmware(4, 6),
        home=Known(home, None, "test") if home else None,
    )


WALLED = situation_of(WALL)
ASKED = Tour(start=HOME, targets=(TARGET,), clearance_m=2.0, trusts_model=True, way_home_inside=True)


@pytest.fixture(scope="module")
def made():
    return plan(WALLED, ASKED)


def test_behind_the_drive_stand_the_ways_home_and_a_tag_at_the_end(made):
    plain = plan(WALLED, replace(ASKED, way_home_inside=False))
    count = len(plain.items)
    assert made.items[:count] == plain.items
    assert (made.path, made.seqs, made.clearance_m) == (plain.path, plain.seqs, plain.clearance_m)
    assert drive_end(made.items) == count
    assert made.items[count] == jump_to_end(len(made.items))
    assert made.items[-1] == jump_tag(count + 1)
    parts = home_parts(made.items)
    assert {part.leg_item for part in parts} <= set(made.seqs[1:])
    assert parts
    for part in parts:
        assert made.items[part.item - 2].command == Command.JUMP_TAG
        assert made.items[part.item - 1] == part.items[0]
        assert distance_m(part.place, HOME) < 0.02
    (told,) = [text for text in made.info if text.startswith("ways home inside")]
    assert all(f"{part.leg_item} → {part.item}" in told for part in parts)


def test_the_drive_by_itself_ends_before_them(made):
    course = follow_mission(Mission(made.items, HOME), HOME)
    assert [leg.last_item for leg in course.legs] == list(made.seqs[1:])
    assert distance_m(course.path[-1], TARGET) < 0.02
    assert (course.troubles, course.notes, course.is_endless) == ((), (), False)


def test_lines_from_the_legs_to_their_ways_and_the_ways_keep_the_promise(made):
    """By the tests' own map: the hull of each leg and of where its way begins, and the lines from there on."""
    wall = shapely.Polygon(MAP.points(WALL.vertices))
    for part in home_parts(made.items):
        leg = [made.path[made.seqs.index(part.leg_item) + step] for step in (-1, 0)]
        path = [item.position for item in part.items if item.is_placed]
        hull = shapely.MultiPoint(MAP.points([*leg, path[0]])).convex_hull
        assert hull.distance(wall) >= 2.0 - 0.03
        if len(path) > 1:
            assert MAP.line(path).distance(wall) >= 2.0 - 0.03


def test_the_check_knows_them_and_finds_one_that_is_spoilt(made):
    checked = check_mission(Mission(made.items, HOME), WALLED, replace(ASKED, way_home_inside=False))
    ways = {way.part.leg_item: way for way in checked.home_ways}
    assert set(ways) == {part.leg_item for part in home_parts(made.items)}
    assert all(way.trouble == "" and way.driven_clearance_m >= 2.0 - 0.011 for way in ways.values())
    assert checked.holds
    last = ways[made.seqs[-1]]
    assert last.length_m > 200
    assert last.time_s > 100
    assert f"choose item {last.part.item}" in str(last)
    # Straight through the wall, from the last leg.
    part = last.part
    spoilt = list(made.items)
    for index in range(part.item - 1, part.item - 1 + len(part.items)):
        spoilt[index] = waypoint(HOME)
    found = check_mission(Mission(tuple(spoilt), HOME), WALLED, replace(ASKED, way_home_inside=False))
    assert not found.holds
    assert found.broken == ()
    trouble = {way.part.leg_item: way.trouble for way in found.home_ways}[part.leg_item]
    assert "exclusion polygon 1" in trouble
    assert "2.00 m is required" in trouble


def test_speeds_are_said_where_a_way_is_entered():
    made = plan(WALLED, replace(ASKED, speed_mps=1.0))
    parts = home_parts(made.items)
    assert parts
    for part in parts:
        assert part.items[0].command == Command.DO_CHANGE_SPEED
        assert part.items[0].params[1] == 1.0
    assert not [
        part
        for part in home_parts(plan(WALLED, ASKED).items)
        if part.items[0].command == Command.DO_CHANGE_SPEED
    ]


def test_a_place_that_is_nearer_than_home_is_led_to():
    made = plan(WALLED, replace(ASKED, places=(("shed", place(100, -20)),)))
    last = home_parts(made.items)[-1]
    assert distance_m(last.place, place(100, -20)) < 0.02


def test_a_target_at_the_place_itself():
    made = plan(WALLED, replace(ASKED, places=(("there", TARGET),)))
    last = home_parts(made.items)[-1]
    assert [distance_m(item.position, TARGET) < 0.1 for item in last.items] == [True]


def test_a_leg_without_a_way_is_named():
    """The target's side of a fence across the field cannot be left: no place is there."""
    closed = box(OUT, 40, -70, 44, 170)
    start = place(60, 0)
    asked = replace(ASKED, start=start)
    with pytest.raises(NoRouteError, match="no leg has a way home: no way home from the leg to item"):
        plan(situation_of(closed), asked)
    with pytest.raises(NoRouteError, match="there is no place to go home to"):
        plan(situation_of(WALL, home=None), asked)


def test_what_does_not_know_tags_is_refused():
    old = replace(WALLED, firmware=Firmware(4, 3))
    with pytest.raises(RouteError, match=r"which ArduPilot has since 4\.4; the vehicle is ArduPilot 4\.3"):
        plan(old, ASKED)


def test_more_items_than_the_vehicle_holds_are_refused():
    small = situation_of(WALL, BRD_SD_MISSION=0)
    made = plan(small, ASKED)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("missions.tour.way_home_inside.most_items", lambda _parameters: len(made.items))
        with pytest.raises(MissionTooLongError, match=f"needs {len(made.items) + 1} items with home"):
            plan(small, ASKED)


def test_requests_that_make_no_sense():
    for end in ("loiter", "rtl"):
        with pytest.raises(RequestError, match="end"):
            replace(ASKED, end=end)
    with pytest.raises(RequestError, match="places"):
        replace(ASKED, places=("shed",))
    words = replace(ASKED, places=(("shed", TARGET),)).words()
    assert words["places"] == (("shed", TARGET),)
    assert words["way_home_inside"] is True
    assert RepairMission().words()["way_home_inside"] is False


HERE = waypoint(HOME)


@pytest.mark.parametrize(
    "items",
    [
        (),
        (HERE,),
        (HERE, jump_tag(9)),
        (HERE, jump_to_end(3), jump_tag(9)),  # nothing between
        (HERE, jump_to_end(4), HERE, jump_tag(9)),  # no tag
        (HERE, jump_to_end(5), jump_tag(2), HERE, jump_tag(9)),  # no item of the drive
        (HERE, jump_to_end(5), jump_tag(1), change_speed(1.0), jump_tag(9)),  # leads nowhere
        (
            HERE,
            replace(jump_to_end(5), params=(5.0, 3.0, 0.0, 0.0)),
            jump_tag(1),
            HERE,
            jump_tag(9),
        ),  # not for ever
        (HERE, jump_to_end(4), jump_tag(1), HERE, jump_tag(9)),  # not to the end
        (HERE, jump_to_end(5), jump_tag(1), HERE, HERE),
    ],
)
def test_what_is_no_way_home(items: tuple[MissionItem, ...]):
    assert home_parts(items) == ()


def test_tags_in_a_row_and_within_a_way_and_twice():
    other = waypoint(place(10, 0))
    items = (
        HERE,
        HERE,
        jump_to_end(11),
        jump_tag(1),
        change_speed(1.0),
        HERE,
        jump_tag(2),
        jump_tag(1),
        other,
        jump_to_end(11),
        jump_tag(3),
    )
    one, two = home_parts(items)
    assert (one.leg_item, one.item, one.items) == (1, 5, (change_speed(1.0), HERE, other))
    assert (two.leg_item, two.item, two.items) == (2, 9, (other,))
    assert two.place == other.position
    assert np.isfinite(one.place).all()
