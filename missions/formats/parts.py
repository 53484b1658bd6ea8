"""What a file may hold."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.situation import Situation


class Part(StrEnum):
    """What a file may hold, named as the fields of a `Situation`."""

    MISSION = "mission"
    FENCE = "fence"
    RALLY = "rally"
    PARAMETERS = "parameters"


def parts_of(situation: Situation) -> tuple[Part, ...]:
    """Return which parts are known."""
    return tuple(part for part in Part if getattr(situation, part))


def only(situation: Situation, part: Part) -> Situation:
    """Leave of mission, fence and rally points the one that is wanted."""
    mission, fence, rally = situation.mission, situation.fence, situation.rally
    return replace(
        situation,
        mission=mission if part is Part.MISSION else None,
        fence=fence if part is Part.FENCE else None,
        rally=rally if part is Part.RALLY else None,
    )
