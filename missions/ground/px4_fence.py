"""What PX4 does not do for a fence: zones that it takes and does not enforce, and no margin or avoidance before any."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shapely import Point

from missions.errors import MissionError
from missions.fence import ZoneKind
from missions.ground.from_situation import ground_for
from missions.promise import known_vehicle
from missions.request import GoTo
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from missions.ground.ground import Barrier, Ground
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
        "it acts only after a breach (in tests the rover stopped up to 1.6 m beyond the fence at 1 m/s, 2.5 m at 3 m/s)",
    )
    return [
        f"PX4 keeps no margin to fences and does not avoid them: only this route keeps the clearance. Its own fence (GF_ACTION {vehicle.fence.action}): {late}"
    ]


def unenforced_warnings(vehicle: Vehicle, situation: Situation, ground: Ground) -> list[str]:
    """Return which zones PX4 would take and not enforce, by where home is, and the vehicle if it is armed (measured on v1.17.0 and the line of 1.18)."""
    if vehicle.autopilot is not Autopilot.PX4:
        return []
    unknown = (
        [
            "home unknown: PX4 does not enforce an inclusion that home is outside of, or an exclusion that it is in (--home LAT,LON)"
        ]
        if situation.home is None
        else []
    )
    return unknown + [
        f"PX4 will not enforce {barrier.name}: {who} is {'outside' if barrier.kind is ZoneKind.INCLUSION else 'inside'} it; this route keeps to it anyway"
        for barrier, who in _unenforced(situation, ground)
    ]


def unenforced_zones(situation: Situation) -> list[tuple[str, str]]:
    """Return the zones that PX4 does not enforce, each with what is on its forbidden side: "home", or "the vehicle", which is armed.

    Nothing where the fence, or where those are, is not known, and for another autopilot.
    """
    if situation.ardupilot is not False or situation.fence is None:
        return []
    places = [known.value for known in (situation.home,) if known is not None]
    places += [situation.pose.value.position] if situation.pose is not None else []
    try:
        ground = ground_for(situation, known_vehicle(situation, GoTo()), places)
    except MissionError:
        return []
    return [(barrier.name, who) for barrier, who in _unenforced(situation, ground)]


def _unenforced(situation: Situation, ground: Ground) -> Iterator[tuple[Barrier, str]]:
    home = situation.home.value if situation.home is not None else None
    here = situation.pose.value.position if situation.armed and situation.pose is not None else None
    for barrier in ground.barriers:
        for place, who in ((home, "home"), (here, "the vehicle")):
            if place is None:
                continue
            is_inside = barrier.area.covers(Point(ground.frame.to_local(place)))
            if is_inside is (barrier.kind is ZoneKind.EXCLUSION):
                yield barrier, who
                break
