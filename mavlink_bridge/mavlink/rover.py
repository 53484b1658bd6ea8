"""What is ArduPilot Rover's own: its mode numbers."""

from __future__ import annotations

import math

# HEARTBEAT.custom_mode of ArduPilot Rover (ROVER_MODE in ardupilotmega.xml).
AUTO_MODE = 10
HOLD_MODE = 4
LOITER_MODE = 5
RTL_MODE = 11
SMART_RTL_MODE = 12
GUIDED_MODE = 15

MODE_NAMES = {
    0: "MANUAL",
    1: "ACRO",
    3: "STEERING",
    HOLD_MODE: "HOLD",
    LOITER_MODE: "LOITER",
    6: "FOLLOW",
    7: "SIMPLE",
    8: "DOCK",
    9: "CIRCLE",
    AUTO_MODE: "AUTO",
    RTL_MODE: "RTL",
    SMART_RTL_MODE: "SMART_RTL",
    GUIDED_MODE: "GUIDED",
    16: "INITIALISING",
}
"""HEARTBEAT.custom_mode by name."""

_MOST_MODE = 0xFFFFFFFF
"""HEARTBEAT.custom_mode has 32 bits."""


def mode_name(mode: int | None) -> str:
    """Return a mode's name; its number, marked as unknown, where Rover has no such mode."""
    if mode is None:
        return "another mode"
    return MODE_NAMES.get(mode, f"mode {mode} (unknown)")


def mode_of(param: float) -> int | None:
    """Return the mode number that a command's parameter asks for; None where it is no whole number of 32 bits, which no vehicle takes."""
    if not math.isfinite(param) or param != int(param) or not 0 <= param <= _MOST_MODE:
        return None
    return int(param)
