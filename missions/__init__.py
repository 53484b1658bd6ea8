"""Missions for ground rovers: fences, vehicles, files, and the way from a situation to a plan.

The names below are stable; they are loaded when they are first asked for, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.checking.check import CheckedLeg, MissionCheck, check_mission
    from missions.editing.repair import Repair, repair_mission
    from missions.errors import MissionError
    from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
    from missions.formats import (
        read_fence,
        read_mission,
        read_parameters,
        read_situation,
        write_mission,
        write_situation,
    )
    from missions.geo import LatLon
    from missions.items import MissionItem, waypoint
    from missions.planned import Plan
    from missions.planning.plan import plan as plan_mission
    from missions.request import Request
    from missions.situation import Known, Mission, Situation
    from missions.tour.tour import plan_tour
    from missions.vehicle import Vehicle, vehicle_from_parameters

__all__ = [
    "CheckedLeg",
    "CircleZone",
    "Fence",
    "Known",
    "LatLon",
    "Mission",
    "MissionCheck",
    "MissionError",
    "MissionItem",
    "Plan",
    "PolygonZone",
    "Repair",
    "Request",
    "Situation",
    "Vehicle",
    "ZoneKind",
    "check_mission",
    "plan_mission",
    "plan_tour",
    "read_fence",
    "read_mission",
    "read_parameters",
    "read_situation",
    "repair_mission",
    "vehicle_from_parameters",
    "waypoint",
    "write_mission",
    "write_situation",
]

_HOMES = {
    "CheckedLeg": "checking.check",
    "CircleZone": "fence",
    "Fence": "fence",
    "Known": "situation",
    "LatLon": "geo",
    "Mission": "situation",
    "MissionCheck": "checking.check",
    "MissionError": "errors",
    "MissionItem": "items",
    "Plan": "planned",
    "PolygonZone": "fence",
    "Repair": "editing.repair",
    "Request": "request",
    "Situation": "situation",
    "Vehicle": "vehicle",
    "ZoneKind": "fence",
    "check_mission": "checking.check",
    "plan_mission": "planning.plan",
    "plan_tour": "tour.tour",
    "read_fence": "formats",
    "read_mission": "formats",
    "read_parameters": "formats",
    "read_situation": "formats",
    "repair_mission": "editing.repair",
    "vehicle_from_parameters": "vehicle",
    "waypoint": "items",
    "write_mission": "formats",
    "write_situation": "formats",
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{home}"), "plan" if name == "plan_mission" else name)
