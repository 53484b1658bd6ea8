"""Turns back and stops in mid-route of a real ArduPilot Rover, against the corridor (data/turns_back.csv, docs/drive-model.md 3)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drive_model.real_tracks import beyond_m, rows_of, track_of, vehicle_of

from missions.drive_model import envelope

ROWS = "turns_back.csv"
WITH_BAND_M = 0.12
"""So much beyond the corridor counts as inside it: the places of the rover are 0.3 m apart, and its waypoints are known to a centimetre."""


def driven(row: dict[str, str]) -> tuple[float, bool]:
    """Return how far a row leaves its corridor, and whether the model has a bound for its turn."""
    leg_m, onward_m, delay_s = (float(row[name]) for name in ("leg_m", "onward_m", "delay_s"))
    turn = math.radians(float(row["turn_deg"]))
    points = [(0.0, 0.0), (0.0, leg_m), (onward_m * math.sin(turn), leg_m + onward_m * math.cos(turn))]
    stops = {1: delay_s} if delay_s else None
    drive = envelope(np.array(points), vehicle_of(row), heading_deg=0.0, stops=stops)
    return beyond_m(drive, track_of(row)), drive.corners[0].bounded


@pytest.mark.parametrize("firmware", ["2024-02", "2025-10"])
@pytest.mark.parametrize("stops", [True, False])
def test_they_stay_in_the_corridor(firmware: str, stops: bool) -> None:
    """Where the model says that it knows them: before 4.6 not the sharpest turns that are driven through."""
    checked = 0
    left_m = {}
    for row in rows_of(ROWS):
        if row["firmware"] != firmware or (row["delay_s"] != "0") is not stops:
            continue
        away_m, bounded = driven(row)
        checked += 1
        if bounded and away_m > WITH_BAND_M:
            left_m[tuple(row.values())[:5]] = away_m
    assert checked >= 20
    assert left_m == {}


def test_a_rover_that_stops_turns_where_it_stands() -> None:
    """The farthest past a waypoint with a delay is 2.3 m, where a start that faces exactly back may go on for more."""
    farthest_m = max(
        track_of(row)[:, 1].max() - float(row["leg_m"]) for row in rows_of(ROWS) if row["delay_s"] != "0"
    )
    assert farthest_m == pytest.approx(2.3, abs=0.06)
