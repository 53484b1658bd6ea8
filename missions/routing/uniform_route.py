"""A route with the same room everywhere on top of the promise, for those who know their vehicle's corners themselves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from missions.fitting.polyline import DrawnPoint
from missions.ground.legs import reserve_m
from missions.routing.drawn_route import DrawnRoutes, Route, simplified, widest_drawn_m
from missions.routing.no_route import NoRoute
from missions.routing.route_search import DrivenRoute

if TYPE_CHECKING:
    from missions.promise import Promise
    from missions.routing.drawn_route import Sought

_TINY_LEG_M = 1.5  # two shorter legs mean that the route winds round a corner; chosen, not measured
# Added to the clearance to draw rounder corners, widest first; chosen, not measured
_WIDER_M = (0.3, 0.1, 0.03)


def uniform_route(sought: Sought, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
    """Return the shortest route at the promise and its allowance, and what is promised for it; else why there is none."""
    route = _sparse_route(sought, asked.drawn_m + reserve_m(sought.ground))
    return route if isinstance(route, NoRoute) else (asked, _driven(route, asked.drawn_m))


def widest_uniform_route(sought: Sought, asked: Promise) -> tuple[Promise, DrivenRoute] | NoRoute:
    """Return the route at the greatest promise that there is one for, to the centimetre, and that promise; else why there is none."""
    reserved_m = reserve_m(sought.ground)
    widest_m = widest_drawn_m(sought)
    if isinstance(widest_m, NoRoute):
        return widest_m
    beside_m = reserved_m + (asked.allowance_m or 0.0) + asked.error_m
    promised_m = math.floor(100 * max(0.0, widest_m - beside_m)) / 100
    error_m = min(asked.error_m, max(0.0, widest_m - reserved_m - (asked.allowance_m or 0.0)))
    promise = replace(asked, promised_m=promised_m, error_m=error_m)
    route = _sparse_route(sought, promise.drawn_m + reserved_m)
    return route if isinstance(route, NoRoute) else (promise, _driven(route, promise.drawn_m))


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
