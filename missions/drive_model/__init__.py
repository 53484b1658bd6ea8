"""How a rover really drives a list of waypoints: a band it stays in, and a time (docs/drive-model.md)."""

from __future__ import annotations

from missions.drive_model.calibrated_range import beyond_measured, extrapolated
from missions.drive_model.envelope import Corner, Envelope, Leg
from missions.drive_model.predict import Drive, corner_forecast, envelope, plan_drive

__all__ = [
    "Corner",
    "Drive",
    "Envelope",
    "Leg",
    "beyond_measured",
    "corner_forecast",
    "envelope",
    "extrapolated",
    "plan_drive",
]
