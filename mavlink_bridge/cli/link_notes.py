"""Notes on a link that is odd, but works."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from mavlink_bridge.cli.failing import telling
from mavlink_bridge.cli.terminal import say

if TYPE_CHECKING:
    from mavlink_bridge.link import Link


class LinkNotes:
    """Reports a link's echoes, once, also where the link is opened again; silent with ``-q``."""

    def __init__(self) -> None:
        self._was_told = telling().quiet > 0

    def tell(self, link: Link) -> None:
        """Report what there is to note about a link and was not reported yet."""
        if link.echoes and not self._was_told:
            self._was_told = True
            say("note: this link echoes our own messages; they are ignored", typer.colors.BRIGHT_BLACK)
