"""Having a mission begin at its first item, where that is asked for by a message that nothing answers, before the vehicle drives.

PX4 stores the same list that is uploaded again not anew, so that the number of the last drive stays; MISSION_CURRENT tells which it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandLong, MissionCurrent, MissionSetCurrent
from mavlink_bridge.protocol.table_machine import Outbox
from missions.items import Command

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_AGAIN_S = 0.4  # so far apart that no burst of noise takes all; chosen, not measured
_MOST_SENDS = 4
"""Then the mission is begun: PX4 1.18 tells the old number until it is. Chosen, not measured."""

_MISSION_CURRENT_ID = 42.0  # MISSION_CURRENT


class BeginAtFirstItem(Outbox):
    """Sends MISSION_SET_CURRENT 0 until MISSION_CURRENT tells of it, or it was sent often enough.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    """

    def __init__(self, peer: Peer) -> None:
        super().__init__()
        self._peer = peer
        self._sends = 0
        self._due_s = 0.0
        self.is_done = False

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.is_done else self._due_s

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    def start(self, now_s: float) -> None:
        """Send it."""
        self._send_once(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:  # noqa: ARG002 - the contract of machines
        """Take a frame."""
        message = frame.message
        if isinstance(message, MissionCurrent) and self._peer.accepts(frame) and self._sends:
            self.is_done = self.is_done or message.seq == 0

    def handle_timer(self, now_s: float) -> None:
        """Send it again, or take notice that it was sent often enough."""
        if self.is_done or now_s < self._due_s:
            return
        if self._sends < _MOST_SENDS:
            self._send_once(now_s)
        else:
            self.is_done = True

    def _send_once(self, now_s: float) -> None:
        peer = self._peer
        self._send(MissionSetCurrent(peer.system, peer.component, 0))
        self._send(
            CommandLong(peer.system, peer.component, Command.REQUEST_MESSAGE, param1=_MISSION_CURRENT_ID)
        )
        self._sends += 1
        self._due_s = now_s + _AGAIN_S
