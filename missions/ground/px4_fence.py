"""What PX4 does not do for a fence: zones that it takes and does not enforce, and no margin or avoidance before any."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shapely import Point

from missions.fence import ZoneKind
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from missions.ground.ground import Ground
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_STOPS = {0: "nothing stops the rover", 1: "it only warns, and the rover drives on"}
"""GF_ACTION."""


def own_promise_info(vehicle: Vehicle) -> list[str]:
    """Return that nobody but the plan keeps the clearance."""
    if vehicle.autopilot is not Autopilot.PX4:
        return []
    late = _STOPS.get(
        vehicle.fence.action,
        "it acts only when the rover is inside (in tests up to 1.6 m at 1 m/s, 2.5 m at 3 m/s)",
    )
    return [
        f"PX4 keeps no margin to fences and does not avoid them: this route alone keeps the clearance. Its own fence (GF_ACTION {vehicle.fence.action}): {late}"
    ]


def unenforced_warnings(vehicle: Vehicle, situation: Situation, ground: Ground) -> list[str]:
    """Return which zones PX4 would take and not enforce, by where home is (measured on v1.17.0 and the line of 1.18)."""
    if vehicle.autopilot is not Autopilot.PX4:
        return []
    if situation.home is None:
        return [
            "home unknown: PX4 does not enforce an inclusion that home is outside of, or an exclusion that it is in (--home LAT,LON)"
        ]
    home = Point(ground.frame.to_local(situation.home.value))
    inside = "home is inside it"
    outside = "home is outside it"
    return [
        f"PX4 will not enforce {barrier.name}: {outside if barrier.kind is ZoneKind.INCLUSION else inside}; this route keeps to it all the same"
        for barrier in ground.barriers
        if barrier.area.covers(home) is (barrier.kind is ZoneKind.EXCLUSION)
    ]
