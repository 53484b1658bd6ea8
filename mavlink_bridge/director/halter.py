"""The part of the director that stops the vehicle: HOLD at once, before a new route is made from where it comes to rest.

HOLD does not brake: a rover of 2 m/s rolls for 4 s. Once its roll tells where it will stand (`resting_pose`), the route is planned from there, and uploaded,
while it rolls; `Starter` switches to AUTO only once it stands, and where the mission keeps its promise from the very place.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import Cue, Notice, Signal, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.mode_switch import ModeSwitch, ask_for_heartbeat
from mavlink_bridge.protocol.stop_here import StopHere
from missions.checking.holding import resting_pose
from missions.stops import Rolling

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.list_watch import ListWatch
    from mavlink_bridge.director.targets import Target
    from mavlink_bridge.mavlink.messages import Frame, Message
    from missions.situation import Pose

FRESH_S = 1.5
"""How old a heartbeat may be to tell what the vehicle does now."""

STILL_MPS = 0.3
"""Slower than this counts as standing."""

_STOP_AT_LEAST_S = 0.25
"""Positions come four times a second: one from after the HOLD is waited for."""

_SOON_S = 1.0
"""A route that was refused within this, while the vehicle rolls, is asked for once more: obstacles may have moved on, or are known better. Chosen."""

# Then a vehicle in HOLD that still reports a speed (a drifting fix, a slope) is taken for stopped; chosen, not measured.
_STOP_PATIENCE_S = 8.0

_DRIVEN_MPS = 0.8
"""Faster than a PX4 rover at rest in HOLD was ever told to be: 0.6 m/s, in recordings of both versions."""

_LOOP_S = 3.5
"""PX4's loop takes so long at the most, as measured."""

_DIVERTED_AFTER_S = 5.0
"""A vehicle that a click drives in HOLD still moves so long after it: every other is at rest by then."""


_LATE_CLICK_S = _DIVERTED_AFTER_S + 4.0
"""A click that came to us at once may come to the vehicle 3 s later, by a radio that repeats it; and so long it is waited for."""


class Halter(Part):
    """Brings the vehicle to rest.

    Attributes
    ----------
    stopping : ModeSwitch or StopHere or None
        Our HOLD, or what else stops it, while it is under way.
    may_be_in_auto : bool
        Whether our AUTO may be on its way, or no heartbeat may have told of it yet.
    is_hold_granted : bool
        Whether the newest HOLD that has ended was taken.
    expected : Pose or None
        Where the vehicle will stand, while it rolls there.
    """

    def __init__(self, core: Core, lists: ListWatch) -> None:
        super().__init__(core)
        self._lists = lists
        self.stopping: ModeSwitch | StopHere | None = None
        self.may_be_in_auto = False
        self.is_hold_granted = False
        self.expected: Pose | None = None
        self._expected_s = -math.inf  # since when
        self._stopped_s = -math.inf  # when the vehicle took it
        self._is_seen = False  # a heartbeat has shown it
        self._held_at_s: float | None = None
        self._standstill_due_s = math.inf
        self._is_diverted = False  # a click may drive it in HOLD
        self._clicked_s = -math.inf
        self._is_for_good = False  # a person asks for it: said until a heartbeat shows it
        self._rolling: Rolling | None = None  # while it may tell where it ends

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self.stopping.deadline_s] if self.stopping is not None else []
        if self.core.state is State.HOLDING:
            times.append(-math.inf if self._rereading_due else self._standstill_due_s)
        return min((time_s for time_s in times if time_s is not None), default=None)

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent before anything else."""
        return self.stopping.messages_to_send() if self.stopping is not None else []

    def hear_answer(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Take a frame for the HOLD that is under way."""
        if self.stopping is None:
            return []
        self.stopping.receive(frame, now_s)
        return self._look_after_hold(self.stopping, now_s)

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Take each position of a vehicle that comes to rest."""
        core, pose = self.core, self.core.situation.pose
        if isinstance(frame.message, m.Statustext) and core.is_from_vehicle(frame):
            self._take_text(frame.message.text, now_s)
        is_position = isinstance(frame.message, m.GlobalPositionInt) and core.is_from_vehicle(frame)
        if core.state is not State.HOLDING or not is_position or pose is None:
            return []
        if self._rolling is not None:
            self._rolling = self._rolling.moved(pose.value.position, pose.value.speed_mps, now_s)
        if self._is_driven_in_hold(now_s):
            return self._stop_diverted(now_s)
        if self._has_come_to_rest(now_s):
            return [Cue.HELD]
        if self.stopping is None and self._rolling is not None and core.orders.drive:
            self.expected = resting_pose(core.situation, core.orders.request, self._rolling)
        self._expected_s = now_s
        return [] if self.expected is None else [Cue.HELD]

    def _take_text(self, text: str, now_s: float) -> None:
        """Wait anew where the vehicle tells of another breach while its loop lasts: its autopilot stops it once more, and it moves on that much longer."""
        is_in_loop = self._held_at_s is not None and now_s <= self._held_at_s + _LOOP_S
        if is_in_loop and self.core.autopilot.incidents.tells_breach_alone(text):
            self._held_at_s = now_s

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Send HOLD again, or see whether the vehicle stands."""
        if self.stopping is not None:
            self.stopping.handle_timer(now_s)
            if signals := self._look_after_hold(self.stopping, now_s):
                return signals
        if self.core.state is not State.HOLDING:
            return []
        if self._is_driven_in_hold(now_s):
            return self._stop_diverted(now_s)
        if self._has_come_to_rest(now_s):
            return [Cue.HELD]
        if self._rereading_due:
            self._lists.reread_suspects(now_s)  # while it comes to rest
        return []

    @property
    def _rereading_due(self) -> bool:
        return self._lists.is_outdated and not self.core.steps

    @property
    def stands(self) -> bool:
        """Whether the vehicle stands, as last told."""
        pose = self.core.situation.pose
        return pose is None or pose.value.speed_mps <= STILL_MPS

    @property
    def patience_over_s(self) -> float:
        """When a vehicle in HOLD that still reports a speed is taken for stopped."""
        return (self._held_at_s or 0.0) + _STOP_PATIENCE_S

    def wait_for_rest(self, now_s: float) -> None:
        """Let the vehicle roll on, for no route was found from where it is expected to stand: later from there once more, where that was soon known, else from where it stands."""
        self.expected = self._rolling = None
        self._standstill_due_s = now_s
        pose = self.core.situation.pose
        is_soon = now_s <= self._expected_s + _SOON_S
        if is_soon and pose is not None and pose.value.speed_mps > 2 * STILL_MPS:
            rolling = Rolling(now_s)
            self._rolling = rolling.moved(pose.value.position, pose.value.speed_mps, now_s)

    # What may be stopped

    @property
    def may_stop_it(self) -> bool:
        """Whether the vehicle may be on its way and is ours to stop."""
        core = self.core
        if core.peer is None:
            return False
        if core.orders.hold and core.is_in_mission:
            return True
        if not core.orders.drive:
            return False
        if core.state in (State.STARTING, State.DRIVING):
            return True
        return not core.orders.once and self._may_move(core.target)

    def _may_move(self, target: Target | None) -> bool:
        """Return whether the vehicle may be on its way; a click, or an RTL, sets it going before any heartbeat says so."""
        has_set_off = target is not None and target.has_set_off
        situation = self.core.situation
        is_driving = situation.mode != self.core.modes.hold or self.moves_in_hold
        return has_set_off or (bool(situation.armed) and is_driving)

    @property
    def moves_in_hold(self) -> bool:
        """Whether a vehicle that a click drives in HOLD moves there."""
        pose = self.core.situation.pose
        drives_in_hold = self.core.autopilot.driving.clicks_drive_in_hold
        return drives_in_hold and pose is not None and pose.value.speed_mps > _DRIVEN_MPS

    def may_be_clicked(self, now_s: float) -> bool:
        """Return whether a click that was heard may have come to the vehicle just now, and drive it in the mode that stops."""
        return now_s <= self._clicked_s + _LATE_CLICK_S

    # Stopping

    def stop_again(self, target: Target, now_s: float) -> Sequence[Signal]:
        """Stop the vehicle once more: a command that is repeated has set it going once more."""
        core = self.core
        if target.source is not TargetSource.REPOSITION or not core.operator.is_on or core.orders.once:
            return []
        core.operator.take_target(now_s, is_click=True)
        self._note_click(target, now_s)
        if core.state in (State.STARTING, State.DRIVING):
            return [Notice.ROUTE_WANTED]
        self.command_hold(now_s)
        return []

    def stop_at_once(self, target: Target, now_s: float) -> None:
        """Stop a vehicle that a target has set going, though the target itself has to wait."""
        core = self.core
        is_heard = core.peer is not None and core.state is not State.LOST
        if core.orders.drive and is_heard and self._may_move(target) and not core.orders.once:
            reason = (
                "called home; it is handled next"
                if target.is_home
                else "a target was received; it is handled next"
            )
            core.voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
            self._note_click(target, now_s)
            self.command_hold(now_s)

    def hold(self, reason: str, now_s: float) -> None:
        """Leave what is under way and stop the vehicle, to plan from where it stands."""
        self._held_at_s = None
        self._standstill_due_s = math.inf
        self.expected = self._rolling = None
        self.core.voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
        self.core.steps.clear()
        if self.core.target is not None:
            self._note_click(self.core.target, now_s)
        self.command_hold(now_s)

    def hold_for_good(self, reason: str, now_s: float) -> None:
        """Stop the vehicle because a person asks for it: said until its heartbeat shows HOLD."""
        self.core.voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
        self.may_be_in_auto = self._is_for_good = True
        drives_in_hold = self.core.autopilot.driving.clicks_drive_in_hold
        self._is_diverted = drives_in_hold and (self.moves_in_hold or self.may_be_clicked(now_s))
        self.command_hold(now_s)

    def _note_click(self, target: Target, now_s: float) -> None:
        """Remember that a click may drive the vehicle in the mode that is to stop it."""
        if target.is_click and self.core.autopilot.driving.clicks_drive_in_hold:
            self._is_diverted, self._clicked_s = True, now_s

    def command_hold(self, now_s: float) -> None:
        """Switch to HOLD; where a click may drive the vehicle in that, stop it where it is."""
        core, pose = self.core, self.core.situation.pose
        assert core.peer is not None
        self.expect_hold()
        if self._is_diverted and pose is not None:
            self.stopping = StopHere(core.peer, pose.value.position)
        else:
            self.stopping = ModeSwitch(
                core.peer, core.modes.hold, is_urgent=True, until_seen=self.may_be_in_auto
            )
        self._is_diverted = False
        self.stopping.start(now_s)

    def expect_hold(self) -> None:
        """Expect nothing but what was and what will be once our HOLD is taken."""
        situation = self.core.situation
        before = {situation.mode}
        if self.may_be_in_auto:
            before.add(self.core.modes.mission)
        self.core.operator.expect(self.core.modes.hold, before, is_armed=bool(situation.armed))

    def let_go(self) -> None:
        """Stop nothing any more."""
        self.stopping = None
        self.may_be_in_auto = self._is_for_good = False

    def _look_after_hold(self, stopping: ModeSwitch | StopHere, now_s: float) -> Sequence[Signal]:
        core = self.core
        if stopping.is_granted and core.state is State.HOLDING and self._held_at_s is None:
            assert core.peer is not None
            self._held_at_s = now_s
            self._standstill_due_s = now_s + _STOP_AT_LEAST_S
            self._rolling = Rolling(now_s)
            # The HOLD may have to be seen; the next one would come a second later.
            core.send(ask_for_heartbeat(core.peer))
        if not stopping.is_done:
            return []
        core.send(*stopping.messages_to_send())
        if self._is_for_good and isinstance(stopping, StopHere):
            self.command_hold(
                now_s
            )  # it stops where it was driven to, granted or not; its mode is still to be seen
            return []
        self.let_go()
        self.is_hold_granted = stopping.is_granted
        self._is_seen = isinstance(stopping, ModeSwitch) and stopping.is_seen
        self._stopped_s = now_s
        core.operator.settle(now_s)
        if not stopping.is_granted:
            text = "the vehicle did not switch to HOLD"
            core.voice.tell(
                now_s, EventName.COMMAND_FAILED, text, stopping.command_name, stopping.result_name
            )
        is_unseen = stopping.is_granted and stopping.is_blind
        return [Notice.HELD_UNSEEN if is_unseen else Notice.HOLD_ENDED]

    def is_mode_known(self, now_s: float) -> bool:
        """Return whether the newest heartbeat is news of the mode that the vehicle is in."""
        # A heartbeat from before our HOLD still tells the mode before it.
        is_after = self.core.heartbeat_s > self._stopped_s or (
            self._is_seen and self.core.heartbeat_s == self._stopped_s
        )
        is_news = self.stopping is None and is_after
        return is_news and now_s - self.core.heartbeat_s <= FRESH_S

    def _is_driven_in_hold(self, now_s: float) -> bool:
        """Return whether the vehicle drives in HOLD, longer than its stop takes."""
        if self._held_at_s is None or self.stopping is not None:
            return False
        return now_s >= self._held_at_s + _DIVERTED_AFTER_S and self.moves_in_hold

    def _stop_diverted(self, now_s: float) -> Sequence[Signal]:
        """Stop a vehicle that a click has sent away after our HOLD; where none was heard, somebody else drives it."""
        if not self.may_be_clicked(now_s):
            return [Notice.DRIVEN_IN_HOLD]
        self._is_diverted, self._held_at_s = True, None
        self._standstill_due_s = math.inf
        self.command_hold(now_s)
        return []

    def _has_come_to_rest(self, now_s: float) -> bool:
        """Return whether the vehicle stands, or will not; else look again a little later."""
        if self._held_at_s is None or now_s < self._held_at_s + _STOP_AT_LEAST_S:
            return False
        is_held = self.core.situation.mode == self.core.modes.hold
        if self.stands or (now_s >= self.patience_over_s and is_held):
            return True
        self._standstill_due_s = now_s + _STOP_AT_LEAST_S
        return False
