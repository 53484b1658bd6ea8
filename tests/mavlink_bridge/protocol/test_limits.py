"""What fits on a vehicle; the simulator's storage is the second opinion."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from protocol.twin import plain_fence, plain_mission

from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.limits import Limits, fence_bytes
from mavlink_bridge.simulator import item_rules
from missions.items import MissionItem

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY


def circles(count):
    return [MissionItem(5004, 0, (5.0, 0, 0, 0))] * count


@given(st.lists(st.integers(3, 20), max_size=6), st.integers(0, 10), st.booleans())
def test_fence_bytes_are_the_vehicles(vertex_counts, circle_count, return_point):
    items = [item for count in vertex_counts for item in plain_fence(1, vertices=count)]
    items += circles(circle_count)
    items += [MissionItem(5000, 0)] * return_point
    assert fence_bytes(items) == item_rules.fence_bytes(items)


@pytest.mark.parametrize(
    ("items", "fits"),
    [
        (plain_fence(1, vertices=83), True),
        (plain_fence(1, vertices=84), False),
        (plain_fence(25, vertices=3), True),
        (plain_fence(26, vertices=3), False),
        (circles(51), True),
        (circles(52), False),
        ([], True),
    ],
)
def test_measured_fence_limits(items, fits):
    assert (Limits().problem(items, FENCE) is None) is fits


def test_mission_limits():
    assert Limits().problem(plain_mission(655), MISSION) is None
    assert Limits().problem(plain_mission(656), MISSION) == "656 mission items; the vehicle holds 655"
    assert Limits().problem([MissionItem(5100)] * 999, RALLY) is None


def test_limits_from_parameters():
    assert Limits.from_parameters({"WP_SPEED": 5.0}) == Limits()
    sd = Limits.from_parameters({"BRD_SD_MISSION": 64.0, "BRD_SD_FENCE": 64.0})
    assert (sd.mission_items, sd.fence_items, sd.fence_bytes) == (4368, 4096, 65536)
    assert sd.problem(plain_fence(30, vertices=4), FENCE) is None
