"""A map of the tests' own, and fences given in metres about a place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from pyproj import Proj
from shapely import LineString, Point
from strategies import GEOD, offset

from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.firmware import Firmware
from missions.geo import LatLon, rounded, wrap_lon_deg
from missions.situation import Known, Situation

HOME = LatLon(40.071374, -105.22993)
IN, OUT = ZoneKind.INCLUSION, ZoneKind.EXCLUSION
MERCATOR_TOLERANCE_M = 2e-3  # a transverse Mercator's stretch over some kilometres, and chords of the samples


def straight(a: LatLon, b: LatLon, pieces: int = 40) -> list[tuple[float, float]]:
    """Sample the autopilot's line: straight in latitude and longitude."""
    east_deg = wrap_lon_deg(b.lon_deg - a.lon_deg)
    return [
        (a.lat_deg + (b.lat_deg - a.lat_deg) * i / pieces, a.lon_deg + east_deg * i / pieces)
        for i in range(pieces + 1)
    ]


class Chart:
    """The test's own map: transverse Mercator about a place."""

    def __init__(self, centre: LatLon) -> None:
        self._proj = Proj(proj="tmerc", ellps="WGS84", lat_0=centre.lat_deg, lon_0=centre.lon_deg, k=1)

    def points(self, places: Sequence[tuple[float, float]]) -> np.ndarray:
        lat_lon = np.array(places)
        # Lists: older versions take an array of one for a number, and warn.
        return np.column_stack(self._proj(lat_lon[:, 1].tolist(), lat_lon[:, 0].tolist()))

    def line(self, path: Sequence[LatLon]) -> LineString:
        return LineString(self.points([place for a, b in pairwise(path) for place in straight(a, b)]))

    def zone_line(self, zone: PolygonZone) -> LineString:
        return self.line([*zone.vertices, zone.vertices[0]])

    def clearance_m(self, zone: Zone, path: Sequence[LatLon]) -> float:
        """Return a path's distance to where it must not be, negative (or 0) where it is there."""
        line = self.line(path)
        if isinstance(zone, CircleZone):
            centre = Point(self.points([zone.centre])[0])
            if zone.kind is OUT:
                return line.distance(centre) - zone.radius_m
            return zone.radius_m - max(centre.distance(Point(xy)) for xy in line.coords)
        inside = _even_odd(shapely.get_coordinates(self.zone_line(zone)), line.coords[0])
        return line.distance(self.zone_line(zone)) * (1 if inside == (zone.kind is IN) else -1)

    def fence_clearance_m(self, fence: Fence, path: Sequence[LatLon]) -> float:
        return min((self.clearance_m(zone, path) for zone in fence.zones), default=math.inf)


def _even_odd(ring: np.ndarray, point: tuple[float, float]) -> bool:
    a, b = ring[:-1], ring[1:]
    spans = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[spans], b[spans]
    return bool(
        (a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]) > point[0]).sum() % 2
    )


def length_m(path: Sequence[LatLon]) -> float:
    return sum(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(path))


def polygon(kind: ZoneKind, *east_north_m: tuple[float, float], origin: LatLon = HOME) -> PolygonZone:
    return PolygonZone(kind, tuple(rounded(offset(origin, *point)) for point in east_north_m))


def box(
    kind: ZoneKind, west_m: float, south_m: float, east_m: float, north_m: float, origin: LatLon = HOME
) -> PolygonZone:
    return polygon(
        kind, (west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m), origin=origin
    )


def place(east_m: float, north_m: float, origin: LatLon = HOME) -> LatLon:
    return rounded(offset(origin, east_m, north_m))


def situation_of(*zones: Zone, **parameters: float) -> Situation:
    return Situation(
        fence=Known(Fence(zones), None, "test"),
        parameters=parameters,
        firmware=Firmware(4, 6),
        home=Known(HOME, None, "test"),
    )


FIELD = box(IN, -100, -100, 100, 100)
WALL = box(OUT, -5, -80, 5, 60)
