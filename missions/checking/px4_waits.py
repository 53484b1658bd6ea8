"""What PX4's rover with steered wheels makes of waits: it drives through a waypoint's hold time, and circles where it is to loiter."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from missions.checking.execution import is_navigation
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.checking.execution import Course, CourseLeg
    from missions.items import MissionItem
    from missions.vehicle import Vehicle

WAIT_M = 9.3
"""How far from its waypoint it comes while it waits: measured from 2 m before it to 4.4 m past it, once 8.7 m, and 3 m to the side (LOITER_TIME on v1.17.0 and
the line of 1.18, DELAY on v1.17.0; 10 s at 1 to 3 m/s)."""


def with_waits(course: Course, items: Sequence[MissionItem], vehicle: Vehicle) -> Course:
    """Return the course as a PX4 rover with steered wheels drives it; that of any other as it is.

    Parameters
    ----------
    course : Course
        The course with its stops.
    items : sequence of MissionItem
        The mission, without a home item.
    vehicle : Vehicle
        What drives.
    """
    if vehicle.pursuit is None:
        return course
    legs: list[CourseLeg] = []
    notes: dict[str, None] = {}
    for leg in course.legs:
        waiting, text = _waiting(leg, items, vehicle)
        legs.append(waiting)
        notes |= dict.fromkeys(text)
    return replace(course, legs=tuple(legs), notes=(*course.notes, *notes))


def _waiting(leg: CourseLeg, items: Sequence[MissionItem], vehicle: Vehicle) -> tuple[CourseLeg, list[str]]:
    if leg.is_return or not 0 < leg.last_item <= len(items):
        return leg, []
    item = items[leg.last_item - 1]
    name = f"item {leg.last_item}"
    notes = []
    if item.command == Command.NAV_WAYPOINT and item.params[0] > 0:
        notes.append(
            f"{name}: PX4 ignores the hold time of a waypoint ({item.params[0]:g} s); the rover drives on"
        )
    delay_s = _delay_s(items, leg.last_item)
    if item.command in (Command.NAV_LOITER_TIME, Command.NAV_LOITER_UNLIM):
        what = "LOITER_TIME" if item.command == Command.NAV_LOITER_TIME else "LOITER_UNLIM"
        wait_s = item.params[0] if item.command == Command.NAV_LOITER_TIME else 0.0
        return _circling(leg, (wait_s or 0.0) + (delay_s or 0.0)), [*notes, _circles(name, what)]
    if delay_s is None:
        return replace(leg, stop_s=None), notes
    if vehicle.stands_for_delays:
        return replace(leg, stop_s=delay_s), notes
    return _circling(leg, delay_s), [*notes, _circles(name, "DELAY before PX4 1.18")]


def _circling(leg: CourseLeg, wait_s: float) -> CourseLeg:
    return replace(
        leg, stop_s=max(0.0, 0.0 if math.isnan(wait_s) else wait_s), circle_m=max(leg.circle_m, WAIT_M)
    )


def _circles(name: str, what: str) -> str:
    return f"{name}: a PX4 rover with steered wheels does not stand while it waits ({what}): it circles, up to {WAIT_M:g} m from there"


def _delay_s(items: Sequence[MissionItem], after: int) -> float | None:
    """Return how long the DELAY items behind a place wait; None where there are none."""
    waits_s: list[float] = []
    for item in items[after:]:
        # 1.18 keeps CONDITION_DELAY as DELAY; what 1.17 does with it was not measured, and is taken for the same.
        if item.command in (Command.NAV_DELAY, Command.CONDITION_DELAY):
            waits_s.append(0.0 if math.isnan(item.params[0]) else max(0.0, item.params[0]))
        elif is_navigation(item) or item.command == Command.DO_JUMP:
            break
    return sum(waits_s) if waits_s else None
