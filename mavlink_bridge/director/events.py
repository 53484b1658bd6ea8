"""What the director tells: one event a decision, for people, for scripts (JSON lines) and for replays to compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum, auto


class Severity(IntEnum):
    """MAV_SEVERITY, the ones used here."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


class EventName(StrEnum):
    """Every event there is."""

    VEHICLE_FOUND = auto()
    LEARNT = auto()
    FENCE_CHANGED = auto()
    TARGET = auto()
    STRAIGHT_LINE_UNSAFE = auto()
    HOLDING = auto()
    PLANNED = auto()
    NO_PLAN = auto()
    ROUTE_BROKEN = auto()
    OBSTACLE_ACROSS = auto()
    WAITING = auto()
    UPLOADING = auto()
    VERIFIED = auto()
    ENFORCED = auto()
    NOT_ENFORCED = auto()
    UPLOAD_FAILED = auto()
    COMMAND_FAILED = auto()
    DRIVING = auto()
    ADOPTED = auto()
    NOT_ADOPTED = auto()
    PROGRESS = auto()
    LEFT_ARMED = auto()
    LEFT_ENVELOPE = auto()
    BREACH_AHEAD = auto()
    BREACH = auto()
    FAILSAFE = auto()
    ARRIVED = auto()
    WAY_HOME = auto()
    NO_WAY_HOME = auto()
    RTL_BY_ROUTE = auto()
    CALLED_HOME = auto()
    GOING_HOME = auto()
    AT_HOME = auto()
    HOME_WAITS = auto()
    CALL_IGNORED = auto()
    TAKEN_OVER = auto()
    IDENTITY_CLASH = auto()
    MISSION_CHANGED = auto()
    LINK_LOST = auto()
    LINK_BACK = auto()
    REBOOTED = auto()
    TROUBLE = auto()


SCHEMA: dict[EventName, tuple[Severity, tuple[str, ...]]] = {
    EventName.VEHICLE_FOUND: (Severity.INFO, ("system", "component", "mav_type")),
    EventName.LEARNT: (Severity.INFO, ("zones", "vertices", "mission_items", "parameters", "position")),
    EventName.FENCE_CHANGED: (Severity.NOTICE, ("zones", "vertices")),
    EventName.TARGET: (Severity.INFO, ("position", "source")),
    EventName.STRAIGHT_LINE_UNSAFE: (Severity.WARNING, ("clearance_m", "asked_m", "fence")),
    EventName.HOLDING: (Severity.NOTICE, ("reason",)),
    EventName.PLANNED: (
        Severity.INFO,
        (
            *("length_m", "drawn_clearance_m", "clearance_m", "duration_s", "waypoints", "path"),
            *("extrapolated", "info", "warnings"),
        ),
    ),
    EventName.NO_PLAN: (Severity.WARNING, ("error", "details")),
    EventName.ROUTE_BROKEN: (Severity.CRITICAL, ("clearance_m", "asked_m", "fence")),
    EventName.OBSTACLE_ACROSS: (Severity.WARNING, ("obstacle", "clearance_m", "asked_m")),
    EventName.WAITING: (Severity.WARNING, ("obstacle", "forgotten_in_s")),
    EventName.UPLOADING: (Severity.INFO, ("mission_items",)),
    EventName.VERIFIED: (Severity.INFO, ("mission_items", "pushes")),
    EventName.ENFORCED: (Severity.INFO, ("zones", "vertices", "not_enforced")),
    EventName.NOT_ENFORCED: (Severity.WARNING, ("zones", "reason")),
    EventName.UPLOAD_FAILED: (Severity.ERROR, ("error", "details")),
    EventName.COMMAND_FAILED: (Severity.ERROR, ("command", "result")),
    EventName.DRIVING: (Severity.INFO, ("mission_items",)),
    EventName.ADOPTED: (Severity.NOTICE, ("mission_items", "item")),
    EventName.NOT_ADOPTED: (Severity.WARNING, ("reason",)),
    EventName.PROGRESS: (
        Severity.INFO,
        ("item", "distance_left_m", "time_left_s", "least_clearance_m", "deviation_m", "position"),
    ),
    EventName.LEFT_ARMED: (Severity.WARNING, ()),
    EventName.LEFT_ENVELOPE: (Severity.WARNING, ("outside_m", "position")),
    EventName.BREACH_AHEAD: (
        Severity.CRITICAL,
        ("fence", "to_fence_m", "stopping_m", "speed_mps", "source", "best", "go_on_m"),
    ),
    EventName.BREACH: (
        Severity.CRITICAL,
        ("breaches", "position", "fence", "beyond_m", "breach_type", "mode"),
    ),
    EventName.FAILSAFE: (Severity.ERROR, ("reason", "mode")),
    EventName.ARRIVED: (Severity.NOTICE, ("driven_m", "took_s", "least_clearance_m", "breaches")),
    EventName.WAY_HOME: (Severity.INFO, ("place", "kind", "length_m", "time_s")),
    EventName.NO_WAY_HOME: (Severity.WARNING, ("reason", "position")),
    EventName.RTL_BY_ROUTE: (Severity.NOTICE, ()),
    EventName.CALLED_HOME: (Severity.NOTICE, ("call", "detail")),
    EventName.GOING_HOME: (Severity.NOTICE, ("call", "place", "length_m", "duration_s")),
    EventName.AT_HOME: (Severity.NOTICE, ("call", "place")),
    EventName.HOME_WAITS: (Severity.WARNING, ("call", "reason")),
    EventName.CALL_IGNORED: (Severity.WARNING, ("call", "reason")),
    EventName.TAKEN_OVER: (Severity.NOTICE, ("mode", "by", "reason")),
    EventName.IDENTITY_CLASH: (Severity.CRITICAL, ("system", "component", "held")),
    EventName.MISSION_CHANGED: (Severity.WARNING, ("mission_items",)),
    EventName.LINK_LOST: (Severity.ERROR, ("silent_s",)),
    EventName.LINK_BACK: (Severity.NOTICE, ()),
    EventName.REBOOTED: (Severity.WARNING, ()),
    EventName.TROUBLE: (Severity.ERROR, ("error", "details")),
}
"""For each event how grave it is and which data it carries; the documentation's table is made from it."""


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened or was decided.

    Parameters
    ----------
    time_s : float
        When, in the director's time.
    name : EventName
        What.
    text : str
        For people.
    data : mapping
        For scripts; the keys stand in `SCHEMA`.
    """

    time_s: float
    name: EventName
    text: str
    data: Mapping[str, object] = field(default_factory=dict)

    @classmethod
    def of(cls, time_s: float, name: EventName, text: str, values: Sequence[object]) -> Event:
        """Make an event of its schema's values, in order."""
        return cls(time_s, name, text, dict(zip(SCHEMA[name][1], values, strict=True)))

    @property
    def severity(self) -> Severity:
        """How grave it is."""
        return SCHEMA[self.name][0]

    def as_json(self) -> dict[str, object]:
        """Return what a JSON line holds."""
        return {
            "time_s": round(self.time_s, 3),
            "event": str(self.name),
            "severity": self.severity.name.lower(),
            "text": self.text,
            **self.data,
        }
