"""The part of the director that has a plan made for each target, and checks whether the one that stands still holds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.fixes import no_fix
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.plan_task import AtHomeError, HomeTask, PlanTask
from mavlink_bridge.director.states import ON_VEHICLE, Cue, Notice, Signal, State
from missions.checking.from_here import from_here
from missions.checking.obstacle_ahead import obstacle_across
from missions.checking.recheck import Recheck, recheck
from missions.errors import MissionError, SituationError
from missions.fence import Obstacles
from missions.geo import distance_m
from missions.items import Command
from missions.planning.marking import unpromised
from missions.promise import asked_clearance
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.drive_supervisor import DriveSupervisor
    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.hold_watch import HoldWatch
    from mavlink_bridge.director.home_keeper import HomeKeeper
    from mavlink_bridge.director.list_watch import ListWatch
    from missions.fence import Obstacle
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

_AGAIN_S = 2.0
"""A route is planned round obstacles as they may be so much later: until it is driven (1.5 s in the campaign, of which half a second is planning), and a little on. Chosen."""

_WIDER_M = 0.5
"""So much wider an obstacle is planned round than it is seen: what a sensor sees of a thing that stands differs by so much from time to time. Chosen."""

_TRY_AGAIN_S = 3.0
"""So long after a way round was sought in vain it is sought again, where obstacles go on to be reported; chosen."""

_AT_ONCE_S = 1.0  # at the soonest, where nothing seems to stand in it any more: the start may still be too near; chosen

_MAKING_A_ROUTE = frozenset({State.HOLDING, State.PLANNING})
"""States whose plan is yet to come: it is made around the fence as it is then."""

_WITH_A_ROUTE = frozenset({State.PROPOSED, *ON_VEHICLE, State.STARTING, State.DRIVING})
"""States in which a route is left at once for an obstacle; an upload is ended first, and looked at then."""


_TOLERANCE_M = 0.01
"""Clearances are given to the centimetre."""


class RouteDesk(Part):
    """Makes routes, with the shell's help.

    Attributes
    ----------
    is_own_idea : bool
        Whether the route is made because the one before broke, not because somebody asked.
    is_foreseen : bool
        Whether it begins where the vehicle was expected to stand, and not yet where it stands.
    """

    def __init__(
        self,
        core: Core,
        lists: ListWatch,
        halter: Halter,
        keeper: HomeKeeper,
        driver: DriveSupervisor,
        hold_watch: HoldWatch,
    ) -> None:
        super().__init__(core)
        self._keeper = keeper
        self._lists = lists
        self._halter = halter
        self._driver = driver
        self._hold_watch = hold_watch
        self._made: Plan | MissionError | None = None
        self._planned_on = Grounds.of(core.situation)
        self._free_way: Plan | None = None  # in which obstacles alone stand, while they are waited for
        self._refused: MissionError | None = None  # why none leads round them, while one without is sought
        self._tried_s = -math.inf
        self._tried_with = Obstacles()
        self._look_s = -math.inf
        self._told_across: tuple[float | None, str] | None = None  # the obstacles that were told of last
        self._told_waiting: tuple[float | None, str] | None = None
        self.is_own_idea = False
        self.is_foreseen = False
        self._has_told_fix = False

    @property
    def deadline_s(self) -> float | None:
        """At once where there is something to do for the plan but to wait for it; soon where obstacles may have gone meanwhile."""
        if self._awaits_way:
            return self._look_s
        is_at_it = self.pending is not None or (bool(self.awaits_fix) and self._has_told_fix)
        is_waiting = is_at_it and not self._lists.is_outdated
        is_due = self.core.state is State.PLANNING and not self.core.steps and not is_waiting
        return -math.inf if is_due else None

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Go on with the plan, or look for a way that obstacles stood in."""
        if self._awaits_way and now_s >= self._look_s:
            self._look_s = now_s + _TRY_AGAIN_S
            return self._look_for_way(now_s)
        return self._go_on(now_s) if self.core.state is State.PLANNING else []

    @property
    def pending(self) -> PlanTask | None:
        """The plan that is waited for."""
        return self.core.plan_task if self._made is None else None

    def plan_made(self, task: PlanTask, made: Plan | MissionError, now_s: float) -> Sequence[Signal]:
        """Take a plan, or why there is none; what is not waited for any more is left."""
        if task is not self.pending:
            return []
        self._made = (
            made
            if isinstance(made, MissionError)
            else self._refused_end(made) or self._unpromised(made) or made
        )
        return self._go_on(now_s)

    def _unpromised(self, made: Plan) -> MissionError | None:
        return unpromised(made) if self.core.orders.upload else None

    def _refused_end(self, made: Plan) -> MissionError | None:
        """Return why a mission is not driven whose end looks like somebody's taking over; None where it does not."""
        core = self.core
        ends_so = any(item.command == Command.NAV_RETURN_TO_LAUNCH for item in made.items)
        if not (ends_so and core.orders.drive and core.autopilot.driving.leaves_mission_for_rtl):
            return None
        return SituationError(
            f"{core.autopilot.kind} leaves its mission mode for an RTL item, which looks like a takeover by an operator; nothing was written: "
            "plan the way home with --return, or upload it without --drive and start it yourself"
        )

    def _go_on(self, now_s: float) -> Sequence[Signal]:
        """Have a plan made around what is known by now, and go on with the one that was."""
        core = self.core
        if core.plan_task is None:
            self._made = None
        if core.steps:
            return []
        if self._lists.is_outdated:
            self._lists.reread_suspects(now_s)
        elif core.plan_task is None:
            self._begin(now_s)
        elif self._made is not None:
            return self._take_made(self._made, now_s)
        return []

    def _take_made(self, made: Plan | MissionError, now_s: float) -> Sequence[Signal]:
        """Go on with a plan; where there is none round obstacles, see whether there is one without them."""
        core, task, refused = self.core, self.core.plan_task, self._refused
        assert task is not None
        if self.is_foreseen and (isinstance(made, MissionError) or made.clearance_m is None):
            return [Cue.NOT_FORESEEN]
        if refused is not None:
            core.plan = None
            if isinstance(made, MissionError):
                self._made = refused
            else:
                self._free_way = made
                self._tell_waiting(made, now_s)
            return [Cue.NO_PLAN]
        if not isinstance(made, MissionError):
            core.plan = made
            self._told_across = self._told_waiting = None
            return [Cue.PLANNED]
        if not task.situation.obstacles.known or isinstance(made, AtHomeError):
            core.plan = None
            return [Cue.NO_PLAN]
        self._refused, self._made = made, None
        core.plan_task = replace(task, situation=replace(task.situation, obstacles=Obstacles()))
        return []

    def _begin(self, now_s: float) -> None:
        """Have the plan made; a way home waits for a fix, which is said once."""
        core = self.core
        trouble = self.awaits_fix
        if not trouble:
            self._planned_on = Grounds.of(core.situation)
            self._free_way = self._refused = None
            self.is_foreseen = self._halter.expected is not None and not self._halter.stands
            core.plan_task = self._task()
            self._tried_s, self._tried_with = now_s, core.plan_task.situation.obstacles
        elif not self._has_told_fix and core.target is not None:
            core.voice.home_waits(now_s, core.target.call, trouble)
        self._has_told_fix = bool(trouble)

    @property
    def awaits_fix(self) -> str:
        """Why the plan of a way home waits; empty where it does not."""
        target = self.core.target
        if target is None or not target.is_home or self.core.plan_task is not None:
            return ""
        return no_fix(self.core.situation, self.core.orders.request)

    def _task(self) -> PlanTask:
        """Return the plan to be made: to the target, or to the nearest place where the vehicle is called home."""
        core, situation = self.core, self._with_wider_obstacles
        if core.target is None or not core.target.is_home:
            return PlanTask(situation, self.request())
        places, ways = core.orders.homing.places, self._keeper.ways
        return HomeTask(situation, core.orders.request, places=places, ways=ways)

    @property
    def _at_rest(self) -> Situation:
        """What is known, of a vehicle that rolls to where a route begins as it will stand there."""
        situation, expected = self.core.situation, self._halter.expected
        if not self.is_foreseen or expected is None or situation.pose is None:
            return situation
        return replace(situation, pose=replace(situation.pose, value=expected))

    def settles(self, now_s: float) -> bool:
        """Return whether the route can be driven from where the vehicle stands by now; where not, it is to be made anew, which is said."""
        core = self.core
        if not self.is_foreseen or core.plan is None:
            return True
        self.is_foreseen = False
        settled = from_here(core.plan, core.situation, core.orders.request)
        if settled is not None:
            core.plan = settled
            return True
        pose = core.situation.pose
        off_m = distance_m(pose.value.position, core.plan.start) if pose is not None else 0.0
        reason = f"it stands {off_m:.2f} m from where it was expected to: planning from there"
        core.voice.tell(now_s, EventName.HOLDING, f"HOLD: {reason}", reason)
        return False

    # Obstacles

    @property
    def is_waiting(self) -> bool:
        """Whether a route waits for obstacles to go, which alone stand in it."""
        return self._free_way is not None and self.core.target is not None

    @property
    def _with_wider_obstacles(self) -> Situation:
        """What is known, with obstacles as large as a route is planned around them."""
        situation = self._at_rest
        return replace(situation, obstacles=situation.obstacles.later(_AGAIN_S, _WIDER_M))

    @property
    def _awaits_way(self) -> bool:
        return self.core.state is State.READY and self.is_waiting

    def _look_for_way(self, now_s: float) -> Sequence[Signal]:
        """Return that a route is sought again, where obstacles alone stood in it: once none does, and now and then while they move."""
        assert self._free_way is not None
        wider = self._with_wider_obstacles
        is_free = now_s >= self._tried_s + _AT_ONCE_S and obstacle_across(self._free_way, wider, 1) is None
        is_due = now_s >= self._tried_s + _TRY_AGAIN_S and wider.obstacles.known != self._tried_with.known
        return [Notice.ROUTE_OUTDATED] if is_free or is_due else []

    def _tell_waiting(self, free_way: Plan, now_s: float) -> None:
        """Report what the vehicle waits for, once."""
        wider = self._with_wider_obstacles
        found = obstacle_across(free_way, wider, 1)
        obstacle = found.obstacle if found is not None else next(iter(wider.obstacles.known), None)
        before, self._told_waiting = self._told_waiting, _identity(obstacle)
        if obstacle is None or before == self._told_waiting:
            return
        left_s = max(0.0, obstacle.ends_s - now_s)
        text = f"waiting: the {obstacle.name} blocks the only way; driving on when it is gone, or {left_s:.0f} s after it was last seen"
        self.core.voice.tell(now_s, EventName.WAITING, text, obstacle.name, round(left_s, 1))

    def obstacles_changed(self, now_s: float) -> Sequence[Signal]:
        """Look whether an obstacle is across the rest of the route, or gone from a way that waits for it."""
        core = self.core
        if self._awaits_way:
            return self._look_for_way(now_s)
        if core.plan is None or core.state not in _WITH_A_ROUTE:
            return []
        found = obstacle_across(core.plan, self._at_rest, self._driver.item)
        if found is None:
            self._told_across = None
            return []
        before, self._told_across = self._told_across, _identity(found.obstacle)
        if before != self._told_across:
            kept = found.kept
            text = f"{kept.fence}: across the route, {metres(kept.clearance_m)} of the required {metres(kept.asked_m)} left"
            left = round(kept.clearance_m, 2), round(kept.asked_m, 2)
            core.voice.tell(now_s, EventName.OBSTACLE_ACROSS, text, kept.fence, *left)
        return [Notice.ROUTE_OUTDATED] if core.orders.drive else []

    def _across(self, item: int) -> Recheck | None:
        """Return what an obstacle across the route leaves of it; without orders to drive they are only told."""
        plan = self.core.plan if self.core.orders.drive else None
        found = obstacle_across(plan, self._at_rest, item) if plan is not None else None
        return found.kept if found is not None else None

    def no_plan(self, now_s: float) -> Sequence[Signal]:
        """Report why there is no plan."""
        assert isinstance(self._made, MissionError)
        if isinstance(self._made, AtHomeError):
            self._end_at_home(self._made, now_s)
            return []
        self.core.voice.no_plan(now_s, self._made)
        return self.core.give_up(self._made)

    def _end_at_home(self, found: AtHomeError, now_s: float) -> None:
        """Report that nothing is to be driven home: the vehicle is held where it stands."""
        core = self.core
        call = core.target.call if core.target is not None else None
        core.target = None
        core.voice.tell(now_s, EventName.AT_HOME, f"{found}; HOLD", str(call), found.details["place"])

    def request(self) -> Request:
        """Return what is asked of the next plan: the orders' request, for the newest target, from where the vehicle is."""
        core, request = self.core, self.core.orders.request
        if core.target is not None and core.target.position not in request.targets:
            request = request.to(core.target.position)
        return request if core.orders.once else replace(request, start=None)

    # Whether the plan still holds

    @property
    def is_stale(self) -> bool:
        """Whether the fence is another one than the plan was made around, or an obstacle has come across its route."""
        is_other = bool(Grounds.of(self.core.situation).changes_since(self._planned_on))
        return is_other or self._across(1) is not None

    @property
    def is_in_doubt(self) -> bool:
        """Whether the plan may not hold any more: on another fence than it was made around, or on one that is not known."""
        return self.is_stale or self.core.situation.fence is None

    @property
    def promises_less(self) -> bool:
        """Whether the plan that stands, of an earlier run, promises less than is asked now."""
        core, plan = self.core, self.core.plan
        if plan is None or plan.clearance_m is None or core.orders.request.accepts_less:
            return False
        asked_m = core.orders.request.clearance_m
        return asked_m is not None and asked_m > plan.clearance_m + _TOLERANCE_M

    def take_up(self, planned_in: Situation) -> None:
        """Take notice of the situation in which the plan that stands was made, where another desk had it made."""
        self._planned_on = Grounds.of(planned_in)

    def recheck(self, item: int) -> Recheck:
        """Return a check of the rest of the route against the fence and its parameters as they are now."""
        core = self.core
        assert core.plan is not None
        if (found := self._across(item)) is not None:
            return found
        fence = replace(self._at_rest, obstacles=Obstacles())
        try:
            vehicle, _ = asked_clearance(core.situation, core.orders.request)
        except MissionError:
            vehicle = core.plan.vehicle
        try:
            return recheck(replace(core.plan, vehicle=vehicle), fence, item)
        except Exception as error:  # noqa: BLE001 - a defect of ours: what cannot be checked does not hold
            why = f"unknown: the check failed ({type(error).__name__}: {error}), a bug in pbpp"
            return Recheck(0.0, core.plan.asked_m, why)

    def fence_changed(self, now_s: float) -> Sequence[Signal]:
        """Look at the route again, whose grounds are others than before."""
        core = self.core
        core.drop_plan_task()
        is_wanted = core.state is State.READY and core.target is not None
        is_none = core.plan is None or core.state in _MAKING_A_ROUTE or core.state is State.ARRIVED
        found = None if is_wanted or is_none else self.recheck(self._driver.item)
        if found is not None and found.holds and core.is_driving_ours:
            return []
        self._hold_watch.announce(now_s)
        if is_wanted:
            return [Notice.ROUTE_OUTDATED]
        if found is None or found.holds:
            return []
        is_ours_to_mend = core.state not in (State.READY, State.LET_GO)
        if is_ours_to_mend or core.is_driving_ours:
            core.voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the rest of the route", found)
        may_mend = is_ours_to_mend and (core.state is not State.DRIVING or core.orders.drive)
        return [Notice.ROUTE_OUTDATED] if may_mend else []

    def tell_less(self, now_s: float) -> Sequence[Signal]:
        """Report that the adopted plan promises less than is asked now, and have the route made anew."""
        core, plan = self.core, self.core.plan
        assert plan is not None
        assert plan.clearance_m is not None
        asked_m = core.orders.request.clearance_m or 0.0
        found = Recheck(plan.clearance_m, asked_m, "it began with a smaller --clearance")
        core.voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the adopted route", found)
        return [Notice.ROUTE_OUTDATED] if core.orders.drive else []

    def broke(self, found: Recheck, now_s: float) -> Sequence[Signal]:
        """Report that the route is broken, and have it made anew before it is driven."""
        self.core.voice.rechecked(now_s, EventName.ROUTE_BROKEN, "the way from here", found)
        return [Notice.ROUTE_OUTDATED]


def _identity(obstacle: Obstacle | None) -> tuple[float | None, str] | None:
    """Return what tells an obstacle from another; its place and size change."""
    return (obstacle.reported_s, obstacle.source) if obstacle is not None else None
