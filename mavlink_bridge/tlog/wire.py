"""What a MAVLink frame looks like on the wire: lengths and checksum seeds of all messages, field offsets of ours.

Everything here is derived once, at import, from pymavlink's ArduPilot dialect.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavlink_bridge.mavlink.codec import DIALECT
from mavlink_bridge.mavlink.messages import MESSAGES, Message, wire_name

if TYPE_CHECKING:
    from numpy.typing import NDArray

# The first byte of a frame of MAVLink 1 and 2.
MAGIC_V1: Final = 0xFE
MAGIC_V2: Final = 0xFD
SIGNED_FLAG: Final = 1
"""MAVLINK_IFLAG_SIGNED, the only incompatibility flag there is: a frame with another one cannot be read."""
SIGNATURE_BYTES: Final = 13  # link id, timestamp of 6 bytes, 6 bytes of hash
MAX_FRAME_BYTES: Final = 10 + 255 + 2 + SIGNATURE_BYTES  # header, payload, checksum, signature of MAVLink 2
TIMESTAMP_BYTES: Final = 8  # microseconds since 1970, before each frame of a .tlog
ID_LIMIT: Final = 65535
"""Message ids from here on are outside the dialect; tables are indexed with ``min(id, ID_LIMIT)``."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the fields of one of our messages stand in its payload.

    Parameters
    ----------
    message_id : int
        MAVLink's message id.
    dtype : numpy.dtype
        Structured type of the payload as far as our fields reach, little-endian, with our field names in our order.
    texts : tuple of bool
        For each field whether it is a NUL-terminated text.
    """

    message_id: int
    dtype: np.dtype[np.void]
    texts: tuple[bool, ...]


def _dialect_classes() -> dict[int, Any]:
    return {number: cls for number, cls in DIALECT.items() if number < ID_LIMIT}


def _formats(cls: Any) -> dict[str, str]:  # noqa: ANN401 - pymavlink ships no types
    codes = cls.native_format.decode()[1:]
    formats = {}
    for name, code, length in zip(cls.ordered_fieldnames, codes, cls.array_lengths, strict=True):
        formats[name] = f"{length}s" if code == "c" else f"{length or ''}{code}"
    return formats


def _base_bytes(cls: Any, formats: dict[str, str]) -> int:  # noqa: ANN401 - pymavlink ships no types
    # The generated constructors give extension fields, and only them and HEARTBEAT's version, a default.
    defaulted = getattr(cls, "defaulted", None) or len(cls.__init__.__defaults__ or ())
    extensions = set(cls.fieldnames[len(cls.fieldnames) - defaulted :])
    return struct.calcsize("<" + "".join(code for name, code in formats.items() if name not in extensions))


def _layout(message_class: type[Message], cls: Any, formats: dict[str, str]) -> Layout:  # noqa: ANN401
    offsets = _offsets(formats)
    names = [field.name for field in fields(message_class)]
    kinds = [_kind(formats[name]) for name in names]
    dtype = np.dtype({"names": names, "formats": kinds, "offsets": [offsets[name] for name in names]})
    return Layout(cls.id, dtype, tuple(formats[name][-1] == "s" for name in names))


def _kind(code: str) -> str:
    """Return numpy's name for a field of a struct format: a text, a number, or a list of numbers."""
    length, letter = code[:-1], code[-1]
    return f"S{length}" if letter == "s" else f"{length}<{letter}"


def _offsets(formats: dict[str, str]) -> dict[str, int]:
    offsets, offset = {}, 0
    for name, code in formats.items():
        offsets[name] = offset
        offset += struct.calcsize("<" + code)
    return offsets


def _tables() -> tuple[dict[str, NDArray[Any]], dict[type[Message], Layout]]:
    known = np.zeros(ID_LIMIT + 1, bool)
    base = np.zeros(ID_LIMIT + 1, np.int16)
    full = np.zeros(ID_LIMIT + 1, np.int16)
    seed = np.zeros(ID_LIMIT + 1, np.uint8)
    boot = np.full(ID_LIMIT + 1, -1, np.int16)
    layouts = {}
    for number, cls in _dialect_classes().items():
        formats = _formats(cls)
        known[number] = True
        base[number] = _base_bytes(cls, formats)
        full[number] = dialect.mavlink_map[number].unpacker.size
        seed[number] = cls.crc_extra
        if formats.get("time_boot_ms") == "I":
            boot[number] = _offsets(formats)["time_boot_ms"]
        if cls.msgname in MESSAGES:
            message_class = MESSAGES[cls.msgname]
            layouts[message_class] = _layout(message_class, cls, formats)
    tables = {"known": known, "base": base, "full": full, "seed": seed, "boot": boot}
    return tables, layouts


_TABLES, LAYOUTS = _tables()
IS_KNOWN: Final[NDArray[np.bool_]] = _TABLES["known"]
"""By message id: whether the dialect has it."""
BASE_BYTES: Final[NDArray[np.int16]] = _TABLES["base"]
"""By message id: payload bytes without extension fields, as MAVLink 1 sends it."""
FULL_BYTES: Final[NDArray[np.int16]] = _TABLES["full"]
"""By message id: payload bytes with all extension fields that pymavlink knows, which it sends in MAVLink 1 too."""
CRC_SEED: Final[NDArray[np.uint8]] = _TABLES["seed"]
"""By message id: CRC_EXTRA."""
BOOT_TIME_AT: Final[NDArray[np.int16]] = _TABLES["boot"]
"""By message id: where ``time_boot_ms`` stands in the payload, -1 where there is none."""
CLASS_OF_ID: Final = {layout.message_id: cls for cls, layout in LAYOUTS.items()}
NAME_OF_ID: Final[dict[int, str]] = {number: cls.msgname for number, cls in _dialect_classes().items()}


def layout_of(message_class: type[Message]) -> Layout:
    """Return the layout of one of our messages.

    Raises
    ------
    ValueError
        The class is not a message on the wire.
    """
    layout = LAYOUTS.get(message_class)
    if layout is None:
        raise ValueError(f"{wire_name(message_class)} is not a MAVLink message this project speaks")
    return layout
