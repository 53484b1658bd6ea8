"""COMMAND_ACKs to whoever commands our own component."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.director.targets import Target
    from mavlink_bridge.mavlink.messages import Frame, Message

_Asker = tuple[int, int]


class Answers:
    """Owes at most one answer, to the newest target's asker, and repeats what was said to one who asks again.

    Parameters
    ----------
    send : callable
        Takes what is to be sent.
    """

    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send = send
        self._owed: _Asker | None = None
        self._said: dict[_Asker, m.MavResult] = {}

    def begin(self, target: Target) -> None:
        """Answer that a target is being worked on; another asker's is given up for it."""
        asker = target.asker if target.is_to_us else None
        if self._owed is not None and self._owed != asker:
            self.settle(m.MavResult.CANCELLED)
        self._owed = asker
        if asker is not None:
            self._say(asker, Command.DO_REPOSITION, m.MavResult.IN_PROGRESS)

    def settle(self, result: m.MavResult) -> None:
        """Send the answer that is owed, if one is."""
        if self._owed is not None:
            self._say(self._owed, Command.DO_REPOSITION, result)
            self._owed = None

    def refuse(self, frame: Frame, result: m.MavResult) -> None:
        """Answer a command that is not done."""
        message = frame.message
        assert isinstance(message, m.CommandInt | m.CommandLong)
        self._say((frame.system, frame.component), message.command, result)

    def repeat(self, frame: Frame) -> None:
        """Answer one who asks for the same once more, having missed the answer."""
        asker = (frame.system, frame.component)
        self._say(asker, Command.DO_REPOSITION, self._said.get(asker, m.MavResult.IN_PROGRESS))

    def _say(self, asker: _Asker, command: int, result: m.MavResult) -> None:
        if command == Command.DO_REPOSITION:
            self._said[asker] = result
        self._send(m.CommandAck(command, result, target_system=asker[0], target_component=asker[1]))
