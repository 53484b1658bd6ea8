"""The planner: built once for a fence, it answers many queries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from math import inf, isfinite

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiPolygon

from .any_angle import shortest_path
from .errors import GoalBlockedError, InvalidGeometryError, NoPathError, StartBlockedError
from .free_space import Scene, build_free_space, parse_scene
from .geometry import Point, Ring, parse_point
from .partition.slabs import Slabs
from .planned_path import PlannedPath, length_of

__all__ = ["Planner", "plan_path"]

BOUNDARY_TOLERANCE_M = 1e-7
"""A start or goal this near to free space counts as on its boundary."""

ShouldStop = Callable[[], bool]


def plan_path(
    inclusions: Sequence[Ring],
    exclusions: Sequence[Ring],
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    *,
    clearance_m: float = 0.0,
    union: bool = False,
    method: str = "optimal",
    should_stop: ShouldStop | None = None,
) -> PlannedPath:
    """Return a path from start to goal that keeps clear of the fence.

    Parameters
    ----------
    inclusions, exclusions : sequence of (n, 2) array-like or shapely polygon
        East and north in metres. No inclusion at all means the open plane.
    start, goal : pair of float
        (east, north) in metres.
    clearance_m : float, default 0.0
        Distance in metres that the path keeps from every exclusion and from the edge of what is included.
    union : bool, default False
        True: the path may lie in any inclusion. False: it lies in all of them.
    method : {"optimal", "pbpp-taut", "pbpp"}
        The search.
    should_stop : callable, optional
        Asked now and then; when it returns True, the best path so far is returned with the bound reached.

    Returns
    -------
    PlannedPath
        The path.

    Raises
    ------
    InvalidGeometryError
        If a ring, a point or the clearance cannot be used.
    StartBlockedError, GoalBlockedError
        If an end lies outside free space.
    NoPathError
        If no path joins them.
    """
    planner = Planner(inclusions, exclusions, clearance_m=clearance_m, union=union)
    return planner.plan(start, goal, method=method, should_stop=should_stop)


class Planner:
    """A fence made ready for queries.

    Parameters
    ----------
    inclusions, exclusions : sequence of (n, 2) array-like or shapely polygon
        East and north in metres. No inclusion at all means the open plane.
    clearance_m : float, default 0.0
        Distance in metres that paths keep from every exclusion and from the edge of what is included.
    union : bool, default False
        True: paths may lie in any inclusion. False: they lie in all of them.

    Raises
    ------
    InvalidGeometryError
        If a ring or the clearance cannot be used.
    """

    def __init__(
        self,
        inclusions: Sequence[Ring],
        exclusions: Sequence[Ring],
        *,
        clearance_m: float = 0.0,
        union: bool = False,
        partition: str | None = None,
    ) -> None:
        if not (isfinite(clearance_m) and clearance_m >= 0.0):
            raise InvalidGeometryError(f"the clearance must be a length of at least 0 m, not {clearance_m!r}")
        del partition
        self._scene = parse_scene(inclusions, exclusions, union=union)
        self._clearance_m = float(clearance_m)
        self._mitred = Field(self._scene, self._clearance_m)

    @property
    def clearance_m(self) -> float:
        """Distance in metres that paths keep from the fence."""
        return self._clearance_m

    @cached_property
    def free_space(self) -> MultiPolygon:
        """Where the robot's centre may be: one polygon for each connected component, east and north in metres."""
        return self._scene.to_map(self._mitred.free.geometry)

    @cached_property
    def _rounded(self) -> Field:
        """The same with round corners: asked before anyone is told that there is no way."""
        return Field(self._scene, self._clearance_m, rounded=True)

    def plan(
        self,
        start: npt.ArrayLike,
        goal: npt.ArrayLike,
        *,
        method: str = "optimal",
        should_stop: ShouldStop | None = None,
    ) -> PlannedPath:
        """Return a path from start to goal.

        Parameters
        ----------
        start, goal : pair of float
            (east, north) in metres.
        method : {"optimal", "pbpp-taut", "pbpp"}
            The search.
        should_stop : callable, optional
            Asked now and then; when it returns True, the best path so far is returned with the bound reached.

        Returns
        -------
        PlannedPath
            The path.

        Raises
        ------
        InvalidGeometryError
            If a point is not a pair of finite numbers.
        StartBlockedError, GoalBlockedError
            If an end lies outside free space.
        NoPathError
            If no path joins them.
        """
        ends = parse_point(start, "start"), parse_point(goal, "goal")
        if not len(self._scene.inclusions):
            self._widen(ends)
        try:
            return self._plan_in(self._mitred, ends, method, should_stop)
        except (NoPathError, StartBlockedError, GoalBlockedError):
            if self._clearance_m == 0.0:
                raise
        return self._plan_in(self._rounded, ends, method, should_stop)

    def _widen(self, ends: tuple[Point, Point]) -> None:
        """Without inclusions, let the bounded part of the plane hold both ends."""
        local = [self._scene.to_local(end) for end in ends]
        if not all(self._mitred.holds(end) for end in local):
            self.__dict__.pop("free_space", None)
            self.__dict__.pop("_rounded", None)
            self._mitred = Field(self._scene, self._clearance_m, reach=local)

    def _plan_in(
        self, field: Field, ends: tuple[Point, Point], method: str, should_stop: ShouldStop | None
    ) -> PlannedPath:
        start, start_parts = self._enter(field, ends[0], StartBlockedError)
        goal, goal_parts = self._enter(field, ends[1], GoalBlockedError)
        if not start_parts & goal_parts:
            raise NoPathError(self._clearance_m)
        result = shortest_path(field.slabs, start, goal, should_stop)
        if result.vertices is None:
            raise NoPathError(self._clearance_m)
        turns = field.slabs.vertices.points[list(result.vertices)] + self._scene.origin_m
        points = np.array([ends[0], *turns, ends[1]])
        length_m = length_of(points)
        bound_m = min(result.lower_bound_m, length_m) if result.stopped else length_m
        return PlannedPath(points, length_m, bound_m, method, len(field.slabs), result.expanded, planner=self)

    def _enter(
        self, field: Field, point: Point, error: type[StartBlockedError | GoalBlockedError]
    ) -> tuple[Point, frozenset[int]]:
        """Return a point and its components, the point moved onto free space if rounding put it beside."""
        local = self._scene.to_local(point)
        components = field.free.components_at(local, BOUNDARY_TOLERANCE_M)
        if not components:
            if not field.free.polygons:
                raise error(point, self._clearance_m, inf, None)
            nearest, distance_m = field.nearest(local)
            raise error(point, self._clearance_m, distance_m, self._scene.from_local(nearest))
        if not field.slabs.locate(local):
            local, _ = field.nearest(local)
        return local, components


class Field:
    """Free space at one clearance with its slabs.

    Parameters
    ----------
    scene : Scene
        The fence.
    clearance_m : float
        Clearance in metres.
    rounded : bool, default False
        Whether corners are offset round.
    reach : sequence of (east, north)
        Points that the bounded part of the open plane must hold, metres from the scene's origin.
    """

    def __init__(
        self, scene: Scene, clearance_m: float, *, rounded: bool = False, reach: Sequence[Point] = ()
    ) -> None:
        self.free = build_free_space(scene, clearance_m, rounded=rounded, reach=reach)

    @cached_property
    def slabs(self) -> Slabs:
        """The slab partition."""
        return Slabs(self.free.polygons)

    def holds(self, point: Point) -> bool:
        """Return whether a point lies in the bounds of free space."""
        if not self.free.polygons:
            return False
        west, south, east, north = self.free.geometry.bounds
        return west <= point[0] <= east and south <= point[1] <= north

    def nearest(self, point: Point) -> tuple[Point, float]:
        """Return the nearest point of free space and how far it is in metres."""
        line = shapely.shortest_line(self.free.geometry, shapely.Point(point))
        east, north = shapely.get_coordinates(line)[0].tolist()
        return (east, north), float(shapely.length(line))
