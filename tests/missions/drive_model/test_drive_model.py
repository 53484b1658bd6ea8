from __future__ import annotations

import csv
import math
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from drive_model.extents import area_extents
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from missions.drive_model import Corner, Envelope, beyond_measured, corner_forecast, envelope, plan_drive
from missions.drive_model.corner import END_OVERRUN_M, blend
from missions.drive_model.motion import LegProfile, all_travelled_m, leg_profile
from missions.errors import InvalidPositionError, VehicleError
from missions.fence import PolygonZone, ZoneKind
from missions.formats import waypoints as waypoint_file
from missions.geo import LatLon
from missions.ground.frame import LocalFrame
from missions.vehicle import Autopilot, Pursuit, Steering, Vehicle

DATA = Path(__file__).parent / "data"
ROVER = Vehicle(waypoint_radius_m=3.0, speed_mps=5.0)
SLOW_ROVER = Vehicle(waypoint_radius_m=2.0, speed_mps=2.0)
TANK = Vehicle(waypoint_radius_m=2.0, speed_mps=2.0, steering=Steering.SKID)

turns = st.floats(-165, 165)
vehicles = st.builds(
    Vehicle,
    waypoint_radius_m=st.floats(0.2, 6),
    speed_mps=st.floats(0.5, 6),
    turn_radius_m=st.floats(0.3, 3),
    turn_max_g=st.floats(0.05, 0.8),
    accel_max_mps2=st.floats(0.3, 3),
    jerk_mps3=st.floats(0.3, 3),
    steering=st.sampled_from(Steering),
)


def polyline(legs_m: list[float], turns_deg: list[float], bearing_deg: float = 0.0) -> np.ndarray:
    points, bearing_rad = [(0.0, 0.0)], math.radians(bearing_deg)
    for number, leg_m in enumerate(legs_m):
        east_m, north_m = points[-1]
        points.append((east_m + leg_m * math.sin(bearing_rad), north_m + leg_m * math.cos(bearing_rad)))
        if number < len(turns_deg):
            bearing_rad += math.radians(turns_deg[number])
    return np.array(points)


def _to_microdegrees(angle_deg: float) -> float:
    """No bend or bearing of 1e-292 degrees: GEOS warns of dividing by zero there, and no mission has one."""
    return round(angle_deg, 6)


routes = st.integers(1, 7).flatmap(
    lambda n: st.builds(
        polyline,
        st.lists(st.floats(2, 60), min_size=n, max_size=n),
        st.lists(turns.map(_to_microdegrees), min_size=n, max_size=n),
        st.floats(-180, 180).map(_to_microdegrees),
    )
)


@settings(max_examples=30)
@given(first=routes, second=routes, heading_deg=st.sampled_from([None, 0.0, 170.0]))
def test_what_is_known_of_corners_changes_no_other_drive(
    first: np.ndarray, second: np.ndarray, heading_deg: float | None
) -> None:
    rover = replace(SLOW_ROVER, has_measured_corners=None)
    known: dict[int, dict] = {}
    drives = [
        (first, None),
        (np.vstack([first, second + first[-1]]), heading_deg),
        (first + 7.0, None),
        (first, 0.0),
    ]
    for points, faces_deg in drives:
        for stops in ({}, {1: 2.0}):
            own = plan_drive(points, rover, heading_deg=faces_deg, stops=stops)
            shared = plan_drive(points, rover, heading_deg=faces_deg, stops=stops, known=known)
            assert [plan.corners for plan in shared.plans] == [plan.corners for plan in own.plans]
            assert shared.arrivals_s.tolist() == own.arrivals_s.tolist()
    assert set(known) == {0, 1}


# --- measured on ArduPilot Rover -------------------------------------------------------------------------------------------


def measured_drives() -> list[list[dict[str, str]]]:
    drives = defaultdict(list)
    with (DATA / "corners.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            drives[row["drive"]].append(row)
    return list(drives.values())


def foreseen(drive: list[dict[str, str]]) -> tuple[Envelope, list[int]]:
    """Foresee a measured drive; also the waypoint of each of its rows."""
    first = drive[0]
    vehicle = Vehicle(
        waypoint_radius_m=float(first["wp_radius_m"]),
        speed_mps=float(first["wp_speed_mps"]),
        steering=Steering(first["vehicle"]),
    )
    slow = first["set"] == "slow1at5"  # 1 m/s from 5 m before to 6 m after each corner
    legs_m, turns_deg, speeds, numbers = [], [], [], []
    for row in drive:
        before_m = float(row["leg_before_m"])
        if slow:
            legs_m += [before_m - (11 if legs_m else 5), 5]
            turns_deg += [0.0, float(row["turn_deg"])]
            speeds += [None, 1.0]
            numbers.append(len(legs_m))
            legs_m.append(6)
            turns_deg.append(0.0)
            speeds.append(1.0)
        else:
            legs_m.append(before_m)
            turns_deg.append(float(row["turn_deg"]))
            speeds.append(None)
            numbers.append(len(legs_m))
    legs_m.append(float(drive[-1]["leg_after_m"]) - (6 if slow else 0))
    speeds.append(None)
    if slow:
        turns_deg = [turn for number, turn in enumerate(turns_deg) if number < len(legs_m) - 1]
    stops = dict.fromkeys(numbers, 1.0) if first["set"] == "delay" else None
    return envelope(
        polyline(legs_m, turns_deg), vehicle, heading_deg=0.0, speeds=speeds, stops=stops
    ), numbers


@pytest.mark.parametrize("kind", ["clean", "delay", "slow1at5", "straight"])
def test_measured_corners_stay_within_the_area(kind: str) -> None:
    checked = 0
    for drive in measured_drives():
        if drive[0]["set"] != kind:
            continue
        track, numbers = foreseen(drive)
        by_waypoint = {corner.waypoint: corner for corner in track.corners}
        for row, number in zip(drive, numbers, strict=True):
            checked += 1
            corner = by_waypoint[number]
            assert corner.turn_deg == pytest.approx(float(row["turn_deg"]), abs=1e-6)
            assert corner.inside_cut_m >= float(row["inside_cut_m"]) - 0.1, row
            assert corner.outside_overshoot_m >= float(row["outside_overshoot_m"]) - 0.1, row
            if kind != "slow1at5":
                inside_m, outside_m = area_extents(
                    track, number, float(row["leg_before_m"]), float(row["leg_after_m"])
                )
                assert inside_m >= float(row["inside_cut_m"]) - 0.1, row
                assert outside_m >= float(row["outside_overshoot_m"]) - 0.1, row
    assert checked >= {"clean": 576, "delay": 384, "slow1at5": 96, "straight": 28}[kind]


def test_little_room_is_wasted_on_measured_corners() -> None:
    waste = []
    for drive in measured_drives():
        if drive[0]["set"] == "clean":
            track, _ = foreseen(drive)
            for row, corner in zip(drive, track.corners, strict=True):
                waste.append(corner.inside_cut_m - float(row["inside_cut_m"]))
                waste.append(corner.outside_overshoot_m - float(row["outside_overshoot_m"]))
    assert np.median(waste) < 0.25
    assert np.percentile(waste, 90) < 0.5


def test_times_of_measured_corners() -> None:
    errors_s = []
    for drive in measured_drives():
        if drive[0]["set"] == "clean":
            track, _ = foreseen(drive)
            errors_s += [
                abs(corner.time_lost_s - float(row["time_lost_s"]))
                for row, corner in zip(drive, track.corners, strict=True)
            ]
    assert np.median(errors_s) < 0.2
    assert np.percentile(errors_s, 90) < 0.8


def driven(name: str) -> tuple[LocalFrame, np.ndarray, np.ndarray, np.ndarray]:
    """Read waypoints, track and track times of a recorded run."""
    with (DATA / "drives" / f"{name}.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    places = [LatLon(float(row["lat_deg"]), float(row["lon_deg"])) for row in rows]
    frame = LocalFrame(places[0])
    local = frame.to_local_array(places)
    count = sum(row["kind"] == "waypoint" for row in rows)
    return frame, local[:count], local[count:], np.array([float(row["time_s"]) for row in rows[count:]])


def fence_lines(path: Path, frame: LocalFrame) -> shapely.Geometry:
    fence = waypoint_file.read(path.read_text(), path.name).fence.value
    shapes = []
    for zone in fence.zones:
        if isinstance(zone, PolygonZone):
            ring = Polygon(frame.to_local_array(zone.vertices))
            shapes.append(ring.exterior if zone.kind is ZoneKind.INCLUSION else ring)
        else:
            assert zone.kind is ZoneKind.EXCLUSION
            shapes.append(Point(frame.to_local(zone.centre)).buffer(zone.radius_m, quad_segs=64))
    return shapely.union_all(shapes)


@pytest.mark.parametrize("name", ["maze-2m", "maze-5m", "yard-3m"])
def test_recorded_drives(name: str, fields: Path) -> None:
    frame, points, track, times_s = driven(name)
    first_leg_deg = math.degrees(math.atan2(*(points[1] - points[0])))
    foreseen = envelope(points, ROVER, heading_deg=first_leg_deg)
    assert shapely.distance(foreseen.area, shapely.points(track)).max() <= 0.1
    assert foreseen.duration_s == pytest.approx(times_s[-1] - times_s[0], rel=0.1)
    fence = fence_lines(fields / f"{name[:4]}-fence.waypoints", frame)
    least_m = LineString(track).distance(fence)
    assert least_m - 0.75 <= foreseen.clearance_m(fence) <= least_m + 0.05


# --- the speed along the lines ----------------------------------------------------------------------------------------------


@given(
    st.lists(st.floats(8, 60), min_size=1, max_size=5),
    st.lists(turns, min_size=4, max_size=4),
    vehicles,
)
def test_speeds_along_the_lines_take_as_long_as_the_legs_and_begin_and_end_at_rest(
    legs_m: list[float], turns_deg: list[float], vehicle: Vehicle
) -> None:
    points = polyline(legs_m, turns_deg)
    band = envelope(points, vehicle, heading_deg=0.0)
    along_m = np.linspace(0.0, sum(legs_m), 400)
    speeds_mps = band.speeds_mps(along_m)
    assert speeds_mps.max() <= vehicle.speed_mps + 1e-9
    assert speeds_mps.min() >= 0.0
    assert (speeds_mps[0], speeds_mps[-1]) == pytest.approx((0.0, 0.0), abs=1e-6)
    tops = [leg.top_speed_mps for leg in band.legs]
    for corner in band.corners:
        at_mps = float(band.speeds_mps(np.array([sum(legs_m[: corner.waypoint])]))[0])
        assert at_mps <= max(tops[corner.waypoint - 1 : corner.waypoint + 1]) + 1e-9
        assert not corner.stops or at_mps == pytest.approx(0.0, abs=1e-6)


@given(st.floats(5, 80), st.floats(0.5, 6), st.floats(0.3, 3), st.floats(0.3, 3))
def test_a_straight_leg_takes_what_its_speeds_say(
    length_m: float, speed_mps: float, accel_mps2: float, jerk_mps3: float
) -> None:
    vehicle = Vehicle(
        waypoint_radius_m=1.0, speed_mps=speed_mps, accel_max_mps2=accel_mps2, jerk_mps3=jerk_mps3
    )
    band = envelope(polyline([length_m], []), vehicle, heading_deg=0.0)
    places_m = np.linspace(0.01 * length_m, 0.99 * length_m, 20_000)
    took_s = float((np.diff(places_m) / band.speeds_mps(places_m)[1:]).sum())
    profile = leg_profile(length_m, speed_mps, accel_mps2, jerk_mps3)
    inner_s = [
        s
        for s in np.linspace(0, profile.duration_s, 20_001)
        if places_m[0] <= profile.travelled_m(s) <= places_m[-1]
    ]
    assert took_s == pytest.approx(inner_s[-1] - inner_s[0], rel=0.02)


def test_px4_slows_down_to_the_speed_that_it_takes_a_corner_at() -> None:
    steers = Pursuit(
        acceptance_m=0.5, acceptance_max_m=3.0, acceptance_gain=2.0, wheel_base_m=0.321,
        steering_angle_rad=0.5236, speed_reduction=0.5, full_speed_mps=3.0,
    )  # fmt: skip
    vehicle = Vehicle(
        waypoint_radius_m=0.5, speed_mps=3.0, turn_radius_m=0.556, autopilot=Autopilot.PX4, pursuit=steers
    )
    band = envelope(polyline([30, 30], [90]), vehicle, heading_deg=0.0)
    along_m = np.array([15.0, 29.0, 30.0, 31.0, 45.0])
    speeds_mps = band.speeds_mps(along_m)
    assert speeds_mps[[0, 4]] == pytest.approx(3.0)
    assert speeds_mps[2] == pytest.approx(3.0 * (1 - 0.5 * 90 / 180))
    assert speeds_mps[2] < speeds_mps[1] <= 3.0
    assert speeds_mps[1] == pytest.approx(speeds_mps[3])


# --- the motion along a leg --------------------------------------------------------------------------------------------------


@given(st.floats(0.3, 200), st.floats(0.1, 8), st.floats(0.2, 5), st.floats(0.2, 5))
def test_a_leg_keeps_its_limits_and_ends_at_rest(
    length_m: float, speed_mps: float, accel_mps2: float, jerk_mps3: float
) -> None:
    profile = leg_profile(length_m, speed_mps, accel_mps2, jerk_mps3)
    times_s = np.linspace(0, profile.duration_s, 4001)
    step_s = times_s[1]
    places_m = np.array([profile.travelled_m(time_s) for time_s in times_s])
    speeds_mps = np.diff(places_m) / step_s
    accels_mps2 = np.diff(speeds_mps) / step_s
    jerks_mps3 = np.diff(accels_mps2) / step_s
    noise = 1e-10 / step_s**3 + 1e-6
    assert places_m[0] == 0
    assert places_m[-1] == pytest.approx(length_m)
    assert speeds_mps.min() >= -1e-9
    assert speeds_mps.max() <= min(speed_mps, profile.top_speed_mps) * (1 + 1e-9)
    assert abs(accels_mps2).max() <= accel_mps2 * (1 + 1e-3) + noise
    assert abs(jerks_mps3).max() <= jerk_mps3 * (1 + 1e-3) + noise
    assert max(speeds_mps[0], speeds_mps[-1]) <= jerk_mps3 * step_s**2


@given(st.floats(0.3, 200), st.floats(0.2, 5), st.floats(0.2, 5))
def test_a_short_leg_uses_all_of_its_length(length_m: float, accel_mps2: float, jerk_mps3: float) -> None:
    profile = leg_profile(length_m, 1000.0, accel_mps2, jerk_mps3)
    assert 2 * profile.ramp.length_m == pytest.approx(length_m)


@given(st.lists(st.tuples(st.floats(0.3, 200), st.floats(0.1, 8)), min_size=1, max_size=4))
def test_many_legs_at_once_run_as_each_alone(legs: list[tuple[float, float]]) -> None:
    profiles = [leg_profile(length_m, speed_mps, 1.0, 1.5) for length_m, speed_mps in legs]
    counts = [7 + number for number in range(len(profiles))]
    times_s = [
        np.linspace(0.0, profile.duration_s, count) for profile, count in zip(profiles, counts, strict=True)
    ]
    alone_m = [
        profile.travelled_m(time_s)
        for profile, own_s in zip(profiles, times_s, strict=True)
        for time_s in own_s.tolist()
    ]
    assert all_travelled_m(profiles, counts, np.concatenate(times_s)) == pytest.approx(alone_m, abs=1e-9)


@given(vehicles, st.floats(2, 60), st.floats(2, 60), turns)
def test_blends_start_as_early_as_allowed(
    vehicle: Vehicle, before_m: float, after_m: float, turn_deg: float
) -> None:
    """Against a search in time of the conditions that SCurve::advance_target_along_track tests."""
    assume(abs(turn_deg) > 1)
    legs = [
        leg_profile(length_m, vehicle.speed_mps, vehicle.accel_max_mps2, vehicle.jerk_mps3)
        for length_m in (before_m, after_m)
    ]
    found = blend(vehicle, *legs, turn_deg)
    longest_s = min(leg.ramp.duration_s for leg in legs)
    assert 0 <= found.duration_s <= longest_s + 1e-9
    if found.duration_s > 0:
        assert turn_middle(vehicle, legs, turn_deg, found.duration_s * (1 - 1e-6), 1.01)
    if found.duration_s < longest_s * 0.98:
        assert not turn_middle(vehicle, legs, turn_deg, found.duration_s * 1.01 + 1e-5, 1.0)


def turn_middle(
    vehicle: Vehicle, legs: list[LegProfile], turn_deg: float, duration_s: float, slack: float
) -> bool:
    """Whether the middle of a turn of such a duration lies within the waypoint radius and the lateral limit."""
    turn_rad = math.radians(turn_deg)
    ahead, onward = np.array([0.0, 1.0]), np.array([math.sin(turn_rad), math.cos(turn_rad)])
    step_s = 1e-3 * duration_s
    left, onto = legs

    def at(offset_s: float) -> np.ndarray:
        half_s = duration_s / 2
        back_m = left.length_m - left.travelled_m(left.duration_s - half_s + offset_s)
        return -ahead * back_m + onward * onto.travelled_m(half_s + offset_s)

    accel_mps2 = np.hypot(*(at(step_s) - 2 * at(0) + at(-step_s))) / step_s**2
    radius_m = vehicle.waypoint_radius_m
    if vehicle.steering is Steering.ACKERMANN:
        radius_m = max(radius_m, vehicle.turn_radius_m)
    return np.hypot(*at(0)) <= radius_m and accel_mps2 <= vehicle.turn_max_g * 9.80665 * slack


# --- the envelope -------------------------------------------------------------------------------------------------------------


@given(vehicles, routes, st.one_of(st.none(), st.floats(-360, 360)))
def test_the_envelope_is_sound(vehicle: Vehicle, points: np.ndarray, heading_deg: float | None) -> None:
    track = envelope(points, vehicle, heading_deg=heading_deg)
    assert track.area.is_valid
    assert shapely.is_valid(track.pieces).all()
    assert track.area.geom_type == "Polygon"  # one piece joins the next
    assert track.area.covers(Point(points[0]))
    assert track.area.covers(Point(points[-1]))
    assert (np.diff(track.arrivals_s) > 0).all()
    assert len(track.legs) == len(points) - 1
    assert len(track.corners) == max(len(points) - 2, 0)
    assert track.duration_s >= sum(leg.length_m for leg in track.legs) / vehicle.speed_mps
    for leg, (start, end) in zip(track.legs, pairwise(points), strict=True):
        assert leg.length_m == pytest.approx(math.dist(start, end))
        assert leg.half_width_m <= min(leg.left_m, leg.right_m) + 1e-9
        assert leg.top_speed_mps <= vehicle.speed_mps


def at_a_threshold(points: np.ndarray, heading_deg: float) -> bool:
    """Whether rounding decides what the model does: about its steps in length and angle."""
    steps = np.diff(points, axis=0)
    bearings_deg = np.degrees(np.arctan2(steps[:, 0], steps[:, 1]))
    angles_deg = np.abs((np.diff(bearings_deg, prepend=heading_deg) + 180) % 360 - 180)
    off_deg = [np.abs(angles_deg - step_deg).min() for step_deg in (0, 10, 58, 60, 62, 165, 180)]
    return min(*off_deg, np.abs(np.hypot(*steps.T) - 3).min()) < 1e-6


@settings(
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)  # older draws like thresholds
@given(vehicles, routes, st.floats(-180, 180), st.floats(-180, 180))
def test_the_same_drive_elsewhere_and_turned(
    vehicle: Vehicle, points: np.ndarray, heading_deg: float, turned_deg: float
) -> None:
    turned_rad = math.radians(turned_deg)
    rotation = np.array(
        [[math.cos(turned_rad), -math.sin(turned_rad)], [math.sin(turned_rad), math.cos(turned_rad)]]
    )

    def moved(area: shapely.Geometry) -> shapely.Geometry:
        return shapely.transform(area, lambda places: places @ rotation + (300.0, -200.0))

    assume(not at_a_threshold(points, heading_deg))
    here = envelope(points, vehicle, heading_deg=heading_deg)
    there = envelope(points @ rotation + (300.0, -200.0), vehicle, heading_deg=heading_deg + turned_deg)
    assert there.duration_s == pytest.approx(here.duration_s, abs=1e-3)
    assert shapely.hausdorff_distance(there.area, moved(here.area)) < 0.1
    for mine, other in zip(here.corners, there.corners, strict=True):
        assert other.inside_cut_m == pytest.approx(mine.inside_cut_m, abs=1e-3)
        assert other.outside_overshoot_m == pytest.approx(mine.outside_overshoot_m, abs=1e-3)


@given(vehicles, routes, st.floats(-170, 170))
def test_mirrored_drives_have_mirrored_bands(
    vehicle: Vehicle, points: np.ndarray, heading_deg: float
) -> None:
    right = envelope(points, vehicle, heading_deg=heading_deg)
    left = envelope(points * (-1, 1), vehicle, heading_deg=-heading_deg)
    assert left.duration_s == pytest.approx(right.duration_s)
    for mine, other in zip(right.legs, left.legs, strict=True):
        assert (other.left_m, other.right_m) == pytest.approx((mine.right_m, mine.left_m))
    for corner, mirrored in zip(right.corners, left.corners, strict=True):
        assert mirrored.turn_deg == pytest.approx(-corner.turn_deg)
        if abs(corner.turn_deg) > 1e-6:
            assert mirrored.inside_cut_m == pytest.approx(corner.inside_cut_m)


def test_an_unknown_heading_is_no_better_than_straight_on_short_legs() -> None:
    vehicle = Vehicle(
        waypoint_radius_m=1.0, speed_mps=3.0, turn_radius_m=1.0, accel_max_mps2=0.5, jerk_mps3=1.0
    )
    points = np.array([(0.0, 0.0), (0.0, 12.0), (0.0, 14.0), (0.0, 44.0), (0.0, 46.0)])
    unknown, known = envelope(points, vehicle), envelope(points, vehicle, heading_deg=0.0)
    assert unknown.area.buffer(1e-6).covers(known.area)


@given(vehicles, routes, st.floats(-176, 176))
def test_an_unknown_heading_is_the_worst_but_exactly_back(
    vehicle: Vehicle, points: np.ndarray, off_deg: float
) -> None:
    east_m, north_m = points[1] - points[0]
    heading_deg = math.degrees(math.atan2(east_m, north_m)) + off_deg
    unknown, known = envelope(points, vehicle), envelope(points, vehicle, heading_deg=heading_deg)
    # To half a millimetre: two unions of many rounded pieces differ by up to 0.11 mm.
    assert unknown.area.buffer(5e-4).covers(known.area)
    assert unknown.duration_s >= known.duration_s - 1e-9


@given(vehicles, routes, st.floats(-60, 60), st.floats(-60, 60), st.floats(0.1, 20))
def test_clearance_is_the_distance_of_the_area(
    vehicle: Vehicle, points: np.ndarray, east_m: float, north_m: float, size_m: float
) -> None:
    track = envelope(points, vehicle, heading_deg=0.0)
    obstacle = shapely.box(east_m, north_m, east_m + size_m, north_m + size_m)
    clearance_m = track.clearance_m(obstacle)
    distance_m = track.area.distance(obstacle)
    if clearance_m > 0:
        assert distance_m == pytest.approx(clearance_m, abs=0.01)
        assert distance_m <= clearance_m + 1e-9  # the area's round ends are drawn no narrower than they are
    else:
        assert distance_m <= 1e-9


@given(vehicles, st.floats(-90, 90), st.floats(20, 60))
def test_a_cut_stays_in_the_triangle_of_its_legs(vehicle: Vehicle, turn_deg: float, leg_m: float) -> None:
    points = polyline([leg_m, leg_m], [turn_deg])
    track = envelope(points, vehicle, heading_deg=0.0)
    band_m = max(leg.half_width_m for leg in track.legs)
    outside_m = max(corner.outside_overshoot_m for corner in track.corners)
    allowed = Polygon([*points, points[0]]).convex_hull.buffer(max(outside_m, band_m) * 1.02 + END_OVERRUN_M)
    assert allowed.covers(track.area)
    bisector = points[0] + points[2] - 2 * points[1]
    length_m = np.hypot(*bisector)
    if length_m > 1:
        # Along the bisector nothing lies farther in than the cut that is told for the corner.
        beyond_m = track.corners[0].inside_cut_m / math.cos(math.radians(turn_deg) / 2) + 0.15
        mine = shapely.union_all(track.pieces[track.waypoints == 1])
        assert mine.distance(Point(points[1] + bisector / length_m * (beyond_m + 0.3))) > 0


@pytest.mark.parametrize("vehicle", [ROVER, SLOW_ROVER, TANK])
@pytest.mark.parametrize("turn_deg", [-165, -120, -60, -20, 0, 45, 90, 105, 150])
def test_one_corner_by_itself(vehicle: Vehicle, turn_deg: float) -> None:
    track = envelope(polyline([200, 200], [turn_deg]), vehicle, heading_deg=0.0)
    alone = corner_forecast(turn_deg, vehicle, leg_before_m=200, leg_after_m=200)
    whole = track.corners[0]
    for name in ("turn_deg", "inside_cut_m", "outside_overshoot_m", "reach_m", "time_lost_s"):
        assert getattr(alone, name) == pytest.approx(getattr(whole, name), abs=1e-6)
    assert (alone.stops, alone.pivots) == (whole.stops, whole.pivots)


def test_cuts_by_the_formula_of_the_blend() -> None:
    """Half a stopping manoeuvre of 5 m/s with 1 m/s² and 1 m/s³ is 3.17 m; 3 m of waypoint radius allow less beyond 56°."""
    assert corner_forecast(45, ROVER).inside_cut_m == pytest.approx(
        3.167 * math.sin(math.radians(45)) + 0.3, abs=1e-2
    )
    reach_m = 3 / (2 * math.sin(math.radians(60)))
    assert corner_forecast(120, ROVER).inside_cut_m == pytest.approx(
        reach_m * math.sin(math.radians(120)) + 0.3, abs=1e-2
    )


def test_means_against_a_cut() -> None:
    plain = corner_forecast(60, ROVER)
    slower = corner_forecast(60, ROVER, speed_mps=1.0)
    stopped = corner_forecast(60, ROVER, stop_s=1.0)
    small_radius = corner_forecast(60, replace(ROVER, waypoint_radius_m=1.0))
    assert slower.inside_cut_m < 0.5 < small_radius.inside_cut_m < plain.inside_cut_m
    assert stopped.inside_cut_m < 1.0
    assert (
        stopped.outside_overshoot_m > plain.outside_overshoot_m + 0.5
    )  # a stop swings out on steered wheels
    assert plain.time_lost_s < small_radius.time_lost_s < stopped.time_lost_s


def test_two_gentle_corners_swing_less_than_a_sharp_one() -> None:
    sharp = envelope(polyline([60, 60], [120]), ROVER, heading_deg=0.0)
    gentle = envelope(polyline([60, 15, 60], [60, 60]), ROVER, heading_deg=0.0)
    assert max(corner.outside_overshoot_m for corner in gentle.corners) < sharp.corners[0].outside_overshoot_m


@pytest.mark.parametrize(
    ("vehicle", "first_m", "heading_deg", "is_wider"),
    [
        (ROVER, 0.7, 90.0, True),
        (ROVER, 2.9, 135.0, True),
        (ROVER, 3.1, 135.0, False),
        (ROVER, 0.7, 10.0, False),
        (ROVER, 0.7, None, True),
        (TANK, 0.7, 90.0, False),
    ],
)
def test_a_run_too_short_for_the_swing_of_the_start_widens_the_corridor(
    vehicle: Vehicle, first_m: float, heading_deg: float | None, is_wider: bool
) -> None:
    """The simulated rover left the corridor by up to 0.9 m there, and breached a fence (circles 1 of `benchmarks/drive.py`)."""
    there = (20.0, first_m + 20.0)
    turning, straight = (
        envelope(np.array([(0.0, 0.0), (0.0, first_m), there_m]), vehicle, heading_deg=heading_deg)
        for there_m in (there, (0.0, 30.0))
    )
    for after in (0, 1):
        leg = turning.legs[after]
        assert (min(leg.left_m, leg.right_m) - leg.half_width_m >= 0.5) is is_wider or heading_deg is None
    if is_wider:
        assert max(turning.legs[0].left_m, turning.legs[0].right_m) == pytest.approx(
            max(straight.legs[0].left_m, straight.legs[0].right_m) + 0.9, abs=0.2
        )


def test_so_after_a_stop() -> None:
    points = np.array([(-30.0, 0.0), (0.0, 0.0), (0.0, 0.7), (20.0, 20.7)])
    stopping = envelope(points, ROVER, heading_deg=90.0, stops={1: 1.0}).legs[2]
    settled = envelope(points * (1.0, 5.0), ROVER, heading_deg=90.0, stops={1: 1.0}).legs[2]
    assert stopping.left_m > settled.left_m + 0.5


def test_a_tail_dies_away() -> None:
    track = envelope(polyline([40, 100], [150]), SLOW_ROVER, heading_deg=0.0)
    onward = track.points[2] - track.points[1]
    onward /= np.hypot(*onward)
    across = np.array([-onward[1], onward[0]])  # to the left, the outside of a right turn
    widths_m = []
    for along_m in (3, 6, 12, 25, 80):
        place = track.points[1] + onward * along_m
        ray = LineString([place, place + across * 10])
        widths_m.append(ray.intersection(shapely.union_all(track.pieces[track.waypoints == 2])).length)
    assert all(near > far for near, far in pairwise(widths_m[:4]))
    assert widths_m[0] > 1.0
    assert widths_m[-1] == pytest.approx(0.3, abs=0.025)


def test_skid_steer_pivots_at_sharp_corners() -> None:
    sharp, gentle = corner_forecast(90, TANK), corner_forecast(45, TANK)
    assert sharp.pivots
    assert sharp.stops
    assert sharp.inside_cut_m < 0.4
    assert sharp.outside_overshoot_m < 0.4
    assert not gentle.pivots
    assert gentle.time_lost_s < sharp.time_lost_s - 3


@pytest.mark.parametrize("turn_deg", [59.5, -60, 60.5])
def test_at_the_pivot_angle_either_may_happen(turn_deg: float) -> None:
    track = envelope(polyline([50, 50], [turn_deg]), TANK, heading_deg=0.0)
    assert track.area.covers(Point(track.points[1]))
    cut_m = track.corners[0].inside_cut_m
    assert cut_m > corner_forecast(50, TANK).inside_cut_m


def test_skid_steer_that_may_not_pivot_swings_out() -> None:
    assert corner_forecast(150, replace(TANK, pivot_angle_deg=0.0)).outside_overshoot_m > 1.0


def test_a_pivot_without_a_rate_limit_takes_no_time_of_its_own() -> None:
    unlimited = corner_forecast(90, replace(TANK, pivot_rate_dps=0.0))
    assert unlimited.time_lost_s == pytest.approx(corner_forecast(90, TANK).time_lost_s - 1.5)


def test_a_wide_turning_circle_swings_farther() -> None:
    assert corner_forecast(150, replace(ROVER, turn_radius_m=3.0)).outside_overshoot_m > 3.0


def test_points_on_one_another_are_a_stop() -> None:
    track = envelope([(0, 0), (0, 30), (0.02, 30), (30, 30)], ROVER, heading_deg=0.0)
    (corner,) = track.corners
    assert corner.waypoint == 2
    assert corner.stops
    assert corner.turn_deg == pytest.approx(90, abs=0.1)
    assert track.arrivals_s[1] == track.arrivals_s[2]
    assert len(track.legs) == 2
    assert corner.outside_overshoot_m > 1.6  # measured on a route with two points 3 cm apart: 1.63 m


def test_points_near_one_another_turn_as_one() -> None:
    together = envelope(polyline([40, 1, 40], [60, 60]), SLOW_ROVER, heading_deg=0.0)
    apart = envelope(polyline([40, 20, 40], [60, 60]), SLOW_ROVER, heading_deg=0.0)
    assert together.corners[1].outside_overshoot_m > apart.corners[1].outside_overshoot_m + 0.5


def test_turns_to_and_fro_are_no_great_turn() -> None:
    fro = envelope(polyline([40, 1, 40], [60, -60]), SLOW_ROVER, heading_deg=0.0)
    assert fro.corners[1].outside_overshoot_m == pytest.approx(fro.corners[0].outside_overshoot_m, abs=0.5)


def test_a_route_of_one_point() -> None:
    track = envelope([(5, 5)], ROVER, heading_deg=0.0)
    assert track.duration_s == 0
    assert track.corners == track.legs == ()
    assert track.clearance_m(Point(5, 8)) == pytest.approx(2.8)


def test_a_route_whose_points_are_one_place() -> None:
    track = envelope([(5, 5), (5.1, 5)], ROVER)
    assert track.duration_s == 0
    assert track.area.covers(LineString(track.points))


def test_nothing_near() -> None:
    assert envelope([(0, 0), (0, 10)], ROVER).clearance_m(Polygon()) == math.inf


def test_delays_and_speeds_take_their_time() -> None:
    points = polyline([50, 50], [30])
    plain = envelope(points, ROVER, heading_deg=0.0)
    delayed = envelope(points, ROVER, heading_deg=0.0, stops={1: 10.0})
    slow = envelope(points, ROVER, heading_deg=0.0, speeds=[1.0, None])
    assert delayed.duration_s > plain.duration_s + 10
    assert slow.duration_s == pytest.approx(plain.duration_s + 40, abs=5)
    assert slow.legs[0].half_width_m < slow.legs[1].half_width_m
    assert slow.corners[0].inside_cut_m < plain.corners[0].inside_cut_m


@pytest.mark.parametrize(
    ("turn_deg", "speeds", "stops", "bounded"),
    [
        (0.0, [None, 1.0], {}, True),
        (8.0, [None, 1.0], {}, True),
        (30.0, [None, 1.0], {}, False),
        (30.0, [1.0, None], {}, False),
        (30.0, [1.0, 1.0], {}, True),
        (30.0, None, {}, True),
        (30.0, [None, 1.0], {1: 1.0}, True),
    ],
)
def test_a_change_of_speed_at_a_corner_is_not_bounded(
    turn_deg: float, speeds: list[float | None] | None, stops: dict[int, float], bounded: bool
) -> None:
    turn_rad = math.radians(turn_deg)
    points = [(0.0, -50.0), (0.0, 0.0), (50.0 * math.sin(turn_rad), 50.0 * math.cos(turn_rad))]
    (corner,) = envelope(points, Vehicle(speed_mps=5.0), heading_deg=0.0, speeds=speeds, stops=stops).corners
    assert corner.bounded is bounded


@given(vehicles, routes, st.floats(0.2, 6))
def test_px4_may_take_the_whole_corner(vehicle: Vehicle, points: np.ndarray, radius_m: float) -> None:
    px4 = replace(vehicle, autopilot=Autopilot.PX4, waypoint_radius_m=radius_m)
    track = envelope(points, px4, heading_deg=0.0)
    for corner in track.corners:
        if not corner.stops:
            place, before = points[corner.waypoint], points[corner.waypoint - 1]
            early = place + (before - place) / np.hypot(*(before - place)) * radius_m
            mine = shapely.union_all(track.pieces[track.waypoints == corner.waypoint])
            assert mine.distance(Point(place)) < 1e-6
            assert mine.distance(Point(early)) < 1e-6
            assert corner.inside_cut_m >= min(
                abs(math.sin(math.radians(corner.turn_deg))) * radius_m, radius_m
            )


def test_sharp_turns_on_short_legs_are_named() -> None:
    def bounded(turn_deg: float, leg_m: float, vehicle: Vehicle = ROVER) -> bool:
        corner: Corner = corner_forecast(turn_deg, vehicle, leg_before_m=leg_m, leg_after_m=leg_m)
        return corner.bounded

    assert not bounded(150, 5)
    assert bounded(150, 30)
    assert bounded(90, 5)
    assert bounded(150, 5, TANK)


def test_vehicles_of_the_measured_kind() -> None:
    assert beyond_measured(ROVER) == beyond_measured(SLOW_ROVER) == beyond_measured(TANK) == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"autopilot": Autopilot.PX4, "steering": Steering.ACKERMANN}, "this PX4 rover steers is not known"),
        ({"boat_drift_m": 2.0}, "boat"),
        (
            {"speed_mps": 8.0},
            "WP_SPEED 8 m/s was not measured (only 1 to 5, ackermann steering): the drive may differ",
        ),
        ({"steering": Steering.SKID}, "WP_SPEED 5 m/s was not measured (only 0.2 to 3, skid"),
        ({"turn_radius_m": 2.5}, "TURN_RADIUS 2.5 m was not"),
        ({"turn_max_g": 0.1}, "ATC_TURN_MAX_G 0.1 g was not"),
        ({"accel_max_mps2": 4.0}, "ATC_ACCEL_MAX 4 m/s² was not"),
        ({"jerk_mps3": 0.1}, "WP_JERK 0.1 m/s³ was not"),
        ({"position_gain_per_s": 1.0}, "PSC_POS_P 1 /s was not"),
    ],
)
def test_vehicles_beyond_what_was_measured(changes: dict[str, object], words: str) -> None:
    (sentence,) = beyond_measured(replace(ROVER, **changes))
    assert words in sentence


@pytest.mark.parametrize("points", [[], [(0, 0, 0)], [(0, math.nan)], [1, 2], [(0, 0), (math.inf, 0)]])
def test_points_that_are_none(points: list[object]) -> None:
    with pytest.raises(InvalidPositionError, match="points of two finite numbers"):
        envelope(points, ROVER)


@pytest.mark.parametrize("speeds", [[1.0], [1.0, 0.0], [1.0, -2.0], [math.nan, None], [math.inf, None]])
def test_speeds_that_are_none(speeds: list[float | None]) -> None:
    with pytest.raises(VehicleError, match="speed"):
        envelope([(0, 0), (0, 10), (10, 10)], ROVER, speeds=speeds)
