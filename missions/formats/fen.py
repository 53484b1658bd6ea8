"""Fences of MAVProxy and Mission Planner before polygons had kinds (.fen): the return point, then one closed ring.

Newer MAVProxy saves its fences as QGC WPL 110 whatever the suffix; such a file is read as one.
"""

from __future__ import annotations

from missions.errors import MissionFormatError
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.formats import waypoints
from missions.formats.point_lines import format_points, lone_inclusion, read_points
from missions.situation import Known, Situation


def read(text: str, source: str) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    if waypoints.is_waypoint_text(text):
        return waypoints.read(text, source)
    points = read_points(text, source)
    if len(points) < 5:
        raise MissionFormatError(
            f"{source}: {len(points)} points; expected the return point, at least 3 vertices and the first vertex again",
            file=source,
        )
    ring = [point for _, point in points[1:]]
    if ring[0] != ring[-1]:
        raise MissionFormatError(
            f"{source}: line {points[-1][0]}: the polygon is not closed: expected the point of line {points[1][0]} again; "
            "is the file truncated?",
            file=source,
            line=points[-1][0],
        )
    fence = Fence((PolygonZone(ZoneKind.INCLUSION, tuple(ring[:-1])),), points[0][1])
    return Situation(fence=Known(fence, None, source))


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's fence.

    Raises
    ------
    MissionFormatError
        The fence is more than one inclusion polygon, or has no return point.
    """
    assert situation.fence is not None
    fence = situation.fence.value
    ring = lone_inclusion(fence, ".fen").vertices
    if fence.return_point is None:
        raise MissionFormatError("a .fen file needs a return point, but the fence has none")
    return format_points([fence.return_point, *ring, ring[0]])
