"""Straight legs through gaps."""

from __future__ import annotations

import math

import pytest
import shapely
from charts import HOME

from missions import read_fence
from missions.fitting.gap import find_gap, straight_through
from missions.fitting.polyline import DrawnPoint
from missions.geo import LatLon, LocalPoint
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import Known, Pose, Situation

WALL = shapely.LineString([(0, -30), (0, 30)])
CORNER = shapely.LineString([(20, -5), (5, 0), (20, 5)])
NARROW = shapely.union_all([WALL, CORNER])

DIJKSTRA_MAZE_S = 58.4
"""Measured: the maze driven by ArduPilot Rover's own planner (OA_TYPE 2) at 5 m/s, WP_RADIUS 3; it came as near as 1.43 m."""


def points(*places):
    ends = (0, len(places) - 1)
    return tuple(
        DrawnPoint(LocalPoint(*place), 2.0, 2.0, is_fixed=i in ends) for i, place in enumerate(places)
    )


@pytest.mark.parametrize("ahead", [(0.0, 1.0), (0.6, 0.8), (0.0, -1.0)])
def test_the_gap_lies_where_the_fences_are_nearest(ahead):
    gap = find_gap(NARROW, (2.0, 1.0), ahead)
    assert gap.middle == pytest.approx((2.5, 0.0))
    assert gap.through == pytest.approx((0.0, math.copysign(1.0, ahead[1])))


@pytest.mark.parametrize("edge", [WALL, CORNER, shapely.Polygon(), shapely.LineString([(-9, 0), (9, 0)])])
def test_a_leg_with_room_on_one_side_or_across_a_fence_has_no_gap(edge):
    assert find_gap(edge, (2.0, 0.0), (0.0, 1.0)) is None


def test_corners_in_the_neck_give_way_to_a_straight_leg_and_others_stay():
    drawing = points((-20, -40), (2, -6), (2.4, 0), (3, 7), (30, 40))
    gap = find_gap(NARROW, (2.4, 0), (0.0, 1.0))
    for lines in straight_through(drawing, 2, gap):
        assert len(lines) == 4
        assert (lines[0], lines[-1]) == (drawing[0], drawing[-1])
        leg = shapely.LineString([lines[1].place, lines[2].place])
        assert leg.distance(WALL) == pytest.approx(2.5)
        assert leg.distance(CORNER) == pytest.approx(2.5)


def test_a_target_in_the_neck_stays_the_target():
    drawing = points((-20, -40), (2, -6), (2.4, 0))
    gap = find_gap(NARROW, (2.4, 0), (0.0, 1.0))
    assert all(lines[-1] == drawing[-1] for lines in straight_through(drawing, 2, gap))


@pytest.mark.parametrize("heading_deg", [0.0, 90.0])
def test_the_gate_of_the_maze_is_driven_at_full_speed(fields, heading_deg):
    fence = read_fence(fields / "maze-fence.waypoints")
    situation = Situation(
        fence=Known(fence, None, "test"),
        pose=Known(Pose(HOME, heading_deg), None, "test"),
        home=Known(HOME, None, "test"),
        parameters={
            "WP_SPEED": 5.0,
            "WP_RADIUS": 3.0,
            "FENCE_ENABLE": 1.0,
            "FENCE_TYPE": 4.0,
            "AVOID_ENABLE": 3.0,
        },
    )
    target = LatLon(40.0726316, -105.2290497)
    planned = plan(situation, Request(targets=(target,), clearance_m=2.0))
    assert planned.driven_clearance_m >= 2.0
    assert planned.duration_s < 0.85 * DIJKSTRA_MAZE_S
    assert not any(planned.speeds)
