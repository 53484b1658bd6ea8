"""Random places, fences and fields for tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hypothesis import strategies as st
from pyproj import Geod

from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.geo import LatLon, rounded

GEOD = Geod(ellps="WGS84")

lats_deg = st.floats(-85, 85)
lons_deg = st.floats(-180, 180)
lat_lons = st.builds(LatLon, lats_deg, lons_deg)
wire_lat_lons = st.builds(
    lambda lat_e7, lon_e7: LatLon(lat_e7 / 1e7, lon_e7 / 1e7),
    st.integers(-850_000_000, 850_000_000),
    st.integers(-1_800_000_000, 1_800_000_000),
)
kinds = st.sampled_from(ZoneKind)


def away(origin: LatLon, bearing_deg: float, distance_m: float) -> LatLon:
    """Return the place at a bearing and a geodesic distance, by Geod alone."""
    lon_deg, lat_deg, _ = GEOD.fwd(origin.lon_deg, origin.lat_deg, bearing_deg, distance_m)
    return LatLon(lat_deg, lon_deg)


def offset(origin: LatLon, east_m: float, north_m: float) -> LatLon:
    """Return the place so far east and north (as bearing and distance) of another."""
    return away(origin, math.degrees(math.atan2(east_m, north_m)), math.hypot(east_m, north_m))


@st.composite
def zones(draw: st.DrawFn) -> Zone:
    """Any zone the autopilot could hold, of degE7 positions."""
    kind = draw(kinds)
    if draw(st.booleans()):
        return PolygonZone(kind, tuple(draw(st.lists(wire_lat_lons, min_size=3, max_size=8))))
    return CircleZone(kind, draw(wire_lat_lons), draw(st.floats(0.5, 5000, width=32)))


fences = st.builds(Fence, st.lists(zones(), max_size=6).map(tuple), st.none() | wire_lat_lons)


@dataclass(frozen=True)
class RandomField:
    """A fence in a field of a size, and two places in it."""

    fence: Fence
    start: LatLon
    target: LatLon
    clearance_m: float


@st.composite
def random_fields(draw: st.DrawFn) -> RandomField:
    """A field of inclusions and exclusions somewhere on Earth, with a start and a target on opposite sides."""
    centre = rounded(
        LatLon(
            draw(st.sampled_from([0.0, 40.07, -33.4, 61.5, -77.0, 84.5])),
            draw(st.sampled_from([-105.23, 0.0, 179.9999, 24.8])),
        )
    )
    size_m = draw(st.sampled_from([40.0, 120.0, 400.0, 3000.0]))

    def place(reach: float) -> LatLon:
        return rounded(offset(centre, *(draw(st.floats(-reach, reach)) * size_m for _ in range(2))))

    found: list[Zone] = []
    if draw(st.integers(0, 3)):
        ring = [
            rounded(away(centre, 360 * i / 7 + draw(st.floats(-20, 20)), size_m * draw(st.floats(0.6, 1.1))))
            for i in range(draw(st.integers(5, 7)))
        ]
        found.append(PolygonZone(ZoneKind.INCLUSION, tuple(ring)))
    if not draw(st.integers(0, 3)):
        found.append(CircleZone(ZoneKind.INCLUSION, place(0.1), size_m * draw(st.floats(0.7, 1.2))))
    for _ in range(draw(st.integers(1, 5))):
        if draw(st.booleans()):
            found.append(CircleZone(ZoneKind.EXCLUSION, place(0.5), size_m * draw(st.floats(0.02, 0.2))))
        else:  # any order of corners: rings that cross themselves too
            ring = [place(0.5) for _ in range(draw(st.integers(3, 6)))]
            found.append(PolygonZone(ZoneKind.EXCLUSION, tuple(ring)))
    return RandomField(
        Fence(tuple(found)),
        rounded(offset(centre, -0.4 * size_m, draw(st.floats(-0.3, 0.3)) * size_m)),
        rounded(offset(centre, 0.4 * size_m, draw(st.floats(-0.3, 0.3)) * size_m)),
        draw(st.sampled_from([0.0, 0.5, 1.0, 2.5, 5.0])),
    )
