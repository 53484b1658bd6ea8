"""Asking for the telemetry that decisions rest on, which not every link gets unasked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import RequestDataStream

if TYPE_CHECKING:
    from mavlink_bridge.protocol.peer import Peer

_STREAMS = (6, 2)
"""MAV_DATA_STREAM_POSITION and _EXTENDED_STATUS, which holds GPS_RAW_INT and MISSION_CURRENT."""
_STREAM_HZ = 4  # positions often enough to follow a drive; chosen, not measured


def stream_requests(peer: Peer) -> list[RequestDataStream]:
    """Return what asks for the position, its quality and the mission's state."""
    return [RequestDataStream(peer.system, peer.component, stream, _STREAM_HZ, 1) for stream in _STREAMS]
