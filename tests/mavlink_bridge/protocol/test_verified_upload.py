"""The safe upload's decisions, message by message; its transfers over bad links are in test_twin_transfers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from protocol.scripted import Script
from protocol.twin import PEER, Client, Faults, Twin, Vehicle, plain_fence, plain_mission

from mavlink_bridge.mavlink.messages import (
    Frame,
    Heartbeat,
    MissionAck,
    MissionCount,
    MissionRequestInt,
    MissionResult,
    MissionType,
    Statustext,
)
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.transitions import VerifiedUploadState
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload
from missions.items import MissionItem

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
ARMED_AUTO = Heartbeat(10, 3, base_mode=128 + 1, custom_mode=10)
ARMED_HOLD = Heartbeat(10, 3, base_mode=128 + 1, custom_mode=4)


def upload(items, old=(), kind=MISSION, faults=None, seed=0, vehicle=None, **options):
    vehicle = vehicle or Vehicle()
    vehicle.hold(kind, list(old))
    client = Client(VerifiedUpload(PEER, kind, items, **{"is_active": False, **options}), PEER)
    twin = Twin(vehicle, [client], faults, seed)
    twin.run()
    return client.machine.outcome, vehicle, client


def at_backup(**options):
    """Return a script whose machine has read an empty list and waits for the backup to be stored."""
    script = Script(VerifiedUpload(PEER, MISSION, plain_mission(3), **options))
    script.hear(MissionCount(PEER.own_system, PEER.own_component, 0))
    assert script.machine.state is VerifiedUploadState.STORING_BACKUP
    return script


def test_nothing_is_written_before_the_backup_is_stored():
    script = at_backup(is_active=False)
    assert script.machine.pending_backup == ()
    assert script.machine.deadline_s is None
    assert not any(isinstance(message, MissionCount) for message in script.sent + script.pass_time(100.0))
    script.machine.backup_stored(script.now_s)
    assert script.machine.pending_backup is None
    assert not script.machine.has_written
    assert script.hear(ARMED_HOLD) == [MissionCount(1, 1, 3, 0)]
    assert script.machine.has_written


@pytest.mark.parametrize(
    ("options", "heartbeat", "writes"),
    [
        ({"is_active": False}, None, True),
        ({"is_active": True}, None, False),
        ({"is_active": True, "replace_active": True}, None, True),
        ({}, ARMED_AUTO, False),
        ({}, ARMED_HOLD, True),
        ({}, replace(ARMED_AUTO, base_mode=1), True),
        ({"replace_active": True}, ARMED_AUTO, True),
        ({"is_active": False}, ARMED_AUTO, False),
    ],
)
def test_a_driving_vehicle_is_not_written_to(options, heartbeat, writes):
    script = Script(VerifiedUpload(PEER, MISSION, plain_mission(3), **options))
    if heartbeat:
        script.hear(heartbeat)
    script.hear(MissionCount(PEER.own_system, PEER.own_component, 0))
    script.machine.backup_stored(script.now_s)
    sent = script.machine.messages_to_send()
    assert any(isinstance(message, MissionCount) for message in sent) is writes
    if not writes:
        assert script.machine.outcome.kind is OutcomeKind.ACTIVE
        assert script.machine.outcome.held is Held.OLD


def test_without_a_heartbeat_nothing_is_written():
    script = at_backup()
    script.machine.backup_stored(script.now_s)
    assert script.pass_time(11.0) == []
    assert script.machine.outcome.kind is OutcomeKind.NO_ANSWER


def test_a_heartbeat_is_waited_for():
    script = at_backup()
    script.machine.backup_stored(script.now_s)
    assert script.hear(ARMED_HOLD, after_s=0.7) == [MissionCount(1, 1, 3, 0)]


def test_an_old_heartbeat_is_not_believed():
    script = at_backup(is_active=False)
    script.pass_time(3.1)
    script.machine.backup_stored(script.now_s)
    assert script.machine.messages_to_send() == []
    assert script.hear(ARMED_HOLD, after_s=0.7) == [MissionCount(1, 1, 3, 0)]


def test_another_vehicles_heartbeat_tells_nothing():
    script = at_backup()
    script.machine.backup_stored(script.now_s)
    assert script.hear(ARMED_HOLD, system=9) == []


def test_what_does_not_fit_is_not_sent():
    script = Script(VerifiedUpload(PEER, MISSION, plain_mission(656)))
    assert script.sent == []
    outcome = script.machine.outcome
    assert (outcome.kind, outcome.result) == (OutcomeKind.REFUSED, MissionResult.NO_SPACE)
    assert outcome.texts == ("656 mission items; the vehicle holds 655",)
    assert outcome.backup is None


def test_the_vehicles_own_limits_count():
    script = Script(VerifiedUpload(PEER, MISSION, plain_mission(656), limits=Limits(mission_items=4368)))
    assert script.sent


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (MissionItem(31000), MissionResult.UNSUPPORTED),
        (MissionItem(5001, 0, (3.0, 0, 0, 0)), MissionResult.UNSUPPORTED),
        (MissionItem(16, 1), MissionResult.UNSUPPORTED_FRAME),
        (MissionItem(16, lat_e7=910000000), MissionResult.INVALID_PARAM5_X),
        (MissionItem(16, lon_e7=1810000000), MissionResult.INVALID_PARAM6_Y),
        (MissionItem(16, alt_m=float("nan")), MissionResult.INVALID_PARAM7),
        (MissionItem(16, params=(float("nan"), 0, 0, 0)), MissionResult.INVALID_PARAM1),
        (MissionItem(177, params=(99.0, 1.0, 0, 0)), MissionResult.ERROR),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_a_refusal_names_the_item_and_leaves_the_old_list(bad, result):
    items = plain_mission(20)
    items[13] = bad
    old = plain_mission(12, salt=1)
    outcome, vehicle, _ = upload(items, old)
    assert (outcome.kind, outcome.result, outcome.item) == (OutcomeKind.REFUSED, result, 13)
    assert outcome.held is Held.OLD
    assert [item.lat_e7 for item in vehicle.held(MISSION)] == [item.lat_e7 for item in old]
    assert outcome.backup == vehicle.held(MISSION)


def test_a_refused_fence_brings_the_reason():
    items = plain_fence(2)
    items[5] = replace(items[5], lat_e7=950000000)
    outcome, vehicle, _ = upload(items, plain_fence(1, salt=5), FENCE)
    assert (outcome.kind, outcome.result) == (OutcomeKind.REFUSED, MissionResult.ERROR)
    assert outcome.texts[-2:] == ("Bad lat or lon", "Fence validation failed")
    assert len(vehicle.held(FENCE)) == 4


def test_a_fence_with_a_bad_item_names_it():
    items = plain_fence(2)
    items[5] = replace(items[5], frame=1)
    outcome, _, _ = upload(items, (), FENCE)
    assert (outcome.result, outcome.item) == (MissionResult.UNSUPPORTED_FRAME, 5)


def test_rally_points_go_up():
    items = [MissionItem(5100, 3, lat_e7=400713740 + seq, lon_e7=-1052299300, alt_m=10.7) for seq in range(3)]
    outcome, vehicle, _ = upload(items, (), RALLY)
    assert outcome.is_verified
    assert [item.lat_e7 for item in vehicle.held(RALLY)] == [400713740, 400713741, 400713742]


def test_an_empty_list_clears():
    outcome, vehicle, _ = upload([], plain_fence(2), FENCE)
    assert outcome.is_verified
    assert vehicle.held(FENCE) == ()


def test_a_silent_vehicle_was_not_written_to():
    script = Script(VerifiedUpload(PEER, MISSION, plain_mission(3)))
    script.pass_time(60.0)
    outcome = script.machine.outcome
    assert (outcome.kind, outcome.held, outcome.backup) == (OutcomeKind.NO_ANSWER, Held.OLD, None)


def test_a_vehicle_that_gives_no_list_is_not_written_to():
    script = Script(VerifiedUpload(PEER, RALLY, []))
    for _ in range(4):
        script.hear(
            MissionAck(PEER.own_system, PEER.own_component, MissionResult.UNSUPPORTED, RALLY), after_s=0.6
        )
    outcome = script.machine.outcome
    assert (outcome.kind, outcome.result) == (OutcomeKind.REFUSED, MissionResult.UNSUPPORTED)


def test_a_link_that_dies_while_pushing_leaves_it_unknown():
    vehicle = Vehicle(off=[(1.0, 1e9)])
    outcome, _, client = upload(
        plain_mission(40), plain_mission(12, 1), faults=Faults(0, 0, 0.1, 0.1), vehicle=vehicle, window=1
    )
    assert (outcome.kind, outcome.held) == (OutcomeKind.UNKNOWN, Held.UNKNOWN)
    assert outcome.backup is not None
    assert len(outcome.backup) == 12
    assert client.ended_s < 25.0


def test_a_reboot_half_way_is_survived():
    vehicle = Vehicle(off=[(1.0, 4.0)])
    outcome, vehicle, _ = upload(
        plain_mission(40), plain_mission(12, 1), faults=Faults(0, 0, 0.1, 0.1), vehicle=vehicle, window=1
    )
    assert outcome.is_verified
    assert len(vehicle.held(MISSION)) == 40


def test_progress_only_grows_and_ends_full():
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, 1))
    machine = VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False)
    client = Client(machine, PEER)
    twin = Twin(vehicle, [client], Faults(0.2, 0.1, 0.01, 0.1), seed=3)
    shown = []
    twin.after_vehicle = lambda: shown.append(machine.progress[0])
    twin.run()
    assert shown == sorted(shown)
    assert machine.progress == (52, 52)
    assert len(set(shown)) > 10


def test_the_texts_of_the_vehicle_are_kept_once_each():
    script = at_backup(is_active=False)
    script.machine.backup_stored(script.now_s)
    script.hear(Statustext(4, "Fence upload timeout"), Statustext(4, "Fence upload timeout"))
    script.pass_time(100.0)
    assert script.machine.outcome.texts == ("Fence upload timeout",)


def test_a_finished_or_unstarted_machine_ignores_everything():
    machine = VerifiedUpload(PEER, MISSION, plain_mission(3))
    machine.handle_timer(1.0)
    machine.receive(Frame(1, 1, MissionCount(245, 190, 3)), 1.0)
    machine.backup_stored(1.0)
    assert machine.outcome is None
    assert machine.messages_to_send() == []
    machine.start(2.0)
    machine.start(2.0)
    assert len(machine.messages_to_send()) == 1


@pytest.mark.parametrize(("is_running", "pushes"), [(False, 4), (True, 1)])
def test_a_list_that_is_driven_meanwhile_is_not_pushed_again(is_running, pushes):
    # No announcement gets through; after the first push somebody switches to AUTO.
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, salt=1))
    machine = VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False)
    twin = Twin(vehicle, [Client(machine, PEER)])
    deliver = twin._to_vehicle

    def drop_announcements(frame):
        if isinstance(frame.message, MissionCount):
            vehicle.is_running = is_running
        else:
            deliver(frame)

    twin._to_vehicle = drop_announcements
    twin.run()
    assert (machine.outcome.kind, machine.outcome.held) == (OutcomeKind.UNCHANGED, Held.OLD)
    assert machine.outcome.pushes == pushes


def test_a_failed_restore_says_what_is_there():
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, salt=1))
    machine = VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False, window=1)
    client = Client(machine, PEER)
    twin = Twin(vehicle, [client])
    deliver = twin._to_vehicle

    def drop_later_items(frame):
        last = 2 if machine.state is VerifiedUploadState.RESTORING else 5
        if getattr(frame.message, "x", None) is None or frame.message.seq <= last:
            deliver(frame)

    twin._to_vehicle = drop_later_items
    twin.run()
    outcome = machine.outcome
    assert (outcome.kind, outcome.held) == (OutcomeKind.DIFFERENT, Held.UNFINISHED)
    assert len(outcome.backup) == 12
    assert outcome.found == vehicle.held(MISSION)
    assert client.ended_s <= machine.bound_s


def test_a_vehicle_that_takes_no_list_is_busy_and_unchanged():
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(12, salt=1))
    machine = VerifiedUpload(PEER, MISSION, plain_mission(20), is_active=False, rival_patience_s=2.0)
    client = Client(machine, PEER)
    twin = Twin(vehicle, [client])
    deliver = twin._to_vehicle

    def deny_counts(frame):
        if isinstance(frame.message, MissionCount):
            denied = MissionAck(PEER.own_system, PEER.own_component, MissionResult.DENIED, MISSION)
            twin._carry(("down",), twin._to_clients, Frame(1, 1, denied))
        else:
            deliver(frame)

    twin._to_vehicle = deny_counts
    twin.run()
    assert (machine.outcome.kind, machine.outcome.held) == (OutcomeKind.BUSY, Held.OLD)
    assert len(vehicle.held(MISSION)) == 12


def test_a_rival_that_comes_after_the_backup_is_reported():
    script = at_backup(is_active=False, rival_patience_s=2.0)
    script.machine.backup_stored(script.now_s)
    denied = MissionAck(PEER.own_system, PEER.own_component, MissionResult.DENIED, MISSION)
    while not script.machine.is_done and script.now_s < 100.0:
        script.hear(denied, after_s=0.5)
    # MISSION_COUNT was sent and the vehicle's word for it may be lost: that nothing was written is not known.
    assert (script.machine.outcome.kind, script.machine.outcome.held) == (OutcomeKind.UNKNOWN, Held.UNKNOWN)


def test_a_vehicle_with_float_positions_is_verified_as_far_as_they_go():
    vehicle = Vehicle()
    vehicle.hold(MISSION, plain_mission(3, salt=1))
    client = Client(VerifiedUpload(PEER, MISSION, plain_mission(5), is_active=False), PEER)
    twin = Twin(vehicle, [client])
    deliver = twin._to_vehicle
    twin._to_vehicle = lambda frame: None if isinstance(frame.message, MissionRequestInt) else deliver(frame)
    twin.run()
    outcome = client.machine.outcome
    assert outcome.is_verified
    assert outcome.is_coarse
