"""MAV_CMD as PX4's rover answers it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandInt, CommandLong, MavResult, Message
from mavlink_bridge.simulator import streams
from missions.geo import LatLon, from_e7
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.simulator.px4.rover import Px4Rover

_UNUSED_1_18: dict[int, range] = {
    Command.DO_SET_MODE: range(4, 8),
    Command.COMPONENT_ARM_DISARM: range(3, 8),
}
"""Parameters that 1.18 wants 0 or NaN; measured of DO_SET_MODE's param4 to 7 and of param3 when arming."""

_CHANGE_MODE = 1  # MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
_NOT_SET = 2**31 - 1  # INT32_MAX


class Px4Commands:
    """Does what commands ask for.

    Parameters
    ----------
    rover : Px4Rover
        Whose commands they are.
    report : callable
        Returns a message by its id, None where it is not known.
    is_1_18 : bool
        Whether it answers as the line of 1.18 does.
    """

    def __init__(
        self, rover: Px4Rover, report: Callable[[int, float], Message | None], *, is_1_18: bool
    ) -> None:
        self._rover = rover
        self._report = report
        self._is_1_18 = is_1_18

    def execute(self, command: CommandLong | CommandInt, now_s: float) -> tuple[MavResult, list[Message]]:
        """Do a command; return its result and what else is to be sent."""
        if self._is_1_18 and any(
            _is_set(command, number) for number in _UNUSED_1_18.get(command.command, ())
        ):
            return MavResult.DENIED, []
        if not all(math.isfinite(value) for value in (command.param1, command.param2, command.param3)):
            return MavResult.DENIED, []  # what PX4 makes of them as whole numbers was not measured
        wanted = self._wanted_message(command)
        if wanted is not None:
            message = self._report(wanted, now_s)
            return (MavResult.ACCEPTED, [message]) if message is not None else (MavResult.DENIED, [])
        return self._do(command), []

    def _wanted_message(self, command: CommandLong | CommandInt) -> int | None:
        if command.command == Command.REQUEST_MESSAGE:
            return int(command.param1)
        if self._is_1_18:
            return None
        return {
            int(Command.GET_HOME_POSITION): streams.HOME_POSITION,
            int(Command.REQUEST_AUTOPILOT_CAPABILITIES): streams.AUTOPILOT_VERSION,
        }.get(command.command)

    def _do(self, command: CommandLong | CommandInt) -> MavResult:
        rover = self._rover
        match command.command:
            case Command.DO_SET_MODE:
                worked = rover.set_mode(int(command.param2), int(command.param3))
                tells = not worked and self._is_1_18
                return MavResult.TEMPORARILY_REJECTED if tells else MavResult.ACCEPTED
            case Command.COMPONENT_ARM_DISARM:
                return self._arm(command.param1)
            case Command.MISSION_START:
                return MavResult.ACCEPTED if rover.start_mission(int(command.param1)) else MavResult.DENIED
            case Command.DO_SET_MISSION_CURRENT if self._is_1_18:
                if command.param1 < -1 or command.param2 not in (0, 1):
                    return MavResult.DENIED
                return MavResult.ACCEPTED if rover.set_current(int(command.param1)) else MavResult.FAILED
            case Command.DO_REPOSITION:
                return self._reposition(command)
            case Command.SET_MESSAGE_INTERVAL:
                return MavResult.ACCEPTED
            case _:
                return MavResult.UNSUPPORTED

    def _arm(self, wanted: float) -> MavResult:
        if wanted == 0:
            self._rover.disarm("external command")
        elif wanted != 1:
            return MavResult.DENIED
        elif not self._rover.arm("external command"):
            return MavResult.TEMPORARILY_REJECTED
        return MavResult.ACCEPTED

    def _reposition(self, command: CommandLong | CommandInt) -> MavResult:
        """Drive there, without a place (QGroundControl's "Pause") to where it is, as read; without the flag 1.17 answers UNSUPPORTED and drives in HOLD all the same."""
        changes_mode = bool(int(command.param2) & _CHANGE_MODE)
        place: LatLon | None
        if isinstance(command, CommandInt):
            place = from_e7(command.x, command.y) if _NOT_SET not in (command.x, command.y) else None
        else:
            is_placed = math.isfinite(command.param5 + command.param6)
            place = LatLon(command.param5, command.param6) if is_placed else None
        drives = self._rover.is_armed and self._rover.go_to(place, changes_mode=changes_mode)
        if changes_mode:
            return MavResult.ACCEPTED
        if not self._is_1_18:
            return MavResult.UNSUPPORTED
        return MavResult.ACCEPTED if drives else MavResult.DENIED


def _is_set(command: CommandLong | CommandInt, number: int) -> bool:
    value = getattr(command, f"param{number}", 0.0)
    return not (value == 0 or math.isnan(value))
