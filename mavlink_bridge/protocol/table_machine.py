"""What all protocol machines share: a state moved by a table, and messages waiting to be sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import StrEnum

    from mavlink_bridge.mavlink.messages import Message

StateT = TypeVar("StateT", bound="StrEnum")
EventT = TypeVar("EventT", bound="StrEnum")


class Outbox:
    """Messages that wait to be sent."""

    def __init__(self) -> None:
        self._outgoing: list[Message] = []

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent now, in order, and forget it."""
        outgoing, self._outgoing = self._outgoing, []
        return outgoing

    def _send(self, message: Message) -> None:
        self._outgoing.append(message)


class TableMachine(Outbox, Generic[StateT, EventT]):
    """A state that moves only by its table.

    Parameters
    ----------
    table : mapping
        For each state the events it accepts and where they lead; a state that accepts none, or is not there, is an end.
    state : StateT
        Where the machine begins.
    """

    def __init__(self, table: Mapping[StateT, Mapping[EventT, StateT]], state: StateT) -> None:
        super().__init__()
        self._table = table
        self.state = state

    @property
    def is_done(self) -> bool:
        """Whether the machine has come to its outcome and wants no more calls."""
        return not self._table.get(self.state)

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    def _move(self, event: EventT) -> bool:
        """Go where the table leads; False if the state does not accept the event."""
        following = self._table.get(self.state, {}).get(event)
        if following is None:
            return False
        self.state = following
        return True
