"""Transfers with PX4: whatever the link does the outcome is true; and each of PX4's ways that a machine has to know."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from protocol.campaign import scenario_of, transfer
from protocol.scripted import Script, seqs
from protocol.twin import PEER, RIVAL, Client, Faults, Px4Vehicle, Twin, plain_fence, plain_mission

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import PX4_1_17, PX4_1_18
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.mavlink.modes import PX4_MODES
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.first_item import BeginAtFirstItem
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.mode_switch import Arming, ModeSwitch
from mavlink_bridge.protocol.outcomes import Writing, end_of_upload
from mavlink_bridge.protocol.parameters import ReadParameters, SetParameter
from mavlink_bridge.protocol.texts import Reasons
from mavlink_bridge.protocol.transitions import DownloadState, SwitchState, UploadState
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind, VerifiedUpload
from missions.items import Command, MissionItem

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
ON_1_17, ON_1_18 = (replace(PEER, autopilot=table) for table in (PX4_1_17, PX4_1_18))
CANCEL = m.MissionAck(1, 1, MissionResult.OPERATION_CANCELLED)


def mission(length, salt=0):
    return plain_mission(length + 1, salt)[1:]


def own(*messages):
    """Messages as the vehicle addresses them to us."""
    return [replace(message, target_system=245, target_component=190) for message in messages]


def request(seq, kind=0):
    return m.MissionRequestInt(245, 190, seq, kind)


def ack(result, kind=0):
    return m.MissionAck(245, 190, result, kind)


def run(wanted, old=(), peer=ON_1_18, kind=MISSION, faults=None, seed=0, **options):
    vehicle = Px4Vehicle(autopilot=peer.autopilot)
    vehicle.hold(kind, list(old))
    client = Client(VerifiedUpload(peer, kind, wanted, is_active=False, **options), PEER)
    twin = Twin(vehicle, [client], faults, seed)
    twin.run()
    return vehicle, client


@pytest.mark.parametrize("autopilot", [PX4_1_17, PX4_1_18], ids=str)
def test_transfers_tell_the_truth(autopilot):
    lies = {}
    for seed in range(60):
        judged = transfer(replace(scenario_of(seed), autopilot=autopilot))
        if judged.lies:
            lies[seed] = judged.lies
    assert lies == {}


@pytest.mark.campaign
def test_more_transfers_tell_the_truth():
    lies = {}
    for seed in range(60, 160):  # `make campaign AUTOPILOT=px4` goes on
        judged = transfer(replace(scenario_of(seed), autopilot=(PX4_1_17, PX4_1_18)[seed % 2]))
        if judged.lies:
            lies[seed] = judged.lies
    assert lies == {}


@pytest.mark.parametrize(("loss", "least_verified"), [(0.05, 60), (0.1, 60), (0.2, 59)])
def test_most_uploads_end_verified(loss, least_verified):
    kinds = []
    for seed in range(60):
        _, client = run(mission(20), mission(12, 1), faults=Faults(loss, 0.0, 0.05, 0.1), seed=seed)
        kinds.append(client.machine.outcome.kind)
    assert kinds.count(OutcomeKind.VERIFIED) >= least_verified


@pytest.mark.parametrize("count", [0, 1, 20, 500])
def test_a_clean_link_takes_one_push(count):
    vehicle, client = run(mission(count), mission(12, 1))
    outcome = client.machine.outcome
    assert (outcome.kind, outcome.held, outcome.pushes) == (OutcomeKind.VERIFIED, Held.WANTED, 1)
    assert len(vehicle.held(MISSION)) == count


class TestUploads:
    def test_the_first_item_is_the_current_one_and_unused_parameters_are_0(self):
        odd = [replace(item, params=(1.0, 2.0, 3.0, math.nan)) for item in mission(3)]
        vehicle, client = run(odd)
        sent = [message for _, message in client.sent if isinstance(message, m.MissionItemInt)]
        assert [message.current for message in sent] == [1, 0, 0]
        assert {message.param3 for message in sent} == {0.0}
        assert client.machine.outcome.is_verified
        assert vehicle.lists[MISSION].current == 0

    def test_circles_of_a_fence_go_last(self):
        circle = MissionItem(Command.FENCE_CIRCLE_EXCLUSION, 0, (5.0, 0, 0, 0), 400_000_000, -1_050_000_000)
        vehicle, client = run([circle, *plain_fence(1)], kind=FENCE)
        assert client.machine.outcome.is_verified
        assert [item.command for item in vehicle.held(FENCE)] == [5002] * 4 + [5004]

    def test_an_item_that_is_refused_leaves_the_old_list(self):
        unknown = replace(mission(3)[1], command=18)
        before = mission(12, 1)
        wanted = mission(5)
        vehicle, client = run([*wanted[:2], unknown, *wanted[2:]], before)
        outcome = client.machine.outcome
        assert (outcome.kind, outcome.held, outcome.result, outcome.item) == (
            OutcomeKind.REFUSED,
            Held.OLD,
            MissionResult.UNSUPPORTED,
            2,
        )
        assert "IGN MISSION_ITEM: Invalid item" in outcome.texts[0]
        assert len(vehicle.held(MISSION)) == 12

    def test_what_is_refused_with_error_is_believed_only_after_it_came_twice(self):
        wanted = [*mission(2), plain_fence(1)[0]]
        _, client = run(wanted, mission(12, 1))
        outcome = client.machine.outcome
        assert (outcome.kind, outcome.result, outcome.item, outcome.pushes) == (
            OutcomeKind.REFUSED,
            MissionResult.ERROR,
            2,
            2,
        )

    def test_a_broken_off_upload_needs_no_restoring_and_that_is_proved_by_reading(self):
        # From the sixth item on nothing of ours gets through, at any push: the vehicle gives up without a word.
        vehicle = Px4Vehicle(autopilot=PX4_1_18)
        vehicle.hold(MISSION, mission(12, 1))
        old = vehicle.held(MISSION)
        client = Client(VerifiedUpload(ON_1_18, MISSION, mission(40), is_active=False, window=1), PEER)
        twin = Twin(vehicle, [client], Faults(0.0, 0.0, 0.1, 0.1))
        deliver = twin._to_vehicle

        def drop(frame):
            if getattr(frame.message, "seq", 0) <= 5 or not isinstance(frame.message, m.MissionItemInt):
                deliver(frame)

        twin._to_vehicle = drop
        twin.run()
        outcome = client.machine.outcome
        assert (outcome.kind, outcome.held) == (OutcomeKind.UNCHANGED, Held.OLD)
        assert vehicle.held(MISSION) == old
        counts = {message.count for _, message in client.sent if isinstance(message, m.MissionCount)}
        assert counts == {40}  # the old list was never sent
        lists = [time_s for time_s, message in client.sent if isinstance(message, m.MissionRequestList)]
        items = [time_s for time_s, message in client.sent if isinstance(message, m.MissionItemInt)]
        assert max(lists) > max(items)

    def test_silence_ends_with_a_word_that_frees_the_vehicle(self):
        script = Script(Upload(ON_1_18, MISSION, mission(3)))
        script.hear(request(0))
        script.pass_time(15.0)
        assert script.machine.state is UploadState.UNCONFIRMED
        assert script.sent[-1] == CANCEL

    def test_an_error_to_the_count_means_busy(self):
        script = Script(Upload(ON_1_18, MISSION, mission(3), rival_patience_s=3.0))
        assert script.hear(ack(MissionResult.ERROR)) == [CANCEL]  # what it is busy with may be ours
        assert script.machine.state is UploadState.WAITING
        (count,) = script.pass_time(1.1)
        assert isinstance(count, m.MissionCount)
        for _ in range(4):
            script.hear(ack(MissionResult.ERROR))
            script.pass_time(1.1)
        assert script.machine.outcome.state is UploadState.BUSY

    def test_an_error_while_items_are_asked_for_is_no_end(self):
        # It answers a second MISSION_COUNT, or an item of an upload before: the upload goes on.
        script = Script(Upload(ON_1_18, MISSION, mission(3), window=1))
        script.hear(request(0), ack(MissionResult.ERROR), ack(MissionResult.ERROR))
        assert script.machine.state is UploadState.SENDING
        script.hear(request(1), ack(MissionResult.ERROR))
        script.hear(request(2), ack(MissionResult.ACCEPTED))
        assert script.machine.outcome.state is UploadState.ACCEPTED

    def test_errors_without_progress_are_one(self):
        script = Script(Upload(ON_1_18, MISSION, mission(3), window=1))
        script.hear(request(0), request(1))
        for _ in range(3):
            script.hear(ack(MissionResult.ERROR))
            resent = script.pass_time(0.6)
        assert script.machine.outcome.result is MissionResult.ERROR
        assert (script.machine.outcome.state, script.machine.outcome.item) == (UploadState.REFUSED, 1)
        assert resent == []

    def test_a_missing_last_word_is_asked_for_by_the_last_item(self):
        script = Script(Upload(ON_1_18, MISSION, mission(2)))
        script.hear(request(0), request(1))
        probes = script.pass_time(1.3)
        assert set(seqs(probes)) == {1}
        assert not [probe for probe in script.sent if isinstance(probe, m.MissionRequestList)]
        script.hear(ack(MissionResult.ACCEPTED))
        assert script.machine.outcome.state is UploadState.ACCEPTED

    def test_a_list_cut_short_is_ours_and_pushed_again(self):
        # The count of an upload that another process of ours left still counted.
        vehicle = Px4Vehicle(autopilot=PX4_1_18)
        vehicle.hold(MISSION, mission(12, 1))
        client = Client(VerifiedUpload(ON_1_18, MISSION, mission(20), is_active=False), PEER)
        twin = Twin(vehicle, [client])
        deliver, cut = twin._to_vehicle, []

        def shorten(frame):
            if isinstance(frame.message, m.MissionCount) and not cut:
                cut.append(frame)
                frame = replace(frame, message=replace(frame.message, count=7))
            deliver(frame)

        twin._to_vehicle = shorten
        twin.run()
        assert client.machine.outcome.is_verified
        assert client.machine.outcome.pushes == 2

    def test_limits(self):
        _, client = run(plain_fence(17), kind=FENCE)
        assert client.machine.outcome.kind is OutcomeKind.REFUSED
        assert client.machine.outcome.texts == ("68 fence items; the vehicle holds 64",)
        assert not any(isinstance(message, m.MissionCount) for _, message in client.sent)
        assert (
            Limits.of(PX4_1_18).problem([MissionItem(5100)] * 33, RALLY)
            == "33 rally items; the vehicle holds 32"
        )
        assert Limits.of(PX4_1_18).problem(plain_fence(16), FENCE) is None
        assert Limits.of(PX4_1_18).problem(mission(700), MISSION) is None

    def test_what_is_said_where_it_breaks_off(self):
        machine = VerifiedUpload(ON_1_18, MISSION, mission(20), is_active=False)
        script = Script(machine)
        script.hear(m.MissionCount(245, 190, 0))
        machine.backup_stored(0.0)
        script.pass_time(0.1)
        assert machine.has_written
        said = str(end_of_upload(OSError(5, "the link broke"), Writing("mission", machine, None)))
        assert (
            "the vehicle holds the complete old list or the complete new one: read it back to know which"
            in said
        )


class TestDownloads:
    def test_in_order_with_a_window(self):
        script = Script(Download(ON_1_18, MISSION))
        asked = script.hear(m.MissionCount(245, 190, 80))
        assert {type(message) for message in asked} == {m.MissionRequestInt}
        assert seqs(asked) == list(range(50))

    def test_a_gap_begins_anew_with_each_request_said_more_often_in_the_end_one_by_one(self):
        """The vehicle takes an item that it has just sent once more, and any later one ends the transfer."""
        script = Script(Download(ON_1_18, MISSION))
        item = own(m.MissionItemInt(0, 0, 1, 6, 16, 0, 1, 0, 0, 0, 0, 1, 1, 0))
        for asked in ([0, 1, 2], [0, 0, 1, 1, 2, 2], [0, 0, 0, 1, 1, 1, 2, 2, 2], [0], [0]):
            assert seqs(script.hear(m.MissionCount(245, 190, 3))) == asked
            if asked == [0]:
                script.hear(ack(MissionResult.ERROR))
            else:
                assert script.hear(*item) == []  # item 0 may only be late
            assert isinstance(script.pass_time(0.5)[-1], m.MissionRequestList)

    @pytest.mark.parametrize(("loss", "most_s"), [(0.05, 2.5), (0.1, 4.0)])
    def test_a_fence_is_soon_read_over_a_link_that_loses_some(self, loss, most_s):
        """17 items over a link of 0.2 s there and back: 20 seeds in the mean; one by one they take 4 s where nothing is lost."""
        took_s = []
        for seed in range(20):
            vehicle = Px4Vehicle(autopilot=PX4_1_18)
            vehicle.hold(FENCE, plain_fence(4))
            client = Client(Download(ON_1_18, FENCE), PEER)
            Twin(vehicle, [client], Faults(loss, 0.0, 0.1, 0.1), seed).run_until_ended(client, 60.0)
            assert client.machine.outcome.is_complete
            took_s.append(client.ended_s)
        assert sum(took_s) / len(took_s) < most_s

    def test_an_error_ends_the_vehicles_transfer(self):
        script = Script(Download(ON_1_18, MISSION))
        script.hear(m.MissionCount(245, 190, 5), ack(MissionResult.ERROR))
        assert isinstance(script.pass_time(0.5)[-1], m.MissionRequestList)
        assert script.machine.state is DownloadState.COUNTING

    def test_an_error_that_items_follow_was_about_something_else(self):
        script = Script(Download(ON_1_18, MISSION))
        script.hear(m.MissionCount(245, 190, 2), ack(MissionResult.ERROR))
        items = [m.MissionItemInt(245, 190, n, 6, 16, 0, 1, 0, 0, 0, 0, 1, 1, 0) for n in range(2)]
        script.hear(*items)
        assert script.machine.outcome.is_complete
        assert script.sent[-1] == m.MissionAck(1, 1, MissionResult.ACCEPTED)

    def test_the_last_one_is_asked_for_again(self):
        script = Script(Download(ON_1_18, MISSION, window=1))
        script.hear(m.MissionCount(245, 190, 2))
        assert seqs(script.pass_time(1.0))[0] == 0
        assert script.machine.state is DownloadState.FETCHING

    def test_items_of_a_reading_before_are_not_taken(self):
        script = Script(Download(ON_1_18, MISSION, window=1))
        script.hear(m.MissionCount(245, 190, 3))
        late = m.MissionItemInt(245, 190, 2, 6, 16, 0, 1, 0, 0, 0, 0, 1, 1, 0)
        script.hear(late)
        assert script.machine.progress == (0, 3)

    def test_a_repeated_count_is_no_other_list(self):
        script = Script(Download(ON_1_18, MISSION, window=1))
        script.hear(m.MissionCount(245, 190, 3))
        assert script.hear(m.MissionCount(245, 190, 3)) == []

    def test_the_old_form_is_never_used(self):
        script = Script(Download(ON_1_18, MISSION))
        script.hear(m.MissionCount(245, 190, 3))
        script.pass_time(9.0)
        assert not any(isinstance(message, m.MissionRequest) for message in script.sent)

    def test_silence_ends_with_a_word_that_frees_the_vehicle(self):
        script = Script(Download(ON_1_18, MISSION))
        script.hear(m.MissionCount(245, 190, 3))
        script.pass_time(30.0)
        assert script.machine.state is DownloadState.SILENT
        assert script.sent[-1] == CANCEL

    def test_a_busy_vehicle_says_so_by_text(self):
        script = Script(Download(ON_1_18, MISSION, rival_patience_s=2.0))
        for _ in range(4):
            script.hear(m.Statustext(6, "Mission download request ignored, already active\t"))
            script.pass_time(1.1)
        assert script.machine.outcome.state is DownloadState.BUSY

    def test_a_rival_half_way_is_waited_for(self):
        vehicle = Px4Vehicle(autopilot=PX4_1_18)
        rival = Client(Upload(replace(RIVAL, autopilot=PX4_1_18), MISSION, mission(30), window=1), RIVAL)
        rival.mute_after = 6
        client = Client(VerifiedUpload(ON_1_18, MISSION, mission(5), is_active=False), PEER, 0.3)
        Twin(vehicle, [rival, client]).run_until_ended(client, 100.0)
        assert client.machine.outcome.is_verified
        assert 4.0 < client.ended_s < 15.0


class TestModes:
    def test_the_heartbeat_counts_and_never_the_answer(self):
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.hold))
        assert script.sent == [m.CommandLong(1, 1, 176, 0, 1.0, 4.0, 3.0)]
        script.hear(m.CommandAck(176, 0))
        assert script.machine.state is SwitchState.ACCEPTED
        assert not script.machine.is_done
        again = script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.mission), after_s=1.0)[-1]
        assert (again.command, again.confirmation, again.param2, again.param3) == (176, 1, 4.0, 3.0)
        script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold))
        assert script.machine.state is SwitchState.SEEN

    def test_what_was_accepted_is_not_said_again(self):
        """Who has switched it back since may have meant it; a heartbeat that comes at once may be of before."""
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.mission))
        script.hear(m.CommandAck(176, 0), after_s=0.1)
        sent = script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold), after_s=1.0)
        assert not script.machine.is_done
        sent += script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold), after_s=1.0)
        assert {(one.command, one.param1) for one in sent} == {(512, 0.0)}  # heartbeats are asked for
        assert (script.machine.is_left, script.machine.is_granted) == (True, False)
        assert script.machine.result_name == "accepted, but not shown by its heartbeat"

    def test_what_was_not_answered_is_said_again(self):
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.mission))
        again = script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold), after_s=1.0)[-1]
        assert (again.command, again.confirmation, again.param3) == (176, 1, 4.0)

    def test_what_may_have_been_done_and_undone_unseen_is_not_said_again(self):
        """Nothing was heard for longer than a person needs to switch it back."""
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.mission))
        sent = script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold), after_s=1.2)
        assert {one.command for one in sent} == {512}
        assert (script.machine.is_left, script.machine.result_name) == (True, "no answer")

    def test_a_hold_that_is_said_again_unseen_says_so(self):
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.hold, is_urgent=True))
        sent = script.pass_time(1.05)
        assert [one.command for one in sent] == [*[512] * 9, 176]  # the question comes first
        assert script.machine.is_blind
        again = script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.mission), after_s=0.3)[-1]
        assert (again.command, again.confirmation) == (176, 2)
        assert not script.machine.is_blind  # it was as before: nothing was done that could be undone

    @pytest.mark.parametrize("heard_s", [0.2, None])
    def test_a_heartbeat_just_before_tells_enough(self, heard_s):
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.hold, is_urgent=True))
        if heard_s:
            script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.mission), after_s=heard_s)
        script.pass_time(1.05 - (heard_s or 0.0))
        assert script.machine.is_blind == (heard_s is None)

    def test_arming_is_known_by_the_heartbeat_too(self):
        script = Script(Arming(ON_1_17))
        assert script.sent == [m.CommandLong(1, 1, 400, 0, 1.0)]
        script.hear(m.Heartbeat(10, 12, 157, PX4_MODES.hold), after_s=0.2)
        assert (script.machine.state, script.machine.is_granted) == (SwitchState.SEEN, True)

    def test_a_refusal_is_believed(self):
        script = Script(ModeSwitch(ON_1_18, PX4_MODES.mission))
        script.hear(m.CommandAck(176, 1))
        assert script.machine.is_refused
        assert script.machine.result_name == "TEMPORARILY_REJECTED"

    def test_accepted_and_never_shown(self):
        script = Script(ModeSwitch(ON_1_17, PX4_MODES.hold))
        script.hear(m.CommandAck(176, 0))
        script.pass_time(9.0)
        assert script.machine.state is SwitchState.UNANSWERED
        assert not script.machine.is_granted

    @pytest.mark.parametrize("number", [4, 10, 11, 15])
    def test_ardupilots_numbers_are_never_sent(self, number):
        with pytest.raises(ValueError, match=f"{number} is not a mode of this autopilot"):
            Script(ModeSwitch(ON_1_18, number))

    def test_a_driving_px4_is_known_by_its_own_mode(self):
        watch = VehicleWatch()
        watch.receive(m.Heartbeat(10, 12, 157, PX4_MODES.mission), 1.0)
        assert watch.is_active(1.0)
        watch.receive(m.MissionCurrent(5, 6, 5), 1.0)
        assert not watch.is_active(1.0)
        watch.receive(m.Heartbeat(10, 12, 157, 10), 1.0)  # ArduPilot's AUTO is none here
        assert not watch.is_active(1.0)


class TestFirstItem:
    def test_it_is_asked_for_until_it_is_told(self):
        script = Script(BeginAtFirstItem(ON_1_17))
        assert script.sent == [m.MissionSetCurrent(1, 1, 0), m.CommandLong(1, 1, 512, param1=42.0)]
        assert script.hear(m.MissionCurrent(3, 6, 4)) == []
        script.pass_time(0.5)
        assert len(script.sent) == 4
        script.hear(m.MissionCurrent(0, 6, 2))
        assert script.machine.is_done

    def test_it_goes_on_without_an_answer(self):
        """1.18 keeps it until the mission is begun, and tells the old number until then."""
        script = Script(BeginAtFirstItem(ON_1_18))
        script.pass_time(2.0)
        assert script.machine.is_done
        assert len([one for one in script.sent if isinstance(one, m.MissionSetCurrent)]) == 4


class TestParameters:
    def test_whole_numbers_by_their_bits(self):
        script = Script(ReadParameters(ON_1_18, ["GF_ACTION", "NAV_ACC_RAD"]))
        script.hear(
            m.ParamValue("GF_ACTION", 2.802596928649634e-45, 6, 2, 0),
            m.ParamValue("NAV_ACC_RAD", 0.5, 9, 2, 1),
        )
        assert script.machine.outcome.values == {"GF_ACTION": 2.0, "NAV_ACC_RAD": 0.5}
        assert script.machine.outcome.types == {"GF_ACTION": 6, "NAV_ACC_RAD": 9}

    @pytest.mark.parametrize("value", [3.0, -7.0])
    def test_set_by_their_bits(self, value):
        script = Script(SetParameter(ON_1_18, "GF_ACTION", value, 6))
        (sent,) = script.sent
        assert (sent.param_type, sent.param_value != value) == (6, True)
        script.hear(m.ParamValue("GF_ACTION", sent.param_value, 6, 2, 65535))
        outcome = script.machine.outcome
        assert (outcome.is_confirmed, outcome.value) == (True, value)


def test_texts_that_are_a_reason():
    reasons = Reasons(ON_1_18, is_about_list=True)
    reasons.ask()
    texts = [
        (2, "IGN MISSION_ITEM: Invalid item\t"),
        (2, "Geofence violation for waypoint 2\t"),
        (2, "Preflight Fail: ekf2 missing data"),
        (2, "Failsafe activated\t"),
        (6, "Armed by external command\t"),
        (4, "Takeoff detected\t"),
    ]
    for severity, text in texts:
        reasons.take(m.Frame(1, 1, m.Statustext(severity, text)), 0.0)
    assert [text.strip() for text in reasons.texts] == [
        "IGN MISSION_ITEM: Invalid item",
        "Geofence violation for waypoint 2",
    ]
