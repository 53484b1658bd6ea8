from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import GEOD, away, lat_lons, wire_lat_lons

from missions.errors import InvalidPositionError
from missions.geo import (
    LatLon,
    bearing_deg,
    checked_lat_lon,
    distance_m,
    from_e7,
    parse_lat_lon,
    rounded,
    to_e7,
    upper_distance_m,
    wrap_lon_deg,
)


@given(lat_lons, st.floats(0, 359.99), st.floats(0.01, 10_000))
def test_distance_and_bearing_agree_with_the_direct_geodesic(
    a: LatLon, bearing: float, length_m: float
) -> None:
    b = away(a, bearing, length_m)
    assert distance_m(a, b) == pytest.approx(length_m, abs=1e-6)
    turn_deg = (bearing_deg(a, b) - bearing + 180) % 360 - 180
    assert abs(turn_deg) < math.degrees(1e-6 / length_m) + 1e-6
    assert 0 <= bearing_deg(a, b) < 360


@given(lat_lons, lat_lons, st.floats(0, 1))
@example(LatLon(0, 0), LatLon(0, 1), 2.0**-52)
def test_the_quick_bound_of_a_distance_is_no_less(a: LatLon, b: LatLon, share: float) -> None:
    nearer = LatLon(a.lat_deg + share * (b.lat_deg - a.lat_deg), a.lon_deg + share * (b.lon_deg - a.lon_deg))
    for there in (b, nearer):
        assert upper_distance_m(a, there) >= GEOD.inv(a.lon_deg, a.lat_deg, there.lon_deg, there.lat_deg)[2]


def test_distance_of_a_degree_of_latitude() -> None:
    assert distance_m(LatLon(0, 0), LatLon(1, 0)) == pytest.approx(110_574.389, abs=0.001)
    assert bearing_deg(LatLon(0, 0), LatLon(0, 1)) == 90


def test_bearing_never_comes_out_as_360() -> None:
    assert bearing_deg(LatLon(10, 20), LatLon(11, 20 - 1e-17)) == 0
    assert bearing_deg(LatLon(10, 20), LatLon(11, 20 - 1e-15)) < 360


@given(wire_lat_lons)
def test_deg_e7_round_trip_is_exact(position: LatLon) -> None:
    assert from_e7(*to_e7(position)) == position
    assert rounded(position) == position


@given(lat_lons)
def test_rounding_goes_to_the_nearest_and_moves_at_most_8_mm(position: LatLon) -> None:
    there = rounded(position)
    assert abs(there.lat_deg - position.lat_deg) <= 0.5e-7 + 1e-12
    assert abs(there.lon_deg - position.lon_deg) <= 0.5e-7 + 1e-12
    assert GEOD.inv(position.lon_deg, position.lat_deg, there.lon_deg, there.lat_deg)[2] < 0.0079


def test_rounding_does_not_cut() -> None:
    assert to_e7(LatLon(40.07132999, -105.22987109)) == (400713300, -1052298711)


@pytest.mark.parametrize(
    ("lon_deg", "wrapped_deg"),
    [(0, 0), (180, -180), (-180, -180), (181, -179), (-181, 179), (540, -180), (359, -1)],
)
def test_longitudes_wrap(lon_deg: float, wrapped_deg: float) -> None:
    assert wrap_lon_deg(lon_deg) == wrapped_deg


def test_positions_are_read() -> None:
    assert parse_lat_lon("40.0713,-105.2299") == (40.0713, -105.2299)
    assert parse_lat_lon(" 40.0713 , -105.2299 ") == (40.0713, -105.2299)
    assert str(parse_lat_lon("-1,2")) == "-1.0000000,2.0000000"


@pytest.mark.parametrize(
    "text",
    [
        "40.0713 -105.2299",
        "40.0713\t-105.2299",
        "40.0713° -105.2299°",
        "40.0713N 105.2299W",
        "40.0713n,105.2299w",
        "40.0713N105.2299W",
        "N40.0713 W105.2299",
        "N 40.0713, W 105.2299",
        "105.2299W 40.0713N",
        "W105.2299, N40.0713",
        "40°4.278'N 105°13.794'W",
        "40°04'16.68\"N 105°13'47.64\"W",
        "40° 04′ 16.68″ N, 105° 13′ 47.64″ W",
        "N40 04' 16.68'' W105 13' 47.64''",
        "40°04'16.68\" -105°13'47.64\"",
    ],
)
def test_positions_as_people_write_them(text: str) -> None:
    assert parse_lat_lon(text) == pytest.approx((40.0713, -105.2299), abs=1e-9)


@given(st.integers(-89, 89), st.integers(0, 59), st.floats(0, 59.9), st.floats(-180, 180))
def test_degrees_minutes_and_seconds(degrees: int, minutes: int, seconds: float, lon_deg: float) -> None:
    text = (
        f"{abs(degrees)}°{minutes}'{seconds:.9f}\"{'NS'[degrees < 0]} {abs(lon_deg):.12f}{'EW'[lon_deg < 0]}"
    )
    size_deg = (abs(degrees) * 3600 + minutes * 60 + seconds) / 3600
    wanted = (-size_deg if degrees < 0 else size_deg, lon_deg)
    assert parse_lat_lon(text) == pytest.approx(wanted, abs=1e-9)


NO_POSITIONS = [
    "",
    "40",
    "40,",
    "40,5,6",
    "north,east",
    "40;5",
    "4_0,5",
    "0x28,5",
    "nan,1",
    "1e2,3",
    "40.0713-105.2299",
]
ODD_ANGLES = [
    "-40N,5E",
    "40N,-5E",
    "404' 5",
    "40.5°30'N 5E",
    "40°60'N 5E",
    "40°1.5'10\"N 5E",
    "40,0713 -105,2299",
    "N40S E5",
]


@pytest.mark.parametrize("text", [*NO_POSITIONS, *ODD_ANGLES])
def test_text_that_is_no_position(text: str) -> None:
    with pytest.raises(InvalidPositionError, match=r"is not a position: expected LAT,LON"):
        parse_lat_lon(text)


@pytest.mark.parametrize("text", ["40N 41N", "40E 41W", "40N 105", "40 105W"])
def test_letters_that_do_not_say_which_is_which(text: str) -> None:
    with pytest.raises(InvalidPositionError, match="N or S and E or W"):
        parse_lat_lon(text)


def test_swapped_numbers_are_recognised() -> None:
    with pytest.raises(InvalidPositionError, match=r"did you mean 40\.0713,-105\.2299\?"):
        parse_lat_lon("-105.2299,40.0713")
    with pytest.raises(InvalidPositionError, match=r"latitude 200° is beyond ±90°$"):
        parse_lat_lon("200,10")


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "problem"),
    [
        (math.nan, 0, "not a pair of numbers"),
        (0, math.inf, "not a pair of numbers"),
        (91, 0, "latitude 91° is beyond"),
        (-90.5, 0, "latitude -90.5° is beyond"),
        (0, 180.5, "longitude 180.5° is beyond"),
        (0, -181, "longitude -181° is beyond"),
    ],
)
def test_numbers_that_are_no_position(lat_deg: float, lon_deg: float, problem: str) -> None:
    with pytest.raises(InvalidPositionError, match=problem):
        checked_lat_lon(lat_deg, lon_deg)
