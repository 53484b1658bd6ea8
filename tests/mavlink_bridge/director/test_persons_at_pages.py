"""What persons at pages of ours ask of the director: HOLD whatever the state, and the word to drive."""

from __future__ import annotations

from dataclasses import replace

import pytest
from director.test_bridge_director import FAR, NEAR, conductor, driving, ready

from mavlink_bridge.director import EventName, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.faults import Faults
from missions.request import Tour


def wait(run, seconds: float) -> None:
    until_s = run.now_s + seconds
    while run.now_s < until_s:
        run.step()


def held(run) -> bool:
    return run.director.situation.mode == Mode.HOLD


def test_a_hold_stops_a_drive_and_nothing_goes_on_by_itself():
    run = driving(conductor())
    wait(run, 5.0)
    sent = len(run.sent)
    run.director.hold("asked for by page 1", run.now_s)
    assert run.director.state is State.LET_GO
    first = run.director.messages_to_send()
    assert isinstance(first[0], m.CommandLong)
    assert (first[0].param2, len(run.sent)) == (Mode.HOLD, sent)  # before anything else
    run.director.hold("asked for by page 2", run.now_s)  # twice is no harm, and the first was lost
    run.run_until(lambda: held(run), 5)
    assert run.last(EventName.HOLDING).data["reason"] == "asked for by page 2"
    wait(run, 20.0)
    assert held(run)
    assert run.director.state is State.LET_GO
    assert run.director.drive is None
    run.director.take_target(FAR, run.now_s)  # and a person may go on
    run.run_until(run.happened(EventName.ARRIVED, len(run.events)), 200)


def test_a_hold_that_is_lost_on_the_way_is_sent_until_a_heartbeat_shows_it():
    run = driving(conductor())
    wait(run, 3.0)
    vehicle = run.vehicles[0]
    receive, lost = vehicle.receive, []

    def deaf(frame, now_s):
        message = frame.message
        if isinstance(message, m.CommandLong) and message.param2 == Mode.HOLD and len(lost) < 4:
            lost.append(now_s)
        else:
            receive(frame, now_s)

    vehicle.receive = deaf
    run.director.hold("asked for", run.now_s)
    run.run_until(lambda: held(run), 10)
    assert len(lost) == 4


@pytest.mark.parametrize("state", [State.PLANNING, State.UPLOADING, State.VERIFIED, State.STARTING])
def test_a_hold_ends_whatever_was_on_the_way_to_a_drive(state):
    run = ready(conductor(arm=True, starts_on_word=state is State.VERIFIED))
    run.planning_s = 1.0
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is state, 30)
    run.director.hold("asked for", run.now_s)
    wait(run, 40.0)
    assert run.director.state is State.LET_GO
    assert not any(event.name is EventName.DRIVING for event in run.events)
    assert run.director.situation.mode == Mode.HOLD
    mission = run.vehicles[0].mission  # whole or none: an upload is finished or undone
    planned = run.director.plan
    assert len(mission) in ({0, 1} if planned is None else {0, 1, len(planned.items) + 1})


def test_a_hold_needs_the_permission_to_drive_and_a_vehicle():
    run = conductor()
    run.director.hold("asked for", 0.0)
    assert run.director.messages_to_send() == []
    run = ready(conductor(drive=False))
    run.director.hold("asked for", run.now_s)
    assert run.director.state is State.READY
    assert not any(isinstance(one, m.CommandLong) for one in run.director.messages_to_send())


def test_a_hold_is_sent_also_where_the_vehicle_is_not_heard():
    run = driving(conductor())
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 20)
    run.director.hold("asked for", run.now_s)
    wait(run, 2.0)
    assert run.vehicles[0].mode == Mode.HOLD  # the other way still works


def test_a_verified_mission_waits_for_the_word_and_a_new_target_takes_it_back():
    run = ready(conductor(arm=True, starts_on_word=True))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 30)
    wait(run, 5.0)
    assert run.director.state is State.VERIFIED
    run.director.start_drive(run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 60)
    wait(run, 5.0)
    assert run.director.state is State.VERIFIED


def test_the_word_may_come_before_the_mission_is_verified():
    run = ready(conductor(arm=True, starts_on_word=True, confirm=True))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.awaits_confirmation, 30)
    run.director.confirm(run.now_s)
    run.director.start_drive(run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 30)


def test_without_permission_the_word_does_nothing():
    run = ready(conductor(drive=False, starts_on_word=True))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 30)
    run.director.start_drive(run.now_s)
    wait(run, 2.0)
    assert run.director.state is State.VERIFIED


def arming():
    """A start at the moment when the rover is armed, and not in AUTO yet."""
    run = conductor(
        faults=Faults(latency_s=0.1), arm=True, starts_on_word=True
    )  # else AUTO is on its way at once
    run.run_until(lambda: run.director.state is State.READY, 30)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 30)
    run.director.start_drive(run.now_s)
    run.run_until(lambda: run.vehicles[0].is_armed, 20)
    assert run.director.state is State.STARTING
    return run


def said_armed(run) -> list:
    return [event for event in run.events if event.name is EventName.LEFT_ARMED]


@pytest.mark.parametrize("how", ["withheld", "held", "told another target"])
def test_a_rover_that_was_armed_for_a_drive_that_did_not_begin_is_told_of_until_it_is_disarmed(how):
    run = arming()
    assert not run.director.is_left_armed
    if how == "withheld":
        run.director.withhold_drive(run.now_s)
    elif how == "held":
        run.director.hold("asked for", run.now_s)
    else:
        run.director.take_target(NEAR, run.now_s)
    wait(run, 10.0)
    assert held(run)
    assert run.director.is_left_armed
    (told,) = said_armed(run)  # once
    assert "stands armed in HOLD" in told.text
    run.vehicles[0].rover.is_armed = False  # by the transmitter
    wait(run, 3.0)
    assert not run.director.is_left_armed
    assert len(said_armed(run)) == 1


def test_a_rover_that_was_armed_and_is_started_again_drives_and_nothing_more_is_said_of_it():
    run = arming()
    run.director.withhold_drive(run.now_s)
    wait(run, 4.0)
    assert run.director.is_left_armed
    run.director.start_drive(run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    assert not run.director.is_left_armed
    run.director.hold("asked for", run.now_s)  # who stops a drive knows that it is armed
    wait(run, 10.0)
    assert held(run)
    assert not run.director.is_left_armed
    assert len(said_armed(run)) == 1


def test_a_rover_that_somebody_else_drives_or_that_was_armed_before_is_not_told_of():
    run = arming()
    run.director.withhold_drive(run.now_s)
    wait(run, 4.0)
    run.vehicles[0].rover.mode = Mode.MANUAL
    wait(run, 3.0)
    run.vehicles[0].rover.mode = Mode.HOLD
    wait(run, 3.0)
    assert not run.director.is_left_armed
    run = ready(conductor(arm=True, starts_on_word=True))  # armed by its operator
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 30)
    run.director.start_drive(run.now_s)
    run.director.withhold_drive(run.now_s)
    wait(run, 5.0)
    assert not said_armed(run)


def test_a_request_of_a_page_takes_the_place_of_the_orders_own():
    run = ready(conductor(drive=False))
    run.director.take_request(Tour(targets=(NEAR, FAR), clearance_m=2.25), run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 30)
    assert run.director.plan.targets == (NEAR, FAR)
    assert run.director.plan.clearance_m == 2.25
    assert run.director.orders.upload
    assert run.director.has_our_mission
    run.run_until(lambda: not run.director.is_transferring, 10)
    before = run.director.situation.fence
    run.director.suspect_lists()
    run.run_until(lambda: run.director.situation.fence is not before, 30)
    assert replace(run.director.situation.fence, time_s=None) == replace(before, time_s=None)
