"""Several targets: their order, the way home, the end of the mission."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

import pbpp
from missions.checking.check import check_mission
from missions.checking.mission_end import ending
from missions.drive_model import corner_forecast
from missions.errors import NoRouteError, SituationError, VehicleError
from missions.fence import ZoneKind
from missions.finishing.route_plan import plan_route
from missions.geo import LocalPoint
from missions.ground.from_situation import route_ends, route_ground
from missions.promise import known_vehicle, promise
from missions.request import End, Order
from missions.routing.bottleneck import widest_clearance_m
from missions.situation import Mission
from missions.tour.visit_order import VisitOrder, length_of, shortest_order

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.planned import Plan
    from missions.request import Request, Tour
    from missions.situation import Situation

_WIDEST_SHARE = 0.9  # of the widest, to measure lengths where no route keeps the asked clearance: chosen, so that all places stay connected
# Vertices of the fence times pairs of places from which on the compiled planner is used, where it is installed: there it is five times as fast, with the second
# that it takes to load.
_COMPILED_FROM = 10_000_000
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
    situation: Situation,
    request: Tour,
    *,
    should_stop: Callable[[], bool] | None = None,
    compares: bool = True,
) -> Plan:
    """Plan a route over one target or several, in the best order, home again, with an end.

    Raises
    ------
    MissionError
        As `missions.planning.plan.plan`; NoRouteError too where RTL at the end would break the promise.
    """
    start, targets = route_ends(situation, request)
    found: TargetOrder | None = None
    if request.order is Order.BEST and len(targets) > 1:
        found = _order(situation, request, should_stop)
        targets = tuple(targets[index] for index in found.indices)
    if request.comes_back:
        targets = (*targets, situation.home.value if situation.home else start)
    planned = plan_route(
        situation, replace(request, targets=targets), should_stop=should_stop, compares=compares
    )
    planned = with_end(planned, situation, request)
    return planned if found is None else _with_order(planned, found)


def _order(situation: Situation, request: Tour, should_stop: Callable[[], bool] | None) -> TargetOrder:
    """Return the order of visits; where less clearance is accepted and need be, along the widest routes."""
    try:
        return target_order(situation, request, should_stop=should_stop)
    except NoRouteError:
        if not request.accepts_less:
            raise
        widest = replace(request, widest=True, clearance_m=None)
        return target_order(situation, widest, should_stop=should_stop)


def target_order(
    situation: Situation, request: Tour, *, should_stop: Callable[[], bool] | None = None
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
            f"the targets cannot be ordered: no route from the start to {name} ({places[lost]}) keeps the clearance asked for",
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
    areas = ground.areas(ZoneKind.INCLUSION), ground.areas(ZoneKind.EXCLUSION)
    work = (
        len(places) * (len(places) - 1) // 2 * int(shapely.get_num_coordinates([*areas[0], *areas[1]]).sum())
    )
    compiled = work >= _COMPILED_FROM and find_spec("numba") is not None
    planner = pbpp.Planner(*areas, clearance_m=clearance_m, union=ground.union, compiled=compiled)
    return planner.lengths([_anchor(ground, planner, place) for place in local], should_stop=should_stop)


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


def with_end(planned: Plan, situation: Situation, request: Tour) -> Plan:
    """Return a plan with the end that is asked for.

    Raises
    ------
    NoRouteError
        RTL would drive straight home and break the promise on the way.
    SituationError
        RTL, and home is not known.
    VehicleError
        It is to loiter, and circles there.
    """
    end = request.end
    if end is End.HOLD:
        return planned
    if end is End.LOITER and planned.vehicle.pursuit is not None:
        raise VehicleError(
            "a PX4 rover with steered wheels does not stand where it loiters: it circles, and that was measured for LOITER_TIME only; use --end hold",
            end=end.value,
            advice="use --end hold",
        )
    items = ending(planned.items, end)
    if end is End.LOITER:
        return replace(planned, items=items)
    if planned.home is None:
        raise SituationError("RTL needs home, which is unknown; use --home LAT,LON, or --end hold or loiter")
    wanted = replace(request, widest=False, clearance_m=planned.clearance_m, start=planned.start)
    checked = check_mission(Mission(items, planned.home), situation, wanted)
    last = checked.legs[-1]
    is_broken = last.breaks if planned.clearance_m is not None else last.drawn_clearance_m < planned.asked_m
    if is_broken:
        near = (
            f"through {', '.join(last.crosses)}"
            if last.crosses
            else f"within {last.driven_clearance_m:.2f} m of {last.fence}"
        )
        raise NoRouteError(
            f"RTL at the end would drive straight home, {near} at {last.at}; plan the way home with --return",
            fences=list(last.crosses or (last.fence,)),
            driven_clearance_m=round(last.driven_clearance_m, 3),
            advice="use --return instead, or --end hold",
        )
    return replace(
        planned,
        items=items,
        path=(*planned.path, last.leg.end),
        seqs=(*planned.seqs, len(items)),
        speeds=(*planned.speeds, last.leg.speed_mps),
        keeps=replace(
            planned.keeps,
            drawn_m=min(planned.keeps.drawn_m, last.drawn_clearance_m),
            driven_m=min(planned.keeps.driven_m, last.driven_clearance_m),
        ),
        envelope=checked.envelope,
    )


def _with_order(planned: Plan, found: TargetOrder) -> Plan:
    """Return a plan that says in which order its targets are, and whether a shorter one may exist."""
    info, warnings = planned.info, planned.warnings
    if found.indices != tuple(range(len(found.indices))):
        numbers = ", ".join(str(index + 1) for index in found.indices)
        lengths = f"{found.length_m:.1f} m around the fences, {found.given_m:.1f} m in the order given"
        info = (f"targets reordered: {numbers} ({lengths})", *info)
    if found.bound_m < found.length_m * 0.9999:
        bound = f"{found.length_m:.1f} m, no order is shorter than {found.bound_m:.1f} m"
        warnings = (f"this order may not be the shortest: {bound}", *warnings)
    return replace(planned, info=info, warnings=warnings)
