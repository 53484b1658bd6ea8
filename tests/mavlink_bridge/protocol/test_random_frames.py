"""Random, truncated and damaged frames into every machine: no exception, no wrong outcome."""

from __future__ import annotations

from dataclasses import fields

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from protocol.twin import PEER, plain_mission

from mavlink_bridge.mavlink import messages
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import CommandLong, Frame, MissionType
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.parameters import ReadParameters, SetParameter
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.protocol.verified_upload import OutcomeKind, VerifiedUpload
from mavlink_bridge.protocol.wire import item_from_message

MISSION = MissionType.MISSION
NUMBERS = st.one_of(
    st.sampled_from([0, 1, 2, 3, 5, 9, 13, 14, 190, 245, 255]), st.integers(-1, 70000), st.floats(width=32)
)
RELEVANT = [
    messages.MissionCount,
    messages.MissionRequest,
    messages.MissionRequestInt,
    messages.MissionItemInt,
    messages.MissionItem,
    messages.MissionAck,
    messages.ParamValue,
    messages.CommandAck,
    messages.Heartbeat,
    messages.Statustext,
]


def machines():
    return [
        Download(PEER, MISSION),
        Upload(PEER, MISSION, plain_mission(5)),
        VerifiedUpload(PEER, MISSION, plain_mission(5), is_active=False),
        ReadParameters(PEER, ["WP_SPEED", "WP_RADIUS"]),
        ReadParameters(PEER),
        SetParameter(PEER, "WP_SPEED", 3.0),
        SendCommand(PEER, CommandLong(1, 1, 400)),
    ]


@st.composite
def any_message(draw, classes):
    message_class = draw(st.sampled_from(classes))
    values = {}
    for field in fields(message_class):
        if field.type == "str":
            values[field.name] = draw(st.sampled_from(["WP_SPEED", "WP_RADIUS", "", "x" * 16, "ÿ"]))
        elif field.name == "target_system":
            values[field.name] = draw(st.sampled_from([PEER.own_system, 0, 255]))
        elif field.name == "target_component":
            values[field.name] = draw(st.sampled_from([PEER.own_component, 0, 7]))
        elif field.name == "mission_type":
            values[field.name] = draw(st.sampled_from([0, 0, 0, 1, 255]))
        elif field.type == "float":
            values[field.name] = draw(st.one_of(NUMBERS, st.just(float("nan"))))
        elif field.type == "tuple[int, ...]":
            values[field.name] = tuple(draw(st.lists(st.integers(0, 255), max_size=18)))
        else:
            values[field.name] = draw(st.one_of(st.integers(0, 6), st.integers(0, 255)))
    return message_class(**values)


SENDERS = st.sampled_from([(1, 1), (1, 1), (1, 1), (2, 1), (1, 9), (245, 190)])
STEPS = st.lists(
    st.tuples(SENDERS, any_message(RELEVANT), st.sampled_from([0.0, 0.0, 0.01, 0.3, 1.0, 5.0])), max_size=60
)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 6), STEPS)
def test_random_messages(index, steps):
    machine = machines()[index]
    now_s = 0.0
    heard = []
    machine.start(now_s)
    for (system, component), message, after_s in steps:
        now_s += after_s
        machine.receive(Frame(system, component, message), now_s)
        if (system, component) == (1, 1):
            heard.append(message)
        machine.handle_timer(now_s)
        if getattr(machine, "pending_backup", None) is not None:
            machine.backup_stored(now_s)
        _check_sent(machine.messages_to_send())
        done, total = machine.progress
        assert done >= 0
        assert total == 0 or done <= total
    _check_outcome(machine, heard)
    _run_out(machine, now_s)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 6), st.lists(any_message(list(messages.MESSAGES.values())), max_size=30))
def test_messages_of_every_kind(index, heard):
    machine = machines()[index]
    machine.start(0.0)
    for step, message in enumerate(heard):
        machine.receive(Frame(1, 1, message), step * 0.1)
        _check_sent(machine.messages_to_send())


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 6), st.binary(max_size=300), st.data())
def test_damaged_frames(index, noise, data):
    machine = machines()[index]
    machine.start(0.0)
    sender, receiver = Codec(1, 1), Codec(245, 190)
    good = b"".join(
        sender.encode(message)
        for message in (
            messages.MissionCount(245, 190, 3),
            messages.MissionRequest(245, 190, 0),
            messages.MissionAck(245, 190, 0),
            messages.ParamValue("WP_SPEED", 3.0, 9, 2, 0),
            messages.CommandAck(400, 0),
        )
    )
    position = data.draw(st.integers(0, len(good) - 1))
    damage = data.draw(st.sampled_from(["flip", "cut", "insert"]))
    if damage == "flip":
        stream = (
            good[:position] + bytes([good[position] ^ data.draw(st.integers(1, 255))]) + good[position + 1 :]
        )
    elif damage == "cut":
        stream = good[:position] + good[position + data.draw(st.integers(1, 20)) :]
    else:
        stream = good[:position] + noise + good[position:]
    for begin in range(0, len(stream), 17):
        for frame in receiver.decode(stream[begin : begin + 17]):
            machine.receive(frame, begin * 0.01)
    _check_sent(machine.messages_to_send())


@pytest.mark.parametrize("index", range(7))
def test_every_machine_ends_in_silence(index):
    machine = machines()[index]
    machine.start(0.0)
    _run_out(machine, 0.0)


def _run_out(machine, now_s):
    """Let silence follow: the machine must end within its bound, or wait for its backup."""
    limit_s = now_s + machine.bound_s + 1.0
    while not machine.is_done and machine.deadline_s is not None and now_s < limit_s:
        assert machine.deadline_s is not None
        now_s = max(now_s, machine.deadline_s)
        machine.handle_timer(now_s)
        machine.messages_to_send()
    if getattr(machine, "pending_backup", None) is None:
        assert machine.is_done
        assert machine.outcome is not None


def _check_sent(sent):
    for message in sent:
        assert (message.target_system, message.target_component) == (PEER.system, PEER.component)


def _check_outcome(machine, heard):
    """An outcome that claims something must have a reason in what was heard."""
    outcome = machine.outcome
    if outcome is None:
        return
    if isinstance(machine, Download) and outcome.is_complete:
        received = {
            repr(item_from_message(message))
            for message in heard
            if isinstance(message, messages.MissionItemInt | messages.MissionItem)
        }
        assert all(repr(item) in received for item in outcome.items)
    if isinstance(machine, VerifiedUpload) and outcome.kind is OutcomeKind.VERIFIED:
        assert any(isinstance(message, messages.MissionItemInt) for message in heard)
        assert outcome.found is not None
        assert [(i.lat_e7, i.lon_e7) for i in outcome.found[1:]] == [
            (i.lat_e7, i.lon_e7) for i in plain_mission(5)[1:]
        ]
    if isinstance(machine, SendCommand) and outcome.result is not None:
        assert any(isinstance(m, messages.CommandAck) and m.command == 400 for m in heard)
    if isinstance(machine, SetParameter) and outcome.is_confirmed:
        assert any(isinstance(m, messages.ParamValue) and m.param_value == 3.0 for m in heard)
