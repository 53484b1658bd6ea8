"""Opening a link beside everything else: to connect or to look a name up may take half a minute, in which time must go on."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.link import Link


class Opening:
    """A link that is being opened, by a thread of its own.

    Parameters
    ----------
    open_it : callable
        Opens it.
    """

    def __init__(self, open_it: Callable[[], Link]) -> None:
        self._open_it = open_it
        self._link: Link | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="opening", daemon=True)
        self._thread.start()
        self._thread.join(_QUICK_S)  # most are open at once

    @property
    def is_over(self) -> bool:
        """Whether it is open, or cannot be opened."""
        return not self._thread.is_alive()

    def link(self) -> Link:
        """Return the link, or raise what came in the way."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._link is not None
        return self._link

    def _run(self) -> None:
        try:
            self._link = self._open_it()
        except BaseException as error:  # noqa: BLE001 - raised again by `link`
            self._error = error


_QUICK_S = 0.1  # most links are open by then; chosen, not measured
