"""By what a vehicle is known again: the uid of its board, else how it was connected.

System ids do not distinguish vehicles: nearly every rover is system 1.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from enum import StrEnum, auto
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import AutopilotVersion


class Kinship(StrEnum):
    """Whether two marks are of one vehicle."""

    SAME = auto()
    OTHER = auto()
    UNCERTAIN = auto()


@dataclass(frozen=True, slots=True)
class VehicleMark:
    """What is known of which vehicle it is.

    Parameters
    ----------
    system : int
        Its system id.
    uid : str
        The uid of its board (AUTOPILOT_VERSION's ``uid2``, else ``uid``) in hexadecimal; empty without one.
    connection : str
        The connection string it was reached by; empty where that is not known.
    autopilot : int, optional
        Its MAV_AUTOPILOT.
    """

    system: int
    uid: str = ""
    connection: str = ""
    autopilot: int | None = None

    def __str__(self) -> str:
        known = (
            f"board {self.uid}" if self.uid else f"connected by {self.connection}" if self.connection else ""
        )
        return f"system {self.system}" + (f" ({known})" if known else "")

    @property
    def key(self) -> str:
        """A short name of the vehicle for files."""
        text = self.uid or f"{self.system} {self.connection} {self.autopilot}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def kinship(self, other: VehicleMark) -> Kinship:
        """Return whether another mark is of the same vehicle.

        Uids settle it. Of two vehicles without one the connection, the system id and the autopilot must be the same. A vehicle that reported its uid
        only once, and one of which nothing was noted, may be this one or another.
        """
        if self.uid and other.uid:
            return Kinship.SAME if self.uid == other.uid else Kinship.OTHER
        if self.system != other.system:
            return Kinship.OTHER
        if self.uid or other.uid or not (self.connection and other.connection):
            return Kinship.UNCERTAIN
        is_same = (self.connection, self.autopilot) == (other.connection, other.autopilot)
        return Kinship.SAME if is_same else Kinship.OTHER


def uid_of(version: AutopilotVersion | None) -> str:
    """Return the board's uid in hexadecimal, empty where none was reported."""
    if version is None:
        return ""
    if any(version.uid2):
        return bytes(version.uid2).rstrip(b"\0").hex()
    return f"{version.uid:016x}" if version.uid else ""
