"""Switching the vehicle's mode, and nothing against what it tells meanwhile.

DO_SET_MODE may be lost, and so may its COMMAND_ACK; which mode the vehicle is in its HEARTBEAT tells for certain. HOLD is urgent: it is sent
again every half second. Any other mode is sent again only after a heartbeat that shows the vehicle where it was when we asked. Nothing is sent again
once it was accepted, for what is shown afterwards is somebody else's doing, also where ACCEPTED alone does not tell that the vehicle is in the mode (PX4
1.17). Only HOLD is: it sets nothing going, and the answer may be that to a command of ours before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandAck, CommandLong, Heartbeat, MavResult
from mavlink_bridge.protocol.table_machine import Outbox, TableMachine
from mavlink_bridge.protocol.texts import Reasons
from mavlink_bridge.protocol.transitions import (
    MODE_SWITCH,
    MODE_SWITCH_BY_HEARTBEAT,
    MODE_SWITCH_UNTIL_SEEN,
    SwitchEvent,
    SwitchState,
)
from missions.items import Command

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_HURRY_S = 0.5  # HOLD is sent again without waiting for heartbeats; chosen, not measured
_PATIENCE_S = 8.0  # for a heartbeat: of one a second seven may be lost; chosen, not measured
_SETTLE_S = 0.5
"""A heartbeat that comes sooner after a command may have been sent before it."""

_SHOWN_BEFORE_S = 1.5
"""A heartbeat that comes sooner after the answer may have been sent before it, as the director takes it, too; chosen, not measured."""

_MOST_SENDS = 16  # at 50 % loss all are lost once in 65,000 times; chosen, not measured
_MOST_S = 60.0  # 16 sends at a heartbeat a second take 16 s; where heartbeats are lost it takes longer
_HEARTBEAT_ID = 0.0


class ModeSwitch(TableMachine[SwitchState, SwitchEvent]):
    """Switches to a mode.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mode : int
        HEARTBEAT.custom_mode, one of the peer's autopilot.
    is_urgent : bool
        Send it again every half second until it is answered.
    until_seen : bool
        Send it again until a heartbeat shows it: the answer may be that to another command.
    """

    command_name = "DO_SET_MODE"

    def __init__(self, peer: Peer, mode: int, *, is_urgent: bool = False, until_seen: bool = False) -> None:
        only_seen = MODE_SWITCH_UNTIL_SEEN if until_seen else MODE_SWITCH_BY_HEARTBEAT
        answer_counts = peer.autopilot.modes.answer_counts and not until_seen
        super().__init__(MODE_SWITCH if answer_counts else only_seen, SwitchState.IDLE)
        self._peer = peer
        self._mode = mode
        self._is_urgent = is_urgent
        self._sends = 0
        self._sent_s = self._answered_s = 0.0
        self._give_up_s = 0.0
        self._result: MavResult | None = None
        self._reasons = Reasons(peer)

    @property
    def is_granted(self) -> bool:
        """Whether the vehicle said yes, by its answer or by its heartbeat."""
        return self.state in (SwitchState.ACCEPTED, SwitchState.SEEN)

    @property
    def is_seen(self) -> bool:
        """Whether a heartbeat has shown it."""
        return self.state is SwitchState.SEEN

    @property
    def is_left(self) -> bool:
        """Whether the vehicle said yes, and its heartbeat shows another mode: it was not available, or somebody has switched it since."""
        return self.state is SwitchState.LEFT

    @property
    def is_refused(self) -> bool:
        """Whether the vehicle said no."""
        return self.state is SwitchState.REFUSED

    @property
    def texts(self) -> tuple[str, ...]:
        """STATUSTEXTs that came meanwhile and may be the reason of a refusal."""
        return self._reasons.texts

    @property
    def result_name(self) -> str:
        """How it was answered, by name."""
        if self._result is MavResult.ACCEPTED and not self.is_granted:
            return "accepted, but not shown by its heartbeat"
        return self._result.name if self._result is not None else "no answer"

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.is_done or self.state is SwitchState.IDLE:
            return None
        return min(self._sent_s + (_HURRY_S if self._may_send_blindly else _PATIENCE_S), self._give_up_s)

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link does."""
        return _MOST_S

    def start(self, now_s: float) -> None:
        """Send the command."""
        if self._move(SwitchEvent.START):
            self._give_up_s = now_s + _MOST_S
            self._reasons.ask()
            self._send_once(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done or not self._peer.accepts(frame):
            return
        message = frame.message
        self._reasons.take(frame, now_s)
        if isinstance(message, Heartbeat):
            if message.custom_mode == self._mode:
                self._move(SwitchEvent.SEEN)
            else:
                self._take_other_mode(now_s)
        elif isinstance(message, CommandAck) and message.command == Command.DO_SET_MODE:
            self._take_ack(message.result, now_s)

    def _take_other_mode(self, now_s: float) -> None:
        """Take a heartbeat that shows another mode: say it again, unless it was accepted and somebody may have switched it since."""
        is_stop = self._mode == self._peer.autopilot.modes.hold
        if self.state is SwitchState.ACCEPTED and not is_stop:
            if now_s >= self._answered_s + _SHOWN_BEFORE_S:
                self._move(SwitchEvent.LEFT)
        elif now_s >= self._sent_s + _SETTLE_S:
            self._send_again(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        deadline_s = self.deadline_s
        if deadline_s is None or now_s < deadline_s:
            return
        if self._may_send_blindly and now_s < self._give_up_s:
            self._send_again(now_s)
        else:
            self._move(SwitchEvent.SILENCE)

    @property
    def _may_send_blindly(self) -> bool:
        return self._is_urgent and self.state is SwitchState.SENT

    def _take_ack(self, result: int, now_s: float) -> None:
        known = {int(one): one for one in MavResult}.get(result)
        if known is None or known is MavResult.IN_PROGRESS:
            return
        if self.state is SwitchState.SENT:
            self._answered_s = now_s
        self._result = known
        self._move(SwitchEvent.ACCEPTED if known is MavResult.ACCEPTED else SwitchEvent.REFUSED)

    def _send_again(self, now_s: float) -> None:
        if self._sends < _MOST_SENDS:
            self._send_once(now_s)
        else:
            self._move(SwitchEvent.SILENCE)

    def _send_once(self, now_s: float) -> None:
        self._send(set_mode(self._peer, self._mode, self._sends))
        self._sends += 1
        self._sent_s = now_s


def set_mode(peer: Peer, mode: int, confirmation: int) -> CommandLong:
    """Return the command that switches to a mode, for the first time (0) or once more.

    Raises
    ------
    ValueError
        The peer's autopilot has no such mode.
    """
    params = peer.autopilot.modes.command_params(mode)
    return CommandLong(peer.system, peer.component, Command.DO_SET_MODE, confirmation, *params)


def ask_for_heartbeat(peer: Peer) -> CommandLong:
    """Return the command that asks for a heartbeat at once."""
    return CommandLong(peer.system, peer.component, Command.REQUEST_MESSAGE, param1=_HEARTBEAT_ID)


class AwaitHeartbeat(Outbox):
    """Asks for a heartbeat and waits for the vehicle's next: what it tells is no older than our wish to act on it.

    One comes every second also unasked, so nothing is asked twice.
    """

    def __init__(self, peer: Peer) -> None:
        super().__init__()
        self._peer = peer
        self.is_done = False

    @property
    def deadline_s(self) -> float | None:
        """Never: it has no bound of its own. The director drops it when the vehicle has been silent for some seconds, and nothing may follow from silence."""
        return None

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    def start(self, now_s: float) -> None:  # noqa: ARG002 - the contract of machines
        """Ask."""
        self._send(ask_for_heartbeat(self._peer))

    def receive(self, frame: Frame, now_s: float) -> None:  # noqa: ARG002 - the contract of machines
        """Take a frame."""
        self.is_done = self.is_done or (isinstance(frame.message, Heartbeat) and self._peer.accepts(frame))

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
