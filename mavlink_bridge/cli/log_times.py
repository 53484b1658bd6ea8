"""A log's times for people: seconds since it begins, and when that was."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.tlog import TlogReader

if TYPE_CHECKING:
    from pathlib import Path

_EPOCH = dt.datetime(1970, 1, 1, tzinfo=dt.UTC)


@dataclass(frozen=True, slots=True)
class LogBegin:
    """When a log begins.

    Parameters
    ----------
    time_s : float
        The first frame's time, in seconds since 1970; in a raw log since the vehicle booted.
    is_dated : bool
        Whether the log has times of its own; a raw one has not.
    """

    time_s: float
    is_dated: bool

    def __str__(self) -> str:
        return f"from {date_text(self.time_s)}" if self.is_dated else "raw (no timestamps)"


def log_begin(log: Path) -> LogBegin:
    """Look when a log begins, without reading on.

    Raises
    ------
    LogError
        The file is missing, unreadable, empty or no log.
    """
    reader = TlogReader(log, ())
    block, _ = next(reader.blocks())
    return LogBegin(float(block.time_us[0]) / 1e6, reader.has_timestamps)


def date_text(time_s: float) -> str:
    """Return a time as a date in UTC.

    Parameters
    ----------
    time_s : float
        Seconds since 1970.
    """
    try:
        return f"{_EPOCH + dt.timedelta(seconds=time_s):%Y-%m-%d %H:%M:%S} UTC"
    except OverflowError:
        return f"{time_s:.4g} s after 1970 (the clock was not set)"
