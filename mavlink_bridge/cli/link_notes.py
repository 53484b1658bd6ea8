"""Notes on a link that is odd, but works."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import inform

if TYPE_CHECKING:
    from mavlink_bridge.link import Link


def tell_echoes(link: Link) -> None:
    """Report a link's echoes, once in a command, also where the link is opened again."""
    if link.echoes:
        inform(["this link echoes our own messages; they are ignored"])
