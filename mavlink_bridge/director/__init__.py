"""The director: decisions between the vehicle's messages and ours, sans-IO (see `states` for its table)."""

from mavlink_bridge.director.director import Director
from mavlink_bridge.director.events import SCHEMA, Event, EventName, Severity
from mavlink_bridge.director.orders import Orders, TargetSource
from mavlink_bridge.director.states import AT_WORK, ON_VEHICLE, TRANSITIONS, Cue, State

__all__ = [
    "AT_WORK",
    "ON_VEHICLE",
    "SCHEMA",
    "TRANSITIONS",
    "Cue",
    "Director",
    "Event",
    "EventName",
    "Orders",
    "Severity",
    "State",
    "TargetSource",
]
