"""MAV_CMD as ArduRover answers it, by COMMAND_LONG and COMMAND_INT."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandInt, CommandLong, MavResult, Message
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import streams
from missions.geo import from_e7
from missions.items import Command, CoordinateFrame

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.simulator.rover import Rover
    from mavlink_bridge.simulator.streams import Streams

_WHOLE: dict[int, tuple[str, ...]] = {
    Command.DO_SET_MODE: ("param2",),
    Command.DO_SET_MISSION_CURRENT: ("param1",),
    Command.SET_MESSAGE_INTERVAL: ("param1", "param2"),
    Command.REQUEST_MESSAGE: ("param1",),
    Command.DO_REPOSITION: ("param2",),
    Command.DO_CHANGE_SPEED: ("param2",),
}
"""The parameters that have to be a number."""

_CHANGE_MODE = 1  # MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
_LOCAL_FRAMES = (CoordinateFrame.LOCAL_NED, CoordinateFrame.MISSION)


class CommandServer:
    """Does what commands ask for.

    Parameters
    ----------
    rover : Rover
        Whose commands they are.
    streams_of : callable
        Returns the timetable of telemetry.
    report : callable
        Returns a message by its id, None where it is not known.
    renew : callable
        Is called after a parameter has changed, with its name.
    is_ready : callable
        Returns whether the rover may be armed at a moment.
    """

    def __init__(
        self,
        rover: Rover,
        streams_of: Callable[[], Streams],
        report: Callable[[int, float], Message | None],
        renew: Callable[[str], None],
        is_ready: Callable[[float], bool],
    ) -> None:
        self._rover = rover
        self._streams = streams_of
        self._report = report
        self._renew = renew
        self._is_ready = is_ready

    def execute(self, command: CommandLong | CommandInt, now_s: float) -> tuple[MavResult, list[Message]]:
        """Do a command; return its result and what else is to be sent."""
        if not all(math.isfinite(getattr(command, name)) for name in _WHOLE.get(command.command, ())):
            return MavResult.DENIED, []  # what a microcontroller makes of NaN as a whole number is its own
        if command.command == Command.DO_REPOSITION:
            if isinstance(command, CommandLong):
                return MavResult.UNSUPPORTED, []
            return self._reposition(command, now_s), []
        if command.command in (
            Command.REQUEST_MESSAGE,
            Command.GET_HOME_POSITION,
            Command.REQUEST_AUTOPILOT_CAPABILITIES,
        ):
            return self._request(command, now_s)
        done = self._do(command, now_s)
        return MavResult.UNSUPPORTED if done is None else done, []

    def _do(self, command: CommandLong | CommandInt, now_s: float) -> MavResult | None:
        rover = self._rover
        result: MavResult | None = None
        match command.command:
            case Command.DO_SET_MODE:
                result = _done(rover.set_mode(int(command.param2), now_s))
            case Command.MISSION_START:
                result = _done(rover.set_mode(Mode.AUTO, now_s))
            case Command.COMPONENT_ARM_DISARM:
                result = self._arm(command.param1, now_s)
            case Command.DO_SET_MISSION_CURRENT:
                restart = command.param2 == 1
                result = _done(rover.set_current_item(int(command.param1), restart=restart, now_s=now_s))
            case Command.DO_CHANGE_SPEED:
                result = self._change_speed(command.param2)
            case Command.DO_FENCE_ENABLE:
                result = self._enable_fence(command.param1)
            case Command.SET_MESSAGE_INTERVAL:
                result = _done(self._streams().set_interval(int(command.param1), command.param2, now_s))
        return result

    def _change_speed(self, speed_mps: float) -> MavResult:
        if not speed_mps > 0:
            return MavResult.DENIED
        self._rover.drive.change_speed(speed_mps)
        return MavResult.ACCEPTED

    def _enable_fence(self, wanted: float) -> MavResult:
        if wanted not in (0, 1):
            return MavResult.FAILED
        self._rover.parameters.set("FENCE_ENABLE", wanted)
        self._renew("FENCE_ENABLE")
        return MavResult.ACCEPTED

    def _arm(self, wanted: float, now_s: float) -> MavResult:
        if wanted == 0:
            self._rover.disarm()
            return MavResult.ACCEPTED
        if wanted != 1:
            return MavResult.UNSUPPORTED
        if not self._is_ready(now_s):
            self._rover.texts.append((2, "Arm: Need Position Estimate"))
            return MavResult.FAILED
        self._rover.arm()
        return MavResult.ACCEPTED

    def _reposition(self, command: CommandInt, now_s: float) -> MavResult:
        rover = self._rover
        change_mode = bool(int(command.param2) & _CHANGE_MODE)
        on_earth = abs(command.x) <= 900_000_000 and abs(command.y) <= 1_800_000_000
        if not on_earth or (command.x, command.y) == (0, 0) or command.frame in _LOCAL_FRAMES:
            return MavResult.DENIED
        if change_mode:
            rover.set_mode(Mode.GUIDED, now_s)
        if not rover.go_to(from_e7(command.x, command.y)):
            return MavResult.DENIED
        if command.param1 > 0:
            rover.drive.change_speed(command.param1)
        return MavResult.ACCEPTED

    def _request(self, command: CommandLong | CommandInt, now_s: float) -> tuple[MavResult, list[Message]]:
        if command.command == Command.REQUEST_MESSAGE:
            wanted = int(command.param1)
        elif command.command == Command.GET_HOME_POSITION:
            wanted = streams.HOME_POSITION
        else:
            wanted = streams.AUTOPILOT_VERSION
        message = self._report(wanted, now_s)
        return (MavResult.FAILED, []) if message is None else (MavResult.ACCEPTED, [message])


def _done(worked: bool) -> MavResult:  # noqa: FBT001
    return MavResult.ACCEPTED if worked else MavResult.FAILED
