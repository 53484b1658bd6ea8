"""The fence as PX4 enforces it: zone by zone, some of them not at all, and only after a while."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.simulator.fence_watch import FenceArea
from missions.errors import FenceError
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.simulator.flat import FlatFrame
    from missions.items import MissionItem

SECONDS_A_VERTEX = 0.1
"""Until a new fence counts: 4 vertices 0.5 s, 16 1.7 s, 64 6.3 s as measured, so one period more than there are vertices."""

_VERTICES = (Command.FENCE_POLYGON_VERTEX_INCLUSION, Command.FENCE_POLYGON_VERTEX_EXCLUSION)
_NO_HOME = "Geofence invalid, doesn't contain Home position"
_NO_VEHICLE = "Geofence invalid, doesn't contain current vehicle position"


@dataclass(frozen=True, slots=True)
class EnforcedFence:
    """What of a fence counts.

    Parameters
    ----------
    area : FenceArea
        The ground that it forbids.
    texts : tuple of str
        What PX4 says about zones that do not count.
    """

    area: FenceArea
    texts: tuple[str, ...]


def activation_s(items: Sequence[MissionItem]) -> float:
    """Return how long after its upload a fence counts."""
    return SECONDS_A_VERTEX * (len(items) + 1) if items else 0.0


def enforced_fence(
    items: Sequence[MissionItem],
    frame: FlatFrame,
    home_m: complex,
    vehicle_m: complex | None,
    radius_m: float,
) -> EnforcedFence:
    """Return what of a fence counts.

    Parameters
    ----------
    items : sequence of MissionItem
        The fence as it reads back.
    frame : FlatFrame
        The plane.
    home_m, vehicle_m : complex
        Where home is, and the vehicle if it is armed.
    radius_m : float
        GF_MAX_HOR_DIST; 0 is none.
    """
    kept: list[MissionItem] = []
    texts: list[str] = []
    for zone in _zones(items):
        try:
            area = FenceArea(zone, frame)
        except FenceError:
            continue  # taken, and what is enforced of it is anyone's guess
        if area.clearance_m(home_m) < 0:
            texts.append(_NO_HOME)
        elif vehicle_m is not None and area.clearance_m(vehicle_m) < 0:
            texts.append(_NO_VEHICLE)
        else:
            kept += zone
    circle = (home_m, radius_m) if radius_m > 0 else None
    return EnforcedFence(FenceArea(kept, frame, home_circle=circle), tuple(texts))


def _zones(items: Sequence[MissionItem]) -> list[list[MissionItem]]:
    """Return the items of each zone; polygons behind a circle are misread, which counts here as not at all."""
    zones: list[list[MissionItem]] = []
    seq, is_misread = 0, False
    while seq < len(items):
        item = items[seq]
        count = max(1, int(item.params[0])) if item.command in _VERTICES else 1
        if item.command in _VERTICES:
            if not is_misread:
                zones.append(list(items[seq : seq + count]))
        elif item.command != Command.FENCE_RETURN_POINT:
            is_misread = True
            zones.append([item])
        seq += count
    return zones
