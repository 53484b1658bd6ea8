"""The director over a recorded log, in the log's own time.

A log that the bridge recorded comes with a journal: its replay makes the same calls between the same frames and so decides the same. Over any
other log the director only listens: it learns from what others transferred, and reports what it would have planned.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from mavlink_bridge.director import Director, Orders
from mavlink_bridge.errors import BackupError, LogError, VehicleInUseError
from mavlink_bridge.logbook.clock import Pulse, SteadyClock
from mavlink_bridge.many import Task
from mavlink_bridge.replay.journal import journal_path, read_journal, request_from_text
from mavlink_bridge.tlog import TlogReader

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from mavlink_bridge.director import Event
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.replay.journal import Call, Journal
    from mavlink_bridge.tlog import LogEntry

Look: TypeAlias = "Callable[[Director, Frame, float], None]"
"""Sees the director after each frame, with the log's own time of it."""

SENT_LINK = 3
"""MAVProxy's link number, and ours, for what the recording side sent."""

_NO_BACKUP = {"backup_failed": BackupError, "in_use": VehicleInUseError}
"""Calls that report why nothing can be uploaded."""
_PLAIN_CALLS: dict[str, Callable[[Director, Call], None]] = {
    "clear": lambda director, call: director.clear_obstacles(call.time_s),
    "confirm": lambda director, call: director.confirm(call.time_s),
    "drive": lambda director, call: director.start_drive(call.time_s),
    "suspect": lambda director, _call: director.suspect_lists(),
    "withhold": lambda director, call: director.withhold_drive(call.time_s),
    "hold": lambda director, call: director.hold(call.text, call.time_s),
}
_NOTED = ("note_stored", "note_failed")
_STILL_ADVICE = "its fence, mission and targets can still be used: `pbpp log FILE`, `pbpp plan --log FILE`"


def replay_log(
    log: Path,
    orders: Orders,
    wait: Callable[[float], None] | None = None,
    look: Look | None = None,
) -> Iterator[Event]:
    """Return the director's events over a log; with its journal where there is one.

    Parameters
    ----------
    log : pathlib.Path
        A telemetry log.
    orders : Orders
        What is asked of plans where there is no journal.
    wait : callable, optional
        Called before each frame with the seconds since the log's begin, to let them pass.
    look : callable, optional
        Called after each frame with the director, the frame and the log's own time of it.

    Raises
    ------
    LogError
        The log or its journal cannot be used.
    """
    entries: Iterable[LogEntry] = TlogReader(log)
    if wait is not None:
        entries = _paced(entries, wait)
    journal = journal_path(log)
    if journal.exists():
        return replay_recorded(entries, read_journal(journal), look)
    return replay_foreign(entries, orders, look)


def replay_task(log: Path, orders: Orders) -> Task[Orders]:
    """Return the replay of a log as a task for workers: with its journal, where it has one."""
    journal = journal_path(log)
    return Task(orders, (log, journal) if journal.exists() else (log,))


def replay_done(task: Task[Orders]) -> list[dict[str, object]]:
    """Do such a task: return the log's events as JSON objects, with its name."""
    log = task.files[0]
    return [{"log": log.name, **event.as_json()} for event in replay_log(log, task.asked)]


def replay_recorded(
    entries: Iterable[LogEntry], journal: Journal, look: Look | None = None
) -> Iterator[Event]:
    """Repeat a bridge's run from its log and journal; return its events."""
    director = Director(journal.orders, journal.described, journal.notes)
    notes_drives = any(call.name in _NOTED for call in journal.calls)
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
        if not notes_drives:  # recorded before there were notes of drives, or there was no drive
            director.note_stored()
        count += 1
        yield from _spoken(director)
        if look is not None:
            look(director, entry.frame, entry.time_s)
    while following is not None:
        yield from _call(director, following)
        following = next(calls, None)


def replay_foreign(entries: Iterable[LogEntry], orders: Orders, look: Look | None = None) -> Iterator[Event]:
    """Let the director listen to a log that somebody else recorded; return its events, at the log's times.

    The director's own time only goes forward: where the log's clock was set, it goes on from where it was.

    Raises
    ------
    LogError
        The log's clock stands still: the director, who waits for seconds to pass, can report nothing of it.
    """
    director = Director(replace(orders, passive=True, upload=False, drive=False, arm=False, once=False))
    clock = SteadyClock()
    pulse = Pulse()
    before_s: float | None = None
    for entry, now_s in clock.over(entries):
        pulse.take(entry.frame, now_s)
        if before_s is None:
            director.start(now_s)
            before_s = now_s
        yield from _at_log_time(_timers(director, before_s, now_s), clock)
        before_s = now_s
        director.receive(entry.frame, now_s)
        yield from _at_log_time(_spoken(director), clock)
        if look is not None:
            look(director, entry.frame, now_s + clock.offset_s)
    if before_s is not None:
        director.handle_timer(before_s)
        _make_plan(director, before_s)
        yield from _at_log_time(_spoken(director), clock)
    if pulse.trouble is not None:
        raise LogError(f"{pulse.trouble}; it cannot be replayed", advice=_STILL_ADVICE)


def _at_log_time(events: Iterable[Event], clock: SteadyClock) -> Iterator[Event]:
    for event in events:
        yield replace(event, time_s=event.time_s + clock.offset_s)


def _paced(entries: Iterable[LogEntry], wait: Callable[[float], None]) -> Iterator[LogEntry]:
    begin_s: float | None = None
    for entry, now_s in SteadyClock().over(entries):
        begin_s = now_s if begin_s is None else begin_s
        wait(now_s - begin_s)
        yield entry


def _timers(director: Director, now_s: float, until_s: float) -> Iterator[Event]:
    """Run the timers that are due before the next frame."""
    while (deadline_s := director.deadline_s) is not None and deadline_s <= until_s:
        now_s = max(now_s, deadline_s)
        director.handle_timer(now_s)
        _make_plan(director, now_s)
        yield from _spoken(director)


def _call(director: Director, call: Call) -> Iterator[Event]:
    if call.name == "start":
        director.start(call.time_s)
    elif call.name == "timer":
        director.handle_timer(call.time_s)
    elif call.name == "target" and call.target is not None:
        director.take_target(call.target, call.time_s)
    elif call.name == "obstacle":
        director.take_obstacle(call.target, float(call.text), call.time_s)
    elif call.name == "request":
        director.take_request(request_from_text(call.text), call.time_s)
    elif call.name in _PLAIN_CALLS:
        _PLAIN_CALLS[call.name](director, call)
    elif call.name == "backup_stored":
        director.backup_stored(call.time_s, Path(call.text) if call.text else None)
    elif call.name == "note_stored":
        director.note_stored()
    elif call.name == "note_failed":
        director.note_failed(BackupError(call.text), call.time_s)
    elif call.name in _NO_BACKUP:
        director.backup_failed(_NO_BACKUP[call.name](call.text), call.time_s)
    elif call.name == "plan_made":
        _make_plan(director, call.time_s)
    elif call.name == "ways_made" and (ways := director.pending_ways) is not None:
        director.ways_made(ways, ways.made(), call.time_s)
    yield from _spoken(director)


def _make_plan(director: Director, now_s: float) -> None:
    """Make the plan that the director waits for, if it does."""
    if (task := director.pending_plan) is not None:
        director.plan_made(task, task.made(), now_s)


def _spoken(director: Director) -> list[Event]:
    """Take the events; what the director wants to send goes nowhere."""
    director.messages_to_send()
    return director.take_events()
