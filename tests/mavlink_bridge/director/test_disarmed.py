"""No vehicle is left disarmed in AUTO by us: arming it would set it going. And none is left armed in AUTO after our drive."""

from __future__ import annotations

from dataclasses import replace

import pytest
from director.test_bridge_director import FAR, NEAR, arm, conductor, driving, ready
from director.test_takeover import MANUAL, armings_sent, modes_sent, unheard, wait

from mavlink_bridge.director import EventName, State
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.faults import Faults
from missions.geo import distance_m
from missions.items import Command
from missions.request import Request

DISARM = m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0)
ARM = replace(DISARM, param1=1.0)
ONE_JOB = Request(targets=(FAR,), clearance_m=2.5)


def disarm_when(run, is_time) -> list[float]:
    """Disarm the vehicle once something is so, unheard; return when that was."""
    when: list[float] = []

    def meddle(run) -> None:
        if not when and is_time():
            when.append(run.now_s)
            unheard(run, DISARM)

    run.meddle = meddle
    return when


def sends_auto(run) -> bool:
    return Mode.AUTO in modes_sent(run)


@pytest.mark.parametrize("mode", [MANUAL, Mode.HOLD, 15])
def test_the_mode_of_a_disarmed_vehicle_is_left_alone(mode):
    run = conductor(request=ONE_JOB, once=True)
    run.vehicles[0].rover.mode = type(run.vehicles[0].mode)(mode)
    assert run.run() is State.FAILED
    assert isinstance(run.director.trouble, OutcomeError)
    assert "not armed" in str(run.director.trouble)
    assert run.director.upload_outcome.is_verified
    assert modes_sent(run) == []
    assert (run.vehicles[0].mode, run.vehicles[0].is_armed) == (mode, False)
    unheard(run, ARM)
    wait(run, 5)
    assert distance_m(run.vehicles[0].position, run.director.plan.start) < 0.1


def test_a_disarmed_vehicle_that_somebody_left_in_auto_is_told_of():
    run = conductor(request=ONE_JOB, once=True)
    run.vehicles[0].rover.mode = type(run.vehicles[0].mode)(Mode.AUTO)
    assert run.run() is State.FAILED
    assert "(AUTO: arming it makes it drive)" in str(run.director.trouble)
    assert modes_sent(run) == []


def test_armed_meanwhile_it_drives_for_a_target_that_is_given_again():
    run = ready(conductor())
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.TROUBLE), 20)
    arm(run)
    wait(run, 5)
    assert not sends_auto(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.ARRIVED)


@pytest.mark.parametrize("once", [True, False])
@pytest.mark.parametrize("late_s", [0.0, 0.02, 0.06, 0.3, 1.0, 2.0])
def test_disarmed_between_the_look_and_the_switch_it_is_put_back_to_hold(once, late_s):
    run = conductor(once=once, request=ONE_JOB)
    arm(run)
    begun: list[float] = []

    def is_time() -> bool:
        if not begun and sends_auto(run):
            begun.append(run.now_s)
        return bool(begun) and run.now_s >= begun[0] + late_s

    when = disarm_when(run, is_time)
    run.run_until(lambda: bool(when) and run.director.state in (State.FAILED, State.LET_GO), 60)
    wait(run, 6)
    vehicle = run.vehicles[0]
    assert (vehicle.mode, vehicle.is_armed) == (Mode.HOLD, False)
    assert (
        "the vehicle was disarmed by itself or by somebody not heard on this link, such as an RC transmitter"
        in str(run.director.trouble)
    )
    place = vehicle.position
    unheard(run, ARM)
    wait(run, 5)
    assert distance_m(vehicle.position, place) < 0.1
    assert armings_sent(run) == 0


def test_over_a_bad_link_too():
    ended = 0
    for seed in range(1, 25):
        run = conductor(once=True, request=ONE_JOB, faults=Faults(loss=0.25, latency_s=0.1, jitter_s=0.2))
        run.up, run.down = (type(run.up)(run.faults, 10 * seed + side) for side in (1, 2))
        unheard(run, ARM)
        when = disarm_when(run, lambda run=run: run.vehicles[0].mode == Mode.AUTO)
        assert run.run() is State.FAILED
        if when:  # else the link was so bad that it never came to AUTO
            ended += 1
            assert run.vehicles[0].mode == Mode.HOLD, seed
            assert "switched back from AUTO to HOLD" in str(run.director.trouble)
    assert ended >= 12


@pytest.mark.parametrize("clash_s", [0.0, 0.02, 0.5, 1.0])
@pytest.mark.parametrize("disarmed_s", [0.0, 2.0])
def test_somebody_with_our_ids_does_not_leave_it_in_auto(disarmed_s, clash_s):
    run = conductor(once=True, request=ONE_JOB, faults=Faults(latency_s=0.15))
    arm(run)
    begun: list[float] = []

    def is_time() -> bool:
        if not begun and sends_auto(run):
            begun.append(run.now_s)
        return bool(begun) and run.now_s >= begun[0] + disarmed_s

    when = disarm_when(run, is_time)
    run.run_until(lambda: bool(when), 60)
    wait(run, clash_s)
    run.director.receive(m.Frame(*run.director.identity, m.Heartbeat(6, 8)), run.now_s)
    wait(run, 12)
    assert (run.vehicles[0].mode, run.vehicles[0].is_armed) == (Mode.HOLD, False)
    assert run.director.state is State.FAILED


@pytest.mark.parametrize("unheard_s", [5.5, 40.0])
def test_disarmed_while_the_link_was_lost_it_is_put_back_too(unheard_s):
    run = driving(conductor())
    wait(run, 3)
    run.is_cut = True
    unheard(run, DISARM)
    wait(run, unheard_s)
    run.is_cut = False
    wait(run, 15)
    assert (run.vehicles[0].mode, run.vehicles[0].is_armed) == (Mode.HOLD, False)
    assert "disarmed while the link was lost; it was switched back from AUTO" in str(run.director.trouble)


def test_what_drives_on_while_the_link_was_lost_is_not_touched():
    run = driving(conductor())
    wait(run, 3)
    run.is_cut = True
    wait(run, 8)
    run.is_cut = False
    sent = len(run.sent)
    wait(run, 15)
    assert run.vehicles[0].mode == Mode.AUTO
    assert modes_sent(run, sent) == []


def test_who_switches_or_arms_it_first_has_it():
    run = driving(conductor())
    wait(run, 3)
    run.is_cut = True
    unheard(run, DISARM)
    wait(run, 0.1)
    unheard(run, m.SetMode(1, 1, MANUAL))
    sent = len(run.sent)
    wait(run, 0.5)
    run.is_cut = False
    wait(run, 6)
    assert run.vehicles[0].mode == MANUAL
    assert modes_sent(run, sent) == []


def test_a_vehicle_that_does_not_go_to_hold_is_told_of():
    run = conductor(once=True, request=ONE_JOB)
    arm(run)
    when = disarm_when(run, lambda: run.vehicles[0].mode == Mode.AUTO)
    push = run.up.push

    def deaf(frame, now_s) -> None:
        is_hold = isinstance(frame.message, m.CommandLong) and frame.message.param2 == Mode.HOLD
        if not (when and is_hold):
            push(frame, now_s)

    run.up.push = deaf
    assert run.run() is State.FAILED
    assert "it is in AUTO, where arming it makes it drive" in str(run.director.trouble)


@pytest.mark.parametrize("once", [True, False])
def test_after_our_drive_it_stands_in_hold(once):
    run = conductor(once=once, request=ONE_JOB)
    arm(run)
    run.run_until(run.happened(EventName.ARRIVED))
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    assert run.vehicles[0].is_armed
    assert run.last(EventName.ARRIVED).text.endswith("; HOLD")
    if once:
        assert run.run() is State.DONE
    assert run.director.trouble is None
    wait(run, 3)
    assert modes_sent(run)[-1] == Mode.HOLD


def test_a_hold_that_is_lost_after_arrival_is_sent_again_until_it_shows():
    run = conductor(once=True, request=ONE_JOB)
    arm(run)
    run.run_until(run.happened(EventName.ARRIVED))
    run.up._faults = run.down._faults = Faults(loss=0.5)
    assert run.run() is State.DONE
    assert run.vehicles[0].mode == Mode.HOLD


def test_an_arrival_without_hold_is_an_outcome():
    run = conductor(once=True, request=ONE_JOB)
    arm(run)
    push, deaf_since = run.up.push, []

    def deaf(frame, now_s) -> None:
        is_hold = isinstance(frame.message, m.CommandLong) and frame.message.param2 == Mode.HOLD
        if not (deaf_since and is_hold):
            push(frame, now_s)

    run.up.push = deaf
    run.run_until(lambda: run.director.state is State.DRIVING)
    deaf_since.append(run.now_s)
    assert run.run() is State.FAILED
    assert "arrived, but the vehicle did not switch to HOLD" in str(run.director.trouble)
    assert isinstance(run.director.trouble, OutcomeError)


def test_somebody_who_takes_it_at_the_end_has_it_and_it_has_arrived():
    run = conductor(once=True, request=ONE_JOB)
    arm(run)
    run.run_until(run.happened(EventName.ARRIVED))
    run.up._faults = Faults(loss=1.0)  # our HOLD does not get through
    unheard(run, m.SetMode(1, 1, MANUAL))
    assert run.run() is State.DONE
    assert run.vehicles[0].mode == MANUAL


@pytest.mark.parametrize("behaviour", [1.0, 3.0])
def test_what_the_vehicle_does_at_the_end_by_its_own_settings_is_left_to_it(behaviour):
    run = conductor(once=True, request=replace(ONE_JOB, targets=(NEAR,)))
    run.vehicles[0].rover.parameters.set("MIS_DONE_BEHAVE", behaviour)
    arm(run)
    assert run.run() is State.DONE
    assert run.last(EventName.ARRIVED).text.endswith(" s")
    assert run.vehicles[0].mode == Mode.AUTO


def test_a_drive_that_somebody_else_began_is_not_held_at_its_end():
    run = conductor(drive=False, request=ONE_JOB)
    run.run_until(run.happened(EventName.VERIFIED))
    arm(run)
    unheard(run, m.SetMode(1, 1, Mode.AUTO))
    run.run_until(run.happened(EventName.ARRIVED))
    wait(run, 3)
    assert run.vehicles[0].mode == Mode.AUTO
    assert modes_sent(run) == []


def test_hold_stops_a_vehicle_that_drives_its_mission_before_it_is_replaced():
    run = conductor(once=True, drive=False, hold=True, request=ONE_JOB)
    first = driving(conductor())
    wait(first, 5)
    run.vehicles[0] = first.vehicles[0]
    run.now_s = first.now_s
    assert run.run() is State.DONE
    assert modes_sent(run)[0] == Mode.HOLD
    assert run.vehicles[0].mode == Mode.HOLD
    assert run.director.upload_outcome.is_verified


def test_without_hold_it_is_refused_and_drives_on():
    run = conductor(once=True, drive=False, request=replace(ONE_JOB, targets=(NEAR,)))
    first = driving(conductor())
    wait(first, 5)
    run.vehicles[0] = first.vehicles[0]
    run.now_s = first.now_s
    assert run.run() is State.FAILED
    assert "driving its mission in AUTO; nothing was written" in str(run.director.trouble)
    assert modes_sent(run) == []


def test_a_mission_that_the_vehicle_calls_complete_may_be_replaced():
    first = conductor(drive=False, request=ONE_JOB)
    first.run_until(first.happened(EventName.VERIFIED))
    arm(first)
    unheard(first, m.SetMode(1, 1, Mode.AUTO))
    first.run_until(first.happened(EventName.ARRIVED))
    wait(first, 5)
    run = conductor(once=True, drive=False, request=replace(ONE_JOB, targets=(NEAR,)))
    run.vehicles[0] = first.vehicles[0]
    run.now_s = first.now_s
    place = run.vehicles[0].position
    assert run.run() is State.DONE
    assert run.vehicles[0].mode == Mode.AUTO
    wait(run, 5)
    assert distance_m(run.vehicles[0].position, place) < 0.1
