"""Commands that are addressed to our own component."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer


def is_command_to(frame: Frame, identity: tuple[int, int], system: int | None) -> bool:
    """Return whether a frame is a command for our own component, not for the vehicle's autopilot or for everyone."""
    message = frame.message
    if not isinstance(message, m.CommandInt | m.CommandLong) or message.target_component != identity[1]:
        return False
    return message.target_system in (0, identity[0], system) and (frame.system, frame.component) != identity


def as_to_vehicle(frame: Frame, peer: Peer | None) -> Frame:
    """Return a command to our own system as one to the vehicle's, whose place it asks for; any other frame as it is."""
    message = frame.message
    if peer is None or peer.own_system == peer.system:
        return frame
    if not is_command_to(frame, (peer.own_system, peer.own_component), peer.own_system):
        return frame
    assert isinstance(message, m.CommandInt | m.CommandLong)
    return replace(frame, message=replace(message, target_system=peer.system))
