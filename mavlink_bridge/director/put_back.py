"""Taking a disarmed vehicle out of the AUTO that we switched it to: left there, arming it would set it going.

HOLD is sent only on a heartbeat that shows the vehicle disarmed and in AUTO, so it goes against nobody: who has armed it, or switched its mode, has it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Heartbeat, ModeFlag
from mavlink_bridge.protocol.mode_switch import set_mode
from mavlink_bridge.protocol.table_machine import Outbox

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_PATIENCE_S = 4.0
"""An AUTO of ours that was on its way shows within this time: heartbeats come every second, some are lost."""

_STALE_S = 1.5
"""So long after HOLD was sent a heartbeat from before our AUTO may still come, and look like the answer."""

_MOST_SENDS = 16  # as of a mode switch; chosen, not measured


class PutBack(Outbox):
    """Switches a vehicle to HOLD as long as it is shown disarmed and in AUTO.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    """

    def __init__(self, peer: Peer) -> None:
        super().__init__()
        self._peer = peer
        self._sends = 0
        self._until_s = 0.0
        self._sent_s = 0.0
        self._mode: int | None = None
        self._is_armed: bool | None = None
        self.is_done = False

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.is_done else self._until_s

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    @property
    def is_left_in_auto(self) -> bool:
        """Whether the vehicle was last shown disarmed and in AUTO all the same."""
        return self._mode == self._peer.autopilot.modes.mission and self._is_armed is False

    @property
    def was_needed(self) -> bool:
        """Whether HOLD was sent."""
        return self._sends > 0

    def start(self, now_s: float) -> None:
        """Begin to look."""
        self._until_s = now_s + _PATIENCE_S

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        heartbeat = frame.message
        if self.is_done or not isinstance(heartbeat, Heartbeat) or not self._peer.accepts(frame):
            return
        self._mode = heartbeat.custom_mode
        self._is_armed = bool(heartbeat.base_mode & ModeFlag.SAFETY_ARMED)
        if self.is_left_in_auto:
            self._send_hold(now_s)
        elif self._sends:
            self.is_done = now_s >= self._sent_s + _STALE_S
        else:
            modes = self._peer.autopilot.modes
            self.is_done = self._mode not in (modes.mission, modes.hold)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        self.is_done = self.is_done or now_s >= self._until_s

    def _send_hold(self, now_s: float) -> None:
        if self._sends >= _MOST_SENDS:
            self.is_done = True
            return
        self._until_s = now_s + _PATIENCE_S
        self._sent_s = now_s
        self._send(set_mode(self._peer, self._peer.autopilot.modes.hold, self._sends))
        self._sends += 1
