"""The drive law against what ArduPilot Rover 4.7.0-dev drove: medians of corners, three whole missions, starts and stops.

The data in ``data/`` are an extract of the measurements: medians over left and right turns of the clean set (long legs, second
repetition; over WP_RADIUS too up to 3 m/s, where it hardly matters), of the short legs of three vehicles, and three tracks.
"""

from __future__ import annotations

import cmath
import csv
import json
import math
from collections import defaultdict
from pathlib import Path
from statistics import median

import numpy as np
import pytest
from shapely import LineString, MultiPoint, Point
from simulator.station import Bench
from simulator.tracks import TICK_S, chain, corners, drive, settings

from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.fence_watch import FenceArea
from mavlink_bridge.simulator.flat import TrueFrame
from mavlink_bridge.simulator.personality import version_number
from missions.drive_model.corner import SKID_START_SWING_M
from missions.fence import Fence, PolygonZone, ZoneKind, fence_to_items
from missions.firmware import firmware_from_number, read_firmware
from missions.formats import read_fence
from missions.geo import LatLon
from missions.items import waypoint
from missions.vehicle import vehicle_from_parameters

DATA = Path(__file__).parent / "data"
ORDER = [105, 165, 10, 120, 75, 90, 45, 150, 60, 20, 135, 30]
"""The turns of the clean set in the order in which they were driven, each to the left and then to the right."""

SHORT_ORDER = [10, 20, 30, 45, 60, 75, 90, 105, 120, 135, 150, 165]


def rows(name):
    with (DATA / name).open() as file:
        return list(csv.DictReader(file))


LONG = defaultdict(dict)
for _row in rows("corner_medians.csv"):
    _key = (_row["vehicle"], float(_row["wp_speed_mps"]), _row["wp_radius_m"], float(_row["leg_m"]))
    LONG[_key][int(_row["turn_deg"])] = _row
SHORT = defaultdict(dict)
for _row in rows("short_leg_medians.csv"):
    _key = (_row["vehicle"], float(_row["wp_speed_mps"]), float(_row["wp_radius_m"]))
    SHORT[_key][float(_row["leg_m"]), int(_row["turn_deg"])] = _row


@pytest.mark.parametrize("cell", LONG, ids=lambda cell: f"{cell[0]} {cell[1]:g} m/s R {cell[2]}")
def test_corners_between_long_legs(cell):
    vehicle, speed_mps, radius, leg_m = cell
    turns = [sign * turn for turn in ORDER for sign in (-1, 1)]
    points = chain(turns, [leg_m] * (len(turns) + 1))
    radius_m = 2.0 if radius == "any" else float(radius)
    track = drive(points, settings(vehicle, WP_SPEED=speed_mps, WP_RADIUS=radius_m))
    driven = defaultdict(list)
    for turn, corner in zip(turns, corners(track, points), strict=True):
        driven[abs(turn)].append(corner)
    assert set(LONG[cell]) == set(ORDER)
    for turn, measured in LONG[cell].items():
        if vehicle == "skid" and turn == 60:
            continue  # exactly WP_PIVOT_ANGLE: it pivots or not by the rounding of the coordinates
        cut_m = median(corner.inside_cut_m for corner in driven[turn])
        out_m = median(corner.outside_overshoot_m for corner in driven[turn])
        speed = median(corner.least_speed_mps for corner in driven[turn])
        assert cut_m == pytest.approx(float(measured["inside_cut_m"]), abs=0.3), turn
        assert out_m == pytest.approx(float(measured["outside_overshoot_m"]), abs=0.3), turn
        assert abs(speed) == pytest.approx(float(measured["min_speed_mps"]), abs=0.15), turn


@pytest.mark.parametrize("cell", SHORT, ids=lambda cell: f"{cell[0]} {cell[1]:g} m/s R {cell[2]:g}")
def test_corners_between_short_legs(cell):
    vehicle, speed_mps, radius_m = cell
    between_m = 25.0 if speed_mps < 3 else 40.0
    turns, legs = [], [between_m]
    for leg_m in (5.0, 10.0):
        for turn in SHORT_ORDER:
            turns += [turn, -turn, -turn, turn]
            legs += [leg_m, leg_m, leg_m, between_m]
    points = chain(turns, legs)
    track = drive(points, settings(vehicle, WP_SPEED=speed_mps, WP_RADIUS=radius_m))
    found = corners(track, points)
    checked = 0
    for index in range(0, len(turns), 4):
        leg_m, turn = legs[index + 1], turns[index]
        measured = SHORT[cell].get((leg_m, turn))
        # 60 is exactly WP_PIVOT_ANGLE; at 150 and 165 which leg a point belongs to is a matter of taste.
        if measured is None or turn >= 150 or (vehicle == "skid" and turn == 60):
            continue
        group = found[index : index + 4]
        cut_m = median(corner.inside_cut_m for corner in group)
        out_m = median(corner.outside_overshoot_m for corner in group)
        assert cut_m == pytest.approx(float(measured["inside_cut_m"]), abs=0.3), (leg_m, turn)
        assert out_m == pytest.approx(float(measured["outside_overshoot_m"]), abs=0.3), (leg_m, turn)
        checked += 1
    assert checked >= 17


def shape(fence, frame):
    """Return the fence's edges as one shape, without the code under test."""
    edges = []
    for zone in fence.zones:
        if isinstance(zone, PolygonZone):
            ring = [frame.to_flat(vertex) for vertex in zone.vertices]
            edges.append(LineString([(p.real, p.imag) for p in [*ring, ring[0]]]))
        else:
            centre = frame.to_flat(zone.centre)
            edges.append(Point(centre.real, centre.imag).buffer(zone.radius_m, 64).exterior)
    return edges


@pytest.mark.parametrize(("run", "time_ratio"), [("maze-2m", 0.1), ("maze-5m", 0.1), ("yard-3m", 0.1)])
def test_whole_missions(run, time_ratio, fields):
    recorded = json.loads((DATA / f"{run}.json").read_text())
    fence = read_fence(fields / f"{run.split('-')[0]}-fence.waypoints")
    places = [LatLon(*place) for place in recorded["waypoints"]]
    frame = TrueFrame(places[0])
    edges = shape(fence, frame)
    bench = Bench(
        SimulatorConfig(
            home=places[0],
            fence=fence_to_items(fence),
            mission=tuple(waypoint(place) for place in places),
            parameters={"FENCE_ENABLE": 1.0},
            streams=False,
        )
    )
    bench.start_auto()
    driven = []
    while not bench.vehicle.rover.mission_run.is_complete:
        assert bench.now_s < 150.0
        bench.run(TICK_S)
        driven.append((frame.to_flat(bench.vehicle.position), bench.now_s))
    real = [(frame.to_flat(LatLon(lat, lon)), time_s) for lat, lon, time_s in recorded["track"]]
    end = frame.to_flat(places[-1])

    def clearance_m(track):
        line = LineString([(point.real, point.imag) for point, _ in track])
        return min(edge.distance(line) for edge in edges)

    def time_s(track):
        """From 2 m off the start to 1 m from the end."""
        begin_s = next(time_s for point, time_s in track if abs(point) > 2.0)
        return next(time_s for point, time_s in track if abs(point - end) < 1.0) - begin_s

    assert clearance_m(driven) == pytest.approx(clearance_m(real), abs=0.3)
    assert time_s(driven) == pytest.approx(time_s(real), rel=time_ratio)
    assert bench.vehicle.least_clearance_m == pytest.approx(clearance_m(driven), abs=0.02)
    assert bench.vehicle.breaches == 0
    cloud = MultiPoint([(point.real, point.imag) for point, _ in driven])
    gaps_m = [cloud.distance(Point(point.real, point.imag)) for point, _ in real]
    assert max(gaps_m) < 0.7
    assert median(gaps_m) < 0.25


@pytest.mark.parametrize(
    ("wrong_deg", "swing_m"), [(0, 0.3), (20, 0.40), (45, 0.61), (90, 1.11), (135, 1.70), (170, 2.05)]
)
@pytest.mark.parametrize("speed_mps", [2.0, 5.0])
def test_a_start_with_the_wrong_heading_swings_off_the_line(wrong_deg, swing_m, speed_mps):
    limits = settings("ackermann", WP_SPEED=speed_mps, WP_RADIUS=2.0)
    track = drive([0j, 60 + 0j], limits, heading_rad=math.radians(wrong_deg))
    assert abs(track.points_m.imag).max() == pytest.approx(swing_m, abs=0.3)
    settled = {2.0: 17.0, 5.0: 29.0}[speed_mps]
    assert abs(track.points_m.imag[track.points_m.real > settled]).max() <= 0.4


@pytest.mark.parametrize("wrong_deg", [75, 135, 180])
def test_a_skid_steered_rover_pivots_at_the_start(wrong_deg):
    track = drive([0j, 60 + 0j], settings("skid", WP_SPEED=2.0), heading_rad=math.radians(wrong_deg))
    assert abs(track.points_m.imag).max() <= 0.25
    assert track.points_m.real.min() >= -0.1


@pytest.mark.parametrize("wrong_deg", [45, 90, 135, 170])
@pytest.mark.parametrize("speed_mps", [0.2, 0.5, 3.0])
def test_a_skid_steered_rover_that_does_not_pivot_turns_where_it_stands(wrong_deg, speed_mps):
    """Within what the drive model takes from corners: starts were not measured."""
    limits = settings("skid", WP_SPEED=speed_mps, WP_PIVOT_ANGLE=0.0)
    track = drive([0j, 20 + 0j], limits, heading_rad=math.radians(wrong_deg))
    bound_m = np.interp(wrong_deg, *zip(*SKID_START_SWING_M, strict=True))
    assert 0.1 < abs(track.points_m.imag).max() <= bound_m
    assert track.points_m.real.min() >= -0.1


@pytest.mark.parametrize("wrong_deg", [179.9999, 180, -180])
def test_a_skid_steered_rover_that_does_not_pivot_turns_round_though_it_faces_exactly_away(wrong_deg):
    """In ArduPilot's AR_PosControl that is a balance, which noise ends; here it stood for ever."""
    limits = settings("skid", WP_SPEED=2.0, WP_PIVOT_ANGLE=0.0)
    track = drive([0j, 20 + 0j], limits, heading_rad=math.radians(wrong_deg))
    assert len(track.points_m) * TICK_S < 30.0
    assert abs(track.points_m.imag).max() <= 0.4


@pytest.mark.parametrize("vehicle", ["ackermann", "skid"])
def test_a_straight_line_is_driven_a_little_to_the_left(vehicle):
    track = drive([0j, 100 + 0j], settings(vehicle, WP_SPEED=3.0))
    settled = track.points_m.imag[track.points_m.real > 20.0]
    assert -0.17 <= settled.mean() <= -0.05


def test_the_end_is_within_what_was_measured():
    for speed_mps in (1.0, 2.0, 5.0):
        limits = settings("ackermann", WP_SPEED=speed_mps)
        end = drive([0j, 60 + 0j], limits).points_m[-1]
        assert -3.0 <= end.real - 60.0 <= 0.5  # where it starts to brake: within WP_RADIUS
        assert abs(end.imag) <= 0.28


def test_the_clearance_is_the_distance_to_the_nearest_fence(fields):
    fence = read_fence(fields / "maze-fence.waypoints")
    origin = LatLon(40.071374, -105.22993)
    frame = TrueFrame(origin)
    area = FenceArea(fence_to_items(fence), frame)
    edges = shape(fence, frame)
    rng = np.random.default_rng(1)
    for north_m, east_m in rng.uniform((-20, -40), (140, 130), (300, 2)):
        distance_m = min(edge.distance(Point(north_m, east_m)) for edge in edges)
        found_m = area.clearance_m(complex(north_m, east_m))
        # Where zones overlap, an edge inside another forbidden zone is none.
        assert abs(found_m) >= distance_m - 1e-3
        if found_m > 0:
            assert found_m == pytest.approx(distance_m, abs=2e-3)
    assert cmath.isfinite(area.clearance_m(0j))


# --- before 4.6 -------------------------------------------------------------------------------------------------------------

BEFORE_4_6 = Path(__file__).parents[2] / "missions" / "drive_model" / "data" / "corners_before_4_6.csv"
NOT_FOLLOWED = {
    ("ackermann", "1", "1"): (150,),
    ("ackermann", "1", "2"): (45, 60, -150),
    ("ackermann", "1", "3"): (75, -170),
    ("ackermann", "2", "1"): (60, 90, -105, -120, 120, -150, 150, -170, 170),
    ("ackermann", "2", "2"): (90, 150, -170, 170),
    ("ackermann", "2", "3"): (-30, 30, -150, 150, -170, 170),
    ("ackermann", "3", "1"): (30, 60, -75, -90, 90, -105, 105, -120, 120, -150, 150, -170, 170),
    ("ackermann", "3", "2"): (-30, 60, 75, -120, 120, -150, 150, -170, 170),
    ("ackermann", "3", "3"): (60, 75, 120, -150, 150, -170, 170),
    ("ackermann", "5", "1"): (-45, 75, -90, 90, -105, 105, -120, 120, -150, 150, -170, 170),
    ("ackermann", "5", "2"): (30, 75, -90, -105, 105, -120, 120, -150, 150, -170, 170),
    ("ackermann", "5", "3"): (-20, -30, 60, -120, 120, -150, 150, -170, 170),
    ("skid", "1", "1"): (45,),
    ("skid", "1", "2"): (45,),
    ("skid", "1", "3"): (60,),
    ("skid", "2", "1"): (60,),
    ("skid", "2", "2"): (45, -60),
    ("skid", "2", "3"): (30,),
    ("skid", "3", "1"): (30, 60),
    ("skid", "3", "2"): (30, -60),
    ("skid", "3", "3"): (45, -60, 60),
}
"""By vehicle, speed and WP_RADIUS: the turns of which cut or swing is off by more than 0.3 m, 100 of 420. The blend is that of those versions, and the cuts
are; what carries those rovers out after sharp turns, and back across their lines, is not known: where a turn up to 75° is listed, it is what
was left of one before."""


@pytest.fixture(scope="module")
def before_4_6():
    drives = defaultdict(list)
    with BEFORE_4_6.open(newline="") as file:
        for row in csv.DictReader(file):
            drives[row["drive"]].append(row)
    first = {}
    for drive_rows in drives.values():
        head = drive_rows[0]
        if head["set"] == "long":
            first.setdefault((head["vehicle"], head["wp_speed_mps"], head["wp_radius_m"]), drive_rows)
    return first


@pytest.mark.parametrize("cell", NOT_FOLLOWED, ids=" ".join)
def test_corners_before_4_6_are_followed_or_listed(cell, before_4_6):
    measured = before_4_6[cell]
    turns = [float(row["turn_deg"]) for row in measured]
    points = chain(turns, [float(measured[0]["leg_m"])] * (len(turns) + 1))
    limits = settings(cell[0], WP_SPEED=float(cell[1]), WP_RADIUS=float(cell[2]), WP_PIVOT_ANGLE=60.0)
    driven = corners(drive(points, limits, turns_early=True), points)
    missed = {
        int(row["turn_deg"])
        for row, corner in zip(measured, driven, strict=True)
        if abs(corner.inside_cut_m - float(row["inside_cut_m"])) > 0.3
        or abs(corner.outside_overshoot_m - float(row["outside_overshoot_m"])) > 0.3
    }
    assert missed == set(NOT_FOLLOWED[cell])


def test_every_slow_cell_before_4_6_is_there(before_4_6):
    assert {cell for cell in before_4_6 if cell[:2] != ("skid", "5")} == set(NOT_FOLLOWED)
    assert sum(map(len, NOT_FOLLOWED.values())) == 100


@pytest.mark.parametrize(
    ("version", "turns_early", "pivot_deg", "number", "has_margin_xy"),
    [
        (None, False, 60.0, 0x04070000, True),
        ("4.5.7", True, 60.0, 0x040507FF, False),
        ("4.6.3", False, 60.0, 0x040603FF, False),
        ("4.7", False, 0.0, 0x040700FF, True),
    ],
)
def test_personalities_by_firmware(version, turns_early, pivot_deg, number, has_margin_xy):
    firmware = read_firmware(version) if version else None
    vehicle = SimulatedVehicle(SimulatorConfig(firmware=firmware))
    told = vehicle_from_parameters(
        {name: vehicle.parameters[name] for name in vehicle.parameters},
        firmware=firmware_from_number(version_number(firmware)),
    )
    assert version_number(firmware) == number
    assert told.has_measured_corners is not turns_early
    assert told.pivot_angle_deg == vehicle.parameters["WP_PIVOT_ANGLE"] == pivot_deg
    assert ("FENCE_MARGIN_XY" in vehicle.parameters) is has_margin_xy


def test_a_corner_given_twice_is_no_trouble_to_avoidance():
    """Its edge of no length has no slope."""
    north, east = 52.0, 9.0
    corners = [(-3e-5, -5e-5), (3e-5, -5e-5), (3e-5, -5e-5), (3e-5, 5e-5), (-3e-5, 5e-5)]
    zone = PolygonZone(ZoneKind.INCLUSION, tuple(LatLon(north + a, east + b) for a, b in corners))
    vehicle = SimulatedVehicle(
        SimulatorConfig(
            home=LatLon(north, east),
            mission=(waypoint(LatLon(north, east + 1e-5)),),
            fence=fence_to_items(Fence((zone,))),
            parameters={"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "AVOID_ENABLE": 3.0},
        )
    )
    vehicle.rover.arm()
    vehicle.rover.set_mode(10, 0.0)
    for tick in range(100):
        vehicle.rover.step(tick * TICK_S)
    assert vehicle.breaches == 0
