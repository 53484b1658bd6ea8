"""How a mission ends, and where RTL leads: straight to home or the nearest rally point, whatever stands in between."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.checking.rtl_lines import Metric, ReturnRule, RoutePieces, may_choose, swept
from missions.fence import ZoneKind
from missions.items import Command, MissionItem, waypoint
from missions.request import End
from missions.vehicle import Autopilot, whole_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.checking.execution import Course
    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_RTL_ACTIONS = {
    "FENCE_ACTION": {1, 3},
    "FS_ACTION": {1, 3},
    "BATT_FS_LOW_ACT": {1, 3},
    "BATT_FS_CRT_ACT": {1, 3},
}
"""Values that end in RTL, at once or where SmartRTL cannot be had."""

_PIECE_M, _MOST_PIECES = 2.0, 4000
"""A route is looked at in pieces: near the border between two rally points both count, this far to either side. Chosen; they bound the work."""

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


def crossed_zones(ground: Ground, shapes: BaseGeometry | NDArray[np.object_]) -> tuple[str, ...]:
    """Name the zones on whose forbidden ground a shape lies that is not wholly on allowed ground, or any of several."""
    names = [
        barrier.name
        for barrier in ground.barriers
        if barrier.kind is ZoneKind.EXCLUSION
        and np.any(shapely.intersects(barrier.area, shapes) & ~shapely.touches(barrier.area, shapes))
    ]
    if not np.all(shapely.covers(ground.keep_in, shapes)):
        names += [
            barrier.name
            for barrier in ground.barriers
            if barrier.kind is ZoneKind.INCLUSION and not np.all(shapely.covers(barrier.area, shapes))
        ]
    return tuple(names) or ("the edge of the field",)


def return_warnings(
    situation: Situation, vehicle: Vehicle, ground: Ground, path: Sequence[LatLon]
) -> list[str]:
    """Warn where RTL, called anywhere on a path, would drive straight through a fence.

    The straight lines from all places of a piece of a leg to one place fill a triangle: it is on allowed ground as a whole, or one of them is not.
    """
    home = situation.home.value if situation.home else None
    if vehicle.oa_type or (home is None and not situation.rally):
        return []
    legs, crossed = _crossing(situation, ground, home, path)
    if not crossed:
        return []
    to = "to the nearest rally point or home" if situation.rally and situation.rally.value else "home"
    text = (
        f"RTL {_causes(situation, vehicle)}drives straight {to}; from {len(legs)} of {len(path) - 1} legs it would cross "
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


def _crossing(
    situation: Situation, ground: Ground, home: LatLon | None, path: Sequence[LatLon]
) -> tuple[set[int], tuple[str, ...]]:
    """Return from which legs RTL would cross a fence, and which zones."""
    frame = ground.frame
    rally = [point.position for point in situation.rally.value] if situation.rally else []
    goals = frame.to_local_array([*rally, *([home] if home else [])])
    pieces = RoutePieces.of(frame.to_local_array(path), _PIECE_M, _MOST_PIECES)
    spread = np.ptp(np.vstack([goals, pieces.starts, pieces.ends]), axis=0)
    metric = Metric.of(ground, float(np.hypot(*spread)))
    away_m = metric.distances_m(goals, (pieces.starts + pieces.ends) / 2)
    within_m = pieces.lengths_m * metric.steepest + metric.slack_m
    rule = ReturnRule.of(situation.parameters)
    chosen = may_choose(away_m[: len(rally)], away_m[-1] if home else None, rule, within_m)
    hulls, _, piece = swept(pieces, goals, chosen[: len(goals)])
    shapely.prepare(ground.allowed)
    outside = ~shapely.covers(ground.allowed, hulls)
    if not outside.any():
        return set(), ()
    zones = crossed_zones(ground, hulls[outside])
    return set(pieces.legs[piece[outside]].tolist()), zones


def _causes(situation: Situation, vehicle: Vehicle) -> str:
    """Name the parameters that call for RTL."""
    causes = [
        f"{name} {situation.parameters[name]:g}"
        for name, values in _RTL_ACTIONS.items()
        if situation.parameters.get(name) in values and (name != "FENCE_ACTION" or vehicle.fence.enabled)
    ]
    return f"({', '.join(causes)}) " if causes else ""
