"""A logbook as a JSON document."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from mavlink_bridge.mavlink.autopilots import autopilot_of
from missions.fence import CircleZone, PolygonZone, ZoneKind

if TYPE_CHECKING:
    from mavlink_bridge.logbook.facts import Logbook, VehicleLog
    from mavlink_bridge.logbook.grade import Grade
    from missions.fence import Fence

_POSITIONS = ("position", "begun_at")


def as_document(book: Logbook) -> dict[str, Any]:
    """Return the document of ``pbpp log --json``: numbers rounded to what they are worth, times in seconds since the log's beginning."""
    return {
        "log": book.name,
        "begins_s": round(book.begins_s, 6),
        "duration_s": round(book.duration_s, 3),
        "has_timestamps": book.has_timestamps,
        "clock_jumps": book.clock_jumps,
        "clock_trouble": book.clock_trouble,
        "damage": asdict(book.damage),
        "messages": [
            {
                "system": traffic.system,
                "component": traffic.component,
                "id": traffic.message_id,
                "name": traffic.name,
                "count": traffic.count,
                "rate_hz": round(traffic.rate_hz, 3),
            }
            for traffic in book.traffic
        ],
        "vehicles": [_vehicle(vehicle) for vehicle in book.vehicles],
    }


def _vehicle(vehicle: VehicleLog) -> dict[str, Any]:
    situation = vehicle.situation
    home, mission = situation.home, situation.mission
    return {
        "system": vehicle.system,
        "component": vehicle.component,
        "mav_type": vehicle.mav_type,
        "firmware": str(situation.firmware) if situation.firmware else None,
        "home": list(home.value) if home else None,
        "position": list(situation.pose.value.position) if situation.pose else None,
        "mission_items": mission.value.item_count(
            has_home=autopilot_of(ardupilot=situation.ardupilot).lists.form.has_home_item
        )
        if mission
        else None,
        "rally_points": len(situation.rally.value) if situation.rally else None,
        "fences": [{"time_s": round(time_s, 3), **_fence(fence)} for time_s, fence in vehicle.fences],
        "fence_trouble": situation.fence_trouble,
        "driven_m": round(vehicle.driven_m, 2),
        "positions": vehicle.positions,
        "positions_without_fix": vehicle.positions_without_fix,
        "targets_seen": vehicle.targets_seen,
        "parameters_seen": vehicle.parameters.seen,
        **{name: _plain(getattr(vehicle, name)) for name in ("transfers", "targets", "modes")},
        "parameters": _plain(vehicle.parameters.values),
        "parameter_changes": _plain(vehicle.parameters.changes),
        **{name: _plain(getattr(vehicle, name)) for name in ("nearest", "intrusions", "reported_breaches")},
        "drives": [_grade(grade) for grade in vehicle.grades],
        "notes": list(vehicle.notes),
    }


def _grade(grade: Grade) -> dict[str, Any]:
    return {**_plain(grade), "is_as_foreseen": grade.is_as_foreseen}


def _fence(fence: Fence) -> dict[str, int]:
    return {
        "inclusion_polygons": fence.count(ZoneKind.INCLUSION, PolygonZone),
        "exclusion_polygons": fence.count(ZoneKind.EXCLUSION, PolygonZone),
        "inclusion_circles": fence.count(ZoneKind.INCLUSION, CircleZone),
        "exclusion_circles": fence.count(ZoneKind.EXCLUSION, CircleZone),
        "vertices": fence.vertex_count,
    }


def _plain(value: Any, name: str = "") -> Any:  # noqa: ANN401 - any value of a logbook
    """Return dataclasses as objects, tuples as lists, numbers rounded (positions not), and null for a number that is not finite."""
    if hasattr(value, "__dataclass_fields__"):
        return {field.name: _plain(getattr(value, field.name), field.name) for field in fields(value)}
    if isinstance(value, dict):
        return {str(key): _plain(entry, str(key)) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(entry, name) for entry in value]
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        return value if name in _POSITIONS or name.isupper() else round(value, 3)
    return value
