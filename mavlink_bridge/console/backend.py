"""What may stand behind the page: a live bridge, a log, or files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from mavlink_bridge.console.deeds import NOT_HERE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.console.deeds import Deed
    from mavlink_bridge.console.view.sections import AfterView
    from mavlink_bridge.console.wire import BackupView
    from missions.request import Request
    from missions.situation import Situation


class PageBackend(Protocol):
    """What the page speaks to; called by the server's loop, and answers at once."""

    def situation(self) -> Situation:
        """Return what is known now, for plans and checks."""
        ...

    def request(self) -> Request:
        """Return what is asked of plans where a page says nothing else."""
        ...

    async def do(self, deed: Deed, page: str) -> str:
        """Have a permitted deed done for a page (its public name); return what was done, for people.

        Raises
        ------
        Refusal
            It is not done, and why.
        """
        ...

    def backups(self) -> Sequence[BackupView]:
        """Return the backups that may be put back."""
        ...

    def after(self) -> AfterView | None:
        """Return what the newest drive was, against what was promised; asked beside the loop, for it takes a while."""
        ...

    def at(self, time_s: float) -> dict[str, Any] | None:
        """Return the sections of a replay at a time; None where there is no replay."""
        ...


class FilesBackend:
    """Files alone: the page can plan and check.

    Parameters
    ----------
    situation : Situation
        What the files hold.
    request : Request
        What is asked of plans.
    """

    def __init__(self, situation: Situation, request: Request) -> None:
        self._situation = situation
        self._request = request

    def situation(self) -> Situation:
        """Return what the files hold."""
        return self._situation

    def request(self) -> Request:
        """Return what the command line asks of plans."""
        return self._request

    async def do(self, deed: Deed, page: str) -> str:  # noqa: ARG002 - as the others
        """Refuse: there is no vehicle.

        Raises
        ------
        Refusal
            Always.
        """
        raise NOT_HERE

    def backups(self) -> Sequence[BackupView]:
        """Return none."""
        return ()

    def after(self) -> AfterView | None:
        """Return None: nothing drives."""
        return None

    def at(self, time_s: float) -> dict[str, Any] | None:  # noqa: ARG002 - as the others
        """Return None: there is no replay."""
        return None
