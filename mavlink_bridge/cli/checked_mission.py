"""A mission checked as options ask for it, and its JSON document."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import remarks_document
from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.home_parts import ways_document
from mavlink_bridge.cli.mission_source import mission_situation, start_of
from mavlink_bridge.cli.plan_results import hold_document
from mavlink_bridge.cli.values import given_places
from mavlink_bridge.cli.vehicle_options import with_vehicle
from mavlink_bridge.cli.way_home import RouteWays
from missions.checking.check import check_mission, plan_of
from missions.request import GoTo
from missions.vehicle.item_limit import most_own_items
from missions.words import mission_items

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.check import CheckOptions
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


@dataclass(frozen=True, slots=True)
class CheckedMission:
    """A check, what it was asked for, the mission as a plan, the ways home from it, and every warning."""

    situation: Situation
    request: Request
    checked: MissionCheck
    planned: Plan
    ways: RouteWays | None
    warnings: list[str]


def checked_of(options: CheckOptions) -> CheckedMission:
    """Check the mission that options name.

    Raises
    ------
    UsageError
        There is no mission, or an option is not what it has to be.
    MissionError, BridgeError
        What cannot be read or checked.
    """
    places = given_places(options.place)
    request = with_vehicle(GoTo(clearance_m=options.clearance, trusts_model=options.trust_model), options)
    situation, unknown = mission_situation(options)
    assert situation.mission is not None
    request = replace(request, start=start_of(options, situation))
    checked = check_mission(situation.mission.value, situation, request)
    planned = plan_of(checked, situation)
    ways = RouteWays.of(planned, situation, places)
    warnings = [
        *situation.remarks,
        *unknown,
        *checked.warnings,
        *(ways.warnings if ways is not None else ()),
        *_storage_warnings(checked, situation),
    ]
    return CheckedMission(situation, request, checked, planned, ways, warnings)


def items_text(checked: MissionCheck) -> str:
    """Return in words how many items a mission has, with home where it is one."""
    home = checked.vehicle.home_items
    return mission_items(len(checked.mission.items) + home, has_home=bool(home))


def _storage_warnings(checked: MissionCheck, situation: Situation) -> list[str]:
    """Warn of a mission that the vehicle cannot hold."""
    home, most = checked.vehicle.home_items, most_own_items(situation)
    by_board = "" if home else " (or 1000, depending on the board; no parameter tells which)"
    told = f"{items_text(checked)}; the vehicle holds {most + home}{by_board}"
    return [told] if len(checked.mission.items) > most else []


def document_of(found: CheckedMission) -> dict[str, object]:
    """Return the JSON document of a check, without the files that were written."""
    checked, warnings, system = found.checked, found.warnings, found.situation.system
    return {
        "status": "ok" if checked.is_promised else "failed",
        "command": "check",
        "exit_code": int(ExitCode.DONE if checked.is_promised else ExitCode.CHECK),
        "system": system,
        "clearance_m": checked.clearance_m,
        "length_m": round(checked.length_m, 3),
        "duration_s": round(checked.duration_s, 1),
        "drawn_clearance_m": _finite(checked.drawn_clearance_m),
        "driven_clearance_m": _finite(checked.driven_clearance_m),
        "mission_items": len(checked.mission.items) + checked.vehicle.home_items,
        "endless": checked.course.is_endless,
        "broken": len(checked.broken),
        "stopping": hold_document(checked.hold),
        "legs": [_leg_document(leg) for leg in checked.legs],
        "not_understood": list(checked.troubles),
        "dangers": list(checked.dangers),
        "extrapolated": list(checked.extrapolated),
        **remarks_document(checked.info, warnings),
        "ways_home": found.ways.document() if found.ways is not None else None,
        "way_home_inside": ways_document(checked.home_ways),
    }


def _leg_document(leg: CheckedLeg) -> dict[str, object]:
    course = leg.leg
    return {
        "from_item": course.first_item,
        "to_item": course.last_item,
        "jump_item": course.jump_item,
        "rtl": course.is_return,
        "start": list(course.start),
        "end": list(course.end),
        "length_m": round(leg.length_m, 3),
        "time_s": round(leg.time_s, 1),
        "speed_mps": course.speed_mps,
        "stop_s": course.stop_s,
        "drawn_clearance_m": _finite(leg.drawn_clearance_m),
        "driven_clearance_m": _finite(leg.driven_clearance_m),
        "asked_m": round(leg.asked_m, 4),
        "fence": leg.fence,
        "at": list(leg.at) if leg.at else None,
        "crosses": list(leg.crosses),
        "breaks": leg.breaks,
    }


def _finite(value_m: float) -> float | None:
    return None if value_m == float("inf") else round(value_m, 4)
