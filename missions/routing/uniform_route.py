"""A route with the same room everywhere on top of the promise, for those who know their vehicle's corners themselves."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from missions.errors import NoRouteError, TargetBlockedError
from missions.fitting.polyline import DrawnPoint
from missions.ground.legs import reserve_m
from missions.routing.bottleneck import widest_clearance_m
from missions.routing.drawn_route import find_route, simplified
from missions.routing.route_search import DrivenRoute

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.promise import Promise
    from missions.request import Request
    from missions.routing.drawn_route import Route

_TINY_LEG_M = 1.5  # two shorter legs mean that the route winds round a corner; chosen, not measured
# Added to the clearance to draw rounder corners, widest first; chosen, not measured
_WIDER_M = (0.3, 0.1, 0.03)
_WIDEST_TRIES = 40  # each takes 2 % off: 40 come down to 45 % of the widest clearance. Chosen, not measured: it bounds the time
_WIDEST_SHARE = 0.97
"""What of the widest clearance a route keeps: round corners of the last millimetre would need a waypoint every half metre."""


def uniform_route(
    ground: Ground,
    ends: Sequence[LocalPoint],
    asked: Promise,
    request: Request,
    should_stop: Callable[[], bool] | None = None,
) -> tuple[Promise, DrivenRoute]:
    """Return the shortest route at the promise and its allowance, or the widest one; and what can be promised for it.

    Raises
    ------
    StartBlockedError, TargetBlockedError, NoRouteError
        No route.
    """
    wanted_m = asked.allowance_m or 0.0
    start, *targets = ends
    find = partial(
        find_route,
        ground,
        start,
        targets,
        snap_m=request.snap_m,
        method=request.method,
        escape=request.escape,
        should_stop=should_stop,
    )
    rounding_m = reserve_m(ground)
    if request.widest:
        route, kept_m = _widest_route(find, widest_clearance_m(ground, ends, should_stop))
        route = simplified(ground, route, _WIDEST_SHARE * kept_m)
        drawn_m = _WIDEST_SHARE * kept_m - rounding_m
        promised_m = max(0.0, drawn_m - wanted_m - asked.error_m)
        asked = replace(asked, promised_m=promised_m, error_m=drawn_m - wanted_m - promised_m)
    else:
        drawn_m = asked.required_m + wanted_m
        route = _sparse_route(ground, find, drawn_m + rounding_m)
    drawing = tuple(DrawnPoint(place, drawn_m, drawn_m) for place in route.places)
    return asked, DrivenRoute(drawing, route.lead_away, route.start_clearance_m, route.targets, route.blocks)


def _sparse_route(ground: Ground, find: Callable[..., Route], clearance_m: float) -> Route:
    """Return the route at a clearance; where it winds round corners in tiny legs, one a little wider off with fewer waypoints."""
    route = find(clearance_m=clearance_m)
    for wider_m in _WIDER_M:
        if not _has_tiny_legs(route):
            break
        try:
            wider = find(clearance_m=clearance_m + wider_m)
        except (NoRouteError, TargetBlockedError):
            continue
        if wider.lead_away == route.lead_away:
            return simplified(ground, wider, clearance_m)
    return route


def _has_tiny_legs(route: Route) -> bool:
    legs_m = np.hypot(*np.diff(route.points, axis=0).T)
    return bool((legs_m[route.lead_away :] < _TINY_LEG_M).sum() > 1)


def _widest_route(find: Callable[..., Route], clearance_m: float) -> tuple[Route, float]:
    """Return the route at the widest clearance, and that clearance: a little less where corners are mitred in the narrowest place."""
    for _ in range(_WIDEST_TRIES):
        try:
            return find(clearance_m=clearance_m), clearance_m
        except (NoRouteError, TargetBlockedError):
            clearance_m *= 0.98  # chosen: a try gives away 2 %
    return find(clearance_m=clearance_m), clearance_m
