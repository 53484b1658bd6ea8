"""A log's page in one file: the director's run over it, as ``pbpp serve --log`` replays it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.console.recording import RecordedSections, Recording
from mavlink_bridge.console.stills import log_still
from mavlink_bridge.director import Orders, TargetSource
from missions.request import Tour

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from mavlink_bridge.console.one_file import StillPage
    from missions.geo import LatLon


def log_page(
    log: Path,
    system: int | None,
    title: Sequence[str],
    notes: Sequence[str] = (),
    breaches: Iterable[tuple[str, LatLon]] = (),
    targets: Iterable[LatLon] = (),
) -> StillPage:
    """Return what a log's page shows.

    Parameters
    ----------
    log : pathlib.Path
        A telemetry log.
    system : int or None
        Its vehicle; None is the first one.
    title : sequence of str
        The lines above the page.
    notes : sequence of str
        What was found in it.
    breaches, targets
        Where the vehicle left the fence, and where it was sent to.

    Raises
    ------
    LogError
        The log cannot be replayed, or holds nothing of the vehicle.
    """
    sources = frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY}
    recording = Recording(
        log, Orders(system=system, any_vehicle=True, request=Tour(), target_sources=sources)
    )
    return log_still(title, recording, RecordedSections(recording), notes, breaches, targets)
