"""How many mission items a vehicle holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

MISSION_ITEMS = 655
"""Items that ArduPilot holds with 16 KB of storage, home included, as measured."""

_SD_BYTES_PER_ITEM = 15
_SD_HEADER_BYTES = 4


def most_items(parameters: Mapping[str, float]) -> int:
    """Give how many items a vehicle holds, home included: BRD_SD_MISSION is storage on an SD card, in KB."""
    sd_bytes = int(parameters.get("BRD_SD_MISSION", 0)) * 1024
    return (sd_bytes - _SD_HEADER_BYTES) // _SD_BYTES_PER_ITEM if sd_bytes > 0 else MISSION_ITEMS
