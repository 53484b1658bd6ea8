"""Waiting until a fence that was just written counts, and hearing which of its zones do not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Statustext
from mavlink_bridge.protocol.table_machine import Outbox

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer

_TEXTS_LATE_S = 1.0
"""A text may come so long after what it is about; chosen, as for the reasons of a refusal."""


class AwaitEnforced(Outbox):
    """Lets the time pass that the vehicle takes for a fence; asks nothing.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    items : int
        How many items the fence has.

    Attributes
    ----------
    texts : dict of str to str
        What the vehicle said of zones that do not count, by why.
    """

    def __init__(self, peer: Peer, items: int) -> None:
        super().__init__()
        self._peer = peer
        self._takes_s = peer.autopilot.fence.counts_after_s(items)
        self._until_s = 0.0
        self.texts: dict[str, str] = {}
        self.is_done = False

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.is_done else self._until_s

    @property
    def bound_s(self) -> float:
        """How long it takes."""
        return self._takes_s + _TEXTS_LATE_S if self._takes_s else 0.0

    @property
    def progress(self) -> tuple[int, int]:
        """Whether it is done, as steps."""
        return int(self.is_done), 1

    def start(self, now_s: float) -> None:
        """Begin to wait."""
        self._until_s = now_s + self.bound_s

    def receive(self, frame: Frame, now_s: float) -> None:  # noqa: ARG002 - the contract of machines
        """Take a frame."""
        message = frame.message
        if not isinstance(message, Statustext) or not self._peer.accepts(frame):
            return
        reason = self._peer.autopilot.fence.reason_of(message.text)
        if reason is not None:
            self.texts.setdefault(reason, message.text.strip())

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        self.is_done = self.is_done or now_s >= self._until_s
