"""One push, message by message; the cases follow MAVSDK's list for its mission transfer client."""

from __future__ import annotations

import pytest
from protocol.scripted import Script, seqs
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink.messages import (
    Heartbeat,
    MissionAck,
    MissionCount,
    MissionItemInt,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionType,
)
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.transitions import UploadState
from mavlink_bridge.protocol.upload import Upload

MISSION = MissionType.MISSION


def push(count, **options):
    return Script(Upload(PEER, MISSION, plain_mission(count), **options))


def ask(seq, **fields):
    return MissionRequest(PEER.own_system, PEER.own_component, seq, **fields)


def ack(result, **fields):
    return MissionAck(PEER.own_system, PEER.own_component, result, **fields)


def test_the_count_is_announced_and_repeated_until_an_answer_comes():
    script = push(3)
    assert script.sent == [MissionCount(1, 1, 3, 0)]
    assert script.pass_time(3.5) == [MissionCount(1, 1, 3, 0)] * 3


def test_where_the_link_is_known_what_was_lost_is_noticed_sooner():
    round_trip = RoundTrip()
    round_trip.observe(0.2)
    script = push(2, round_trip=round_trip)
    assert script.pass_time(0.55) == []
    assert script.pass_time(0.1) == [MissionCount(1, 1, 2, 0)]
    script.hear(ask(0))
    script.pass_time(0.2)
    script.hear(ask(1))
    assert not any(isinstance(message, MissionRequestList) for message in script.pass_time(0.35))
    assert MissionRequestList(1, 1, 0) in script.pass_time(0.2)


def test_silence_ends_it_unconfirmed():
    script = push(3)
    script.pass_time(9.9)
    assert not script.machine.is_done
    script.pass_time(0.2)
    assert script.machine.outcome.state is UploadState.UNCONFIRMED


def test_no_item_goes_out_before_it_is_asked_for():
    script = push(3)
    assert not any(isinstance(message, MissionItemInt) for message in script.sent + script.pass_time(5.0))


@pytest.mark.parametrize("request_class", [MissionRequest, MissionRequestInt])
def test_items_are_pushed_ahead_of_both_kinds_of_request(request_class):
    script = push(4)
    sent = script.hear(request_class(PEER.own_system, PEER.own_component, 0))
    assert seqs(sent) == [0, 1, 2, 3]
    assert all(isinstance(message, MissionItemInt) for message in sent)


def test_a_window_of_one_serves_one_by_one():
    script = push(3, window=1)
    for seq in range(3):
        assert seqs(script.hear(ask(seq))) == [seq]
    script.hear(ack(MissionResult.ACCEPTED))
    assert script.machine.outcome.state is UploadState.ACCEPTED


def test_the_window_grows_while_requests_keep_up():
    script = push(100)
    first = len(script.hear(ask(0)))
    sizes = [len(script.hear(ask(seq), after_s=0.001)) for seq in range(1, 10)]
    assert first == 26
    assert all(size == 2 for size in sizes)


def test_a_second_announcement_by_the_vehicle_is_no_outcome():
    script = push(3)
    script.hear(ask(0))
    assert script.hear(ask(0)) == []  # the same frame twice
    assert not script.machine.is_done


def test_a_repeated_request_is_answered_the_last_one_too():
    script = push(3)
    script.hear(ask(0), ask(1), ask(2))
    assert seqs(script.hear(ask(2), after_s=1.0)) == [2]
    assert seqs(script.hear(ask(2), after_s=1.0)) == [2]


def test_a_restart_from_the_front_is_followed():
    script = push(5)
    script.hear(ask(0), ask(1), ask(2), ask(3))
    assert seqs(script.hear(ask(0), after_s=0.5)) == [0]
    assert seqs(script.hear(ask(1), after_s=0.5))[:1] == [1]


def test_out_of_sequence_goes_on_from_the_item_asked_for():
    script = push(30)
    script.hear(ask(0))
    script.hear(ask(1), ask(2), after_s=0.02)
    invalid = ack(MissionResult.INVALID_SEQUENCE)
    assert script.hear(invalid, invalid) == []
    assert seqs(script.pass_time(0.2)) == [2]  # a window of one
    assert not script.machine.is_done


def test_out_of_sequence_from_a_frame_that_came_twice_repeats_nothing():
    script = push(30)
    script.hear(ask(0))
    script.hear(ask(1), after_s=0.02)
    sent = script.hear(ack(MissionResult.INVALID_SEQUENCE), ask(2), ask(3))
    sent += script.pass_time(0.5)
    assert len(seqs(sent)) == len(set(seqs(sent)))
    assert min(seqs(sent)) > 25


def test_an_item_lost_at_the_end_waits_for_the_vehicle_to_ask():
    script = push(3)
    script.hear(ask(0), ask(1), ask(2))
    assert not any(isinstance(message, MissionItemInt) for message in script.pass_time(5.0))


def test_a_late_first_request_for_a_pushed_item_sends_it_again():
    script = push(5)
    script.hear(ask(0))
    assert seqs(script.hear(ask(3), after_s=1.1)) == [3]


def test_an_acceptance_before_everything_was_sent_is_ignored():
    script = push(50)
    script.hear(ask(0))
    script.hear(ack(MissionResult.ACCEPTED))
    assert not script.machine.is_done


def test_an_empty_list_is_accepted_without_items():
    script = Script(Upload(PEER, MISSION, []))
    script.hear(ack(MissionResult.ACCEPTED))
    assert script.machine.outcome.state is UploadState.ACCEPTED
    assert script.machine.progress == (0, 0)


@pytest.mark.parametrize(
    "result",
    [result for result in MissionResult if result not in (0, 13, 14, 15)],
    ids=lambda result: result.name,
)
def test_a_refusal_names_result_and_item(result):
    script = push(5, window=1)
    for seq in range(3):
        script.hear(ask(seq))
    script.hear(ack(result))
    outcome = script.machine.outcome
    assert outcome.state is UploadState.REFUSED
    assert (outcome.result, outcome.item, outcome.item_is_certain) == (result, 2, True)


def test_with_items_under_way_the_refused_one_is_not_certain():
    script = push(5)
    script.hear(ask(0), ask(1), ack(MissionResult.INVALID_PARAM7))
    outcome = script.machine.outcome
    assert (outcome.item, outcome.item_is_certain) == (1, False)


def test_a_list_refused_as_a_whole_names_no_item():
    script = push(5)
    script.hear(ack(MissionResult.NO_SPACE))
    outcome = script.machine.outcome
    assert (outcome.state, outcome.result, outcome.item) == (
        UploadState.REFUSED,
        MissionResult.NO_SPACE,
        None,
    )


def test_a_cancelled_upload_is_unconfirmed():
    script = push(5)
    script.hear(ask(0), ack(MissionResult.OPERATION_CANCELLED))
    outcome = script.machine.outcome
    assert (outcome.state, outcome.result) == (UploadState.UNCONFIRMED, MissionResult.OPERATION_CANCELLED)


def test_a_rival_is_waited_for_and_then_reported():
    script = push(5, rival_patience_s=3.0)
    for _ in range(5):
        script.hear(ack(MissionResult.DENIED), after_s=1.0)
    assert script.machine.outcome.state is UploadState.BUSY


def test_after_a_rival_the_list_is_announced_again():
    script = push(5)
    script.hear(ack(MissionResult.DENIED))
    assert script.pass_time(1.1) == [MissionCount(1, 1, 5, 0)]
    assert seqs(script.hear(ask(0))) == [0, 1, 2, 3, 4]


def test_a_missing_final_word_is_asked_for_with_the_list():
    script = push(2)
    script.hear(ask(0), ask(1))
    assert MissionRequestList(1, 1, 0) in script.pass_time(1.5)
    script.hear(ack(MissionResult.DENIED))  # it still takes items
    assert not script.machine.is_done
    script.hear(MissionCount(PEER.own_system, PEER.own_component, 2))  # it does not
    assert script.machine.outcome.state is UploadState.UNCONFIRMED


def test_nothing_is_sent_once_the_word_is_in():
    script = push(2)
    script.hear(ask(0), ask(1), ack(MissionResult.ACCEPTED))
    assert script.hear(ask(1), ask(0), after_s=1.0) == []
    assert script.pass_time(30.0) == []
    assert script.machine.deadline_s is None


def test_endless_requests_do_not_keep_it_for_ever():
    script = push(2)
    while not script.machine.is_done and script.now_s < 1000:
        script.hear(ask(0), after_s=1.0)
    assert script.now_s <= script.machine.bound_s + 1.0


@pytest.mark.parametrize(
    ("message", "sender"),
    [
        (ask(0), (2, 1)),
        (ask(0), (1, 100)),
        (ask(0), (PEER.own_system, PEER.own_component)),
        (ask(0, mission_type=1), (1, 1)),
        (MissionRequest(255, 190, 0), (1, 1)),
        (MissionRequest(PEER.own_system, 7, 0), (1, 1)),
        (ask(99), (1, 1)),
        (ack(99), (1, 1)),
        (Heartbeat(10, 3), (1, 1)),
        (MissionItemInt(245, 190, 0, 0, 16, 0, 1, 0, 0, 0, 0, 0, 0, 0), (1, 1)),
    ],
)
def test_what_is_not_for_us_changes_nothing(message, sender):
    script = push(3)
    assert script.hear(message, system=sender[0], component=sender[1]) == []
    assert script.machine.state is UploadState.ANNOUNCED


def test_requests_to_everyone_count():
    script = push(1)
    assert seqs(script.hear(MissionRequest(0, 0, 0))) == [0]


def test_progress_counts_the_items_asked_for():
    script = push(4)
    script.hear(ask(0), ask(1), ask(2))
    assert script.machine.progress == (2, 4)
    script.hear(ask(3), ack(MissionResult.ACCEPTED))
    assert script.machine.progress == (4, 4)


def test_nobody_talks_to_himself():
    with pytest.raises(ValueError, match="cannot have the same ids"):
        Peer(1, 1, 1, 1)


def test_an_unstarted_machine_is_quiet():
    machine = Upload(PEER, MISSION, plain_mission(3))
    machine.handle_timer(5.0)
    assert machine.messages_to_send() == []
    assert machine.deadline_s is None
    assert machine.outcome is None


def test_an_error_after_a_long_stall_is_no_refusal():
    script = push(5, window=1)
    script.hear(ask(0), ask(1))
    for _ in range(7):
        script.hear(ask(1), after_s=1.0)
    script.hear(ack(MissionResult.ERROR))
    assert script.machine.outcome.state is UploadState.UNCONFIRMED
