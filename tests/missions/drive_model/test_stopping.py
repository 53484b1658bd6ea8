"""How far a rover rolls on, and which HOLD on a drive ends beyond a fence: against the measured rows, and against sums by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Point, box

from missions.drive_model import envelope
from missions.drive_model.stopping import MEASURED, SIMULATED, Motion, Stopping, motion, roll_out_m
from missions.stops import Stop, Stops
from missions.vehicle import FenceParameters, Steering, Vehicle

ROWS = {
    Steering.ACKERMANN: [(1, 1.97), (2, 4.05), (3, 6.17), (5, 10.6), (8, 17.6)],
    Steering.SKID: [(1, 0.41), (2, 1.08), (3, 1.99), (4, 3.17)],
}
"""As they were measured from HOLD, set speed and distance."""

speeds = st.floats(0.05, 20.0)
some_stops = st.lists(st.builds(Stop, st.floats(0.5, 8.0), st.floats(0.1, 40.0)), max_size=4).map(tuple)


@pytest.mark.parametrize("steering", Steering)
def test_what_is_not_known_of_the_vehicle_is_as_the_measured_rows(steering):
    stopping = Stopping(Stops(), steering)
    for speed_mps, distance_m in ROWS[steering]:
        assert stopping.distance_m(speed_mps) == pytest.approx(distance_m, abs=0.08)
        assert stopping.source(speed_mps) == SIMULATED
    top_mps, top_m = MEASURED[steering][-1]
    assert stopping.distance_m(2 * top_mps) == pytest.approx(4 * top_m)  # beyond the rows with the square


def test_own_and_given_stops_count_before_the_rows_as_far_as_they_tell():
    stopping = Stopping(Stops(own=(Stop(2.0, 3.0),)), Steering.ACKERMANN)
    assert stopping.distance_m(1.0) == pytest.approx(1.5)
    assert stopping.distance_m(3.0) == pytest.approx(6.75)  # × 1.5²
    assert stopping.source(4.0) == "from its own stops"
    assert stopping.distance_m(4.0) == pytest.approx(12.0)
    assert stopping.source(4.1) == SIMULATED
    assert stopping.distance_m(4.1) == pytest.approx(12.0)  # the row, 8.7 m, is less than it rolls from 4 m/s
    assert stopping.distance_m(8.0) == pytest.approx(17.6, abs=0.08)
    both = Stopping(Stops(given=(Stop(2.0, 5.0),), own=(Stop(2.1, 3.0),)), Steering.ACKERMANN)
    assert both.distance_m(2.1) == pytest.approx(
        5.0
    )  # the owner's word counts where the vehicle was seen to do better once
    assert both.source(2.0) == "from --stopping and its own stops"


@given(some_stops, some_stops, st.sampled_from(Steering), speeds, speeds)
def test_faster_never_rolls_less_far(own, told, steering, one_mps, other_mps):
    stopping = Stopping(Stops(told, own), steering)
    slow_m, fast_m = (stopping.distance_m(speed) for speed in sorted((one_mps, other_mps)))
    assert 0 < slow_m <= fast_m + 1e-9


@given(some_stops.filter(bool), st.sampled_from(Steering))
def test_no_stop_that_was_seen_is_told_shorter(own, steering):
    stopping = Stopping(Stops(own=own), steering)
    for stop in own:
        assert stopping.distance_m(stop.speed_mps) >= stop.distance_m - 1e-9


def test_a_drive_straight_at_a_wall_by_hand():
    vehicle = Vehicle(speed_mps=3.0, fence=FenceParameters(avoid_bits=0))
    band = envelope([(0.0, 0.0), (0.0, 60.0)], vehicle, heading_deg=0.0)
    moving = motion(band, vehicle)
    assert moving.speeds_mps.max() == pytest.approx(3.0, abs=1e-6)
    assert np.allclose(moving.ways, (0.0, 1.0))
    # From 3 m/s it slows down over v²/2a + v a/2j = 6 m: until 54 m it is at 3 m/s.
    at_full = moving.places[moving.speeds_mps > 2.999][:, 1]
    assert at_full.max() == pytest.approx(54.0, abs=1.0)
    allowed = box(-50.0, -50.0, 50.0, 58.0)
    rolls_m = np.full(len(moving.places), 10.0)
    out_m = roll_out_m(moving, rolls_m, allowed)
    expected_m = 58.0 - moving.places[:, 1]
    assert np.allclose(out_m, np.where(expected_m < 10.0, np.maximum(expected_m, 0.0), np.inf))


def test_avoidance_slows_a_vehicle_before_the_fence_that_it_sees():
    vehicle = Vehicle(
        speed_mps=3.0, fence=FenceParameters(enabled=True, type_bits=4, margin_m=2.0, avoid_bits=3)
    )
    band = envelope([(0.0, 0.0), (0.0, 60.0)], vehicle, heading_deg=0.0)
    wall = box(-50.0, -50.0, 50.0, 63.0).boundary
    slowed = motion(band, vehicle, wall)
    near = slowed.places[:, 1] > 50.0
    # AR_PosControl: the position gain (0.2 /s) times what is left to the margin.
    assert (slowed.speeds_mps[near] <= 0.2 * (63.0 - 2.0 - slowed.places[near][:, 1]) + 1e-9).all()
    assert motion(band, vehicle).speeds_mps[near].max() > slowed.speeds_mps[near].max() + 0.5


def test_the_first_way_out_counts_of_several():
    island = box(-100.0, -100.0, 100.0, 100.0).difference(box(-1.0, 5.0, 1.0, 6.0))
    moving = Motion(np.array([[0.0, 0.0]]), np.array([3.0]), np.array([[0.0, 1.0]]))
    assert roll_out_m(moving, np.array([200.0]), island)[0] == pytest.approx(5.0)
    assert math.isinf(roll_out_m(moving, np.array([4.9]), island)[0])
    assert roll_out_m(moving, np.array([3.0]), Point(50.0, 50.0).buffer(1.0))[0] == 0.0


def test_a_day_long_drive_and_a_standing_one_are_not_looked_at():
    vehicle = Vehicle(speed_mps=0.05)
    assert motion(envelope([(0.0, 0.0), (0.0, 9000.0)], vehicle), vehicle) is None
    assert motion(envelope([(0.0, 0.0)], vehicle), vehicle) is None
