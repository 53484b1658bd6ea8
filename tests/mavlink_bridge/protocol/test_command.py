"""Commands: results, progress, repetition."""

from __future__ import annotations

import pytest
from protocol.scripted import Script
from protocol.twin import PEER

from mavlink_bridge.mavlink.messages import (
    CommandAck,
    CommandInt,
    CommandLong,
    Heartbeat,
    MavResult,
    Statustext,
)
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.transitions import CommandState

ARM = CommandLong(1, 1, 400, param1=1.0)


def ack(result, command=400, **fields):
    return CommandAck(command, result, **fields)


@pytest.mark.parametrize(
    "result", [r for r in MavResult if r is not MavResult.IN_PROGRESS], ids=lambda r: r.name
)
def test_every_result_is_an_outcome(result):
    script = Script(SendCommand(PEER, ARM))
    assert script.sent == [ARM]
    script.hear(ack(result))
    outcome = script.machine.outcome
    assert (outcome.command, outcome.result) == (400, result)
    assert outcome.is_accepted is (result is MavResult.ACCEPTED)
    assert script.machine.progress == (100, 100)


def test_a_repeated_command_counts_its_confirmation_up():
    script = Script(SendCommand(PEER, ARM))
    script.pass_time(2.1)
    assert [message.confirmation for message in script.sent] == [0, 1, 2]


def test_command_int_is_repeated_as_it_is():
    message = CommandInt(1, 1, 0, 192)
    script = Script(SendCommand(PEER, message))
    script.pass_time(1.1)
    assert script.sent == [message, message]


def test_silence_is_no_result():
    script = Script(SendCommand(PEER, ARM))
    script.pass_time(script.machine.bound_s + 0.1)
    assert script.machine.state is CommandState.SILENT
    assert script.machine.outcome.result is None
    assert len(script.sent) == 6


def test_progress_is_waited_for_and_shown():
    script = Script(SendCommand(PEER, ARM))
    script.hear(ack(MavResult.IN_PROGRESS, progress=30))
    assert script.machine.progress == (30, 100)
    assert script.pass_time(9.0) == []
    script.hear(ack(MavResult.IN_PROGRESS, progress=255))
    assert script.machine.progress == (30, 100)
    script.pass_time(9.0)
    script.hear(ack(MavResult.ACCEPTED))
    assert script.machine.outcome.is_accepted


def test_progress_that_stops_is_silence():
    script = Script(SendCommand(PEER, ARM))
    script.hear(ack(MavResult.IN_PROGRESS, progress=30))
    script.pass_time(10.1)
    assert script.machine.state is CommandState.SILENT


def test_the_reason_is_kept():
    script = Script(SendCommand(PEER, ARM))
    script.hear(Statustext(2, "Arm: Radio failsafe on"), ack(MavResult.FAILED))
    assert script.machine.outcome.texts == ("Arm: Radio failsafe on",)


@pytest.mark.parametrize(
    ("message", "sender"),
    [
        (ack(0, command=176), 1),
        (ack(0), 2),
        (ack(0, target_system=255, target_component=190), 1),
        (ack(77), 1),
        (Heartbeat(10, 3), 1),
    ],
)
def test_other_answers_change_nothing(message, sender):
    script = Script(SendCommand(PEER, ARM))
    script.hear(message, system=sender)
    assert script.machine.state is CommandState.SENT


def test_an_unstarted_machine_is_quiet():
    machine = SendCommand(PEER, ARM)
    machine.handle_timer(1.0)
    assert machine.deadline_s is None
    assert machine.outcome is None
    assert machine.progress == (0, 100)
