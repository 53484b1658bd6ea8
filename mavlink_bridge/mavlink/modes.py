"""Modes of each autopilot: their numbers in HEARTBEAT.custom_mode, their names, how one is asked for, and how one knows that one is in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MavType, ModeFlag
from mavlink_bridge.mavlink.rover import Mode, plain_mode_name

if TYPE_CHECKING:
    from collections.abc import Callable

_PX4_MAIN = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    4: "AUTO",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STABILIZED",
    8: "RATTITUDE",
}
_PX4_AUTO = {
    1: "READY",
    2: "TAKEOFF",
    3: "LOITER",
    4: "MISSION",
    5: "RTL",
    6: "LAND",
    8: "FOLLOW",
    9: "PRECLAND",
}
_PX4_AUTO_MAIN = 4  # PX4_CUSTOM_MAIN_MODE_AUTO
_ROVERS = (None, MavType.GROUND_ROVER, MavType.SURFACE_BOAT)


@dataclass(frozen=True, slots=True)
class Modes:
    """An autopilot's modes.

    Parameters
    ----------
    hold, mission, rtl : int
        HEARTBEAT.custom_mode of the mode that stops, that drives the mission, and that drives home.
    answer_counts : bool
        Whether ACCEPTED means that the vehicle is in the mode. PX4 1.17 accepts any mode, also one that it does not have: only its heartbeat counts.
    asked_by : callable
        Returns param2 and param3 of the DO_SET_MODE that asks for a mode; None for a number that is no mode of this autopilot.
    named : callable
        Returns a mode's name, or "mode" and its number.
    """

    hold: int
    mission: int
    rtl: int
    answer_counts: bool
    asked_by: Callable[[int], tuple[float, float] | None]
    named: Callable[[int], str]

    def command_params(self, mode: int) -> tuple[float, float, float]:
        """Return param1 to param3 of the DO_SET_MODE that asks for a mode.

        Raises
        ------
        ValueError
            The number is no mode of this autopilot. Numbers are never handed on unseen: ArduPilot's HOLD (4) makes a PX4 rover drive its mission.
        """
        asked = self.asked_by(mode)
        if asked is None:
            raise ValueError(f"{mode} is no mode of this autopilot")
        return float(ModeFlag.CUSTOM_MODE_ENABLED), *asked


def px4_mode(main: int, sub: int = 0) -> int:
    """Return HEARTBEAT.custom_mode of a PX4 mode: the main mode in bits 16 to 23, the sub-mode in bits 24 to 31 (px4_custom_mode.h)."""
    return main << 16 | sub << 24


def _ardupilot_asked(mode: int) -> tuple[float, float] | None:
    return (float(mode), 0.0) if mode in _ARDUPILOT_MODES else None


def _px4_asked(mode: int) -> tuple[float, float] | None:
    main, sub = mode >> 16 & 0xFF, mode >> 24 & 0xFF
    is_known = main in _PX4_MAIN and (sub in _PX4_AUTO if main == _PX4_AUTO_MAIN else sub == 0)
    return (float(main), float(sub)) if is_known and mode == px4_mode(main, sub) else None


def _px4_named(mode: int) -> str:
    main, sub = mode >> 16 & 0xFF, mode >> 24 & 0xFF
    name = _PX4_MAIN.get(main, f"mode {mode}")
    return f"{name}.{_PX4_AUTO.get(sub, sub)}" if main == _PX4_AUTO_MAIN and sub else name


_ARDUPILOT_MODES = frozenset(Mode)
ARDUPILOT_MODES = Modes(
    hold=Mode.HOLD,
    mission=Mode.AUTO,
    rtl=Mode.RTL,
    answer_counts=True,
    asked_by=_ardupilot_asked,
    named=plain_mode_name,
)
PX4_MODES = Modes(
    hold=px4_mode(_PX4_AUTO_MAIN, 3),
    mission=px4_mode(_PX4_AUTO_MAIN, 4),
    rtl=px4_mode(_PX4_AUTO_MAIN, 5),
    answer_counts=False,
    asked_by=_px4_asked,
    named=_px4_named,
)


def modes_of(*, ardupilot: bool | None) -> Modes:
    """Return the modes of the autopilot that is ArduPilot, or is not; where that is not known, ArduPilot's."""
    return PX4_MODES if ardupilot is False else ARDUPILOT_MODES


def mode_name(mode: int, mav_type: int | None, *, ardupilot: bool | None) -> str:
    """Return a mode's name, or its number where the vehicle's modes are not known here.

    Parameters
    ----------
    mode : int
        HEARTBEAT.custom_mode.
    mav_type : int or None
        MAV_TYPE: ArduPilot numbers the modes of each kind of vehicle anew.
    ardupilot : bool or None
        Whether the autopilot is ArduPilot.
    """
    if ardupilot is not False and mav_type not in _ROVERS:
        return f"mode {mode}"
    return modes_of(ardupilot=ardupilot).named(mode)


def drives_mission(mode: int | None, mav_type: int | None, *, ardupilot: bool | None) -> bool:
    """Return whether a mode drives the mission: AUTO, on PX4 AUTO.MISSION."""
    if mode is None or (ardupilot is not False and mav_type not in _ROVERS):
        return False
    return mode == modes_of(ardupilot=ardupilot).mission
