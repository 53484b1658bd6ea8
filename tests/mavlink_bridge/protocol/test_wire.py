"""Items on the wire and back, and who is listened to."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from protocol.twin import PEER

from mavlink_bridge.mavlink import messages
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Frame, Heartbeat, MissionAck, MissionResult, MissionType
from mavlink_bridge.protocol.wire import INT32_MAX, item_from_message, item_to_message, mission_result
from missions.items import MissionItem

FLOATS = st.floats(width=32, allow_nan=False)
ITEMS = st.builds(
    MissionItem,
    command=st.integers(0, 65535),
    frame=st.integers(0, 255),
    params=st.tuples(FLOATS, FLOATS, FLOATS, FLOATS),
    lat_e7=st.integers(-(2**31), 2**31 - 1),
    lon_e7=st.integers(-(2**31), 2**31 - 1),
    alt_m=FLOATS,
    current=st.booleans(),
    autocontinue=st.booleans(),
)


@given(ITEMS, st.integers(0, 65535), st.sampled_from([0, 1, 2]))
def test_an_item_comes_back_as_it_was(item, seq, mission_type):
    message = item_to_message(item, seq, PEER, MissionType(mission_type))
    [frame] = Codec(1, 1).decode(Codec(245, 190).encode(message))
    assert (frame.message.seq, frame.message.mission_type) == (seq, mission_type)
    assert item_from_message(frame.message) == item


def float_message(**fields):
    values = dict.fromkeys((one.name for one in dataclasses.fields(messages.MissionItem)), 0)
    return messages.MissionItem(**{**values, "command": 16, **fields})


def test_degrees_are_rounded_not_cut():
    item = item_from_message(float_message(x=40.07137399999, y=-105.22992999999))
    assert (item.lat_e7, item.lon_e7) == (400713740, -1052299300)


@pytest.mark.parametrize("command", [202, 203])
def test_some_commands_do_not_scale_x_and_y(command):
    assert item_from_message(float_message(command=command, x=7.0, y=9.0)).lat_e7 == 7


def test_the_mission_frame_does_not_scale():
    assert item_from_message(float_message(frame=2, x=7.0)).lat_e7 == 7


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf, 400.0, -1e30])
def test_what_is_no_place_stays_none(x):
    assert item_from_message(float_message(x=x)).lat_e7 == INT32_MAX


def test_results_off_the_wire():
    assert mission_result(13) is MissionResult.INVALID_SEQUENCE
    assert mission_result(200) is None


@pytest.mark.parametrize(
    ("system", "component", "message", "mission_type", "accepted"),
    [
        (1, 1, MissionAck(245, 190, 0, 0), MissionType.MISSION, True),
        (1, 1, MissionAck(0, 0, 0, 0), MissionType.MISSION, True),
        (1, 1, MissionAck(245, 0, 0, 0), MissionType.MISSION, True),
        (1, 1, MissionAck(245, 190, 0, 1), MissionType.MISSION, False),
        (1, 1, MissionAck(245, 190, 0, 1), None, True),
        (1, 1, MissionAck(255, 190, 0, 0), MissionType.MISSION, False),
        (1, 1, MissionAck(245, 191, 0, 0), MissionType.MISSION, False),
        (2, 1, MissionAck(245, 190, 0, 0), MissionType.MISSION, False),
        (1, 2, MissionAck(245, 190, 0, 0), MissionType.MISSION, False),
        (245, 190, MissionAck(245, 190, 0, 0), MissionType.MISSION, False),
        (1, 1, Heartbeat(10, 3), MissionType.MISSION, True),
    ],
)
def test_the_filter(system, component, message, mission_type, accepted):
    assert PEER.accepts(Frame(system, component, message), mission_type) is accepted
