"""A route with the same room everywhere on top of the promise, for those who know their vehicle's corners themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from missions.fitting.polyline import DrawnPoint
from missions.ground.legs import reserve_m
from missions.routing.bottleneck import kept_m
from missions.routing.drawn_route import DrawnRoutes, Route, simplified
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.routing.route_search import DrivenRoute

if TYPE_CHECKING:
    from missions.promise import Promise
    from missions.routing.drawn_route import Sought

_TINY_LEG_M = 1.5  # two shorter legs mean that the route winds round a corner; chosen, not measured
# Added to the clearance to draw rounder corners, widest first; chosen, not measured
_WIDER_M = (0.3, 0.1, 0.03)
_WIDEST_TRIES = 40  # each takes 2 % off: 40 come down to 45 % of the widest clearance. Chosen, not measured: it bounds the time
_WIDEST_SHARE = 0.97
"""What of the widest clearance a route keeps: round corners of the last millimetre would need a waypoint every half metre."""


def uniform_route(sought: Sought, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
    """Return the shortest route at the promise and its allowance, and what is promised for it; else why there is none."""
    route = _sparse_route(sought, asked.drawn_m + reserve_m(sought.ground))
    return route if isinstance(route, NoRoute) else (asked, _driven(route, asked.drawn_m))


def widest_uniform_route(sought: Sought, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
    """Return the widest route, and what can be promised for it; else why there is none."""
    widest_m = kept_m(sought.narrowest_places())
    clearance_m, route = _widest_route(sought, widest_m)
    if isinstance(route, NoRoute):
        return route
    simplified_m = _WIDEST_SHARE * clearance_m
    drawn_m = simplified_m - reserve_m(sought.ground)
    wanted_m = asked.allowance_m or 0.0
    promised_m = max(0.0, drawn_m - wanted_m - asked.error_m)
    promise = replace(asked, promised_m=promised_m, error_m=drawn_m - wanted_m - promised_m)
    return promise, _driven(simplified(sought.ground, route, simplified_m), drawn_m)


def _driven(route: Route, drawn_m: float) -> DrivenRoute:
    drawing = tuple(DrawnPoint(place, drawn_m, drawn_m) for place in route.places)
    return DrivenRoute(drawing, route.lead_away, route.start_clearance_m, route.targets, route.blocks)


def _sparse_route(sought: Sought, clearance_m: float) -> Route | NoRoute:
    """Return the route at a clearance; where it winds round corners in tiny legs, one a little wider off with fewer waypoints."""
    route = DrawnRoutes.at(sought, clearance_m).find()
    if isinstance(route, NoRoute) or not _has_tiny_legs(route):
        return route
    for wider_m in _WIDER_M:
        wider = DrawnRoutes.at(sought, clearance_m + wider_m).find()
        if isinstance(wider, Route) and wider.lead_away == route.lead_away:
            return simplified(sought.ground, wider, clearance_m)
    return route


def _has_tiny_legs(route: Route) -> bool:
    legs_m = np.hypot(*np.diff(route.points, axis=0).T)
    return bool((legs_m[route.lead_away :] < _TINY_LEG_M).sum() > 1)


def _widest_route(sought: Sought, clearance_m: float) -> tuple[float, Route | NoRoute]:
    """Return the route at the widest clearance, and that clearance: a little less where corners are mitred in the narrowest place."""
    route = DrawnRoutes.at(sought, clearance_m).find()
    for _ in range(_WIDEST_TRIES):
        if isinstance(route, Route) or route.kind is NoRouteKind.START_BLOCKED:
            break
        clearance_m *= 0.98  # chosen: a try gives away 2 %
        route = DrawnRoutes.at(sought, clearance_m).find()
    return clearance_m, route
