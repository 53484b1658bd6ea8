"""Mission items to and from MISSION_ITEM_INT and MISSION_ITEM."""

from __future__ import annotations

import math
import struct
from dataclasses import fields
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages
from mavlink_bridge.mavlink.messages import MissionResult
from missions.items import CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Message, MissionType
    from mavlink_bridge.protocol.peer import Peer

INT32_MAX = 2**31 - 1
"""What MAVLink puts into an integer coordinate that is not set; no position reads it as a place."""

_PLAIN_XY_COMMANDS = frozenset({202, 203})
"""DO_DIGICAM_CONFIGURE and DO_DIGICAM_CONTROL: ArduPilot does not scale their ``x`` and ``y``."""


def item_to_message(
    item: MissionItem, seq: int, peer: Peer, mission_type: MissionType
) -> messages.MissionItemInt:
    """Return the MISSION_ITEM_INT that sends one item to the peer, as its autopilot wants it."""
    item = peer.autopilot.lists.form.sendable(item, mission_type)
    param1, param2, param3, param4 = item.params
    return messages.MissionItemInt(
        target_system=peer.system,
        target_component=peer.component,
        seq=seq,
        frame=int(item.frame),
        command=int(item.command),
        current=int(item.current),
        autocontinue=int(item.autocontinue),
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=item.lat_e7,
        y=item.lon_e7,
        z=item.alt_m,
        mission_type=int(mission_type),
    )


def item_from_message(message: messages.MissionItemInt | messages.MissionItem) -> MissionItem:
    """Return the item in a MISSION_ITEM_INT or in the old MISSION_ITEM, whose degrees are rounded to degE7.

    A coordinate of the old form that is not a number or does not fit becomes `INT32_MAX`, MAVLink's "not set".
    """
    if isinstance(message, messages.MissionItemInt):
        lat_e7, lon_e7 = message.x, message.y
    else:
        scaled = message.frame != CoordinateFrame.MISSION and message.command not in _PLAIN_XY_COMMANDS
        scale = 1e7 if scaled else 1.0
        lat_e7, lon_e7 = _to_int32(message.x * scale), _to_int32(message.y * scale)
    return MissionItem(
        command=message.command,
        frame=message.frame,
        params=(message.param1, message.param2, message.param3, message.param4),
        lat_e7=lat_e7,
        lon_e7=lon_e7,
        alt_m=message.z,
        current=bool(message.current),
        autocontinue=bool(message.autocontinue),
    )


def wire_key(message: Message) -> tuple[object, ...]:
    """Return what distinguishes a message from all others as it goes over the wire: floats as their 32 bits, so that NaN equals itself."""
    values = ((field, getattr(message, field.name)) for field in fields(message))
    return (type(message), *(_bits(value) if field.type == "float" else value for field, value in values))


def _bits(value: float) -> bytes:
    try:
        return struct.pack("<f", value)
    except OverflowError:
        return struct.pack("<f", math.copysign(math.inf, value))


_RESULTS = {int(result): result for result in MissionResult}


def mission_result(value: int) -> MissionResult | None:
    """Return the MAV_MISSION_RESULT of a number off the wire; None for a number that has no such result."""
    return _RESULTS.get(value)


def _to_int32(value: float) -> int:
    if not math.isfinite(value) or abs(value) > INT32_MAX:
        return INT32_MAX
    return round(value)
