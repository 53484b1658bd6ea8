"""What is ArduPilot Rover's own: its modes."""

from __future__ import annotations

import math
from enum import IntEnum


class Mode(IntEnum):
    """HEARTBEAT.custom_mode of ArduPilot Rover (ROVER_MODE in ardupilotmega.xml)."""

    MANUAL = 0
    ACRO = 1
    STEERING = 3
    HOLD = 4
    LOITER = 5
    FOLLOW = 6
    SIMPLE = 7
    DOCK = 8
    CIRCLE = 9
    AUTO = 10
    RTL = 11
    SMART_RTL = 12
    GUIDED = 15
    INITIALISING = 16


_KNOWN = frozenset(Mode)
_MOST_MODE = 0xFFFFFFFF
"""HEARTBEAT.custom_mode has 32 bits."""


def plain_mode_name(mode: int) -> str:
    """Return a mode's name; its number where Rover has no such mode."""
    return Mode(mode).name if mode in _KNOWN else f"mode {mode}"


def mode_name(mode: int | None) -> str:
    """Return a mode's name; its number, marked as unknown, where Rover has no such mode."""
    if mode is None:
        return "another mode"
    return plain_mode_name(mode) + ("" if mode in _KNOWN else " (unknown)")


def mode_of(param: float) -> int | None:
    """Return the mode number that a command's parameter asks for; None where it is no whole number of 32 bits, which no vehicle takes."""
    if not math.isfinite(param) or param != int(param) or not 0 <= param <= _MOST_MODE:
        return None
    return int(param)
