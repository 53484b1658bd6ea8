"""What is typed, a line at a time, without waiting for it."""

from __future__ import annotations

import contextlib
import os
import queue
import re
import select
import sys
import threading
from collections.abc import Callable
from typing import Any

try:
    import termios
except ImportError:  # Windows
    termios = None  # type: ignore[assignment]

STDIN = 0  # the file descriptor

_ESCAPES = re.compile(rb"\x1b(\[[0-9;]*[ -/]*[@-~]|O.|.)?")  # arrows and the like
_BACKSPACES, _KILL, _KILL_WORD = b"\x7f\x08", b"\x15", b"\x17"


class Keyboard:
    """The standard input, read as it comes.

    Attributes
    ----------
    is_closed : bool
        Whether nothing more can come.
    is_shown_by_us : bool
        Whether the terminal shows nothing of what is typed: who has taken it does.
    """

    def __init__(self) -> None:
        self.is_closed = False
        self.is_shown_by_us = False
        self._before: Any = None  # what termios holds
        self._waiting = b""
        self._read = keyboard_thread(STDIN) if os.name == "nt" else _typed_now

    def line(self) -> str | None:
        """Return a line that was typed, without its end; None while none was."""
        if b"\n" not in self._waiting and not self.is_closed:
            typed = self._read()
            self.is_closed = typed == b""
            self._waiting = self._with(typed or b"")
        line, found, rest = self._waiting.partition(b"\n")
        if not found:
            return None
        self._waiting = rest
        return line.decode(errors="replace").strip()

    @property
    def typing(self) -> str:
        """What was typed of a line that has not ended yet."""
        return self._waiting.rpartition(b"\n")[2].decode(errors="replace")

    def take(self) -> None:
        """Have the terminal show nothing of what is typed, from now on, where it can: a view that moves would write over it."""
        if termios is None or self.is_shown_by_us or not sys.stdin.isatty():
            return
        with contextlib.suppress(termios.error):
            self._before = termios.tcgetattr(STDIN)
            silent = termios.tcgetattr(STDIN)
            silent[3] &= ~(termios.ECHO | termios.ICANON)  # Ctrl-C stays an interrupt
            termios.tcsetattr(STDIN, termios.TCSADRAIN, silent)
            self.is_shown_by_us = True

    def give_back(self) -> None:
        """Have the terminal as it was."""
        if termios is None or self._before is None or not self.is_shown_by_us:
            return
        self.is_shown_by_us = False
        with contextlib.suppress(termios.error):
            termios.tcsetattr(STDIN, termios.TCSADRAIN, self._before)

    def _with(self, typed: bytes) -> bytes:
        """Return what waits with what was typed; the terminal edits lines itself, unless it was taken."""
        if not self.is_shown_by_us:
            return self._waiting + typed
        waiting = self._waiting
        for key in _ESCAPES.sub(b"", typed):
            done, end, line = waiting.rpartition(b"\n")
            if key in _BACKSPACES:
                line = line.decode(errors="replace")[:-1].encode()
            elif bytes((key,)) == _KILL:
                line = b""
            elif bytes((key,)) == _KILL_WORD:
                line = line.rstrip().rpartition(b" ")[0]
            elif key in b"\n\r":
                line += b"\n"
            elif key >= ord(" "):
                line += bytes((key,))
            waiting = done + end + line
        return waiting

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
