"""Several targets: their order, the way home, the end of the mission."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from shapely import Point

import pbpp
from missions.checking.check import check_mission, plan_of
from missions.checking.mission_end import End, ending
from missions.drive_model import corner_forecast
from missions.editing.repair import repaired_plan
from missions.editing.shorten import shortened
from missions.errors import NoRouteError, SituationError
from missions.fence import ZoneKind
from missions.geo import LocalPoint
from missions.ground.from_situation import route_ends, route_ground
from missions.planning.plan import plan
from missions.promise import known_vehicle, promise
from missions.routing.bottleneck import widest_clearance_m
from missions.situation import Mission
from missions.tour.visit_order import VisitOrder, length_of, shortest_order
from missions.vehicle.item_limit import most_items

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

_WIDEST_SHARE = 0.9  # of the widest, to measure lengths where no route keeps the asked clearance: chosen, so that all places stay connected
# So that a place moved to free ground is not on its edge; more than degE7's rounding of 5.6 mm
_INSIDE_M = 0.01


@dataclass(frozen=True, slots=True)
class TargetOrder:
    """In which order targets are visited.

    Parameters
    ----------
    indices : tuple of int
        Numbers of the targets as they were given, from 0, in the order of visits.
    length_m : float
        The length of the routes around fences, the way home included where one was asked for.
    given_m : float
        That of the order given.
    bound_m : float
        No order is shorter; equal to the length where this one is proved to be the shortest.
    """

    indices: tuple[int, ...]
    length_m: float
    given_m: float
    bound_m: float


def plan_tour(
    situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None
) -> Plan:
    """Plan all that a request may ask for: one target or several, in the best order, home again, with an end; or a mission repaired.

    Raises
    ------
    MissionError
        As `missions.planning.plan.plan` and `missions.editing.repair.repair_mission`; NoRouteError too where RTL at the end would break the promise.
    """
    if request.repairs:
        return repaired_plan(situation, request, should_stop=should_stop)
    start, targets = route_ends(situation, request)
    said: list[str] = []
    if request.order == "best" and len(targets) > 1:
        found = target_order(situation, request, should_stop=should_stop)
        targets = tuple(targets[index] for index in found.indices)
        said = _order_text(found)
    if request.comes_back:
        targets = (*targets, situation.home.value if situation.home else start)
    # The targets are given only where they have to be: else the plan itself notes where they come from.
    asked = replace(request, targets=targets) if len(targets) > 1 or request.targets else request
    planned = plan(situation, asked, should_stop=should_stop)
    planned = with_end(planned, situation, request)
    planned = with_room(planned, situation, request, should_stop=should_stop)
    return replace(planned, warnings=(*said, *planned.warnings)) if said else planned


def target_order(
    situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None
) -> TargetOrder:
    """Find the order of a request's targets in which the routes around the fences are shortest.

    Raises
    ------
    NoRouteError
        A target cannot be reached from the start with the clearance that is asked for.
    SituationError
        The start is not known; or more than 12 targets, and HiGHS is not installed.
    """
    start, targets = route_ends(situation, request)
    places = [start, *targets]
    if request.comes_back:
        places.append(situation.home.value if situation.home else start)
    lengths_m = route_lengths_m(situation, request, places, should_stop=should_stop)
    if not np.isfinite(lengths_m).all():
        lost = next(number for number in range(1, len(places)) if not np.isfinite(lengths_m[0, number]))
        name = f"target {lost}" if lost <= len(targets) else "home"
        raise NoRouteError(
            f"no order of the targets: no route leads from the start to {name} ({places[lost]}) with the clearance asked for",
            target=list(places[lost]),
        )
    found: VisitOrder = shortest_order(lengths_m, ends_at_last=request.comes_back, should_stop=should_stop)
    indices = tuple(place - 1 for place in found.order if 0 < place <= len(targets))
    given_m = length_of(lengths_m, range(len(places)))
    return TargetOrder(indices, found.length_m, given_m, found.bound_m)


def route_lengths_m(
    situation: Situation,
    request: Request,
    places: Sequence[LatLon],
    *,
    should_stop: Callable[[], bool] | None = None,
) -> NDArray[np.float64]:
    """Return the lengths of the routes around the fences between all places, in metres.

    Places too near to a fence are taken where the nearest free ground is.

    Returns
    -------
    ndarray of float, shape (n, n)
        Symmetric; infinite where there is no route.
    """
    vehicle = known_vehicle(situation, request)
    ground = route_ground(situation, vehicle, places)
    local = [ground.frame.to_local(place) for place in places]
    if request.widest:
        clearance_m = _WIDEST_SHARE * widest_clearance_m(ground, local, should_stop)
    else:
        asked = promise(situation, request, vehicle)
        band_m = corner_forecast(0.0, vehicle).inside_cut_m  # what a straight leg needs beside it
        clearance_m = asked.required_m + (band_m if asked.allowance_m is None else asked.allowance_m)
    planner = pbpp.Planner(
        ground.areas(ZoneKind.INCLUSION),
        ground.areas(ZoneKind.EXCLUSION),
        clearance_m=clearance_m,
        union=ground.union,
    )
    anchors = [_anchor(ground, planner, place) for place in local]
    lengths_m = np.zeros((len(places), len(places)))
    for a, b in combinations(range(len(places)), 2):
        lengths_m[a, b] = lengths_m[b, a] = _length_m(planner, anchors[a], anchors[b], should_stop)
    return lengths_m


def _anchor(ground: Ground, planner: pbpp.Planner, place: LocalPoint) -> LocalPoint:
    """Return the place, or the nearest free one."""
    here = Point(place)
    if planner.free_space.covers(here):
        return place
    inner = planner.free_space.buffer(-_INSIDE_M)
    if inner.is_empty:
        return place
    nearest = ground.nearest_point(inner, here)
    return LocalPoint(nearest.x, nearest.y)


def _length_m(
    planner: pbpp.Planner, a: LocalPoint, b: LocalPoint, should_stop: Callable[[], bool] | None
) -> float:
    try:
        return float(planner.plan(a, b, should_stop=should_stop).length_m)
    except (pbpp.NoPathError, pbpp.StartBlockedError, pbpp.GoalBlockedError):
        return float("inf")


def with_room(
    planned: Plan, situation: Situation, request: Request, *, should_stop: Callable[[], bool] | None = None
) -> Plan:
    """Return a plan that fits into the vehicle's storage, without what can be left out of its route.

    Raises
    ------
    MissionTooLongError
        It cannot be shortened so far.
    """
    most = most_items(situation.parameters) - 1
    if len(planned.items) <= most:
        return planned
    wanted = replace(request, clearance_m=planned.clearance_m, start=planned.start)
    is_fitted = (
        request.corner_allowance_m is None
    )  # else drawn lines were asked for, which a check does not judge
    own = _own_items(planned, request) if is_fitted else ()
    mission = Mission(planned.items, planned.home)
    checked = shortened(mission, own, situation, wanted, most=most, may_slow=True, should_stop=should_stop)
    left_out = len(planned.items) - len(checked.mission.items)
    said = f"{left_out} item{'s' * (left_out != 1)} of the route left out so that the vehicle can hold it ({most + 1})"
    return replace(
        plan_of(checked, situation, method=planned.method),
        targets=planned.targets,
        straight_line_m=planned.straight_line_m,
        clearance_m=planned.clearance_m,
        asked_m=planned.asked_m,
        blocks=planned.blocks,
        home=planned.home,
        warnings=(*planned.warnings, said),
    )


def _own_items(planned: Plan, request: Request) -> frozenset[int]:
    """Return the seqs of a plan's own items: all but the targets, and the speed that is set first."""
    kept = {1} if request.speed_mps is not None else set()
    points = iter(range(1, len(planned.path)))
    for target in planned.targets:
        kept.add(planned.seqs[next(point for point in points if planned.path[point] == target)])
    return frozenset(range(1, len(planned.items) + 1)) - kept


def with_end(planned: Plan, situation: Situation, request: Request) -> Plan:
    """Return a plan with the end that is asked for.

    Raises
    ------
    NoRouteError
        RTL would drive straight home and break the promise on the way.
    SituationError
        RTL, and home is not known.
    """
    end = End(request.end)
    if end is End.HOLD:
        return planned
    items = ending(planned.items, end)
    if end is End.LOITER:
        return replace(planned, items=items)
    if planned.home is None:
        raise SituationError(
            "RTL leads home, and home is not known; give it (--home LAT,LON), or end with hold or loiter"
        )
    wanted = replace(request, clearance_m=planned.clearance_m, start=planned.start)
    checked = check_mission(Mission(items, planned.home), situation, wanted)
    last = checked.legs[-1]
    is_broken = last.breaks if planned.clearance_m is not None else last.drawn_clearance_m < planned.asked_m
    if is_broken:
        near = (
            f"through {', '.join(last.crosses)}"
            if last.crosses
            else f"{last.driven_clearance_m:.2f} m near {last.fence}"
        )
        raise NoRouteError(
            f"RTL at the end would drive straight home, {near} at {last.at}; make the way home part of the mission (--return)",
            fences=list(last.crosses or (last.fence,)),
            driven_clearance_m=round(last.driven_clearance_m, 3),
        )
    return replace(
        planned,
        items=items,
        path=(*planned.path, last.leg.end),
        seqs=(*planned.seqs, len(items)),
        speeds=(*planned.speeds, last.leg.speed_mps),
        length_m=planned.length_m + last.length_m,
        duration_s=checked.duration_s,
        drawn_clearance_m=min(planned.drawn_clearance_m, last.drawn_clearance_m),
        driven_clearance_m=min(planned.driven_clearance_m, last.driven_clearance_m),
        envelope=checked.envelope,
    )


def _order_text(found: TargetOrder) -> list[str]:
    """Return a sentence on the order, where it is not the one given."""
    texts = []
    if found.indices != tuple(range(len(found.indices))):
        numbers = ", ".join(str(index + 1) for index in found.indices)
        texts.append(
            f"the targets are visited in the order {numbers}: {found.length_m:.1f} m around the fences, {found.given_m:.1f} m as given"
        )
    if found.bound_m < found.length_m * 0.9999:
        texts.append(
            f"the order was not proved to be the shortest: none is shorter than {found.bound_m:.1f} m ({found.length_m:.1f} m found)"
        )
    return texts
