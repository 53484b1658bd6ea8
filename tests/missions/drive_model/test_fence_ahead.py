"""How far ahead a fence lies, and what speed avoidance leaves: one place at a time, many at once, and by shapely."""

from __future__ import annotations

import cmath
import csv
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.drive_model.fence_ahead import FenceAhead, FenceEdges
from missions.vehicle import Vehicle, vehicle_from_parameters

AVOIDING = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "AVOID_ENABLE": 3.0, "FENCE_MARGIN": 2.0}
RAY_M = 1000.0


def vehicle_at(speed_mps: float) -> Vehicle:
    return vehicle_from_parameters({**AVOIDING, "WP_SPEED": speed_mps})


def expected_mps(fence: shapely.Geometry, place: complex, way: complex, vehicle: Vehicle) -> float:
    """Return the speed by ArduPilot's sqrt_controller of the distance that shapely measures."""
    end = place + RAY_M * way
    met = shapely.LineString([(place.real, place.imag), (end.real, end.imag)]).intersection(fence)
    if met.is_empty:
        return math.inf
    left_m = max(met.distance(shapely.Point(place.real, place.imag)) - vehicle.fence.margin_m, 0.0)
    gain, accel = vehicle.position_gain_per_s, vehicle.accel_max_mps2
    if left_m <= accel / gain**2:
        return gain * left_m
    return math.sqrt(2 * accel * (left_m - accel / gain**2 / 2))


def ring(corners: int, radius_m: float, east_m: float, north_m: float) -> shapely.LinearRing:
    around = [cmath.rect(radius_m, math.tau * number / corners) for number in range(corners)]
    return shapely.LinearRing([(east_m + at.real, north_m + at.imag) for at in around])


@pytest.mark.parametrize("corners", [3, 200])
@settings(max_examples=60)
@given(
    speed_mps=st.sampled_from([1.0, 2.0, 5.0]),
    east_m=st.floats(-15.0, 15.0),
    north_m=st.floats(-15.0, 15.0),
    ways=st.lists(st.floats(0.0, math.tau), min_size=1, max_size=6),
)
def test_the_speed_is_that_of_the_first_edge_ahead(
    corners: int, speed_mps: float, east_m: float, north_m: float, ways: list[float]
) -> None:
    vehicle = vehicle_at(speed_mps)
    fence = shapely.union_all([ring(corners, 20.3, 0.0, 0.0), ring(corners, 4.1, 5.0, 30.0)])
    place = complex(east_m, north_m)
    ahead = FenceAhead(FenceEdges(fence), np.array([(-20.0, -20.0), (20.0, 20.0)]), vehicle)
    units = [cmath.rect(1.0, way) for way in ways]
    many_mps = ahead.speeds_mps(
        np.full((len(units), 2), (east_m, north_m)),
        np.array([(unit.real, unit.imag) for unit in units]),
        speed_mps,
    )
    allowed_mps = ahead.speeds_about(speed_mps)
    for unit, one_of_many_mps in zip(units, many_mps, strict=True):
        wanted_mps = min(expected_mps(fence, place, unit, vehicle), speed_mps)
        assert min(float(one_of_many_mps), speed_mps) == pytest.approx(wanted_mps, abs=1e-6)
        one_mps = allowed_mps(place, unit)
        assert min(one_mps, speed_mps) == pytest.approx(wanted_mps, abs=1e-6)


def test_places_far_apart_look_at_their_own_edges() -> None:
    vehicle = vehicle_at(2.0)
    walls = shapely.MultiLineString([[(10.0, -5.0), (10.0, 5.0)], [(210.0, -5.0), (210.0, 5.0)]])
    ahead = FenceAhead(FenceEdges(walls), np.array([(0.0, 0.0), (200.0, 0.0)]), vehicle)
    allowed_mps = ahead.speeds_about(2.0)
    for east_m in (0.0, 200.0, 1.0):
        assert allowed_mps(complex(east_m), 1 + 0j) == pytest.approx(
            expected_mps(walls, complex(east_m), 1 + 0j, vehicle)
        )


def test_many_edges_are_looked_at_by_parts_of_the_way() -> None:
    vehicle = vehicle_at(2.0)
    fence = shapely.union_all([ring(500, 5.0, 30.0 * number, 9.0) for number in range(10)])
    places = np.column_stack([np.linspace(0.0, 270.0, 400), np.zeros(400)])
    ways = np.tile([0.6, 0.8], (400, 1))
    ahead = FenceAhead(FenceEdges(fence), places, vehicle)
    for place, mps in list(zip(places.tolist(), ahead.speeds_mps(places, ways, 2.0), strict=True))[::20]:
        wanted_mps = expected_mps(fence, complex(*place), 0.6 + 0.8j, vehicle)
        assert min(mps, 2.0) == pytest.approx(min(wanted_mps, 2.0), abs=1e-6)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), far_m=st.sampled_from([0.0, 20_000.0]))
def test_rays_that_pass_all_edges_by_are_left_out_and_no_others(seed: int, far_m: float) -> None:
    """Many places at once, some of which meet an edge close to its end, give what one place at a time does."""
    rng = np.random.default_rng(seed)
    vehicle = vehicle_at(2.0)
    fence = shapely.union_all([ring(int(rng.integers(3, 30)), 4.0, far_m + x, 3.0) for x in (-9.0, 0.0, 9.0)])
    places = np.array((far_m, 0.0)) + rng.uniform(-20.0, 20.0, (60, 2))
    edges = FenceEdges(fence)
    aimed = rng.integers(0, len(edges.boxed.starts), 60)
    at = edges.boxed.starts[aimed] + rng.choice([1e-6, 0.3, 1.0 - 1e-6], 60) * edges.boxed.steps[aimed]
    ways = np.column_stack((at.real, at.imag)) - places
    ways /= np.hypot(*ways.T)[:, None]
    ahead = FenceAhead(edges, places, vehicle)
    for place, way, mps in zip(places, ways, ahead.speeds_mps(places, ways, 2.0), strict=True):
        alone_mps = ahead.speeds_mps(place[None], way[None], 2.0)[0]
        assert min(mps, 2.0) == min(alone_mps, 2.0)
        assert min(mps, 2.0) == pytest.approx(
            min(ahead.speeds_about(2.0)(complex(*place), complex(*way)), 2.0), abs=1e-6
        )


def test_an_edge_along_the_way_is_met_at_its_neighbour() -> None:
    vehicle = vehicle_at(2.0)
    corner = shapely.LineString([(4.0, 0.0), (8.0, 0.0), (8.0, 3.0)])
    ahead = FenceAhead(FenceEdges(corner), np.array([(0.0, 0.0)]), vehicle)
    left_m = 8.0 - vehicle.fence.margin_m
    assert ahead.speeds_about(2.0)(0j, 1 + 0j) == pytest.approx(vehicle.position_gain_per_s * left_m)


FENCES = Path(__file__).parents[2] / "mavlink_bridge" / "simulator" / "data" / "fences.csv"


def wall_rows() -> list[dict[str, str]]:
    with FENCES.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return [
        row
        for row in rows
        if (row["test"], row["avoid_enable"]) == ("wall ahead", "3") and "AVOID" not in row["case"]
    ]


def test_a_measured_rover_slows_for_a_wall_where_it_is_foreseen_or_a_little_later() -> None:
    """So it is not foreseen too broadly: real ones lag by 0.25 to 0.42 s."""
    later_s = []
    for row in wall_rows():
        speed_mps, margin_m = float(row["wp_speed_mps"]), float(row["fence_margin_m"])
        vehicle = vehicle_from_parameters({**AVOIDING, "WP_SPEED": speed_mps, "FENCE_MARGIN": margin_m})
        wall = shapely.LineString([(40.0, -20.0), (40.0, 20.0)])
        along_m = np.arange(0.0, 40.0, 0.01)
        places = np.stack((along_m, np.zeros_like(along_m)), axis=1)
        allowed_mps = FenceAhead(FenceEdges(wall), places, vehicle).speeds_mps(
            places, np.broadcast_to((1.0, 0.0), places.shape), speed_mps
        )
        foreseen_m = along_m[np.flatnonzero(allowed_mps < 0.8 * speed_mps)[0]]
        later_s.append((float(row["slow_below_80pct_at_m"]) - foreseen_m) / speed_mps)
    assert len(later_s) == 10
    assert min(later_s) >= 0.2
    assert max(later_s) <= 0.45
