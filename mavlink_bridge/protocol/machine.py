"""The contract of every protocol machine: no sockets, no clocks, time comes in as an argument."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message


class Machine(Protocol):
    """What a shell (live link, replay, test) needs to run a machine.

    The shell calls `start` once, then `receive` for each frame and `handle_timer` when `deadline_s` is reached, and after each call
    sends what `messages_to_send` gives. ``now_s`` is any clock that only goes forward. Every machine that comes to an end (all but the
    director and what waits only for its signs) also has `bound_s`: the longest time from `start` to the end, whatever link and vehicle do.
    """

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called; None for never."""
        ...

    @property
    def is_done(self) -> bool:
        """Whether the machine has come to its outcome and wants no more calls."""
        ...

    @property
    def progress(self) -> tuple[int, int]:
        """Steps done and steps in all, for a progress bar; (0, 0) while the number is not known."""
        ...

    def start(self, now_s: float) -> None:
        """Begin."""
        ...

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        ...

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now; harmless when called early or twice."""
        ...

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent now, in order, and forget it."""
        ...
