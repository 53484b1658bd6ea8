"""What a log holds, as data. All times are seconds since the log's first record, by a clock that only runs forward."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavlink_bridge.logbook.grade import Grade
    from mavlink_bridge.tlog import Damage, Traffic
    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.situation import ListKind, Situation

Sender = tuple[int, int]
"""System and component id."""


class Way(StrEnum):
    """What was done with a list."""

    UPLOAD = "upload"
    READ_BACK = "read-back"
    CLEAR = "clear"
    PARTIAL_WRITE = "partial write"


class Ending(StrEnum):
    """How a transfer ended."""

    COMPLETE = "complete"
    PARTIAL = "partial"
    UNANSWERED = "unanswered"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class Transfer:
    """A fence, mission or rally list on its way.

    Parameters
    ----------
    kind : ListKind
    way : Way
    station : tuple of int or None
        Who wrote or read: system and component id; None where only the vehicle's side was recorded and it names nobody.
    begun_s, ended_s : float
    announced : int or None
        Items as announced; None where the announcement was not seen.
    seen : int
        Different items seen.
    ending : Ending
        Complete: all items were seen and, where the list was written, accepted. Partial: items are missing in the log, whatever the
        vehicle answered. Unanswered: no MISSION_ACK was seen.
    result : str or None
        MAV_MISSION_RESULT of the vehicle's MISSION_ACK.
    repeats : int
        How often an item, or the announcement, came again: each was lost on a link, or thought to be.
    """

    kind: ListKind
    way: Way
    station: Sender | None
    begun_s: float
    ended_s: float
    announced: int | None
    seen: int
    ending: Ending
    result: str | None = None
    repeats: int = 0


@dataclass(frozen=True, slots=True)
class TargetSeen:
    """A place somebody sent the vehicle to: by which message, who, and how often it was repeated within seconds."""

    time_s: float
    position: LatLon
    source: str
    station: Sender
    said: int = 1


@dataclass(frozen=True, slots=True)
class ModeSpan:
    """A stretch in one mode, armed or not, as the heartbeats report."""

    mode: int
    name: str
    armed: bool
    begun_s: float
    ended_s: float
    driven_m: float


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """A parameter that matters took another value while the log was written."""

    time_s: float
    name: str
    before: float
    after: float


@dataclass(frozen=True, slots=True)
class ParameterLog:
    """What a log reports of a vehicle's parameters.

    Parameters
    ----------
    values : mapping of str to float
        Those that matter to planning and driving, at the end.
    seen : int
        How many the log reports in all.
    changes : tuple of ParameterChange
    """

    values: Mapping[str, float]
    seen: int
    changes: tuple[ParameterChange, ...]


@dataclass(frozen=True, slots=True)
class Nearest:
    """Where the vehicle came nearest to the fence while it was armed.

    Parameters
    ----------
    clearance_m : float
        Of its track to the nearest forbidden ground; 0 where it was on it.
    time_s : float
    position : LatLon
    zone : str
        The zone that was nearest.
    """

    clearance_m: float
    time_s: float
    position: LatLon
    zone: str


@dataclass(frozen=True, slots=True)
class Intrusion:
    """A stretch of the track on forbidden ground while armed.

    Parameters
    ----------
    begun_s, ended_s : float
    deepest_m : float
        The farthest from allowed ground.
    position : LatLon
        Where that was.
    zone : str
        The zone that forbids it there.
    begun_at : LatLon
        Where it began.
    """

    begun_s: float
    ended_s: float
    deepest_m: float
    position: LatLon
    zone: str
    begun_at: LatLon


@dataclass(frozen=True, slots=True)
class ReportedBreach:
    """A breach that the autopilot itself reported, by FENCE_STATUS, PX4 by a text: its count then, and FENCE_BREACH type."""

    time_s: float
    count: int
    breach_type: int


@dataclass(frozen=True, slots=True)
class TrackPart:
    """A stretch of the track driven in one mode, thinned: fit for drawing. Each drive of a mission is one."""

    mode: str
    begun_s: float
    positions: tuple[LatLon, ...]


@dataclass(frozen=True, eq=False)
class VehicleLog:
    """What a log reports of one vehicle.

    Parameters
    ----------
    system, component, mav_type : int
        The vehicle.
    situation : Situation
        What is known at the log's end.
    fences : tuple of (float, Fence)
        Every fence that held for some time, and from when.
    parameters : ParameterLog
    driven_m : float
        The track's length, without the wandering of a standing vehicle's position.
    positions, positions_without_fix : int
        GLOBAL_POSITION_INT with and without a place.
    nearest : Nearest or None
        None without a fence, or where it never drove.
    notes : tuple of str
        What could not be reported, and why.
    """

    system: int
    component: int
    mav_type: int
    situation: Situation
    fences: tuple[tuple[float, Fence], ...]
    transfers: tuple[Transfer, ...]
    targets: tuple[TargetSeen, ...]
    targets_seen: int
    modes: tuple[ModeSpan, ...]
    parameters: ParameterLog
    driven_m: float
    positions: int
    positions_without_fix: int
    nearest: Nearest | None
    intrusions: tuple[Intrusion, ...]
    reported_breaches: tuple[ReportedBreach, ...]
    track: tuple[TrackPart, ...]
    grades: tuple[Grade, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Logbook:
    """What a log holds.

    Parameters
    ----------
    name : str
        The file's name.
    begins_s : float
        The first record's time, seconds since 1970 (in a raw log since the vehicle booted).
    duration_s : float
        From the first record to the last, by a clock that only runs forward.
    has_timestamps : bool
        False for a raw log.
    clock_jumps : int
        How often the log's clock was set while it was written; rates are then not to be trusted.
    clock_trouble : str or None
        That the clock stands still: no time, rate or speed of this log means anything.
    traffic : tuple of Traffic
        Messages by sender and type.
    damage : Damage
    vehicles : tuple of VehicleLog
    """

    name: str
    begins_s: float
    duration_s: float
    has_timestamps: bool
    clock_jumps: int
    clock_trouble: str | None
    traffic: tuple[Traffic, ...]
    damage: Damage
    vehicles: tuple[VehicleLog, ...]
