"""Turns back and stops in mid-route of a real ArduPilot Rover, against the corridor (data/turns_back.csv, docs/drive-model.md 3)."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
import shapely

from missions.drive_model import envelope
from missions.vehicle import Vehicle

WITH_BAND_M = 0.12
"""So much beyond the corridor counts as inside it: the places of the rover are 0.3 m apart, and its waypoints are known to a centimetre."""


def rows() -> list[dict[str, str]]:
    with (Path(__file__).parent / "data" / "turns_back.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def beyond_m(row: dict[str, str]) -> tuple[float, bool]:
    """Return how far a row leaves its corridor, and whether the model has a bound for its turn."""
    leg_m, onward_m = float(row["leg_m"]), float(row["onward_m"])
    turn = math.radians(float(row["turn_deg"]))
    points = [(0.0, 0.0), (0.0, leg_m), (onward_m * math.sin(turn), leg_m + onward_m * math.cos(turn))]
    vehicle = Vehicle(
        waypoint_radius_m=float(row["wp_radius_m"]),
        speed_mps=float(row["speed_mps"]),
        turn_radius_m=0.9,
        has_measured_corners=row["firmware"] == "2025-10",
    )
    delay_s = float(row["delay_s"])
    drive = envelope(np.array(points), vehicle, heading_deg=0.0, stops={1: delay_s} if delay_s else None)
    track = np.array([[float(one) for one in pair.split(",")] for pair in row["track_m"].split()])
    away_m = float(shapely.distance(shapely.union_all(drive.pieces), shapely.points(track)).max())
    return away_m, drive.corners[0].bounded


@pytest.mark.parametrize("firmware", ["2024-02", "2025-10"])
@pytest.mark.parametrize("stops", [True, False])
def test_they_stay_in_the_corridor(firmware: str, stops: bool) -> None:
    """Where the model says that it knows them; before 4.6 no turns back were known, nor stops at them."""
    checked = 0
    left_m = {}
    for row in rows():
        if row["firmware"] != firmware or (row["delay_s"] != "0") is not stops:
            continue
        away_m, bounded = beyond_m(row)
        checked += 1
        if bounded and away_m > WITH_BAND_M:
            left_m[tuple(row.values())[:5]] = away_m
    assert checked >= 20
    assert left_m == {}


def test_a_rover_that_stops_turns_where_it_stands() -> None:
    """The farthest past a waypoint with a delay is 2.3 m, where a start that faces exactly back may go on for more."""
    farthest_m = max(
        float(pair.split(",")[1]) - float(row["leg_m"])
        for row in rows()
        if row["delay_s"] != "0"
        for pair in row["track_m"].split()
    )
    assert farthest_m == pytest.approx(2.3, abs=0.06)
