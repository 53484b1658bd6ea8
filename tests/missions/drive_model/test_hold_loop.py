"""The loop of a PX4 HOLD: what it needs, and where on a way it leaves the fence."""

from __future__ import annotations

import numpy as np
import pytest
from drive_model.test_pursuit import rover
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon, box

from missions.drive_model import envelope
from missions.drive_model.hold_loop import LOOPED, HoldLoop, ending_of
from missions.drive_model.stopping import Motion, Stopping, motion
from missions.stops import Stop, Stops
from missions.vehicle import Steering, Vehicle


def at(place=(0.0, 0.0), way=(0.0, 1.0), speed_mps=3.0):
    return Motion(np.array([place]), np.array([speed_mps]), np.array([way]))


def test_the_measured_loops_lie_within():
    loop = HoldLoop()
    for speed_mps, ahead_m in ((3.0, 2.3), (2.0, 1.9), (3.2, 2.3), (2.2, 1.9)):
        assert loop.distance_m(speed_mps) >= ahead_m
    assert loop.distance_m(1.0) == 1.9
    assert loop.distance_m(6.0) == pytest.approx(4 * 2.3)
    assert (loop.aside_m(1.0), loop.aside_m(3.0), loop.aside_m(6.0)) == pytest.approx((2.1, 2.1, 8.4))
    assert loop.source(3.0) == LOOPED


def test_which_vehicle_loops():
    assert isinstance(ending_of(rover(), Stops()), HoldLoop)
    assert isinstance(ending_of(Vehicle(), Stops()), Stopping)
    assert isinstance(ending_of(rover(CA_AIRFRAME=6), Stops()), Stopping)


def test_longer_stops_that_are_known_count():
    longer = ending_of(rover(), Stops(given=(Stop(3.0, 9.0),)))
    assert longer.distance_m(3.0) == 9.0
    assert longer.source(3.0) == "from --stopping"
    shorter = ending_of(rover(), Stops(given=(Stop(3.0, 0.5),)))
    assert shorter.distance_m(3.0) == pytest.approx(2.3)
    assert shorter.source(3.0) == LOOPED


@given(st.floats(1.0, 3.0), st.floats(0.0, 360.0), st.floats(0.0, 3.5))
def test_it_leaves_where_the_fence_is_nearer_than_the_loop_ahead(speed_mps, bearing_deg, to_wall_m):
    way = np.array([np.sin(np.radians(bearing_deg)), np.cos(np.radians(bearing_deg))])
    right = np.array([way[1], -way[0]])
    corners = [
        way * to_wall_m + right * 50,
        way * to_wall_m - right * 50,
        -way * 50 - right * 50,
        -way * 50 + right * 50,
    ]
    leaving = HoldLoop().leaves(at(way=tuple(way), speed_mps=speed_mps), Polygon(corners))
    deep_m = HoldLoop().distance_m(speed_mps) - to_wall_m
    if deep_m > 0.01:
        assert leaving.beyond_m[0] == pytest.approx(deep_m, abs=1e-3)
        assert leaving.reach_m[0] >= leaving.beyond_m[0]
    elif deep_m < -0.01:
        assert np.isneginf(leaving.beyond_m[0])


def test_it_leaves_to_a_side_too():
    corridor = box(-1.5, -50, 50, 50)
    leaving = HoldLoop().leaves(at(), corridor)
    assert leaving.beyond_m[0] == pytest.approx(0.6)
    assert leaving.ends is not None
    assert leaving.ends[0][0] == pytest.approx(-2.1)


def test_the_way_is_followed_at_cruise():
    points = [(0, 0), (0, 20), (15, 20)]
    vehicle = rover()
    moving = motion(envelope(points, vehicle, heading_deg=0.0), vehicle)
    assert moving is not None
    line = LineString(points)
    assert max(line.distance(Point(place)) for place in moving.places) < 1e-9
    assert moving.speeds_mps.min() == moving.speeds_mps.max() == 3.0
    assert np.hypot(*moving.ways.T) == pytest.approx(1.0)
    assert vehicle.steering is Steering.ACKERMANN
