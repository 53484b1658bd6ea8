"""What a log holds, as data: who speaks, which lists went over the link, what was driven and how near to the fence."""

from mavlink_bridge.logbook.clock import Pulse, SteadyClock
from mavlink_bridge.logbook.facts import (
    Ending,
    Intrusion,
    Logbook,
    ModeSpan,
    Nearest,
    ParameterChange,
    ReportedBreach,
    TargetSeen,
    TrackPart,
    Transfer,
    VehicleLog,
    Way,
)
from mavlink_bridge.logbook.reading import read_logbook

__all__ = [
    "Ending",
    "Intrusion",
    "Logbook",
    "ModeSpan",
    "Nearest",
    "ParameterChange",
    "Pulse",
    "ReportedBreach",
    "SteadyClock",
    "TargetSeen",
    "TrackPart",
    "Transfer",
    "VehicleLog",
    "Way",
    "read_logbook",
]
