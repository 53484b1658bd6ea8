"""Whatever a vehicle answers, and however late, every machine ends within the bound that it tells before it starts."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from protocol.twin import PEER, plain_mission

from mavlink_bridge.director.learning import Learning
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame, MissionType
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.find import FindVehicle
from mavlink_bridge.protocol.mode_switch import ModeSwitch
from mavlink_bridge.protocol.pace import MOST_S
from mavlink_bridge.protocol.parameters import ReadParameters, SetParameter
from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.protocol.verified_upload import VerifiedUpload
from mavlink_bridge.protocol.write_watch import WriteWatch
from missions.situation import ListKind

MISSION = MissionType.MISSION
US = (PEER.own_system, PEER.own_component)
MACHINES = {
    "download": lambda: Download(PEER, MISSION),
    "undisturbed read": lambda: UndisturbedRead(PEER, MISSION, WriteWatch(PEER, MISSION)),
    "upload": lambda: Upload(PEER, MISSION, plain_mission(9)),
    "long upload": lambda: Upload(PEER, MISSION, plain_mission(650)),
    "verified upload": lambda: VerifiedUpload(PEER, MISSION, plain_mission(9), is_active=False),
    "long verified upload": lambda: VerifiedUpload(PEER, MISSION, plain_mission(650), replace_active=True),
    "some parameters": lambda: ReadParameters(PEER, [f"P{number}" for number in range(40)]),
    "all parameters": lambda: ReadParameters(PEER),
    "set a parameter": lambda: SetParameter(PEER, "P1", 3.0),
    "command": lambda: SendCommand(PEER, m.CommandLong(1, 1, 400)),
    "find": lambda: FindVehicle(7),
    "mode": lambda: ModeSwitch(PEER, 4),
    "mode, urgent": lambda: ModeSwitch(PEER, 4, is_urgent=True, until_seen=True),
    "learning": lambda: Learning(PEER, 30.0, list(ListKind)),
}

ANSWERS = [
    "as asked", "nothing", "nothing", "denied", "error", "cancelled", "accepted", "another count", "huge count", "zero", "another item", "old form",
    "next item", "first item", "huge item", "in progress", "refused", "another value", "a new parameter", "a rival", "our ids", "heartbeat",
]  # fmt: skip
WAITS_S = [0.3, 0.95, 1.9, 5.0, 9.9, 31.0]
MOST_UNDER_WAY = 6


class Peer:
    """A vehicle that answers each message by the next of a list of answers, over and over, each after a wait."""

    def __init__(self, answers):
        self._answers = itertools.cycle(answers)
        self._seq = -1
        self._count = itertools.cycle([3, 5, 4, 700])
        self._numbers = itertools.count(1)

    def hear(self, message):
        """Return what is answered, and after how long; some answers come from others."""
        answer, wait_s = next(self._answers)
        return [(wait_s, frame) for frame in self._answer(answer, message)]

    def _answer(self, answer, message):
        number = next(self._numbers)
        ack = {"denied": 14, "error": 1, "cancelled": 15, "accepted": 0}
        if answer == "as asked":
            return self._as_asked(message)
        if answer in ack:
            return [Frame(1, 1, m.MissionAck(*US, ack[answer], 0))]
        counts = {"another count": next(self._count), "huge count": 65535, "zero": 0}
        if answer in counts:
            return [Frame(1, 1, m.MissionCount(*US, counts[answer], 0))]
        seqs = {"next item": self._seq + 1, "first item": 0, "huge item": 60000}
        if answer in seqs:
            self._seq = min(seqs[answer], 100)
            return [Frame(1, 1, m.MissionRequest(*US, seqs[answer], 0))]
        values = (0, 1, 0.0, math.nan, 0.0, 0.0)
        others = {
            "nothing": [],
            "another item": [Frame(1, 1, m.MissionItemInt(*US, getattr(message, "seq", 0), 3, 16, *values, number, 1, math.inf))],
            "old form": [Frame(1, 1, m.MissionItem(*US, getattr(message, "seq", 0), 3, 16, *values, 1.0, 1.0, 0.0))],
            "in progress": [Frame(1, 1, m.CommandAck(getattr(message, "command", 0), 5, 200))],
            "refused": [Frame(1, 1, m.CommandAck(getattr(message, "command", 0), 2))],
            "another value": [Frame(1, 1, m.ParamValue(getattr(message, "param_id", "P1"), float(number), 9, 65535, number % 65535))],
            "a new parameter": [Frame(1, 1, m.ParamValue(f"Q{number}", 1.0, 9, 65535, number % 65535))],
            "a rival": [Frame(255, 190, m.MissionWritePartialList(1, 1, 1, 1)), Frame(1, 1, m.MissionRequest(255, 190, 1, 0))],
            "our ids": [Frame(*US, m.MissionCount(1, 1, number % 99, 0)), Frame(1, 1, m.MissionAck(*US, 0, 0))],
            "heartbeat": [Frame(1, 1, m.Heartbeat(10, 3, base_mode=1, custom_mode=number % 3)), Frame(9, 1, m.Heartbeat(10, 3))],
        }  # fmt: skip
        return others[answer]

    def _as_asked(self, message):
        values = (0, 1, 0.0, 0.0, 0.0, 0.0, 1, 1, 0.0)
        match message:
            case m.MissionRequestList():
                return [Frame(1, 1, m.MissionCount(*US, 3, message.mission_type))]
            case m.MissionRequestInt():
                return [Frame(1, 1, m.MissionItemInt(*US, message.seq, 3, 16, *values, message.mission_type))]
            case m.MissionCount():
                return [Frame(1, 1, m.MissionRequest(*US, 0, message.mission_type))]
            case m.MissionItemInt():
                return [Frame(1, 1, m.MissionRequest(*US, message.seq + 1, message.mission_type))]
            case m.ParamRequestRead():
                return [Frame(1, 1, m.ParamValue(message.param_id, 1.0, 9, 40, 1))]
            case m.CommandLong():
                return [Frame(1, 1, m.CommandAck(message.command, 0))]
        return []


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(MACHINES)),
    st.lists(st.tuples(st.sampled_from(ANSWERS), st.sampled_from(WAITS_S)), min_size=1, max_size=8),
    st.sampled_from([None, 0.9, 2.0, 7.0]),
)
@example("download", [("huge count", 0.3), ("another item", 1.9)], None)
@example("all parameters", [("a new parameter", 0.95)], 0.95)
@example("command", [("in progress", 5.0)], 5.0)
@example("mode", [("heartbeat", 5.0)], 7.0)
@example("verified upload", [("as asked", 0.3), ("a rival", 0.3)], 2.0)
@example("long upload", [("next item", 1.9)], None)
def test_every_machine_ends_whatever_it_is_answered(name, answers, noise_every_s):
    machine = MACHINES[name]()
    bound_s = machine.bound_s
    took_s, waited_s = run(machine, Peer(answers), bound_s + 1.0, noise_every_s)
    assert took_s - waited_s <= bound_s
    if name != "learning":
        assert bound_s <= MOST_S


@pytest.mark.parametrize("name", sorted(MACHINES))
@pytest.mark.parametrize("answer", sorted(set(ANSWERS)))
def test_every_machine_ends_when_one_answer_comes_again_and_again(name, answer):
    machine = MACHINES[name]()
    bound_s = machine.bound_s
    took_s, waited_s = run(machine, Peer([(answer, 0.95)]), bound_s + 1.0, 0.95)
    assert took_s - waited_s <= bound_s


def run(machine, peer, limit_s, noise_every_s=None, backup_after_s=100.0):
    """Run a machine in stepped time; return how long that took, and how long it waited for its backup to be stored."""
    now_s = waited_s = 0.0
    order = itertools.count()
    coming = []  # (when, order, frame)
    noise_s = math.inf if noise_every_s is None else noise_every_s
    machine.start(now_s)
    for _ in range(40_000):
        room = MOST_UNDER_WAY - len(coming)  # the link carries no more at a time
        for message in machine.messages_to_send()[: max(room, 0)]:
            coming += [(now_s + wait_s, next(order), frame) for wait_s, frame in peer.hear(message)]
        if machine.is_done:
            return now_s, waited_s
        if getattr(machine, "pending_backup", None) is not None:
            waited_s += backup_after_s
            now_s += backup_after_s
            machine.backup_stored(now_s)
            continue
        coming.sort()
        deadline_s = machine.deadline_s
        assert deadline_s is not None, "it waits for ever"
        next_s = min(deadline_s, coming[0][0] if coming else math.inf, noise_s)
        now_s = max(now_s, next_s)
        assert now_s <= limit_s + waited_s, f"it has not ended after {now_s:.0f} s"
        if coming and coming[0][0] <= now_s:
            machine.receive(coming.pop(0)[2], now_s)
        elif noise_s <= now_s:
            noise_s = now_s + noise_every_s
            coming += [(now_s, next(order), frame) for _, frame in peer.hear(m.Heartbeat(6, 8))]
        if (deadline_s := machine.deadline_s) is not None and deadline_s <= now_s:
            machine.handle_timer(now_s)
    raise AssertionError(f"it went on and on at {now_s:.1f} s")
