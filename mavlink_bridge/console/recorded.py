"""A log behind the page: what the page speaks to in a replay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mavlink_bridge.console.deeds import Refusal
from mavlink_bridge.console.recording import RecordedSections
from mavlink_bridge.console.wire import Problem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.console.deeds import Deed
    from mavlink_bridge.console.recording import Recording
    from mavlink_bridge.console.view.sections import AfterView
    from mavlink_bridge.console.wire import BackupView
    from missions.request import Request
    from missions.situation import Situation


class RecordedBackend:
    """What the page speaks to in a replay; plans and checks are of the log's end.

    Parameters
    ----------
    recording : Recording
        The log.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._sections = RecordedSections(recording)

    def situation(self) -> Situation:
        """Return what is known at the log's end."""
        return self._recording.moments[-1].situation

    def request(self) -> Request:
        """Return what is asked of plans."""
        return self._recording.moments[-1].request

    async def do(self, deed: Deed, page: str) -> str:  # noqa: ARG002 - as the others
        """Refuse: what was is over.

        Raises
        ------
        Refusal
            Always.
        """
        raise Refusal(Problem(kind="not_here", message="this is a replay: nothing can be sent"))

    def backups(self) -> Sequence[BackupView]:
        """Return none."""
        return ()

    def after(self) -> AfterView | None:
        """Return None: the drive is seen in the replay."""
        return None

    def at(self, time_s: float) -> dict[str, Any]:
        """Return the sections at a time."""
        return self._sections.at(time_s)
