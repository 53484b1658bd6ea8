"""What is typed to the bridge, and the answer to it: whoever types is never left without one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.cli.values import checked_number
from mavlink_bridge.director import State
from mavlink_bridge.director.obstacle_watch import TYPED_RADIUS_M, TYPED_S
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.errors import UsageError
from missions.errors import InvalidPositionError
from missions.geo import parse_lat_lon
from missions.words import counted

if TYPE_CHECKING:
    from mavlink_bridge.director import Director
    from missions.geo import LatLon

HELP = "type LAT,LON for a target, or yes to upload a proposed plan"
CONFIRM = "type yes to upload the plan, or another target"
_YES = frozenset({"yes", "y", "go"})
_BLOCKED, _CLEAR = "blocked", "clear"
_OBSTACLES = f"{_BLOCKED} [here | LAT,LON] [RADIUS] for an obstacle, {_CLEAR} to forget all"
_MOST_RADIUS_M = 100.0  # wider is what fences are for; chosen
_MOST_SHOWN = 40  # characters of what was typed, in an answer of one line; chosen
_LATER = {
    State.LISTENING: "as soon as a vehicle is heard",
    State.LEARNING: "as soon as the vehicle is known",
    State.LOST: "as soon as the vehicle is heard again",
    State.UPLOADING: "after the upload",
    State.WITHDRAWING: "after the upload",
}


@dataclass(frozen=True, slots=True)
class TypedObstacle:
    """An obstacle that was typed; without a position it is right in front of the vehicle."""

    position: LatLon | None
    radius_m: float


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
    obstacle : TypedObstacle, optional
        The obstacle that it reports.
    clears : bool
        Whether all obstacles are to be forgotten.
    """

    answer: str
    target: LatLon | None = None
    confirms: bool = False
    obstacle: TypedObstacle | None = None
    clears: bool = False

    @property
    def is_taken(self) -> bool:
        """Whether anything follows from it."""
        is_of_obstacles = self.clears or self.obstacle is not None
        return self.confirms or self.target is not None or is_of_obstacles


def understood(line: str, director: Director) -> Typed:
    """Return what a line means to the director as it stands."""
    if line.lower() in _YES:
        if director.awaits_confirmation:
            return Typed("yes: uploading the plan", confirms=True)
        return Typed(f"nothing to confirm: {_why_nothing(director)}")
    words = line.lower().split()
    if words and words[0] in (_BLOCKED, _CLEAR):
        return _of_obstacles(words, director)
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


def _of_obstacles(words: list[str], director: Director) -> Typed:
    """Return what a line about obstacles means."""
    if ObstacleSource.KEYBOARD not in director.orders.obstacle_sources:
        return Typed("not accepted: start the bridge with --obstacles-from keyboard to report obstacles")
    if words[0] == _CLEAR:
        count = len(director.situation.obstacles.known)
        return Typed(
            f"{counted(count, 'obstacle')} forgotten; what a sensor sees is reported again", clears=True
        )
    rest = [word for word in words[1:] if word != "here"]
    radius_m, position = TYPED_RADIUS_M, None
    try:
        if rest and "," not in rest[-1]:
            radius_m = checked_number(rest.pop(), 0.1, _MOST_RADIUS_M, "metres")
        if rest:
            position = parse_lat_lon(" ".join(rest))
    except (UsageError, InvalidPositionError) as error:
        return Typed(f"not accepted: {_shown(str(error), 3 * _MOST_SHOWN)}; type {_OBSTACLES}")
    pose = director.situation.pose
    if position is None and (pose is None or pose.value.heading_deg is None):
        return Typed(
            f"not accepted: the vehicle's place or heading is not known; type {_BLOCKED} LAT,LON [RADIUS]"
        )
    where = f"at {position}" if position else "in front of the vehicle"
    text = f"obstacle of {radius_m:g} m radius {where}, kept for {TYPED_S / 60:.0f} minutes or until you type {_CLEAR}; this protects no person"
    return Typed(text, obstacle=TypedObstacle(position, radius_m))


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
