"""What is left out of a fence cannot bear on a vehicle inside it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod
from shapely import Polygon
from strategies import away

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon
from missions.ground.fence_reach import REACH_M, is_wide, within_reach

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
    kept, left_out, cut = within_reach(Fence((field, zone)))
    assert (len(kept.zones) + left_out, cut) == (2, 0)
    gap_m = GEOD.inv(centre.lon_deg, centre.lat_deg, there.lon_deg, there.lat_deg)[2] - 200.0 - size_m
    if gap_m < REACH_M:
        assert left_out == 0
    if gap_m > 2 * REACH_M:
        assert left_out == 1


def test_without_an_inclusion_everything_stays():
    zones = tuple(square(ZoneKind.EXCLUSION, LatLon(48.1 + i, 11.5), 50.0) for i in range(4))
    assert within_reach(Fence(zones)) == (Fence(zones), 0, 0)


@given(CENTRES.filter(lambda centre: centre.lat_deg < 70), st.floats(0, 360), st.floats(0, 300.0))
def test_of_a_wide_exclusion_the_part_within_reach_is_left_as_it_was(centre, bearing, distance_m):
    field = square(ZoneKind.INCLUSION, centre, 200.0)
    corner = away(centre, bearing, distance_m)
    wide = tuple(
        LatLon(corner.lat_deg + up, (corner.lon_deg + right + 180) % 360 - 180)
        for up, right in ((0, 0), (0, 3), (4, 3), (4, 0))
    )
    kept, left_out, cut = within_reach(Fence((field, PolygonZone(ZoneKind.EXCLUSION, wide))))
    assert (left_out, cut) == (0, 1)

    def plane(vertices):
        return Polygon(
            [((p.lon_deg - corner.lon_deg + 180) % 360 - 180, p.lat_deg - corner.lat_deg) for p in vertices]
        )

    [part] = kept.zones[1:]
    reach_deg = 0.9 * REACH_M / 111_320
    near = plane(field.vertices).buffer(reach_deg)
    missing = plane(wide).intersection(near).difference(plane(part.vertices))
    assert missing.area < 1e-12
    assert plane(part.vertices).difference(plane(wide)).area < 1e-12
    assert not is_wide(*kept.zones)
