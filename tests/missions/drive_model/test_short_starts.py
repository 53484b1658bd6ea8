"""Starts of a real ArduPilot Rover that faces away from a short first leg, against the corridor (data/short_starts.csv, docs/drive-model.md 3)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import shapely

from missions.drive_model import envelope
from missions.vehicle import Vehicle

WITH_BAND_M = 0.15
"""So much beyond the corridor counts as inside it, as with the corners."""


def starts() -> list[tuple[Vehicle, float, list[tuple[float, float]], np.ndarray]]:
    """Return vehicle, heading, points and track of each start that goes on without stopping, east and north in metres."""
    with (Path(__file__).parent / "data" / "short_starts.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["onward_m"] != "0" or float(row["leg_m"]) > 10]
    found = []
    for row in rows:
        leg_m, onward_m = float(row["leg_m"]), float(row["onward_m"])
        points = [(0.0, 0.0), (0.0, leg_m), *([(onward_m, leg_m)] if onward_m else [])]
        vehicle = Vehicle(
            waypoint_radius_m=float(row["wp_radius_m"]),
            speed_mps=float(row["speed_mps"]),
            turn_radius_m=0.9,
            has_measured_corners=row["firmware"] == "2025-10",
        )
        track = np.array([[float(one) for one in pair.split(",")] for pair in row["track_m"].split()])
        found.append((vehicle, float(row["heading_off_deg"]), points, track))
    return found


def test_they_stay_in_the_corridor() -> None:
    beyond_m = {}
    for vehicle, heading_deg, points, track in starts():
        corridor = shapely.union_all(envelope(np.array(points), vehicle, heading_deg=heading_deg).pieces)
        away_m = float(shapely.distance(corridor, shapely.points(track)).max())
        if away_m > WITH_BAND_M:
            beyond_m[
                vehicle.has_measured_corners, vehicle.speed_mps, points[1][1], heading_deg, len(points)
            ] = away_m
    assert beyond_m == {}


@pytest.mark.parametrize("is_new", [True, False])
def test_the_room_behind_is_needed(is_new: bool) -> None:
    """The rows reach farther back than a corridor without it: 4.3 and 8.2 m behind."""
    farthest_m = -min(
        track[:, 1].min() for vehicle, _, _, track in starts() if vehicle.has_measured_corners is is_new
    )
    assert farthest_m == pytest.approx(4.3 if is_new else 8.2, abs=0.06)
