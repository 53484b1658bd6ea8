"""A plan's mission from where the vehicle is now: the route from where it has come to rest, and a way home inside that was chosen.

The items stay as they are. What they make the vehicle drive from here is predicted and measured anew by the check that judges any mission, against what the
plan promises.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.checking.check import TOLERANCE_M, MissionCheck, check_mission, plan_of
from missions.errors import MissionError
from missions.fence import Obstacles
from missions.ground.seams import with_seams
from missions.items import Command, change_speed
from missions.request import GoTo, conditions
from missions.situation import Mission

if TYPE_CHECKING:
    from missions.checking.home_part import HomePart
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


def from_here(plan: Plan, situation: Situation, request: Request) -> Plan | None:
    """Return a plan as it is from where the vehicle stands; None where its mission does not keep from there what it has promised.

    Parameters
    ----------
    plan : Plan
        What was planned from another place.
    situation : Situation
        Where the vehicle stands; the fence as it is now. Obstacles do not count: `obstacle_ahead` looks for them.
    request : Request
        What was asked of the plan.
    """
    if plan.clearance_m is None or request.corner_allowance_m is not None:
        return None
    try:
        found = _checked(plan, plan.items, situation, request)
    except MissionError:
        return None
    first = found.legs[0]  # the check asks of it no more than its start has: here it keeps what was planned
    least_m = min(plan.asked_m, plan.driven_clearance_m)
    if not found.is_promised or first.driven_clearance_m < least_m - TOLERANCE_M:
        return None
    driven = plan_of(found, situation)
    if driven.path[1:] != plan.path[1:] or driven.seqs != plan.seqs:
        return None
    return replace(
        plan,
        path=driven.path,
        start=driven.start,
        envelope=driven.envelope,
        ground=with_seams(found.ground, found.vehicle),
        keeps=replace(plan.keeps, drawn_m=found.drawn_clearance_m, driven_m=found.driven_clearance_m),
        hold=found.hold,
    )


def on_way_home(plan: Plan, part: HomePart, situation: Situation, request: Request) -> Plan:
    """Return what is driven of a plan's mission from here, once a way home inside it was chosen; its items keep their numbers.

    Raises
    ------
    MissionError
        It cannot be followed.
    """
    items, numbers = part.items, part.numbers
    speed_mps = plan.speeds[max(plan.path_index(part.leg_item) - 1, 0)]
    if speed_mps is not None and items[0].command != Command.DO_CHANGE_SPEED:
        items, numbers = (change_speed(speed_mps), *items), (part.leg_item, *numbers)
    found = _checked(plan, items, situation, request)
    way = plan_of(found, situation, method=plan.method)
    seqs = (0, *(numbers[seq - 1] for seq in way.seqs[1:]))
    return replace(
        way,
        items=plan.items,
        seqs=seqs,
        asked_targets=(part.place,),
        ground=with_seams(found.ground, found.vehicle),
    )


def _checked(
    plan: Plan, items: tuple[MissionItem, ...], situation: Situation, request: Request
) -> MissionCheck:
    """Check items from where the vehicle is, for what the plan has promised, the error of its position at that time included."""
    asked = {**conditions(request), "start": None, "widest": False, "accepts_less": False}
    if plan.clearance_m is not None:
        asked |= {
            "clearance_m": plan.clearance_m,
            "position_error_m": plan.asked_m - plan.clearance_m,
            "reserve_m": 0.0,
        }
    return check_mission(Mission(items, plan.home), replace(situation, obstacles=Obstacles()), GoTo(**asked))
