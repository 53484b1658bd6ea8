"""One download, message by message."""

from __future__ import annotations

import dataclasses

import pytest
from protocol.scripted import Script, seqs
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink.messages import (
    MissionAck,
    MissionCount,
    MissionItem,
    MissionItemInt,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionType,
)
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.transitions import DownloadState
from mavlink_bridge.protocol.wire import item_to_message

MISSION, FENCE = MissionType.MISSION, MissionType.FENCE
BACK = Peer(PEER.own_system, PEER.own_component, 1, 1)  # the vehicle's view: messages to us


def read(**options):
    return Script(Download(PEER, MISSION, **options))


def count(number, **fields):
    return MissionCount(PEER.own_system, PEER.own_component, number, **fields)


def item(seq, salt=0):
    return item_to_message(plain_mission(seq + 1, salt)[seq], seq, BACK, MISSION)


def float_item(seq):
    message = item(seq)
    values = {one.name: getattr(message, one.name) for one in dataclasses.fields(message)}
    return MissionItem(**{**values, "x": message.x / 1e7, "y": message.y / 1e7})


def ack(result, **fields):
    return MissionAck(PEER.own_system, PEER.own_component, result, **fields)


def test_a_list_is_read_and_thanked_for():
    script = read()
    assert script.sent == [MissionRequestList(1, 1, 0)]
    assert script.hear(count(3)) == [MissionRequestInt(1, 1, seq, 0) for seq in range(3)]
    assert script.hear(item(2), item(0), item(1)) == [MissionAck(1, 1, 0, 0)]
    outcome = script.machine.outcome
    assert outcome.is_complete
    assert [entry.lat_e7 for entry in outcome.items] == [entry.lat_e7 for entry in plain_mission(3)]
    assert not outcome.is_coarse
    assert script.machine.progress == (3, 3)


def test_an_empty_list_is_complete_at_once():
    script = read()
    assert script.hear(count(0)) == [MissionAck(1, 1, 0, 0)]
    assert script.machine.outcome.items == ()
    assert script.machine.outcome.is_complete


def test_the_list_is_asked_for_again_until_patience_ends():
    script = read()
    assert script.pass_time(2.1) == [MissionRequestList(1, 1, 0)] * 4
    script.pass_time(8.0)
    assert script.machine.outcome.state is DownloadState.SILENT
    assert script.machine.outcome.items == ()


def test_a_lost_item_is_asked_for_again_when_later_ones_came():
    script = read()
    script.hear(count(6))
    sent = script.hear(*(item(seq) for seq in (0, 2, 3, 4, 5)), after_s=0.05)
    assert seqs(sent) == [1]


def test_a_lost_last_item_is_asked_for_again_after_a_while():
    script = read()
    script.hear(count(3))
    script.hear(item(0), item(1), after_s=0.05)
    assert seqs(script.pass_time(0.5))[0] == 2
    script.hear(item(2))
    assert script.machine.outcome.is_complete


def test_silence_in_the_middle_ends_it():
    script = read()
    script.hear(count(3), item(0))
    script.pass_time(10.1)
    assert script.machine.outcome.state is DownloadState.SILENT


def test_the_window_is_kept():
    script = read(window=5)
    assert seqs(script.hear(count(20))) == [0, 1, 2, 3, 4]
    assert seqs(script.hear(item(0))) == [5]


def test_another_count_starts_afresh():
    script = read()
    script.hear(count(3), item(0))
    assert seqs(script.hear(count(2))) == [0, 1]
    script.hear(item(0), item(1))
    assert len(script.machine.outcome.items) == 2


def test_the_same_count_again_changes_nothing():
    script = read()
    script.hear(count(3), item(0))
    assert script.hear(count(3)) == []
    assert script.machine.progress == (1, 3)


def test_items_twice_and_past_the_end_change_nothing():
    script = read()
    script.hear(count(2))
    script.hear(item(0), item(0, salt=3), item(7))
    assert script.machine.progress == (1, 2)
    script.hear(item(1))
    assert script.machine.outcome.items[0].lat_e7 == plain_mission(1)[0].lat_e7


def test_items_before_the_count_are_ignored():
    script = read()
    assert script.hear(item(0)) == []
    assert script.machine.progress == (0, 0)


def test_a_rival_is_waited_for():
    script = read()
    script.hear(ack(MissionResult.DENIED))
    assert script.pass_time(1.1) == [MissionRequestList(1, 1, 0)]
    script.hear(count(0))
    assert script.machine.outcome.is_complete


def test_a_rival_that_stays_is_reported():
    script = read(rival_patience_s=3.0)
    for _ in range(5):
        script.hear(ack(MissionResult.DENIED), after_s=1.0)
    assert script.machine.outcome.state is DownloadState.BUSY


def test_a_rival_in_the_middle_means_reading_again():
    script = read()
    script.hear(count(2), item(0), ack(MissionResult.DENIED))
    script.pass_time(1.1)
    assert seqs(script.hear(count(2))) == [0, 1]


def test_a_refusal_is_believed_when_it_is_repeated():
    script = read()
    for _ in range(3):
        assert not script.machine.is_done
        script.hear(ack(MissionResult.UNSUPPORTED), ack(MissionResult.UNSUPPORTED))
        script.pass_time(0.6)
    outcome = script.machine.outcome
    assert (outcome.state, outcome.result) == (DownloadState.REFUSED, MissionResult.UNSUPPORTED)


@pytest.mark.parametrize("result", [MissionResult.ERROR, MissionResult.INVALID_SEQUENCE])
def test_answers_to_items_pushed_before_are_no_refusal(result):
    script = read()
    for _ in range(50):
        script.hear(ack(result), after_s=0.4)
    assert script.hear(count(1)) == [MissionRequestInt(1, 1, 0, 0)]
    script.hear(item(0))
    assert script.machine.outcome.is_complete


def test_an_error_that_never_ends_is_a_refusal():
    script = read()
    for _ in range(80):
        script.hear(ack(MissionResult.ERROR), after_s=0.4)
    outcome = script.machine.outcome
    assert (outcome.state, outcome.result) == (DownloadState.REFUSED, MissionResult.ERROR)


def test_different_refusals_are_not_added_up():
    script = read()
    for _ in range(2):
        script.hear(ack(MissionResult.ERROR), after_s=0.6)
    script.hear(ack(MissionResult.UNSUPPORTED), after_s=0.6)
    script.hear(ack(MissionResult.UNSUPPORTED), after_s=0.6)
    assert not script.machine.is_done


def test_an_item_past_the_end_makes_it_ask_for_the_count():
    script = read()
    script.hear(count(3), item(0))
    sent = script.hear(ack(MissionResult.INVALID_SEQUENCE), ack(MissionResult.INVALID_SEQUENCE))
    assert sent == [MissionRequestList(1, 1, 0)]
    script.hear(count(1))
    script.hear(item(0))
    assert len(script.machine.outcome.items) == 1


def test_a_vehicle_that_wants_requests_in_order_is_asked_one_by_one():
    script = read()
    script.hear(count(3))
    for _ in range(3):
        script.hear(ack(MissionResult.ERROR), after_s=0.6)
    assert script.machine.state is DownloadState.COUNTING
    assert seqs(script.hear(count(3))) == [0]
    assert seqs(script.hear(item(0))) == [1]


def test_an_old_vehicle_is_read_by_the_old_messages():
    script = read()
    script.hear(count(2))
    sent = script.pass_time(9.0)
    assert MissionRequest(1, 1, 0, 0) in sent
    sent = script.hear(float_item(0), float_item(1))
    assert sent == [MissionRequestInt(1, 1, 0, 0), MissionRequestInt(1, 1, 1, 0)]
    sent = script.pass_time(8.1)
    outcome = script.machine.outcome
    assert outcome.is_complete
    assert outcome.is_coarse
    assert not any(isinstance(message, MissionRequest) for message in sent)


def test_a_whole_list_of_coarse_items_is_given_up_for_an_exact_one():
    script = read()
    script.hear(count(2))
    script.pass_time(9.0)
    script.hear(float_item(0), float_item(1))
    script.pass_time(5.0)
    script.hear(item(1), item(0))
    outcome = script.machine.outcome
    assert outcome.is_complete
    assert not outcome.is_coarse
    assert [entry.lat_e7 for entry in outcome.items] == [entry.lat_e7 for entry in plain_mission(2)]


def test_an_exact_item_puts_an_end_to_coarse_ones():
    script = read()
    script.hear(count(2))
    script.pass_time(9.0)
    script.hear(float_item(0))
    sent = script.hear(item(1))
    assert MissionRequestInt(1, 1, 0, 0) in sent
    script.hear(float_item(0))
    assert not script.machine.is_done
    script.hear(item(0))
    assert not script.machine.outcome.is_coarse


def test_without_leave_coarse_items_do_not_count():
    script = read(float_form=False)
    script.hear(count(1), float_item(0))
    assert not script.machine.is_done
    assert not any(isinstance(message, MissionRequest) for message in script.pass_time(9.0))


def test_other_mission_types_and_targets_change_nothing():
    script = read()
    assert script.hear(count(3, mission_type=FENCE), MissionCount(255, 190, 3)) == []
    script.hear(count(1))
    script.hear(MissionItemInt(255, 190, 0, 0, 16, 0, 1, 0, 0, 0, 0, 1, 1, 0))
    assert not script.machine.is_done


def test_a_changing_list_does_not_keep_it_for_ever():
    script = read()
    number = 2
    while not script.machine.is_done and script.now_s < 1000:
        script.hear(count(number), after_s=1.0)
        number = 5 - number
    assert script.now_s <= script.machine.bound_s + 1.0
    assert script.machine.outcome.state is DownloadState.TOO_SLOW


@pytest.mark.parametrize("at_s", [0.0, 5.0])
def test_an_unstarted_machine_is_quiet(at_s):
    machine = Download(PEER, MISSION)
    machine.handle_timer(at_s)
    assert machine.messages_to_send() == []
    assert machine.deadline_s is None
    assert machine.outcome is None
