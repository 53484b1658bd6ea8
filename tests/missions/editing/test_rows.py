"""Repaired survey rows keep to their own line, and leave it only near what is in the way; measured in the test's own map by shapely."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from charts import HOME, IN, OUT, Chart, box, place, situation_of
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, union_all

from missions.checking.check import check_mission
from missions.editing.repair import repair_mission
from missions.errors import RouteError
from missions.fence import CircleZone
from missions.formats import read_fence, read_mission
from missions.formats.parameters import read_parameters
from missions.items import Command, waypoint
from missions.request import Request
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path

    from missions.editing.repair import Repair
    from missions.geo import LatLon

ON_LINE_M = 0.3
BAND_M = 0.5  # more than the predicted corridor of a straight line is wide
MOWER = {
    "WP_RADIUS": 0.5,
    "WP_SPEED": 1.5,
    "ATC_TURN_MAX_G": 0.6,
    "WP_PIVOT_ANGLE": 60,
    "SERVO1_FUNCTION": 73,
    "SERVO3_FUNCTION": 74,
    "AVOID_ENABLE": 0,
    "FENCE_MARGIN": 1,
}


def off_line(chart: Chart, row: tuple[LatLon, LatLon], found: Repair) -> LineString:
    """Return what of a row is not driven along it, between the same two waypoints."""
    path = list(found.check.path)
    begin = path.index(row[0])
    driven = LineString(chart.points(path[begin : path.index(row[1], begin) + 1]))
    return LineString(chart.points(row)).difference(driven.buffer(ON_LINE_M))


def disc(chart: Chart, zone: CircleZone, around_m: float) -> Point:
    return Point(chart.points([zone.centre])[0]).buffer(zone.radius_m + around_m)


@pytest.fixture(scope="module")
def trees(fields: Path) -> tuple[Mission, Situation]:
    fence = Known(read_fence(fields / "trees-fence.waypoints"), None, "file")
    parameters = read_parameters(fields / "trees-mower.parm")
    return read_mission(fields / "trees-rows.waypoints"), Situation(fence=fence, parameters=parameters)


@pytest.fixture(scope="module")
def repaired(trees: tuple[Mission, Situation]) -> Repair:
    """The survey, round the trees."""
    return repair_mission(*trees, Request())


def test_rows_of_a_survey_leave_their_lines_only_near_the_trees(trees, repaired):
    mission, situation = trees
    drawn = check_mission(mission, situation)
    found = repaired
    assert found.check.holds
    assert [item for item in found.mission.items if item in mission.items] == list(mission.items)
    chart = Chart(mission.home)
    circles = [zone for zone in situation.fence.value.zones if isinstance(zone, CircleZone)]
    # 2 m before and after what is nearer than asked
    near = union_all([disc(chart, zone, drawn.clearance_m + BAND_M + 2.0) for zone in circles])
    off_m = 0.0
    for leg in drawn.legs:
        off = off_line(chart, (leg.leg.start, leg.leg.end), found)
        assert off.difference(near).is_empty
        off_m += off.length
    rows_m = sum(leg.length_m for leg in drawn.broken)
    assert rows_m > 1000
    assert off_m < 0.12 * rows_m
    assert found.check.duration_s < 1.05 * drawn.duration_s


def test_a_repaired_survey_keeps_its_speed(repaired):
    assert all(item.command != Command.DO_CHANGE_SPEED for item in repaired.mission.items)


def test_rows_are_bent_where_the_vehicle_holds_no_more_items(trees, monkeypatch):
    mission, situation = trees
    most = len(mission.items) + 14  # home, and one waypoint for each row: too few to come back to its line
    monkeypatch.setattr("missions.editing.repair.most_own_items", lambda _situation: most - 1)
    found = repair_mission(mission, situation, Request())
    assert found.check.holds
    assert len(found.mission.items) < most
    assert [item for item in found.mission.items if item in mission.items] == list(mission.items)


FIELD = box(IN, -30, -60, 130, 60)
TREES = st.lists(
    st.tuples(st.floats(20, 80), st.floats(-4, 4), st.floats(0.3, 4)),
    min_size=1,
    max_size=3,
)


@settings(max_examples=25, deadline=None)
@given(trees=TREES)
def test_random_rows_among_random_trees(trees):
    chart = Chart(HOME)
    circles = [CircleZone(OUT, place(east_m, north_m), radius_m) for east_m, north_m, radius_m in trees]
    situation = situation_of(FIELD, *circles, **MOWER)
    row = (place(0, 0), place(100, 0))
    mission = Mission((waypoint(row[0]), waypoint(row[1])), HOME)
    asked = Request(start=place(-20, 0), clearance_m=1.0)
    try:
        found = repair_mission(mission, situation, asked)
    except RouteError:
        assume(False)
    assert found.check.holds
    line = LineString(chart.points(found.check.path))
    for zone in circles:
        assert line.distance(disc(chart, zone, 0.0)) >= 1.0
    # 8 m at most before and after, and what lies between two trees is as long again, or not kept
    near = union_all([disc(chart, zone, 1.0 + BAND_M + 12.0) for zone in circles])
    assert off_line(chart, row, found).difference(near).is_empty


def test_the_way_from_the_start_is_the_shortest():
    situation = situation_of(FIELD, CircleZone(OUT, place(50, 0), 3.0), **MOWER)
    mission = Mission((waypoint(place(100, 0)),), HOME)
    found = repair_mission(mission, situation, Request(start=place(0, 0), clearance_m=1.0))
    off = off_line(Chart(HOME), (place(0, 0), place(100, 0)), found)
    assert off.length > 60
