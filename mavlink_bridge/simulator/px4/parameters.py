"""The parameters of the simulated PX4 rover, sent bytewise: those that matter here, with the defaults of PX4's Ackermann rover in its own simulator."""

from __future__ import annotations

import csv
import math
import struct
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

UINT32, INT32, REAL32 = 5, 6, 9
"""MAV_PARAM_TYPE."""

NO_INDEX = 65_535  # UINT16_MAX: PARAM_VALUE.param_index outside a list
_GONE_1_18 = frozenset({"GF_PREDICT"})


def _rows() -> list[dict[str, str]]:
    with Path(__file__).with_name("parameters.csv").open(encoding="ascii", newline="") as file:
        return list(csv.DictReader(file))


class Px4Parameters:
    """Parameters by name, in a fixed order; nothing is range-checked.

    Parameters
    ----------
    overrides : mapping of str to float
        What differs from the defaults.
    is_1_18 : bool
        Whether those that 1.18 no longer has are left out.

    Raises
    ------
    BridgeError
        An override of a parameter that the rover does not have.
    """

    def __init__(self, overrides: Mapping[str, float], *, is_1_18: bool) -> None:
        rows = [row for row in _rows() if not (is_1_18 and row["name"] in _GONE_1_18)]
        self._types = {row["name"]: int(row["type"]) for row in rows}
        self._values = {row["name"]: float(row["default"]) for row in rows}
        unknown = sorted(set(overrides) - set(self._values))
        if unknown:
            raise BridgeError(
                f"the simulated PX4 rover has no parameter {', '.join(unknown)}; it has {', '.join(self._values)}",
                parameters=unknown,
            )
        self._values |= overrides
        self._names = tuple(self._values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def whole(self, name: str) -> int:
        """Return a whole number; 0 of what is none."""
        value = self._values[name]
        return int(value) if math.isfinite(value) else 0

    def set(self, message: m.ParamSet) -> bool:
        """Take a PARAM_SET; return whether it is answered: one of the wrong type, or for a name that is not known, is not."""
        kind = self._types.get(message.param_id)
        if kind is None or kind != message.param_type:
            return False
        packed = struct.pack("<f", message.param_value)
        self._values[message.param_id] = float(struct.unpack("<i" if kind == INT32 else "<f", packed)[0])
        return True

    def message(self, name: str, index: int) -> m.ParamValue:
        """Return the PARAM_VALUE of a parameter."""
        kind, value = self._types[name], self._values[name]
        packed = struct.pack("<i", int(value)) if kind == INT32 else struct.pack("<f", value)
        told = float(struct.unpack("<f", packed)[0])
        return m.ParamValue(name, told, kind, len(self._names), index)

    def checksum(self) -> m.ParamValue:
        """Return what ends a list: a checksum of all parameters."""
        number = zlib.crc32(repr(self._values).encode())
        told = float(struct.unpack("<f", struct.pack("<I", number))[0])
        return m.ParamValue("_HASH_CHECK", told, UINT32, len(self._names), NO_INDEX)

    def asked(self, message: m.ParamRequestRead) -> m.ParamValue | None:
        """Return the answer to a PARAM_REQUEST_READ; silence for what there is not."""
        index = message.param_index
        if index >= 0:
            return self.message(self._names[index], index) if index < len(self._names) else None
        name = message.param_id
        return self.message(name, self._names.index(name)) if name in self._values else None
