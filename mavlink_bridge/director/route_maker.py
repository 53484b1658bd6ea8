"""The part of the director that makes of each target a plan, and of the plan a verified mission, as far as the orders go."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.plan_task import PlanTask
from mavlink_bridge.director.states import Cue, State
from mavlink_bridge.director.target_taker import TargetTaker
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import AUTO_MODE
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.outcomes import Writing, end_of_upload, upload_trouble
from mavlink_bridge.protocol.sendable import check_items
from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
from missions.checking.recheck import Recheck, recheck
from missions.errors import MissionError
from missions.items import with_home
from missions.promise import asked_clearance

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.mavlink.messages import Frame
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

FRESH_S = 1.5
"""How old a heartbeat may be to tell what the vehicle does now."""

_MAKING_A_ROUTE = frozenset({State.HOLDING, State.PLANNING})
"""States whose plan is yet to come: it is made around the fence as it is then."""

_ON_OUR_MISSION = frozenset({State.VERIFIED, State.STARTING, State.DRIVING})


class RouteMaker(TargetTaker):
    """Takes targets to verified missions.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).

    Attributes
    ----------
    upload : VerifiedUpload or None
        The newest upload, under way or ended; None before the first.
    upload_outcome : VerifiedUploadOutcome or None
        How the newest upload that has ended did.
    plan : Plan or None
        The plan that stands.
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self.upload: VerifiedUpload | None = None
        self.upload_outcome: VerifiedUploadOutcome | None = None
        self.plan: Plan | None = None
        self._task: PlanTask | None = None
        self._made: Plan | MissionError | None = None
        self._planned_on = Grounds.of(self.situation)
        self._is_own_idea = (
            False  # the route is made because the one before broke, not because somebody asked
        )
        self._ours: tuple[MissionItem, ...] | None = None  # the mission that is on the vehicle by us
        self._confirmed = False
        self._backup_path: Path | None = None

    # What the shell sees and does

    @property
    def is_uploading(self) -> bool:
        """Whether an upload is under way, from the reading of the old mission on."""
        return isinstance(self._steps.current, VerifiedUpload)

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The vehicle's old mission, while it waits to be stored; nothing is written before `backup_stored`."""
        upload = self._steps.current
        return upload.pending_backup if isinstance(upload, VerifiedUpload) else None

    @property
    def pending_plan(self) -> PlanTask | None:
        """The plan that is waited for; nothing follows before `plan_made`."""
        return self._task if self.state is State.PLANNING and self._made is None else None

    def plan_made(self, task: PlanTask, made: Plan | MissionError, now_s: float) -> None:
        """Take a plan, or why there is none; what is not waited for any more is left."""
        if task is self.pending_plan:
            self._made = made
            self._go_on_planning(now_s)

    @property
    def awaits_confirmation(self) -> bool:
        """Whether a plan stands that is uploaded only after `confirm`."""
        orders = self.orders
        return self.state is State.PROPOSED and orders.upload and orders.confirm and not self._confirmed

    def confirm(self, now_s: float) -> None:
        """Take the operator's yes to the plan that stands; a yes to none is forgotten."""
        if self.state is State.PROPOSED:
            self._confirmed = True
            self._go_on(now_s)

    def backup_stored(self, now_s: float, path: Path | None = None) -> None:
        """Take notice that the old mission is safe, and where: an upload that fails says so."""
        upload = self._steps.current
        if isinstance(upload, VerifiedUpload):
            self._backup_path = path
            upload.backup_stored(now_s)

    def backup_failed(self, trouble: BridgeError, now_s: float) -> None:
        """Take notice that the old mission cannot be stored: the upload is left before anything is written."""
        if self.pending_backup is None:
            return
        self._drop_steps()
        self._upload_failed(trouble, {}, now_s)
        self._after_upload(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        super().receive(frame, now_s)
        old = self.pending_backup
        if old is not None and self._is_own_idea and self._ours is not None and old[1:] != self._ours[1:]:
            self._drop_steps()  # nothing was written yet
            self._move(Cue.TROUBLE)
            self._mission_taken_over(len(old), now_s)

    def _cue_target(self, now_s: float, *, is_own_idea: bool = False) -> None:
        self._is_own_idea = is_own_idea
        if self._may_stop_it and self._move(Cue.TARGET_WHILE_MOVING):
            self._confirmed = False
            self._hold("a new route is wanted", now_s)
        elif self._move(Cue.TARGET):
            self._confirmed = False
            self._stand_by()

    # Plans

    def _move(self, event: Cue) -> bool:
        has_moved = super()._move(event)
        if has_moved:
            self._forget_task()
        return has_moved

    def _forget_task(self) -> None:
        self._task = self._made = None

    def _own_deadlines_s(self) -> list[float | None]:
        return [-math.inf] if self._planning_due else []

    def _handle_own_timer(self, now_s: float) -> None:
        if self.state is State.PLANNING:
            self._go_on_planning(now_s)

    @property
    def _planning_due(self) -> bool:
        """Whether there is something to do for the plan, but to wait for it."""
        is_waiting = self.pending_plan is not None and not self._is_outdated
        return self.state is State.PLANNING and not self._steps and not is_waiting

    def _go_on_planning(self, now_s: float) -> None:
        """Have a plan made around what is known by now, and go on with the one that was."""
        if self._steps:
            return
        if self._is_outdated:
            self._reread_suspects(now_s)
        elif self._task is None:
            self._planned_on = Grounds.of(self.situation)
            self._task = PlanTask(self.situation, self._route_request())
        elif self._made is not None:
            self._take_plan(self._made, now_s)

    def _take_plan(self, made: Plan | MissionError, now_s: float) -> None:
        if isinstance(made, MissionError):
            self.plan = None
            self._answers.settle(m.MavResult.DENIED)
            self._move(Cue.NO_PLAN)
            self._voice.no_plan(now_s, made)
            self._give_up(made)
            return
        self.plan = made
        self._move(Cue.PLANNED)
        self._answers.settle(m.MavResult.ACCEPTED)
        self._voice.planned(now_s, made)
        self._go_on(now_s)

    def _route_request(self) -> Request:
        """Give what is asked of the next plan: the orders' request, for the newest target, from where the vehicle is."""
        request = self.orders.request
        if self._target is not None and self._target.position not in request.targets:
            request = replace(request, targets=(self._target.position,))
        return request if self.orders.once else replace(request, start=None)

    def _recheck(self, item: int) -> Recheck:
        """Check the rest of the route against the fence and its parameters as they are now."""
        assert self.plan is not None
        try:
            vehicle, _ = asked_clearance(self.situation, self.orders.request)
        except MissionError:
            vehicle = self.plan.vehicle
        try:
            return recheck(replace(self.plan, vehicle=vehicle), self.situation, item)
        except Exception as error:  # noqa: BLE001 - a defect of ours: what cannot be checked does not hold
            why = f"not known: checking it broke down ({type(error).__name__}: {error}), a defect"
            return Recheck(0.0, self.plan.asked_m, why)

    def _fence_changed(self, now_s: float) -> None:
        self._forget_task()
        if self.state is State.READY and self._target is not None:
            self._cue_target(now_s, is_own_idea=True)
        if self.plan is None or self.state in _MAKING_A_ROUTE or self.state is State.ARRIVED:
            return
        found = self._recheck(self._item)
        if found.holds:
            return
        is_ours_to_mend = self.state not in (State.READY, State.LET_GO)
        if is_ours_to_mend or self._is_driving_ours:
            self._voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the rest of the route", found)
        if is_ours_to_mend and (self.state is not State.DRIVING or self.orders.drive):
            self._cue_target(now_s, is_own_idea=True)

    @property
    def _is_driving_ours(self) -> bool:
        """Whether the vehicle drives our mission, whoever started it."""
        situation, ours = self.situation, self._ours
        is_auto = bool(situation.armed) and situation.mode == AUTO_MODE
        mission = situation.mission
        return is_auto and ours is not None and mission is not None and mission.value.items == ours[1:]

    # Missions

    def _go_on(self, now_s: float) -> None:
        """Do with the plan what the orders allow."""
        if self.state is not State.PROPOSED or self.plan is None or self._peer is None:
            return
        if not self.orders.upload:
            self._end()
            return
        if (self.orders.confirm and not self._confirmed) or not self._move(Cue.UPLOAD):
            return
        self._drop_steps()
        items = with_home(self.plan.items, self.plan.home or self.plan.start)
        try:
            check_items(items, m.MissionType.MISSION)
        except MissionError as error:
            self._upload_failed(error, dict(error.details), now_s)
            return
        self._backup_path = None
        upload = self.upload = VerifiedUpload(
            self._peer,
            m.MissionType.MISSION,
            items,
            limits=Limits.from_parameters(self.situation.parameters),
        )
        if self._is_mode_known(now_s):
            upload.know_vehicle(self.watch, now_s)
        self._voice.tell(now_s, EventName.UPLOADING, f"uploading {len(items)} items", len(items))
        self._steps.run([(upload, self._uploaded)], now_s)

    def _is_mode_known(self, now_s: float) -> bool:
        """Tell whether the newest heartbeat is news of the mode that the vehicle is in."""
        return now_s - self._heartbeat_s <= FRESH_S

    def _uploaded(self, machine: VerifiedUpload, now_s: float) -> None:
        outcome = self.upload_outcome = machine.outcome
        assert outcome is not None
        if (trouble := upload_trouble(outcome)) is not None:
            self._ours = None
            ended = end_of_upload(trouble, Writing("mission", machine, self._backup_path))
            assert isinstance(ended, BridgeError)
            self._upload_failed(ended, dict(ended.details), now_s)
        else:
            self._ours = outcome.found if outcome.found is not None else outcome.backup
            self._move(Cue.UPLOAD_VERIFIED)
            assert self.plan is not None
            count = len(self.plan.items) + 1
            text = f"mission of {count} items verified on the vehicle"
            self._voice.tell(now_s, EventName.VERIFIED, text, count, outcome.pushes)
        self._after_upload(now_s)

    def _upload_failed(
        self, trouble: BridgeError | MissionError, details: Mapping[str, object], now_s: float
    ) -> None:
        self._voice.error(now_s, EventName.UPLOAD_FAILED, trouble, details)
        self._fail_step(trouble)

    def _after_upload(self, now_s: float) -> None:
        """Go on from an upload that has ended, well or badly; the machine has moved already."""
        if self._take_waiting_target(now_s) or self.state is not State.VERIFIED:
            return
        self._note_lists()
        found = self._recheck(1)
        if not found.holds and self._is_stale:
            self._route_broke(found, now_s)
        elif self.orders.drive:
            self._start_driving(now_s)
        else:
            self._end()

    @property
    def _is_stale(self) -> bool:
        """Whether the fence is another one than the plan was made around."""
        return bool(Grounds.of(self.situation).changes_since(self._planned_on))

    def _route_broke(self, found: Recheck, now_s: float) -> None:
        """Make the route anew before it is driven."""
        self._voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the way from here", found)
        self._cue_target(now_s, is_own_idea=True)

    def _fail_step(self, trouble: BridgeError | MissionError) -> None:
        self._move(Cue.TROUBLE)
        self._give_up(trouble)

    def _mission_read(self, items: tuple[MissionItem, ...], now_s: float) -> None:
        if self._ours is not None and items[1:] == self._ours[1:]:
            return
        if self._ours is not None:
            self._mission_taken_over(len(items), now_s)
        self._take_mission_target(now_s)

    def _mission_taken_over(self, count: int, now_s: float) -> None:
        """Leave a mission alone that somebody else put in the place of ours."""
        self._ours = None
        text = f"somebody changed the mission: {count} items"
        self._voice.tell(now_s, EventName.MISSION_CHANGED, text, count)
        if self.state is State.READY:
            self._target = None
        elif (self.state in _ON_OUR_MISSION or self._is_own_idea) and self._move(Cue.TAKEN_OVER):
            self._let_loose()

    # Hooks: what the vehicle is made to do is decided above

    @property
    def _item(self) -> int:
        """The mission item that the vehicle is on its way to."""
        raise NotImplementedError

    @property
    def _may_stop_it(self) -> bool:
        """Whether the vehicle may be on its way and is ours to stop."""
        raise NotImplementedError

    def _hold(self, reason: str, now_s: float) -> None:
        """Stop the vehicle, to plan from where it stands."""
        raise NotImplementedError

    def _stand_by(self) -> None:
        """Remember how the vehicle stands while a route is made."""
        raise NotImplementedError

    def _start_driving(self, now_s: float) -> None:
        """Drive the mission that is verified."""
        raise NotImplementedError

    def _let_loose(self) -> None:
        """Do nothing more with the vehicle until a new target comes."""
        raise NotImplementedError
