"""What the page asks of the planner, answered: plans, checks, repairs, the widest route. Everything that takes a while and changes nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from mavlink_bridge.console import reading
from mavlink_bridge.console.view.fields import fence_view
from mavlink_bridge.console.view.places import finite, place
from mavlink_bridge.console.view.plans import checked_view, no_route_view, plan_view
from mavlink_bridge.console.wire import Widest
from missions.checking.check import check_mission, plan_of
from missions.errors import MissionError, PlanStoppedError
from missions.ground.from_situation import route_ends, route_ground
from missions.planning.plan import plan as make_plan
from missions.promise import known_vehicle
from missions.routing.bottleneck import narrowest_place
from missions.situation import Known

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.console.view.sections import FenceView, PlanView
    from mavlink_bridge.console.wire import CheckRequest, FenceRequest, PlanRequest
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request, Tour
    from missions.situation import Situation


@dataclass(frozen=True, eq=False, slots=True)
class Looked:
    """A plan that was made for a page: as it is shown, and itself, where there is one.

    Parameters
    ----------
    view : PlanView
    request : Tour or None
        What was asked; None of a check.
    items : tuple of MissionItem
        The mission of it.
    plan : Plan or None
    field : tuple or None
        What it rests on, of `field_of`.
    """

    view: PlanView
    request: Tour | None = None
    items: tuple[MissionItem, ...] = ()
    plan: Plan | None = None
    field: tuple[object, ...] | None = None


def field_of(situation: Situation) -> tuple[object, ...]:
    """Return what a checked mission's promise rests on beside its items; where it is equal, it still holds."""
    fence, home = situation.fence, situation.home
    return (
        fence.value if fence is not None else None,
        home.value if home is not None else None,
        situation.parameters,
        situation.obstacles.known,
    )


def look_at_plan(
    body: PlanRequest,
    situation: Situation,
    own: Request,
    should_stop: Callable[[], bool],
    clock: Callable[[], float],
) -> Looked:
    """Plan what a page asks for; that there is no room for it is answered at once, without the widest route that can be driven.

    Raises
    ------
    MissionError
        What is asked makes no sense. That there is no route is an answer.
    """
    begun_s = clock()
    situation = reading.with_fence(situation, body.fence)
    request = reading.plan_request(body, own)
    try:
        planned = make_plan(situation, request, should_stop=should_stop, compares=False)
    except PlanStoppedError:
        raise
    except MissionError as error:
        took_s = clock() - begun_s
        return Looked(no_route_view(error, situation, request, should_stop, took_s=took_s), request)
    took_s = clock() - begun_s
    return Looked(
        plan_view(planned, situation, request, took_s=round(took_s, 4)), request, planned.items, planned
    )


def look_at_mission(
    body: CheckRequest,
    situation: Situation,
    own: Request,
    _should_stop: Callable[[], bool],
    clock: Callable[[], float],
) -> Looked:
    """Check a mission against the fence, to its end: nothing interrupts a check.

    Raises
    ------
    MissionError
        It cannot be checked.
    """
    begun_s = clock()
    situation = reading.with_fence(situation, body.fence)
    request = reading.check_request(body, own)
    mission = reading.mission_of(body, situation)
    checked = check_mission(mission, situation, request)
    planned = plan_of(checked, situation)
    view = checked_view(checked, planned, request, took_s=round(clock() - begun_s, 4))
    return Looked(view, items=mission.items, plan=planned, field=field_of(situation))


def repaired(
    body: CheckRequest,
    situation: Situation,
    own: Request,
    should_stop: Callable[[], bool],
    clock: Callable[[], float],
) -> Looked:
    """Repair a mission around the fence.

    Raises
    ------
    MissionError
        It cannot be repaired.
    """
    begun_s = clock()
    situation = reading.with_fence(situation, body.fence)
    mission = reading.mission_of(body, situation)
    request = reading.repair_request(body, own, mission)
    planned = make_plan(situation, request, should_stop=should_stop)
    took_s = round(clock() - begun_s, 4)
    view = replace(
        plan_view(planned, situation, request, took_s=took_s), state="repaired", changed=planned.info
    )
    return Looked(view, items=planned.items, plan=planned, field=field_of(situation))


def look_at_fence(
    body: FenceRequest, situation: Situation, own: Request, _should_stop: Callable[[], bool]
) -> FenceView:
    """Return what a drawn fence comes to; why it cannot be used, where it cannot: half-drawn ones are usual."""
    try:
        drawn = reading.with_fence(situation, body.fence)
        if body.clearance_m is not None:
            own = replace(own, widest=False, clearance_m=body.clearance_m)
    except MissionError as error:
        usable = reading.usable_zones(body.fence)
        held = fence_view(replace(situation, fence=Known(usable, None, "drawn on the page")), own, "drawn")
        return replace(held, meant=None, trouble=str(error), where="drawn")
    return fence_view(drawn, own, "drawn")


def widest(body: PlanRequest, situation: Situation, own: Request, should_stop: Callable[[], bool]) -> Widest:
    """Return the most clearance that drawn lines over the targets can keep, and where they are narrowest; why not, where that is not known."""
    try:
        return _widest(body, situation, own, should_stop)
    except PlanStoppedError:
        raise
    except MissionError as error:
        return Widest(clearance_m=None, trouble=str(error))


def _widest(body: PlanRequest, situation: Situation, own: Request, should_stop: Callable[[], bool]) -> Widest:
    situation = reading.with_fence(situation, body.fence)
    request = reading.plan_request(body, own)
    start, targets = route_ends(situation, request)
    ground = route_ground(situation, known_vehicle(situation, request), [start, *targets])
    stop = PlanStoppedError.when(should_stop)
    found = [
        narrowest_place(ground, ground.frame.to_local(a), ground.frame.to_local(b), stop)
        for a, b in pairwise((start, *targets))
    ]
    if any(one is None for one in found):
        return Widest(clearance_m=0.0)
    least = min((one for one in found if one is not None), key=lambda one: one.clearance_m)
    if math.isinf(least.clearance_m):
        return Widest(clearance_m=None)
    return Widest(
        clearance_m=finite(least.clearance_m),
        at=place(least.at) if least.at else None,
        between=tuple(dict.fromkeys(least.between)),
    )
