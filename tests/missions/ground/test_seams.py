"""Routes across the seams of a union: refused while the vehicle's avoidance or path planning stops it there."""

from __future__ import annotations

import pytest
import shapely
from charts import HOME, IN, OUT, Chart, box, place, situation_of
from shapely import LineString, Polygon

from missions.checking.check import check_mission
from missions.editing.repair import repair_mission
from missions.errors import NoRouteError, TargetBlockedError
from missions.fence import CircleZone, Fence
from missions.ground.merged_fence import merged_fence
from missions.items import waypoint
from missions.planning.plan import plan
from missions.request import GoTo, Request, Tour
from missions.situation import Mission

UNION = {
    "FENCE_ENABLE": 1.0,
    "FENCE_TYPE": 4.0,
    "FENCE_OPTIONS": 2.0,
    "FENCE_MARGIN": 2.0,
    "AVOID_ENABLE": 3.0,
}
MERGE = "merge the inclusions into one polygon (`pbpp fence merge FILE -o merged.plan`, then `pbpp upload merged.plan`), or "
COST = (
    " (then nothing brakes it before the fence: in tests it drove 4 m beyond at 2 m/s, 10 to 15 m at 5 m/s)"
)
WEST, EAST = box(IN, -100, -40, 10, 40), box(IN, -20, -40, 100, 40)
START, TARGET = (-80.0, 0.0), (80.0, 0.0)


def route(zones, *, start=START, target=TARGET, clearance_m=2.5, **parameters):
    situation = situation_of(*zones, **{**UNION, **parameters})
    return plan(situation, Request(place(*start), (place(*target),), clearance_m))


def check(zones, *points, **parameters):
    mission = Mission(tuple(waypoint(place(*point)) for point in points[1:]), place(*points[0]))
    return check_mission(
        mission, situation_of(*zones, **{**UNION, **parameters}), Request(place(*points[0]), clearance_m=2.5)
    )


@pytest.mark.parametrize(
    "zones",
    [
        (WEST, EAST),
        (box(IN, -100, -40, 10, 40), box(IN, 10, -40, 100, 40)),
        (WEST, CircleZone(IN, place(60, 0), 80.0)),
    ],
    ids=["overlap", "a common edge", "a circle"],
)
def test_no_route_crosses_a_seam(zones) -> None:
    with pytest.raises(
        NoRouteError,
        match=r"the inner edge of .*: with AVOID_ENABLE 3 \(bit 0\) the vehicle stops FENCE_MARGIN 2 m before the edge",
    ) as caught:
        route(zones)
    assert caught.value.details["advice"] == f"{MERGE}set AVOID_ENABLE 2 (without bit 0){COST}"


@pytest.mark.parametrize(
    "parameters",
    [
        {"AVOID_ENABLE": 2},
        {"AVOID_ENABLE": 0},
        {"FENCE_ENABLE": 0},
        {"FENCE_TYPE": 2, "FENCE_RADIUS": 0},
        {"FENCE_MARGIN": 0.05},
        {"FENCE_MARGIN_XY": 0.05},
    ],
    ids=str,
)
def test_where_measured_rovers_pass_a_route_crosses_it(parameters) -> None:
    found = route((WEST, EAST), **parameters)
    chart = Chart(HOME)
    # By shapely's overlay, not by the code under test: the route leaves the western polygon on its way.
    west = Polygon(chart.points(WEST.vertices))
    assert chart.line(found.path).crosses(west.boundary)


@pytest.mark.parametrize(
    ("parameters", "advice"),
    [
        ({"OA_TYPE": 2, "AVOID_ENABLE": 0}, "set OA_TYPE 0"),
        ({"OA_TYPE": 1}, "set AVOID_ENABLE 2 (without bit 0) and OA_TYPE 0{COST}"),
    ],
)
def test_path_planning_does_not_cross_it_either(parameters, advice) -> None:
    with pytest.raises(NoRouteError, match="does not cross from one inclusion into another") as caught:
        route((WEST, EAST), **parameters)
    assert caught.value.details["advice"] == MERGE + advice.format(COST=COST)


def test_a_route_within_one_inclusion_is_found_where_the_shorter_one_crosses_a_seam() -> None:
    """A large field with a barn in it, and a strip that would shorten the way round the barn."""
    field, strip = box(IN, -100, -40, 100, 40), box(IN, -20, -60, 20, 10)
    barn = box(OUT, -15, -35, 15, 38)
    found = route((field, strip, barn), AVOID_ENABLE=0)
    chart = Chart(HOME)
    assert chart.line(found.path).crosses(Polygon(chart.points(strip.vertices)).boundary)
    with pytest.raises(
        NoRouteError,
        match=r"no route keeps 2\.5 m while driving; the widest keeps 0\.\d\d m \(1\.00 m along straight legs\)",
    ):  # the barn leaves 2 m in the north: only the strip leads round it
        route((field, strip, barn))
    inside = box(IN, 40, 20, 60, 38)
    around = route((field, inside), start=(-80, 30), target=(80, 30), clearance_m=2.5)
    line, hole = chart.line(around.path), Polygon(chart.points(inside.vertices))
    assert not line.crosses(hole.boundary)
    assert line.distance(hole) >= 2.5
    straight = route((field, inside), start=(-80, 30), target=(80, 30), clearance_m=2.5, AVOID_ENABLE=0)
    assert chart.line(straight.path).crosses(hole.boundary)


def test_a_target_before_a_seam_says_what_would_do() -> None:
    with pytest.raises(TargetBlockedError, match="the inner edge of inclusion polygon 1") as caught:
        route((WEST, EAST), start=(50, 0), target=(11, 0))
    assert caught.value.details["advice"] == f"{MERGE}set AVOID_ENABLE 2 (without bit 0){COST}"


def test_a_check_names_the_seam_and_where_the_vehicle_stops() -> None:
    found = check((WEST, EAST), START, (-50, 0), (50, 0), (80, 0))
    assert [leg.breaks for leg in found.legs] == [False, True, False]
    assert not found.holds
    (broken,) = found.broken
    chart = Chart(HOME)
    # The eastern polygon's own edge counts as soon as the rover is in it.
    east = Polygon(chart.points(EAST.vertices))
    first = LineString(chart.points([place(-50, 0), place(50, 0)])).intersection(east).coords
    first = shapely.Point(first[0])
    assert broken.crosses == ("the inner edge of inclusion polygon 2",)
    assert chart.points([broken.at])[0] == pytest.approx((first.x, first.y), abs=0.05)
    assert broken.driven_clearance_m == 0.0
    assert any(
        "does not resume, although FENCE_OPTIONS bit 1" in warning and "set AVOID_ENABLE 2" in warning
        for warning in found.warnings
    )


def test_a_check_of_a_drive_that_leaves_its_polygon_stops_the_margin_before_its_edge() -> None:
    corner = box(IN, 8, -60, 100, 60)
    found = check((WEST, corner), START, (40, 0))
    assert found.legs[0].crosses == ("the inner edge of inclusion polygon 1",)
    east_m = Chart(HOME).points([found.legs[0].at])[0][0]
    assert east_m == pytest.approx(8.0, abs=0.05)


@pytest.mark.parametrize("parameters", [{"AVOID_ENABLE": 0}, {"FENCE_MARGIN": 0.05}, {"FENCE_ENABLE": 0}])
def test_a_check_passes_where_measured_rovers_pass(parameters) -> None:
    assert check((WEST, EAST), START, (-50, 0), (50, 0), (80, 0), **parameters).holds


def test_a_leg_beside_another_inclusion_but_outside_it_is_not_stopped() -> None:
    """Only the edges of inclusions that the rover is in are walls to it."""
    inside = box(IN, -20, -30, 20, 0)
    assert check((WEST, EAST, inside), START, (-30, 1.0)).holds
    assert check((box(IN, -100, -40, 100, 40), inside), START, (80, 1.0)).holds
    assert not check((box(IN, -100, -40, 100, 40), inside), START, (80, -1.0)).holds


def test_a_repair_leads_round_the_seam_or_says_that_nothing_does() -> None:
    field, inside = box(IN, -100, -40, 100, 40), box(IN, -20, -20, 20, 20)
    mission = Mission((waypoint(place(80, 0)),), place(-80, 0))
    request = Request(place(-80, 0), clearance_m=2.5)
    repaired = repair_mission(mission, situation_of(field, inside, **UNION), request)
    chart = Chart(HOME)
    line = chart.line((place(-80, 0), *(item.position for item in repaired.mission.items if item.is_placed)))
    assert line.distance(Polygon(chart.points(inside.vertices))) >= 2.0
    with pytest.raises(NoRouteError, match="the inner edge of"):
        repair_mission(mission, situation_of(WEST, EAST, **UNION), request)


def test_no_tour_and_no_widest_route_crosses_a_seam() -> None:
    situation = situation_of(WEST, EAST, **UNION)
    targets = (place(-40, 0), place(*TARGET))
    for request in (
        Tour(start=place(*START), targets=targets, clearance_m=2.5),
        GoTo(start=place(*START), target=targets[1], widest=True),
    ):
        with pytest.raises(NoRouteError, match="the inner edge of inclusion polygon") as caught:
            plan(situation, request)
        assert "`pbpp fence merge FILE -o merged.plan`" in caught.value.details["advice"]


def test_a_merged_fence_is_crossed_with_avoidance_on() -> None:
    merged = merged_fence(Fence((WEST, EAST)))
    found = route(merged.zones)
    assert Chart(HOME).line(found.path).length == pytest.approx(160.0, abs=1.0)
    assert not [warning for warning in found.warnings if "inner edge" in warning]
