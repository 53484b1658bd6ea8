"""Waiting until the vehicle stands, as its positions tell."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandLong, GlobalPositionInt
from mavlink_bridge.protocol.table_machine import Outbox
from missions.items import Command

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer


_ASK_EVERY_S, _MOST_ASKED = 0.1, 25
"""So often positions are asked for shortly before it stands: they come four times a second. From twice that speed a rover rolls on for 1.4 s. Chosen."""

_POSITION_ID = 33  # GLOBAL_POSITION_INT


class AwaitStandstill(Outbox):
    """Waits for a position that says that the vehicle stands; shortly before that positions are asked for.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    still_mps : float
        Slower than this counts as standing.
    until_s : float
        When a vehicle that still reports a speed is taken for standing: a fix that drifts, a slope.
    """

    def __init__(self, peer: Peer, still_mps: float, until_s: float) -> None:
        super().__init__()
        self._peer = peer
        self._still_mps = still_mps
        self._until_s = until_s
        self._ask_s = math.inf
        self._asked = 0
        self.is_done = False

    @property
    def deadline_s(self) -> float | None:
        """When a position is asked for, or it is taken for standing."""
        return None if self.is_done else min(self._ask_s, self._until_s)

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    def start(self, now_s: float) -> None:
        """Begin to wait."""

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        message = frame.message
        if self.is_done or not isinstance(message, GlobalPositionInt) or not self._peer.accepts(frame):
            return
        speed_mps = math.hypot(message.vx, message.vy) / 100
        self.is_done = speed_mps <= self._still_mps
        if speed_mps <= 2 * self._still_mps and self._asked == 0:
            self._ask_s = now_s

    def handle_timer(self, now_s: float) -> None:
        """Ask for a position, or take notice that time has passed."""
        self.is_done = self.is_done or now_s >= self._until_s
        if self.is_done or now_s < self._ask_s:
            return
        self._asked += 1
        self._ask_s = now_s + _ASK_EVERY_S if self._asked < _MOST_ASKED else math.inf
        peer = self._peer
        self._send(CommandLong(peer.system, peer.component, Command.REQUEST_MESSAGE, param1=_POSITION_ID))
