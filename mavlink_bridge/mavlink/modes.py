"""Modes by name: ArduPilot Rover's and PX4's numbers in HEARTBEAT.custom_mode."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.mavlink.messages import MavType
from mavlink_bridge.mavlink.rover import Mode, plain_mode_name

_PX4_MAIN: Final = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    4: "AUTO",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STABILIZED",
    8: "RATTITUDE",
}
_PX4_AUTO: Final = {
    1: "READY",
    2: "TAKEOFF",
    3: "LOITER",
    4: "MISSION",
    5: "RTL",
    6: "LAND",
    8: "FOLLOW",
    9: "PRECLAND",
}
_PX4_AUTO_MAIN, _PX4_MISSION = 4, 4  # PX4_CUSTOM_MAIN_MODE_AUTO, PX4_CUSTOM_SUB_MODE_AUTO_MISSION


def mode_name(mode: int, mav_type: int | None, *, ardupilot: bool | None) -> str:
    """Return a mode's name, or its number where the vehicle's modes are not known here.

    Parameters
    ----------
    mode : int
        HEARTBEAT.custom_mode. PX4 keeps its main mode in bits 16 to 23, its sub-mode in bits 24 to 31 (px4_custom_mode.h).
    mav_type : int or None
        MAV_TYPE: ArduPilot numbers the modes of each kind of vehicle anew.
    ardupilot : bool or None
        Whether the autopilot is ArduPilot.
    """
    if ardupilot is False:
        main, sub = mode >> 16 & 0xFF, mode >> 24 & 0xFF
        name = _PX4_MAIN.get(main, f"mode {mode}")
        return f"{name}.{_PX4_AUTO.get(sub, sub)}" if main == _PX4_AUTO_MAIN and sub else name
    is_rover = mav_type in (None, MavType.GROUND_ROVER, MavType.SURFACE_BOAT)
    return plain_mode_name(mode) if is_rover else f"mode {mode}"


def drives_mission(mode: int | None, mav_type: int | None, *, ardupilot: bool | None) -> bool:
    """Return whether a mode drives the mission: AUTO, on PX4 AUTO.MISSION."""
    if mode is None:
        return False
    if ardupilot is False:
        return (mode >> 16 & 0xFF, mode >> 24 & 0xFF) == (_PX4_AUTO_MAIN, _PX4_MISSION)
    return mode == Mode.AUTO and mav_type in (None, MavType.GROUND_ROVER, MavType.SURFACE_BOAT)
