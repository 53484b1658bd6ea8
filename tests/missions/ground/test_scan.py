"""What a distance sensor sees becomes discs that hold what is there; what lies on the fence's edges counts for nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import frame_around
from missions.ground.ground import lay_out
from missions.ground.scan import RangeScan, discs_seen

MIDDLE = LatLon(40.07, -105.23)
FRAME = frame_around([MIDDLE])
CORNERS = tuple(
    FRAME.to_lat_lon(LocalPoint(*corner)) for corner in ((-50, -50), (50, -50), (50, 50), (-50, 50))
)
POND = CircleZone(ZoneKind.EXCLUSION, FRAME.to_lat_lon(LocalPoint(0, 20)), 5.0)
FIELD = lay_out(Fence((PolygonZone(ZoneKind.INCLUSION, CORNERS), POND)), FRAME)


def scan_of(shapes, here, heading_deg, *, sectors=72, first_deg=0.0, clockwise=1, sees_m=15.0):
    """Return what an ideal sensor sees: in each sector the nearest, along many rays, by shapely."""
    step_deg = 360 / sectors
    found = []
    for sector in range(sectors):
        middle_deg = heading_deg + first_deg + clockwise * step_deg * sector
        distances = [
            ray.intersection(shape).distance(Point(here))
            for turn in np.linspace(-0.5, 0.5, 9)
            for ray in [_ray(here, middle_deg + turn * step_deg, sees_m)]
            for shape in shapes
            if ray.intersects(shape)
        ]
        found.append(min(distances, default=math.nan))
    return RangeScan(np.array(found), first_deg, clockwise * step_deg)


def _ray(here, bearing_deg, length_m):
    bearing = math.radians(bearing_deg)
    return LineString(
        [here, (here[0] + length_m * math.sin(bearing), here[1] + length_m * math.cos(bearing))]
    )


def circle(disc):
    """Return a disc as a shape."""
    east, north = (
        disc.near.east_m + disc.way[0] * disc.radius_m,
        disc.near.north_m + disc.way[1] * disc.radius_m,
    )
    return Point(east, north).buffer(disc.radius_m + 1e-6, 64)


@settings(max_examples=40)
@given(
    st.floats(2, 13),
    st.floats(0, 360),
    st.floats(0, 360),
    st.floats(0.2, 1.2),
    st.floats(-180, 180),
    st.sampled_from((1, -1)),
)
def test_a_disc_in_view_lies_in_the_disc_that_is_seen(
    away_m, bearing_deg, heading_deg, radius_m, first_deg, clockwise
):
    bearing = math.radians(bearing_deg)
    here = LocalPoint(-10.0, -20.0)
    middle = (
        here[0] + (away_m + radius_m) * math.sin(bearing),
        here[1] + (away_m + radius_m) * math.cos(bearing),
    )
    thing = Point(middle).buffer(radius_m, 64)
    scan = scan_of([thing], here, heading_deg, first_deg=first_deg, clockwise=clockwise)
    (seen,) = discs_seen(scan, here, heading_deg, FIELD)
    assert thing.difference(circle(seen).buffer(0.2)).is_empty
    assert seen.radius_m < radius_m + 0.18 * (away_m + 2 * radius_m) + 0.3  # two sectors too wide at most


def test_two_things_are_two_and_one_across_the_front_is_one():
    here = LocalPoint(-10.0, -20.0)
    left, front = Point(-16, -20).buffer(0.5), Point(-10, -12).buffer(1.5)
    found = discs_seen(scan_of([left, front], here, 0.0), here, 0.0, FIELD)
    assert len(found) == 2
    assert all(any(thing.within(circle(disc).buffer(0.2)) for disc in found) for thing in (left, front))


def test_a_wall_is_a_row_of_discs_that_hold_it():
    here = LocalPoint(-10.0, -20.0)
    wall = LineString([(-18, -14), (-2, -14)])
    scan = scan_of([wall], here, 30.0)
    found = discs_seen(scan, here, 30.0, FIELD)
    assert len(found) > 2
    assert max(disc.radius_m for disc in found) < 4.0
    row = [circle(disc) for disc in found]
    assert max(min(shape.distance(Point(x, -14)) for shape in row) for x in np.arange(-17.5, -2.0, 0.5)) < 0.5


@pytest.mark.parametrize(
    "thing",
    [Point(0, 20).buffer(3.0), Point(52, -20).buffer(1.0), LineString([(49.8, -30), (49.8, 0)])],
    ids=["in an exclusion", "outside", "along the edge"],
)
def test_what_lies_on_the_fence_or_beyond_is_left_out(thing):
    here = LocalPoint(*(0.0, 10.0) if abs(thing.centroid.x) < 1 else (42.0, -20.0))
    scan = scan_of([thing], here, 0.0)
    assert np.isfinite(scan.distances_m).any()
    assert discs_seen(scan, here, 0.0, FIELD) == []


def test_nothing_is_seen_in_an_empty_scan_nor_where_no_fence_is_near():
    here = LocalPoint(0.0, -20.0)
    assert discs_seen(RangeScan(np.full(72, math.nan), 0.0, 5.0), here, 0.0, FIELD) == []
    open_ground = lay_out(Fence(()), FRAME, around=[MIDDLE])
    scan = RangeScan(np.where(np.arange(72) == 3, 4.0, math.nan), 0.0, 5.0)
    assert len(discs_seen(scan, here, 0.0, open_ground)) == 1


def test_what_stands_at_the_sensor_is_bounded():
    here = LocalPoint(0.0, -20.0)
    found = discs_seen(RangeScan(np.full(72, 0.3), 0.0, 5.0), here, 0.0, FIELD)
    assert all(disc.radius_m <= 4.0 for disc in found)


@pytest.mark.parametrize("sectors", [2, 3, 4, 8, 12])
@pytest.mark.parametrize("away_m", [0.01, 0.3, 6.0, 11.0, 40.0])
@pytest.mark.filterwarnings("error")
def test_a_wide_sector_is_a_row_of_discs(sectors, away_m):
    """A single rangefinder is sent as a sector of 45°: what it sees may be anywhere in it."""
    open_ground, here = lay_out(Fence(()), FRAME, around=[MIDDLE]), LocalPoint(0.0, 0.0)
    distances_m = np.full(sectors, math.nan)
    distances_m[0] = away_m
    found = discs_seen(RangeScan(distances_m, 0.0, 360 / sectors), here, 0.0, open_ground)
    assert all(math.isfinite(value) for disc in found for value in (*disc.near, *disc.way, disc.radius_m))
    half_deg = 180 / sectors
    for bearing in np.radians(np.linspace(-half_deg, half_deg, 181)):
        seen = Point(away_m * math.sin(bearing), away_m * math.cos(bearing))
        assert min(circle(disc).distance(seen) for disc in found) <= 1.05  # where two meet


@pytest.mark.parametrize("sectors", [1, 2, 3, 4, 8, 72])
@pytest.mark.parametrize("away_m", [0.01, 0.3, 3.0, 40.0])
@pytest.mark.filterwarnings("error")
def test_what_is_seen_all_around_is_discs_all_around(sectors, away_m):
    open_ground, here = lay_out(Fence(()), FRAME, around=[MIDDLE]), LocalPoint(0.0, 0.0)
    found = discs_seen(RangeScan(np.full(sectors, away_m), 0.0, 360 / sectors), here, 0.0, open_ground)
    assert len(found) >= 3
    for bearing in np.radians(np.arange(0, 360, 3)):
        seen = Point(away_m * math.sin(bearing), away_m * math.cos(bearing))
        assert min(circle(disc).distance(seen) for disc in found) <= 1.05  # where two meet
    assert all(disc.radius_m <= 4.0 for disc in found)
