"""Where a route around obstacles leaves a leg's own line, and where it comes back to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely
from shapely import LineString, Point
from shapely.ops import substring

from missions.geo import LocalPoint
from missions.ground.legs import drawn_leg

if TYPE_CHECKING:
    from missions.checking.execution import CourseLeg
    from missions.geo import LatLon
    from missions.ground.ground import Ground

_CHORDS = 32  # in a quarter circle: they cut off less than a thousandth of the radius
_CHORD_SHARE, _SPARE_M = 1.001, 0.02
_LEVEL_M = 1e-3  # differences of rounding


def places_on_line(ground: Ground, leg: CourseLeg, clearance_m: float, run_in_m: float) -> list[LatLon]:
    """Return where a route leaves the leg's line and returns to it, in order; none where it leaves the line from end to end.

    Parameters
    ----------
    ground : Ground
        The field.
    leg : CourseLeg
        Its line is the autopilot's.
    clearance_m : float
        What is nearer than this to forbidden ground is driven around.
    run_in_m : float
        How far before and after that the line is left; what is kept between is at least as long.
    """
    line = drawn_leg(ground, leg.start, leg.end)
    if not isinstance(line, LineString):
        return []
    wide_m = clearance_m * _CHORD_SHARE + _SPARE_M
    edge = ground.edge.intersection(line.buffer(2 * wide_m))
    free = line.intersection(ground.allowed).difference(edge.buffer(wide_m, quad_segs=_CHORDS))
    stretches_m = sorted(
        (line.project(Point(part.coords[0])), line.project(Point(part.coords[-1])))
        for part in shapely.get_parts(free)
        if isinstance(part, LineString) and not part.is_empty
    )
    along_m: list[float] = []
    for number, (begin_m, end_m) in enumerate(stretches_m):
        is_first = number == 0 and _leads_away(ground, substring(line, begin_m, 0.0))
        is_last = end_m == stretches_m[-1][1] and _leads_away(ground, substring(line, end_m, line.length))
        kept_m = begin_m + run_in_m * (not is_first), end_m - run_in_m * (not is_last)
        if kept_m[1] - kept_m[0] >= run_in_m:
            along_m += kept_m[is_first : 2 - is_last]
    places = (line.interpolate(at_m) for at_m in along_m)
    return [ground.frame.to_lat_lon(LocalPoint(place.x, place.y)) for place in places]


def _leads_away(ground: Ground, stretch: LineString | Point) -> bool:
    """Return whether nothing on a stretch is nearer to forbidden ground than its end, an end of the leg: there is nothing to go around."""
    end = shapely.get_point(stretch, -1) if isinstance(stretch, LineString) else stretch
    return ground.clearance_m(stretch) > ground.clearance_m(end) - _LEVEL_M
