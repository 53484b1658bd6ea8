"""Where a route could not be fitted: the refusal that names the place, and the block that keeps the next route away from it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely
from shapely import Point

from missions.fitting import polyline as drawn
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.words import metres

if TYPE_CHECKING:
    from shapely import Polygon

    from missions.fitting.cost import Measured
    from missions.fitting.polyline import Drawing
    from missions.routing.drawn_route import Route, Sought

_START_ADVICE = "the vehicle has no room to turn where it stands: turn it by hand to face the route, or move it, or ask for less with --clearance"
AT_START = 2
"""Points where most is missing because of how the route begins."""

# Chosen, not measured: half the square's side, and how far along the route it keeps from both ends, so that these stay free.
_BLOCK_M = 0.5
_BLOCK_AWAY_M = 8.0


def refusal(
    sought: Sought,
    required_m: float,
    reserve_m: float,
    drawing: Drawing,
    measured: Measured,
    *,
    held_at_start: bool,
) -> NoRoute:
    """Return which corner refused, by how much and at which fence; with advice where the vehicle cannot turn at its start."""
    ground = sought.ground
    index = measured.worst_index
    point = drawing[index]
    position = ground.frame.to_lat_lon(point.place)
    barrier, _ = ground.nearest(Point(measured.worst[index]))
    fence = barrier.name if barrier else "no fence in particular"
    turn_deg = drawn.turn_deg(drawing, index) if 0 < index < len(drawing) - 1 else 0.0
    kept_m = point.required_m - reserve_m - measured.missing_m[index]
    where = (
        "the start"
        if index == 0
        else "the target"
        if index == len(drawing) - 1
        else f"the corner of {abs(turn_deg):.0f}° at {position}"
    )
    kept_m = max(kept_m, 0.0)
    facts = {
        "clearance_m": round(required_m, 3),
        "corner": list(position),
        "turn_deg": round(turn_deg, 1),
        "kept_m": round(kept_m, 3),
        "fences": [fence],
        "at_start": index <= AT_START,
    }
    return NoRoute(
        NoRouteKind.CORNER,
        f"no route keeps {sought.asked or metres(required_m)} while driving: at {where} this vehicle would come as near as "
        f"{metres(kept_m)} to {fence} on the best route tried",
        facts,
        [fence],
        advice=_START_ADVICE if index == 0 or held_at_start else None,
        at_start=index <= AT_START,
        is_held=held_at_start,
    )


def block(route: Route, drawing: Drawing, measured: Measured) -> Polygon:
    """Return a small square on a route near where most is missing, to send the next one elsewhere."""
    index = measured.worst_index
    place = measured.worst[index] if not math.isnan(measured.worst[index][0]) else drawing[index].place
    line = shapely.LineString(route.points)
    margin_m = min(_BLOCK_AWAY_M, line.length / 3)
    along_m = min(max(line.project(Point(place)), margin_m), line.length - margin_m)
    return line.interpolate(along_m).buffer(_BLOCK_M, cap_style="square")
