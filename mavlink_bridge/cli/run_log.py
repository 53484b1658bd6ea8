"""What the bridge writes beside what it does: where it cannot be written, one note says so, and the drive goes on."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.failing import drop_stdout, is_reader_gone
from mavlink_bridge.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.director import Event
    from mavlink_bridge.replay.journal import Call, JournalWriter
    from mavlink_bridge.tlog import TlogWriter


class RunLog:
    """Writes both as long as both can be written: one without the other would not replay.

    Parameters
    ----------
    recorder : TlogWriter
        Takes what goes over the link.
    journal : JournalWriter
        Takes what else happens.
    tell : callable
        Told, once, why no more is written.
    """

    def __init__(
        self,
        recorder: TlogWriter,
        journal: JournalWriter,
        tell: Callable[[str], None] = lambda text: warn([text]),
    ) -> None:
        self._recorder = recorder
        self._journal = journal
        self._tell = tell
        self._is_written = True

    def write(self, time_s: float, data: bytes, link: int = 0) -> None:
        """Write what was received or sent, as `TlogWriter` does."""
        self._do(lambda: self._recorder.write(time_s, data, link))

    def call(self, call: Call) -> None:
        """Write a call of the director."""
        self._do(lambda: self._journal.call(call))

    def event(self, event: Event) -> None:
        """Write an event."""
        self._do(lambda: self._journal.event(event))

    def _do(self, write: Callable[[], None]) -> None:
        if not self._is_written:
            return
        try:
            write()
        except LogError as error:
            self._is_written = False
            for writer in (self._recorder, self._journal):
                with contextlib.suppress(OSError):  # what still waits to be written cannot be either
                    writer.close()
            self._tell(f"{error}; recording stopped; the bridge continues")


class SafeTeller:
    """Prints events on the standard output as long as they can be written there.

    Parameters
    ----------
    tell : callable
        Prints one.
    may_end : callable
        Whether the bridge may end where nobody reads any more (``pbpp bridge --json | head``): nothing is under way on the vehicle.
    """

    def __init__(self, tell: Callable[[Event], None], may_end: Callable[[], bool]) -> None:
        self._tell = tell
        self._may_end = may_end

    def __call__(self, event: Event) -> None:
        """Print an event.

        Raises
        ------
        OSError
            Nobody reads any more, and the bridge may end.
        """
        try:
            self._tell(event)
        except OSError as error:
            if is_reader_gone(error) and self._may_end():
                raise
            drop_stdout()
            with contextlib.suppress(OSError):
                warn([f"events can no longer be written ({error.strerror}); the bridge continues"])
