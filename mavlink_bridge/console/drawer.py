"""What takes a while to make for showing, made in a thread of its own: the newest wish of each kind counts."""

from __future__ import annotations

from threading import Condition, Thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Drawer:
    """Makes one thing after the other; nobody waits for it.

    Parameters
    ----------
    trouble : callable
        Told of a defect of ours; what it was in is not shown, and all else goes on.
    """

    def __init__(self, trouble: Callable[[Exception], None]) -> None:
        self._trouble = trouble
        self._wanted: dict[str, Callable[[], None]] = {}
        self._condition = Condition()
        self._is_closed = False
        self._thread = Thread(target=self._run, name="console drawer", daemon=True)
        self._thread.start()

    def want(self, name: str, make: Callable[[], None]) -> None:
        """Have something made, in place of what of that name waits yet."""
        with self._condition:
            self._wanted[name] = make
            self._condition.notify()

    def close(self) -> None:
        """Make nothing more."""
        with self._condition:
            self._is_closed = True
            self._condition.notify()

    def _run(self) -> None:
        while True:
            with self._condition:
                while not self._wanted and not self._is_closed:
                    self._condition.wait()
                if self._is_closed:
                    return
                make = self._wanted.pop(next(iter(self._wanted)))
            try:
                make()
            except Exception as error:  # noqa: BLE001 - a picture less, and nothing else
                self._trouble(error)
