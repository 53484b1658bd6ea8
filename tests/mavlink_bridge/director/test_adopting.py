"""A bridge that was killed while it drove goes on with its drive when it is begun anew, and with nobody else's."""

from __future__ import annotations

import json
import os
from dataclasses import replace

import pytest
from director.adopting import FOREIGN, HOME, TARGETS, UID, YARD, Killed, adopted_run, foreign_run

from mavlink_bridge.backup.drive_note import DriveNotes, note_from_json, note_to_json
from mavlink_bridge.director import Director, EventName, State
from mavlink_bridge.errors import BackupError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from missions.checking.drive_record import plan_again, record_of
from missions.fence import CircleZone, Fence, ZoneKind
from missions.firmware import Firmware
from missions.geo import LatLon, rounded
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import Fix, Known, Pose, Situation


@pytest.mark.parametrize("seed", [2, 3, 5, 7, 8, 11])
def test_a_drive_is_adopted_at_any_moment_and_held_where_a_fence_comes_across(seed):
    assert not adopted_run(seed).startswith("bad")


@pytest.mark.parametrize("kind", FOREIGN)
def test_a_drive_that_is_not_ours_is_left_alone_and_it_is_said_why(kind):
    assert not foreign_run(100, kind).startswith("bad")


def test_it_is_where_it_would_be_without_the_restart():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.4)
    before = one.run.director._parts
    one.restart(one.note)
    one.run.run_until(one.run.happened(EventName.DRIVING), 10)
    after = one.run.director._parts
    assert after.core.state is before.core.state is State.DRIVING
    plans = before.core.plan, after.core.plan
    assert plans[0].envelope.area.equals(plans[1].envelope.area)
    for name in (
        "items",
        "path",
        "seqs",
        "targets",
        "home",
        "asked_m",
        "driven_clearance_m",
        "duration_s",
        "fence",
    ):
        assert getattr(plans[0], name) == getattr(plans[1], name), name
    assert after.core.ours == before.core.ours
    assert after.core.target.position == before.core.plan.targets[-1]
    assert after.driver.is_our_drive
    assert after.driver.item >= before.driver.item
    assert after.halter.may_be_in_auto == before.halter.may_be_in_auto
    assert after.core.operator.is_ours(Mode.AUTO)


def test_an_operator_takes_over_an_adopted_drive_and_the_note_goes():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.2)
    one.restart(one.note)
    one.run.run_until(lambda: one.run.director.state is State.DRIVING, 10)
    one.run.ground_station(m.SetMode(1, 1, 0))
    one.run.run_until(lambda: one.run.director.state is State.LET_GO, 5)
    assert one.run.director.drive_note is None
    assert one.switched() == []


def test_a_takeover_while_the_item_is_waited_for_is_heeded():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.2)
    one.restart(one.note)
    director = one.run.director
    assert director.state is State.READY  # learnt, and no MISSION_CURRENT since
    director.receive(m.Frame(1, 1, m.Heartbeat(10, 3, 0x81, 0)), one.run.now_s)
    director.receive(m.Frame(1, 1, m.MissionCurrent(1)), one.run.now_s)
    assert director.state is State.LET_GO
    assert director.drive_note is None


def test_a_takeover_while_all_is_read_speaks_against_adopting():
    one = Killed(1, TARGETS[0], is_clean=True, latency_s=0.4)
    run = one.run
    one.drive_on(0.2)
    one.restart(one.note, until=State.LEARNING)
    for mode in (0, Mode.AUTO):
        run.ground_station(m.SetMode(1, 1, mode))
        until_s = run.now_s + 1.6
        run.run_until(lambda until_s=until_s: run.now_s >= until_s, 5)
    assert run.director.state is State.LEARNING
    run.run_until(run.happened(EventName.NOT_ADOPTED), 30)
    (told,) = (event.data["reason"] for event in run.events if event.name is EventName.NOT_ADOPTED)
    assert told == "it was disarmed, or not in AUTO, while this bridge read its lists"
    assert not run.happened(EventName.ADOPTED)()
    assert one.switched() == []


def test_a_fence_put_across_while_all_is_read_is_known_before_the_drive_is_adopted():
    one = Killed(1, TARGETS[0], is_clean=True, latency_s=0.4)
    run = one.run
    one.drive_on(0.2)
    place = one.place_ahead()
    one.restart(one.note, until=State.LEARNING)
    until_s = run.now_s + 3.0
    run.run_until(lambda: run.now_s >= until_s, 5)  # the fence is read by then
    one.put_fence(place)
    run.run_until(run.happened(EventName.ADOPTED), 30)
    adopted_s = run.now_s
    run.run_until(lambda: Mode.HOLD in one.switched(), 3)
    assert run.now_s - adopted_s < 1.0
    assert run.director.situation.fence.value.zones[-1].centre == rounded(place)


def test_a_drive_whose_item_the_vehicle_does_not_tell_is_not_adopted_and_it_is_said():
    one = Killed(1, TARGETS[0], is_clean=True)
    run = one.run
    one.drive_on(0.2)
    send = one.vehicle.messages_to_send
    one.vehicle.messages_to_send = lambda: [
        message for message in send() if not isinstance(message, m.MissionCurrent)
    ]
    one.restart(one.note)
    run.run_until(run.happened(EventName.NOT_ADOPTED), 15)
    assert [event.data["reason"] for event in run.events if event.name is EventName.NOT_ADOPTED] == [
        "the vehicle does not report which item it drives to"
    ]


def test_an_arrival_while_nobody_was_there_is_told_and_held():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.9)
    note = one.note
    one.be_away(40)
    one.restart(note)
    one.run.run_until(lambda: one.run.director.state is State.ARRIVED, 20)
    one.run.run_until(lambda: one.vehicle.mode == Mode.HOLD, 5)


def test_without_drive_it_is_only_watched():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.1)
    one.restart(one.note, drive=False, arm=False)
    one.run.run_until(one.run.happened(EventName.ADOPTED), 10)
    assert "only watched" in one.run.last(EventName.ADOPTED).text
    one.put_fence(one.place_ahead())
    one.run.run_until(one.run.happened(EventName.ROUTE_BROKEN), 20)
    assert one.switched() == []


def test_its_own_target_given_again_leaves_the_drive_as_it_is_and_another_ends_it():
    for target, is_held in ((TARGETS[0], False), (TARGETS[1], True)):
        one = Killed(1, TARGETS[0], is_clean=True)
        one.drive_on(0.1)
        one.restart(one.note, request=Request(targets=(target,), clearance_m=2.5))
        until_s = one.run.now_s + 3
        one.run.run_until(lambda until_s=until_s, one=one: one.run.now_s >= until_s)
        assert (Mode.HOLD in one.switched()) is is_held
        assert one.run.happened(EventName.ADOPTED)() is not is_held


def test_a_drive_that_cannot_be_noted_is_not_begun():
    one = Killed(1, TARGETS[0], is_clean=True)
    run = one.run
    run.run_until(lambda: run.director.state is State.ARRIVED)
    run.run_until(lambda: run.director.drive_note is None, 5)
    run.sent.clear()
    director, run.director.note_stored = run.director, lambda: None
    director.take_target(HOME, run.now_s)
    run.run_until(lambda: director.drive_note is not None, 30)
    director.note_failed(BackupError("no space left on device"), run.now_s)
    assert (director.state, director.drive_note) == (State.VERIFIED, None)
    until_s = run.now_s + 5
    run.run_until(lambda: run.now_s >= until_s)
    assert Mode.AUTO not in one.switched()


@pytest.mark.parametrize(
    "request_",
    [Request(targets=(TARGETS[0], TARGETS[1]), comes_back=True), Request(targets=TARGETS[:1], end="loiter")],
)
def test_a_note_holds_all_that_a_plan_needs(tmp_path, request_):
    situation = Situation(
        ardupilot=True,
        firmware=Firmware(4, 6, 3),
        vehicle_type=10,
        parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0},
        fence=Known(
            Fence((*YARD.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0721, -105.2301), 1.37))), None, ""
        ),
        home=Known(HOME, None, ""),
        pose=Known(Pose(HOME, 30.0), 0.0, ""),
        fix=Known(Fix(6, 0.02), 0.0, ""),
    )
    made = plan(situation, replace(request_, clearance_m=1.5))
    one = Killed(1, TARGETS[0], is_clean=True)
    note = replace(one.note, record=record_of(made, situation))
    notes = DriveNotes(tmp_path / "notes")
    notes.keep(note)
    ((again,), troubles) = notes.read()
    assert again == note
    assert not troubles
    found = plan_again(again.record)
    assert (found.path, found.seqs, found.targets) == (made.path, made.seqs, made.targets)
    assert found.envelope.area.equals(made.envelope.area)
    notes.end(note.vehicle)
    assert notes.read() == ((), [])


def test_a_note_that_was_changed_or_broken_is_said_and_not_used(tmp_path):
    one = Killed(1, TARGETS[0], is_clean=True)
    content = note_to_json(one.note)
    assert note_from_json(content).vehicle.uid == UID.ljust(18, b"\0").rstrip(b"\0").hex()
    broken = [{**content, "boot_ms": 0}, {**content, "format": 9}, {}, [], {"sha256": 1}]
    for number, one_of_them in enumerate(broken):
        (tmp_path / f"drive-under-way-{number}.json").write_text(json.dumps(one_of_them))
    (tmp_path / "drive-under-way-x.json").write_bytes(b"\xff{")
    found, troubles = DriveNotes(tmp_path).read()
    assert found == ()
    assert len(troubles) == len(broken) + 1


def test_what_is_no_file_or_far_too_large_is_no_note(tmp_path):
    os.mkfifo(tmp_path / "drive-under-way-a.json")
    with (tmp_path / "drive-under-way-b.json").open("wb") as file:
        file.truncate(5_000_000)
    (tmp_path / "drive-under-way-c.json").write_text("[]")
    notes, troubles = DriveNotes(tmp_path).read()
    assert notes == ()
    assert len(troubles) == 3


def test_a_single_job_adopts_nothing():
    one = Killed(1, TARGETS[0], is_clean=True)
    one.drive_on(0.1)
    director = Director(replace(one.orders, once=True), None, (one.note,))
    assert not director._parts.adopter.look(0.0)
