"""How a safe upload ends, and what is on the vehicle then."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum, auto
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import MissionResult, MissionType
    from mavlink_bridge.mavlink.stored_form import Difference
    from missions.items import MissionItem


class OutcomeKind(StrEnum):
    """How a safe upload ended."""

    VERIFIED = auto()  # the last complete read-back equalled the list, nothing was written since
    REFUSED = auto()  # the vehicle (or the check of its limits) refused; the old list is there
    BUSY = auto()  # another ground station kept the list busy, or kept writing it; nothing was written
    ACTIVE = auto()  # armed in AUTO; nothing was written
    NO_ANSWER = auto()  # silence before anything was written
    UNCHANGED = auto()  # the upload did not get through; the old list was never replaced
    RESTORED = auto()  # the upload did not get through; the old list was put back and verified
    DIFFERENT = auto()  # something else is on the vehicle
    UNKNOWN = (
        auto()
    )  # what is on the vehicle could not be read, was another list each time, or is being written by others


class Held(StrEnum):
    """What the vehicle holds now."""

    WANTED = auto()
    OLD = auto()
    UNFINISHED = auto()  # part old, part new
    FOREIGN = auto()  # neither
    UNKNOWN = auto()


@dataclass(frozen=True, slots=True)
class VerifiedUploadOutcome:
    """How a safe upload ended and what is on the vehicle.

    Parameters
    ----------
    kind : OutcomeKind
        How it ended.
    held : Held
        What the vehicle holds now.
    mission_type : MissionType
        Which list.
    result : MissionResult, optional
        What the vehicle refused with.
    item : int, optional
        The item it refused, for missions with home at 0.
    texts : tuple of str
        STATUSTEXTs that came while items were sent, or the limit that the list breaks.
    differences : tuple of Difference
        Where what is on the vehicle differs from what was wanted, as last read.
    backup : tuple of MissionItem, optional
        The list that was there before; None if it was never read.
    found : tuple of MissionItem, optional
        The list as last read; None if nothing was read after the upload began.
    pushes : int
        How often the list was sent; 0: it was there already, or nothing was written.
    is_coarse : bool
        The vehicle gives positions as 32-bit floats only: what is there is known to about 1 m.
    writer : tuple of int, optional
        System and component of another station that wrote to the list meanwhile; our own ids if somebody else speaks with these.
    shortfall : str
        How a read that took too long fell short, in words; empty if none did.
    """

    kind: OutcomeKind
    held: Held
    mission_type: MissionType
    result: MissionResult | None = None
    item: int | None = None
    texts: tuple[str, ...] = ()
    differences: tuple[Difference, ...] = ()
    backup: tuple[MissionItem, ...] | None = None
    found: tuple[MissionItem, ...] | None = None
    pushes: int = 0
    is_coarse: bool = False
    writer: tuple[int, int] | None = None
    shortfall: str = ""

    @property
    def is_verified(self) -> bool:
        """Whether the vehicle holds the list, proved by reading it back."""
        return self.kind is OutcomeKind.VERIFIED
