"""Stopping a vehicle that a go-to click drives in the mode that stops: it is sent to the place where it is.

On PX4 a click leads to HOLD and drives in it, and asking for HOLD again does not stop it (read in its source: nothing begins anew in a mode that is on already).
Another place given in the same way takes the first one's place, as measured; given its own, it turns the loop that HOLD is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import CommandInt
from mavlink_bridge.protocol.command import SendCommand
from missions.geo import to_e7
from missions.items import Command, CoordinateFrame

if TYPE_CHECKING:
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

    @property
    def is_granted(self) -> bool:
        """Whether the vehicle accepted it."""
        return self.outcome is not None and self.outcome.is_accepted

    @property
    def result_name(self) -> str:
        """How it was answered, by name."""
        result = self.outcome.result if self.outcome is not None else None
        return result.name if result is not None else "no answer"
