"""Modes of each autopilot: their numbers in HEARTBEAT.custom_mode, their names, how one is asked for, and how one knows that one is in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MavType, ModeFlag
from mavlink_bridge.mavlink.rover import Mode, mode_of, plain_mode_name
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

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
_PX4_AUTO_MAIN, _PX4_MISSION = 4, 4  # PX4_CUSTOM_MAIN_MODE_AUTO, PX4_CUSTOM_SUB_MODE_AUTO_MISSION
_ROVERS = (None, MavType.GROUND_ROVER, MavType.SURFACE_BOAT)


@dataclass(frozen=True, slots=True)
class Modes:
    """An autopilot's modes.

    Parameters
    ----------
    hold, mission, rtl : int
        HEARTBEAT.custom_mode of the mode that stops, that drives the mission, and that drives home.
    homing : frozenset of int
        The modes in which it drives home by itself, straight.
    guided : int, optional
        The mode in which a go-to click makes it drive; None where a click makes it drive in the one that stops.
    of_commands : mapping of int to int
        Commands that it answers with a change of mode.
    answer_counts : bool
        Whether ACCEPTED means that the vehicle is in the mode. PX4 1.17 accepts any mode, also one that it does not have: only its heartbeat counts.
    asked_by : callable
        Returns param2 and param3 of the DO_SET_MODE that asks for a mode; None for a number that is not a mode of this autopilot.
    asked_for : callable
        Returns the mode that param2 and param3 of a DO_SET_MODE ask for; None where they are no mode of any kind.
    named : callable
        Returns a mode's name, or "mode" and its number.
    """

    hold: int
    mission: int
    rtl: int
    homing: frozenset[int]
    guided: int | None
    of_commands: Mapping[int, int]
    answer_counts: bool
    asked_by: Callable[[int], tuple[float, float] | None]
    asked_for: Callable[[float, float], int | None]
    named: Callable[[int], str]

    def words(self, mode: int | None) -> str:
        """Return a mode's name for people, marked where this autopilot has no such mode; None is one that is not known."""
        if mode is None:
            return "another mode"
        return self.named(mode) + ("" if self.asked_by(mode) is not None else " (unknown)")

    def command_params(self, mode: int) -> tuple[float, float, float]:
        """Return param1 to param3 of the DO_SET_MODE that asks for a mode.

        Raises
        ------
        ValueError
            The number is not a mode of this autopilot. Numbers are never handed on unseen: ArduPilot's HOLD (4) makes a PX4 rover drive its mission.
        """
        asked = self.asked_by(mode)
        if asked is None:
            raise ValueError(f"{mode} is not a mode of this autopilot")
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


def _ardupilot_asked_for(param2: float, _param3: float) -> int | None:
    return mode_of(param2)


def _px4_asked_for(param2: float, param3: float) -> int | None:
    """Return the mode; AUTO without a sub-mode is the mission, as measured."""
    main, sub = mode_of(param2), mode_of(param3)
    if main is None or main > 0xFF or sub is None or sub > 0xFF:
        return None
    return px4_mode(main, _PX4_MISSION if main == _PX4_AUTO_MAIN and not sub else sub)


def _px4_named(mode: int) -> str:
    main, sub = mode >> 16 & 0xFF, mode >> 24 & 0xFF
    name = _PX4_MAIN.get(main, f"mode {mode}")
    return f"{name}.{_PX4_AUTO.get(sub, sub)}" if main == _PX4_AUTO_MAIN and sub else name


_ARDUPILOT_MODES = frozenset(Mode)
ARDUPILOT_MODES = Modes(
    hold=Mode.HOLD,
    mission=Mode.AUTO,
    rtl=Mode.RTL,
    homing=frozenset({Mode.RTL, Mode.SMART_RTL}),
    guided=Mode.GUIDED,
    of_commands={
        Command.NAV_RETURN_TO_LAUNCH: Mode.RTL,
        Command.NAV_LOITER_UNLIM: Mode.HOLD,
        Command.MISSION_START: Mode.AUTO,
    },
    answer_counts=True,
    asked_by=_ardupilot_asked,
    asked_for=_ardupilot_asked_for,
    named=plain_mode_name,
)
PX4_MODES = Modes(
    hold=px4_mode(_PX4_AUTO_MAIN, 3),
    mission=px4_mode(_PX4_AUTO_MAIN, _PX4_MISSION),
    rtl=px4_mode(_PX4_AUTO_MAIN, 5),
    homing=frozenset({px4_mode(_PX4_AUTO_MAIN, 5)}),
    guided=None,
    of_commands={
        Command.NAV_RETURN_TO_LAUNCH: px4_mode(_PX4_AUTO_MAIN, 5),
        Command.NAV_LOITER_UNLIM: px4_mode(_PX4_AUTO_MAIN, 3),
        Command.MISSION_START: px4_mode(_PX4_AUTO_MAIN, _PX4_MISSION),
    },
    answer_counts=False,
    asked_by=_px4_asked,
    asked_for=_px4_asked_for,
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
