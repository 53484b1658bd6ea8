"""The end that a service manager, a closed terminal or a cluster asks for: as Ctrl-C, so that what is half done is cleared away."""

from __future__ import annotations

import contextlib
import signal
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator


class Terminated(KeyboardInterrupt):
    """SIGTERM, SIGHUP, or Ctrl-Break on Windows: the end without a person at the keyboard."""


def _terminate(_number: int, _frame: object) -> None:
    raise Terminated


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM, a terminal that is closed (SIGHUP), on Windows Ctrl-Break, end what runs in the context as an interrupt does: with a word of what the vehicle does."""
    before: dict[int, Any] = {}
    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # what SIGINT does is put back at the end
    for number in (getattr(signal, name) for name in names if hasattr(signal, name)):
        before[number] = signal.getsignal(number)
        is_ignored = before[number] is signal.SIG_IGN  # by nohup
        if number != signal.SIGINT and not is_ignored:
            with contextlib.suppress(ValueError):  # not the main thread
                signal.signal(number, _terminate)
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)
