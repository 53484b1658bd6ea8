"""Parameters: read, listed, set."""

from __future__ import annotations

import math
import random
import struct

import pytest
from protocol.scripted import Script
from protocol.twin import PEER

from mavlink_bridge.mavlink.messages import Frame, ParamRequestList, ParamRequestRead, ParamSet, ParamValue
from mavlink_bridge.protocol.parameters import WINDOW, ReadParameters, SetParameter
from mavlink_bridge.protocol.transitions import ParameterState

NAMES = [f"P{index:03}" for index in range(60)]


def value(name, number=1.0, index=65535, count=60, kind=9):
    return ParamValue(name, number, kind, count, index)


class Store:
    """A vehicle's parameters behind a lossy link, in stepped time."""

    def __init__(self, machine, loss=0.0, seed=0, delay_s=0.05, stalls=()):
        self.machine, self.loss, self.delay_s = machine, loss, delay_s
        self.stalls = stalls
        self.random = random.Random(seed)
        self.values = {name: float(index) for index, name in enumerate(NAMES)}
        self.asked = 0

    def run(self, limit_s=300.0):
        now_s, arriving = 0.0, []
        self.machine.start(now_s)
        while not self.machine.is_done and now_s < limit_s:
            stalled = any(begin_s <= now_s < end_s for begin_s, end_s in self.stalls)
            for message in self.machine.messages_to_send():
                self.asked += 1
                if self.random.random() >= self.loss and not stalled:
                    arriving += [(now_s + self.delay_s, answer) for answer in self._answers(message)]
            now_s += 0.01
            due = [answer for time_s, answer in arriving if time_s <= now_s]
            arriving = [pair for pair in arriving if pair[0] > now_s]
            for answer in due:
                if self.random.random() >= self.loss:
                    self.machine.receive(Frame(1, 1, answer), now_s)
            self.machine.handle_timer(now_s)
        return now_s

    def _answers(self, message):
        if isinstance(message, ParamRequestList):
            return [self._value(name) for name in NAMES]
        if isinstance(message, ParamSet):
            self.values[message.param_id] = struct.unpack("<f", struct.pack("<f", message.param_value))[0]
            return [self._value(message.param_id)]
        name = NAMES[message.param_index] if message.param_index >= 0 else message.param_id
        return [self._value(name)] if name in self.values else []

    def _value(self, name):
        return value(name, self.values[name], NAMES.index(name))


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("seed", range(5))
def test_names_come_or_are_missing(loss, seed):
    store = Store(ReadParameters(PEER, [*NAMES[:30], "NONE1", "NONE2"]), loss, seed)
    took_s = store.run()
    outcome = store.machine.outcome
    assert outcome.values == {name: float(index) for index, name in enumerate(NAMES[:30])}
    assert sorted(outcome.missing) == ["NONE1", "NONE2"]
    assert not outcome.is_complete
    assert took_s < (2.0 if loss == 0 else 25.0)


@pytest.mark.parametrize("stall_s", [0.6, 1.0, 3.0, 8.0])
@pytest.mark.parametrize("begins_s", [0.0, 0.04, 0.1, 0.2])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_a_link_that_stands_still_tells_nothing_of_a_name(stall_s, begins_s, loss):
    store = Store(ReadParameters(PEER, [*NAMES, "NONE"]), loss, 1, stalls=[(begins_s, begins_s + stall_s)])
    store.run()
    outcome = store.machine.outcome
    assert not outcome.is_silent
    assert outcome.missing == ("NONE",)
    assert len(outcome.values) == len(NAMES)


@pytest.mark.parametrize("stall_s", [0.7, 4.0])
def test_names_that_are_all_unknown_are_missing_where_the_vehicle_answers_to_others(stall_s):
    store = Store(ReadParameters(PEER, ["NONE1", "NONE2"]), stalls=[(0.0, stall_s)])
    took_s = store.run()
    assert sorted(store.machine.outcome.missing) == ["NONE1", "NONE2"]
    assert not store.machine.outcome.is_silent
    assert took_s < 15.0


def test_a_silent_link_is_not_asked_again_and_again():
    store = Store(ReadParameters(PEER, NAMES), stalls=[(0.1, 60.0)])
    took_s = store.run()
    assert store.machine.outcome.is_silent
    assert len(store.machine.outcome.values) + len(store.machine.outcome.missing) == len(NAMES)
    assert took_s < 11.0
    assert store.asked < 10 * len(NAMES)


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_all_parameters_come(loss):
    store = Store(ReadParameters(PEER), loss, seed=1)
    store.run()
    outcome = store.machine.outcome
    assert outcome.is_complete
    assert outcome.values == store.values


def test_the_window_is_kept_and_names_are_asked_once():
    script = Script(ReadParameters(PEER, NAMES + NAMES))
    assert script.sent == [ParamRequestRead(1, 1, name, -1) for name in NAMES[:WINDOW]]
    assert script.hear(value("P000")) == [ParamRequestRead(1, 1, NAMES[WINDOW], -1)]


def test_no_names_need_no_answer():
    assert Script(ReadParameters(PEER, [])).machine.outcome.is_complete


def test_a_silent_vehicle():
    for machine in (ReadParameters(PEER), ReadParameters(PEER, ["WP_SPEED"])):
        script = Script(machine)
        script.pass_time(11.0)
        assert machine.outcome.is_silent
        assert not machine.outcome.is_complete


def test_a_vehicle_that_falls_silent_leaves_the_rest_missing():
    script = Script(ReadParameters(PEER, NAMES[:3]))
    script.hear(value("P000"))
    script.pass_time(30.0)
    assert script.machine.outcome.missing == ("P001", "P002")
    assert script.machine.outcome.is_silent


def test_the_list_is_asked_for_again_when_nothing_comes():
    script = Script(ReadParameters(PEER))
    assert script.pass_time(3.1) == [ParamRequestList(1, 1)] * 2


def test_gaps_in_the_list_are_asked_for_by_number():
    script = Script(ReadParameters(PEER))
    script.hear(*(value(NAMES[index], index=index) for index in range(60) if index not in (3, 7)))
    assert script.pass_time(1.1) == [ParamRequestRead(1, 1, "", 3), ParamRequestRead(1, 1, "", 7)]
    script.hear(value("P003", index=3), value("P007", index=7))
    assert script.machine.outcome.is_complete


def test_values_nobody_asked_for_are_ignored():
    script = Script(ReadParameters(PEER, ["P001", "P002"]))
    script.hear(value("OTHER"))
    script.hear(value("P001"), system=2)
    assert script.machine.progress == (0, 2)
    script.hear(value("P001"), value("P001"), value("P002"))
    assert script.machine.outcome.values == {"P001": 1.0, "P002": 1.0}


def test_a_name_heard_before_its_turn_is_not_asked_for():
    script = Script(ReadParameters(PEER, NAMES[: WINDOW + 1]))
    script.hear(value(NAMES[WINDOW]))
    assert ParamRequestRead(1, 1, NAMES[WINDOW], -1) not in script.hear(value("P000"))


@pytest.mark.parametrize(("loss", "seed"), [(0.0, 0), (0.2, 1), (0.2, 2), (0.3, 3)])
def test_a_value_is_set_and_confirmed(loss, seed):
    store = Store(SetParameter(PEER, "P004", 3.3), loss, seed)
    store.run()
    outcome = store.machine.outcome
    assert outcome.is_confirmed
    assert outcome.value == pytest.approx(3.3)


def test_the_answer_of_the_wire_is_the_32_bit_value():
    script = Script(SetParameter(PEER, "WP_SPEED", 3.3))
    assert script.sent == [ParamSet(1, 1, "WP_SPEED", 3.3, 9)]
    script.hear(value("WP_SPEED", 3.299999952316284))
    assert script.machine.outcome.is_confirmed
    assert script.machine.progress == (1, 1)


def test_a_vehicle_that_keeps_another_value_is_believed_when_it_says_so_again():
    script = Script(SetParameter(PEER, "WP_SPEED", 99.0))
    for _ in range(3):
        assert not script.machine.is_done
        script.hear(value("WP_SPEED", 20.0), value("WP_SPEED", 20.0))
        script.pass_time(0.8)
    outcome = script.machine.outcome
    assert (outcome.value, outcome.is_confirmed) == (20.0, False)


def test_one_other_answer_and_then_nothing():
    script = Script(SetParameter(PEER, "WP_SPEED", 99.0))
    script.hear(value("WP_SPEED", 20.0), value("OTHER", 99.0))
    script.pass_time(11.0)
    assert script.machine.state is ParameterState.DONE
    assert script.machine.outcome.value == 20.0


def test_setting_an_unknown_name_ends_in_silence():
    script = Script(SetParameter(PEER, "NONE", 1.0))
    sent = script.pass_time(10.1)
    assert ParamRequestRead(1, 1, "NONE", -1) in sent
    assert script.machine.state is ParameterState.SILENT
    assert script.machine.outcome.value is None


@pytest.mark.parametrize("number", [math.nan, math.inf, 1e300])
def test_numbers_the_wire_cannot_carry_are_never_confirmed(number):
    script = Script(SetParameter(PEER, "WP_SPEED", number))
    script.hear(value("WP_SPEED", 1.0))
    assert not script.machine.is_done


def test_unstarted_machines_are_quiet():
    for machine in (ReadParameters(PEER, ["A"]), ReadParameters(PEER), SetParameter(PEER, "A", 1.0)):
        machine.handle_timer(1.0)
        machine.receive(Frame(1, 1, value("A")), 1.0)
        assert machine.messages_to_send() == []
        assert machine.deadline_s is None
        assert machine.outcome is None


@pytest.mark.parametrize("came", [math.nan, math.inf])
def test_what_is_no_number_is_answered_and_no_value(came):
    store = Store(ReadParameters(PEER, NAMES[:3]))
    store.values["P001"] = came
    store.run()
    outcome = store.machine.outcome
    assert outcome.values == {"P000": 0.0, "P002": 2.0}
    assert outcome.no_numbers == {"P001": str(came)}
    assert (outcome.missing, outcome.is_complete) == ((), True)
