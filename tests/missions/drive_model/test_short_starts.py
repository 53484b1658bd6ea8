"""Starts of a real ArduPilot Rover that faces away from a short first leg, against the corridor (data/short_starts.csv, docs/drive-model.md 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from drive_model.real_tracks import beyond_m, rows_of, track_of, vehicle_of

from missions.drive_model import envelope

if TYPE_CHECKING:
    from missions.vehicle import Vehicle

WITH_BAND_M = 0.15
"""So much beyond the corridor counts as inside it, as with the corners."""


def starts() -> list[tuple[Vehicle, float, list[tuple[float, float]], np.ndarray]]:
    """Return vehicle, heading, points and track of each start that goes on without stopping, east and north in metres."""
    found = []
    for row in rows_of("short_starts.csv"):
        if row["onward_m"] == "0" and float(row["leg_m"]) <= 10:
            continue
        leg_m, onward_m = float(row["leg_m"]), float(row["onward_m"])
        points = [(0.0, 0.0), (0.0, leg_m), *([(onward_m, leg_m)] if onward_m else [])]
        found.append((vehicle_of(row), float(row["heading_off_deg"]), points, track_of(row)))
    return found


def test_they_stay_in_the_corridor() -> None:
    left_m = {}
    for vehicle, heading_deg, points, track in starts():
        away_m = beyond_m(envelope(np.array(points), vehicle, heading_deg=heading_deg), track)
        if away_m > WITH_BAND_M:
            left_m[
                vehicle.has_measured_corners, vehicle.speed_mps, points[1][1], heading_deg, len(points)
            ] = away_m
    assert left_m == {}


@pytest.mark.parametrize("is_new", [True, False])
def test_the_room_behind_is_needed(is_new: bool) -> None:
    """The rows reach farther back than a corridor without it: 4.3 and 8.2 m behind."""
    farthest_m = -min(
        track[:, 1].min() for vehicle, _, _, track in starts() if vehicle.has_measured_corners is is_new
    )
    assert farthest_m == pytest.approx(4.3 if is_new else 8.2, abs=0.06)
