"""Sending one command and waiting for its result."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandAck, CommandLong, MavResult
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.texts import Reasons
from mavlink_bridge.protocol.transitions import COMMAND, CommandEvent, CommandState

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import CommandInt, Frame
    from mavlink_bridge.protocol.peer import Peer

# Chosen: at 40 % loss each way six sends leave 7 commands of 100 unanswered.
_SEND_AGAIN_S = 1.0
_MOST_SENDS = 6
_PROGRESS_PATIENCE_S = 10.0  # since the last report of progress
_PROGRESS_UNKNOWN = 255  # UINT8_MAX, as COMMAND_ACK.progress is defined
_MOST_S = 60.0  # however long the vehicle reports progress: nothing that is sent here takes longer
_RESULTS = {int(result): result for result in MavResult}


@dataclass(frozen=True, slots=True)
class CommandOutcome:
    """How a command ended.

    Parameters
    ----------
    command : int
        MAV_CMD.
    result : MavResult, optional
        None if no answer came.
    texts : tuple of str
        STATUSTEXTs that came meanwhile and may be the reason of a refusal.
    """

    command: int
    result: MavResult | None
    texts: tuple[str, ...] = ()

    @property
    def is_accepted(self) -> bool:
        """Whether the vehicle accepted the command."""
        return self.result is MavResult.ACCEPTED


class SendCommand(TableMachine[CommandState, CommandEvent]):
    """Sends a command until its result comes; the outcome is None until `is_done`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    message : CommandLong or CommandInt
        The command; a repeated COMMAND_LONG counts its ``confirmation`` up.
    """

    def __init__(self, peer: Peer, message: CommandLong | CommandInt) -> None:
        super().__init__(COMMAND, CommandState.IDLE)
        self._peer = peer
        self._message = message
        self._sends = 0
        self._result: MavResult | None = None
        self._percent = 0
        self._reasons = Reasons(peer)
        self._deadline_s = 0.0
        self._give_up_s = 0.0

    @property
    def outcome(self) -> CommandOutcome | None:
        """How it ended; None while it runs."""
        if not self.is_done:
            return None
        return CommandOutcome(self._message.command, self._result, self._reasons.texts)

    @property
    def progress(self) -> tuple[int, int]:
        """Percent done, as far as the vehicle reports."""
        return (100, 100) if self.is_done else (self._percent, 100)

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, also where the vehicle keeps reporting progress."""
        return _MOST_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.is_done or self.state is CommandState.IDLE else self._deadline_s

    def start(self, now_s: float) -> None:
        """Send the command."""
        if self._move(CommandEvent.START):
            self._reasons.ask()
            self._give_up_s = now_s + _MOST_S
            self._send_once(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done or not self._peer.accepts(frame):
            return
        message = frame.message
        self._reasons.take(frame, now_s)
        if isinstance(message, CommandAck) and message.command == self._message.command:
            self._take_ack(message, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.is_done or self.state is CommandState.IDLE or now_s < self._deadline_s:
            return
        if self.state is CommandState.SENT and self._sends < _MOST_SENDS:
            self._send_once(now_s)
        else:
            self._move(CommandEvent.SILENCE)

    def _send_once(self, now_s: float) -> None:
        message = self._message
        if isinstance(message, CommandLong):
            message = replace(message, confirmation=self._sends)
        self._sends += 1
        self._deadline_s = now_s + _SEND_AGAIN_S
        self._send(message)

    def _take_ack(self, ack: CommandAck, now_s: float) -> None:
        result = _RESULTS.get(ack.result)
        if result is MavResult.IN_PROGRESS:
            if self._move(CommandEvent.PROGRESS):
                self._deadline_s = min(now_s + _PROGRESS_PATIENCE_S, self._give_up_s)
                if ack.progress != _PROGRESS_UNKNOWN:
                    self._percent = min(max(ack.progress, 0), 100)
        elif result is not None and self._move(CommandEvent.RESULT):
            self._result = result
