"""Switching the vehicle's mode, or arming it, and nothing against what it tells meanwhile.

The command may be lost, and so may its COMMAND_ACK; what the vehicle did its HEARTBEAT tells for certain. One comes each second, and an operator may act
between two of them, so they are asked for until the answer is known. HOLD is urgent: it is sent again after a second in which nothing was heard. Anything else is sent again only
after a heartbeat that shows the vehicle as it was when we asked, and not where none was heard for so long before that it may have been done and undone.
Nothing is sent again once it was accepted, for what is shown afterwards is somebody else's doing, also where ACCEPTED alone does not tell that the vehicle is
in the mode (PX4 1.17). Only HOLD is: it sets nothing going, and the answer may be that to a command of ours before.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandAck, CommandLong, Heartbeat, MavResult, ModeFlag
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
    from collections.abc import Mapping

    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_HURRY_S = 1.0
"""HOLD is sent again after so long without a heartbeat; where one shows that it was not done, at once. Chosen: over a slow link (0.8 s there and back, tested) the answer comes before."""

_PATIENCE_S = 8.0  # for a heartbeat: of one a second seven may be lost; chosen, not measured
_SETTLE_S = 0.5
"""A heartbeat that comes sooner after a command may have been sent before it."""

_SETTLE_STOP_S = 0.25  # a HOLD too many does no harm; chosen, not measured

ASK_S = 0.1
"""So often a heartbeat is asked for while it is not known what became of a command: sooner than a person answers what a vehicle does. Chosen."""

_MOST_ASKS = 8  # after each command, for about a second: then the next heartbeat comes unasked
_LONGEST_UNSEEN_S = 1.0
"""Longer without a heartbeat, what we asked for may have been done and undone by somebody. Chosen: eight heartbeats were asked for by then."""

_SHOWN_BEFORE_S = 1.5
"""A heartbeat that comes sooner after the answer may have been sent before it, as the director takes it, too; chosen, not measured."""

_MOST_SENDS = 16  # at 50 % loss all are lost once in 65,000 times; chosen, not measured
_MOST_S = 60.0  # 16 sends at a heartbeat a second take 16 s; where heartbeats are lost it takes longer
_HEARTBEAT_ID = 0.0


class SeenCommand(TableMachine[SwitchState, SwitchEvent]):
    """A command whose effect the vehicle's heartbeats show.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    command : CommandLong
        What is sent; its ``confirmation`` is counted up.
    table : mapping
        Its transitions.
    is_stop : bool
        Whether it sets nothing going: then it is said again also after it was accepted.
    is_urgent : bool
        Send it again after each second in which nothing is heard.

    Attributes
    ----------
    is_blind : bool
        Whether it was said again while no heartbeat told what had become of it: who has switched the vehicle meanwhile was overridden, and nobody knows.
    """

    def __init__(
        self,
        peer: Peer,
        command: CommandLong,
        table: Mapping[SwitchState, Mapping[SwitchEvent, SwitchState]],
        *,
        is_stop: bool,
        is_urgent: bool = False,
    ) -> None:
        super().__init__(table, SwitchState.IDLE)
        self.is_blind = False
        self._peer = peer
        self._command = command
        self._is_stop = is_stop
        self._is_urgent = is_urgent
        self._sends = self._asks = 0
        self._sent_s = self._answered_s = 0.0
        self._heard_s = -math.inf
        self._give_up_s = 0.0
        self._result: MavResult | None = None
        self._reasons = Reasons(peer)

    @property
    def command_name(self) -> str:
        """Its MAV_CMD."""
        return Command(self._command.command).name

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
        """Whether the vehicle is shown otherwise, though it said yes or may have done it unseen: it was not available, or somebody has undone it since."""
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
        return min(self._silence_s, self._ask_due_s, self._give_up_s)

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
            if self._shows(message):
                self._move(SwitchEvent.SEEN)
            else:
                self._take_otherwise(now_s)
        elif isinstance(message, CommandAck) and message.command == self._command.command:
            self._take_ack(message.result, now_s)

    def _shows(self, heartbeat: Heartbeat) -> bool:
        """Return whether a heartbeat shows that it was done."""
        raise NotImplementedError

    def _take_otherwise(self, now_s: float) -> None:
        """Take a heartbeat that does not show it: say it again, unless it was accepted, or may have been done unseen, and somebody may have undone it since."""
        unseen_s = now_s - max(self._sent_s, self._heard_s)
        self._heard_s = now_s
        if self.state is SwitchState.ACCEPTED and not self._is_stop:
            if now_s >= self._answered_s + _SHOWN_BEFORE_S:
                self._move(SwitchEvent.LEFT)
        elif now_s < self._sent_s + (_SETTLE_STOP_S if self._is_stop else _SETTLE_S):
            return
        elif self._is_stop or unseen_s <= _LONGEST_UNSEEN_S:
            self.is_blind = False  # it is as it was: nothing of ours was done yet
            self._send_again(now_s)
        else:
            self._move(SwitchEvent.LEFT)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        deadline_s = self.deadline_s
        if deadline_s is None or now_s < deadline_s:
            return
        if now_s < min(self._silence_s, self._give_up_s):
            self._asks += 1
            self._send(ask_for_heartbeat(self._peer))
        elif self._may_send_blindly and now_s < self._give_up_s:
            self.is_blind = self.is_blind or self._heard_s < self._sent_s + ASK_S
            self._send(ask_for_heartbeat(self._peer))  # it is answered before the command is done
            self._send_again(now_s)
        else:
            self._move(SwitchEvent.SILENCE)

    @property
    def _silence_s(self) -> float:
        """When nothing was heard for so long that something is to be done."""
        return self._sent_s + (_HURRY_S if self._may_send_blindly else _PATIENCE_S)

    @property
    def _ask_due_s(self) -> float:
        return self._sent_s + ASK_S * (self._asks + 1) if self._asks < _MOST_ASKS else math.inf

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
        self._send(replace(self._command, confirmation=self._sends))
        self._sends += 1
        self._asks = 0
        self._sent_s = now_s


class ModeSwitch(SeenCommand):
    """Switches to a mode.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mode : int
        HEARTBEAT.custom_mode, one of the peer's autopilot.
    is_urgent : bool
        Send it again after each second in which nothing is heard.
    until_seen : bool
        Send it again until a heartbeat shows it: the answer may be that to another command.
    """

    def __init__(self, peer: Peer, mode: int, *, is_urgent: bool = False, until_seen: bool = False) -> None:
        modes = peer.autopilot.modes
        only_seen = MODE_SWITCH_UNTIL_SEEN if until_seen else MODE_SWITCH_BY_HEARTBEAT
        table = MODE_SWITCH if modes.answer_counts and not until_seen else only_seen
        super().__init__(
            peer, set_mode(peer, mode, 0), table, is_stop=mode == modes.hold, is_urgent=is_urgent
        )
        self._mode = mode

    def _shows(self, heartbeat: Heartbeat) -> bool:
        return heartbeat.custom_mode == self._mode


class Arming(SeenCommand):
    """Arms the vehicle.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    """

    def __init__(self, peer: Peer) -> None:
        command = CommandLong(peer.system, peer.component, Command.COMPONENT_ARM_DISARM, param1=1.0)
        super().__init__(peer, command, MODE_SWITCH, is_stop=False)

    def _shows(self, heartbeat: Heartbeat) -> bool:
        return bool(heartbeat.base_mode & ModeFlag.SAFETY_ARMED)


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
