"""How many mission items a vehicle holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from missions.errors import VehicleError
from missions.vehicle import known_ardupilot, whole_number
from missions.vehicle.asked_parameters import STORAGE_NAMES

if TYPE_CHECKING:
    from missions.situation import Situation

MISSION_ITEMS = 655
"""Items that ArduPilot holds with 16 KB of storage, home included, as measured."""

PX4_MISSION_ITEMS = 500
"""Items that every PX4 board holds; the larger ones hold 1000. From its source, not measured: the simulator holds 10000."""

_SD_BYTES_PER_ITEM = 15  # AP_MISSION_EEPROM_COMMAND_SIZE
_SD_HEADER_BYTES = 4  # storage format's version
_MOST_SD_KB = 1024
"""ArduPilot's documentation allows 64; more than a megabyte no list of 16-bit numbers can fill."""


def most_items(parameters: Mapping[str, float]) -> int:
    """Return how many items a vehicle holds, home included."""
    sd_bytes = sd_card_bytes(parameters, "BRD_SD_MISSION")
    return (sd_bytes - _SD_HEADER_BYTES) // _SD_BYTES_PER_ITEM if sd_bytes > 0 else MISSION_ITEMS


def most_own_items(situation: Situation) -> int:
    """Return how many items of a mission a vehicle holds, home not included."""
    if known_ardupilot(situation) is False:
        return PX4_MISSION_ITEMS
    return most_items(situation.parameters) - 1


def sd_card_bytes(parameters: Mapping[str, float], name: str) -> int:
    """Return the storage on the SD card that BRD_SD_MISSION or BRD_SD_FENCE set in KB; 0, the least of all, where the value is impossible."""
    try:
        return whole_number(parameters, name, 0, most=_MOST_SD_KB) * 1024
    except VehicleError:
        return 0


def storage_remarks(parameters: Mapping[str, float]) -> list[str]:
    """Return remarks on storage that no vehicle can have."""
    remarks = []
    for name in STORAGE_NAMES:
        try:
            whole_number(parameters, name, 0, most=_MOST_SD_KB)
        except VehicleError as error:
            remarks.append(f"{error}; assuming 0 (no SD card storage)")
    return remarks
