"""Polygons of Mission Planner (.poly): one ring, closed or not; read as an inclusion."""

from __future__ import annotations

from missions.errors import MissionFormatError
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.formats.point_lines import format_points, lone_inclusion, read_points
from missions.situation import Known, Situation


def read(text: str, source: str) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    ring = [point for _, point in read_points(text, source)]
    if len(ring) > 1 and ring[0] == ring[-1]:
        del ring[-1]
    if len(ring) < 3:
        raise MissionFormatError(
            f"{source}: {len(ring)} vertices; a polygon needs at least 3", file=source, vertices=len(ring)
        )
    return Situation(fence=Known(Fence((PolygonZone(ZoneKind.INCLUSION, tuple(ring)),)), None, source))


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's fence; the return point is left out.

    Raises
    ------
    MissionFormatError
        The fence is more than one inclusion polygon.
    """
    assert situation.fence is not None
    ring = lone_inclusion(situation.fence.value, ".poly").vertices
    return format_points([*ring, ring[0]])
