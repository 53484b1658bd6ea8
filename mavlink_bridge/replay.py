"""The director over a recorded log, in the log's own time.

A log that the bridge recorded comes with a journal: its replay makes the same calls between the same frames and so decides the same. Over any
other log the director only listens: it learns from what others transferred, and tells what it would have planned.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director import Director, Orders
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from mavlink_bridge.director import Event
    from mavlink_bridge.journal import Call, Journal
    from mavlink_bridge.tlog import LogEntry

SENT_LINK = 3
"""MAVProxy's link number, and ours, for what the recording side sent."""


def replay_recorded(entries: Iterable[LogEntry], journal: Journal) -> Iterator[Event]:
    """Repeat a bridge's run from its log and journal; give its events."""
    director = Director(journal.orders, Situation(parameters=journal.parameters))
    calls = iter(journal.calls)
    following = next(calls, None)
    count = 0
    for entry in entries:
        if entry.link == SENT_LINK:
            continue
        while following is not None and following.frames <= count:
            yield from _call(director, following)
            following = next(calls, None)
        director.receive(entry.frame, entry.time_s)
        count += 1
        yield from _spoken(director)
    while following is not None:
        yield from _call(director, following)
        following = next(calls, None)


def replay_foreign(entries: Iterable[LogEntry], orders: Orders) -> Iterator[Event]:
    """Let the director listen to a log that somebody else recorded; give its events."""
    director = Director(replace(orders, passive=True, upload=False, drive=False, arm=False, once=False))
    now_s: float | None = None
    for entry in entries:
        if now_s is None:
            director.start(entry.time_s)
            now_s = entry.time_s
        yield from _timers(director, now_s, entry.time_s)
        now_s = max(now_s, entry.time_s)
        director.receive(entry.frame, now_s)
        yield from _spoken(director)
    if now_s is not None:
        director.handle_timer(now_s)
        yield from _spoken(director)


def _timers(director: Director, now_s: float, until_s: float) -> Iterator[Event]:
    """Run the timers that are due before the next frame."""
    while (deadline_s := director.deadline_s) is not None and deadline_s <= until_s:
        now_s = max(now_s, deadline_s)
        director.handle_timer(now_s)
        yield from _spoken(director)


def _call(director: Director, call: Call) -> Iterator[Event]:
    if call.name == "start":
        director.start(call.time_s)
    elif call.name == "timer":
        director.handle_timer(call.time_s)
    elif call.name == "target" and call.target is not None:
        director.take_target(call.target, call.time_s)
    elif call.name == "confirm":
        director.confirm(call.time_s)
    elif call.name == "backup_stored":
        director.backup_stored(call.time_s)
    yield from _spoken(director)


def _spoken(director: Director) -> list[Event]:
    """Take the events; what the director wants to send goes nowhere."""
    director.messages_to_send()
    return director.take_events()
