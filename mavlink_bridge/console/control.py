"""Which page holds control: one at a time; taking it over is one deliberate step that all pages see. Clock-free."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_bridge.console.view.sections import ControlView

AWAY_S = 10.0
"""A page that holds control and is gone for so long has left it: longer than a reload takes; chosen, not measured."""


@dataclass(slots=True)
class _Page:
    """A page that was seen: its public name, how many connections it has, and when it was seen last without one."""

    name: str
    connections: int = 0
    left_s: float = 0.0


class ControlDesk:
    """Knows the pages by their secret ids, and which of them holds control."""

    def __init__(self) -> None:
        self._pages: dict[str, _Page] = {}
        self._holder: str | None = None
        self._since_s: float | None = None
        self._named = 0

    def name_of(self, page_id: str) -> str:
        """Return the public name of a page; a new one gets the next number."""
        if page_id not in self._pages:
            self._named += 1
            self._pages[page_id] = _Page(f"page {self._named}")
        return self._pages[page_id].name

    def connect(self, page_id: str) -> str:
        """Take notice that a page is connected; return its public name."""
        name = self.name_of(page_id)
        self._pages[page_id].connections += 1
        return name

    def disconnect(self, page_id: str, now_s: float) -> None:
        """Take notice that a connection of a page has ended; it keeps control for a while."""
        page = self._pages[page_id]
        page.connections -= 1
        page.left_s = now_s
        self._forget_gone(now_s)

    def take(self, page_id: str, now_s: float) -> None:
        """Let a page have control, whoever held it."""
        self._note_seen(page_id, now_s)
        if self._holder != page_id:
            self._holder, self._since_s = page_id, now_s

    def give(self, page_id: str) -> bool:
        """Leave control, where the page holds it; return whether it did."""
        if self._holder != page_id:
            return False
        self._holder = self._since_s = None
        return True

    def may_write(self, page_id: str, now_s: float) -> bool:
        """Return whether a page may change things now; where nobody holds control it gets it by asking."""
        self._note_seen(page_id, now_s)
        if self.holder(now_s) is None:
            self.take(page_id, now_s)
        return self._holder == page_id

    def note_seen(self, page_id: str, now_s: float) -> None:
        """Take notice that a page asks for something, whatever it is: one that is known is there, also where it is not connected just now."""
        if page_id in self._pages:
            self._pages[page_id].left_s = now_s

    def _note_seen(self, page_id: str, now_s: float) -> None:
        """Take notice that a page wants to change something, known or not."""
        self._forget_gone(now_s)
        self.name_of(page_id)
        self.note_seen(page_id, now_s)

    def holder(self, now_s: float) -> str | None:
        """Return the public name of the page that holds control; None where it is free."""
        if self._holder is None:
            return None
        page = self._pages[self._holder]
        if not page.connections and now_s - page.left_s > AWAY_S:
            self._holder = self._since_s = None
            return None
        return page.name

    def view(self, now_s: float) -> ControlView:
        """Return what all pages see of it."""
        holder = self.holder(now_s)
        is_away = self._holder is not None and not self._pages[self._holder].connections
        connected = tuple(page.name for page in self._pages.values() if page.connections)
        return ControlView(holder=holder, since_s=self._since_s, is_away=is_away, pages=connected)

    def _forget_gone(self, now_s: float) -> None:
        """Forget pages that left long ago; a page that comes back later gets another name."""
        self.holder(now_s)
        gone = [
            key
            for key, page in self._pages.items()
            if not page.connections and key != self._holder and now_s - page.left_s > AWAY_S
        ]
        for key in gone:
            del self._pages[key]
