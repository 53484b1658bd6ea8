"""Asking a vehicle which one it is: told, refused, granted without its coming, or silent."""

from __future__ import annotations

import pytest
from protocol.scripted import Script
from protocol.twin import PEER

from mavlink_bridge.backup.vehicle_mark import uid_of
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import AutopilotVersion, CommandAck, CommandLong, Frame, MavResult
from mavlink_bridge.protocol.ask_version import AskVersion
from mavlink_bridge.protocol.transitions import VersionState
from mavlink_bridge.simulator import SimulatedVehicle, Simulator, SimulatorConfig

BY_MESSAGE = CommandLong(1, 1, 512, param1=148.0)
BY_CAPABILITIES = CommandLong(1, 1, 520, param1=1.0)
VERSION = AutopilotVersion(7, uid2=tuple(b"abc".ljust(18, b"\0")))


def test_it_is_told():
    script = Script(AskVersion(PEER))
    assert script.sent == [BY_MESSAGE]
    script.hear(CommandAck(512, MavResult.ACCEPTED))
    script.hear(VERSION, system=9)
    assert not script.machine.is_done
    script.hear(VERSION)
    assert (script.machine.state, script.machine.version) == (VersionState.TOLD, VERSION)


def test_a_refusal_is_followed_by_the_older_question_at_once():
    script = Script(AskVersion(PEER))
    assert script.hear(CommandAck(512, MavResult.UNSUPPORTED)) == [BY_CAPABILITIES]
    assert script.hear(CommandAck(512, MavResult.UNSUPPORTED)) == []
    script.hear(CommandAck(520, MavResult.UNSUPPORTED))
    assert (script.machine.state, script.machine.version) == (VersionState.NOT_TOLD, None)


def test_silence_ends_within_the_bound():
    script = Script(AskVersion(PEER))
    assert script.pass_time(script.machine.bound_s)[:2] == [BY_CAPABILITIES, BY_MESSAGE]
    assert script.machine.state is VersionState.NOT_TOLD


def test_a_vehicle_that_grants_all_and_tells_nothing_is_not_waited_for():
    script = Script(AskVersion(PEER))
    script.hear(CommandAck(512, MavResult.ACCEPTED))
    script.pass_time(0.7)
    script.hear(CommandAck(520, MavResult.ACCEPTED))
    script.pass_time(0.7)
    assert script.machine.state is VersionState.NOT_TOLD


@pytest.mark.parametrize("command", [BY_MESSAGE, BY_CAPABILITIES])
def test_the_simulated_rover_tells_its_uid(command):
    vehicle = SimulatedVehicle(SimulatorConfig(uid=b"\x01\x02\x03"))
    vehicle.receive(Frame(245, 190, command), 0.1)
    vehicle.handle_timer(1.0)
    told = [message for message in vehicle.messages_to_send() if isinstance(message, AutopilotVersion)]
    assert [uid_of(message) for message in told] == ["010203"]


def test_each_simulated_rover_on_a_link_is_a_vehicle_of_its_own():
    uids = {Simulator(listen="tcpin:127.0.0.1:0").vehicle.config.uid for _ in range(3)}
    assert len(uids) == 3
    assert Simulator(SimulatorConfig(uid=b"mine")).vehicle.config.uid == b"mine"


def test_the_uid_goes_over_the_wire_as_it_is():
    [frame] = Codec(255, 190).decode(Codec(1, 1).encode(VERSION))
    assert frame.message == VERSION
    hash(frame.message)
