"""How a mission ends, and where RTL leads: straight to home or the nearest rally point, whatever stands in between."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from shapely import MultiPoint

from missions.fence import ZoneKind
from missions.geo import LatLon, distance_m
from missions.items import Command, MissionItem, waypoint
from missions.request import End
from missions.vehicle import Autopilot, real_number, whole_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from missions.checking.execution import Course
    from missions.ground.ground import Ground
    from missions.situation import Situation
    from missions.vehicle import Vehicle

RALLY_LIMIT_M = 500.0
"""RALLY_LIMIT_KM of ArduPilot Rover: rally points farther away than this lose to a nearer home."""

_RTL_ACTIONS = {
    "FENCE_ACTION": {1, 3},
    "FS_ACTION": {1, 3},
    "BATT_FS_LOW_ACT": {1, 3},
    "BATT_FS_CRT_ACT": {1, 3},
}
"""Values that end in RTL, at once or where SmartRTL cannot be had."""

_DONE_MODES = {1: "Loiter", 2: "Acro", 3: "Manual"}


def ending(items: Sequence[MissionItem], end: End) -> tuple[MissionItem, ...]:
    """Return waypoints with the end that is wanted: the last one loitered at, or RTL after it."""
    if end is End.RTL:
        return (*items, MissionItem(Command.NAV_RETURN_TO_LAUNCH))
    if end is End.LOITER:
        last = max(index for index, item in enumerate(items) if item.is_placed)
        return (
            *items[:last],
            replace(
                items[last], command=Command.NAV_LOITER_UNLIM, params=waypoint(items[last].position).params
            ),
            *items[last + 1 :],
        )
    return tuple(items)


def return_place(situation: Situation, here: LatLon, home: LatLon | None) -> LatLon | None:
    """Return where RTL leads from a place (AP_Rally::calc_best_rally_or_home_location): the nearest rally point, else home.

    Home takes part where RALLY_INCL_HOME is 1, and where the nearest rally point is farther away than RALLY_LIMIT_KM.
    """
    rally = [point.position for point in situation.rally.value] if situation.rally else []
    if not rally:
        return home
    nearest = min(rally, key=lambda place: distance_m(here, place))
    if home is None:
        return nearest
    limit_m = real_number(situation.parameters, "RALLY_LIMIT_KM", RALLY_LIMIT_M / 1000) * 1000
    away_m = distance_m(here, nearest)
    counts_home = situation.parameters.get("RALLY_INCL_HOME") == 1 or 0 < limit_m < away_m
    return home if counts_home and distance_m(here, home) < away_m else nearest


def crossed_zones(ground: Ground, shape: BaseGeometry) -> tuple[str, ...]:
    """Name the zones on whose forbidden ground a shape lies that is not wholly on allowed ground."""
    names = [
        barrier.name
        for barrier in ground.barriers
        if barrier.kind is ZoneKind.EXCLUSION
        and barrier.area.intersects(shape)
        and not barrier.area.touches(shape)
    ]
    if not ground.keep_in.covers(shape):
        names += [
            barrier.name
            for barrier in ground.barriers
            if barrier.kind is ZoneKind.INCLUSION and not barrier.area.covers(shape)
        ]
    return tuple(names) or ("the edge of the field",)


def return_warnings(
    situation: Situation, vehicle: Vehicle, ground: Ground, path: Sequence[LatLon]
) -> list[str]:
    """Warn where RTL, called anywhere on a path, would drive straight through a fence.

    The straight lines home from all places of a leg fill a triangle: it is on allowed ground as a whole, or one of them is not.
    """
    home = situation.home.value if situation.home else None
    if vehicle.oa_type or (home is None and not situation.rally):
        return []
    crossed: dict[str, None] = {}
    legs = 0
    for a, b in pairwise(path):
        goals = dict.fromkeys(filter(None, (return_place(situation, place, home) for place in (a, b))))
        found = {
            name: None
            for goal in goals
            if not ground.allowed.covers(swept := _triangle(ground, goal, a, b))
            for name in crossed_zones(ground, swept)
        }
        legs += bool(found)
        crossed |= found
    if not crossed:
        return []
    to = "to the nearest rally point" if situation.rally else "home"
    text = (
        f"RTL {_causes(situation, vehicle)}drives straight {to}; from {legs} of {len(path) - 1} legs it would cross "
        f"{', '.join(crossed)}"
    )
    return [text]


def end_warnings(situation: Situation, vehicle: Vehicle, course: Course) -> list[str]:
    """Warn where the vehicle does not stay at the end of a mission."""
    if vehicle.autopilot is not Autopilot.ARDUPILOT or course.is_endless or course.ends_in_loiter:
        return []
    mode = _DONE_MODES.get(whole_number(situation.parameters, "MIS_DONE_BEHAVE", 0))
    return (
        [f"after the last item the vehicle switches to {mode} (MIS_DONE_BEHAVE), not to Hold"] if mode else []
    )


def _triangle(ground: Ground, goal: LatLon, a: LatLon, b: LatLon) -> BaseGeometry:
    return MultiPoint(ground.frame.to_local_array([goal, a, b])).convex_hull


def _causes(situation: Situation, vehicle: Vehicle) -> str:
    """Name the parameters that call for RTL."""
    causes = [
        f"{name} {situation.parameters[name]:g}"
        for name, values in _RTL_ACTIONS.items()
        if situation.parameters.get(name) in values and (name != "FENCE_ACTION" or vehicle.fence.enabled)
    ]
    return f"({', '.join(causes)}) " if causes else ""
