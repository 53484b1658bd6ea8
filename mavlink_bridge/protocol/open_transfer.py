"""Which transfer of a list we have begun and not ended, as what goes out and comes in tells: for who has to leave in the middle of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Message
    from mavlink_bridge.protocol.peer import Peer


class OpenTransfer:
    """Follows our side of the mission protocol."""

    def __init__(self) -> None:
        self._mission_type: int | None = None

    def note_sent(self, message: Message) -> None:
        """Take what we have sent."""
        if isinstance(message, m.MissionCount | m.MissionRequestList):
            self._mission_type = int(message.mission_type)
        elif isinstance(message, m.MissionAck):
            self._mission_type = None

    def note_heard(self, message: Message, identity: tuple[int, int]) -> None:
        """Take what was heard; an ERROR ends no transfer of PX4's."""
        if not isinstance(message, m.MissionAck) or message.mission_type != self._mission_type:
            return
        is_to_us = (message.target_system, message.target_component) == identity
        if is_to_us and message.type != m.MissionResult.ERROR:
            self._mission_type = None

    def ending(self, peer: Peer) -> list[Message]:
        """Return what ends it on a vehicle that heeds that: else it is busy for everybody until it gives up."""
        if self._mission_type is None or not peer.autopilot.lists.heeds_cancel:
            return []
        cancelled = m.MissionResult.OPERATION_CANCELLED
        return [m.MissionAck(peer.system, peer.component, cancelled, self._mission_type)]
