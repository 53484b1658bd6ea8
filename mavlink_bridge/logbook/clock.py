"""A clock that only runs forward, from the times of a log, which may jump and run backwards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from mavlink_bridge.mavlink.messages import Heartbeat
from mavlink_bridge.mavlink.vehicles import is_vehicle

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.tlog import LogEntry

NEAR_S: Final = 5.0
"""Records no farther apart than this follow one another; a step back by less is a late record."""

SILENCE_S: Final = 86_400.0
"""A step forward by at most this is time that passed; by more, or backwards, the clock was set."""


LEAST_BEATS: Final = 10
LEAST_BEAT_S: Final = 0.1
"""Autopilots send a HEARTBEAT a second; so many that come faster than this were not timed."""


class Pulse:
    """Detects a log whose clock stands still, by its heartbeats: nothing in it can be timed.

    Attributes
    ----------
    beats : int
        The most heartbeats that one autopilot sent.
    """

    def __init__(self) -> None:
        self.beats = 0
        self._counts: dict[tuple[int, int], int] = {}
        self._first_s: float | None = None
        self._elapsed_s = 0.0

    def take(self, frame: Frame, now_s: float) -> None:
        """Take a frame and the time that the log gives it."""
        self._first_s = now_s if self._first_s is None else self._first_s
        self._elapsed_s = now_s - self._first_s
        if isinstance(frame.message, Heartbeat) and is_vehicle(frame.message):
            sender = (frame.system, frame.component)
            self._counts[sender] = self._counts.get(sender, 0) + 1
            self.beats = max(self.beats, self._counts[sender])

    @property
    def trouble(self) -> str | None:
        """Return a message that the clock stands still; None where it runs."""
        if self.beats < LEAST_BEATS or self._elapsed_s >= LEAST_BEAT_S * self.beats:
            return None
        return (
            f"the log's clock does not advance: {self.beats} heartbeats of one vehicle, which sends about one a second, "
            f"within {self._elapsed_s:.2f} s"
        )


class SteadyClock:
    """Turns a log's times into times that only go forward.

    Attributes
    ----------
    offset_s : float
        The log's time less the clock's; it changes only where the log's clock was set.
    jumps : int
        How often that was.
    """

    def __init__(self) -> None:
        self.offset_s = 0.0
        self.jumps = 0
        self._now_s: float | None = None

    def over(self, entries: Iterable[LogEntry]) -> Iterator[tuple[LogEntry, float]]:
        """Return each entry with the clock's time; looks one entry ahead."""
        before: LogEntry | None = None
        for entry in entries:
            if before is not None:
                yield before, self.advance(before.time_s, entry.time_s)
            before = entry
        if before is not None:
            yield before, self.advance(before.time_s, None)

    def advance(self, time_s: float, next_s: float | None) -> float:
        """Return the clock's time at a record.

        Parameters
        ----------
        time_s : float
            The record's time.
        next_s : float or None
            The next record's; None at the end.
        """
        now_s = self._now_s
        step_s = 0.0 if now_s is None else time_s - self.offset_s - now_s
        if now_s is None or 0 <= step_s <= NEAR_S:
            self._now_s = time_s - self.offset_s
        elif -NEAR_S <= step_s < 0 or (next_s is not None and abs(next_s - self.offset_s - now_s) <= NEAR_S):
            pass  # late, or a lone record whose time lies off both neighbours': they get the time before
        elif 0 < step_s <= SILENCE_S:
            self._now_s = time_s - self.offset_s
        else:
            self.offset_s = time_s - now_s
            self.jumps += 1
        assert self._now_s is not None
        return self._now_s
