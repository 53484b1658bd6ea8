"""Ways home inside a mission: parts behind its end, one of which is chosen while a leg is driven.

ArduPilot Rover has nothing that leads there by itself: up to 4.7 its ``ModeAuto::start_command`` passes over DO_LAND_START (189) and DO_RETURN_PATH_START
(188), its failsafes know RTL, Hold and SmartRTL only (Rover/mode_auto.cpp, Rover/failsafe.cpp), and its own list of what is to come still has "Rover:
implement DO_LAND_START" (issue 19055). So somebody chooses: the operator, or a companion computer, sends the number of the part's first item
(MISSION_SET_CURRENT, DO_SET_MISSION_CURRENT) while the vehicle is in AUTO. JUMP_TAG (600), which ArduPilot has since 4.4, marks the parts: the tag is the number of
the item to which the vehicle drives when the part is chosen.

The drive ends in LOITER_UNLIM, which is never done (``verify_loiter_unlimited`` returns false): nothing but a choice leads behind it. Each part ends so too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.geo import LatLon
    from missions.items import MissionItem


@dataclass(frozen=True, slots=True)
class HomePart:
    """A way home inside a mission.

    Parameters
    ----------
    leg_item : int
        While the vehicle drives to this item, the part may be chosen; the number on the tag.
    item : int
        The item to choose: the first behind the tag.
    items : tuple of MissionItem
        What is driven from there, to the LOITER_UNLIM that ends it.
    """

    leg_item: int
    item: int
    items: tuple[MissionItem, ...]

    @property
    def place(self) -> LatLon:
        """Where it leads."""
        return self.items[-1].position


def drive_end(items: Sequence[MissionItem]) -> int | None:
    """Return the index of the LOITER_UNLIM that ends a drive with ways home behind it; None where there are none."""
    end = next((i for i, item in enumerate(items) if item.command == Command.NAV_LOITER_UNLIM), None)
    if end is None or not any(item.command == Command.JUMP_TAG for item in items[end + 1 :]):
        return None
    return end


def home_parts(items: Sequence[MissionItem]) -> tuple[HomePart, ...]:
    """Return the ways home in a mission's items, without its home item; of a tag that is there twice the first counts, as for the autopilot."""
    end = drive_end(items)
    if end is None:
        return ()
    parts: dict[int, HomePart] = {}
    for index in range(end + 1, len(items)):
        tag = int(items[index].params[0])
        if items[index].command != Command.JUMP_TAG or not 1 <= tag <= end + 1 or tag in parts:
            continue
        last = next(
            (i for i in range(index, len(items)) if items[i].command == Command.NAV_LOITER_UNLIM), None
        )
        first = next((i for i in range(index, len(items)) if items[i].command != Command.JUMP_TAG), None)
        if last is not None and first is not None:
            driven = tuple(item for item in items[first : last + 1] if item.command != Command.JUMP_TAG)
            parts[tag] = HomePart(tag, first + 1, driven)
    return tuple(parts[tag] for tag in sorted(parts))
