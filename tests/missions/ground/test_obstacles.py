"""Reported obstacles are exclusions for the planner, as large as they may be at their time, and unknown to the vehicle."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point

from missions.checking.fence_place import fence_place
from missions.checking.obstacle_ahead import obstacle_across, stands_after_s
from missions.errors import MissionError
from missions.fence import Fence, Obstacle, Obstacles, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import frame_around
from missions.ground.from_situation import ground_for
from missions.ground.obstacles import with_obstacles
from missions.planning.plan import plan
from missions.request import GoTo
from missions.situation import Known, Pose, Situation
from missions.vehicle import Vehicle

FRAME = frame_around([LatLon(40.07, -105.23)])
PARAMETERS = {"FENCE_ENABLE": 1.0, "WP_SPEED": 2.0, "AVOID_ENABLE": 3.0}


def at(east_m, north_m):
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


FIELD = Fence((PolygonZone(ZoneKind.INCLUSION, (at(-60, -40), at(60, -40), at(60, 40), at(-60, 40))),))


def obstacle(east_m, north_m, radius_m=1.0, growth_mps=0.0, seen_s=100.0):
    return Obstacle(at(east_m, north_m), radius_m, growth_mps, seen_s, 10.0, "OBSTACLE_DISTANCE", 90.0)


def situation(*obstacles, at_s=100.0, here=(-40, 0)):
    return Situation(
        ardupilot=True,
        fence=Known(FIELD, 0.0, ""),
        home=Known(at(-40, 0), 0.0, ""),
        pose=Known(Pose(at(*here), 90.0, (2.0, 0.0)), 100.0, ""),
        parameters=PARAMETERS,
        obstacles=Obstacles(obstacles, at_s),
    )


REQUEST = GoTo(target=at(40, 0), clearance_m=2.0)


def test_it_grows_until_it_is_forgotten_and_is_named_by_when_who_and_how_large():
    one = obstacle(0, 0, 0.8, growth_mps=0.5)
    assert one.radius_at(99.0) == 0.8
    assert one.radius_at(104.0) == pytest.approx(2.8)
    assert one.ends_s == 110.0
    assert one.name.startswith("obstacle reported at ")
    assert one.name.endswith(":01:30 by OBSTACLE_DISTANCE (radius 0.8 m)")
    known = Obstacles((one,), 102.0)
    assert known.radius_m(one) == pytest.approx(1.8)
    assert known.later(2.0, 0.5).radius_m(one) == pytest.approx(3.3)


@given(st.floats(-55, 55), st.floats(-35, 35), st.floats(0.3, 12.0))
@settings(max_examples=50)
def test_the_ground_leaves_it_out_whole_and_little_more(east_m, north_m, radius_m):
    one = obstacle(east_m, north_m, radius_m)
    ground = with_obstacles(ground_for(situation(), Vehicle(), ()), Obstacles((one,), 100.0))
    circle = Point(ground.frame.to_local(one.position)).buffer(radius_m, 64)
    assert ground.allowed.intersection(circle).area < 1e-6
    assert ground.enforced.allowed.difference(ground.allowed).area < circle.area * 1.04
    assert ground.barriers[-1].name == one.name
    assert ground.avoided_edge.equals(ground.enforced.edge)


def test_a_route_goes_round_it_says_so_and_keeps_what_was_asked():
    one = obstacle(0, 0, 2.0)
    found = plan(situation(one), REQUEST)
    line = LineString(found.ground.frame.to_local_array(found.path))
    assert line.distance(Point(found.ground.frame.to_local(one.position))) - 2.0 >= 2.0
    assert found.ground.obstacles.known == (one,)
    assert any(one.name in text and "protects no person" in text for text in found.info)
    assert found.fence == FIELD  # what a file and the autopilot get
    assert plan(situation(), REQUEST).ground.obstacles.known == ()


def test_none_round_it_is_said_with_its_name():
    wall = [obstacle(0, north_m, 4.0) for north_m in range(-40, 41, 6)]
    with pytest.raises(MissionError, match="obstacle reported at"):
        plan(situation(*wall), REQUEST)


def test_the_vehicles_own_avoidance_is_not_foreseen_to_see_it():
    # 2.6 m beside the route: a fence there makes the rover slower, an obstacle does not
    beside = plan(situation(obstacle(0, 5.0, 2.4)), REQUEST)
    free = plan(situation(), REQUEST)
    assert beside.duration_s == pytest.approx(free.duration_s, rel=0.01)


def test_a_breach_is_told_by_the_fence_not_by_an_obstacle():
    place = fence_place(situation(obstacle(-40, 5, 1.0)), REQUEST, at(-40, 0))
    assert place.fence == "inclusion polygon 1"


# Across a route


@pytest.fixture(scope="module")
def straight():
    return plan(situation(), REQUEST)


@given(st.floats(-35, 55), st.floats(-35, 35), st.floats(0.3, 6.0), st.floats(0, 2), st.floats(-38, 38))
@settings(max_examples=150)
def test_it_is_across_where_the_rest_of_the_route_does_not_keep_off_it(
    straight, east_m, north_m, radius_m, growth_mps, here_m
):
    one = obstacle(east_m, north_m, radius_m, growth_mps)
    known = situation(one, at_s=103.0, here=(here_m, 0))
    found = obstacle_across(straight, known, 1)
    to_local = straight.ground.frame.to_local
    middle, here = Point(to_local(one.position)), to_local(at(here_m, 0))
    kept_m = LineString([here, to_local(straight.path[-1])]).distance(middle) - radius_m - 3 * growth_mps
    here_kept_m = Point(here).distance(middle) - radius_m - 3 * growth_mps
    asked_m = min(straight.asked_m, max(here_kept_m, 0.1)) if here_kept_m > 0 else straight.asked_m
    if abs(kept_m - asked_m) > 0.03:
        assert (found is not None) == (kept_m < asked_m)
    if found is not None:
        assert found.obstacle == one
        assert not found.kept.holds
        assert found.kept.clearance_m == pytest.approx(max(0.0, kept_m), abs=1e-3)


def test_one_that_was_planned_round_is_across_only_once_it_leaves_its_circle():
    one = obstacle(0, 0, 1.0, growth_mps=0.5)
    wide = replace(situation(one), obstacles=Obstacles((one,), 100.0).later(3.0, 0.5))
    found = plan(wide, REQUEST)
    known = replace(situation(one), obstacles=Obstacles((one,), 102.0))
    assert obstacle_across(found, known, 1) is None
    moved = replace(one, position=at(0, 2.0), seen_s=102.0)
    north = found.ground.frame.to_local_array(found.path)[:, 1].max() > 2.0
    towards = replace(moved, position=at(0, 2.5 if north else -2.5))
    known = replace(known, obstacles=Obstacles((towards,), 105.0))
    assert obstacle_across(found, known, 1) is not None


def test_none_is_across_without_any_and_the_plans_start_stands_for_an_unknown_place(straight):
    assert obstacle_across(straight, situation(), 1) is None
    known = replace(situation(obstacle(0, 0)), pose=None)
    assert obstacle_across(straight, known, 1) is not None


def test_standing_takes_as_long_as_rolling_out():
    assert stands_after_s(situation(), REQUEST) == pytest.approx(0.5 + 2 * 4.07 / 2.0, abs=0.05)
    broken = replace(
        situation(), parameters={**PARAMETERS, "WP_SPEED": -1.0, "ATC_ACCEL_MAX": -5.0, "FRAME_CLASS": 7.5}
    )
    assert stands_after_s(broken, REQUEST) > 0
