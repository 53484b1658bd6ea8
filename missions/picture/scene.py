"""What every picture of a plan shows, in local metres, east then north: the same for images, HTML and the terminal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Polygon

import pbpp
from missions.fence import ZoneKind
from missions.geo import LocalPoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.planned import Plan

_BORDER_SHARE = 0.06  # white around the drawing
_MOST_BLOCKS = 5000  # more cannot be told apart
_SCALE_STEPS_M = tuple(step * 10**power for power in range(5) for step in (1, 2, 5))


@dataclass(frozen=True, eq=False)
class Scene:
    """What a picture shows.

    Parameters
    ----------
    plan : Plan
        What was planned.
    driven : sequence of LatLon
        Where the vehicle drove, if it did.
    """

    plan: Plan
    driven: Sequence[LatLon] = ()

    @cached_property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """West, south, east, north: the fence's zones and the lines, with a border.

        The home circle, which may be vast, is seen as far as it reaches into that.
        """
        shapes = [zone.area for zone in self.plan.ground.barriers[: len(self.plan.fence.zones)]]
        points = shapely.MultiPoint(np.concatenate((self.route, self.track)))
        west, south, east, north = shapely.union_all([*shapes, points]).bounds
        border_m = max(1.0, _BORDER_SHARE * max(east - west, north - south))
        return west - border_m, south - border_m, east + border_m, north + border_m

    @cached_property
    def frame(self) -> Polygon:
        """The picture's rectangle."""
        return shapely.box(*self.bounds_m)

    @cached_property
    def route(self) -> NDArray[np.float64]:
        """The drawn lines, (n, 2)."""
        return self.plan.ground.frame.to_local_array(self.plan.path)

    @cached_property
    def targets(self) -> NDArray[np.float64]:
        """The targets in order, (t, 2)."""
        return self.plan.ground.frame.to_local_array(self.plan.targets)

    @cached_property
    def track(self) -> NDArray[np.float64]:
        """Where the vehicle drove, (d, 2)."""
        return self.plan.ground.frame.to_local_array(self.driven)

    @property
    def outside(self) -> BaseGeometry:
        """What lies outside the inclusions."""
        return self.frame.difference(self.plan.ground.keep_in)

    @property
    def has_inclusion(self) -> bool:
        """Whether the fence keeps the vehicle in."""
        return any(zone.kind is ZoneKind.INCLUSION for zone in self.plan.ground.barriers)

    @property
    def inner_edges(self) -> BaseGeometry:
        """The edges of inclusions that are no edge of what is allowed: inside the union, or beyond another inclusion."""
        ground = self.plan.ground
        edges = [zone.area.boundary for zone in ground.barriers if zone.kind is ZoneKind.INCLUSION]
        return (
            shapely.union_all(edges).difference(ground.keep_in.boundary.buffer(0.01)).intersection(self.frame)
        )

    @property
    def margin(self) -> BaseGeometry:
        """The allowed ground that is nearer to a fence than the drawn lines ever come."""
        margin_m = self.plan.drawn_clearance_m
        if not (math.isfinite(margin_m) and margin_m > 0):
            return Polygon()
        return self.plan.ground.edge.buffer(margin_m).intersection(self.plan.ground.allowed)

    @property
    def exclusions(self) -> BaseGeometry:
        """The ground that is kept out of."""
        return shapely.union_all(self.plan.ground.areas(ZoneKind.EXCLUSION))

    @property
    def envelope(self) -> BaseGeometry:
        """The band that the vehicle is predicted to stay in."""
        return self.plan.envelope.area.intersection(self.frame)

    @property
    def leg_clearances_m(self) -> list[float]:
        """The least distance of each drawn leg to a fence, infinite without a fence."""
        legs = zip(self.route[:-1], self.route[1:], strict=True)
        return [self.plan.ground.clearance_m(LineString(leg)) for leg in legs]

    def blocks(self) -> list[NDArray[np.float64]]:
        """Return the corners of the blocks of the free space at the drawn clearance; none where there are too many to see."""
        ground, plan = self.plan.ground, self.plan
        clearance_m = 0.99 * plan.drawn_clearance_m if math.isfinite(plan.drawn_clearance_m) else 0.0
        areas = ground.areas(ZoneKind.INCLUSION), ground.areas(ZoneKind.EXCLUSION)
        target = LocalPoint(*self.targets[-1].tolist())
        try:
            planner = pbpp.Planner(*areas, clearance_m=clearance_m, union=ground.union)
            drawing = planner.plan(target, target, method=plan.method).drawing
        except pbpp.PlanningError:  # a picture without blocks is better than none
            return []
        partition = drawing.field.slabs if drawing.partition == "slabs" else drawing.field.blocks
        if len(partition) > _MOST_BLOCKS:
            return []
        origin_m = drawing.field.scene.origin_m
        return [partition.outline(block) + origin_m for block in range(len(partition))]

    def title(self) -> str:
        """Return the title: how long the route is and what it keeps."""
        plan = self.plan
        drawn = (
            f", clearance {plan.drawn_clearance_m:.2f} m drawn"
            if math.isfinite(plan.drawn_clearance_m)
            else ""
        )
        promised = "" if plan.clearance_m is None else f", {plan.clearance_m:g} m promised while driving"
        extrapolated = ", extrapolated" if plan.extrapolated else ""
        return f"{plan.length_m:.1f} m, about {plan.duration_s:.0f} s{drawn}{promised}{extrapolated}"

    def scale_m(self, share: float = 0.2) -> int:
        """Return a round length of at most a share of the picture's width."""
        width_m = self.bounds_m[2] - self.bounds_m[0]
        return max((step for step in _SCALE_STEPS_M if step <= share * width_m), default=1)


def polygons(area: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a geometry, outer rings counter-clockwise and holes clockwise."""
    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and not part.is_empty]
    return list(shapely.orient_polygons(parts)) if parts else []
