"""The part of the director that stops the vehicle: HOLD at once, before a new route is made from where it comes to rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.mode_switch import ModeSwitch
from mavlink_bridge.director.operator_watch import OperatorWatch
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.route_maker import RouteMaker
from mavlink_bridge.director.states import Cue, State
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import AUTO_MODE, GUIDED_MODE, HOLD_MODE

if TYPE_CHECKING:
    from mavlink_bridge.director.drive_watch import DriveWatch
    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.director.targets import Target
    from mavlink_bridge.mavlink.messages import Frame, Message
    from missions.situation import Situation

_STILL_MPS = 0.3
_STOP_AT_LEAST_S = 0.25
_STOP_PATIENCE_S = 8.0


class Stopper(RouteMaker):
    """Brings the vehicle to rest.

    Parameters
    ----------
    orders : Orders
        Whether it may.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self.drive: DriveWatch | None = None
        self._operator = OperatorWatch()
        self._stopping: ModeSwitch | None = None  # our HOLD, while it is under way
        self._stopped_s = -math.inf  # when the vehicle took it
        self._may_be_in_auto = False  # our AUTO may be on its way, or no heartbeat may have told of it yet
        self._speed_mps = 0.0
        self._is_hold_granted = False
        self._held_at_s: float | None = None
        self._standstill_due_s = math.inf

    def messages_to_send(self) -> list[Message]:
        """Give and forget what is to be sent now."""
        stopping = self._stopping.messages_to_send() if self._stopping is not None else []
        return stopping + super().messages_to_send()

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        if self._stopping is not None:
            self._stopping.receive(frame, now_s)
            self._look_after_hold(now_s)
        super().receive(frame, now_s)

    def _own_deadlines_s(self) -> list[float | None]:
        times = super()._own_deadlines_s()
        if self._stopping is not None:
            times.append(self._stopping.deadline_s)
        if self.state is State.HOLDING:
            times.append(-math.inf if self._rereading_due else self._standstill_due_s)
        return times

    def _handle_own_timer(self, now_s: float) -> None:
        if self._stopping is not None:
            self._stopping.handle_timer(now_s)
            self._look_after_hold(now_s)
        if self.state is State.HOLDING:
            self._await_standstill(now_s)
        if self.state is State.HOLDING and self._rereading_due:
            self._reread_suspects(now_s)  # while it comes to rest
        super()._handle_own_timer(now_s)

    @property
    def _rereading_due(self) -> bool:
        return self._is_outdated and not self._steps

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        if isinstance(frame.message, m.GlobalPositionInt):
            self._speed_mps = math.hypot(frame.message.vx, frame.message.vy) / 100
        super()._take_vehicle_frame(frame, now_s)

    @property
    def _may_stop_it(self) -> bool:
        if self._peer is None:
            return False
        if self.orders.hold and self.situation.armed and self.situation.mode == AUTO_MODE:
            return True
        if not self.orders.drive:
            return False
        if self.state in (State.STARTING, State.DRIVING):
            return True
        return not self.orders.once and self._may_move

    @property
    def _may_move(self) -> bool:
        """Whether the vehicle may be on its way; a click sets it going before any heartbeat says so."""
        was_clicked = self._target is not None and self._target.is_click
        return was_clicked or (bool(self.situation.armed) and self.situation.mode != HOLD_MODE)

    def _sets_it_going(self, target: Target) -> bool:
        is_command = target.source is TargetSource.REPOSITION
        return target.is_click and (is_command or self.situation.mode == GUIDED_MODE)

    def _take_again(self, target: Target, now_s: float) -> None:
        """Stop the vehicle once more: a command that is repeated has set it going once more."""
        if target.source is not TargetSource.REPOSITION or not self._operator.is_on or self.orders.once:
            return
        self._operator.take_target(now_s, is_click=True)
        if self.state in (State.STARTING, State.DRIVING):
            self._cue_target(now_s)
        else:
            self._command_hold(now_s)

    def _stop_at_once(self, target: Target, now_s: float) -> None:
        is_heard = self._peer is not None and self.state is not State.LOST
        is_moving = target.is_click or (bool(self.situation.armed) and self.situation.mode != HOLD_MODE)
        if self.orders.drive and is_heard and is_moving and not self.orders.once:
            reason = "a target came; it is gone into in a moment"
            self._voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
            self._command_hold(now_s)
        self._watch_while_waiting()

    def _hold(self, reason: str, now_s: float) -> None:
        self.drive = None
        self._held_at_s = None
        self._standstill_due_s = math.inf
        self._voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
        self._drop_steps()
        self._command_hold(now_s)

    def _command_hold(self, now_s: float) -> None:
        """Switch to HOLD."""
        assert self._peer is not None
        self._expect_hold()
        self._stopping = ModeSwitch(self._peer, HOLD_MODE, is_urgent=True, until_seen=self._may_be_in_auto)
        self._stopping.start(now_s)

    def _expect_hold(self) -> None:
        """Expect nothing but what was and what will be once our HOLD is taken."""
        before = {self.situation.mode}
        if self._may_be_in_auto:
            before.add(AUTO_MODE)
        self._operator.expect(HOLD_MODE, before, is_armed=bool(self.situation.armed))

    def _look_after_hold(self, now_s: float) -> None:
        stopping = self._stopping
        if stopping is None:
            return
        if stopping.is_granted and self.state is State.HOLDING and self._held_at_s is None:
            self._held_at_s = now_s
            self._standstill_due_s = now_s + _STOP_AT_LEAST_S
        if not stopping.is_done:
            return
        self._outgoing += stopping.messages_to_send()
        self._stopping = None
        self._may_be_in_auto = False
        self._is_hold_granted = stopping.is_granted
        self._stopped_s = now_s
        self._operator.settle(now_s)
        if not stopping.is_granted:
            text = "the vehicle does not go to HOLD"
            self._voice.tell(now_s, EventName.COMMAND_FAILED, text, "DO_SET_MODE", stopping.result_name)
        self._hold_ended(is_granted=stopping.is_granted, now_s=now_s)

    def _hold_ended(self, *, is_granted: bool, now_s: float) -> None:  # noqa: ARG002 - those above go on from there
        """Go on from a HOLD that was taken, or was not."""
        if not is_granted and self.state is State.HOLDING:
            self._fail_step(OutcomeError("the vehicle does not go to HOLD; nothing was written"))

    def _is_mode_known(self, now_s: float) -> bool:
        # A heartbeat from before our HOLD still tells the mode before it.
        is_news = self._stopping is None and self._heartbeat_s > self._stopped_s
        return is_news and super()._is_mode_known(now_s)

    def _await_standstill(self, now_s: float) -> None:
        """Plan from where the vehicle has come to rest."""
        if self._held_at_s is None or now_s < self._held_at_s + _STOP_AT_LEAST_S:
            return
        is_patience_over = now_s >= self._held_at_s + _STOP_PATIENCE_S and self.situation.mode == HOLD_MODE
        if self._speed_mps <= _STILL_MPS or is_patience_over:
            self._move(Cue.HELD)
        else:
            self._standstill_due_s = now_s + _STOP_AT_LEAST_S

    # Hooks: what follows is decided above

    def _watch_while_waiting(self) -> None:
        """Notice a takeover while a target has to wait."""
        raise NotImplementedError
