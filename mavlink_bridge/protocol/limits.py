"""How much a vehicle can hold, asked before anything is sent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionType
from missions.items import Command
from missions.vehicle.item_limit import MISSION_ITEMS, most_items, sd_card_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mavlink_bridge.mavlink.autopilots import AutopilotTable
    from missions.items import MissionItem

_SD_FENCE_ITEMS = 4096  # measured on ArduPilot Rover 4.7.0-dev, with storage on an SD card
_POLYGON = frozenset({Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION})
_CIRCLE = frozenset({Command.FENCE_CIRCLE_INCLUSION, Command.FENCE_CIRCLE_EXCLUSION})


@dataclass(frozen=True, slots=True)
class Limits:
    """What fits on a vehicle; the defaults are ArduPilot Rover's with 16 KB of storage, as measured.

    Parameters
    ----------
    mission_items, fence_items, rally_points : int, optional
        Most items in a list; the home item of a mission counts. None leaves it to the vehicle's own answer.
    fence_bytes : int, optional
        Storage for the fence: 4, 2 + 8 n for a polygon of n vertices, 13 for a circle, 9 for the return point. None where only items count.
    """

    mission_items: int | None = MISSION_ITEMS
    fence_items: int | None = 84
    rally_points: int | None = None
    fence_bytes: int | None = 672

    @classmethod
    def of(cls, autopilot: AutopilotTable) -> Limits:
        """Return what fits on a vehicle of which only its autopilot is known."""
        most = autopilot.lists.most_items
        return cls(
            most.get(MissionType.MISSION),
            most.get(MissionType.FENCE),
            most.get(MissionType.RALLY),
            fence_bytes=autopilot.lists.fence_bytes,
        )

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, float]) -> Limits:
        """Return a vehicle's limits from its parameters: BRD_SD_MISSION and BRD_SD_FENCE are storage on the SD card, in KB."""
        limits = cls(mission_items=most_items(parameters))
        fence_bytes = sd_card_bytes(parameters, "BRD_SD_FENCE")
        if fence_bytes > 0:
            limits = replace(
                limits, fence_items=min(fence_bytes // 8, _SD_FENCE_ITEMS), fence_bytes=fence_bytes
            )
        return limits

    @classmethod
    def of_vehicle(cls, autopilot: AutopilotTable, parameters: Mapping[str, float]) -> Limits:
        """Return what fits on a vehicle, by its parameters where they tell."""
        return (
            cls.from_parameters(parameters) if autopilot.lists.has_storage_parameters else cls.of(autopilot)
        )

    def problem(self, items: Sequence[MissionItem], mission_type: MissionType) -> str | None:
        """Return why a list does not fit; None if it does."""
        most = {
            MissionType.MISSION: self.mission_items,
            MissionType.FENCE: self.fence_items,
            MissionType.RALLY: self.rally_points,
        }.get(mission_type)
        if most is not None and len(items) > most:
            return f"{len(items)} {mission_type.name.lower()} items; the vehicle holds {most}"
        if mission_type is not MissionType.FENCE or self.fence_bytes is None:
            return None
        if (needed := fence_bytes(items)) > self.fence_bytes:
            return f"the fence needs {needed} bytes of storage; the vehicle has {self.fence_bytes}"
        return None


def fence_bytes(items: Sequence[MissionItem]) -> int:
    """Return the storage a fence needs on ArduPilot, in bytes."""
    vertices = [item for item in items if item.command in _POLYGON]
    polygons = sum(1 / item.params[0] for item in vertices if item.params[0] >= 1)
    circles = sum(item.command in _CIRCLE for item in items)
    return_points = sum(item.command == Command.FENCE_RETURN_POINT for item in items)
    # As measured on ArduPilot Rover 4.7.0-dev: 672 bytes hold one polygon of 83 vertices, 25 triangles or 51 circles.
    return 4 + 2 * round(polygons) + 8 * len(vertices) + 13 * circles + 9 * return_points
