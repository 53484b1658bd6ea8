"""The vehicle's own avoidance: it slows a rover down at a corner before a fence, and the rover cuts the corner; the band holds that."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from charts import HOME, OUT, Chart, box, place

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.rover import TICK_S
from mavlink_bridge.simulator.vehicle import SimulatedVehicle
from missions.drive_model import envelope
from missions.drive_model.avoidance import with_avoidance
from missions.fence import Fence, fence_to_items
from missions.firmware import Firmware
from missions.items import waypoint
from missions.vehicle import Vehicle, vehicle_from_parameters

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from missions.drive_model import Envelope
    from missions.fence import PolygonZone

AVOIDING = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "AVOID_ENABLE": 3.0, "FENCE_MARGIN": 2.0}
STEERED_5 = {"WP_SPEED": 5.0, "WP_RADIUS": 3.0, "CRUISE_SPEED": 5.0, "CRUISE_THROTTLE": 30.0}
STEERED_2 = {"WP_SPEED": 2.0, "WP_RADIUS": 2.0}
SKID_2 = {
    **STEERED_2,
    "SERVO1_FUNCTION": 73.0,
    "SERVO3_FUNCTION": 74.0,
    "ATC_STR_RAT_FF": 0.2,
    "CRUISE_SPEED": 3.0,
    "CRUISE_THROTTLE": 75.0,
}

NORTH_THEN_EAST = [(0.0, 0.0), (0.0, 40.0), (40.0, 40.0)]
NORTH_THEN_HALF_EAST = [(0.0, 0.0), (0.0, 40.0), (30.0, 70.0)]
ROUND_TWO_CORNERS = [(0.0, 0.0), (0.0, 40.0), (12.0, 43.0), (24.0, 10.0)]


def wall(south_m: float, north_m: float, west_m: float = -60.0, east_m: float = 60.0) -> PolygonZone:
    return box(OUT, west_m, south_m, east_m, north_m)


def vehicle_of(parameters: dict[str, float]) -> Vehicle:
    return vehicle_from_parameters({**AVOIDING, **parameters}, firmware=Firmware(4, 6))


def bands(
    points: list[tuple[float, float]], zone: PolygonZone, parameters: dict[str, float]
) -> tuple[Envelope, Envelope, BaseGeometry]:
    """Return the band without avoidance, the band with it, and the fence's line."""
    line = Chart(HOME).zone_line(zone)
    vehicle = vehicle_of(parameters)
    heading_deg = math.degrees(math.atan2(points[1][0] - points[0][0], points[1][1] - points[0][1]))
    plain = envelope(points, vehicle, heading_deg=heading_deg)
    return plain, with_avoidance(plain, vehicle, line), line


def driven(
    points: list[tuple[float, float]], zone: PolygonZone, parameters: dict[str, float]
) -> BaseGeometry:
    """Return the simulated rover's true track."""
    simulated = SimulatedVehicle(
        SimulatorConfig(
            home=place(*points[0]),
            heading_deg=0.0,
            mission=[waypoint(place(*point)) for point in points[1:]],
            fence=fence_to_items(Fence((zone,))),
            parameters={**AVOIDING, **parameters},
            streams=False,
        )
    )
    rover = simulated.rover
    rover.arm()
    now_s = 1.0
    rover.set_mode(Mode.AUTO, now_s)
    track = []
    while rover.mode == Mode.AUTO and not rover.mission_run.is_complete and now_s < 120.0:
        now_s += TICK_S
        rover.step(now_s)
        track.append(rover.position)
    assert rover.mission_run.is_complete
    return shapely.MultiPoint(Chart(HOME).points(track[::5]))


@pytest.mark.parametrize(
    ("points", "zone", "parameters"),
    [
        (NORTH_THEN_EAST, wall(44.0, 46.0), STEERED_5),
        (NORTH_THEN_HALF_EAST, wall(45.0, 46.0, -60.0, 2.0), STEERED_5),
        (ROUND_TWO_CORNERS, wall(47.5, 49.0), STEERED_5),
        (NORTH_THEN_EAST, wall(43.0, 46.0), STEERED_2),
        ([(0.0, 0.0), (0.0, 40.0), (30.0, 60.0)], wall(43.5, 46.0, -60.0, 1.0), SKID_2),
        pytest.param(NORTH_THEN_EAST, wall(42.5, 46.0), {**STEERED_5, "FENCE_MARGIN": 0.0}, id="no margin"),
        pytest.param(
            NORTH_THEN_EAST,
            wall(44.0, 46.0),
            {**STEERED_5, "FENCE_MARGIN": 0.0, "FENCE_MARGIN_XY": 2.0},
            id="the flat margin",
        ),
    ],
)
def test_a_rover_that_is_slowed_at_a_corner_leaves_the_plain_band_but_not_this_one(
    points: list[tuple[float, float]], zone: PolygonZone, parameters: dict[str, float]
) -> None:
    plain, slowed, _ = bands(points, zone, parameters)
    track = driven(points, zone, parameters)
    assert shapely.distance(plain.area, shapely.get_parts(track)).max() > 0.3
    assert shapely.distance(slowed.area, shapely.get_parts(track)).max() <= 0.10


def test_more_ground_but_no_less() -> None:
    plain, slowed, line = bands(NORTH_THEN_EAST, wall(44.0, 46.0), STEERED_5)
    assert len(slowed.cores) > len(plain.cores)
    assert np.array_equal(slowed.bands_m[: len(plain.bands_m)], plain.bands_m)
    assert slowed.area.covers(plain.area.buffer(-1e-3))
    assert set(slowed.waypoints.tolist()) <= {0, 1, 2}
    assert slowed.duration_s == plain.duration_s
    assert slowed.clearance_m(line) <= plain.clearance_m(line)


@pytest.mark.parametrize(
    ("points", "zone", "changed"),
    [
        pytest.param(NORTH_THEN_EAST, wall(44.0, 46.0), {"AVOID_ENABLE": 0.0}, id="avoidance is off"),
        pytest.param(NORTH_THEN_EAST, wall(44.0, 46.0), {"FENCE_ENABLE": 0.0}, id="the fence is off"),
        pytest.param(NORTH_THEN_EAST, wall(140.0, 146.0), {}, id="the fence is far"),
        pytest.param([(0.0, 0.0), (0.0, 40.0)], wall(44.0, 46.0), {}, id="no corner"),
        pytest.param([(0.0, 0.0), (0.0, 40.0), (2.0, 70.0)], wall(75.0, 76.0), {}, id="hardly a turn"),
        pytest.param([(0.0, 0.0), (0.05, 0.0)], wall(44.0, 46.0), {}, id="no way at all"),
    ],
)
def test_nothing_more_where_nothing_is_slowed(
    points: list[tuple[float, float]], zone: PolygonZone, changed: dict[str, float]
) -> None:
    plain, slowed, _ = bands(points, zone, {**STEERED_5, **changed})
    assert slowed is plain


def test_nothing_more_without_a_fence() -> None:
    vehicle = vehicle_of(STEERED_5)
    plain = envelope(NORTH_THEN_EAST, vehicle, heading_deg=0.0)
    assert with_avoidance(plain, vehicle, shapely.LineString()) is plain


def test_a_stop_at_the_corner_is_no_cut() -> None:
    vehicle = vehicle_of(STEERED_5)
    line = Chart(HOME).zone_line(wall(44.0, 46.0))
    plain = envelope(NORTH_THEN_EAST, vehicle, heading_deg=0.0, stops={1: 1.0})
    assert with_avoidance(plain, vehicle, line) is plain


def test_the_nearer_the_wall_the_deeper_the_cut() -> None:
    vehicle = vehicle_of(STEERED_5)
    plain = envelope(NORTH_THEN_EAST, vehicle, heading_deg=0.0)
    inner = shapely.Point(12.0, 28.0)
    chart = Chart(HOME)
    kept_m = [
        with_avoidance(plain, vehicle, chart.zone_line(wall(south_m, south_m + 2.0))).clearance_m(inner)
        for south_m in (43.0, 46.0, 50.0, 58.0)
    ]
    assert kept_m == sorted(kept_m)
    assert kept_m[0] < kept_m[-1] - 1.0


def test_a_slack_position_gain_is_slowed_from_farther_away() -> None:
    """The speed allowed is the gain times what is left: half the gain, half the speed."""
    line = Chart(HOME).zone_line(wall(56.0, 58.0))
    inner = shapely.Point(12.0, 28.0)
    kept_m = []
    for gain_per_s in (0.3, 0.15):
        vehicle = replace(vehicle_of(STEERED_5), position_gain_per_s=gain_per_s)
        plain = envelope(NORTH_THEN_EAST, vehicle, heading_deg=0.0)
        kept_m.append(with_avoidance(plain, vehicle, line).clearance_m(inner))
    assert kept_m[1] < kept_m[0]
