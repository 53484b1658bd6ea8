"""Missions longer than the vehicle holds: what their routes put in is left out, and nothing comes nearer to a fence for it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from charts import HOME, OUT, Chart, box, place
from shapely import LineString, Point, Polygon

from mavlink_bridge.protocol.limits import Limits
from missions.checking.check import check_mission
from missions.editing.repair import repair_mission
from missions.editing.shorten import shortened
from missions.editing.shorter_lines import meeting_place, without
from missions.errors import MissionTooLongError
from missions.fence import CircleZone, Fence, Zone, ZoneKind
from missions.firmware import Firmware
from missions.geo import distance_m
from missions.items import Command, CoordinateFrame, MissionItem, change_speed, waypoint
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import Known, Mission, Situation
from missions.vehicle.item_limit import most_items

MAP = Chart(HOME)


def situation_of(*zones: Zone, **parameters: float) -> Situation:
    return Situation(fence=Known(Fence(zones), None, "test"), parameters=parameters, firmware=Firmware(4, 6))


def go(east_m: float, north_m: float) -> MissionItem:
    return waypoint(place(east_m, north_m))


def jump(seq: int, times: int) -> MissionItem:
    return MissionItem(Command.DO_JUMP, CoordinateFrame.MISSION, (float(seq), float(times), 0.0, 0.0))


WIDE = box(ZoneKind.INCLUSION, -100, -100, 900, 100)
ONE_KB = 68
"""Items that BRD_SD_MISSION 1 holds, home included."""


def test_how_much_a_vehicle_holds():
    assert most_items({}) == Limits().mission_items == 655
    assert (
        most_items({"BRD_SD_MISSION": 1.0})
        == Limits.from_parameters({"BRD_SD_MISSION": 1.0}).mission_items
        == ONE_KB
    )
    assert most_items({"BRD_SD_MISSION": 64.0}) == 4368


def test_waypoints_on_the_line_go_first():
    bent = {40: 0.6, 80: -0.6}
    items = [go(8.0 * number, bent.get(number, 0.0)) for number in range(1, 101)]
    own = set(range(1, 100))
    situation = situation_of(WIDE)
    found = shortened(Mission(tuple(items), HOME), own, situation, Request(clearance_m=2.0), most=60)
    assert found.holds
    assert len(found.mission.items) == 60
    assert {items[39], items[79], items[99]} <= set(found.mission.items)
    assert found.length_m == pytest.approx(
        check_mission(Mission(tuple(items), HOME), situation).length_m, abs=1e-3
    )


def test_waypoints_round_an_obstacle_stay():
    post = CircleZone(OUT, place(400.0, 0.0), 20.0)
    around = [
        (400.0 - 30.0 * math.cos(turn), 30.0 * math.sin(turn))
        for turn in (0.0, 0.7, math.pi / 2, 2.4, math.pi)
    ]
    straight = [(9.0 * number, 0.0) for number in range(1, 40)]
    items = [go(*one) for one in (*straight, *around, (500.0, 0.0))]
    own = set(range(1, len(items)))
    situation, request = situation_of(WIDE, post, WP_SPEED=2.0), Request(clearance_m=2.0)
    assert check_mission(Mission(tuple(items), HOME), situation, request).holds
    found = shortened(Mission(tuple(items), HOME), own, situation, request, most=10)
    assert found.holds
    assert len(found.mission.items) <= 10
    kept = sum(item in found.mission.items for item in items[39:44])
    assert kept >= 3
    with pytest.raises(MissionTooLongError, match="the vehicle holds 4;") as caught:
        shortened(Mission(tuple(items), HOME), own, situation, request, most=3)
    assert caught.value.details["limit"] == 4
    assert caught.value.details["items"] > 4


def test_quick_stretches_become_slow_ones():
    items = [go(0.0, 0.0)]
    for number in range(10):
        items += [
            change_speed(5.0),
            go(50.0 * number + 20, 0.0),
            change_speed(2.0),
            go(50.0 * number + 30, 10.0 * (number % 2)),
        ]
    own = {seq for seq, item in enumerate(items, 1) if item.command == Command.DO_CHANGE_SPEED} | {5}
    situation = situation_of(WIDE, WP_SPEED=2.0)
    places = [item for item in items if item.command == Command.NAV_WAYPOINT]
    found = shortened(
        Mission(tuple(items), HOME), own - {5}, situation, Request(clearance_m=2.0), most=31, may_slow=True
    )
    assert [item for item in found.mission.items if item.is_placed] == places
    assert len(found.mission.items) <= 31
    # What is left of them still sets each stretch's speed: none is quicker than it was.
    before = {
        leg.leg.end: leg.leg.speed_mps or 2.0
        for leg in check_mission(Mission(tuple(items), HOME), situation).legs
    }
    assert all((leg.leg.speed_mps or 2.0) <= before[leg.leg.end] for leg in found.legs)


def test_a_speed_that_the_mission_sets_itself_stays():
    items = (
        change_speed(1.0),
        go(20.0, 0.0),
        change_speed(5.0),
        go(40.0, 0.0),
        change_speed(1.0),
        go(60.0, 0.0),
    )
    with pytest.raises(
        MissionTooLongError, match="needs 7 items including home, but the vehicle holds 5; 0 of 0 route items"
    ):
        shortened(Mission(items, HOME), (), situation_of(WIDE), Request(clearance_m=2.0), most=4)


def test_jumps_are_numbered_anew():
    items = (go(0.0, 0.0), go(10.0, 0.0), go(20.0, 0.0), jump(2, 1), jump(3, 1))
    mission, seqs = without(Mission(items, HOME), {2})
    assert seqs == (1, 3, 4, 5)
    assert [item.params[0] for item in mission.items if item.command == Command.DO_JUMP] == [2, 2]


def field_of_posts():
    posts = [
        CircleZone(OUT, place(20.0 * column, 20.0 * row), 2.0)
        for column in range(-4, 8)
        for row in range(-2, 3)
    ]
    return (box(ZoneKind.INCLUSION, -100, -60, 170, 60), *posts)


def test_a_long_tour_fits_or_says_why_not(monkeypatch):
    spots = [(20.0 * column + 10.0, 20.0 * row + 10.0) for column in range(-4, 7) for row in (-2, -1, 0, 1)]
    targets = tuple(place(*spots[9 * number % len(spots)]) for number in range(15))
    situation = situation_of(*field_of_posts(), WP_SPEED=2.0)
    request = Request(start=place(-95.0, 0.0), targets=targets, clearance_m=1.0)
    whole = plan(situation, request)
    most = len(whole.items)  # one less, with home
    monkeypatch.setattr("missions.planning.plan.plan_tour", lambda *_arguments, **_options: whole)
    monkeypatch.setattr("missions.planning.plan.most_own_items", lambda _situation: most - 1)
    fitted = plan(situation, request)
    assert len(fitted.items) + 1 <= most
    assert fitted.targets == whole.targets
    assert set(fitted.targets) <= set(fitted.path)
    assert any(f"left out to fit the vehicle's limit of {most}" in text for text in fitted.info)
    assert fitted.driven_clearance_m >= 1.0 - 0.01
    assert_clear_of_posts(fitted.path, 1.0)
    assert check_mission(Mission(fitted.items), situation, request).holds
    with pytest.raises(MissionTooLongError, match=f"the vehicle holds {most}; 0 of 0 route items"):
        plan(situation, replace(request, corner_allowance_m=1.0))


def assert_clear_of_posts(path, least_m: float) -> None:
    """Measure the lines in the test's own map."""
    line = LineString(MAP.points(path))
    for column in range(-4, 8):
        for row in range(-2, 3):
            centre = Point(MAP.points([place(20.0 * column, 20.0 * row)])[0])
            assert line.distance(centre) - 2.0 >= least_m - 0.01


def test_a_repaired_mission_is_shortened_by_its_routes_only(monkeypatch):
    items = (go(20.0, 30.0), go(80.0, 30.0), go(80.0, 50.0))
    barn = box(OUT, 40, 20, 60, 40)
    situation = situation_of(box(ZoneKind.INCLUSION, -60, -60, 160, 160), barn)
    request = Request(clearance_m=2.0)
    whole = repair_mission(Mission(items, HOME), situation, request)
    assert (
        len(whole.mission.items) == 7
    )  # the leg is left before the barn, and comes back to its line behind it
    count = 5
    monkeypatch.setattr(
        "missions.editing.repair.most_own_items", lambda _situation: count - 1
    )  # one less, with home
    short = repair_mission(Mission(items, HOME), situation, request)
    assert short.check.holds
    assert [item for item in short.mission.items if item in items] == list(items)
    assert len(short.mission.items) == count - 1  # two corners of the barn became one
    assert short.changes[-1] == "3 route items left out to fit the vehicle's limit of 5"
    barn_at = Polygon(MAP.points([place(*corner) for corner in ((40, 20), (60, 20), (60, 40), (40, 40))]))
    line = LineString(MAP.points([HOME, *(one.position for one in short.mission.items)]))
    assert line.distance(barn_at) >= 2.0
    monkeypatch.setattr("missions.editing.repair.most_own_items", lambda _situation: count - 1 - 1)
    with pytest.raises(
        MissionTooLongError, match="needs 5 items including home, but the vehicle holds 4; 1 of 2 route items"
    ):
        repair_mission(Mission(items, HOME), situation, request)


def test_where_two_corners_meet():
    found = meeting_place(place(0, 0), place(0, 10), place(5, 20), place(15, 20))
    assert distance_m(found, place(0, 20)) < 0.01
    assert meeting_place(place(0, 0), place(0, 10), place(5, 20), place(5, 30)) is None  # one turns back
    assert meeting_place(place(0, 0), place(0, 10), place(5, 12), place(5, 0)) is None  # nearly a whole turn
    assert meeting_place(place(0, 0), place(0, 0), place(5, 12), place(5, 0)) is None


def test_rtl_at_the_end_needs_an_item_too(monkeypatch):
    situation = situation_of(WIDE)
    request = Request(
        start=place(0.0, 0.0), targets=(place(20.0, 0.0), place(40.0, 0.0)), clearance_m=1.0, end="rtl"
    )
    situation = replace(situation, home=Known(place(0.0, 0.0), None, "test"))
    monkeypatch.setattr("missions.planning.plan.most_own_items", lambda _situation: 4 - 1)
    assert len(plan(situation, request).items) == 3
    monkeypatch.setattr("missions.planning.plan.most_own_items", lambda _situation: 3 - 1)
    with pytest.raises(MissionTooLongError, match="needs 4 items including home, but the vehicle holds 3"):
        plan(situation, request)
