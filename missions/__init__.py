"""Missions for ground rovers: fences, vehicles, files, and the way from a situation to a plan.

The names below are stable; they are loaded when they are first asked for, so that importing this package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING
from warnings import warn

if TYPE_CHECKING:
    from missions.checking.check import CheckedLeg, MissionCheck, check_mission
    from missions.editing.repair import Repair, repair_mission
    from missions.errors import MissionError
    from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
    from missions.firmware import Firmware, read_firmware
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
    from missions.planning.plan import plan
    from missions.request import End, GoTo, Method, Order, RepairMission, Request, Tour
    from missions.situation import Known, Mission, Situation
    from missions.vehicle import Vehicle, vehicle_from_parameters

__all__ = [
    "CheckedLeg",
    "CircleZone",
    "End",
    "Fence",
    "Firmware",
    "GoTo",
    "Known",
    "LatLon",
    "Method",
    "Mission",
    "MissionCheck",
    "MissionError",
    "MissionItem",
    "Order",
    "Plan",
    "PolygonZone",
    "Repair",
    "RepairMission",
    "Request",
    "Situation",
    "Tour",
    "Vehicle",
    "ZoneKind",
    "check_mission",
    "plan",
    "read_fence",
    "read_firmware",
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
    name: home
    for home, names in {
        "checking.check": ("CheckedLeg", "MissionCheck", "check_mission"),
        "editing.repair": ("Repair", "repair_mission"),
        "errors": ("MissionError",),
        "fence": ("CircleZone", "Fence", "PolygonZone", "ZoneKind"),
        "firmware": ("Firmware", "read_firmware"),
        "formats": (
            "read_fence",
            "read_mission",
            "read_parameters",
            "read_situation",
            "write_mission",
            "write_situation",
        ),
        "geo": ("LatLon",),
        "items": ("MissionItem", "waypoint"),
        "planned": ("Plan",),
        "planning.plan": ("plan",),
        "request": ("End", "GoTo", "Method", "Order", "RepairMission", "Request", "Tour"),
        "situation": ("Known", "Mission", "Situation"),
        "vehicle": ("Vehicle", "vehicle_from_parameters"),
    }.items()
    for name in names
}


_DEPRECATED = {"plan_mission": "plan", "plan_tour": "plan"}


def __getattr__(name: str) -> object:
    if name in _DEPRECATED:
        warn(
            f"missions.{name} is deprecated: call missions.{_DEPRECATED[name]}",
            DeprecationWarning,
            stacklevel=2,
        )
    name = _DEPRECATED.get(name, name)
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{home}"), name)
