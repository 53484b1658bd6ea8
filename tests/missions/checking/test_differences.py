"""Two missions, fences and lists of rally points told apart: nothing where they are the same, and each change by itself."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from missions.checking.differences import ChangeKind, differences, summary
from missions.errors import SituationError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats.parts import Part
from missions.geo import LatLon
from missions.items import Command, CoordinateFrame, MissionItem, change_speed, waypoint
from missions.picture.differences import differences_scene
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Situation

HOME = LatLon(48.1, 11.5)
NAV_SCRIPT_TIME = 42702
PARTS = (Part.MISSION, Part.FENCE, Part.RALLY)
GEOD = Geod(ellps="WGS84")


def place(east: int, north: int) -> LatLon:
    return LatLon(48.1 + north * 1e-5, 11.5 + east * 1e-5)


def jump(item: int, times: float = 2.0) -> MissionItem:
    return MissionItem(Command.DO_JUMP, CoordinateFrame.MISSION, (float(item), times, 0.0, 0.0))


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        (3_000_000.0, 3_000_001.0, False),  # a number of something, such as a script's argument
        (16_777_215.0, 16_777_216.0, False),
        (0.1, 0.10000000149011612, True),  # as a vehicle keeps it
        (123_456.1, 123_456.1015625, True),
        (123_456.1, 123_456.2, False),
        (0.0, 1e-7, True),
        (2.0, 2.0000001, True),
    ],
)
def test_numbers_are_the_same_as_far_as_vehicles_keep_them(one, other, is_same):
    a, b = (
        situation([MissionItem(NAV_SCRIPT_TIME, CoordinateFrame.MISSION, (1.0, 2.0, value, 0.0))])
        for value in (one, other)
    )
    assert (differences(a, b, PARTS) == ()) == is_same


def square(east: int, north: int, size: int = 10, kind: ZoneKind = ZoneKind.EXCLUSION) -> PolygonZone:
    corners = [(0, 0), (size, 0), (size, size), (0, size)]
    return PolygonZone(kind, tuple(place(east + x, north + y) for x, y in corners))


def situation(
    items=(), zones=(), rally=(), home: LatLon | None = HOME, back: LatLon | None = None
) -> Situation:
    fence = Fence(tuple(zones), back)
    return Situation(
        mission=Known(Mission(tuple(items), home), None, "") if items else None,
        fence=Known(fence, None, "") if zones or back else None,
        rally=Known(tuple(rally), None, "") if rally else None,
    )


def told(a: Situation, b: Situation) -> list[str]:
    return [f"{one.change} {one.text}" for one in differences(a, b, PARTS)]


ITEMS = [waypoint(place(0, 0)), waypoint(place(20, 0)), change_speed(1.5), waypoint(place(20, 30)), jump(2)]
places = st.builds(place, st.integers(-50, 50), st.integers(-50, 50))
items = st.lists(
    st.one_of(places.map(waypoint), st.floats(0.5, 3.0).map(change_speed), st.just(jump(1))),
    min_size=1,
    max_size=7,
)
zones = st.lists(
    st.builds(square, st.integers(-90, 90), st.integers(-90, 90), st.integers(1, 30)), max_size=4
)


@settings(max_examples=40)
@given(items, zones, st.lists(st.builds(RallyPoint, st.just(48.1), st.floats(11.4, 11.6)), max_size=3))
def test_the_same_has_no_difference_and_neither_has_another_order_of_zones(some, fence, rally):
    one = situation(some, fence, rally)
    assert told(one, one) == []
    turned = [replace(zone, vertices=(*zone.vertices[2:], *zone.vertices[:2])) for zone in fence[::-1]]
    if len(set(fence)) == len(fence):
        assert told(one, situation(some, turned, rally)) == []


@given(items, st.data())
def test_an_item_put_in_is_the_only_difference(some, data):
    at = data.draw(st.integers(0, len(some)))
    new = waypoint(place(999, 999))
    longer = [*some[:at], new, *some[at:]]
    moved = [
        jump(int(item.params[0]) + (item.params[0] > at)) if item.command == Command.DO_JUMP else item
        for item in longer
    ]
    found = differences(situation(some), situation(moved), PARTS)
    assert [(one.change, one.name_b) for one in found] == [(ChangeKind.ONLY_B, str(at + 1))]
    back = differences(situation(moved), situation(some), PARTS)
    assert [(one.change, one.name_a) for one in back] == [(ChangeKind.ONLY_A, str(at + 1))]


def test_a_moved_waypoint_is_told_by_how_far():
    other = [*ITEMS[:1], waypoint(place(20, 10)), *ITEMS[2:]]
    (found,) = differences(situation(ITEMS), situation(other), PARTS)
    bearing_deg, _, away_m = GEOD.inv(*reversed(place(20, 0)), *reversed(place(20, 10)))
    assert found.moved_m == pytest.approx(away_m, abs=0.01)
    assert (
        found.text
        == f"item 2 (WAYPOINT): moved {away_m:.2f} m, bearing {bearing_deg:.0f}°, to {place(20, 10)}"
    )
    assert (found.name_a, found.name_b) == ("2", "2")


@pytest.mark.parametrize(
    ("number", "item", "text"),
    [
        (3, change_speed(2.0), "~ item 3 (DO_CHANGE_SPEED): speed (m/s) 1.5 → 2"),
        (5, jump(1), "~ item 5 (DO_JUMP): jump to item 2 → 1"),
        (5, jump(2, 3.0), "~ item 5 (DO_JUMP): times 2 → 3"),
        (3, jump(1), "~ item 3: DO_CHANGE_SPEED in A, DO_JUMP in B"),
        (1, replace(ITEMS[0], params=(5.0, 0.0, 0.0, 0.0)), "~ item 1 (WAYPOINT): stop (s) 0 → 5"),
        (1, replace(ITEMS[0], alt_m=2.0, autocontinue=False), "~ item 1 (WAYPOINT): altitude 0 → 2 m; autocontinue 1 → 0"),
        (1, replace(ITEMS[0], frame=CoordinateFrame.GLOBAL_INT), "~ item 1 (WAYPOINT): frame 3 → 0"),
        (3, replace(ITEMS[2], lat_e7=4), "~ item 3 (DO_CHANGE_SPEED): param5 and param6 0, 0 → 4, 0"),
    ],
)  # fmt: skip
def test_what_of_an_item_is_otherwise(number, item, text):
    other = [*ITEMS[: number - 1], item, *ITEMS[number:]]
    assert told(situation(ITEMS), situation(other)) == [text]


def test_what_a_format_cannot_write_is_no_difference():
    nan = float("nan")
    unset = replace(ITEMS[0], params=(0.0, 0.0, 0.0, nan))
    assert told(situation([unset, *ITEMS[1:]]), situation(ITEMS)) == []
    needed = replace(ITEMS[2], params=(1.0, nan, -1.0, 0.0))
    assert told(situation([needed]), situation([needed])) == []
    unknown = MissionItem(31010, CoordinateFrame.MISSION)
    assert told(situation([unknown]), situation([unknown, unknown])) == [
        "+ item 2 (command 31010): only in B"
    ]


def test_home_and_return_point():
    assert told(situation(ITEMS), situation(ITEMS, home=None)) == [f"- home {HOME}: only in A"]
    assert told(situation(ITEMS, home=None), situation(ITEMS)) == [f"+ home {HOME}: only in B"]
    assert told(situation(ITEMS), situation(ITEMS, home=place(0, 10)))[0].startswith(
        "~ home moved 11.12 m, bearing 0°"
    )
    zone = [square(0, 0)]
    assert told(situation(zones=zone), situation(zones=zone, back=HOME)) == [
        f"+ return point {HOME}: only in B"
    ]
    assert told(situation(zones=zone, back=HOME), situation(zones=zone)) == [
        f"- return point {HOME}: only in A"
    ]
    moved = told(situation(zones=zone, back=HOME), situation(zones=zone, back=place(0, 10)))
    assert moved[0].startswith("~ return point moved 11.12 m")
    assert told(situation(zones=zone, back=HOME), situation(zones=zone, back=HOME)) == []


def test_zones_are_told_by_what_they_share():
    field = square(-100, -100, 300, ZoneKind.INCLUSION)
    ring = CircleZone(ZoneKind.EXCLUSION, place(60, 60), 5.0)
    a = situation(zones=[field, square(0, 0), square(50, 0), ring])
    wider = replace(ring, radius_m=6.0)
    grown = PolygonZone(ZoneKind.EXCLUSION, (*square(0, 0).vertices[:3], place(-3, 10)))
    b = situation(zones=[square(0, 50), grown, wider, field])
    found = differences(a, b, PARTS)
    assert [one.text.split(",")[0] for one in found] == [
        found[0].text.split(",")[0],
        "exclusion circle 1: radius 5.00 → 6.00 m",
        found[2].text.split(",")[0],
        found[3].text.split(",")[0],
    ]
    assert found[0].text.startswith("exclusion polygon 1 (in B exclusion polygon 2): its edge moved by up to")
    _, _, west_m = GEOD.inv(*reversed(place(0, 10)), *reversed(place(-3, 10)))
    assert found[0].moved_m == pytest.approx(west_m, rel=0.02)
    assert [(one.change, one.name_a, one.name_b) for one in found[2:]] == [
        (ChangeKind.ONLY_A, "exclusion polygon 2", None),
        (ChangeKind.ONLY_B, None, "exclusion polygon 1"),
    ]
    fewer = PolygonZone(ZoneKind.EXCLUSION, square(0, 0).vertices[:3])
    assert "4 → 3 vertices" in told(situation(zones=[square(0, 0)]), situation(zones=[fewer]))[0]
    moved = replace(ring, centre=place(61, 60))
    assert told(situation(zones=[ring]), situation(zones=[moved]))[0].startswith(
        "~ exclusion circle 1: centre moved 0.74 m"
    )
    gone = told(situation(zones=[ring]), situation())
    assert gone == [f"- exclusion circle 1, radius 5 m around {place(60, 60)}: only in A"]


def test_rally_points():
    points = [RallyPoint(48.1, 11.5), RallyPoint(48.2, 11.5)]
    a = situation(rally=points)
    assert told(a, situation(rally=points[:1])) == [f"- rally point 2 at {points[1].position}: only in A"]
    assert told(situation(rally=points[1:]), a) == [f"+ rally point 1 at {points[0].position}: only in B"]
    higher = [points[0]._replace(alt_m=3.0), points[1]]
    assert told(a, situation(rally=higher)) == ["~ rally point 1: altitude 0 → 3 m"]
    moved = [RallyPoint(48.1001, 11.5), points[1]]
    assert told(a, situation(rally=moved))[0].startswith("~ rally point 1: moved 11.12 m, bearing 0°")


def test_summaries():
    whole = situation(ITEMS, [square(0, 0)], [RallyPoint(48.1, 11.5)])
    assert [summary(whole, part) for part in PARTS][1:] == ["1 zone", "1 rally point"]
    assert summary(whole, Part.MISSION).startswith("5 items, 48.")
    assert [summary(Situation(), part) for part in PARTS] == ["no mission", "no fence", "no rally points"]


def test_the_picture_shows_b_and_what_a_has_otherwise():
    a = situation(ITEMS, [square(0, 0), square(50, 0)])
    b = situation([*ITEMS[:1], waypoint(place(20, 10)), *ITEMS[2:]], [square(0, 0)])
    scene = differences_scene(a, b, ["A B"], [(place(20, 10), "~ 2")])
    assert [track.name for track in scene.tracks] == ["fence in A", "route in A", "route in A"]
    assert (scene.zone_count, scene.numbers, len(scene.marks)) == (1, (1, 2, 4), 1)
    many = differences_scene(a, b, ["A B"], [(place(20, 10), "~ 2")] * 31)
    assert {mark.name for mark in many.marks} == {""}
    with pytest.raises(SituationError, match="no place to draw"):
        differences_scene(Situation(), Situation(), [], [])
