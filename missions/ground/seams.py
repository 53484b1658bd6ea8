"""Seams: edges of inclusions that lie inside their union, which ArduPilot's avoidance takes for walls all the same.

With FENCE_OPTIONS bit 1 one inclusion is enough to be allowed, but avoidance and path planning look at each one by itself: a rover inside
a polygon stops before its edge, whatever lies beyond. Measured (docs/drive-model.md): none of 65 runs passed a seam with AVOID_ENABLE
bit 0, none of 30 with OA_TYPE 1 or 2; all 17 with both off, and all 15 with a margin of 0.05 m and less.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import shapely
from shapely import LineString, Point, Polygon

from missions.fence import ZoneKind
from missions.ground.ground import Barrier
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from missions.ground.ground import Ground
    from missions.vehicle import Vehicle

_WALL_M = 1e-3
"""Half a seam's width as an obstacle."""

_PASSES_WITHIN_M = 0.05
"""With this margin and less measured rovers crept across; with 0.1 m none did."""

AVOIDANCE_OFF_COSTS = (
    "then nothing brakes it before the fence: in tests it drove 4 m beyond at 2 m/s, 10 to 15 m at 5 m/s"
)
"""Measured with AVOID_ENABLE 0 and each FENCE_ACTION but LOITER: 4.2 to 4.9 m beyond the edge at 2 m/s, 10.5 to 14.8 m at 5 m/s."""

_NAME = "the inner edge of "


def is_seam(name: str) -> bool:
    """Return whether a zone's name is that of a seam."""
    return name.startswith(_NAME)


class Seam(NamedTuple):
    """An inclusion's edge inside the union: its name, the line, and the ground on which the vehicle stops before it."""

    name: str
    line: BaseGeometry
    stops_on: BaseGeometry


def stops_at_seams(vehicle: Vehicle) -> bool:
    """Return whether a vehicle stops before the seams of its fence."""
    if vehicle.autopilot is not Autopilot.ARDUPILOT:
        return False
    fence = vehicle.fence
    if not (fence.union and fence.enforces_zones):
        return False
    return bool(vehicle.oa_type) or (vehicle.avoids_fence and fence.margin_m > _PASSES_WITHIN_M)


def seams_of(ground: Ground, vehicle: Vehicle) -> tuple[Seam, ...]:
    """Return the seams at which the vehicle stops."""
    inclusions = [barrier for barrier in ground.barriers if barrier.kind is ZoneKind.INCLUSION]
    if not stops_at_seams(vehicle) or not ground.union or len(inclusions) < 2:
        return ()
    rim = ground.keep_in.boundary.buffer(_WALL_M)
    found = []
    for barrier in inclusions:
        line = barrier.area.boundary.difference(rim)
        if not line.is_empty:
            reach_m = max(vehicle.stops_within_m, _WALL_M)
            found.append(
                Seam(f"{_NAME}{barrier.name}", line, line.buffer(reach_m).intersection(barrier.area))
            )
    return tuple(found)


def with_seams(ground: Ground, vehicle: Vehicle) -> Ground:
    """Return the ground with its seams as obstacles, for routes: one that crosses none is found where there is one."""
    seams = seams_of(ground, vehicle)
    if not seams:
        return ground
    # The ends reach into the rim that was taken off, so that no gap is left there.
    walls = [
        Barrier(seam.name, ZoneKind.EXCLUSION, _area(seam.line.buffer(3 * _WALL_M, cap_style="square")))
        for seam in seams
    ]
    return replace(ground, barriers=(*ground.barriers, *walls))


def first_stop(seams: tuple[Seam, ...], shape: BaseGeometry) -> tuple[str, Point] | None:
    """Return the first seam before which a vehicle stops that drives along a shape, and where; None without one."""
    stops = []
    for seam in seams:
        there = shape.intersection(seam.stops_on)
        if there.is_empty:
            continue
        if isinstance(shape, LineString):
            along_m = min(shape.project(Point(place)) for place in shapely.get_coordinates(there))
            stops.append((along_m, seam.name, Point(shape.interpolate(along_m))))
        else:
            stops.append((0.0, seam.name, there.representative_point()))
    if not stops:
        return None
    _, name, place = min(stops, key=lambda stop: stop[:2])
    return name, place


def seam_advice(vehicle: Vehicle) -> str:
    """Return what would take the vehicle across."""
    what = []
    if vehicle.avoid_bits & 1:
        what.append(f"AVOID_ENABLE {vehicle.avoid_bits & ~1} (without bit 0)")
    if vehicle.oa_type:
        what.append("OA_TYPE 0")
    cost = f" ({AVOIDANCE_OFF_COSTS})" if vehicle.avoid_bits & 1 else ""
    return (
        "merge the inclusions into one polygon (`pbpp fence merge FILE -o merged.plan`, then `pbpp upload merged.plan`), "
        f"or set {' and '.join(what)}{cost}"
    )


def seam_reason(vehicle: Vehicle) -> str:
    """Return why the vehicle does not pass."""
    if vehicle.oa_type:
        return f"with OA_TYPE {vehicle.oa_type} the vehicle does not cross from one inclusion into another"
    return (
        f"with AVOID_ENABLE {vehicle.avoid_bits} (bit 0) the vehicle stops {vehicle.fence.margin_name} {vehicle.stops_within_m:g} m "
        "before the edge of its inclusion and does not resume, although FENCE_OPTIONS bit 1 joins it to others"
    )


def _area(shape: BaseGeometry) -> shapely.MultiPolygon:
    return shapely.MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, Polygon)])
