"""Learning a vehicle: its parameters, fence, mission, home and position, asked for in that order."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from mavlink_bridge.backup.vehicle_mark import uid_of
from mavlink_bridge.director.steps import Steps, step
from mavlink_bridge.errors import BridgeError, LinkError
from mavlink_bridge.fold import KINDS, with_list
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.ask_version import VERSION_PATIENCE_S, AskVersion
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.outcomes import list_read
from mavlink_bridge.protocol.pace import MOST_S
from mavlink_bridge.protocol.parameters import ReadParameters
from mavlink_bridge.protocol.table_machine import Outbox
from mavlink_bridge.protocol.telemetry import stream_requests
from missions.situation import ListKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.protocol.peer import Peer
    from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
    from missions.items import MissionItem
    from missions.situation import Situation

MISSION_TYPES = {kind: m.MissionType(number) for number, kind in KINDS.items()}

_ASK_STREAMS_EVERY_S = 3.0  # until they come: a request may be lost; chosen, not measured
_HOME_S = 60.0  # the longest that a command may take
_FIX_PATIENCE_S = 3.0
"""What is promised rests on the fix, so that whether it is known must not be a matter of luck; not every vehicle tells it."""


class Learning(Outbox):
    """Learns a vehicle; a machine as all others, its outcome in `trouble` and `merged`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    patience_s : float
        How long to wait for a position.
    kinds : sequence of ListKind
        The lists that are read.
    read : callable
        Returns the machine that reads one.
    needs_position : bool
        Whether it is a trouble where the vehicle tells no position.
    names : sequence of str
        The parameters that are asked for; those of the vehicle's autopilot where a mission is to be driven if not given.
    may_lack : frozenset of ListKind
        Lists that a vehicle may not have, or not tell; they are not known then.

    Attributes
    ----------
    trouble : BridgeError or None
        What could not be learnt.
    uid : str
        The uid of the vehicle's board; empty where it tells none.
    coarse : list of ListKind
        The lists that came with positions as 32-bit floats, good to about a metre.
    """

    def __init__(
        self,
        peer: Peer,
        patience_s: float,
        kinds: Sequence[ListKind],
        read: Callable[[Peer, m.MissionType], Download | UndisturbedRead] = Download,
        *,
        needs_position: bool = True,
        names: Sequence[str] | None = None,
        may_lack: frozenset[ListKind] = frozenset(),
    ) -> None:
        super().__init__()
        self.trouble: BridgeError | None = None
        self.uid = ""
        self._peer = peer
        self._patience_s = patience_s
        self._kinds = tuple(kinds)
        self._read = read
        self._needs_position = needs_position
        self._names = tuple(peer.autopilot.parameters.asked if names is None else names)
        self._may_lack = may_lack
        self.coarse: list[ListKind] = []
        self._steps = Steps()
        self._parameters: dict[str, float] = {}
        self._lists: dict[ListKind, tuple[MissionItem, ...]] = {}
        self._awaits_position = True
        self._awaits_fix = True
        self._fix_until_s = 0.0
        self._streams_due_s = 0.0
        self._position_until_s = 0.0

    @property
    def is_done(self) -> bool:
        """Whether all is learnt, or something cannot be."""
        return self.trouble is not None or (not (self._steps or self._awaits_position or self._awaits_fix))

    @property
    def progress(self) -> tuple[int, int]:
        """That of the transfer under way."""
        return self._steps.progress

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link and the vehicle do."""
        transfers_s = MOST_S * (1 + len(self._kinds))  # the parameters and the lists
        return transfers_s + VERSION_PATIENCE_S + _HOME_S + self._patience_s

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self._streams_due_s] if self._awaits_position else []
        if not self._steps:
            times.append(self._position_until_s)
            if self._awaits_fix:
                times.append(self._fix_until_s)
        elif self._steps.deadline_s is not None:
            times.append(self._steps.deadline_s)
        return min(times, default=None)

    def start(self, now_s: float) -> None:
        """Begin to ask."""
        peer = self._peer
        self._streams_due_s = now_s
        self._ask_streams(now_s)
        command, param1 = peer.autopilot.driving.home_asked_by
        home = m.CommandLong(peer.system, peer.component, command, param1=param1)
        self._steps.run(
            [
                step(ReadParameters(peer, self._names), self._take_parameters),
                *(
                    step(self._read(peer, MISSION_TYPES[kind]), partial(self._take_list, kind))
                    for kind in self._kinds
                ),
                # Which vehicle it is, and its firmware, which decides what some parameters are by default.
                step(AskVersion(peer), self._take_version),
                step(SendCommand(peer, home), self._take_home),
            ],
            now_s,
        )

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        message = frame.message
        if isinstance(message, m.GlobalPositionInt) and self._peer.accepts(frame):
            self._awaits_position = self._awaits_position and (message.lat, message.lon) == (0, 0)
        elif isinstance(message, m.GpsRawInt) and self._peer.accepts(frame):
            self._awaits_fix = False
        self._steps.receive(frame, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        self._steps.handle_timer(now_s)
        if not self._steps and now_s >= self._fix_until_s:
            self._awaits_fix = False
        if self._awaits_position:
            self._ask_streams(now_s)
            if not self._steps and now_s >= self._position_until_s:
                self._awaits_position = False
                if self._needs_position:
                    why = f"no position from the vehicle within {self._patience_s:g} s (no GPS fix?)"
                    self._fail(LinkError(why))

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent now."""
        return super().messages_to_send() + self._steps.messages_to_send()

    def merged(self, situation: Situation, now_s: float) -> Situation:
        """Return a situation with what was learnt."""
        situation = replace(situation, parameters={**situation.parameters, **self._parameters})
        for kind, items in self._lists.items():
            situation = with_read_list(situation, kind, items, now_s)
        return situation

    def _ask_streams(self, now_s: float) -> None:
        if now_s >= self._streams_due_s:
            self._streams_due_s = now_s + _ASK_STREAMS_EVERY_S
            self._outgoing += stream_requests(self._peer)

    def _take_parameters(self, machine: ReadParameters, _now_s: float) -> None:
        outcome = machine.outcome
        if outcome is None or outcome.is_silent:
            self._fail(LinkError("the vehicle did not answer the parameter request"))
            return
        self._parameters = dict(outcome.values)

    def _take_list(self, kind: ListKind, machine: Download | UndisturbedRead, _now_s: float) -> None:
        items = list_read(machine, kind)
        if isinstance(items, BridgeError):
            if kind not in self._may_lack:
                self._fail(items)
            return
        self._lists[kind] = items
        if machine.outcome is not None and machine.outcome.is_coarse:
            self.coarse.append(kind)

    def _take_version(self, machine: AskVersion, _now_s: float) -> None:
        self.uid = uid_of(machine.version)

    def _take_home(self, _machine: SendCommand, now_s: float) -> None:
        self._position_until_s = now_s + self._patience_s
        self._fix_until_s = now_s + min(self._patience_s, _FIX_PATIENCE_S)

    def _fail(self, trouble: BridgeError) -> None:
        self._steps.clear()
        self.trouble = trouble


def with_read_list(
    situation: Situation, kind: ListKind, items: tuple[MissionItem, ...], now_s: float
) -> Situation:
    """Take a list that was read from the vehicle for what it holds; a fence that cannot be used leaves none known."""
    situation = with_list(situation, kind, items, now_s, f"{kind} read from the vehicle")
    if kind is ListKind.FENCE and situation.fence_trouble is not None:
        return replace(situation, fence=None)
    return situation
