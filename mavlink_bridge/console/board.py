"""What every page is to be shown: the newest of each section, the events and the track; and what of it a page has not got yet. Clock-free.

A page that is slow gets, when it can take something again, the newest of what has changed since and nothing in between.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import msgspec

from mavlink_bridge.console.view.sections import EventView, Sections, TrackRow
from mavlink_bridge.console.wire import encode

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MOST_EVENTS = 500
"""That a page is shown when it connects, and that may wait for a slow one; chosen, not measured."""

NAMES = tuple(one.name for one in fields(Sections))
"""The sections."""


@dataclass(slots=True)
class Seen:
    """What one page has got: the version of each section, the newest event, and how much of which track."""

    versions: dict[str, int] = field(default_factory=dict)
    event: int = 0
    generation: int = -1
    rows: int = 0

    @classmethod
    def of_new_board(cls) -> Seen:
        """Return the mark of a page that has got all of a board that was just made."""
        return cls(dict.fromkeys(NAMES, 1), generation=0)


class Board:
    """The newest of everything.

    Parameters
    ----------
    sections : Sections
        What is known at first.
    most_events : int, optional
        How many are kept; None keeps all, as of a log.

    Attributes
    ----------
    sections : dict
        The newest of each section, by its name.
    """

    def __init__(self, sections: Sections, most_events: int | None = MOST_EVENTS) -> None:
        self.sections: dict[str, Any] = {name: getattr(sections, name) for name in NAMES}
        self._encoded = {name: msgspec.Raw(encode(value)) for name, value in self.sections.items()}
        self._versions = dict.fromkeys(NAMES, 1)
        self._events: deque[EventView] = deque(maxlen=most_events)
        self._event_id = 0
        self._rows: list[TrackRow] = []
        self._generation = 0

    @property
    def events(self) -> tuple[EventView, ...]:
        """The newest events."""
        return tuple(self._events)

    @property
    def rows(self) -> Sequence[TrackRow]:
        """The track."""
        return self._rows

    def publish(self, sections: Mapping[str, Any]) -> bool:
        """Take newer sections; return whether any of them differs from what was known."""
        has_changed = False
        for name, value in sections.items():
            before = self.sections[name]
            if value is before or value == before:
                continue
            self.sections[name] = value
            self._encoded[name] = msgspec.Raw(encode(value))
            self._versions[name] += 1
            has_changed = True
        return has_changed

    def add_events(self, events: Iterable[EventView]) -> None:
        """Take what happened; each gets the next number."""
        for event in events:
            self._event_id += 1
            self._events.append(replace(event, id=self._event_id))

    def add_rows(self, rows: Iterable[TrackRow]) -> None:
        """Take more of the track."""
        self._rows.extend(rows)

    def replace_rows(self, rows: Sequence[TrackRow]) -> None:
        """Take the whole track anew: thinned, or another moment's."""
        self._rows = list(rows)
        self._generation += 1

    def news(self, mark: Seen) -> dict[str, Any]:
        """Return what a page has not got yet, as the fields of a `wire.ChangeMessage`, and note that it has got it; empty where it has all."""
        found: dict[str, Any] = {}
        changed = [name for name in NAMES if mark.versions.get(name) != self._versions[name]]
        if changed:
            found["state"] = {name: self._encoded[name] for name in changed}
            mark.versions.update((name, self._versions[name]) for name in changed)
        if mark.event != self._event_id:
            found["events"] = [one for one in self._events if one.id > mark.event]
            mark.event = self._event_id
        if mark.generation != self._generation:
            found["track"], found["track_anew"] = self._rows[:], True
            mark.generation, mark.rows = self._generation, len(self._rows)
        elif mark.rows < len(self._rows):
            found["track"] = self._rows[mark.rows :]
            mark.rows = len(self._rows)
        return found
