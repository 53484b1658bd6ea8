"""Stopping a vehicle that a go-to click drives in the mode that stops: it is sent to the place where it is.

On PX4 a click leads to HOLD and drives in it, and asking for HOLD again does not stop it (read in its source: nothing begins anew in a mode that is on already).
Another place given in the same way takes the first one's place, as measured; given its own, it turns the loop that HOLD is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandInt, Heartbeat
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.mode_switch import ASK_S, ask_for_heartbeat
from missions.geo import to_e7
from missions.items import Command, CoordinateFrame

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer
    from missions.geo import LatLon

_CHANGES_MODE = 1.0
"""MAV_DO_REPOSITION_FLAGS_CHANGE_MODE: without it PX4 1.17 answers UNSUPPORTED, and 1.18 does nothing in a mission."""

_OWN_SPEED = -1.0  # as a ground station leaves it open


class StopHere(SendCommand):
    """Sends the vehicle to a place, and is granted where it accepts that.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    position : LatLon
        Where it is.

    Attributes
    ----------
    is_blind : bool
        Whether it was said again while no heartbeat told of the vehicle's mode, which it changes: as of a mode switch.
    """

    command_name = "DO_REPOSITION"

    def __init__(self, peer: Peer, position: LatLon) -> None:
        lat_e7, lon_e7 = to_e7(position)
        message = CommandInt(
            peer.system,
            peer.component,
            int(CoordinateFrame.GLOBAL_RELATIVE_ALT),
            Command.DO_REPOSITION,
            param1=_OWN_SPEED,
            param2=_CHANGES_MODE,
            param4=math.nan,  # the heading, as a ground station leaves it open
            x=lat_e7,
            y=lon_e7,
        )
        super().__init__(peer, message)
        self.is_blind = False
        self._heard_s = -math.inf
        self._sent_s = 0.0
        self._asks = 0

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        deadline_s = super().deadline_s
        return None if deadline_s is None else min(deadline_s, self._ask_due_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if isinstance(frame.message, Heartbeat) and self._peer.accepts(frame):
            self._heard_s = now_s
        super().receive(frame, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Ask for a heartbeat, or do what else is due by now."""
        if not self.is_done and now_s >= self._ask_due_s:
            self._asks += 1
            self._send(ask_for_heartbeat(self._peer))
        super().handle_timer(now_s)

    @property
    def _ask_due_s(self) -> float:
        return self._sent_s + ASK_S * (self._asks + 1)

    def _send_once(self, now_s: float) -> None:
        self.is_blind = self.is_blind or (self._sends > 0 and self._heard_s < self._sent_s + ASK_S)
        self._sent_s, self._asks = now_s, 0
        super()._send_once(now_s)

    @property
    def is_granted(self) -> bool:
        """Whether the vehicle accepted it."""
        return self.outcome is not None and self.outcome.is_accepted

    @property
    def result_name(self) -> str:
        """How it was answered, by name."""
        result = self.outcome.result if self.outcome is not None else None
        return result.name if result is not None else "no answer"
