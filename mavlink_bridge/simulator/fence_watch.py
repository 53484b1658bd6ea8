"""The fence as the rover sees it: where forbidden ground begins."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import shapely
from shapely.geometry import Point, Polygon, box

from missions.fence import CircleZone, Fence, Zone, ZoneKind, fence_from_items

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.items import MissionItem

_FAR_M = 1e6  # farther than any fence: stands for no edge at all
_ROUNDED_M = 1e-6  # more than distances are rounded by
_CIRCLE_SEGMENTS = 64  # chords a quarter turn: they leave a 50 m circle by 4 mm


class Plane(Protocol):
    """A flat frame."""

    def to_flat(self, position: LatLon) -> complex:
        """Return a position in metres, north + east·j."""
        ...


class FenceArea:
    """The ground a fence forbids, in a flat frame.

    Parameters
    ----------
    items : sequence of MissionItem
        The fence as the vehicle holds it.
    plane : Plane
        The frame; points below are in it.
    union : bool
        Whether one inclusion is enough (FENCE_OPTIONS value 2); otherwise all must hold.
    home_circle : tuple of complex and float, optional
        Centre and radius of the circle round home that must not be left.
    """

    def __init__(
        self,
        items: Sequence[MissionItem],
        plane: Plane,
        *,
        union: bool = False,
        home_circle: tuple[complex, float] | None = None,
    ) -> None:
        self._forbidden = _forbidden(bounded_fence(items), plane, union=union, home_circle=home_circle)
        self._edge = self._forbidden.boundary
        shapely.prepare(self._forbidden)
        shapely.prepare(self._edge)
        self._measured = 0j, -math.inf

    @property
    def is_empty(self) -> bool:
        """Whether nothing is forbidden."""
        return bool(self._forbidden.is_empty)

    def clearance_m(self, point_m: complex) -> float:
        """Return the distance to forbidden ground; inside it, minus the distance to its edge; infinite without a fence."""
        if self.is_empty:
            return math.inf
        point = Point(point_m.real, point_m.imag)
        distance_m = float(shapely.distance(self._edge, point))
        clearance_m = -distance_m if self._forbidden.contains(point) else distance_m
        self._measured = point_m, clearance_m
        return clearance_m

    def is_beyond(self, least_m: float, point_m: complex) -> bool:
        """Return whether a point's clearance is known to be more, near where it was measured last: then it need not be measured."""
        measured_at_m, clearance_m = self._measured
        return clearance_m - abs(point_m - measured_at_m) > least_m + _ROUNDED_M


def bounded_fence(items: Sequence[MissionItem]) -> Fence:
    """Return the fence that items are, with no circle beyond what shapely takes; ArduPilot takes an infinite one."""
    return fence_from_items(
        [replace(item, params=(min(item.params[0], _FAR_M), *item.params[1:])) for item in items]
    )


def _forbidden(
    fence: Fence, plane: Plane, *, union: bool, home_circle: tuple[complex, float] | None
) -> BaseGeometry:
    exclusions: list[BaseGeometry] = []
    inclusions: list[BaseGeometry] = []
    for zone in fence.zones:
        shape = _shape(zone, plane)
        (inclusions if zone.kind is ZoneKind.INCLUSION else exclusions).append(shape)
    allowed: list[BaseGeometry] = []
    if inclusions:
        allowed = [shapely.union_all(inclusions)] if union else inclusions
    if home_circle is not None:
        centre_m, radius_m = home_circle
        allowed = [*allowed, Point(centre_m.real, centre_m.imag).buffer(radius_m, _CIRCLE_SEGMENTS)]
    everywhere = box(-_FAR_M, -_FAR_M, _FAR_M, _FAR_M)
    outside = [everywhere.difference(area) for area in allowed]
    return shapely.union_all([*outside, *exclusions])


def _shape(zone: Zone, plane: Plane) -> BaseGeometry:
    if isinstance(zone, CircleZone):
        centre_m = plane.to_flat(zone.centre)
        return Point(centre_m.real, centre_m.imag).buffer(zone.radius_m, _CIRCLE_SEGMENTS)
    points_m = [plane.to_flat(vertex) for vertex in zone.vertices]
    # make_valid on the ring's lines is the even-odd rule, by which ArduPilot tests self-crossing polygons.
    return shapely.make_valid(Polygon([(point_m.real, point_m.imag) for point_m in points_m]))
