"""The three lists a vehicle keeps: the mission is written in place, the fence all at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.simulator import item_rules
from missions.items import Command, CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.geo import LatLon

MISSION_LIMIT = 655
"""Mission items with home that the default storage holds."""

FENCE_BYTES = 672
"""Bytes of fence the default storage holds."""

SD_FENCE_LIMIT = 4096
"""Fence items at most, however large the SD card's storage."""

# How ArduPilot counts storage on an SD card: bytes an item, and a mission's header.
_BYTES_PER_FENCE_ITEM = 8
_BYTES_PER_MISSION_ITEM = 15
_HEADER_BYTES = 4

RALLY_LIMIT = 50
"""Rally points the default storage holds (750 bytes, from the source; not measured)."""


class StoredList(ABC):
    """One stored list, as an upload and a download see it.

    Attributes
    ----------
    items : list of MissionItem
        What is stored now.
    texts : list of str
        The vehicle's texts about the last call, for STATUSTEXT; the caller empties it.
    """

    mission_type: MissionType
    limit: int
    name: str

    def __init__(self) -> None:
        self.items: list[MissionItem] = []
        self.texts: list[str] = []

    def __len__(self) -> int:
        return len(self.items)

    def read(self, seq: int) -> MissionItem | None:
        """Return an item as it reads back, None past the end."""
        return self.items[seq] if seq < len(self.items) else None

    @abstractmethod
    def begin(self, count: int) -> None:
        """Note that ``count`` items will come."""

    @abstractmethod
    def begin_part(self) -> None:
        """Note that some items will be overwritten."""

    @abstractmethod
    def write(self, seq: int, item: MissionItem, count: int) -> MissionResult:
        """Take one item of an upload that ends with ``count`` items."""

    def finish(self) -> MissionResult:
        """Note that the last item has come."""
        return MissionResult.ACCEPTED

    def abandon(self) -> None:  # noqa: B027 - only the fence has something to forget
        """Forget what an unfinished upload holds in memory."""

    def clear(self) -> bool:
        """Empty the list; return whether that was allowed."""
        self.items = []
        return True


class _InPlaceList(StoredList):
    """A list that an upload cuts at once and overwrites item by item."""

    def begin(self, count: int) -> None:
        del self.items[count:]

    def begin_part(self) -> None:
        """Items are overwritten as they come: nothing to prepare."""

    def _put(self, seq: int, item: MissionItem) -> MissionResult:
        self.items[seq : seq + 1] = [item]
        return MissionResult.ACCEPTED


class MissionList(_InPlaceList):
    """The mission; item 0 is the vehicle's home, whatever was sent there.

    Parameters
    ----------
    home : callable
        Returns the vehicle's home.
    is_running : callable
        Returns whether the vehicle is armed in AUTO.
    sd_kb : int
        BRD_SD_MISSION: storage on the SD card instead of the default one.
    """

    mission_type = MissionType.MISSION
    limit = MISSION_LIMIT
    name = "Mission"

    def __init__(self, home: Callable[[], LatLon], is_running: Callable[[], bool], sd_kb: int = 0) -> None:
        super().__init__()
        if sd_kb > 0:
            self.limit = (sd_kb * 1024 - _HEADER_BYTES) // _BYTES_PER_MISSION_ITEM
        self._home = home
        self._is_running = is_running
        self.items.append(_home_item(home()))

    def read(self, seq: int) -> MissionItem | None:
        """Return an item as it reads back: at 0 the vehicle's home."""
        if seq == 0 and self.items:
            return _home_item(self._home())
        return super().read(seq)

    def write(self, seq: int, item: MissionItem, count: int) -> MissionResult:
        """Write one item in place."""
        result = item_rules.mission_item_result(item, count)
        if result != MissionResult.ACCEPTED:
            return result
        return self._put(seq, item_rules.kept_mission_item(item))

    def finish(self) -> MissionResult:
        """Note with ArduPilot's text that the list is complete; return that it is accepted."""
        self.texts.append("Flight plan received")
        return MissionResult.ACCEPTED

    def clear(self) -> bool:
        """Empty the mission, home included; refused while it is driven."""
        return not self._is_running() and super().clear()


class RallyList(_InPlaceList):
    """Rally points."""

    mission_type = MissionType.RALLY
    limit = RALLY_LIMIT
    name = "Rally"

    def write(self, seq: int, item: MissionItem, count: int) -> MissionResult:  # noqa: ARG002 - one shape for all lists
        """Write one item in place."""
        result = item_rules.rally_item_result(item)
        return result or self._put(seq, item_rules.kept_rally_item(item))


class FenceList(StoredList):
    """The fence: an upload is held in memory and written when the whole of it is found good.

    Parameters
    ----------
    sd_kb : int
        BRD_SD_FENCE: storage on the SD card instead of the default one.
    """

    mission_type = MissionType.FENCE
    name = "Fence"

    def __init__(self, sd_kb: int = 0) -> None:
        super().__init__()
        self._bytes = sd_kb * 1024 if sd_kb > 0 else FENCE_BYTES
        # What is announced: most fences of that many items do not fit.
        self.limit = min(self._bytes // _BYTES_PER_FENCE_ITEM, SD_FENCE_LIMIT)
        self._incoming: list[MissionItem] = []

    def begin(self, count: int) -> None:
        """Start with an empty buffer; no items at all empty the fence."""
        self._incoming = []
        if count == 0:
            self.items = []

    def begin_part(self) -> None:
        """Start with what is stored."""
        self._incoming = list(self.items)

    def write(self, seq: int, item: MissionItem, count: int) -> MissionResult:  # noqa: ARG002 - one shape for all lists
        """Take one item into the buffer."""
        result = item_rules.fence_item_result(item)
        if result == MissionResult.ACCEPTED:
            self._incoming[seq : seq + 1] = [item_rules.kept_fence_item(item)]
        return result

    def finish(self) -> MissionResult:
        """Judge the buffer; write it if it is good and fits."""
        problem = item_rules.fence_problem(self._incoming)
        if problem is not None:
            self.texts += [problem, "Fence validation failed"]
            return MissionResult.ERROR
        if item_rules.fence_bytes(self._incoming) > self._bytes:
            self.texts.append("Fence exceeds storage size")
            return MissionResult.ERROR
        self.items = self._incoming
        self._incoming = []
        return MissionResult.ACCEPTED

    def abandon(self) -> None:
        """Forget the buffer."""
        self._incoming = []


def _home_item(home: LatLon) -> MissionItem:
    return MissionItem(
        Command.NAV_WAYPOINT,
        CoordinateFrame.GLOBAL,
        lat_e7=round(home.lat_deg * 1e7),
        lon_e7=round(home.lon_deg * 1e7),
    )
