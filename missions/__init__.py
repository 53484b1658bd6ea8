"""Missions for ground rovers: fences, vehicles, files, and the way from a situation to a plan.

The names below are stable; they are loaded when they are first asked for, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.errors import MissionError
    from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
    from missions.formats import read_fence, read_mission, read_parameters, read_situation, write_mission
    from missions.geo import LatLon
    from missions.items import MissionItem, waypoint
    from missions.plan import Plan
    from missions.plan import plan as plan_mission
    from missions.request import Request
    from missions.situation import Mission, Situation
    from missions.vehicle import Vehicle, vehicle_from_parameters

__all__ = [
    "CircleZone",
    "Fence",
    "LatLon",
    "Mission",
    "MissionError",
    "MissionItem",
    "Plan",
    "PolygonZone",
    "Request",
    "Situation",
    "Vehicle",
    "ZoneKind",
    "plan_mission",
    "read_fence",
    "read_mission",
    "read_parameters",
    "read_situation",
    "vehicle_from_parameters",
    "waypoint",
    "write_mission",
]

_HOMES = {
    "CircleZone": "fence",
    "Fence": "fence",
    "LatLon": "geo",
    "Mission": "situation",
    "MissionError": "errors",
    "MissionItem": "items",
    "Plan": "plan",
    "PolygonZone": "fence",
    "Request": "request",
    "Situation": "situation",
    "Vehicle": "vehicle",
    "ZoneKind": "fence",
    "plan_mission": "plan",
    "read_fence": "formats",
    "read_mission": "formats",
    "read_parameters": "formats",
    "read_situation": "formats",
    "vehicle_from_parameters": "vehicle",
    "waypoint": "items",
    "write_mission": "formats",
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{home}"), "plan" if name == "plan_mission" else name)
