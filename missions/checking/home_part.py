"""Ways home inside a mission: parts behind its end, one of which is chosen while a leg is driven.

ArduPilot Rover has nothing that leads there by itself: up to 4.7 its ``ModeAuto::start_command`` passes over DO_LAND_START (189) and DO_RETURN_PATH_START
(188), its failsafes know RTL, Hold and SmartRTL only (Rover/mode_auto.cpp, Rover/failsafe.cpp), and its own list of what is to come still has "Rover:
implement DO_LAND_START" (issue 19055). So somebody chooses: the operator, or a companion computer, sends the number of the part's first item
(MISSION_SET_CURRENT, DO_SET_MISSION_CURRENT) while the vehicle is in AUTO. JUMP_TAG (600), which ArduPilot has since 4.4, marks the parts: the tag is the number of
the item to which the vehicle drives when the part is chosen.

The drive ends with a jump to the last item (DO_JUMP, repeated without end), a tag behind which there is nothing: so the mission is complete, and the vehicle
stops. Nothing but a choice leads into the parts between; each ends with the same jump. (LOITER_UNLIM would be a simpler end, but before
ArduPilot 4.5 a steered rover goes on steering at it.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from missions.items import Command, CoordinateFrame, MissionItem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.geo import LatLon


FOR_EVER = -1.0
"""DO_JUMP's count of a jump that is taken each time."""


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
        What is driven from there, without the jump that ends it.
    numbers : tuple of int
        The number of each of them in the mission.
    """

    leg_item: int
    item: int
    items: tuple[MissionItem, ...]
    numbers: tuple[int, ...]

    @property
    def place(self) -> LatLon:
        """Where it leads."""
        return next(item.position for item in reversed(self.items) if item.is_placed)


def jump_to_end(last_item: int) -> MissionItem:
    """Return the jump that ends a drive, and each way home, over what stands between it and the last item."""
    return MissionItem(
        Command.DO_JUMP, CoordinateFrame.MISSION, params=(float(last_item), FOR_EVER, 0.0, 0.0)
    )


def drive_end(items: Sequence[MissionItem]) -> int | None:
    """Return the index of the jump that ends a drive with ways home behind it; None where there are none."""
    if not items or items[-1].command != Command.JUMP_TAG:
        return None
    end = next((index for index, item in enumerate(items) if _jumps_to_end(item, len(items))), None)
    return None if end in (None, len(items) - 2) else end


def home_parts(items: Sequence[MissionItem]) -> tuple[HomePart, ...]:
    """Return the ways home in a mission's items, without its home item; of a tag that is there twice the first counts, as for the autopilot."""
    end = drive_end(items)
    if end is None:
        return ()
    parts: dict[int, HomePart] = {}
    for index in range(end + 1, len(items) - 1):
        tag = items[index].params[0]
        if items[index].command != Command.JUMP_TAG or not 1 <= tag <= end or tag in parts:
            continue
        rest = range(index, len(items))
        last = next(i for i in rest if _jumps_to_end(items[i], len(items)) or i == len(items) - 1)
        first = next((i for i in rest if items[i].command != Command.JUMP_TAG), last)
        numbers = tuple(i + 1 for i in range(first, last) if items[i].command != Command.JUMP_TAG)
        driven = tuple(items[number - 1] for number in numbers)
        if any(item.is_placed for item in driven):
            parts[int(tag)] = HomePart(int(tag), first + 1, driven, numbers)
    return tuple(parts[tag] for tag in sorted(parts))


def _jumps_to_end(item: MissionItem, count: int) -> bool:
    return item.command == Command.DO_JUMP and item.params[:2] == (float(count), FOR_EVER)
