"""Recorded tracks of real rovers (data/*.csv with a column track_m): their rows, their vehicles, and how far they leave a corridor."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from missions.vehicle import Vehicle

if TYPE_CHECKING:
    from missions.drive_model import Envelope

DATA = Path(__file__).parent / "data"


def rows_of(name: str) -> list[dict[str, str]]:
    with (DATA / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def track_of(row: dict[str, str]) -> np.ndarray:
    """Return the places of a row, shape (n, 2), east and north in metres."""
    return np.array([[float(one) for one in pair.split(",")] for pair in row["track_m"].split()])


def vehicle_of(row: dict[str, str]) -> Vehicle:
    return Vehicle(
        waypoint_radius_m=float(row["wp_radius_m"]),
        speed_mps=float(row["speed_mps"]),
        turn_radius_m=0.9,
        has_measured_corners=row["firmware"] == "2025-10",
    )


def beyond_m(drive: Envelope, track: np.ndarray) -> float:
    """Return how far a track leaves the corridor of a drive."""
    return float(shapely.distance(shapely.union_all(drive.pieces), shapely.points(track)).max())
