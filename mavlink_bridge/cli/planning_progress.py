"""Progress while a plan is made: most plans are there at once, the widest route and a hard refusal take seconds."""

from __future__ import annotations

import time
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from missions.request import Request

_AFTER_S = 0.5  # quicker plans show nothing, and load nothing that draws; chosen, not measured


@contextmanager
def planning_shown(request: Request, *, quiet: bool) -> Iterator[Callable[[], bool]]:
    """Yield what planning asks now and then whether to stop: it never does, and once planning takes long it shows so.

    Raises
    ------
    KeyboardInterrupt
        With its last word, where it was interrupted.
    """
    begun_s = time.monotonic()
    text = "planning the widest route" if request.widest else "planning"
    is_shown = False
    with ExitStack() as stack:

        def look() -> bool:
            nonlocal is_shown
            if not is_shown and time.monotonic() - begun_s > _AFTER_S:
                from mavlink_bridge.cli.drawing import progress_bar  # noqa: PLC0415 - slow to load

                is_shown = True
                stack.enter_context(progress_bar(quiet=quiet))(text, 0, 0)
            return False

        try:
            yield look
        except KeyboardInterrupt as interrupt:
            raise type(interrupt)("interrupted while planning; nothing was written") from None
