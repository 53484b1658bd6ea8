"""What is typed to the bridge, and the answer to it: whoever types is never left without one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.director import State
from missions.errors import InvalidPositionError
from missions.geo import parse_lat_lon

if TYPE_CHECKING:
    from mavlink_bridge.director import Director
    from missions.geo import LatLon

HELP = "type LAT,LON for a target, or yes to upload a proposed plan"
CONFIRM = "type yes to upload the plan, or another target"
_YES = frozenset({"yes", "y", "go"})
_MOST_SHOWN = 40  # characters of what was typed, in an answer of one line; chosen
_LATER = {
    State.LISTENING: "as soon as a vehicle is heard",
    State.LEARNING: "as soon as the vehicle is known",
    State.LOST: "as soon as the vehicle is heard again",
    State.UPLOADING: "after the upload",
    State.WITHDRAWING: "after the upload",
}


@dataclass(frozen=True, slots=True)
class Typed:
    """A line that was typed.

    Parameters
    ----------
    answer : str
        What is answered.
    target : LatLon, optional
        The target that it gives.
    confirms : bool
        Whether it is the yes that a plan waits for.
    """

    answer: str
    target: LatLon | None = None
    confirms: bool = False

    @property
    def is_taken(self) -> bool:
        """Whether anything follows from it."""
        return self.confirms or self.target is not None


def understood(line: str, director: Director) -> Typed:
    """Return what a line means to the director as it stands."""
    if line.lower() in _YES:
        if director.awaits_confirmation:
            return Typed("yes: uploading the plan", confirms=True)
        return Typed(f"nothing to confirm: {_why_nothing(director)}")
    try:
        target = parse_lat_lon(line)
    except InvalidPositionError as error:
        shown = _shown(line)
        if not any(letter.isdigit() for letter in line):
            return Typed(
                f"not understood: {shown!r}; {HELP}; to stop the vehicle use the transmitter or ground station"
            )
        return Typed(f"not accepted: {_shown(str(error), 3 * _MOST_SHOWN)}; {HELP}")
    later = _LATER.get(director.state)
    return Typed(f"target {target} accepted" + (f": planned {later}" if later else ""), target=target)


def _why_nothing(director: Director) -> str:
    if director.state is State.LOST:
        return "the vehicle is not heard"
    if not director.orders.upload:
        return "without --upload plans are only reported"
    if not director.orders.confirm:
        return "plans are uploaded without a yes (--confirm waits for it)"
    return "no plan is proposed"


def _shown(text: str, most: int = _MOST_SHOWN) -> str:
    """Return a text short and without control characters."""
    clean = "".join(letter if letter.isprintable() else "?" for letter in text)
    return clean if len(clean) <= most else f"{clean[:most]}…"
