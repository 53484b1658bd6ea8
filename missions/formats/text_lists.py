"""Lists as text (.waypoints, .txt): QGC WPL, MAVProxy's rally points, or a fence of points; the first line tells which."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats import fen, rally_lines, waypoints
from missions.formats.point_lines import is_point_text

if TYPE_CHECKING:
    from missions.situation import Situation


def read(text: str, source: str) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    if rally_lines.is_rally_text(text):
        return rally_lines.read(text, source)
    if is_point_text(text):
        return fen.read(text, source)
    if not waypoints.is_waypoint_text(text):
        raise MissionFormatError(
            f"{source}: line 1: expected 'QGC WPL 110', a fence of 'latitude longitude' lines, or 'RALLY' lines",
            file=source,
            line=1,
        )
    return waypoints.read(text, source)
