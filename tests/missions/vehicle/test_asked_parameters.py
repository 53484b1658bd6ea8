"""What a vehicle is asked for."""

from __future__ import annotations

from mavlink_bridge.simulator.parameters import DEFAULTS
from missions.vehicle.asked_parameters import ASKED_NAMES, CHECKED_NAMES


def test_the_bridge_asks_for_nothing_that_a_plain_rover_lacks():
    assert set(ASKED_NAMES) <= set(DEFAULTS)  # a missing name holds up each learning of a vehicle by 0.7 s


def test_a_check_asks_for_more_and_nothing_twice():
    assert set(ASKED_NAMES) < set(CHECKED_NAMES)
    assert len(set(CHECKED_NAMES)) == len(CHECKED_NAMES)
