"""The planner: built once for a fence, it answers many queries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from math import isfinite

import numpy as np
import numpy.typing as npt
from shapely.geometry import MultiPolygon

from .any_angle import shortest_path
from .errors import GoalBlockedError, InvalidGeometryError, NoPathError, StartBlockedError
from .field import Field
from .free_space import parse_scene
from .geometry import Point, Ring, parse_point
from .planned_path import PlannedPath, length_of
from .widest import WidestWay, widest_in

__all__ = ["Planner", "plan_path"]

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

    def widest(
        self, start: npt.ArrayLike, goal: npt.ArrayLike, *, tolerance_m: float = 0.01, should_stop: ShouldStop | None = None
    ) -> WidestWay:
        """Return the greatest clearance at which start and goal are still connected, whatever clearance was asked for.

        Parameters
        ----------
        start, goal : pair of float
            (east, north) in metres.
        tolerance_m : float, default 0.01
            How exact the clearance must be, in metres.
        should_stop : callable, optional
            Asked before each step; when it returns True, the clearance is what has been proven so far.

        Returns
        -------
        WidestWay
            The clearance with its narrowest place.

        Raises
        ------
        InvalidGeometryError, StartBlockedError, GoalBlockedError, NoPathError
            As `widest` does.
        """
        ends = parse_point(start, "start"), parse_point(goal, "goal")
        return widest_in(self._scene, ends, tolerance_m, should_stop)

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
        if not field.require(ends[0], StartBlockedError) & field.require(ends[1], GoalBlockedError):
            raise NoPathError(self._clearance_m)
        start, goal = (field.onto(self._scene.to_local(end)) for end in ends)
        result = shortest_path(field.slabs, start, goal, should_stop)
        if result.vertices is None:
            raise NoPathError(self._clearance_m)
        turns = field.slabs.vertices.points[list(result.vertices)] + self._scene.origin_m
        points = np.array([ends[0], *turns, ends[1]])
        length_m = length_of(points)
        bound_m = min(result.lower_bound_m, length_m) if result.stopped else length_m
        return PlannedPath(points, length_m, bound_m, method, len(field.slabs), result.expanded, planner=self)
