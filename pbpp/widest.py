"""The widest way: the greatest clearance at which start and goal are still connected, and what limits it.

The clearance is found by bisection over the connected components of free space. A mitred offset keeps more than the clearance at
corners, so where it says "not connected" the round one is asked: the answer is right to the tolerance, not only on the safe side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry import Point as ShapelyPoint

from .any_angle import shortest_path
from .errors import GoalBlockedError, NoPathError, StartBlockedError
from .field import BOUNDARY_TOLERANCE_M, Field
from .free_space import Scene, parse_scene
from .geometry import Floats, Point, Ring, parse_point

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from shapely.geometry.base import BaseGeometry

_SAME_PLACE_M = 1e-6  # rounding: places this near are one
_REACH = 4.0  # clearances within which fences may form the gap; chosen, not measured
# Places along the piece that are looked at, again about the best of them: three rounds end at an 8192nd of it. Chosen, not measured.
_SAMPLES = 33
_ZOOMS = 3


@dataclass(frozen=True, eq=False)
class WidestWay:
    """The greatest clearance between start and goal, and its narrowest place.

    Parameters
    ----------
    clearance_m : float
        The greatest clearance in metres at which start and goal are connected, less than the tolerance below the truth.
    limited_by : {"gap", "start", "goal"}
        What does not let it be greater: a gap between two parts of the fence, or how near to the fence an end lies.
    gap_m : float
        Width in metres of the narrowest gap; for an end its distance to the fence.
    points : (2, 2) array
        East and north in metres of the two points on the fence that face each other; for an end, the end and the nearest fence point.
    parts : tuple of (str, int)
        The fence parts that these points lie on, ``("inclusion" or "exclusion", index)``: two for a gap, maybe the same one, else one.
    """

    clearance_m: float
    limited_by: str
    gap_m: float
    points: Floats
    parts: tuple[tuple[str, int], ...]


def widest(
    inclusions: Sequence[Ring],
    exclusions: Sequence[Ring],
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    *,
    union: bool = False,
    tolerance_m: float = 0.01,
    should_stop: Callable[[], bool] | None = None,
) -> WidestWay:
    """Return the greatest clearance at which start and goal are still connected.

    Parameters
    ----------
    inclusions, exclusions : sequence of (n, 2) array-like or shapely polygon
        East and north in metres. No inclusion at all means the open plane.
    start, goal : pair of float
        (east, north) in metres.
    union : bool, default False
        True: the path may lie in any inclusion. False: it lies in all of them.
    tolerance_m : float, default 0.01
        How exact the clearance must be, in metres.
    should_stop : callable, optional
        Asked before each step of the bisection; when it returns True, the clearance is what has been proven so far.

    Returns
    -------
    WidestWay
        The clearance with its narrowest place.

    Raises
    ------
    InvalidGeometryError
        If a ring or a point cannot be used.
    StartBlockedError, GoalBlockedError
        If an end lies outside the fence's free space even at no clearance.
    NoPathError
        If start and goal are not connected even at no clearance.
    """
    scene = parse_scene(inclusions, exclusions, union=union)
    ends = parse_point(start, "start"), parse_point(goal, "goal")
    return widest_in(scene, ends, tolerance_m, should_stop)


def widest_in(
    scene: Scene, ends: tuple[Point, Point], tolerance_m: float, should_stop: Callable[[], bool] | None = None
) -> WidestWay:
    """Return the greatest clearance in a scene that is already parsed; see `widest`."""
    local = [scene.to_local(end) for end in ends]
    reach = () if len(scene.inclusions) else tuple(local)
    joined = Field(scene, 0.0, reach=reach)
    start_parts = joined.require(ends[0], StartBlockedError)
    if not start_parts & joined.require(ends[1], GoalBlockedError):
        raise NoPathError(0.0)
    if not len(scene.fence_lines):
        return WidestWay(np.inf, "start", np.inf, np.array(ends), ())
    room_m = [float(shapely.distance(scene.fence_lines, ShapelyPoint(end)).min()) for end in local]
    low_m, high_m = 0.0, max(min(room_m) - 0.25 * tolerance_m, 0.0)
    if _connected(scene, local, reach, high_m) is not None:
        return _limited_by_end(scene, local, room_m, high_m)
    while high_m - low_m > 0.5 * tolerance_m and not (should_stop is not None and should_stop()):
        middle_m = 0.5 * (low_m + high_m)
        field = _connected(scene, local, reach, middle_m)
        if field is None:
            high_m = middle_m
        else:
            low_m, joined = middle_m, field
    parted = Field(scene, high_m, rounded=True, reach=reach)
    if not all(parted.free.components_at(end, BOUNDARY_TOLERANCE_M) for end in local):
        return _limited_by_end(scene, local, room_m, low_m)
    return _limited_by_gap(scene, local, joined, parted)


def _connected(
    scene: Scene, ends: Sequence[Point], reach: Sequence[Point], clearance_m: float
) -> Field | None:
    """Return the field in which two ends are connected at a clearance, None if there is none."""
    for rounded in (False, True) if clearance_m > 0.0 else (False,):
        field = Field(scene, clearance_m, rounded=rounded, reach=reach)
        start_parts, goal_parts = (field.free.components_at(end, BOUNDARY_TOLERANCE_M) for end in ends)
        if start_parts & goal_parts:
            return field
    return None


def _limited_by_end(
    scene: Scene, ends: Sequence[Point], room_m: list[float], clearance_m: float
) -> WidestWay:
    which = int(room_m[1] < room_m[0])
    lines = scene.fence_lines
    index = int(np.argmin(shapely.distance(lines, ShapelyPoint(ends[which]))))
    facing = _nearest(lines[index], ends[which])
    points = np.array([scene.from_local(ends[which]), scene.from_local(facing)])
    return WidestWay(clearance_m, ("start", "goal")[which], room_m[which], points, (scene.part(index),))


def _limited_by_gap(scene: Scene, ends: Sequence[Point], joined: Field, parted: Field) -> WidestWay:
    """Find the gap that is open in one field and closed in the other."""
    start_parts, goal_parts = (joined.free.components_at(end, BOUNDARY_TOLERANCE_M) for end in ends)
    start, goal = (joined.onto(end, start_parts & goal_parts) for end in ends)
    turns = shortest_path(joined.slabs, start, goal).vertices or ()
    path = LineString([ends[0], *joined.slabs.vertices.points[list(turns)], ends[1]])
    piece = _closed_piece(path, parted)
    near = np.flatnonzero(shapely.dwithin(scene.fence_lines, piece, _REACH * parted.free.clearance_m))
    facing = _facing_points(scene.fence_lines[near], piece)
    gap_m = float(np.hypot(*(facing.first - facing.second)))
    points = np.array([scene.from_local(tuple(facing.first)), scene.from_local(tuple(facing.second))])
    parts = tuple(scene.part(int(near[index])) for index in facing.lines)
    return WidestWay(joined.free.clearance_m, "gap", gap_m, points, parts)


def _closed_piece(path: LineString, parted: Field) -> LineString:
    """Return the piece of a path that leads from one component to another where they have come apart."""
    outside = shapely.difference(path, shapely.buffer(parted.free.geometry, _SAME_PLACE_M))
    pieces = sorted(shapely.get_parts(outside), key=shapely.length, reverse=True)

    def leads_across(piece: LineString) -> bool:
        first, last = (
            parted.free.components_at((east, north), 10.0 * _SAME_PLACE_M)
            for east, north in shapely.get_coordinates(piece)[[0, -1]].tolist()
        )
        return not first & last

    return next(filter(leads_across, pieces), path)


@dataclass(frozen=True)
class _Facing:
    """Two fence points that face each other across a place."""

    first: Floats
    second: Floats
    lines: tuple[int, int]


def _facing_points(lines: npt.NDArray[np.object_], piece: LineString) -> _Facing:
    """Return the fence points on both sides of a piece of path where it is tightest.

    All along the piece no fence point is nearer than the clearance, so the two distances add up to the least in the gap itself.
    """
    low, high = 0.0, 1.0
    best: tuple[float, float, _Facing] | None = None
    for _ in range(_ZOOMS):
        for share in np.linspace(low, high, _SAMPLES).tolist():
            found = _look_both_ways(
                lines, shapely.get_coordinates(piece.interpolate(share, normalized=True))[0]
            )
            if found is not None and (best is None or found[0] < best[0]):
                best = (found[0], share, found[1])
        step, middle = (high - low) / (_SAMPLES - 1), best[1] if best is not None else 0.5
        low, high = max(middle - step, 0.0), min(middle + step, 1.0)
    assert best is not None, "a closed gap has two sides"
    return best[2]


def _look_both_ways(lines: npt.NDArray[np.object_], place: Floats) -> tuple[float, _Facing] | None:
    """Return the sum of the distances to the nearest fence point and to the nearest on the other side, with both points."""
    point = ShapelyPoint(place)
    distances = shapely.distance(lines, point)
    index = int(np.argmin(distances))
    first = np.array(_nearest(lines[index], (float(place[0]), float(place[1]))))
    size_m = float(distances[index])
    if size_m == 0.0:
        return None
    ahead = (place - first) / size_m
    aside = np.array([-ahead[1], ahead[0]])
    bounds = shapely.total_bounds(lines)
    reach_m = float(np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1])) + size_m
    # What faces the first point lies within 60 degrees of straight ahead.
    wedge = Polygon(
        [place, place + reach_m * (ahead + 1.75 * aside), place + reach_m * (ahead - 1.75 * aside)]
    )
    there = shapely.intersection(lines, wedge)
    opposite = shapely.distance(there, point)
    if np.isnan(opposite).all():
        return None
    other = int(np.nanargmin(opposite))
    second = np.array(_nearest(there[other], (float(place[0]), float(place[1]))))
    return size_m + float(opposite[other]), _Facing(first, second, (index, other))


def _nearest(line: BaseGeometry, point: Point) -> Point:
    east, north = shapely.get_coordinates(shapely.shortest_line(line, ShapelyPoint(point)))[0].tolist()
    return east, north
