"""One inclusion polygon in the place of several that overlap: what a vehicle enforces without seams and without a union."""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely
from shapely import Polygon

from missions.errors import FenceError
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.geo import LocalPoint, rounded
from missions.ground.frame import frame_around
from missions.ground.ground import lay_out

if TYPE_CHECKING:
    from shapely import LinearRing
    from shapely.geometry.base import BaseGeometry

    from missions.ground.frame import LocalFrame
    from missions.ground.ground import Barrier

# Off the edges of what is merged: simplifying, degE7 (8 mm) and the bow of long edges never leave more ground than was drawn.
_RESERVE_M = 0.02
_SIMPLER_M = 0.005


def merged_fence(fence: Fence) -> Fence:
    """Return a fence with its overlapping inclusions joined to one polygon, 2 cm inside them; exclusions stay as they are.

    Ground that the inclusions go around becomes an exclusion. A fence with one inclusion or none stays as it is.

    Raises
    ------
    FenceError
        The inclusions do not overlap to one area; the message says which lie apart, and how far.
    """
    numbers = [number for number, zone in enumerate(fence.zones) if zone.kind is ZoneKind.INCLUSION]
    if len(numbers) < 2:
        return fence
    frame = frame_around(fence.places)
    drawn = lay_out(fence, frame, union=True)
    inside = drawn.keep_in.buffer(-_RESERVE_M, join_style="mitre").simplify(_SIMPLER_M)
    if not isinstance(inside, Polygon) or inside.is_empty:
        raise _apart(inside, [drawn.barriers[number] for number in numbers])
    outer = _zone(ZoneKind.INCLUSION, inside.exterior, frame)
    holes = [_zone(ZoneKind.EXCLUSION, ring, frame) for ring in inside.interiors]
    zones = [zone for number, zone in enumerate(fence.zones) if number not in numbers]
    merged = Fence((outer, *zones, *holes), fence.return_point)
    if not drawn.allowed.covers(lay_out(merged, frame).allowed):
        raise FenceError(
            "the merged fence would allow ground that the inclusions do not. This is a bug, please report it"
        )
    return merged


def _zone(kind: ZoneKind, ring: LinearRing, frame: LocalFrame) -> PolygonZone:
    return PolygonZone(
        kind, tuple(rounded(frame.to_lat_lon(LocalPoint(*corner))) for corner in ring.coords[:-1])
    )


def _apart(inside: BaseGeometry, inclusions: list[Barrier]) -> FenceError:
    """Return the error that says which inclusions lie in another area than the first."""
    parts = shapely.get_parts(inside)
    if inside.is_empty:
        return FenceError("the inclusions have no area: there is no allowed area")
    first = next((part for part in parts if part.intersects(inclusions[0].area)), parts[0])
    others = [zone.name for zone in inclusions if not zone.area.intersects(first)]
    names = ", ".join(others) or "one of them"
    distance_m = float(shapely.union_all([part for part in parts if part is not first]).distance(first))
    return FenceError(
        f"the inclusions form {len(parts)} separate areas, {distance_m:.2f} m apart: {names} and {inclusions[0].name}; "
        "a vehicle can be in one area only: draw them so that they overlap, or leave one out",
        zones=others,
        distance_m=round(distance_m, 3),
    )
