"""Corners that ArduPilot Rover drove, in software in the loop: every one lies inside its bound, or is of a kind that is called extrapolated.

`corners_before_4_6.csv`: 1,192 corners of a development version of November 2024, which begins turns as the releases up to 4.5.7 do, in the order
driven. `corners_by_parameters.csv`: 1,574 corners of slow rovers and of other parameters, with firmware before 4.6, since, and 4.7.
"""

from __future__ import annotations

import csv
import math
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from drive_model.extents import area_extents

from missions.drive_model import Corner, Envelope, beyond_measured, corner_forecast, envelope, extrapolated
from missions.drive_model.calibrated_range import SAME_MPS, SAME_TURN_DEG
from missions.drive_model.corner import start_swing_m
from missions.firmware import Firmware, read_firmware
from missions.vehicle import Steering, Vehicle, vehicle_from_parameters

DATA = Path(__file__).parent / "data"
STEERING = {
    "ackermann": {"SERVO1_FUNCTION": 26.0, "SERVO3_FUNCTION": 70.0},
    "skid": {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0},
}
MEASURED = {
    "ATC_TURN_MAX_G": 0.6,
    "ATC_ACCEL_MAX": 1.0,
    "ATC_STR_RAT_MAX": 120.0,
    "ATC_STR_ACC_MAX": 120.0,
    "PSC_POS_P": 0.2,
}
Row = dict[str, str]


def drives(name: str) -> list[list[Row]]:
    found = defaultdict(list)
    with (DATA / name).open(newline="") as file:
        for row in csv.DictReader(file):
            found[row["drive"]].append(row)
    return list(found.values())


def vehicle_of(row: Row) -> Vehicle:
    firmware = row.get("firmware", "4.5")
    words = row.get("parameters", "").split()
    parameters = {
        **STEERING[row["vehicle"]],
        **MEASURED,
        "WP_SPEED": float(row["wp_speed_mps"]),
        "WP_RADIUS": float(row["wp_radius_m"]),
        "TURN_RADIUS": float(row.get("turn_radius_m", 0.9)),
        "WP_PIVOT_ANGLE": 0.0 if firmware == "4.7" else 60.0,
        **dict(zip(words[::2], map(float, words[1::2]), strict=True)),
    }
    return vehicle_from_parameters(parameters, firmware=read_firmware(firmware))


def foreseen(drive: list[Row], vehicle: Vehicle) -> Envelope:
    leg_m, bearing_rad = float(drive[0]["leg_m"]), 0.0
    points = [np.zeros(2)]
    for turn_deg in [*(float(row["turn_deg"]) for row in drive), 0.0]:
        points.append(points[-1] + leg_m * np.array([math.sin(bearing_rad), math.cos(bearing_rad)]))
        bearing_rad += math.radians(turn_deg)
    return envelope(np.array(points), vehicle, heading_deg=0.0)


def spare_m(row: Row, corner: Corner) -> tuple[float, float]:
    """Return how much more than the measured the bound is, inside and outside."""
    assert corner.turn_deg == pytest.approx(float(row["turn_deg"]), abs=1e-6)
    inside_m = corner.inside_cut_m - float(row["inside_cut_m"])
    return inside_m, corner.outside_overshoot_m - float(row["outside_overshoot_m"])


@pytest.mark.parametrize("known", [False, None], ids=["older", "unknown"])
def test_every_corner_before_4_6_is_inside_its_bound_or_extrapolated(known: bool | None) -> None:
    counted = Counter()
    for drive in drives("corners_before_4_6.csv"):
        vehicle = replace(vehicle_of(drive[0]), has_measured_corners=known)
        track = foreseen(drive, vehicle)
        told = extrapolated(vehicle, track)
        too_fast = drive[0]["vehicle"] == "skid" and drive[0]["wp_speed_mps"] == "5"
        # Sharp turns between legs of 10 m are beyond what bounds the firmware since, which an unknown one may be.
        assert bool(told) is (too_fast or not all(corner.bounded for corner in track.corners)), told
        for row, corner in zip(drive, track.corners, strict=True):
            counted[bool(told)] += 1
            assert too_fast or min(spare_m(row, corner)) >= -0.05, row
    assert counted == ({False: 1076, True: 116} if known is False else {False: 836, True: 356})


def test_the_bounds_before_4_6_are_no_wider_than_they_need_be() -> None:
    spare: dict[tuple[str, str, bool], list[tuple[float, float]]] = defaultdict(list)
    for drive in drives("corners_before_4_6.csv"):
        first = drive[0]
        if (first["vehicle"], first["wp_speed_mps"]) != ("skid", "5"):
            track = foreseen(drive, vehicle_of(first))
            for row, corner in zip(drive, track.corners, strict=True):
                is_sharp = abs(corner.turn_deg) > 120
                spare[first["vehicle"], first["set"], is_sharp].append(spare_m(row, corner))
    medians = {kind: np.median(both, axis=0).round(2).tolist() for kind, both in spare.items()}
    assert medians == SPARE_M


SPARE_M = {  # by vehicle, set, and whether it turns by more than 120°: how much wider than the row, inside and outside
    ("ackermann", "long", False): [0.55, 0.23],
    ("ackermann", "long", True): [0.56, 0.28],
    ("ackermann", "short", False): [1.29, 0.56],
    ("ackermann", "short", True): [3.77, 0.72],
    ("skid", "long", False): [0.43, 0.16],
    ("skid", "long", True): [0.42, 0.04],
    ("skid", "short", False): [0.49, 0.2],
    ("skid", "short", True): [0.47, 0.17],
}


def test_the_areas_before_4_6_hold_what_was_measured() -> None:
    """On long legs: on short ones swings to either side fill the ground about both legs."""
    checked = 0
    for drive in drives("corners_before_4_6.csv"):
        if drive[0]["set"] == "long" and (drive[0]["vehicle"], drive[0]["wp_speed_mps"]) != ("skid", "5"):
            track, leg_m = foreseen(drive, vehicle_of(drive[0])), float(drive[0]["leg_m"])
            for number, row in enumerate(drive, 1):
                checked += 1
                inside_m, outside_m = area_extents(track, number, leg_m, leg_m)
                assert inside_m >= float(row["inside_cut_m"]) - 0.05, row
                assert outside_m >= float(row["outside_overshoot_m"]) - 0.05, row
    assert checked == 656


def test_every_other_corner_is_inside_its_bound_or_extrapolated() -> None:
    counted: dict[str, Counter[bool]] = defaultdict(Counter)
    for drive in drives("corners_by_parameters.csv"):
        vehicle = vehicle_of(drive[0])
        track = foreseen(drive, vehicle)
        told = extrapolated(vehicle, track)
        for row, corner in zip(drive, track.corners, strict=True):
            slow = float(row["wp_speed_mps"]) < 1 and row["vehicle"] == "ackermann"
            kind = "slow steered" if slow else row["parameters"] or "defaults"
            counted[kind][bool(told)] += 1
            assert told or min(spare_m(row, corner)) >= -0.1, row
    assert {kind: dict(found) for kind, found in counted.items()} == OTHER


OTHER = {  # by parameters, and whether it is extrapolated: how many; those with defaults that are have WP_RADIUS 0.5, or are skid steer below 1 m/s before 4.6
    "ATC_ACCEL_MAX 0.5": {False: 70},
    "ATC_ACCEL_MAX 2": {False: 70},
    "ATC_DECEL_MAX 3": {False: 68},
    "ATC_STR_RAT_MAX 40": {True: 70},
    "ATC_STR_RAT_MAX 40 ATC_TURN_MAX_G 0.2": {True: 70},
    "ATC_TURN_MAX_G 0.2": {False: 70},
    "TURN_RADIUS 2": {False: 56},
    "WP_PIVOT_ANGLE 0": {False: 70},
    "WP_PIVOT_ANGLE 0 ATC_STR_RAT_MAX 40": {True: 28},
    "WP_PIVOT_ANGLE 0 ATC_TURN_MAX_G 0.2": {False: 28},
    "WP_PIVOT_ANGLE 60": {False: 50},
    "WP_PIVOT_RATE 30": {False: 28},
    "defaults": {False: 613, True: 40},
    "slow steered": {True: 243},
}


def test_a_skid_steered_start_is_taken_as_wide_as_what_was_driven_without_a_pivot() -> None:
    """Nothing was measured of starts for themselves; a corner that is driven through swings farther than one from rest."""
    checked = 0
    for drive in drives("corners_by_parameters.csv"):
        vehicle = vehicle_of(drive[0])
        if vehicle.steering is Steering.ACKERMANN or beyond_measured(vehicle):
            continue
        for row in drive:
            turn_deg = abs(float(row["turn_deg"]))
            if vehicle.pivot_angle_deg and turn_deg > vehicle.pivot_angle_deg:
                continue
            checked += 1
            at_rest = replace(vehicle, pivot_angle_deg=0.0, turn_radius_m=4.0)
            assert start_swing_m(at_rest, turn_deg) >= float(row["outside_overshoot_m"]) - 0.005, row
    assert checked == 500


def test_the_turning_radius_does_nothing_on_skid_steer() -> None:
    points = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 38.0)]
    bands = [
        envelope(
            points,
            Vehicle(steering=Steering.SKID, pivot_angle_deg=pivot_deg, turn_radius_m=radius_m),
            heading_deg=0.0,
        )
        for pivot_deg in (0.0, 60.0)
        for radius_m in (0.9, 4.0)
    ]
    for narrow, wide in (bands[:2], bands[2:]):
        assert wide.area.equals_exact(narrow.area, 1e-9)


def test_gentle_turns_and_pivots_are_driven_alike_before_4_6() -> None:
    checked = 0
    for row in (row for drive in drives("corners_before_4_6.csv") for row in drive):
        vehicle = replace(vehicle_of(row), has_measured_corners=True)
        corner = corner_forecast(
            float(row["turn_deg"]),
            vehicle,
            leg_before_m=float(row["leg_m"]),
            leg_after_m=float(row["leg_m"]),
        )
        gentle = abs(corner.turn_deg) <= SAME_TURN_DEG and vehicle.speed_mps <= SAME_MPS
        if row["set"] == "long" and row["wp_speed_mps"] != "5" and (corner.pivots or gentle):
            checked += 1
            assert min(spare_m(row, corner)) >= -0.05
    assert checked > 150


@pytest.mark.parametrize(
    ("turn_deg", "changes", "told"),
    [
        (90.0, {}, ()),
        (
            90.0,
            {"waypoint_radius_m": 4.0},
            ("WP_RADIUS 4 m was not measured before ArduPilot 4.6 (only 1 to 3)",),
        ),
        (15.0, {"waypoint_radius_m": 4.0}, ()),
        (90.0, {"waypoint_radius_m": 4.0, "steering": Steering.SKID}, ()),
        (
            90.0,
            {"accel_max_mps2": 2.0},
            ("ATC_ACCEL_MAX 2 m/s² was not measured before ArduPilot 4.6 (only 1)",),
        ),
        (175.0, {}, ("turns like those of this drive (up to 175°) were not measured",)),
        (175.0, {"has_measured_corners": True}, ()),
    ],
)
def test_an_unknown_firmware_counts_where_the_older_was_not_measured(
    turn_deg: float, changes: dict[str, object], told: tuple[str, ...]
) -> None:
    vehicle = replace(Vehicle(), **{"has_measured_corners": None, **changes})
    track = foreseen([{"turn_deg": str(turn_deg), "leg_m": "30"}], vehicle)
    found = extrapolated(vehicle, track)
    assert len(found) == len(told)
    for sentence, words in zip(found, told, strict=True):
        assert sentence.startswith("firmware unknown, which may be older than April 2025")
        assert words in sentence


def test_an_unknown_firmware_is_the_worse_of_both() -> None:
    for turn_deg in (30.0, 90.0, 150.0):
        forecasts = {
            known: corner_forecast(turn_deg, Vehicle(speed_mps=2.0, has_measured_corners=known))
            for known in (True, False, None)
        }
        for told in ("inside_cut_m", "outside_overshoot_m", "reach_m"):
            now, before, unknown = (getattr(forecasts[known], told) for known in (True, False, None))
            assert unknown == max(now, before)
        tracks = {
            known: foreseen([{"turn_deg": str(turn_deg), "leg_m": "30"}], Vehicle(has_measured_corners=known))
            for known in (True, False, None)
        }
        both = shapely.union_all([tracks[True].area, tracks[False].area])
        assert shapely.equals(shapely.normalize(both), shapely.normalize(tracks[None].area)) or (
            both.symmetric_difference(tracks[None].area).area < 1e-9
        )


def test_older_firmware_away_from_what_was_measured() -> None:
    usual = {**STEERING["ackermann"], "WP_SPEED": 2.0}

    def told(turns_deg: list[float], leg_m: float, **parameters: float) -> tuple[str, ...]:
        vehicle = vehicle_from_parameters({**usual, **parameters}, firmware=Firmware(4, 5, 7))
        rows = [{"turn_deg": str(turn_deg), "leg_m": str(leg_m)} for turn_deg in turns_deg]
        return extrapolated(vehicle, foreseen(rows, vehicle))

    assert told([90.0, -90.0], 10.0) == told([45.0], 5.0) == told([15.0], 3.0) == ()
    assert (
        "ArduPilot 4.5.7 (before 4.6): turns like those of this drive (up to 90°)"
        in told([90.0, 20.0], 9.0)[0]
    )
    assert "WP_RADIUS 4 m was not measured before ArduPilot 4.6" in told([20.0], 30.0, WP_RADIUS=4.0)[0]
    assert (
        "TURN_RADIUS 0.6 m was not measured before ArduPilot 4.6 (only 0.9)"
        in told([20.0], 30.0, TURN_RADIUS=0.6)[0]
    )
    skid = {**STEERING["skid"], "WP_PIVOT_ANGLE": 0.0}
    assert "(up to 90°)" in told([90.0], 30.0, **skid)[0]
    assert told([90.0], 30.0, **STEERING["skid"]) == ()
