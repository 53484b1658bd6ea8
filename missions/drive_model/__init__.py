"""How a rover really drives a list of waypoints: a band it stays in, and a time (docs/drive-model.md)."""

from __future__ import annotations

from missions.drive_model.band import convex
from missions.drive_model.build import Drive, corner_forecast, envelope, plan_drive
from missions.drive_model.envelope import Corner, Envelope, Leg
from missions.drive_model.measured import beyond_measured

__all__ = [
    "Corner",
    "Drive",
    "Envelope",
    "Leg",
    "beyond_measured",
    "convex",
    "corner_forecast",
    "envelope",
    "plan_drive",
]
