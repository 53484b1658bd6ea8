"""Machines run one after the other, each with what is to be done with its outcome."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from mavlink_bridge.director.states import Signal
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.protocol.machine import Machine

    MachineT = TypeVar("MachineT", bound=Machine)


@dataclass(frozen=True, slots=True)
class Step:
    """A machine that is not started, and what follows from it.

    Parameters
    ----------
    machine : Machine
        What is to be run.
    ended : callable
        Called with the time when the machine is done; returns what the director is to heed, None for nothing.
    dropped : callable, optional
        Called instead where the step is dropped before its machine is done.
    """

    machine: Machine
    ended: Callable[[float], Iterable[Signal] | None]
    dropped: Callable[[], None] | None = None


def step(
    machine: MachineT,
    take: Callable[[MachineT, float], Iterable[Signal] | None],
    dropped: Callable[[], None] | None = None,
) -> Step:
    """Return a step whose machine is handed to ``take`` when it is done."""
    return Step(machine, partial(take, machine), dropped)


class Steps:
    """A queue of machines; the first one runs.

    Parameters
    ----------
    heed : callable, optional
        Takes what the end of a machine signals, at once: before the next machine starts, for it may be dropped.
    """

    def __init__(self, heed: Callable[[Iterable[Signal], float], None] | None = None) -> None:
        self._heed = heed
        self._queue: deque[Step] = deque()
        self._last_words: list[Message] = []

    def __bool__(self) -> bool:
        return bool(self._queue)

    @property
    def current(self) -> Machine | None:
        """The machine that runs, None where there is none."""
        return self._queue[0].machine if self._queue else None

    @property
    def progress(self) -> tuple[int, int]:
        """Progress of the machine that runs."""
        return self._queue[0].machine.progress if self._queue else (0, 0)

    @property
    def deadline_s(self) -> float | None:
        """When the running machine wants its timer."""
        return self._queue[0].machine.deadline_s if self._queue else None

    def runs(self, kind: type[object]) -> bool:
        """Return whether the machine that runs is of a kind."""
        return isinstance(self.current, kind)

    def run(self, steps: Iterable[Step], now_s: float) -> None:
        """Run these after those that wait already."""
        was_idle = not self._queue
        self._queue.extend(steps)
        if was_idle and self._queue:
            self._queue[0].machine.start(now_s)
            self._advance(now_s)

    def clear(self) -> None:
        """Drop them all."""
        dropped = list(self._queue)
        self._queue.clear()
        for one in dropped:
            if one.dropped is not None:
                one.dropped()

    def receive(self, frame: Frame, now_s: float) -> None:
        """Hand a frame to the machine that runs."""
        if self._queue:
            self._queue[0].machine.receive(frame, now_s)
            self._advance(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Hand the time to the machine that runs."""
        if self._queue:
            self._queue[0].machine.handle_timer(now_s)
            self._advance(now_s)

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent."""
        messages, self._last_words = self._last_words, []
        return messages + (self._queue[0].machine.messages_to_send() if self._queue else [])

    def _advance(self, now_s: float) -> None:
        while self._queue and self._queue[0].machine.is_done:
            done = self._queue.popleft()
            self._last_words += done.machine.messages_to_send()
            following = self._queue[0] if self._queue else None
            signals = done.ended(now_s)
            if signals and self._heed is not None:
                self._heed(signals, now_s)
            if following is not None and self._queue and self._queue[0] is following:
                following.machine.start(now_s)
