"""The director: turns messages and time into decisions, as one state machine without sockets and clocks.

It listens for the vehicle, learns it, and makes of each target a plan; uploads the plan verified, drives it in AUTO and watches, as far as its
orders go. It notices what others do: a changed fence, a changed mission, a changed mode. The operator's word always counts more than its own.
The same object runs live, in a replay, against the simulator and in tests.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge import messages as m
from mavlink_bridge.director.drive_watch import DriveWatch
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.keeper import FRESH_S, Keeper
from mavlink_bridge.director.orders import Orders, TargetSource
from mavlink_bridge.director.states import Cue, State
from mavlink_bridge.director.targets import CLICKS, Target, TargetWatch
from mavlink_bridge.errors import BridgeError, OutcomeError, RefusedError
from mavlink_bridge.outcomes import upload_trouble
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
from mavlink_bridge.rover import AUTO_MODE, GUIDED_MODE, HOLD_MODE, MODE_NAMES
from missions.errors import MissionError
from missions.items import Command, last_place, with_home
from missions.plan import plan as make_plan
from missions.recheck import recheck, straight_line

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.director.steps import Step
    from mavlink_bridge.messages import Frame
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.plan import Plan
    from missions.request import Request
    from missions.situation import Situation

_STILL_MPS = 0.3
_STOP_AT_LEAST_S = 0.25
_STOP_PATIENCE_S = 8.0
_MOVED_M = 1.0
_MAKING_A_ROUTE = frozenset({State.PLANNING, State.PROPOSED, State.VERIFIED})


class Director(Keeper):
    """Takes targets to verified missions, and missions to arrival.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    planner : callable, optional
        Makes the plans; `missions.plan.plan` unless a test says otherwise.
    """

    def __init__(
        self,
        orders: Orders,
        situation: Situation | None = None,
        planner: Callable[[Situation, Request], Plan] = make_plan,
    ) -> None:
        super().__init__(orders, situation)
        self.upload_outcome: VerifiedUploadOutcome | None = None
        self.plan: Plan | None = None
        self.drive: DriveWatch | None = None
        self._planner = planner
        self._targets = TargetWatch(orders.target_sources)
        self._target: Target | None = None
        self._waiting_target: Target | None = None
        self._ours: tuple[MissionItem, ...] | None = None  # the mission that is on the vehicle by us
        self._confirmed = False
        self._speed_mps = 0.0
        self._held_at_s: float | None = None
        self._mode_set_s = -math.inf  # when the vehicle took the newest mode of ours
        self._standstill_due_s = math.inf
        self._modes_expected: frozenset[int] = frozenset()
        self._modes_expected_s = -math.inf
        self._item_now = 1

    # What the shell sees

    @property
    def progress(self) -> tuple[int, int]:
        """Progress of the transfer under way, or of the drive by items."""
        if self.state is State.DRIVING and self.drive and self.plan:
            return self.drive.item - 1, len(self.plan.items)
        progress: tuple[int, int] = self._steps.current.progress if self._steps else (0, 0)
        return progress

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The vehicle's old mission, while it waits to be stored; nothing is written before `backup_stored`."""
        upload = self._steps.current
        return upload.pending_backup if isinstance(upload, VerifiedUpload) else None

    # What the shell does

    def take_target(self, position: LatLon, now_s: float) -> None:
        """Take a target that was typed."""
        self._targets.take(position, now_s)
        self._take_target(Target(position, TargetSource.TYPED), now_s)

    def confirm(self, now_s: float) -> None:
        """Take the operator's yes to the plan that stands."""
        self._confirmed = True
        self._go_on(now_s)

    def backup_stored(self, now_s: float) -> None:
        """Take notice that the old mission is safe."""
        upload = self._steps.current
        if isinstance(upload, VerifiedUpload):
            upload.backup_stored(now_s)

    # What follows from learning

    def _learnt(self, now_s: float) -> None:
        if not self._resume(now_s):
            self._want_first_target(now_s)

    def _resume(self, now_s: float) -> bool:
        """Go on watching where, after a lost link, the vehicle still drives our mission and the route still holds."""
        mission, plan = self.situation.mission, self.plan
        if plan is None or self._ours is None or mission is None or mission.value.items != self._ours[1:]:
            return False
        is_driving = bool(self.situation.armed) and self.situation.mode == AUTO_MODE
        if not is_driving or not recheck(plan, self.situation, self._item_now).holds:
            return False
        self._move(Cue.RESUMED)
        self.drive = DriveWatch(plan, self._voice, now_s)
        self.drive.item = self._item_now
        self._voice.tell(now_s, EventName.DRIVING, "still driving our mission", len(plan.items))
        return True

    def _want_first_target(self, now_s: float) -> None:
        """Begin with the targets of the orders; a single job also with the newest of the stream or the mission's last place."""
        targets = self.orders.request.targets
        if self._target is not None:
            self._take_target(self._target, now_s)
        elif targets:
            self._take_target(Target(targets[-1], TargetSource.TYPED), now_s)
        elif self.orders.once:
            self._cue_target(now_s)
        elif TargetSource.MISSION in self.orders.target_sources:
            self._take_mission_target(now_s)

    # Targets and plans

    def _take_target(self, target: Target, now_s: float) -> None:
        if self.state is State.UPLOADING:
            self._waiting_target = target
            return
        if self.state in (State.LEARNING, State.LOST):
            self._target = target
            return
        self._target = target
        self._voice.tell(
            now_s,
            EventName.TARGET,
            f"target {target.position} by {target.source}",
            list(target.position),
            str(target.source),
        )
        if target.command is not None:
            self._answer(target, m.MavResult.IN_PROGRESS)
        self._warn_of_straight_line(target, now_s)
        self._cue_target(now_s)

    def _cue_target(self, now_s: float) -> None:
        if self._may_stop_it and self._move(Cue.TARGET_WHILE_MOVING):
            self._hold("a new route is wanted", now_s)
        elif self._move(Cue.TARGET):
            self._confirmed = False
            self.drive = None
            was_clicked = self._target is not None and self._target.source in CLICKS
            self._expect_modes(
                {self.situation.mode, GUIDED_MODE} if was_clicked else {self.situation.mode}, now_s
            )

    def _expect_modes(self, modes: set[int | None], now_s: float) -> None:
        """Remember how the vehicle stands while a route is made: another mode is somebody else's doing."""
        self._modes_expected = frozenset(mode for mode in modes if mode is not None)
        self._modes_expected_s = now_s

    @property
    def _may_stop_it(self) -> bool:
        """Whether the vehicle may be on its way and is ours to stop; a click sets it going before any heartbeat says so."""
        orders, situation = self.orders, self.situation
        if not orders.drive or (orders.once and self.state is not State.DRIVING):
            return False
        if self.state in (State.STARTING, State.DRIVING):
            return True
        if not situation.armed:
            return False
        was_clicked = self._target is not None and self._target.source in CLICKS
        return was_clicked or situation.mode in (AUTO_MODE, GUIDED_MODE)

    def _warn_of_straight_line(self, target: Target, now_s: float) -> None:
        """Warn at once: a go-to click makes the vehicle drive straight, before any plan exists."""
        if self.situation.mode != GUIDED_MODE or not self.situation.armed or self.situation.pose is None:
            return
        found = straight_line(self.situation, self.orders.request, target.position)
        if found is not None and not found.holds:
            self._voice.rechecked(
                now_s, EventName.STRAIGHT_LINE_UNSAFE, "the straight line to the target", found
            )

    def _hold(self, reason: str, now_s: float) -> None:
        self._confirmed = False
        self.drive = None
        self._held_at_s = None
        self._standstill_due_s = math.inf
        self._voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
        self._steps.clear()
        self._steps.run(
            [self._command(Command.DO_SET_MODE, m.ModeFlag.CUSTOM_MODE_ENABLED, HOLD_MODE)], now_s
        )

    def _await_standstill(self, now_s: float) -> None:
        """Plan from where the vehicle has come to rest."""
        if self._held_at_s is None or now_s < self._held_at_s + _STOP_AT_LEAST_S:
            return
        if self._speed_mps <= _STILL_MPS or now_s >= self._held_at_s + _STOP_PATIENCE_S:
            self._move(Cue.HELD)
        else:
            self._standstill_due_s = now_s + _STOP_AT_LEAST_S

    def _plan_route(self, now_s: float) -> None:
        request = self._route_request()
        try:
            self.plan = self._planner(self.situation, request)
        except MissionError as error:
            self.plan = None
            self._answer_owed(m.MavResult.DENIED)
            self._move(Cue.NO_PLAN)
            self._voice.no_plan(now_s, error)
            self._give_up(error)
            return
        self._move(Cue.PLANNED)
        self._answer_owed(m.MavResult.ACCEPTED)
        self._voice.planned(now_s, self.plan)
        self._go_on(now_s)

    def _route_request(self) -> Request:
        """Give what is asked of the next plan: the orders' request, for the newest target, from where the vehicle is."""
        request = self.orders.request
        if self._target is not None and self._target.position not in request.targets:
            request = replace(request, targets=(self._target.position,))
        return request if self.orders.once else replace(request, start=None)

    def _go_on(self, now_s: float) -> None:
        """Do with the plan what the orders allow."""
        if self.state is not State.PROPOSED or self.plan is None or self._peer is None:
            return
        if not self.orders.upload:
            self._end()
            return
        if (self.orders.confirm and not self._confirmed) or not self._move(Cue.UPLOAD):
            return
        items = with_home(self.plan.items, self.plan.home or self.plan.start)
        is_active = bool(self.situation.armed) and self.situation.mode == AUTO_MODE
        # A heartbeat from before our own change of mode still tells the mode before it.
        is_fresh = max(now_s - FRESH_S, self._mode_set_s) <= self._heartbeat_s
        upload = VerifiedUpload(
            self._peer,
            m.MissionType.MISSION,
            items,
            limits=Limits.from_parameters(self.situation.parameters),
            is_active=is_active if is_fresh else None,
        )
        self._voice.tell(now_s, EventName.UPLOADING, f"uploading {len(items)} items", len(items))
        self._steps.run([(upload, self._uploaded)], now_s)

    def _uploaded(self, machine: VerifiedUpload, now_s: float) -> None:
        outcome = self.upload_outcome = machine.outcome
        assert outcome is not None
        if (trouble := upload_trouble(outcome)) is not None:
            self._ours = None
            self._fail_step(trouble, EventName.UPLOAD_FAILED, now_s)
            return
        self._ours = outcome.found if outcome.found is not None else outcome.backup
        self._move(Cue.UPLOAD_VERIFIED)
        assert self.plan is not None
        count = len(self.plan.items) + 1
        self._voice.tell(
            now_s,
            EventName.VERIFIED,
            f"mission of {count} items verified on the vehicle",
            count,
            outcome.pushes,
        )
        if self._is_taken_over(now_s):
            self._let_go(now_s)
        elif self._waiting_target is not None:
            target, self._waiting_target = self._waiting_target, None
            self._take_target(target, now_s)
        elif self.orders.drive:
            self._start_driving(now_s)
        else:
            self._end()

    # Driving

    def _start_driving(self, now_s: float) -> None:
        assert self.plan is not None
        first_leg = recheck(self.plan, self.situation, 1)
        if not first_leg.holds and first_leg.moved_m > _MOVED_M:
            self._voice.rechecked(
                now_s, EventName.ROUTE_BROKEN, "the way to the first waypoint from here", first_leg
            )
            self._cue_target(now_s)
            return
        self._move(Cue.DRIVE)
        steps = [self._command(Command.COMPONENT_ARM_DISARM, 1.0)] if self.orders.arm else []
        steps.append(self._command(Command.DO_SET_MODE, m.ModeFlag.CUSTOM_MODE_ENABLED, AUTO_MODE))
        # Only after the mode change: before it, in HOLD, ArduPilot reports internal errors.
        steps.append(self._command(Command.DO_SET_MISSION_CURRENT, 1.0, 1.0))
        self._steps.run(steps, now_s)

    def _command(self, number: Command, param1: float, param2: float = 0.0) -> Step:
        assert self._peer is not None
        message = m.CommandLong(self._peer.system, self._peer.component, number, param1=param1, param2=param2)
        return SendCommand(self._peer, message), self._commanded

    def _commanded(self, machine: SendCommand, now_s: float) -> None:
        outcome = machine.outcome
        assert outcome is not None
        if outcome.is_accepted and outcome.command == Command.DO_SET_MODE:
            self._mode_set_s = now_s
        if not outcome.is_accepted:
            name = Command(outcome.command).name
            result = outcome.result.name if outcome.result is not None else "no answer"
            self._steps.clear()
            self._voice.tell(now_s, EventName.COMMAND_FAILED, f"{name}: {result}", name, result)
            kind = OutcomeError if outcome.result is None else RefusedError
            texts = "".join(f"; {text}" for text in outcome.texts)
            self._fail_step(kind(f"{self._on_vehicle}, but it refused {name}: {result}{texts}"), None, now_s)
        elif self.state is State.HOLDING:
            self._held_at_s = now_s
            self._expect_modes({HOLD_MODE}, now_s)
            self._standstill_due_s = now_s + _STOP_AT_LEAST_S
        elif not self._steps and self._move(Cue.STARTED):
            assert self.plan is not None
            self.drive = DriveWatch(self.plan, self._voice, now_s)
            self._voice.tell(now_s, EventName.DRIVING, "AUTO", len(self.plan.items))

    @property
    def _on_vehicle(self) -> str:
        return "the mission is on the vehicle" if self._ours is not None else "nothing was written"

    def _watch_drive(self, frame: Frame, now_s: float) -> None:
        drive = self.drive
        if drive is None:
            return
        drive.receive(frame, now_s)
        if isinstance(frame.message, m.Heartbeat):
            self._watch_mode(frame.message, drive, now_s)
        if drive.has_arrived and self._move(Cue.REACHED):
            drive.tell_progress(now_s)
            self._voice.arrived(now_s, drive)
            self.drive = None
            self._end()

    def _watch_mode(self, heartbeat: m.Heartbeat, drive: DriveWatch, now_s: float) -> None:
        is_armed = heartbeat.base_mode & m.ModeFlag.SAFETY_ARMED
        if drive.has_left_auto(heartbeat, now_s):
            self._let_go(now_s)
        elif self.orders.once and not is_armed:
            self._give_up(
                OutcomeError("the mission is on the vehicle in AUTO, but it is not armed and does not drive")
            )

    def _is_taken_over(self, now_s: float) -> bool:
        """Tell whether somebody switched the vehicle's mode since a route was wanted."""
        is_settled = now_s - self._modes_expected_s > FRESH_S
        is_other = bool(self._modes_expected) and self.situation.mode not in self._modes_expected
        return self.orders.drive and is_settled and is_other

    def _let_go(self, now_s: float) -> None:
        """Leave the vehicle to the operator, until a new target comes."""
        mode = self.situation.mode
        name = MODE_NAMES.get(mode, str(mode)) if mode is not None else "another mode"
        if self._move(Cue.TAKEN_OVER):
            self.drive = None
            self._waiting_target = None
            text = f"somebody switched to {name}; waiting for a new target"
            self._voice.tell(now_s, EventName.TAKEN_OVER, text, name)
            self._give_up(
                OutcomeError(f"somebody switched the vehicle to {name} before it arrived", mode=name)
            )

    # What the vehicle and others do

    def _own_deadlines_s(self) -> list[float | None]:
        times: list[float | None] = []
        if self.state is State.HOLDING:
            times.append(self._standstill_due_s)
        if self.state is State.PLANNING:
            times.append(-math.inf)
        if self.drive is not None:
            times.append(self.drive.progress_due_s)
        return times

    def _handle_own_timer(self, now_s: float) -> None:
        if self.state is State.HOLDING:
            self._await_standstill(now_s)
        elif self.state is State.PLANNING and not self._steps:
            self._plan_route(now_s)
        elif self.drive is not None and now_s >= self.drive.progress_due_s:
            self.drive.tell_progress(now_s)

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        if self.identity is None:
            return
        target = self._targets.look(frame, before, self.situation, now_s, self.identity)
        if target is not None:
            self._take_target(target, now_s)

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        message = frame.message
        if isinstance(message, m.MissionCurrent) and message.seq:
            self._item_now = message.seq
        elif isinstance(message, m.GlobalPositionInt):
            self._speed_mps = math.hypot(message.vx, message.vy) / 100
        super()._take_vehicle_frame(frame, now_s)
        if isinstance(message, m.Heartbeat) and self.state in _MAKING_A_ROUTE and self._is_taken_over(now_s):
            self._let_go(now_s)
        if self.state is State.DRIVING:
            self._watch_drive(frame, now_s)

    def _vehicle_gone(self, *, has_forgotten: bool) -> None:
        self.drive = None
        if has_forgotten:
            self._ours = None

    def _mission_heard(self, now_s: float) -> None:
        self._take_mission_target(now_s)

    def _mission_read(self, items: tuple[MissionItem, ...], now_s: float) -> None:
        if self._ours is not None and items[1:] == self._ours[1:]:
            return
        if self._ours is not None:
            self._ours = None
            count = len(items)
            self._voice.tell(
                now_s, EventName.MISSION_CHANGED, f"somebody changed the mission: {count} items", count
            )
            if self.state is State.DRIVING and self._move(Cue.TAKEN_OVER):
                self.drive = None
        self._take_mission_target(now_s)

    def _fence_changed(self, now_s: float) -> None:
        if self.plan is None or self.state in (State.READY, State.LET_GO, State.ARRIVED):
            if self.state is State.READY and self._target is not None:
                self._cue_target(now_s)
            return
        item = self.drive.item if self.drive is not None else 1
        found = recheck(self.plan, self.situation, item)
        if found.holds:
            return
        self._voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the rest of the route", found)
        if self.state is not State.DRIVING or self.orders.drive:
            self._cue_target(now_s)

    def _take_mission_target(self, now_s: float) -> None:
        mission = self.situation.mission
        place = last_place(mission.value.items) if mission else None
        is_new = self._target is None or place != self._target.position
        if place is not None and is_new and TargetSource.MISSION in self.orders.target_sources:
            self._take_target(Target(place, TargetSource.MISSION), now_s)

    # Answers

    def _answer(self, target: Target, result: m.MavResult) -> None:
        assert target.command is not None
        asker = target.asker or (0, 0)
        self._send(m.CommandAck(target.command, result, target_system=asker[0], target_component=asker[1]))

    def _answer_owed(self, result: m.MavResult) -> None:
        if self._target is not None and self._target.command is not None:
            self._answer(self._target, result)
            self._target = replace(self._target, command=None)

    # A step that failed

    def _fail_step(self, trouble: BridgeError, name: EventName | None, now_s: float) -> None:
        if name is not None:
            self._voice.error(now_s, name, trouble, dict(trouble.details))
        self._move(Cue.TROUBLE)
        self._give_up(trouble)
