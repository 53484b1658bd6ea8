"""Why there is no route: a result as a route is one, with its kind and its facts; only the door makes it an error."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from missions.errors import NoRouteError, StartBlockedError, TargetBlockedError
from missions.ground.seams import is_seam, seam_advice, seam_reason

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.errors import RouteError
    from missions.vehicle import Vehicle


class NoRouteKind(StrEnum):
    """What stands in the way."""

    START_BLOCKED = "start blocked"
    TARGET_BLOCKED = "target blocked"
    NOWHERE_FREE = "nowhere free"
    TOO_NARROW = "too narrow"
    WALLED_IN = "walled in"
    NO_OTHER_WAY = "no other way"
    CORNER = "corner"


_ERRORS: dict[NoRouteKind, type[RouteError]] = {
    NoRouteKind.START_BLOCKED: StartBlockedError,
    NoRouteKind.TARGET_BLOCKED: TargetBlockedError,
}


@dataclass(frozen=True, eq=False)
class NoRoute:
    """Why there is no route.

    Parameters
    ----------
    kind : NoRouteKind
        What stands in the way.
    text : str
        The same as a sentence for people, with its numbers.
    facts : mapping of str to object
        The numbers and names, as they go into the error's details.
    fences : sequence of str
        The fences to blame.
    advice : str, optional
        What would help.
    at_start : bool
        Whether it is because of how the vehicle stands.
    is_held : bool
        Whether the vehicle cannot turn where it stands, so that other clearances make no difference.
    is_seam : bool
        Whether a seam of the union is to blame.
    """

    kind: NoRouteKind
    text: str
    facts: Mapping[str, object] = field(default_factory=dict)
    fences: Sequence[str] = ()
    advice: str | None = None
    at_start: bool = False
    is_held: bool = False
    is_seam: bool = False

    def error(self) -> RouteError:
        """Return the error for people and scripts."""
        advice = {"advice": self.advice} if self.advice else {}
        seam = {"seam": True} if self.is_seam else {}
        return _ERRORS.get(self.kind, NoRouteError)(self.text, **self.facts, **advice, **seam)


def explained(why: NoRoute, vehicle: Vehicle) -> NoRoute:
    """Return it with why seams part its ends, where they do."""
    if not any(map(is_seam, why.fences)):
        return why
    text = f"{why.text}: {seam_reason(vehicle)}"
    return replace(why, text=text, advice=seam_advice(vehicle), is_seam=True)
