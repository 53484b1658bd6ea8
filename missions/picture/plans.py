"""What a picture of a plan shows."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

import pbpp
from missions.fence import ZoneKind
from missions.geo import distance_m
from missions.ground.legs import ROUNDING_RESERVE_M
from missions.picture.scene import Mark, PictureScene, TrackLine, crossings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.planned import Plan

_MOST_BLOCKS = 5000  # more cannot be told apart
_MOST_NAMED = 3  # legs in a title; chosen


def plan_scene(
    plan: Plan,
    *,
    track: Sequence[LatLon] = (),
    title: str | None = None,
    unsafe: Mapping[int, LatLon | None] | None = None,
    blocks: bool = False,
) -> PictureScene:
    """Return the scene of a plan.

    Parameters
    ----------
    plan : Plan
        What was planned.
    track : sequence of LatLon
        Where the vehicle drove, if it did.
    title : str, optional
        Its lines. Default: length, time and clearance.
    unsafe : mapping of int to LatLon or None, optional
        The legs that a check found unsafe, counted from 0, each with the place. Default: the legs that cross the fence.
    blocks : bool
        Whether the blocks of the free space are shown too.
    """
    local = plan.ground.frame.to_local_array
    route = local(plan.path)
    legs = [shapely.LineString(leg) for leg in pairwise(route)]
    crossing = tuple(number for number, leg in enumerate(legs) if not plan.ground.allowed.covers(leg))
    found = crossing if unsafe is None else tuple(unsafe)
    crossed = crossings(legs, tuple(number for number in found if number in crossing), plan.ground.allowed)
    near = [place for number, place in (unsafe or {}).items() if place and number not in crossing]
    arrivals_s = plan.envelope.arrivals_s
    moved = [
        None if distance_m(asked, reached) <= ROUNDING_RESERVE_M else asked
        for asked, reached in zip(plan.asked_targets or plan.targets, plan.targets, strict=True)
    ]
    return PictureScene(
        title=tuple(title.split("\n")) if title else plan_title(plan, crossing),
        ground=plan.ground,
        zone_count=len(plan.fence.zones),
        clearance_m=plan.drawn_clearance_m if plan.clearance_m is None else plan.clearance_m,
        route=route,
        numbers=(None, *plan.seqs[1:]),
        point_texts=tuple(
            f"{f'waypoint {number}' if number else 'start'}\n{position}\nafter {arrival_s:.0f} s"
            for number, position, arrival_s in zip(plan.seqs, plan.path, arrivals_s, strict=True)
        ),
        unsafe_legs=found,
        marks=tuple(Mark(point) for point in (*crossed, *local(near))),
        band=plan.envelope.area,
        start=route[0],
        targets=local(plan.targets),
        asked=np.array([(math.nan, math.nan) if at is None else local([at])[0] for at in moved]).reshape(
            -1, 2
        ),
        tracks=(TrackLine("driven", local(track)),) if len(track) else (),
        blocks=tuple(_blocks(plan)) if blocks else (),
        marks_narrowest=True,
    )


def plan_title(plan: Plan, crossing: tuple[int, ...]) -> tuple[str, ...]:
    """Return the title: how long the route is, what it keeps, and which legs alone are not safe."""
    extrapolated = ", extrapolated" if plan.extrapolated else ""
    length = f"{plan.length_m:.1f} m, about {plan.duration_s:.0f} s{extrapolated}"
    drawn_m = plan.drawn_clearance_m
    if crossing:
        if len(crossing) > _MOST_NAMED:
            return length, f"{len(crossing)} legs are unsafe: they cross the fence"
        names = ", ".join(str(leg + 1) for leg in crossing)
        others_m = [m for leg, m in enumerate(leg_clearances_m(plan)) if leg > max(crossing)]
        along = f"{min(others_m):.2f} m along straight legs" if others_m else ""
        if along and plan.clearance_m is not None:
            along = f"at least {plan.clearance_m:g} m while driving ({along})"
        kept = f"; the others keep {along}" if along else ""
        return length, f"only leg {names} is unsafe: it begins {_begins(plan)}{kept}"
    if not math.isfinite(drawn_m):
        return (f"{length}, no fence near",)
    along = f"{drawn_m:.2f} m along straight legs"
    if plan.clearance_m is None:
        return length, f"fence clearance: {along}, none promised while driving"
    kept = f"fence clearance: at least {plan.clearance_m:g} m while driving"
    if plan.start_clearance_m is not None:  # the straight legs count the start's too
        return length, f"{kept}, but {plan.start_clearance_m:g} m at the start"
    return length, f"{kept} ({along})"


def leg_clearances_m(plan: Plan) -> list[float]:
    """Return the least distance of each drawn leg to a fence, infinite without a fence."""
    route = plan.ground.frame.to_local_array(plan.path)
    return [plan.ground.clearance_m(shapely.LineString(leg)) for leg in pairwise(route)]


def _begins(plan: Plan) -> str:
    """Return on which forbidden ground a route begins."""
    zones = plan.ground.forbidding(shapely.Point(plan.ground.frame.to_local(plan.path[0])))
    sides = {ZoneKind.EXCLUSION: "inside", ZoneKind.INCLUSION: "outside"}
    return (
        " and ".join(f"{sides[zone.kind]} {zone.name}" for zone in zones)
        or "on allowed ground and crosses the fence"
    )


def _blocks(plan: Plan) -> list[NDArray[np.float64]]:
    """Return the corners of the blocks of the free space at the drawn clearance; none where there are too many to see."""
    ground = plan.ground
    clearance_m = 0.99 * plan.drawn_clearance_m if math.isfinite(plan.drawn_clearance_m) else 0.0
    areas = ground.areas(ZoneKind.INCLUSION), ground.areas(ZoneKind.EXCLUSION)
    target = ground.frame.to_local(plan.targets[-1])
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
