"""The simulated distance sensor sees what stands and moves in the field, by geometry of the tests' own."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator import MovingDisc, SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.sensor import SECTORS, distances_cm, obstacle_distance
from missions.geo import LatLon, destination, distance_m

HOME = LatLon(40.071374, -105.229930)


@given(
    st.lists(st.tuples(st.complex_numbers(max_magnitude=25, allow_nan=False), st.floats(0.1, 3)), max_size=4),
    st.floats(-7, 7),
)
@settings(max_examples=60)
def test_each_sector_tells_of_the_nearest_disc_in_it(discs, heading):
    found = distances_cm(discs, 0j, heading, 15.0)
    shapes = [Point(centre.real, centre.imag).buffer(radius, 64) for centre, radius in discs]
    for sector in range(0, SECTORS, 5):
        middle = heading + math.radians(5 * sector)
        edges = [cmath.rect(16.0, middle + math.radians(turn)) for turn in (-2.5, 0, 2.5)]
        wedge = Polygon([(0, 0), *((edge.real, edge.imag) for edge in edges)])
        seen = [
            shape.intersection(wedge).distance(Point(0, 0)) for shape in shapes if shape.intersects(wedge)
        ]
        ray = LineString([(0, 0), (edges[1].real, edges[1].imag)])
        straight = [
            shape.intersection(ray).distance(Point(0, 0)) for shape in shapes if shape.intersects(ray)
        ]
        told_m = found[sector] / 100
        assert told_m >= min([*seen, 15.0]) - 0.03  # nothing nearer than there is
        assert told_m <= max(0.2, min([*straight, 15.01])) + 0.03  # and what is straight ahead is seen


def test_the_message_is_as_ardupilot_takes_it():
    message = obstacle_distance((1501,) * SECTORS, 2.5, 15.0)
    assert (message.increment, message.frame, message.angle_offset) == (5, 12, 0.0)
    assert (message.min_distance, message.max_distance, message.time_usec) == (20, 1500, 2_500_000)


def received(vehicle, until_s):
    vehicle.handle_timer(until_s)
    return vehicle.messages_to_send()


def test_a_disc_moves_appears_in_its_time_and_is_told_ten_times_a_second():
    ahead = destination(HOME, 10.0, 90.0)
    disc = MovingDisc(ahead, 1.0, 2.0, 270.0, from_s=2.0)
    vehicle = SimulatedVehicle(SimulatorConfig(home=HOME, heading_deg=90.0, discs=(disc,), sensor_m=15.0))
    seen = [one for one in received(vehicle, 1.9) if isinstance(one, m.ObstacleDistance)]
    assert len(seen) == pytest.approx(20, abs=1)
    assert min(seen[-1].distances) == 1501
    seen = [one for one in received(vehicle, 4.0) if isinstance(one, m.ObstacleDistance)]
    assert seen[-1].distances[0] == pytest.approx(100 * (distance_m(HOME, ahead) - 1.0 - 2.0 * 2.0), abs=25)
    assert any(isinstance(one, m.Attitude) for one in received(vehicle, 4.2))


def test_without_a_sensor_nothing_of_it_is_sent():
    vehicle = SimulatedVehicle(SimulatorConfig(home=HOME, discs=(MovingDisc(HOME, 1.0),)))
    assert not any(isinstance(one, m.ObstacleDistance | m.Attitude) for one in received(vehicle, 3.0))
