"""What cannot be put on the wire is refused before anything is sent, with the item and the field."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.sendable import check_items, check_parameters
from mavlink_bridge.protocol.wire import item_to_message
from missions.errors import MissionFormatError
from missions.items import MissionItem

MISSION = MissionType.MISSION
NUMBERS = st.one_of(
    st.floats(), st.sampled_from([0.0, 1e39, -1e39, 3.4028234663852886e38, 3.4028235677973366e38, 2.0**128])
)
ITEMS = st.builds(
    MissionItem,
    command=st.sampled_from([0, 16, 65535, 65536, -1]),
    frame=st.sampled_from([0, 3, 255, 256, -1]),
    params=st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS),
    lat_e7=st.sampled_from([0, 2**31 - 1, 2**31, -(2**31), -(2**31) - 1]),
    lon_e7=st.sampled_from([0, 2**31 - 1, 2**31, -(2**31), -(2**31) - 1]),
    alt_m=NUMBERS,
)


@given(ITEMS)
def test_what_passes_can_be_encoded_and_what_cannot_does_not_pass(item):
    try:
        check_items([item], MISSION, allow_infinite=True)
    except MissionFormatError:
        with pytest.raises((struct.error, OverflowError)):
            Codec(245, 190).encode(item_to_message(item, 0, PEER, MISSION))
    else:
        Codec(245, 190).encode(item_to_message(item, 0, PEER, MISSION))


@pytest.mark.parametrize(
    ("item", "field"),
    [
        (MissionItem(16, params=(1e39, 0.0, 0.0, 0.0)), "param1"),
        (MissionItem(16, params=(0.0, math.nan, 0.0, -math.inf)), "param4"),
        (MissionItem(16, params=(0.0, math.nan, 0.0, 0.0), alt_m=math.inf), "z"),
        (MissionItem(16, alt_m=-1e39), "z"),
        (MissionItem(65536), "command"),
        (MissionItem(16, 300), "frame"),
        (MissionItem(178, lat_e7=4_000_000_000), "x"),
        (MissionItem(178, lon_e7=-4_000_000_000), "y"),
    ],
)
def test_the_item_and_the_field_are_named(item, field):
    with pytest.raises(MissionFormatError, match=rf"mission item 2: {field} is .*nothing was sent") as caught:
        check_items([*plain_mission(2), item], MISSION)
    assert (caught.value.details["item"], caught.value.details["field"]) == (2, field)


def test_numbers_that_are_none_pass_and_what_a_vehicle_held_is_put_back():
    check_items([MissionItem(16, params=(math.nan,) * 4, alt_m=math.nan)], MISSION)
    check_items([MissionItem(16, alt_m=math.inf)], MISSION, allow_infinite=True)


def test_a_list_longer_than_mavlink_counts():
    with pytest.raises(MissionFormatError, match=r"65536 rally items are too many: MAVLink counts to 65535"):
        check_items([MissionItem(5100)] * 65536, MissionType.RALLY)


@pytest.mark.parametrize(
    "parameters",
    [
        {"WP_SPEED": 1e39},
        {"WP_SPEED": math.inf},
        {"WP_SPEED": math.nan},
        {"A" * 17: 1.0},
        {"É": 1.0},
        {"": 1.0},
    ],
)
def test_parameters(parameters):
    with pytest.raises(MissionFormatError, match="nothing was sent"):
        check_parameters({"WP_RADIUS": 2.0, **parameters})
    check_parameters({"A" * 16: -3.4e38})
