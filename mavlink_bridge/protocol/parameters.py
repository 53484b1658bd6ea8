"""Reading parameters, some or all, and setting one with confirmation.

Every parameter comes as a 32-bit float, whole numbers too: cast by ArduPilot, their bits from PX4. Neither answers when asked for a parameter it does not have:
a name counts as missing when it was asked for so often that, as the link loses messages, an answer would have come. A question counts
only where the vehicle has answered a later one: a link or a vehicle that stands still for a while shows nothing of its parameters. So
that there is a later one, a parameter that is there is asked for again after each repeated question.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import ParamRequestList, ParamRequestRead, ParamSet, ParamValue
from mavlink_bridge.mavlink.parameter_values import (
    REAL32,
    encoded_parameter,
    float32,
    parameter_value,
)
from mavlink_bridge.protocol.pace import MOST_S, Pace, bound_s
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import PARAMETERS, ParameterEvent, ParameterState

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

WINDOW = 20  # requests in flight; chosen, not measured
PATIENCE_S = 10.0  # of silence, as for lists
_LIST_AGAIN_S = 1.5  # without anything of the list; chosen, not measured
_QUIET_S = 1.0  # after the last of the stream: what it left out is asked for; chosen, not measured
_SET_AGAIN_S = 0.7  # above the round trip of most links; chosen, not measured
_ANSWERS_BELIEVED = 3  # with another value, as one may answer somebody else; chosen, not measured
# Bounds of the measured round trip's timeout, and of the questions until a name is missing. Chosen, not measured.
_LEAST_OVERDUE_S, _MOST_OVERDUE_S = 0.2, 2.0
_LEAST_TRIES, _MOST_TRIES = 3, 14
_PATIENT_ROUNDS = 2  # of repeated questions without any answer, until they are asked ever more seldom
_WRONGLY_MISSING = 1e-4  # how likely a parameter may be called missing that is there
_NO_INDEX = 65535  # UINT16_MAX: PARAM_VALUE.param_index outside a list


@dataclass(frozen=True, slots=True)
class ParametersOutcome:
    """What was read.

    Parameters
    ----------
    values : mapping of str to float
        Parameters by name.
    missing : tuple of str
        Names the vehicle did not answer to; numbers of parameters of the list that never came.
    is_silent : bool
        The vehicle did not answer at all, or stopped answering.
    no_numbers : mapping of str to str
        Parameters that the vehicle answered with what is no number, and what came; they are not among the values.
    types : mapping of str to int
        MAV_PARAM_TYPE by name.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    is_silent: bool = False
    no_numbers: Mapping[str, str] = field(default_factory=dict)
    types: Mapping[str, int] = field(default_factory=dict)

    @property
    def is_complete(self) -> bool:
        """Whether everything asked for is here."""
        return not self.is_silent and not self.missing


@dataclass(slots=True)
class _Ask:
    """A question under way: when it was last sent, how often, which questions its first and last sending were, and how many count."""

    sent_s: float
    tries: int
    first: int
    last: int
    passed_over: int = 0


class ReadParameters(TableMachine[ParameterState, ParameterEvent]):
    """Reads parameters by name, or all of them; the outcome is None until `is_done`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    names : iterable of str, optional
        Which ones; None for all.
    """

    def __init__(self, peer: Peer, names: Iterable[str] | None = None) -> None:
        super().__init__(PARAMETERS, ParameterState.IDLE)
        self._peer = peer
        self._names = None if names is None else tuple(dict.fromkeys(names))
        self._values: dict[str, float] = {}
        self._no_numbers: dict[str, str] = {}
        self._types: dict[str, int] = {}
        self._seen_indices: set[int] = set()
        self._count = 0
        self._waiting: list[str | int] = []  # in reverse order
        self._asks: dict[str | int, _Ask] = {}  # in order of sending
        self._missing: list[str | int] = []
        self._round_trip = RoundTrip(0.3)  # seconds taken until one is measured; chosen
        self._answered = 0
        self._answered_tries = 0
        self._sent = 0
        self._answered_to = 0  # the latest question that was surely heard
        self._control = (0, "")  # which question it was, and for what; after each repeated one
        self._quiet_rounds = 0
        self._heard_s = 0.0
        self._list_at_s = 0.0
        self._pace = Pace()

    @property
    def outcome(self) -> ParametersOutcome | None:
        """What was read; None while it runs."""
        if not self.is_done:
            return None
        is_silent = self.state is ParameterState.SILENT
        open_asks = [*self._missing, *self._asks, *reversed(self._waiting)]
        return ParametersOutcome(
            dict(self._values),
            tuple(map(str, open_asks)),
            is_silent,
            dict(self._no_numbers),
            dict(self._types),
        )

    @property
    def progress(self) -> tuple[int, int]:
        """Parameters settled and parameters in all."""
        if self._names is None:
            return len(self._seen_indices), self._count
        return len(self._names) - len(self._waiting) - len(self._asks), len(self._names)

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link and the vehicle do."""
        return MOST_S if self._names is None else bound_s(len(self._names))

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        silence_s = min(self._heard_s + PATIENCE_S, self._pace.deadline_s)
        if self.state is ParameterState.LISTING:
            return min(self._list_at_s, silence_s)
        if self.state is ParameterState.ASKING:
            return min(next(iter(self._asks.values())).sent_s + self._overdue_s(), silence_s)
        return None

    def start(self, now_s: float) -> None:
        """Ask."""
        self._heard_s = now_s
        self._pace.start(now_s)
        if self._names is None:
            if self._move(ParameterEvent.START_ALL):
                self._ask_list(now_s)
        elif self._move(ParameterEvent.START_SOME):
            self._waiting = list(reversed(self._names))
            self._go_on(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        message = frame.message
        if self.is_done or not isinstance(message, ParamValue) or not self._peer.accepts(frame):
            return
        if self.state is ParameterState.IDLE:
            return
        self._hear_control(message, now_s)
        if self._names is None:
            self._take(message)
            if 0 <= message.param_index < message.param_count and message.param_index != _NO_INDEX:
                self._count = message.param_count
                self._seen_indices.add(message.param_index)
                self._heard_s = now_s
                self._list_at_s = now_s + _QUIET_S
            self._settle(message.param_index, now_s)
        elif message.param_id in self._names:
            self._heard_s = now_s
            self._take(message)
            self._settle(message.param_id, now_s)
        self._pace.advance(self.progress[0], now_s)
        self._go_on(now_s)

    def _take(self, message: ParamValue) -> None:
        name = message.param_id
        if name in self._peer.autopilot.parameters.left_out:
            return
        value = parameter_value(message, bytewise=self._peer.autopilot.parameters.is_bytewise)
        self._types[name] = message.param_type
        if math.isfinite(value):
            self._values[name] = value
            self._no_numbers.pop(name, None)
        else:
            self._values.pop(name, None)
            self._no_numbers[name] = str(value)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.is_done or self.state is ParameterState.IDLE:
            return
        if now_s >= self._heard_s + PATIENCE_S or self._pace.is_over(now_s):
            self._move(ParameterEvent.SILENCE)
        elif self.state is ParameterState.LISTING:
            if now_s >= self._list_at_s:
                self._end_list(now_s)
        else:
            self._repeat_overdue(now_s)
            self._go_on(now_s)

    def _ask_list(self, now_s: float) -> None:
        self._list_at_s = now_s + _LIST_AGAIN_S
        self._send(ParamRequestList(self._peer.system, self._peer.component))

    def _end_list(self, now_s: float) -> None:
        """Go on with single requests for what the stream has left out; ask once more if there was no stream."""
        if not self._count:
            self._ask_list(now_s)
            return
        gaps = sorted(set(range(self._count)) - self._seen_indices, reverse=True)
        if gaps and self._move(ParameterEvent.GAPS):
            self._waiting = list(gaps)
            self._go_on(now_s)

    def _go_on(self, now_s: float) -> None:
        if self.state is ParameterState.LISTING:
            if self._count and len(self._seen_indices) >= self._count:
                self._move(ParameterEvent.ALL_HERE)
            return
        if self.state is not ParameterState.ASKING:
            return
        while self._waiting and len(self._asks) < WINDOW:
            self._ask(self._waiting.pop(), 1, now_s)
        if not self._asks:
            self._move(ParameterEvent.GIVEN_UP if self._missing else ParameterEvent.ALL_HERE)

    def _ask(self, key: str | int, tries: int, now_s: float) -> None:
        before = self._asks.pop(key, None)
        self._sent += 1
        self._asks[key] = _Ask(now_s, tries, self._sent, self._sent)
        if before is not None:
            self._asks[key].first, self._asks[key].passed_over = before.first, before.passed_over
        self._request(key)

    def _request(self, key: str | int) -> None:
        name, index = ("", key) if isinstance(key, int) else (key, -1)
        self._send(ParamRequestRead(self._peer.system, self._peer.component, name, index))

    def _ask_control(self) -> None:
        """Ask for what is surely there: a parameter that was answered, else the first one of the vehicle's list."""
        self._sent += 1
        self._answered_tries += 1
        name = next(iter(self._values), "")
        self._control = (self._sent, name)
        self._request(name or 0)

    def _hear_control(self, message: ParamValue, now_s: float) -> None:
        number, name = self._control
        if number and (message.param_id == name if name else message.param_index == 0):
            self._answered_to = max(self._answered_to, number)
            self._answered += 1
            self._control = (0, "")
            self._heard_s, self._quiet_rounds = now_s, 0

    def _settle(self, key: str | int, now_s: float) -> None:
        ask = self._asks.pop(key, None)
        if ask is None:
            if key in self._waiting:
                self._waiting.remove(key)
            return
        self._quiet_rounds = 0
        self._answered_to = max(
            self._answered_to, ask.first
        )  # which of its sendings was answered is not known
        if ask.tries == 1:
            self._round_trip.observe(now_s - ask.sent_s)
        self._answered += 1
        self._answered_tries += ask.tries

    def _overdue_s(self) -> float:
        overdue_s = self._round_trip.timeout_s(_LEAST_OVERDUE_S, _MOST_OVERDUE_S)
        return min(overdue_s * 2.0 ** max(self._quiet_rounds - _PATIENT_ROUNDS, 0), _MOST_OVERDUE_S)

    def _repeat_overdue(self, now_s: float) -> None:
        overdue_s = self._overdue_s()
        enough = self._tries_enough()
        repeated = False
        for key, ask in list(self._asks.items()):
            if now_s < ask.sent_s + overdue_s:
                break
            ask.passed_over += ask.last < self._answered_to
            # What is asked by number is in the list: only names can be unknown.
            is_unknown = isinstance(key, str) and ask.passed_over >= enough
            if is_unknown or ask.tries >= _MOST_TRIES:
                del self._asks[key]
                self._missing.append(key)
            else:
                self._ask(key, ask.tries + 1, now_s)
                repeated = True
        if repeated:
            still_open, _ = self._control
            self._quiet_rounds += bool(still_open)
            self._ask_control()

    def _tries_enough(self) -> int:
        """Return how often to ask until an unanswered name is a missing one, judged by what others needed."""
        if not self._answered:
            return _MOST_TRIES
        failures = (max(self._answered_tries - self._answered, 0) + 1) / (self._answered_tries + 4)
        return min(max(math.ceil(math.log(_WRONGLY_MISSING) / math.log(failures)), _LEAST_TRIES), _MOST_TRIES)


@dataclass(frozen=True, slots=True)
class SetParameterOutcome:
    """How setting a parameter ended.

    Parameters
    ----------
    name : str
        Which one.
    value : float, optional
        What the vehicle holds now, as it reported; None if it never answered (unknown name, or silence).
    is_confirmed : bool
        Whether that is what was wanted.
    """

    name: str
    value: float | None
    is_confirmed: bool


class SetParameter(TableMachine[ParameterState, ParameterEvent]):
    """Sets one parameter and waits for the vehicle to confirm it; the outcome is None until `is_done`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    name : str
        Which one.
    value : float
        The value wanted.
    param_type : int
        MAV_PARAM_TYPE of the parameter, as the vehicle reported it; ArduPilot takes any.
    """

    def __init__(self, peer: Peer, name: str, value: float, param_type: int = REAL32) -> None:
        super().__init__(PARAMETERS, ParameterState.IDLE)
        self._peer = peer
        self._name = name
        self._is_bytewise = peer.autopilot.parameters.is_bytewise
        self._sent, self._type = encoded_parameter(value, param_type, bytewise=self._is_bytewise)
        self._wanted = float32(value) if self._type == REAL32 else value
        self._value: float | None = None
        self._is_confirmed = False
        self._other_answers = 0
        self._answer_counts = False
        self._send_at_s = 0.0
        self._give_up_s = 0.0

    @property
    def name(self) -> str:
        """Which parameter."""
        return self._name

    @property
    def outcome(self) -> SetParameterOutcome | None:
        """How it ended; None while it runs."""
        return SetParameterOutcome(self._name, self._value, self._is_confirmed) if self.is_done else None

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link does."""
        return PATIENCE_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return min(self._send_at_s, self._give_up_s) if self.state is ParameterState.SETTING else None

    def start(self, now_s: float) -> None:
        """Send the value."""
        if self._move(ParameterEvent.START_SET):
            self._give_up_s = now_s + PATIENCE_S
            self._send_value(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:  # noqa: ARG002 - the contract's
        """Take a frame; what is not for this machine is ignored."""
        message = frame.message
        if self.state is not ParameterState.SETTING or not self._peer.accepts(frame):
            return
        if not isinstance(message, ParamValue) or message.param_id != self._name:
            return
        self._value = parameter_value(message, bytewise=self._is_bytewise)
        if self._value == self._wanted:
            self._is_confirmed = True
            self._move(ParameterEvent.CONFIRMED)
        elif self._answer_counts:
            # An answer to somebody else's question may come before ours was heard: one other value is not the last word.
            self._answer_counts = False
            self._other_answers += 1
            if self._other_answers >= _ANSWERS_BELIEVED:
                self._move(ParameterEvent.GIVEN_UP)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.state is not ParameterState.SETTING:
            return
        if now_s >= self._give_up_s:
            self._move(ParameterEvent.SILENCE if self._value is None else ParameterEvent.GIVEN_UP)
        elif now_s >= self._send_at_s:
            self._send_value(now_s)
            self._send(ParamRequestRead(self._peer.system, self._peer.component, self._name))

    def _send_value(self, now_s: float) -> None:
        self._send_at_s = now_s + _SET_AGAIN_S
        self._answer_counts = True
        self._send(ParamSet(self._peer.system, self._peer.component, self._name, self._sent, self._type))
