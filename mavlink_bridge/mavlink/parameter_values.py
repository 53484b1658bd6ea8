"""What a PARAM_VALUE means: MAVLink puts every parameter into a float, and autopilots differ in how.

ArduPilot casts (3 is sent as 3.0). PX4 sends the bits: the float's four bytes hold the integer (MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE).
A signalling NaN's bits do not survive on their way through Python: INT32 values of 2139095041 to 2143289343 and their negatives come out wrong.
"""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import ParamValue

REAL32 = 9
"""MAV_PARAM_TYPE_REAL32."""

_WHOLE_NUMBERS = {1: "<Bxxx", 2: "<bxxx", 3: "<Hxx", 4: "<hxx", 5: "<I", 6: "<i"}
"""MAV_PARAM_TYPE: UINT8, INT8, UINT16, INT16, UINT32, INT32, as PARAM_VALUE's union lays them out."""


def float32(value: float) -> float:
    """Return the value as it goes over the wire."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def parameter_value(message: ParamValue, *, bytewise: bool) -> float:
    """Return the value of a PARAM_VALUE; it may be no number.

    Parameters
    ----------
    message : ParamValue
        The message.
    bytewise : bool
        Whether its autopilot sends whole numbers as bits.
    """
    layout = _WHOLE_NUMBERS.get(message.param_type) if bytewise else None
    if layout is None:
        return message.param_value
    return float(struct.unpack(layout, struct.pack("<f", message.param_value))[0])


def encoded_parameter(value: float, param_type: int, *, bytewise: bool) -> tuple[float, int]:
    """Return what a PARAM_SET carries, and the type that it says: an autopilot that casts is sent floats.

    Raises
    ------
    MissionFormatError
        The parameter is a whole number of so many bits, and the value is none.
    """
    layout = _WHOLE_NUMBERS.get(param_type) if bytewise else None
    if layout is None:
        return value, param_type if bytewise else REAL32
    try:
        packed = struct.pack(layout, int(value))
    except (struct.error, ValueError, OverflowError):
        packed = None
    if packed is None or value != int(value):
        raise MissionFormatError(
            f"{value:g} is not a whole number of this parameter's type; nothing was sent", value=value
        )
    return float(struct.unpack("<f", packed)[0]), param_type
