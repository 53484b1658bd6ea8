"""What was done to the vehicle's mode or arming that is none of our doing, and what can be said of who did it.

Three answers, and no guess among them: a ground station, where its command was overheard; the autopilot itself, where a breach or a failsafe
was heard that it answers so; else nobody knows, for a transmitter sends no MAVLink.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.incident_rules import DISARMING

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.modes import Modes


class Doer(StrEnum):
    """Who took the vehicle, as far as it is known."""

    GROUND_STATION = "ground_station"
    AUTOPILOT = "autopilot"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Takeover:
    """A change of mode or arming that is not ours.

    Parameters
    ----------
    mode : int, optional
        The mode that the vehicle is in, or was asked to go to; None: it was disarmed.
    asker : tuple of int, optional
        System and component whose command was overheard; None: the vehicle's heartbeat tells of it.
    shows_failsafe : bool
        Whether that heartbeat says MAV_STATE_CRITICAL.
    is_unseen : bool
        Whether nobody knows that there was one: our HOLD was said again while nothing was heard of the vehicle, and would have undone it.
    """

    mode: int | None
    asker: tuple[int, int] | None = None
    shows_failsafe: bool = False
    is_unseen: bool = False


@dataclass(frozen=True, slots=True)
class Cause:
    """Something that the autopilot may answer by switching its mode or disarming.

    Parameters
    ----------
    reason : str
        What.
    heard_s : float
        When it was heard.
    modes : frozenset of int
        The modes that it may answer with.
    needs_heartbeat : bool
        Whether the heartbeat has to show a failsafe, too.
    """

    reason: str
    heard_s: float
    modes: frozenset[int]
    needs_heartbeat: bool = False

    def explains(self, takeover: Takeover) -> bool:
        """Return whether the autopilot answers it with just that."""
        if self.needs_heartbeat and not takeover.shows_failsafe:
            return False
        return (DISARMING if takeover.mode is None else takeover.mode) in self.modes


@dataclass(frozen=True, slots=True)
class Account:
    """What is told of a takeover.

    Parameters
    ----------
    text : str
        For people.
    by : Doer
        Who did it.
    reason : str, optional
        What the autopilot answered with it, or whose command was overheard.
    """

    text: str
    by: Doer
    reason: str | None


def account_of(takeover: Takeover, cause: Cause | None, heard: Cause | None, modes: Modes) -> Account:
    """Return what can be said of a takeover.

    Parameters
    ----------
    takeover : Takeover
        What was done.
    cause : Cause, optional
        What the autopilot answers with just that, heard just before.
    heard : Cause, optional
        What else was heard just before; it explains nothing for certain.
    modes : Modes
        The modes of the vehicle's autopilot.
    """
    if takeover.asker is not None:
        who = f"system {takeover.asker[0]} component {takeover.asker[1]}"
        return Account(f"{who} {_done(takeover, modes)}", Doer.GROUND_STATION, who)
    if takeover.is_unseen:
        text = "HOLD was said again while nothing was heard of the vehicle, so that whoever took it meanwhile was overridden"
        return Account(text, Doer.UNKNOWN, None)
    if cause is not None:
        return Account(
            f"the autopilot {_done(takeover, modes)} itself: {cause.reason}", Doer.AUTOPILOT, cause.reason
        )
    what = "was disarmed" if takeover.mode is None else f"went to {modes.words(takeover.mode)}"
    before = f" ({heard.reason} was heard just before)" if heard is not None else ""
    return Account(
        f"the vehicle {what} by itself or by somebody not heard on this link, such as an RC transmitter{before}",
        Doer.UNKNOWN,
        None,
    )


def _done(takeover: Takeover, modes: Modes) -> str:
    if takeover.mode is None:
        return "disarmed the vehicle"
    return f"switched the vehicle to {modes.words(takeover.mode)}"
