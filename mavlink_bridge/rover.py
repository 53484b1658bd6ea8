"""What is ArduPilot Rover's own: its mode numbers."""

from __future__ import annotations

AUTO_MODE = 10
HOLD_MODE = 4
RTL_MODE = 11
GUIDED_MODE = 15

MODE_NAMES = {
    0: "MANUAL",
    1: "ACRO",
    3: "STEERING",
    HOLD_MODE: "HOLD",
    5: "LOITER",
    6: "FOLLOW",
    7: "SIMPLE",
    8: "DOCK",
    9: "CIRCLE",
    AUTO_MODE: "AUTO",
    RTL_MODE: "RTL",
    12: "SMART_RTL",
    GUIDED_MODE: "GUIDED",
    16: "INITIALISING",
}
"""HEARTBEAT.custom_mode by name."""
