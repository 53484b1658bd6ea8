"""A time for the frames of a log without timestamps: the vehicle's own time since it booted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from mavlink_bridge.tlog.wire import BOOT_TIME_AT, ID_LIMIT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mavlink_bridge.tlog.walk import Block

_AUTOPILOT: Final = 1
"""MAV_COMP_ID_AUTOPILOT1: ground stations have a boot time of their own."""


class RawClock:
    """Assigns each frame the ``time_boot_ms`` of the latest autopilot message that carries one; 0 before the first."""

    def __init__(self) -> None:
        self._time_us = np.uint64(0)

    def set_times(self, block: Block) -> None:
        """Fill in the times of a block, the next one of the log."""
        scan, which = block.scan, block.which
        component = scan.view[scan.at[which] + np.where(scan.is_v2[which], 6, 4)]
        field_at = BOOT_TIME_AT[np.minimum(scan.ids[which], ID_LIMIT)].astype(np.int64)
        is_clock = (field_at >= 0) & (component == _AUTOPILOT) & (scan.payload_bytes[which] >= field_at + 4)
        places = np.flatnonzero(is_clock)
        ticks = np.concatenate(([self._time_us], self._read(block, places, field_at[places])))
        block.time_us[:] = ticks[np.cumsum(is_clock)]
        self._time_us = ticks[-1]

    @staticmethod
    def _read(block: Block, places: NDArray[np.int64], field_at: NDArray[np.int64]) -> NDArray[np.uint64]:
        at = block.scan.payload_at(block.which[places]) + field_at
        # Whole milliseconds are multiples of 4 µs, so the link bits stay 0.
        times: NDArray[np.uint64] = block.scan.words("<u4")[at].astype(np.uint64) * np.uint64(1000)
        return times
