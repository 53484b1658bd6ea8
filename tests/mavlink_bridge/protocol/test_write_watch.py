"""What tells that somebody else writes a list, and what does not: reading is no writing."""

from __future__ import annotations

import math

import pytest
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Frame, MissionResult, MissionType
from mavlink_bridge.protocol.wire import item_to_message
from mavlink_bridge.protocol.write_watch import WriteWatch
from missions.items import MissionItem

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
VEHICLE, OTHER, OURS = (1, 1), (255, 190), (PEER.own_system, PEER.own_component)
RIVAL_ITEM = item_to_message(plain_mission(3, salt=7)[1], 1, PEER, MISSION)


def heard(sender, *messages, kind=MISSION, counted=True):
    watch = WriteWatch(PEER, kind)
    watch.begin()
    if counted:
        watch.counted()
    for message in messages:
        watch.look(Frame(*sender, message), 5.0)
    return watch


def guided(current):
    return m.MissionItemInt(1, 1, 0, 6, 16, current, 1, 0.0, 0.0, 0.0, 0.0, 1, 1, 0.0)


WRITES = {
    "item asked of another": (VEHICLE, m.MissionRequest(*OTHER, 1)),
    "item asked of another, newer form": (VEHICLE, m.MissionRequestInt(*OTHER, 1)),
    "item asked of another program on our computer": (VEHICLE, m.MissionRequest(OURS[0], 7, 1)),
    "write of another acknowledged": (VEHICLE, m.MissionAck(*OTHER, MissionResult.ACCEPTED)),
    "write of another given up": (VEHICLE, m.MissionAck(*OTHER, MissionResult.OPERATION_CANCELLED)),
    "item of another refused": (VEHICLE, m.MissionAck(*OTHER, MissionResult.INVALID_PARAM5_X)),
    "all lists cleared": (VEHICLE, m.MissionAck(*OTHER, MissionResult.ACCEPTED, MissionType.ALL)),
    "item asked of us, unasked": (VEHICLE, m.MissionRequest(*OURS, 1)),
    "write acknowledged to us, unasked": (VEHICLE, m.MissionAck(*OURS, MissionResult.ACCEPTED)),
    "item asked of everybody": (VEHICLE, m.MissionRequest(0, 0, 1)),
    "count": (OTHER, m.MissionCount(1, 1, 5)),
    "count to all components": (OTHER, m.MissionCount(1, 0, 5)),
    "part": (OTHER, m.MissionWritePartialList(1, 1, 1, 1)),
    "item": (OTHER, RIVAL_ITEM),
    "clear": (OTHER, m.MissionClearAll(1, 1)),
    "clear of all": (OTHER, m.MissionClearAll(1, 1, MissionType.ALL)),
    "storage reset": (OTHER, m.CommandLong(1, 1, 245, param2=2.0)),
    "count with our ids": (OURS, m.MissionCount(1, 1, 5)),
    "item with our ids": (OURS, RIVAL_ITEM),
    "part with our ids": (OURS, m.MissionWritePartialList(1, 1, 1, 1)),
}
READS = {
    "list asked for": (OTHER, m.MissionRequestList(1, 1)),
    "item asked for": (OTHER, m.MissionRequestInt(1, 1, 1)),
    "item asked for, older form": (OTHER, m.MissionRequest(1, 1, 1)),
    "list thanked for": (OTHER, m.MissionAck(1, 1, MissionResult.ACCEPTED)),
    "count given to another": (VEHICLE, m.MissionCount(*OTHER, 5)),
    "item given to another": (VEHICLE, m.MissionItemInt(*OTHER, 1, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, 1, 1, 0.0)),
    "another denied": (VEHICLE, m.MissionAck(*OTHER, MissionResult.DENIED)),
    "another read past the end": (VEHICLE, m.MissionAck(*OTHER, MissionResult.INVALID_SEQUENCE)),
    "another's list too long": (VEHICLE, m.MissionAck(*OTHER, MissionResult.NO_SPACE)),
    "no such list for another": (VEHICLE, m.MissionAck(*OTHER, MissionResult.UNSUPPORTED)),
    "another list": (OTHER, m.MissionCount(1, 1, 5, FENCE)),
    "another list asked of another": (VEHICLE, m.MissionRequest(*OTHER, 1, FENCE)),
    "another vehicle": (OTHER, m.MissionCount(2, 1, 5)),
    "another vehicle's item": ((2, 1), m.MissionRequest(*OTHER, 1)),
    "a place to go to": (OTHER, guided(2)),
    "an altitude": (OTHER, guided(3)),
    "a command": (OTHER, m.CommandLong(1, 1, 400, param2=2.0)),
    "the current item": (OTHER, m.MissionSetCurrent(1, 1, 2)),
    "heartbeat": (OTHER, m.Heartbeat(6, 8)),
}  # fmt: skip


@pytest.mark.parametrize("what", WRITES)
def test_writes_are_heard(what):
    sender, message = WRITES[what]
    watch = heard(sender, message)
    assert watch.is_disturbed
    assert watch.heard_s == 5.0
    target = (getattr(message, "target_system", 0), getattr(message, "target_component", 0))
    assert watch.writer == ({(0, 0): OURS}.get(target, target) if sender == VEHICLE else sender)


@pytest.mark.parametrize("what", READS)
def test_reading_is_no_writing(what):
    watch = heard(*READS[what])
    assert not watch.is_disturbed
    assert watch.writer is None


@pytest.mark.parametrize("kind", [FENCE, RALLY])
def test_every_list_is_watched_for_itself(kind):
    assert heard(OTHER, m.MissionCount(1, 1, 5, kind), kind=kind).is_disturbed
    assert not heard(OTHER, m.MissionCount(1, 1, 5, MISSION), kind=kind).is_disturbed


def test_late_words_about_our_own_upload_do_not_count_before_the_list_is_counted():
    words = [m.MissionRequest(*OURS, 4), m.MissionAck(*OURS, MissionResult.ACCEPTED)]
    assert not heard(VEHICLE, *words, counted=False).is_disturbed
    assert heard(VEHICLE, m.MissionRequest(*OTHER, 4), counted=False).is_disturbed


def test_a_new_read_begins_without_suspicion():
    watch = heard(OTHER, m.MissionClearAll(1, 1))
    watch.begin()
    assert not watch.is_disturbed
    assert watch.writer == OTHER


def test_our_own_echoes_are_known_also_where_an_item_is_not_equal_to_itself():
    # Half-duplex radios give back what is sent: as it went over the wire, floats cut to 32 bits.
    items = [
        MissionItem(16, 3, (0.1, 0.0, 0.0, math.nan), 400713740, -1052299300, 0.3),
        MissionItem(16, 3, (0, 0, 0, 0), 400713741, -1052299300, 1),
    ]
    messages = [
        m.MissionCount(1, 1, 2, 0),
        *(item_to_message(item, seq, PEER, MISSION) for seq, item in enumerate(items)),
    ]
    watch = WriteWatch(PEER, MISSION)
    for message in messages:
        watch.note_sent(message)
    watch.begin()
    watch.counted()
    sender, receiver = Codec(*OURS), Codec(1, 1)
    for frame in receiver.decode(b"".join(sender.encode(message) for message in messages)):
        watch.look(frame, 1.0)
    assert not watch.is_disturbed
    watch.look(Frame(*OURS, m.MissionCount(1, 1, 3, 0)), 2.0)
    assert watch.is_disturbed


def test_a_number_that_changes_is_a_sign_and_one_that_stays_is_none():
    same = [
        m.MissionCurrent(1, 4, mission_id=77, fence_id=5),
        m.MissionCurrent(2, 4, mission_id=77, fence_id=6),
    ]
    assert not heard(VEHICLE, *same).is_disturbed
    assert heard(VEHICLE, *same, kind=FENCE).is_disturbed
    assert heard(VEHICLE, same[0], m.MissionCurrent(1, 4, mission_id=78, fence_id=5)).is_disturbed
    assert heard(VEHICLE, same[0], m.MissionCurrent(1, 5, mission_id=77, fence_id=5)).is_disturbed
    totals = [m.ParamValue("MIS_TOTAL", number, 9, 900, 3) for number in (4.0, 4.0, 5.0)]
    assert not heard(VEHICLE, *totals[:2]).is_disturbed
    assert heard(VEHICLE, *totals).is_disturbed
    assert not heard(
        VEHICLE, m.ParamValue("FENCE_TOTAL", 4.0, 9, 900, 3), m.ParamValue("FENCE_TOTAL", 5.0, 9, 900, 3)
    ).is_disturbed


def test_the_word_that_a_plan_came_is_ours_once():
    text = m.Statustext(6, "Flight plan received")
    watch = WriteWatch(PEER, MISSION)
    watch.note_sent(m.MissionCount(1, 1, 5))
    watch.begin()
    watch.counted()
    watch.look(Frame(1, 1, text), 1.0)
    assert not watch.is_disturbed
    watch.look(Frame(1, 1, text), 2.0)
    assert watch.is_disturbed
    assert not heard(VEHICLE, text, kind=FENCE).is_disturbed
