"""The part of the director that makes of each target a plan, and of the plan a verified mission, as far as the orders go."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge import messages as m
from mavlink_bridge.director.answers import Answers, is_command_to
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.keeper import Keeper
from mavlink_bridge.director.orders import Orders, TargetSource
from mavlink_bridge.director.plan_task import PlanTask
from mavlink_bridge.director.states import Cue, State
from mavlink_bridge.director.targets import Target, TargetWatch
from mavlink_bridge.errors import RefusedError
from mavlink_bridge.outcomes import upload_trouble
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
from mavlink_bridge.rover import AUTO_MODE
from missions.errors import MissionError
from missions.geo import distance_m
from missions.items import Command, last_place, with_home
from missions.plan import asked_clearance
from missions.recheck import recheck, straight_line

if TYPE_CHECKING:
    from mavlink_bridge.errors import BridgeError
    from mavlink_bridge.messages import Frame
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.plan import Plan
    from missions.recheck import Recheck
    from missions.request import Request
    from missions.situation import Situation

FRESH_S = 1.5
"""How old a heartbeat may be to tell what the vehicle does now."""

_NOT_NOW = frozenset({State.LISTENING, State.LEARNING, State.LOST, State.UPLOADING, State.WITHDRAWING})
"""States that have to end before another target is gone into."""

_MAKING_A_ROUTE = frozenset({State.HOLDING, State.PLANNING})
"""States whose plan is yet to come: it is made around the fence as it is then."""


_ON_OUR_MISSION = frozenset({State.VERIFIED, State.STARTING, State.DRIVING})

_SAME_M = 0.2


class RouteMaker(Keeper):
    """Takes targets to verified missions.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self.upload_outcome: VerifiedUploadOutcome | None = None
        self.plan: Plan | None = None
        self._task: PlanTask | None = None
        self._made: Plan | MissionError | None = None
        self._targets = TargetWatch(orders.target_sources)
        self._answers = Answers(self._send)
        self._target: Target | None = None
        self._waiting_target: Target | None = None
        self._listed: dict[TargetSource, LatLon | None] = {}
        self._planned_on = Grounds.of(self.situation)
        self._is_own_idea = (
            False  # the route is made anew because the one before broke, not because somebody asked
        )
        self._ours: tuple[MissionItem, ...] | None = None  # the mission that is on the vehicle by us
        self._confirmed = False

    # What the shell sees and does

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

    def take_target(self, position: LatLon, now_s: float) -> None:
        """Take a target that was typed."""
        self._targets.take(position, now_s)
        self._take_target(Target(position, TargetSource.TYPED), now_s)

    def confirm(self, now_s: float) -> None:
        """Take the operator's yes to the plan that stands; a yes to none is forgotten."""
        if self.state is State.PROPOSED:
            self._confirmed = True
            self._go_on(now_s)

    def backup_stored(self, now_s: float) -> None:
        """Take notice that the old mission is safe."""
        upload = self._steps.current
        if isinstance(upload, VerifiedUpload):
            upload.backup_stored(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        super().receive(self._as_to_vehicle(frame), now_s)
        old = self.pending_backup
        if old is not None and self._is_own_idea and self._ours is not None and old[1:] != self._ours[1:]:
            self._drop_steps()  # nothing was written yet
            self._move(Cue.TROUBLE)
            self._mission_taken_over(len(old), now_s)

    # Targets

    def _as_to_vehicle(self, frame: Frame) -> Frame:
        """Take a command to our own system for one to the vehicle's, whose place it asks for."""
        peer, message = self._peer, frame.message
        if peer is None or peer.own_system == peer.system or self.identity is None:
            return frame
        if not is_command_to(frame, self.identity, peer.own_system):
            return frame
        assert isinstance(message, m.CommandInt | m.CommandLong)
        return replace(frame, message=replace(message, target_system=peer.system))

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        super()._take_any_frame(frame, before, now_s)
        if self.identity is None:
            return
        target = self._targets.look(frame, before, self.situation, now_s, self.identity)
        is_to_us = is_command_to(frame, self.identity, self.situation.system)
        if target is None:
            if is_to_us:
                self._refuse_command(frame, now_s)
        elif not target.is_again:
            self._take_target(target, now_s)
        elif is_to_us:
            self._answers.repeat(frame)
        else:
            self._take_again(target, now_s)

    def _refuse_command(self, frame: Frame, now_s: float) -> None:
        """Answer a command to our own component that asks for no place we could take the vehicle to."""
        message = frame.message
        assert isinstance(message, m.CommandInt | m.CommandLong)
        if message.command != Command.DO_REPOSITION:
            self._answers.refuse(frame, m.MavResult.UNSUPPORTED)
            return
        self._answers.refuse(frame, m.MavResult.DENIED)
        is_heeded = TargetSource.REPOSITION in self.orders.target_sources
        why = "it names no place" if is_heeded else "targets by reposition are not heeded"
        self._voice.error(now_s, EventName.TROUBLE, RefusedError(f"DO_REPOSITION denied: {why}"), {})

    def _take_target(self, target: Target, now_s: float) -> None:
        if self.state in _NOT_NOW:
            self._waiting_target = target
            self._stop_at_once(target, now_s)
            return
        self._target = target
        self._voice.tell(
            now_s,
            EventName.TARGET,
            f"target {target.position} by {target.source}",
            list(target.position),
            str(target.source),
        )
        self._answers.begin(target)
        if not self.orders.drive:
            self._warn_of_straight_line(target, now_s)
        self._cue_target(now_s)

    def _take_waiting_target(self, now_s: float) -> bool:
        """Go into a target that came at an inconvenient time, if one did."""
        target, self._waiting_target = self._waiting_target, None
        if target is not None:
            self._take_target(target, now_s)
        return target is not None

    def _warn_of_straight_line(self, target: Target, now_s: float) -> None:
        """Warn at once: a go-to click makes the vehicle drive straight, before any plan exists."""
        if not self.situation.armed or not self._sets_it_going(target):
            return
        found = straight_line(self.situation, self.orders.request, target.position)
        if found is not None and not found.holds:
            self._voice.rechecked(
                now_s, EventName.STRAIGHT_LINE_UNSAFE, "the straight line to the target", found
            )

    def _cue_target(self, now_s: float, *, is_own_idea: bool = False) -> None:
        self._is_own_idea = is_own_idea
        if self._may_stop_it and self._move(Cue.TARGET_WHILE_MOVING):
            self._confirmed = False
            self._hold("a new route is wanted", now_s)
        elif self._move(Cue.TARGET):
            self._confirmed = False
            self._stand_by()

    def _take_listed_target(self, place: LatLon | None, source: TargetSource, now_s: float) -> None:
        """Take the last place of a list on the vehicle for a target, where that is asked for and it is a new one."""
        if source not in self.orders.target_sources or not self._note_listed(place, source):
            return
        if place is not None and not _is_same(place, self._target.position if self._target else None):
            self._take_target(Target(place, source), now_s)

    def _note_listed(self, place: LatLon | None, source: TargetSource) -> bool:
        """Remember the last place of a list; tell whether it is another one than before."""
        before, self._listed[source] = self._listed.get(source), place
        return not _is_same(place, before)

    def _note_lists(self) -> None:
        """Take the lists on the vehicle for known: nothing in them is a new target."""
        mission, rally = self.situation.mission, self.situation.rally
        self._note_listed(last_place(mission.value.items) if mission else None, TargetSource.MISSION)
        self._note_listed(rally.value[-1] if rally and rally.value else None, TargetSource.RALLY)

    def _take_mission_target(self, now_s: float) -> None:
        mission = self.situation.mission
        place = last_place(mission.value.items) if mission else None
        self._take_listed_target(place, TargetSource.MISSION, now_s)

    def _rally_read(self, now_s: float) -> None:
        rally = self.situation.rally
        self._take_listed_target(
            rally.value[-1] if rally and rally.value else None, TargetSource.RALLY, now_s
        )

    def _mission_heard(self, now_s: float) -> None:
        self._take_mission_target(now_s)

    # Plans

    def _move(self, event: Cue) -> bool:
        has_moved = super()._move(event)
        if has_moved:
            self._forget_task()
        return has_moved

    def _forget_task(self) -> None:
        self._task = self._made = None

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
        return recheck(replace(self.plan, vehicle=vehicle), self.situation, item)

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
        is_active = bool(self.situation.armed) and self.situation.mode == AUTO_MODE
        upload = VerifiedUpload(
            self._peer,
            m.MissionType.MISSION,
            items,
            limits=Limits.from_parameters(self.situation.parameters),
            is_active=is_active if self._is_mode_known(now_s) else None,
        )
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
            self._voice.error(now_s, EventName.UPLOAD_FAILED, trouble, dict(trouble.details))
            self._fail_step(trouble)
        else:
            self._ours = outcome.found if outcome.found is not None else outcome.backup
            self._move(Cue.UPLOAD_VERIFIED)
            assert self.plan is not None
            count = len(self.plan.items) + 1
            text = f"mission of {count} items verified on the vehicle"
            self._voice.tell(now_s, EventName.VERIFIED, text, count, outcome.pushes)
        self._after_upload(now_s)

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

    def _fail_step(self, trouble: BridgeError) -> None:
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

    def _sets_it_going(self, target: Target) -> bool:
        """Tell whether a target has made the vehicle drive straight to it."""
        raise NotImplementedError

    def _hold(self, reason: str, now_s: float) -> None:
        """Stop the vehicle, to plan from where it stands."""
        raise NotImplementedError

    def _stop_at_once(self, target: Target, now_s: float) -> None:
        """Stop a vehicle that a target has set going, though the target itself has to wait."""
        raise NotImplementedError

    def _take_again(self, target: Target, now_s: float) -> None:
        """Act on a target that was said again."""
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


def _is_same(a: LatLon | None, b: LatLon | None) -> bool:
    """Tell whether two places are one, but for the rounding of the wire."""
    return a is b or (a is not None and b is not None and distance_m(a, b) < _SAME_M)
