"""The answer to a command of ours is lost, and the operator acts before a heartbeat tells what became of it: said again, it would be his word that is undone."""

from __future__ import annotations

import pytest
from director.test_bridge_director import FAR, NEAR, arm, conductor, driving, ready
from director.test_takeover import (
    MANUAL,
    armings_sent,
    deaf_to,
    left_alone,
    modes_sent,
    unheard,
    wait,
)

from mavlink_bridge.director import EventName, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.faults import Faults
from missions.items import Command

DISARM = m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0)


def losing_commands(run, number: int, times: int) -> None:
    """Lose a command on its way up so many times."""
    receive, lost = run.vehicles[0].receive, []

    def take(frame, now_s) -> None:
        if getattr(frame.message, "command", None) == number and len(lost) < times:
            lost.append(now_s)
            return
        receive(frame, now_s)

    run.vehicles[0].receive = take


def silent_from(run, number: int) -> None:
    """Lose all that the vehicle says from a command of ours on, its answer as well."""
    receive, push = run.vehicles[0].receive, run.down.push

    def take(frame, now_s) -> None:
        if getattr(frame.message, "command", None) == number:
            run.vehicles[0].receive = receive
            run.down.push = lambda _frame, _now_s: None
        receive(frame, now_s)

    run.vehicles[0].receive = take
    run.hear_again = lambda: setattr(run.down, "push", push)


def held_for_a_new_route(run) -> int:
    """Have the bridge stop the vehicle for a target, the answers lost; return how many messages were sent before."""
    wait(run, 6)
    deaf_to(run, m.CommandAck)
    sent = len(run.sent)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    return sent


def in_hold(run) -> None:
    """Let somebody put the vehicle into the mode that it is started from."""
    unheard(run, m.SetMode(1, 1, Mode.HOLD))
    wait(run, 1.5)


def starting(run) -> None:
    """Let a verified mission be started."""
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.STARTING, 60)


@pytest.mark.parametrize("after_s", [0.02, 0.1, 0.2, 0.3, 0.45, 0.6, 0.9])
@pytest.mark.parametrize("mode", [MANUAL, Mode.RTL])
def test_the_answer_to_hold_is_lost(mode, after_s):
    run = driving(conductor())
    sent = held_for_a_new_route(run)
    wait(run, after_s)
    unheard(run, m.SetMode(1, 1, mode))
    assert left_alone(run, mode)
    assert modes_sent(run, sent) == [Mode.HOLD]
    assert run.director.state is State.LET_GO


def taken_while_nothing_is_heard_after_hold(deaf_s):
    run = driving(conductor())
    wait(run, 6)
    silent_from(run, Command.DO_SET_MODE)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    wait(run, 0.1)
    unheard(run, m.SetMode(1, 1, MANUAL))
    wait(run, deaf_s)
    run.hear_again()
    return run


def test_nothing_at_all_is_heard_for_less_than_a_second_after_hold():
    """HOLD is not said again so soon."""
    run = taken_while_nothing_is_heard_after_hold(0.6)
    assert left_alone(run, MANUAL)
    assert run.director.state is State.LET_GO


@pytest.mark.parametrize("deaf_s", [1.2, 3.0])
def test_nothing_at_all_is_heard_after_hold(deaf_s):
    """Who has taken the vehicle meanwhile is overridden by HOLD, and it is not driven on."""
    run = taken_while_nothing_is_heard_after_hold(deaf_s)
    assert left_alone(run, Mode.HOLD)
    assert modes_sent(run)[-1] == Mode.HOLD
    assert run.director.state is State.LET_GO
    assert "HOLD was said again while nothing was heard" in run.last(EventName.TAKEN_OVER).text
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)


@pytest.mark.parametrize("times", [1, 2, 4])
def test_a_hold_that_is_lost_itself_is_said_again_and_the_new_route_driven(times):
    run = driving(conductor())
    wait(run, 6)
    losing_commands(run, Command.DO_SET_MODE, times)
    before = len(run.events)
    begun_s = run.now_s
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 5)
    assert run.now_s - begun_s <= 0.5 * times + 0.1
    run.run_until(run.happened(EventName.DRIVING, before), 60)
    assert EventName.TAKEN_OVER not in [event.name for event in run.events]


@pytest.mark.parametrize("after_s", [0.3, 0.5, 0.7, 0.9])
def test_the_answer_to_auto_is_lost(after_s):
    run = ready(conductor())
    arm(run)
    deaf_to(run, m.CommandAck)
    starting(run)
    run.run_until(lambda: run.vehicles[0].mode == Mode.AUTO, 10)
    wait(run, after_s)
    unheard(run, m.SetMode(1, 1, Mode.HOLD))
    assert left_alone(run, Mode.HOLD)
    assert modes_sent(run).count(Mode.AUTO) == 1
    assert run.director.state is State.LET_GO


@pytest.mark.parametrize("after_s", [0.02, 0.1, 0.5, 1.0])
def test_nothing_at_all_is_heard_after_auto(after_s):
    run = ready(conductor())
    arm(run)
    in_hold(run)
    starting(run)
    silent_from(run, Command.DO_SET_MODE)
    run.run_until(lambda: run.vehicles[0].mode == Mode.AUTO, 10)
    wait(run, after_s)
    unheard(run, m.SetMode(1, 1, Mode.HOLD))
    wait(run, 1.5 - after_s)
    run.hear_again()
    assert left_alone(run, Mode.HOLD)
    assert modes_sent(run).count(Mode.AUTO) == 1
    assert run.director.state is State.LET_GO


@pytest.mark.parametrize("times", [1, 2])
def test_an_auto_that_is_lost_itself_is_said_again(times):
    run = ready(conductor())
    arm(run)
    in_hold(run)
    losing_commands(run, Command.DO_SET_MODE, times)
    starting(run)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    assert modes_sent(run).count(Mode.AUTO) == times + 1


@pytest.mark.parametrize("after_s", [0.3, 0.6, 0.9])
def test_the_answer_to_arming_is_lost(after_s):
    run = ready(conductor(arm=True))
    deaf_to(run, m.CommandAck)
    starting(run)
    vehicle = run.vehicles[0]
    run.run_until(lambda: vehicle.is_armed, 10)
    losing_commands(run, Command.DO_SET_MODE, 1000)  # what comes after arming is not looked at here
    wait(run, after_s)
    unheard(run, DISARM)
    wait(run, 12)
    assert not vehicle.is_armed
    assert armings_sent(run) == 1


def test_nothing_at_all_is_heard_after_arming():
    run = ready(conductor(arm=True))
    in_hold(run)
    starting(run)
    silent_from(run, Command.COMPONENT_ARM_DISARM)
    run.run_until(lambda: run.vehicles[0].is_armed, 10)
    unheard(run, DISARM)
    wait(run, 1.5)
    run.hear_again()
    wait(run, 12)
    assert not run.vehicles[0].is_armed
    assert armings_sent(run) == 1
    assert Mode.AUTO not in modes_sent(run)
    assert run.last(EventName.COMMAND_FAILED).data["result"] == "no answer"


@pytest.mark.parametrize("times", [1, 2])
def test_an_arming_that_is_lost_itself_is_said_again(times):
    run = ready(conductor(arm=True))
    losing_commands(run, Command.COMPONENT_ARM_DISARM, times)
    starting(run)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    assert armings_sent(run) == times + 1


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(6))
def test_over_a_link_that_loses_a_tenth_new_targets_are_driven_to(seed):
    """Without an operator nobody is taken for one."""
    run = ready(conductor(faults=Faults(loss=0.1, jitter_s=0.2), arm=True))
    run.down._random.seed(seed)
    run.up._random.seed(100 + seed)
    for number in range(4):
        before = len(run.events)
        run.director.take_target((FAR, NEAR)[number % 2], run.now_s)
        run.run_until(run.happened(EventName.DRIVING, before), 90)
        wait(run, 5)
    assert EventName.TAKEN_OVER not in [event.name for event in run.events]
