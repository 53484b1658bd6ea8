"""Machines run one after the other, each with what is to be done with its outcome."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from mavlink_bridge.mavlink.messages import Frame, Message

Step = tuple[Any, "Callable[[Any, float], None]"]
"""A machine that is not started, and what takes it when it is done."""


class Steps:
    """A queue of machines; the first one runs."""

    def __init__(self) -> None:
        self._queue: deque[Step] = deque()
        self._last_words: list[Message] = []

    def __bool__(self) -> bool:
        return bool(self._queue)

    @property
    def current(self) -> Any:  # noqa: ANN401 - any machine
        """The machine that runs, None where there is none."""
        return self._queue[0][0] if self._queue else None

    @property
    def deadline_s(self) -> float | None:
        """When the running machine wants its timer."""
        return self._queue[0][0].deadline_s if self._queue else None

    def run(self, steps: Iterable[Step], now_s: float) -> None:
        """Run these after those that wait already."""
        was_idle = not self._queue
        self._queue.extend(steps)
        if was_idle and self._queue:
            self._queue[0][0].start(now_s)
            self._advance(now_s)

    def clear(self) -> None:
        """Forget them all."""
        self._queue.clear()

    def receive(self, frame: Frame, now_s: float) -> None:
        """Give a frame to the machine that runs."""
        if self._queue:
            self._queue[0][0].receive(frame, now_s)
            self._advance(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Give the time to the machine that runs."""
        if self._queue:
            self._queue[0][0].handle_timer(now_s)
            self._advance(now_s)

    def messages_to_send(self) -> list[Message]:
        """Give and forget what is to be sent."""
        messages, self._last_words = self._last_words, []
        return messages + (self._queue[0][0].messages_to_send() if self._queue else [])

    def _advance(self, now_s: float) -> None:
        while self._queue and self._queue[0][0].is_done:
            machine, take = self._queue.popleft()
            self._last_words += machine.messages_to_send()
            following = self._queue[0] if self._queue else None
            take(machine, now_s)
            if following is not None and self._queue and self._queue[0] is following:
                following[0].start(now_s)
