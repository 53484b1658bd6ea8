"""Finished lines: rounded to degE7, checked as the autopilot draws them, and written as mission items."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.errors import PlanCheckError
from missions.geo import LocalPoint, rounded
from missions.ground.ground import EDGE_BOW_M
from missions.ground.legs import MAX_LEG_M, ROUNDING_RESERVE_M, drawn_leg
from missions.items import change_speed, waypoint

if TYPE_CHECKING:
    from missions.fitting.polyline import Drawing
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.items import MissionItem


@dataclass(frozen=True, slots=True)
class Lines:
    """A path as it goes into a mission.

    Parameters
    ----------
    path : tuple of LatLon
        The points, start first, as rounded into the items.
    speeds : tuple of float or None
        What is asked for on each leg; None is the vehicle's own.
    stops : dict of int to float
        Where it waits, by the point's number, and how long in seconds.
    lead_away : int
        How many of the first legs lead away from a fence nearby.
    """

    path: tuple[LatLon, ...]
    speeds: tuple[float | None, ...]
    stops: dict[int, float]
    lead_away: int


def finished(ground: Ground, drawing: Drawing, lead_away: int) -> Lines:
    """Split long legs, round to degE7, drop waypoints that fall together."""
    path = [rounded(ground.frame.to_lat_lon(drawing[0].place))]
    speeds: list[float | None] = []
    stops: dict[int, float] = {}
    leading = 0
    for number, (a, b) in enumerate(pairwise(drawing)):
        pieces = max(1, math.ceil(math.dist(a.place, b.place) / MAX_LEG_M))
        for piece in range(1, pieces + 1):
            share = piece / pieces
            (east_a, north_a), (east_b, north_b) = a.place, b.place
            place = LocalPoint(east_a + (east_b - east_a) * share, north_a + (north_b - north_a) * share)
            position = rounded(ground.frame.to_lat_lon(place))
            if position != path[-1]:
                path.append(position)
                speeds.append(b.speed_mps)
                leading += number < lead_away
        if b.stop_s is not None:
            stops[len(path) - 1] = b.stop_s
    if len(path) == 1:
        return Lines((path[0], path[0]), (None,), {}, 0)
    return Lines(tuple(path), tuple(speeds), stops, leading)


def mission_items(
    lines: Lines, own_speed_mps: float, asked_speed_mps: float | None
) -> tuple[tuple[MissionItem, ...], tuple[int, ...]]:
    """Return the items, and for each point of the path its seq with home at 0 (0 for the start).

    Speeds stand before the waypoint whose leg they are for: the autopilot takes them when it has reached the one before.
    """
    items: list[MissionItem] = []
    seqs = [0]
    now_mps = own_speed_mps
    if asked_speed_mps is not None:
        items.append(change_speed(asked_speed_mps))
    for number, (position, speed_mps) in enumerate(zip(lines.path[1:], lines.speeds, strict=True), start=1):
        wanted_mps = own_speed_mps if speed_mps is None else speed_mps
        if wanted_mps != now_mps:
            items.append(change_speed(wanted_mps))
            now_mps = wanted_mps
        item = waypoint(position)
        if number in lines.stops:
            item = replace(item, params=(lines.stops[number], 0.0, 0.0, 0.0))
        items.append(item)
        seqs.append(len(items))
    return tuple(items), tuple(seqs)


def check_lines(ground: Ground, lines: Lines, start_clearance_m: float, asked_m: float) -> float:
    """Measure the finished lines, as the autopilot draws them, and return their least clearance.

    Raises
    ------
    PlanCheckError
        They come nearer to a fence than asked.
    """
    clearances_m = [ground.clearance_m(drawn_leg(ground, a, b)) for a, b in pairwise(lines.path)]
    if not ground.edge.is_empty:  # it may stand so far off the autopilot's
        clearances_m = [max(0.0, clearance_m - EDGE_BOW_M) for clearance_m in clearances_m]
    leading_m = min(start_clearance_m, asked_m) - ROUNDING_RESERVE_M
    if start_clearance_m < 0:  # it leaves forbidden ground
        leading_m = 0.0
    least_m = {"lead-away": leading_m, "route": asked_m}
    parts = {"lead-away": clearances_m[: lines.lead_away], "route": clearances_m[lines.lead_away :]}
    for name, found in parts.items():
        if found and min(found) < least_m[name] - 1e-6:
            raise PlanCheckError(
                f"the {name} comes within {min(found):.4f} m of a fence; at least {least_m[name]:.4f} m is required. This is a bug, please report it",
                clearance_m=min(found),
                asked_m=least_m[name],
            )
    return min(clearances_m)
