"""What is typed, a line at a time, without waiting for it."""

from __future__ import annotations

import contextlib
import os
import queue
import select
import sys
import threading
from collections.abc import Callable

STDIN = 0  # the file descriptor


class Keyboard:
    """The standard input, read as it comes.

    Attributes
    ----------
    is_closed : bool
        Whether nothing more can come.
    """

    def __init__(self) -> None:
        self.is_closed = False
        self._waiting = b""
        self._read = keyboard_thread(STDIN) if os.name == "nt" else _typed_now

    def line(self) -> str | None:
        """Return a line that was typed, without its end; None while none was."""
        if b"\n" not in self._waiting and not self.is_closed:
            typed = self._read()
            self.is_closed = typed == b""
            self._waiting += typed or b""
        line, found, rest = self._waiting.partition(b"\n")
        if not found:
            return None
        self._waiting = rest
        return line.decode(errors="replace").strip()

    def forget(self) -> None:
        """Forget what was typed so far: it was typed for something else."""
        while self.line() is not None:
            pass
        self._waiting = b""


def _typed_now() -> bytes | None:
    """Return what was typed: None while nothing was, empty at the end of the input."""
    try:
        has_input = bool(select.select([sys.stdin], [], [], 0)[0])
        return os.read(sys.stdin.fileno(), 4096) if has_input else None
    except (OSError, ValueError):  # no stdin, or a closed one
        return b""


def keyboard_thread(descriptor: int) -> Callable[[], bytes | None]:
    """Return what returns what was typed, read by a thread: Windows cannot tell whether a console has input.

    The thread reads the descriptor itself: one that waits in ``sys.stdin`` would hold its lock when the program ends.
    """
    typed: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def read() -> None:
        with contextlib.suppress(OSError):
            while data := os.read(descriptor, 4096):
                typed.put(data)
        typed.put(b"")

    threading.Thread(target=read, name="keyboard", daemon=True).start()

    def take() -> bytes | None:
        try:
            return typed.get_nowait()
        except queue.Empty:
            return None

    return take
