"""Asking a vehicle which one it is: AUTOPILOT_VERSION, whose uid no other board has.

Asked for by REQUEST_MESSAGE, and in turn by the older REQUEST_AUTOPILOT_CAPABILITIES. Not every vehicle reports it, and nothing waits long for it:
a vehicle without a uid is known again by how it was connected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import (
    AUTOPILOT_VERSION_ID,
    AutopilotVersion,
    CommandAck,
    CommandLong,
    MavResult,
)
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import VERSION, VersionEvent, VersionState
from missions.items import Command

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_ASK_AGAIN_S = 0.7  # above the round trip of most links; chosen, not measured
VERSION_PATIENCE_S = 5.0
"""At 40 % loss each way eight questions leave one vehicle in forty unknown."""
_MOST_EMPTY_GRANTS = 2
"""Granted so often without its coming, it does not come."""
_QUESTIONS = (
    (Command.REQUEST_MESSAGE, float(AUTOPILOT_VERSION_ID)),
    (Command.REQUEST_AUTOPILOT_CAPABILITIES, 1.0),
)


class AskVersion(TableMachine[VersionState, VersionEvent]):
    """Asks for AUTOPILOT_VERSION.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.

    Attributes
    ----------
    version : AutopilotVersion or None
        What it reported; None while it runs, and where nothing came.
    """

    def __init__(self, peer: Peer) -> None:
        super().__init__(VERSION, VersionState.IDLE)
        self.version: AutopilotVersion | None = None
        self._peer = peer
        self._asked = 0
        self._refused: set[int] = set()
        self._is_granted = False
        self._empty_grants = 0
        self._ask_at_s = 0.0
        self._give_up_s = 0.0

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end."""
        return VERSION_PATIENCE_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return min(self._ask_at_s, self._give_up_s) if self.state is VersionState.ASKING else None

    def start(self, now_s: float) -> None:
        """Ask."""
        if self._move(VersionEvent.START):
            self._give_up_s = now_s + VERSION_PATIENCE_S
            self._ask(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.state is not VersionState.ASKING or not self._peer.accepts(frame):
            return
        message = frame.message
        if isinstance(message, AutopilotVersion):
            self.version = message
            self._move(VersionEvent.VERSION)
        elif isinstance(message, CommandAck) and message.command in {command for command, _ in _QUESTIONS}:
            self._take_ack(message, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.state is not VersionState.ASKING:
            return
        if now_s >= self._give_up_s:
            self._move(VersionEvent.SILENCE)
        elif now_s >= self._ask_at_s:
            self._empty_grants += self._is_granted
            if self._empty_grants < _MOST_EMPTY_GRANTS:
                self._ask(now_s)
            else:
                self._move(VersionEvent.GIVEN_UP)

    def _take_ack(self, ack: CommandAck, now_s: float) -> None:
        if ack.result == MavResult.ACCEPTED:
            self._is_granted = True
            return
        if ack.command not in self._refused and ack.result != MavResult.IN_PROGRESS:
            self._refused.add(ack.command)
            if len(self._refused) == len(_QUESTIONS):
                self._move(VersionEvent.GIVEN_UP)
            else:
                self._ask(now_s)

    def _ask(self, now_s: float) -> None:
        open_questions = [question for question in _QUESTIONS if question[0] not in self._refused]
        command, param1 = open_questions[self._asked % len(open_questions)]
        self._asked += 1
        self._is_granted = False
        self._ask_at_s = now_s + _ASK_AGAIN_S
        self._send(CommandLong(self._peer.system, self._peer.component, command, param1=param1))
