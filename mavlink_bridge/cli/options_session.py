"""The session that a command's options ask for."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from mavlink_bridge.cli.drawing import Shown, progress_bar
from mavlink_bridge.cli.session import Contact, Session, open_session

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mavlink_bridge.cli.options.shared import LinkOptions


@contextmanager
def session_for(options: LinkOptions, connection: str) -> Iterator[tuple[Session, Shown]]:
    """Open a link and find the vehicle, with a progress bar; both are closed at the end.

    Raises
    ------
    LinkError
        No link, or no vehicle.
    UsageError
        The signing key cannot be used.
    """
    contact = Contact(
        connection,
        options.identity,
        options.system,
        options.any_vehicle,
        options.timeout,
        options.signing_key,
    )
    with progress_bar(quiet=options.is_silent) as show, open_session(contact, show) as session:
        yield session, show
