"""From a situation and a request to a plan: the one function that the command line, the bridge, replays and programs call."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.checking.check import plan_of
from missions.checking.holding import with_hold
from missions.editing.repair import repaired_plan
from missions.editing.shorten import shortened
from missions.errors import PlanStoppedError
from missions.finishing.route_plan import plan_route
from missions.planning.marking import marked
from missions.promise import promise
from missions.request import RepairMission, Tour
from missions.situation import Mission
from missions.tour.tour import plan_tour
from missions.tour.way_home_inside import with_way_home_inside
from missions.vehicle.item_limit import most_own_items
from missions.words import left_out_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


def plan(
    situation: Situation,
    request: Request,
    *,
    should_stop: Callable[[], bool] | None = None,
    compares: bool = True,
) -> Plan:
    """Plan what is asked for around the situation's fence, in as many items as the vehicle holds.

    Parameters
    ----------
    situation : Situation
        What is known.
    request : GoTo, Tour or RepairMission
        What is asked for; all of it is kept, or refused.
    should_stop : callable, optional
        Asked now and then; once it returns True, nobody waits for the plan any more.
    compares : bool
        Whether a refusal for want of room names what the widest route keeps while driven, which takes as long as several plans; else it names what
        straight legs keep.

    Raises
    ------
    FenceMissingError
        No fence is known.
    SituationError
        Start or target is not known, or home where FENCE_RADIUS is enforced around it or RTL leads there; or the mission to repair is not
        known or not understood.
    FenceError, VehicleError, InvalidPositionError
        The fence, a parameter or a position cannot be used.
    StartBlockedError, TargetBlockedError, NoRouteError
        No route; with the fences, or the corner, to blame.
    MissionTooLongError
        The vehicle does not hold that many items.
    PlanStoppedError
        It was stopped.
    PlanCheckError
        The finished route failed its check: a defect of this program, never to be driven.
    """
    should_stop = PlanStoppedError.when(should_stop)
    if isinstance(request, RepairMission):
        planned = repaired_plan(situation, request, should_stop=should_stop)
        return _told_of_obstacles(with_hold(marked(planned, request), situation), situation)
    if isinstance(request, Tour):
        planned = plan_tour(situation, request, should_stop=should_stop, compares=compares)
    else:
        planned = plan_route(situation, request, should_stop=should_stop, compares=compares)
    planned = _with_room(planned, situation, request, should_stop)
    planned = _told_of_obstacles(with_hold(marked(planned, request), situation), situation)
    if isinstance(request, Tour) and request.way_home_inside:
        return with_way_home_inside(planned, situation, request, should_stop=should_stop)
    return planned


def _told_of_obstacles(planned: Plan, situation: Situation) -> Plan:
    """Return a plan with the obstacles that it was made around told, each once."""
    obstacles = situation.obstacles
    told = [
        f"planned around the {one.name}{_grown(one.radius_m, obstacles.radius_m(one))}; the autopilot does not know of it; this protects no person"
        for one in obstacles.known
    ]
    return replace(planned, info=(*planned.info, *told)) if told else planned


def _grown(radius_m: float, planned_m: float) -> str:
    """Return how large an obstacle is taken to be where it may have moved; empty where it stands."""
    return "" if f"{planned_m:.1f}" == f"{radius_m:.1f}" else f", as if its radius were {planned_m:.1f} m"


def _with_room(
    planned: Plan, situation: Situation, request: Request, should_stop: Callable[[], bool] | None
) -> Plan:
    """Return a plan that fits into the vehicle's storage, without what can be left out of its route.

    Raises
    ------
    MissionTooLongError
        It cannot be shortened so far.
    """
    most = most_own_items(situation)
    if len(planned.items) <= most:
        return planned
    # A route may keep more than was asked: what is short keeps that much, and promises no more.
    kept = planned.keeps
    most_m = kept.promised_m
    if most_m is not None and not request.widest:
        most_m = min(most_m, promise(situation, request, planned.vehicle).promised_m)
    less_m = kept.promised_m - most_m if kept.promised_m is not None and most_m is not None else 0.0
    wanted = replace(request, widest=False, clearance_m=most_m, start=planned.start)
    # Drawn lines that were asked for are not judged by a check: nothing of them is left out.
    own = _own_items(planned, request) if request.corner_allowance_m is None else ()
    mission = Mission(planned.items, planned.home)
    checked = shortened(mission, own, situation, wanted, most=most, may_slow=True, should_stop=should_stop)
    left_out = len(planned.items) - len(checked.mission.items)
    short = plan_of(checked, situation, method=planned.method)
    return replace(
        short,
        targets=planned.targets,
        asked_targets=planned.asked_targets,
        straight_line_m=planned.straight_line_m,
        keeps=replace(
            kept,
            promised_m=most_m,
            asked_m=kept.asked_m - less_m,
            drawn_m=short.keeps.drawn_m,
            driven_m=short.keeps.driven_m,
        ),
        blocks=planned.blocks,
        home=planned.home,
        warnings=planned.warnings,
        info=(*planned.info, left_out_text(left_out, most + planned.vehicle.home_items)),
    )


def _own_items(planned: Plan, request: Request) -> frozenset[int]:
    """Return the seqs of a plan's own items: all but the targets, and the speed that is set first."""
    kept = {1} if request.speed_mps is not None else set()
    points = iter(range(1, len(planned.path)))
    for target in planned.targets:
        kept.add(planned.seqs[next(point for point in points if planned.path[point] == target)])
    return frozenset(range(1, len(planned.items) + 1)) - kept
