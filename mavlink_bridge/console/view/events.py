"""Events as they are shown: decisions of the director, and the vehicle's own texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.console.view.places import finite, place
from mavlink_bridge.console.view.sections import EventView
from missions.geo import LatLon
from missions.words import harmless

if TYPE_CHECKING:
    from mavlink_bridge.director import Event
    from mavlink_bridge.mavlink.messages import Statustext

_SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
"""MAV_SEVERITY."""

_MOST_LETTERS = 500
"""Of an event's text that are shown: a vehicle may send thousands, and all else would be out of sight. Chosen, not measured."""

_PLACES = ("position", "path")
"""Data of events that are places, latitude first; what is shown has the longitude first."""


def event_view(event: Event) -> EventView:
    """Return a decision of the director."""
    at = event.data.get("position")
    is_place = isinstance(at, list | tuple) and len(at) == 2
    return EventView(
        id=0,
        time_s=round(event.time_s, 3),
        name=str(event.name),
        severity=event.severity.name.lower(),
        text=_shown(event.text),
        position=place(LatLon(*at)) if is_place else None,  # type: ignore[misc] # two numbers
        data={key: _plain(value) for key, value in event.data.items() if key not in _PLACES},
    )


def text_view(message: Statustext, now_s: float) -> EventView:
    """Return what the vehicle wrote."""
    severity = _SEVERITIES[message.severity] if 0 <= message.severity < len(_SEVERITIES) else "info"
    return EventView(
        id=0, time_s=round(now_s, 3), name="statustext", severity=severity, text=_shown(message.text)
    )


def _shown(text: str) -> str:
    """Return a text as it is shown: harmless, and not without end."""
    seen = harmless(text[: _MOST_LETTERS + 1])
    return seen if len(seen) <= _MOST_LETTERS else f"{seen[:_MOST_LETTERS]}…"


def _plain(value: object) -> object:
    """Return data of an event as JSON has it."""
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return str(value)
