"""Which zones of a fence a vehicle can come near to."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from missions.fence import CircleZone, Fence, Zone, ZoneKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from missions.geo import LatLon

_M_PER_DEG = 111_320.0
REACH_M = 1_000.0
"""How far from its inclusions a vehicle may ever come; chosen."""


def within_reach(fence: Fence) -> tuple[Fence, int]:
    """Return a fence without the exclusions that are far from every inclusion, and how many those are.

    A vehicle that stays inside the inclusions never comes there; maps of whole countries hold thousands.
    """
    fields = [_bounds(zone, REACH_M) for zone in fence.zones if zone.kind is ZoneKind.INCLUSION]
    if not fields:
        return fence, 0
    near = tuple(
        zone
        for zone in fence.zones
        if zone.kind is ZoneKind.INCLUSION or any(_meet(_bounds(zone), field) for field in fields)
    )
    return replace(fence, zones=near), len(fence.zones) - len(near)


_Bounds = tuple[float, float, float, float]


def _bounds(zone: Zone, wider_m: float = 0.0) -> _Bounds:
    """Return the least and the largest latitude and longitude of a zone."""
    if isinstance(zone, CircleZone):
        places: Iterable[LatLon] = (zone.centre,)
        wider_m += zone.radius_m
    else:
        places = zone.vertices
    lats, lons = zip(*places, strict=True)
    lat_deg = wider_m / _M_PER_DEG * 1.01  # degrees of latitude are up to 0.6 % shorter than that
    lon_deg = lat_deg / max(0.01, math.cos(math.radians(max(map(abs, lats)))))
    if max(lons) - min(lons) > 180:  # across the antimeridian
        lons = tuple(lon % 360 for lon in lons)
    return min(lats) - lat_deg, max(lats) + lat_deg, min(lons) - lon_deg, max(lons) + lon_deg


def _meet(a: _Bounds, b: _Bounds) -> bool:
    """Return whether two boxes meet; longitudes may differ by whole turns."""
    shift = 360 * round((a[2] + a[3] - b[2] - b[3]) / 720)
    return a[0] <= b[1] and b[0] <= a[1] and a[2] - shift <= b[3] and b[2] <= a[3] - shift
