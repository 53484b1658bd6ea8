"""Stops as they are seen from positions: what counts, and what does not."""

from __future__ import annotations

import math

import pytest

from missions.geo import LatLon
from missions.stops import Stop, Stops

HERE = LatLon(40.0, -105.0)
M_PER_DEG = 111_034.6  # of latitude at 40°: (1 - e²) a / (1 - e² sin²)^1.5, from the ellipsoid by hand


def north(metres: float) -> LatLon:
    return LatLon(HERE.lat_deg + metres / M_PER_DEG, HERE.lon_deg)


def damped(speed_mps: float, until_s: float, stops: Stops | None = None, tau_s: float = 2.0) -> Stops:
    """Let a rover roll whose speed falls evenly with its way, as ArduPilot's does; a position each 0.25 s."""
    stops = (stops or Stops()).begun(10.0)
    for step in range(int(until_s / 0.25) + 1):
        left = math.exp(-0.25 * step / tau_s)
        stops = stops.moved(north(speed_mps * tau_s * (1 - left)), speed_mps * left, 10.0 + 0.25 * step)
    return stops


@pytest.mark.parametrize("speed_mps", [0.6, 2.0, 5.0])
def test_a_stop_is_measured_to_its_end_which_a_standing_position_does_not_show(speed_mps):
    [stop] = damped(speed_mps, 20.0).own
    assert stop.speed_mps == pytest.approx(speed_mps)
    assert stop.distance_m == pytest.approx(2.0 * speed_mps, rel=0.01)  # v τ, by integrating


def test_a_stop_that_another_mode_ends_early_counts_where_it_nearly_stood():
    nearly = damped(2.0, 4.0)  # 2 e^-2 = 0.27 m/s
    assert not nearly.own
    [stop] = nearly.ended().own
    assert stop.distance_m == pytest.approx(4.0, rel=0.01)
    assert not damped(2.0, 2.0).ended().own  # 0.74 m/s


def test_who_drives_is_no_stop():
    rolling = damped(2.0, 1.0)
    assert rolling.rolling is not None
    driven = rolling.moved(north(4.0), 1.9, 11.5)  # it was 1.2 m/s
    assert driven.rolling is None
    assert not driven.moved(north(5.0), 0.0, 12.0).own


def test_a_fix_that_jumps_is_no_stop():
    begun = Stops().begun(0.0).moved(HERE, 2.0, 0.0)
    assert not begun.moved(north(9.0), 0.1, 2.0).own  # 2 m/s for 2 s are 4 m
    assert begun.moved(north(4.5), 0.1, 2.0).own


def test_slow_ones_and_endless_ones_are_not_counted():
    assert not damped(0.4, 10.0).own
    begun = Stops().begun(0.0).moved(HERE, 2.0, 0.0)
    assert not begun.moved(north(50.0), 0.1, 61.0).own


def test_the_longest_of_each_class_of_speeds_is_kept():
    stops = damped(2.1, 20.0, tau_s=2.0)
    stops = damped(2.1, 20.0, stops, tau_s=1.0)
    stops = damped(1.1, 20.0, stops, tau_s=1.0)
    stops = damped(2.3, 20.0, stops, tau_s=3.0)
    assert [round(stop.distance_m, 1) for stop in stops.own] == [1.1, 6.9]


def test_what_was_given_stays():
    given = (Stop(3.0, 8.0),)
    assert damped(2.0, 20.0, Stops(given=given)).given == given
