"""What the server's loop holds: the board that pages are shown, who holds control, and what is behind it all."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING, Any

from mavlink_bridge.console.board import MOST_EVENTS, Board
from mavlink_bridge.console.control import ControlDesk
from mavlink_bridge.console.deeds import GiveControl, Refusal, TakeControl, check_permitted
from mavlink_bridge.console.jobs import Jobs
from mavlink_bridge.console.view.sections import EventView
from mavlink_bridge.console.wire import Problem

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from mavlink_bridge.console.access import Access
    from mavlink_bridge.console.answers import Looked
    from mavlink_bridge.console.backend import PageBackend
    from mavlink_bridge.console.deeds import Deed
    from mavlink_bridge.console.view.sections import Permissions, Sections, TrackRow

_KEPT_PLANS = 50  # that were looked at, by their ids; chosen: bounds the memory


class Hub:
    """Everything that the requests of pages share; touched by the server's loop alone, but for `post`.

    Parameters
    ----------
    sections : Sections
        What is shown at first.
    backend : PageBackend
        What is behind it.
    access : Access
        Who may speak to it.
    clock : callable
        Returns the time, seconds since 1970.
    """

    def __init__(
        self, sections: Sections, backend: PageBackend, access: Access, clock: Callable[[], float]
    ) -> None:
        self.board = Board(sections, None if sections.replay is not None else MOST_EVENTS)
        self.backend = backend
        self.access = access
        self.control = ControlDesk()
        self.jobs = Jobs()
        self.clock = clock
        self.looked: OrderedDict[str, Looked] = OrderedDict()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._news = asyncio.Event()
        self._lock = Lock()
        self._posted: dict[str, Any] = {}
        self._posted_events: list[EventView] = []
        self._posted_rows: list[TrackRow] = []
        self._rows_anew: Sequence[TrackRow] | None = None
        self._is_due = False

    @property
    def can(self) -> Permissions:
        """What pages may do."""
        can: Permissions = self.board.sections["server"].can
        return can

    @property
    def is_live(self) -> bool:
        """Whether there is a vehicle behind it."""
        return self.board.sections["server"].source in ("live", "demo")

    # From the bridge's thread

    def post(
        self,
        sections: dict[str, Any],
        events: Iterable[EventView] = (),
        rows: Iterable[TrackRow] = (),
        rows_anew: Sequence[TrackRow] | None = None,
    ) -> None:
        """Take what is newer, from any thread, and return at once: where the server is busy the newest is kept for it."""
        with self._lock:
            self._posted.update(sections)
            self._posted_events += events
            if rows_anew is not None:
                self._rows_anew, self._posted_rows = rows_anew, []
            else:
                self._posted_rows += rows
            is_due, self._is_due = self._is_due, True
            loop = self._loop
        if not is_due and loop is not None:
            try:
                loop.call_soon_threadsafe(self._take_posted)
            except RuntimeError:  # the server has ended
                return

    def _take_posted(self) -> None:
        with self._lock:
            sections, self._posted = self._posted, {}
            events, self._posted_events = self._posted_events, []
            rows, self._posted_rows = self._posted_rows, []
            anew, self._rows_anew = self._rows_anew, None
            self._is_due = False
        self.board.publish(sections)
        self.board.add_events(events)
        if anew is not None:
            self.board.replace_rows(anew)
        self.board.add_rows(rows)
        self.wake()

    # In the server's loop

    def begin(self) -> None:
        """Belong to the loop that runs now."""
        with self._lock:
            self._loop = asyncio.get_running_loop()
        self._take_posted()

    def wake(self) -> None:
        """Let every connection look for what is new."""
        self._news.set()
        self._news = asyncio.Event()

    @property
    def news(self) -> asyncio.Event:
        """Set at the next news."""
        return self._news

    def show_control(self) -> None:
        """Show all pages who holds control."""
        if self.board.publish({"control": self.control.view(self.clock())}):
            self.wake()

    def tell(self, text: str, severity: str = "info") -> None:
        """Note for all pages what one of them has done."""
        self.board.add_events(
            [EventView(id=0, time_s=self.clock(), name="console", severity=severity, text=text)]
        )
        self.wake()

    async def take_control(self, page_id: str) -> str:
        """Let a page have control, tell all, and do nothing any more of what the page before it waits for; return what that page must know."""
        before, now_s = self.control.holder(self.clock()), self.clock()
        self.control.take(page_id, now_s)
        name = self.control.name_of(page_id)
        if name != before:
            self.tell(f"{name} took control" + (f" from {before}" if before else ""), "notice")
        self.show_control()
        return await self._end_wishes(TakeControl(), name)

    async def give_control(self, page_id: str) -> str:
        """Take control back from a page, and do nothing any more of what it waits for; return what that page must know."""
        if not self.control.give(page_id):
            return ""
        self.show_control()
        return await self._end_wishes(GiveControl(), self.control.name_of(page_id))

    async def _end_wishes(self, deed: Deed, page: str) -> str:
        """Have the bridge end what waits, now that control is with somebody else; control itself is the server's, and has changed whatever the bridge answers."""
        if not self.is_live:
            return ""
        try:
            return await self.backend.do(deed, page)
        except Refusal as refusal:
            text = f"control has changed, but what was waited for before may still be done: {refusal.problem.message}"
            self.tell(text, "warning")
            return text

    def keep(self, looked: Looked) -> None:
        """Remember a plan that was looked at, so that it can be asked for by its id."""
        self.looked[looked.view.id] = looked
        self.looked.move_to_end(looked.view.id)
        while len(self.looked) > _KEPT_PLANS:
            self.looked.popitem(last=False)

    async def do(self, deed: Deed, page_id: str) -> str:
        """Have a deed done for a page, where it is permitted and the page holds control.

        Raises
        ------
        Refusal
            It is not done, and why.
        """
        check_permitted(deed, self.can)
        if deed.needs_control and not self.control.may_write(page_id, self.clock()):
            holder = self.control.holder(self.clock())
            raise Refusal(
                Problem(
                    kind="no_control",
                    message=f"{holder} holds control: nothing was sent",
                    advice="take control first",
                    details={"holder": holder},
                )
            )
        self.show_control()
        return await self.backend.do(deed, self.control.name_of(page_id))
