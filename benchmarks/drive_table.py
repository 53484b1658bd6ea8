"""Vehicles over the whole table of parameters for the drive benchmark, each from a seed, on the fields of `drive_fields` and `drive_more_fields`."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING

import shapely
from drive_fields import CENTRE, make_field, polygon_zone
from drive_more_fields import make_more

from missions.fence import Fence, PolygonZone, ZoneKind
from missions.ground.frame import frame_around

if TYPE_CHECKING:
    from drive_fields import Field

SPEEDS_MPS = (0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0)
MARGINS_M = (0.0, 0.5, 2.0, 5.0)
SKID_TOP_MPS = 3.0
"""The simulated skid-steered body reaches 4 m/s; ArduPilot's too."""

OVERLAP_M = 6.0


def make_case(seed: int) -> tuple[Field, str, dict[str, float]]:
    """Return a field, and a vehicle by its words and its parameters."""
    rng = random.Random(f"table {seed}")
    field = make_field(seed // 2) if seed % 2 else make_more(seed // 2)
    is_skid = rng.random() < 0.4
    speed_mps = rng.choice([one for one in SPEEDS_MPS if one <= SKID_TOP_MPS or not is_skid])
    radius_m, turn_radius_m = rng.uniform(0.5, 4.0), rng.uniform(0.5, 4.0)
    margin_m, xy_m = rng.choice(MARGINS_M), rng.choice((0.0, 0.0, 0.5, 2.0))
    avoids, jerk, zones = (
        rng.random() < 0.6,
        rng.choice((0.0, 0.5, 2.0)),
        rng.choice(("one", "one", "both", "any")),
    )
    pivot_deg = rng.choice((0.0, 60.0))
    parameters = {
        "WP_SPEED": speed_mps,
        "WP_RADIUS": radius_m,
        "TURN_RADIUS": turn_radius_m,
        "WP_PIVOT_ANGLE": pivot_deg,
        "WP_JERK": jerk,
        "FENCE_MARGIN": margin_m,
        "FENCE_OPTIONS": 2.0 if zones == "any" else 0.0,
        "AVOID_ENABLE": 3.0 if avoids else 0.0,
        "CRUISE_SPEED": 5.0,
        "CRUISE_THROTTLE": 30.0,
    }
    if xy_m:
        parameters["FENCE_MARGIN_XY"] = xy_m
    if is_skid:
        parameters |= {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0, "ATC_STR_RAT_FF": 0.2}
        parameters |= {"CRUISE_SPEED": 3.0, "CRUISE_THROTTLE": 75.0}
    words = (
        f"{'skid' if is_skid else 'steered'} {speed_mps:g} m/s, WP_RADIUS {radius_m:.1f}, TURN_RADIUS {turn_radius_m:.1f}, pivot {pivot_deg:g}, "
        f"margin {margin_m:g}, XY {xy_m:g}, avoidance {'on' if avoids else 'off'}, WP_JERK {jerk:g}, inclusions {zones}"
    )
    return replace(field, fence=_with_inclusions(field, zones)), words, parameters


def _with_inclusions(field: Field, zones: str) -> Fence:
    """Return the fence with its inclusion once, within a larger one, or as the union of two that overlap."""
    if zones == "one":
        return field.fence
    frame = frame_around([CENTRE])
    outline = next(
        zone
        for zone in field.fence.zones
        if isinstance(zone, PolygonZone) and zone.kind is ZoneKind.INCLUSION
    )
    others = tuple(zone for zone in field.fence.zones if zone is not outline)
    ring = shapely.Polygon(frame.to_local_array(outline.vertices))
    if zones == "both":
        wider = polygon_zone(frame, ZoneKind.INCLUSION, ring.convex_hull.buffer(12.0, join_style="mitre"))
        return Fence((outline, wider, *others))
    west, south, east, north = ring.bounds
    middle = (west + east) / 2
    halves = [
        ring.intersection(shapely.box(*box))
        for box in (
            (west, south, middle + OVERLAP_M / 2, north),
            (middle - OVERLAP_M / 2, south, east, north),
        )
    ]
    if not all(isinstance(half, shapely.Polygon) for half in halves):
        return field.fence  # a ring that is cut into more than two stays one
    return Fence((*(polygon_zone(frame, ZoneKind.INCLUSION, half) for half in halves), *others))
