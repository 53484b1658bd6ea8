"""Where a run of the bridge is recorded: a log and its journal, in files of their own that nothing else has written to."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.errors import LogError
from mavlink_bridge.replay.journal import JournalWriter, journal_path
from mavlink_bridge.tlog import TlogWriter

if TYPE_CHECKING:
    import contextlib
    from collections.abc import Iterator

    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.director import Orders
    from missions.situation import Situation


def open_recording(
    stack: contextlib.ExitStack,
    log: Path,
    orders: Orders,
    described: Situation,
    notes: tuple[DriveNote, ...] = (),
) -> tuple[Path, TlogWriter, JournalWriter]:
    """Return the log that is written, and what writes it and its journal.

    A journal belongs to one run. Where the log is there already, as after a restart, the run goes on in its next part: ``run.tlog``,
    ``run.2.tlog``, ``run.3.tlog`` …, each with a journal beside it. Each part is created by one run alone, also where two begin at once.

    Raises
    ------
    LogError
        The files cannot be written.
    """
    for part in _parts(log):
        try:
            part.open("xb").close()
        except FileExistsError:
            continue
        except OSError as error:
            raise LogError(f"{part}: {error.strerror}", path=str(part)) from error
        try:
            journal = stack.enter_context(journal_path(part).open("x", encoding="utf-8"))
        except FileExistsError:  # of a log that was moved away: it is not ours to write over
            part.unlink()
            continue
        except OSError as error:
            part.unlink()
            raise LogError(f"{journal_path(part)}: {error.strerror}", path=str(part)) from error
        recorder = stack.enter_context(TlogWriter(part))
        return part, recorder, JournalWriter(journal, orders, described, notes)
    raise AssertionError  # pragma: no cover - there is always another number


def _parts(log: Path) -> Iterator[Path]:
    yield log
    for number in itertools.count(2):
        yield log.with_name(f"{log.stem}.{number}{log.suffix or '.tlog'}")
