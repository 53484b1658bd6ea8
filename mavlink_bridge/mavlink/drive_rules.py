"""How an autopilot is set driving, stopped, and watched: data alone, as part of each autopilot's table."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum, auto

from missions.items import Command


class FirstItem(StrEnum):
    """How a mission is made to begin at its first item."""

    BY_COMMAND_IN_MISSION = auto()
    """DO_SET_MISSION_CURRENT with its reset flag, once the vehicle is in the mode that drives missions: before it ArduPilot reports internal errors."""

    BY_MESSAGE_BEFORE = auto()
    """MISSION_SET_CURRENT before that mode: PX4 1.17 does not serve the command, and both keep the number until the mission is entered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveRules:
    """What differs between autopilots in setting a vehicle driving, stopping it, and knowing what it does.

    Parameters
    ----------
    first_item : FirstItem
        How a mission is begun at its first item.
    ends_in_hold : bool
        Whether a mission's end is a change to the mode that stops.
    finished_text : str, optional
        A regular expression for the beginning of the text that tells of that end.
    judges_missions : bool
        Whether MISSION_CURRENT tells that a mission cannot be driven (state 1), with its id.
    repeats_reached : bool
        Whether MISSION_ITEM_REACHED is repeated for seconds, into the next mission: then it tells nothing of an arrival.
    clicks_drive_in_hold : bool
        Whether a go-to click makes it drive in the mode that stops: the mode then does not tell that it moves, and asking for it again does not stop it. A
        place given in the same way does: its own.
    leaves_mission_for_rtl : bool
        Whether an RTL item of a mission leads out of the mode that drives missions, straight home through any zone: it looks like somebody's taking over.
    home_asked_by : tuple of Command and float
        The command that HOME_POSITION is asked for by, and its param1.
    """

    first_item: FirstItem
    ends_in_hold: bool
    finished_text: str | None = None
    judges_missions: bool
    repeats_reached: bool
    clicks_drive_in_hold: bool
    leaves_mission_for_rtl: bool
    home_asked_by: tuple[Command, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceRules:
    """When a fence that was accepted and read back counts.

    Parameters
    ----------
    seconds_a_vertex : float
        How long it takes for each vertex and circle, and once more; 0: at once.
    not_enforced : tuple of tuple of str
        Texts that say that a zone is not enforced, as regular expressions for their beginning, and why.
    """

    seconds_a_vertex: float = 0.0
    not_enforced: tuple[tuple[str, str], ...] = ()

    def reason_of(self, text: str) -> str | None:
        """Return why a zone is not enforced, where a text of the vehicle says that one is not."""
        for pattern, reason in self.not_enforced:
            if re.match(pattern, text.strip(), re.IGNORECASE):
                return reason
        return None

    def counts_after_s(self, vertices: int) -> float:
        """Return how long after its upload a fence counts; the measured times are those of so many vertices and one more."""
        return self.seconds_a_vertex * (vertices + 1) if vertices else 0.0


ARDUPILOT_DRIVING = DriveRules(
    first_item=FirstItem.BY_COMMAND_IN_MISSION,
    ends_in_hold=False,
    judges_missions=False,
    repeats_reached=False,
    clicks_drive_in_hold=False,
    leaves_mission_for_rtl=False,
    home_asked_by=(Command.GET_HOME_POSITION, 0.0),
)
ARDUPILOT_FENCE = FenceRules()

_HOME_POSITION_ID = 242.0  # HOME_POSITION

PX4_DRIVING = DriveRules(
    first_item=FirstItem.BY_MESSAGE_BEFORE,
    ends_in_hold=True,
    finished_text=r"mission finished",
    judges_missions=True,
    repeats_reached=True,
    clicks_drive_in_hold=True,
    leaves_mission_for_rtl=True,
    home_asked_by=(Command.REQUEST_MESSAGE, _HOME_POSITION_ID),
)
"""Set driving by its mode, not by MISSION_START: that arms, and would undo a disarming that crosses it on its way.

Stopped by HOLD. An empty mission leads to the same loop, later, and leaves no mission; disarmed while it drives it rolls on for good (1.17) or 14 m, and cannot be
armed for minutes (1.18).
"""

PX4_FENCE = FenceRules(
    seconds_a_vertex=0.1,
    not_enforced=(
        (r"geofence invalid, doesn't contain home", "home"),
        (r"geofence invalid, doesn't contain current vehicle", "the vehicle"),
        (r"geofence invalid", "the vehicle does not say why"),
    ),
)
"""Measured: 4 vertices 0.5 s, 16 1.7 s, 32 3.2 s, 64 6.3 s; on 1.18 a little less."""
