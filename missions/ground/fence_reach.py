"""Which parts of a fence a vehicle can come near to."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from shapely import Polygon, box, make_valid

from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.geo import LatLon, wrap_lon_deg

REACH_M = 1_000.0
"""How far from its inclusions a vehicle may ever come; chosen."""

MOST_WIDE_DEG = 0.5
"""Exclusions that reach further are cut (55 km of latitude): at most 100 km from a fence's centre can be planned."""

_M_PER_DEG = 110_500.0  # of latitude, where it is least


class _Box(NamedTuple):
    """The least and the largest latitude and longitude of a zone, longitudes counted from an origin."""

    south: float
    north: float
    west: float
    east: float


def within_reach(fence: Fence) -> tuple[Fence, int, int]:
    """Return a fence without what is far from every inclusion, how many exclusions that left out and how many it cut.

    A vehicle that stays inside the inclusions never comes there; maps of whole countries hold thousands, and some wider than can be planned.
    """
    inclusions = [zone for zone in fence.zones if zone.kind is ZoneKind.INCLUSION]
    if not inclusions:
        return fence, 0, 0
    origin_deg = inclusions[0].places[0].lon_deg
    fields = [_box(zone, origin_deg, REACH_M) for zone in inclusions]
    near: list[Zone] = []
    left_out = cut = 0
    for zone in fence.zones:
        if zone.kind is ZoneKind.INCLUSION:
            near.append(zone)
        elif not any(_meet(_box(zone, origin_deg), field) for field in fields):
            left_out += 1
        elif isinstance(zone, PolygonZone) and is_wide(zone):
            near += _cut(zone, origin_deg, _around(fields))
            cut += 1
        else:
            near.append(zone)
    return replace(fence, zones=tuple(near)), left_out, cut


def is_wide(*zones: Zone) -> bool:
    """Return whether zones reach together over more than `MOST_WIDE_DEG`."""
    origin_deg = zones[0].places[0].lon_deg
    south, north, west, east = _around([_box(zone, origin_deg) for zone in zones])
    return max(north - south, east - west) > MOST_WIDE_DEG


def _cut(zone: PolygonZone, origin_deg: float, reach: _Box) -> list[Zone]:
    """Return what of an exclusion lies within reach of the inclusions; the vertices there are as they were."""
    lons = _lons(zone.vertices, origin_deg)
    # Rounded, for numbers like 1e-316 make GEOS lose whole triangles
    ring = [
        (round(lon, 12), round(place.lat_deg, 12)) for lon, place in zip(lons, zone.vertices, strict=True)
    ]
    inside = make_valid(Polygon(ring)).intersection(box(reach.west, reach.south, reach.east, reach.north))
    return [
        PolygonZone(
            zone.kind,
            tuple(LatLon(lat, wrap_lon_deg(lon + origin_deg)) for lon, lat in part.exterior.coords[:-1]),
        )
        for part in getattr(inside, "geoms", [inside])
        if isinstance(part, Polygon) and part.area > 0
    ]


def _lons(places: tuple[LatLon, ...], origin_deg: float) -> list[float]:
    """Return longitudes from an origin on, all on the same turn as the first."""
    first_deg = wrap_lon_deg(places[0].lon_deg - origin_deg)
    return [first_deg + wrap_lon_deg(place.lon_deg - places[0].lon_deg) for place in places]


def _box(zone: Zone, origin_deg: float, wider_m: float = 0.0) -> _Box:
    places = zone.places
    lats, lons = [place.lat_deg for place in places], _lons(places, origin_deg)
    lat_deg = (wider_m + (zone.radius_m if isinstance(zone, CircleZone) else 0.0)) / _M_PER_DEG
    furthest_deg = min(89.0, max(map(abs, lats)) + lat_deg)
    lon_deg = lat_deg / math.cos(math.radians(furthest_deg))
    return _Box(min(lats) - lat_deg, max(lats) + lat_deg, min(lons) - lon_deg, max(lons) + lon_deg)


def _around(boxes: list[_Box]) -> _Box:
    south, north, west, east = zip(*boxes, strict=True)
    return _Box(min(south), max(north), min(west), max(east))


def _meet(a: _Box, b: _Box) -> bool:
    is_beside = a.east < b.west or b.east < a.west
    return not is_beside and a.south <= b.north and b.south <= a.north
