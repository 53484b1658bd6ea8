"""Whether MAVLink can carry what is to be sent, found out before the first message goes.

ArduPilot cuts its mission at MISSION_COUNT: an item found afterwards that cannot be put on the wire would leave half a mission.
"""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mavlink_bridge.mavlink.messages import MissionType
    from missions.items import MissionItem

_UINT8, _UINT16, _INT32 = (0, 2**8 - 1), (0, 2**16 - 1), (-(2**31), 2**31 - 1)
_MOST_ITEMS = 2**16 - 1
"""MISSION_COUNT's ``count`` is a uint16."""
_NAME_BYTES = 16
"""PARAM_SET's ``param_id``."""
_FLOAT32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
_NOTHING_SENT = "nothing was sent to the vehicle"


def check_items(
    items: Sequence[MissionItem], mission_type: MissionType, *, allow_infinite: bool = False
) -> None:
    """Refuse a list that cannot be sent as it is.

    NaN passes: ground stations write them for "not set", and the vehicle refuses them where it wants one. Infinite ones
    mean nothing in any field.

    Parameters
    ----------
    items : sequence of MissionItem
        The list as it goes over the wire, for missions with home at 0.
    mission_type : MissionType
        Which list.
    allow_infinite : bool
        For a list that a vehicle held: it is put back as it was.

    Raises
    ------
    MissionFormatError
        A number cannot be sent; the message names item and field, and what MAVLink carries there.
    """
    name = mission_type.name.lower()
    if len(items) > _MOST_ITEMS:
        raise MissionFormatError(
            f"{len(items)} {name} items are too many: MAVLink counts to {_MOST_ITEMS}; {_NOTHING_SENT}"
        )
    for seq, item in enumerate(items):
        if found := _misfit(item, allow_infinite=allow_infinite):
            field, value, carries = found
            raise MissionFormatError(
                f"{name} item {seq}: {field} is {value:g}; MAVLink carries {carries} there; {_NOTHING_SENT}",
                item=seq,
                field=field,
                value=value,
            )


def check_parameters(parameters: Mapping[str, float]) -> None:
    """Refuse parameters that cannot be sent as they are.

    Raises
    ------
    MissionFormatError
        One cannot be sent; the message names it and says why.
    """
    for name, value in parameters.items():
        problem = None
        if not name.isascii() or not 0 < len(name) <= _NAME_BYTES:
            problem = f"MAVLink's parameter names have at most {_NAME_BYTES} ASCII characters"
        elif not _is_float32(value) or not math.isfinite(value):
            problem = f"its value is {value:g}; MAVLink carries finite 32-bit floats there, at most {_FLOAT32_MAX:.2g}"
        if problem:
            raise MissionFormatError(
                f"parameter {name}: {problem}; {_NOTHING_SENT}", parameter=name, value=value
            )


def _misfit(item: MissionItem, *, allow_infinite: bool) -> tuple[str, float, str] | None:
    """Return the first field of an item that cannot be sent, its value, and what MAVLink carries there."""
    whole = (
        ("frame", int(item.frame), _UINT8),
        ("command", int(item.command), _UINT16),
        ("x", item.lat_e7, _INT32),
        ("y", item.lon_e7, _INT32),
    )
    for field, number, (least, most) in whole:
        if not least <= number <= most:
            return field, number, f"whole numbers from {least} to {most}"
    floats = (*((f"param{place}", value) for place, value in enumerate(item.params, 1)), ("z", item.alt_m))
    for field, value in floats:
        if math.isinf(value) and not allow_infinite:
            return field, value, "finite numbers, or NaN for none,"
        if not _is_float32(value):
            return field, value, f"32-bit floats, at most {_FLOAT32_MAX:.2g},"
    return None


def _is_float32(value: float) -> bool:
    """Return whether a number is within the range of 32-bit floats; NaN and the infinities are among them."""
    try:
        struct.pack("<f", value)
    except OverflowError:
        return False
    return True
