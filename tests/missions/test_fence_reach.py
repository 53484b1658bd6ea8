"""What is left out of a fence cannot bear on a vehicle inside it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod
from strategies import away

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.fence_reach import REACH_M, within_reach
from missions.geo import LatLon

GEOD = Geod(ellps="WGS84")
CENTRES = st.sampled_from(
    [LatLon(48.1, 11.5), LatLon(-33.4, 179.9995), LatLon(0.0, -180.0), LatLon(79.0, 15.0)]
)


def square(kind: ZoneKind, centre: LatLon, radius_m: float) -> PolygonZone:
    return PolygonZone(kind, tuple(away(centre, bearing, radius_m) for bearing in (45, 135, 225, 315)))


@given(CENTRES, st.floats(0, 360), st.floats(0, 30_000), st.sampled_from([5.0, 400.0]), st.booleans())
def test_what_is_near_stays_and_what_is_far_goes(centre, bearing, distance_m, size_m, is_circle):
    field = square(ZoneKind.INCLUSION, centre, 200.0)
    there = away(centre, bearing, distance_m)
    zone = (
        CircleZone(ZoneKind.EXCLUSION, there, size_m)
        if is_circle
        else square(ZoneKind.EXCLUSION, there, size_m)
    )
    kept, left_out = within_reach(Fence((field, zone)))
    assert len(kept.zones) + left_out == 2
    gap_m = GEOD.inv(centre.lon_deg, centre.lat_deg, there.lon_deg, there.lat_deg)[2] - 200.0 - size_m
    if gap_m < REACH_M:
        assert left_out == 0
    if gap_m > 2 * REACH_M:
        assert left_out == 1


def test_without_an_inclusion_everything_stays():
    zones = tuple(square(ZoneKind.EXCLUSION, LatLon(48.1 + i, 11.5), 50.0) for i in range(4))
    assert within_reach(Fence(zones)) == (Fence(zones), 0)
