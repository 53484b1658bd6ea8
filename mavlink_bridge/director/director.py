"""The director: turns messages and time into decisions, as one state machine without sockets and clocks.

It listens for the vehicle, learns it, and makes of each target a plan; uploads the plan verified, drives it in AUTO and watches, as far as its
orders go. It notices what others do: a changed fence, a changed mission, a changed mode. The operator's word always counts more than its own.
The same object runs live, in a replay, against the simulator and in tests.

It stands on others, each with a part of the work: `acquaintance` finds and learns the vehicle, `keeper` keeps true what is known of it,
`target_taker` hears targets, `route_maker` makes them into verified missions, `stopper` brings the vehicle to rest. Here it is made to move, and
left to the operator: nothing else arms or switches to AUTO.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.drive_watch import DriveWatch
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.incidents import Incidents
from mavlink_bridge.director.mode_switch import AwaitHeartbeat, ModeSwitch
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.put_back import PutBack
from mavlink_bridge.director.states import Cue, State
from mavlink_bridge.director.stopper import Stopper
from mavlink_bridge.director.takeover import Takeover, account_of
from mavlink_bridge.director.targets import Target
from mavlink_bridge.errors import OutcomeError, RefusedError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import AUTO_MODE, HOLD_MODE, mode_name
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.find import identity_shared, identity_taken
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.director.steps import Step
    from mavlink_bridge.mavlink.messages import Frame
    from missions.situation import Situation

_MOVED_M = 1.0

_ARMING_SHOWS_S = 1.5
"""So long after the start a heartbeat from before the arming may still come."""

_START_YOURSELF = (
    "arm it and give the target again, or start the mission yourself: arm it in HOLD, then switch to AUTO"
)
_ENDLESS = (Command.NAV_LOITER_UNLIM, Command.NAV_RETURN_TO_LAUNCH)


def _is_no_ardupilots(message: m.Message) -> bool:
    """Return whether a message is a HEARTBEAT of no ArduPilot: its modes mean something else, and it is not the vehicle that was learnt."""
    return isinstance(message, m.Heartbeat) and message.autopilot != m.Autopilot.ARDUPILOTMEGA


class Director(Stopper):
    """Takes targets to verified missions, and missions to arrival.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self._incidents = Incidents(self._voice, orders.request)
        self._taken_over: OutcomeError | None = None
        self._is_first_time = True
        self._item_now = 1
        self._is_our_start = False  # the drive was begun by us, not by somebody else
        self._holds_after_arrival = False
        self._was_in_auto_by_us = False  # when it was last heard, before the link was lost

    @property
    def progress(self) -> tuple[int, int]:
        """Progress of the transfer under way, or of the drive by items."""
        if self.state is State.DRIVING and self.drive and self.plan:
            return self.drive.item - 1, len(self.plan.items)
        progress: tuple[int, int] = self._steps.current.progress if self._steps else (0, 0)
        return progress

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; one with our own ids that we did not send says nothing but that it is there, nor does another autopilot's with the vehicle's."""
        is_heeded = self.state is State.LISTENING or self.orders.passive
        if not is_heeded and self._is_from_vehicle(frame) and _is_no_ardupilots(frame.message):
            return
        if is_heeded or not clash.is_clash(frame, self.identity):
            super().receive(frame, now_s)
            return
        self._identity_clash(now_s)
        self._steps.receive(frame, now_s)  # a list that is read back may not be what we have written any more

    @property
    def drives_by_us(self) -> bool:
        """Whether the vehicle drives because of us, or is about to."""
        return self.orders.drive and (self._may_be_in_auto or self.state is State.DRIVING)

    # What the vehicle and others do

    def _own_deadlines_s(self) -> list[float | None]:
        progress_due_s = self.drive.progress_due_s if self.drive is not None else None
        return [*super()._own_deadlines_s(), progress_due_s]

    def _handle_own_timer(self, now_s: float) -> None:
        super()._handle_own_timer(now_s)
        if self.drive is not None and now_s >= self.drive.progress_due_s:
            self.drive.tell_progress(now_s)

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        message = frame.message
        if isinstance(message, m.MissionCurrent) and message.seq:
            self._item_now = message.seq
        self._incidents.receive(message, self.situation, now_s)
        super()._take_vehicle_frame(frame, now_s)
        if isinstance(message, m.Heartbeat):
            self._take_heartbeat(message, now_s)
        if self.state is State.DRIVING and self.drive is not None:
            self._watch_drive(self.drive, frame, now_s)

    def _take_heartbeat(self, heartbeat: m.Heartbeat, now_s: float) -> None:
        if self.state in clash.CLASHES:
            self._watch_hold(heartbeat, now_s)
            return
        taken = self._operator.take_heartbeat(heartbeat, now_s)
        if taken is None and self._drives_unarmed(now_s):
            taken = Takeover(None)
        if taken is not None:
            self._let_go(taken, now_s)
        elif self._operator.is_late_click(heartbeat, now_s) and self._stopping is None:
            self._command_hold(now_s)
        elif self.state is State.VERIFIED and not self.orders.drive and self._is_driving_ours:
            self._watch_on(now_s, "somebody drives the mission")

    def _drives_unarmed(self, now_s: float) -> bool:
        """Return whether our drive runs on a vehicle that never showed itself armed."""
        is_late = self.drive is not None and now_s > self.drive.begun_s + _ARMING_SHOWS_S
        return self.state is State.DRIVING and is_late and not self.situation.armed

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        if self.state in clash.CLASHES:
            return
        peer = self._peer
        is_anothers = (frame.system, frame.component) != self.identity and not self._is_from_vehicle(frame)
        if peer is not None and is_anothers:
            taken = self._operator.overhear(frame, peer.system, peer.component, now_s)
            if taken is not None:
                self._let_go(taken, now_s)
        super()._take_any_frame(frame, before, now_s)

    def _learnt(self, now_s: float) -> None:
        is_first_time, self._is_first_time = self._is_first_time, False
        targets = self.orders.request.targets
        if not is_first_time and self.orders.once:
            self._give_up(OutcomeError("the vehicle was switched off and on meanwhile"))
        elif not is_first_time:
            self._note_lists()
            self._take_up_again(now_s)
            self._take_waiting_target(now_s)
        elif self._waiting_target is not None or targets:
            self._note_lists()
            if not self._take_waiting_target(now_s):
                self._take_target(Target(targets[-1], TargetSource.TYPED), now_s)
        elif self.orders.once:
            self._cue_target(now_s)
        else:
            self._take_mission_target(now_s)
            self._rally_read(now_s)

    def _take_up_again(self, now_s: float) -> None:
        """Go on where a lost link left us: with watching, never with driving; somebody may have had the vehicle meanwhile."""
        was_in_auto_by_us, self._was_in_auto_by_us = self._was_in_auto_by_us, False
        if was_in_auto_by_us and self.situation.mode == AUTO_MODE and not self.situation.armed:
            self._put_back("the vehicle was disarmed while it was not heard", now_s)
        mission, ours = self.situation.mission, self._ours
        if self.plan is None or ours is None or mission is None or mission.value.items != ours[1:]:
            return
        self._target = Target(self.plan.targets[-1], TargetSource.TYPED)
        if self._is_driving_ours:
            self._watch_on(now_s, "still driving our mission")
            self._fence_changed(now_s)
        elif self.orders.drive:
            self._target = None
        elif self._move(Cue.STILL_THERE) and self._is_stale:
            self._fence_changed(now_s)

    def _watch_on(self, now_s: float, text: str) -> None:
        """Watch a drive on our mission that we did not start just now."""
        if self.plan is not None and self._move(Cue.RESUMED):
            self._operator.expect(AUTO_MODE, set(), is_armed=True)
            self._is_our_start = False
            self.drive = DriveWatch(self.plan, self._voice, now_s)
            self.drive.item = self._item_now
            self._voice.tell(now_s, EventName.DRIVING, text, len(self.plan.items))

    def _vehicle_gone(self, *, has_forgotten: bool) -> None:
        is_in_auto_by_us = self._may_be_in_auto or (self.drive is not None and self._is_our_start)
        self._was_in_auto_by_us = not has_forgotten and (self._was_in_auto_by_us or is_in_auto_by_us)
        self._let_loose()
        if has_forgotten:
            self._incidents.forget()
            self._ours = None
            self._waiting_target = None
        self._watch_while_waiting()

    def _learn(self, now_s: float) -> None:
        super()._learn(now_s)
        is_wanted = self._is_first_time and bool(self.orders.request.targets)
        self._watch_while_waiting(is_wanted=is_wanted)

    def _watch_while_waiting(self, *, is_wanted: bool = False) -> None:
        """Notice a takeover while a target has to wait: it revokes the target."""
        has_target = is_wanted or self._waiting_target is not None
        if has_target and self.orders.drive and not self.orders.once and not self._operator.is_on:
            self._operator.expect(self.situation.mode, set(), is_armed=bool(self.situation.armed))

    @property
    def _item(self) -> int:
        if self.drive is not None:
            return self.drive.item
        return self._item_now if self._is_driving_ours else 1

    # The operator's word

    def _let_go(self, taken: Takeover, now_s: float) -> None:
        """Leave the vehicle to the operator, until a new target comes."""
        if self.state is State.ARRIVED and self.orders.once:
            self._end_drive()  # it has arrived; whoever has it now
            return
        is_ours_in_auto, drive = self._may_be_in_auto, self.drive
        if not self._move(Cue.TAKEN_OVER):
            return
        self._let_loose()
        self._waiting_target = None
        self._is_first_time = False
        is_withdrawing = self.state is State.WITHDRAWING
        then = "the upload is finished first" if is_withdrawing else "waiting for a new target"
        cause = self._incidents.cause_of(taken, now_s)
        account = account_of(taken, cause, self._incidents.heard_before(now_s))
        mode = mode_name(self.situation.mode if taken.mode is None else taken.mode)
        text = f"{account.text}; {then}"
        self._voice.tell(now_s, EventName.TAKEN_OVER, text, mode, str(account.by), account.reason)
        so_far = drive.so_far if drive is not None else ""
        trouble = OutcomeError(f"{account.text}, before it arrived{so_far}", mode=mode)
        if is_withdrawing:
            self._taken_over = trouble
        elif taken.mode is None and is_ours_in_auto:
            self._put_back(str(trouble), now_s)
        else:
            self._give_up(trouble)

    def _put_back(self, what: str, now_s: float) -> None:
        """Take the vehicle, disarmed now, out of the AUTO that we switched it to."""
        assert self._peer is not None
        self._steps.run([(PutBack(self._peer), partial(self._was_put_back, what))], now_s)

    def _was_put_back(self, what: str, machine: PutBack, now_s: float) -> None:
        if machine.is_left_in_auto:
            text = f"{what}, and it does not go to HOLD: it is in AUTO, arming it drives off"
        elif machine.was_needed:
            text = f"{what}; it was switched back from AUTO to HOLD, so that arming it does not drive off"
        else:
            text = what
        trouble = OutcomeError(text, advice=_START_YOURSELF, mode=mode_name(self.situation.mode))
        if machine.was_needed:
            self._voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        self._give_up(trouble)

    def _let_loose(self) -> None:
        """Forget what was wanted and what is under way, but for an upload and for learning."""
        self._operator.stop()
        self._targets.let_go()
        self._answers.settle(m.MavResult.CANCELLED)
        self._stopping = None
        self._may_be_in_auto = False
        self.drive = None
        self._target = None
        if self.state not in (State.WITHDRAWING, State.CLASHING, State.LEARNING):
            self._drop_steps()

    def _after_upload(self, now_s: float) -> None:
        was_rebooted = self._learn_now(now_s)
        if was_rebooted:
            self._ours = None
        taken_over, self._taken_over = self._taken_over, None
        if taken_over is not None:
            self._give_up(taken_over)
        if self.state is State.CLASHED:
            self._settle_clash("the mission is verified on the vehicle, but it is not driven", now_s)
        elif not was_rebooted and not self.is_done:
            super()._after_upload(now_s)

    def _take_target(self, target: Target, now_s: float) -> None:
        if self._move(Cue.TYPED):
            self._operator.stop()
            self._learn(now_s)
        self._operator.take_target(now_s, is_click=target.is_click)
        super()._take_target(target, now_s)

    # Somebody else with our ids

    def _identity_clash(self, now_s: float) -> None:
        """Do what a clash asks for, once until it is settled by a typed target."""
        identity, upload = self.identity, self._steps.current
        if identity is None or self.is_done or isinstance(upload, PutBack):  # that first: it takes seconds
            return
        answer = clash.Circumstances(
            self.state,
            is_start=self._is_first_time,
            is_single_job=self.orders.once,
            has_written=self.upload_outcome is not None or getattr(upload, "has_written", False),
            may_drive=self.orders.drive,
            drives_ours=self._is_driving_ours,
        ).answer
        if answer is clash.Answer.REFUSE:
            self._drop_steps()
            self._refuse(identity_taken(identity), now_s)
            return
        if not self._move(Cue.CLASH):
            return
        hold, may_be_in_auto = self._stopping, self._may_be_in_auto
        self._let_loose()
        self._waiting_target = None
        self._stopping, self._may_be_in_auto = hold, may_be_in_auto  # a HOLD on its way gets there
        is_held = answer is clash.Answer.HOLD
        if hold is not None:
            self._expect_hold()
        elif is_held:
            self._command_hold(now_s)
        text = clash.account(identity, answer, self.state, is_single_job=self.orders.once)
        self._voice.tell(now_s, EventName.IDENTITY_CLASH, text, *identity, is_held or hold is not None)
        if self.state is State.CLASHED:
            self._settle_clash("nothing more is done", now_s)

    def _watch_hold(self, heartbeat: m.Heartbeat, now_s: float) -> None:
        """Leave the vehicle to whoever takes it while our HOLD is under way."""
        if self._stopping is not None and self._operator.take_heartbeat(heartbeat, now_s) is not None:
            self._stopping = None
            self._settle_clash("somebody has taken the vehicle over; the mission is on it", now_s)

    def _settle_clash(self, then: str, now_s: float) -> None:
        """Go on from a clash once nothing is under way any more: to the end of a single job, else to a target that is typed."""
        if self._stopping is not None:
            return
        if self._waiting_target is not None:
            self._take_waiting_target(now_s)
        elif self.orders.once and (self.orders.drive or self.upload_outcome is None):
            self._give_up(identity_shared(self.identity or (0, 0), then))
        else:
            self._end()

    def _hold_ended(self, *, is_granted: bool, now_s: float) -> None:
        super()._hold_ended(is_granted=is_granted, now_s=now_s)
        if self.state is State.CLASHED:
            done = "was switched to HOLD" if is_granted else "does not go to HOLD"
            self._settle_clash(f"the vehicle {done}; the mission is on it", now_s)

    def _stand_by(self) -> None:
        self.drive = None
        if self.orders.drive:
            self._operator.expect(self.situation.mode, set(), is_armed=bool(self.situation.armed))

    # Driving

    def _start_driving(self, now_s: float) -> None:
        if self._move(Cue.DRIVE):
            self._look_once_more(now_s)

    def _look_once_more(self, now_s: float) -> None:
        """Read again what somebody may have changed, and wait for a heartbeat: it shows a takeover that was on its way."""
        assert self._peer is not None
        self._reread_suspects(now_s)
        self._steps.run([(AwaitHeartbeat(self._peer), self._looked)], now_s)

    def _looked(self, _machine: AwaitHeartbeat, now_s: float) -> None:
        if (
            self._has_suspects
            or self._stopping is not None
            or not self._operator.is_ours(self.situation.mode)
        ):
            self._look_once_more(now_s)
            return
        if not self.situation.armed and not self.orders.arm:
            self._refuse_unarmed(now_s)
            return
        if (
            self.situation.mode != HOLD_MODE
        ):  # it starts from HOLD: any other mode is then known for somebody else's
            self._command_hold(now_s)
            self._look_once_more(now_s)
            return
        found = self._recheck(1)
        if not found.holds and (found.moved_m > _MOVED_M or self._is_stale):
            self._route_broke(found, now_s)
        elif self.orders.arm and not self.situation.armed:
            self._steps.run([self._command(Command.COMPONENT_ARM_DISARM, 1.0, self._armed)], now_s)
        else:
            self._switch_to_auto(now_s)

    def _refuse_unarmed(self, now_s: float) -> None:
        """Leave the mode of a disarmed vehicle alone: in AUTO, arming it would drive off."""
        mode = mode_name(self.situation.mode)
        drives_off = ": arming it drives off" if self.situation.mode == AUTO_MODE else ""
        trouble = OutcomeError(
            f"the mission is verified on the vehicle, which is not armed and does not drive: its mode was left alone ({mode}{drives_off})",
            advice=_START_YOURSELF,
            mode=mode,
        )
        self._stand_by()
        self._voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        self._fail_step(trouble)

    def _armed(self, machine: SendCommand, now_s: float) -> None:
        if self._is_accepted(machine, now_s):
            self._switch_to_auto(now_s)

    def _switch_to_auto(self, now_s: float) -> None:
        assert self._peer is not None
        self._may_be_in_auto = True
        self._operator.expect(AUTO_MODE, {self.situation.mode}, is_armed=bool(self.situation.armed))
        self._steps.run([(ModeSwitch(self._peer, AUTO_MODE), self._in_auto)], now_s)

    def _in_auto(self, machine: ModeSwitch, now_s: float) -> None:
        if not machine.is_granted:
            self._stand_by()
            self._command_failed("DO_SET_MODE", machine.result_name, "", now_s)
            return
        self._operator.settle(now_s)
        # Only after the mode change: before it, in HOLD, ArduPilot reports internal errors.
        self._steps.run(
            [self._command(Command.DO_SET_MISSION_CURRENT, 1.0, self._started, param2=1.0)], now_s
        )

    def _started(self, machine: SendCommand, now_s: float) -> None:
        if not self._is_accepted(machine, now_s):
            self._command_hold(now_s)  # it drives from an item that we do not know
        elif self._move(Cue.STARTED):
            assert self.plan is not None
            self._is_our_start = True
            self.drive = DriveWatch(self.plan, self._voice, now_s)
            self._voice.tell(now_s, EventName.DRIVING, "AUTO", len(self.plan.items))

    def _command(
        self, number: Command, param1: float, take: Callable[[SendCommand, float], None], param2: float = 0.0
    ) -> Step:
        assert self._peer is not None
        message = m.CommandLong(self._peer.system, self._peer.component, number, param1=param1, param2=param2)
        return SendCommand(self._peer, message), take

    def _is_accepted(self, machine: SendCommand, now_s: float) -> bool:
        outcome = machine.outcome
        assert outcome is not None
        if not outcome.is_accepted:
            result = outcome.result.name if outcome.result is not None else "no answer"
            texts = "".join(f"; {text}" for text in outcome.texts)
            self._command_failed(Command(outcome.command).name, result, texts, now_s)
        return outcome.is_accepted

    def _command_failed(self, name: str, result: str, texts: str, now_s: float) -> None:
        self._drop_steps()
        self._voice.tell(now_s, EventName.COMMAND_FAILED, f"{name}: {result}", name, result)
        kind = OutcomeError if result == "no answer" else RefusedError
        self._fail_step(kind(f"the mission is on the vehicle, but it refused {name}: {result}{texts}"))

    def _watch_drive(self, drive: DriveWatch, frame: Frame, now_s: float) -> None:
        drive.receive(frame, now_s)
        if drive.has_arrived and self._move(Cue.REACHED):
            drive.tell_progress(now_s)
            self._holds_after_arrival = self._is_our_start and not self._goes_on_after_arrival
            self._voice.arrived(now_s, drive, holds=self._holds_after_arrival)
            if self._holds_after_arrival:
                self._command_hold(now_s)
            self.drive = None
            if not self._holds_after_arrival:
                self._end_drive()

    @property
    def _goes_on_after_arrival(self) -> bool:
        """Whether the mission's end is something to do: to loiter, to return, or what MIS_DONE_BEHAVE says."""
        assert self.plan is not None
        ends = any(item.command in _ENDLESS for item in self.plan.items)
        return ends or self.situation.parameters.get("MIS_DONE_BEHAVE", 0) != 0

    def _look_after_hold(self, now_s: float) -> None:
        super()._look_after_hold(now_s)
        if self._stopping is None and self._holds_after_arrival and self.state is State.ARRIVED:
            self._end_drive()
            if not self._is_hold_granted:
                self._give_up(OutcomeError("it has arrived, but it does not go to HOLD: it is still in AUTO"))

    def _end_drive(self) -> None:
        """End a drive that has arrived; a single job is done with it."""
        self._holds_after_arrival = False
        self._let_loose()
        self._end()
