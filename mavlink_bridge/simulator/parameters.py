"""The parameters of the simulated rover: ArduRover 4.7's, as far as something here depends on them or clients ask for them."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.errors import BridgeError
from mavlink_bridge.simulator.personality import missing_names, own_defaults

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from missions.firmware import Firmware

_ROWS = [
    line.split(",")
    for line in Path(__file__).with_name("parameters.csv").read_text(encoding="ascii").splitlines()[1:]
]
DEFAULTS = {name: float(value) for name, value, _ in _ROWS}
"""Read from ArduRover 4.7.0-dev (24 October 2025), software in the loop; FENCE_MARGIN_XY came later, and at 0 changes nothing."""

REAL32 = 9
"""MAV_PARAM_TYPE_REAL32."""

_TYPES = {name: int(type_) for name, _, type_ in _ROWS}  # MAV_PARAM_TYPE


def float32(value: float) -> float:
    """Return the value as it is after a trip through a float of four bytes."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


class ParameterStore:
    """Parameters by name, in a fixed order.

    Parameters
    ----------
    overrides : mapping of str to float
        What differs from `DEFAULTS`.
    firmware : Firmware or None
        The version whose defaults and names it has; None: those of `DEFAULTS`.

    Raises
    ------
    BridgeError
        An override of a parameter the rover does not have.
    """

    def __init__(self, overrides: Mapping[str, float], firmware: Firmware | None = None) -> None:
        missing = missing_names(firmware)
        unknown = sorted(set(overrides) - set(DEFAULTS) | set(overrides) & missing)
        if unknown:
            raise BridgeError(
                f"the simulated rover has no parameter {', '.join(unknown)}; it has {len(DEFAULTS)},"
                " all listed in docs/simulator.md",
                parameters=unknown,
            )
        values = DEFAULTS | dict(own_defaults(firmware)) | dict(overrides)
        self._values = {name: float32(value) for name, value in values.items()}
        self._names = tuple(name for name in self._values if name not in missing)

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def flag(self, name: str, bit: int) -> bool:
        """Whether the bit of that value is set in a bit mask."""
        return bool(self.whole(name) & bit)

    def whole(self, name: str) -> int:
        """Return an enumeration or a bit mask; 0 of what is no number."""
        value = self._values[name]
        return int(value) if math.isfinite(value) else 0

    @property
    def fence_margin_m(self) -> float:
        """FENCE_MARGIN_XY where that is above 0, else FENCE_MARGIN (AC_Fence, from 4.7 on)."""
        return self._values["FENCE_MARGIN_XY"] or self._values["FENCE_MARGIN"]

    def set(self, name: str, value: float) -> None:
        """Change a value; an integer parameter drops the fraction."""
        self._values[name] = float(int(value)) if kind(name) != REAL32 else float32(value)

    def name_at(self, index: int) -> str | None:
        """Return the name at an index of the list, None past its ends."""
        return self._names[index] if 0 <= index < len(self._names) else None

    def index_of(self, name: str) -> int:
        """Return a parameter's place in the list."""
        return self._names.index(name)


def kind(name: str) -> int:
    """Return a parameter's MAV_PARAM_TYPE."""
    return _TYPES[name]
