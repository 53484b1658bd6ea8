"""A start inside the margin of a fence that the vehicle avoids: where measured rovers backed into it, or never moved.

Measured (docs/drive-model.md), 42 starts each 0.5 to 1.5 m from a fence of 2 m margin: of steered rovers 29 breached it backwards, 9 wandered
to the end, 4 arrived; of skid-steered ones 41 stood. Before 4.6 only 4 starts were measured (2 skid-steered that stood, a steered one that
backed into the fence, one that wandered): taken as since. With AVOID_BACKUP_SPD 0 all skid-steered and 5 of 6 steered ones left along it, all away
from it. From the margin and 0.05 m on all left as usual.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from shapely import Point

from missions.errors import StartBlockedError
from missions.fence import ZoneKind
from missions.vehicle import Steering

if TYPE_CHECKING:
    from missions.geo import LocalPoint
    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

LEAVES_FROM_M = 0.05
"""So much more than the margin, and measured rovers left as usual."""


def start_hazard(ground: Ground, start: LocalPoint, vehicle: Vehicle) -> StartBlockedError | str | None:
    """Return what a vehicle's avoidance does to it where it starts.

    Parameters
    ----------
    ground : Ground
        The fence, without seams.
    start : LocalPoint
        Where it starts.
    vehicle : Vehicle
        What starts.

    Returns
    -------
    StartBlockedError or str or None
        An error where it may back into the fence, a remark where it may not move, None where it leaves as usual. None on forbidden ground too.
    """
    if not vehicle.avoids_fence or not ground.allowed.covers(Point(start)):
        return None
    away_m, fence = nearest_avoided(ground, Point(start))
    leaves_from_m = vehicle.stops_within_m + LEAVES_FROM_M
    if away_m >= leaves_from_m:
        return None
    margin = f"{vehicle.fence.margin_name} {vehicle.stops_within_m:g} m plus {LEAVES_FROM_M:g} m"
    where = f"the start is {away_m:.2f} m from {fence}, where fence avoidance acts (within {margin})"
    advice = f"drive it at least {leaves_from_m:.2f} m away from the fence by hand, or set AVOID_BACKUP_SPD 0 or AVOID_ENABLE 0 until it is there"
    is_steered = vehicle.steering is Steering.ACKERMANN
    if vehicle.backs_away:
        there = (
            "the vehicle backs up there: in tests, rovers backed into the fence (29 of 42 starts, at any heading)"
            if is_steered
            else "in tests, skid-steered rovers did not move from there (41 of 42 starts)"
        )
        return StartBlockedError(
            f"{where}: {there}{_few_rows(vehicle)}",
            fences=[fence],
            distance_m=round(away_m, 3),
            margin_m=vehicle.stops_within_m,
            advice=advice,
        )
    along = (
        "with AVOID_BACKUP_SPD 0 rovers left it in tests, but 1 of 3 that had to drive along it did not move"
    )
    if is_steered or vehicle.has_measured_corners is not True:
        return f"{where}: {along if is_steered else 'skid-steered rovers left it with AVOID_BACKUP_SPD 0'}{_few_rows(vehicle)}"
    return None


def _few_rows(vehicle: Vehicle) -> str:
    """Return what is to be said of firmware before 4.6, or that may be."""
    return (
        "" if vehicle.has_measured_corners else "; only 4 of these starts were measured before ArduPilot 4.6"
    )


def nearest_avoided(ground: Ground, point: Point) -> tuple[float, str]:
    """Return the distance to what avoidance sees from a place, and its name: exclusions, and edges of inclusions around the place."""
    distances = [
        (
            float(
                (barrier.area if barrier.kind is ZoneKind.EXCLUSION else barrier.area.boundary).distance(
                    point
                )
            ),
            barrier.name,
        )
        for barrier in ground.barriers
        if not barrier.is_reported and (barrier.kind is ZoneKind.EXCLUSION or barrier.area.covers(point))
    ]
    return min(distances, default=(float("inf"), "no fence"))
