from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shapely import LineString, Point
from strategies import GEOD, away, lat_lons

from missions.errors import InvalidPositionError
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import (
    LocalFrame,
    autopilot_line,
    autopilot_scale,
    bow_m,
    frame_around,
)

bearings = st.floats(0, 360)
within_10_km = st.floats(0, 10_000)


@given(lat_lons, bearings, within_10_km, bearings, within_10_km)
@example(LatLon(85, 180), 90, 10_000, 270, 10_000)
@example(LatLon(-85, -180), 0, 10_000, 180, 10_000)
def test_plane_distances_agree_with_the_geodesic(
    origin: LatLon, bearing_a: float, away_a_m: float, bearing_b: float, away_b_m: float
) -> None:
    frame = LocalFrame(origin)
    a, b = away(origin, bearing_a, away_a_m), away(origin, bearing_b, away_b_m)
    true_m = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2]
    assert math.dist(frame.to_local(a), frame.to_local(b)) == pytest.approx(true_m, abs=1e-3, rel=1e-6)


@given(lat_lons, bearings, st.floats(0.01, 10_000))
def test_bearings_from_the_origin_agree_with_the_geodesic(
    origin: LatLon, bearing: float, length_m: float
) -> None:
    east_m, north_m = LocalFrame(origin).to_local(away(origin, bearing, length_m))
    assert east_m == pytest.approx(length_m * math.sin(math.radians(bearing)), abs=1e-3)
    assert north_m == pytest.approx(length_m * math.cos(math.radians(bearing)), abs=1e-3)


@given(lat_lons, st.floats(-20_000, 20_000), st.floats(-20_000, 20_000))
def test_there_and_back(origin: LatLon, east_m: float, north_m: float) -> None:
    frame = LocalFrame(origin)
    position = frame.to_lat_lon(LocalPoint(east_m, north_m))
    assert -180 <= position.lon_deg < 180
    # PROJ 9.2 puts what is nearer than 0.64 mm (1e-10 rad) at the origin itself.
    assert frame.to_local(position) == pytest.approx((east_m, north_m), abs=1e-3)
    points = [LocalPoint(east_m, north_m), LocalPoint(0, 0)]
    np.testing.assert_allclose(frame.to_local_array(list(map(frame.to_lat_lon, points))), points, atol=1e-3)


def test_no_positions_give_an_empty_array() -> None:
    assert LocalFrame(LatLon(1, 2)).to_local_array([]).shape == (0, 2)


def test_the_frame_lies_in_the_middle_of_the_bounding_box() -> None:
    corners = [LatLon(10, 20), LatLon(10.2, 20.1), LatLon(10.1, 20.5)]
    assert frame_around(corners).origin == pytest.approx((10.1, 20.25))


def test_the_frame_takes_the_short_way_across_the_antimeridian() -> None:
    frame = frame_around([LatLon(-17, 179.999), LatLon(-17, -179.998), LatLon(-17.001, 179.9995)])
    assert frame.origin.lat_deg == pytest.approx(-17.0005)
    assert frame.origin.lon_deg == pytest.approx(-179.9995)
    west, east = frame.to_local(LatLon(-17, 179.999)), frame.to_local(LatLon(-17, -179.998))
    true_m = GEOD.inv(179.999, -17, -179.998, -17)[2]
    assert east.east_m - west.east_m == pytest.approx(true_m, abs=1e-3)


@pytest.mark.parametrize("lat_deg", [85.0001, -85.5, 90, -90])
def test_near_a_pole_is_refused(lat_deg: float) -> None:
    with pytest.raises(
        InvalidPositionError,
        match=r"latitude .*° is beyond ±85°: this close to a pole the autopilot's flat-earth",
    ):
        LocalFrame(LatLon(lat_deg, 0))
    with pytest.raises(InvalidPositionError, match=r"is beyond ±85°"):
        frame_around([LatLon(math.copysign(84, lat_deg), 5), LatLon(lat_deg, 5)])


def test_a_frame_around_nothing_is_refused() -> None:
    with pytest.raises(InvalidPositionError, match="no position"):
        frame_around([])


@pytest.mark.parametrize("lat_deg", range(-85, 86, 5))
def test_the_autopilots_metre(lat_deg: int) -> None:
    """A step of the autopilot's flat frame (1.113195e5 m a degree, cosine of the latitude), measured by Geod."""
    step_deg = 1e-4
    north_m = GEOD.inv(0, lat_deg - step_deg / 2, 0, lat_deg + step_deg / 2)[2]
    east_m = GEOD.inv(0, lat_deg, step_deg, lat_deg)[2]
    scale = autopilot_scale(lat_deg)
    assert scale.north == pytest.approx(north_m / (1.113195e5 * step_deg), abs=2e-8)
    assert scale.east == pytest.approx(
        east_m / (1.113195e5 * step_deg * math.cos(math.radians(lat_deg))), abs=2e-8
    )
    assert 0.993 < min(scale) <= max(scale) < 1.0035


@given(st.floats(-85, 85), st.floats(0, 360), st.floats(1, 1000))
@example(85.0, 90.0, 1000.0)
@example(-85.0, 270.0, 1000.0)
@example(45.0, 45.0, 1000.0)
def test_the_bow_bounds_how_far_the_autopilots_line_leaves_ours(
    lat_deg: float, bearing: float, leg_m: float
) -> None:
    a = LatLon(lat_deg, 179.999)
    b = away(a, bearing, leg_m)
    frame = frame_around([LatLon(max(-85, min(85, lat_deg)), 180)])
    line = frame.to_local_array(autopilot_line(a, b, 64))
    straight = LineString([line[0], line[-1]])
    measured_m = max(straight.distance(Point(xy)) for xy in line)
    worst_lat_deg = max(abs(a.lat_deg), abs(b.lat_deg))
    assert measured_m <= bow_m(leg_m, worst_lat_deg) + 1e-5


def test_the_bow_at_mid_latitudes() -> None:
    assert bow_m(1000, 40) == pytest.approx(0.018, abs=1e-4)
    assert bow_m(500, 40) == pytest.approx(bow_m(1000, -40) / 4)
    assert bow_m(1000, 0) == 0


def test_the_autopilots_line_across_the_antimeridian() -> None:
    line = autopilot_line(LatLon(10, 179.9995), LatLon(10.001, -179.9995), 8)
    assert line[0] == (10, 179.9995)
    assert line[-1] == pytest.approx((10.001, -179.9995))
    steps_m = [GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(line)]
    assert len(line) == 9
    assert max(steps_m) - min(steps_m) < 1e-3


def test_a_line_of_no_length() -> None:
    a = LatLon(1, 2)
    assert autopilot_line(a, a, 1) == [a, a]


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_few_positions_are_an_array_too(count: int) -> None:
    frame = LocalFrame(LatLon(40.0, -105.0))
    places = [LatLon(40.001, -105.002), LatLon(39.999, -104.998)][:count]
    points = frame.to_local_array(places)
    assert points.shape == (count, 2)
    assert [LocalPoint(*point) for point in points.tolist()] == [frame.to_local(place) for place in places]


@pytest.mark.parametrize("origin", [LatLon(40.0, -105.0), LatLon(-80.0, 180.0)])
def test_many_positions_lie_where_each_by_itself_does(origin: LatLon) -> None:
    """Many are placed by PROJ, few by GeographicLib: within nanometres the same."""
    frame = LocalFrame(origin)
    along_deg = np.linspace(0, 3600, 2500)
    places = [away(origin, angle, 0.5 * turn) for turn, angle in enumerate(along_deg.tolist())]
    points = frame.to_local_array(places)
    assert points == pytest.approx(np.array([frame.to_local(place) for place in places]), abs=5e-9)
    back = [frame.to_lat_lon(LocalPoint(*point)) for point in points[::100].tolist()]
    assert [
        GEOD.inv(*a[::-1], *b[::-1])[2] for a, b in zip(back, places[::100], strict=True)
    ] == pytest.approx([0] * 25, abs=1e-8)
