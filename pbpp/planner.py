"""The planner: built once for a fence, it answers many queries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import dist, isfinite
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .any_angle import shortest_path
from .block_search import BlockGraph, block_sequence
from .compiled import require_numba
from .errors import GoalBlockedError, InvalidGeometryError, NoPathError, StartBlockedError
from .field import Field
from .free_space import Scene, grow_exclusions, parse_scene
from .funnel import taut_path
from .geometry import Point, Ring, parse_point
from .planned_path import PlannedPath, length_of, straightened
from .plotting import Drawing
from .three_cases import crossing_point
from .uncollected import uncollected
from .widest import WidestWay, widest_in

if TYPE_CHECKING:
    from shapely.geometry import MultiPolygon

    from .clearance import Geometries

__all__ = ["Planner", "plan_path"]

ShouldStop = Callable[[], bool]


def plan_path(  # noqa: PLR0913 - a fence, two ends, and options by name
    inclusions: Sequence[Ring],
    exclusions: Sequence[Ring],
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    *,
    clearance_m: float = 0.0,
    union: bool = False,
    method: str = "optimal",
    cost: str = "metric",
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
    cost : {"metric", "literal"}
        How the block methods read the paper's g: metres so far, or 1 and 1.4 for each step as printed.
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
    return planner.plan(start, goal, method=method, cost=cost, should_stop=should_stop)


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
    partition : {"slabs", "blocks"}, optional
        What the block methods search: the paper's blocks if left out, or their merged form, which is much smaller. The exact search
        uses slabs whatever is said here; its answer depends on neither.
    compiled : bool, default False
        Whether the exact search runs in its compiled form: the same paths, many times faster once numba has compiled it, which takes some
        seconds the first time and a good part of one in each later process. It pays for some hundred queries and more. Needs the
        extra ``fast``. Where a query brings a ``should_stop``, the plain search answers.

    Raises
    ------
    InvalidGeometryError
        If a ring or the clearance cannot be used.
    ImportError
        If numba is asked for and not there.
    """

    def __init__(
        self,
        inclusions: Sequence[Ring],
        exclusions: Sequence[Ring],
        *,
        clearance_m: float = 0.0,
        union: bool = False,
        partition: str | None = None,
        compiled: bool = False,
    ) -> None:
        if not (isfinite(clearance_m) and clearance_m >= 0.0):
            raise InvalidGeometryError(f"the clearance must be 0 m or more, not {clearance_m!r}")
        if partition not in {None, "slabs", "blocks"}:
            raise ValueError(f'partition must be "slabs", "blocks" or None, not {partition!r}')
        if compiled:
            require_numba()
        self._partition, self._compiled = partition, compiled
        self._space = _Space.swept(parse_scene(inclusions, exclusions, union=union), float(clearance_m))

    def with_exclusion(self, ring: Ring) -> Planner:
        """Return a planner for the same fence with one exclusion more, faster than from scratch.

        Parameters
        ----------
        ring : (n, 2) array-like or shapely polygon
            East and north in metres. It becomes the last exclusion.

        Returns
        -------
        Planner
            A new planner; this one stays as it is.

        Raises
        ------
        InvalidGeometryError
            If the ring cannot be used.
        """
        scene, grown = self._space.scene.with_exclusion(ring), self._space.mitred.free.grown
        added = grow_exclusions(replace(scene, exclusions=scene.exclusions[-1:]), self.clearance_m)
        return self._changed(scene, np.concatenate((grown, added)))

    def without_exclusion(self, index: int) -> Planner:
        """Return a planner for the same fence without one of its exclusions, faster than from scratch.

        Parameters
        ----------
        index : int
            Which exclusion; those after it move up by one.

        Returns
        -------
        Planner
            A new planner; this one stays as it is.

        Raises
        ------
        IndexError
            If there is no such exclusion.
        """
        grown = np.delete(self._space.mitred.free.grown, index)
        return self._changed(self._space.scene.without_exclusion(index), grown)

    def _changed(self, scene: Scene, grown: Geometries) -> Planner:
        changed = copy(self)
        changed._space = _Space.swept(scene, self.clearance_m, grown)  # noqa: SLF001 - one of our own
        return changed

    @property
    def clearance_m(self) -> float:
        """Distance in metres that paths keep from the fence."""
        return self._space.mitred.free.clearance_m

    @property
    def free_space(self) -> MultiPolygon:
        """Where the robot's centre may be: one polygon for each connected component, east and north in metres."""
        return self._space.on_map

    def plan(
        self,
        start: npt.ArrayLike,
        goal: npt.ArrayLike,
        *,
        method: str = "optimal",
        cost: str = "metric",
        should_stop: ShouldStop | None = None,
    ) -> PlannedPath:
        """Return a path from start to goal.

        Parameters
        ----------
        start, goal : pair of float
            (east, north) in metres.
        method : {"optimal", "pbpp-taut", "pbpp"}
            The search.
        cost : {"metric", "literal"}
            As for `plan_path`.
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
        self._space = self._space.holding(ends)
        if method not in {"optimal", "pbpp-taut", "pbpp"}:
            raise ValueError(f'method must be "optimal", "pbpp-taut" or "pbpp", not {method!r}')
        if cost not in {"metric", "literal"}:
            raise ValueError(f'cost must be "metric" or "literal", not {cost!r}')
        plan = partial(self._plan_in, ends=ends, method=method, cost=cost, should_stop=should_stop)
        try:
            return plan(self._space.mitred)
        except (NoPathError, StartBlockedError, GoalBlockedError):
            if self.clearance_m == 0.0:
                raise
        return plan(self._space.rounded)

    def widest(
        self,
        start: npt.ArrayLike,
        goal: npt.ArrayLike,
        *,
        tolerance_m: float = 0.01,
        should_stop: ShouldStop | None = None,
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
        return widest_in(self._space.scene, ends, tolerance_m, should_stop)

    def _plan_in(
        self, field: Field, ends: tuple[Point, Point], method: str, cost: str, should_stop: ShouldStop | None
    ) -> PlannedPath:
        common = field.require(ends[0], StartBlockedError) & field.require(ends[1], GoalBlockedError)
        if not common:
            raise NoPathError(self.clearance_m)
        start, goal = (field.onto(field.scene.to_local(end), common) for end in ends)
        if method == "optimal":
            found = _optimal(field, start, goal, should_stop, compiled=self._compiled)
        else:
            graph = field.graph(self._partition or "blocks")
            taut = method == "pbpp-taut"
            found = _over_blocks(graph, start, goal, taut=taut, cost=cost, should_stop=should_stop)
        if found is None:
            raise NoPathError(self.clearance_m)
        inner = np.array(found.turns, dtype=np.float64).reshape(-1, 2) + field.scene.origin_m
        points = straightened(np.array([ends[0], *inner, ends[1]]))
        length_m = length_of(points)
        return PlannedPath(
            points=points,
            length_m=length_m,
            lower_bound_m=length_m if found.lower_bound_m is None else min(found.lower_bound_m, length_m),
            method=method,
            blocks=found.blocks,
            expanded=found.expanded,
            sequence=tuple(found.sequence),
            drawing=Drawing(field, self._partition or ("slabs" if method == "optimal" else "blocks"), inner),
        )


@dataclass(frozen=True, eq=False)
class _Space:
    """Free space with mitred corners, and what follows from it once it is asked for."""

    mitred: Field

    @classmethod
    def swept(cls, scene: Scene, clearance_m: float, grown: Geometries | None = None) -> _Space:
        """Return the space with its slabs made: searches need them, and better now than in the first query."""
        with uncollected():
            field = Field(scene, clearance_m, grown=grown)
            _ = field.slabs
        return cls(field)

    def holding(self, ends: tuple[Point, Point]) -> _Space:
        """Return the same space; without inclusions one whose bounded part of the plane holds both ends."""
        local = [self.scene.to_local(end) for end in ends]
        if len(self.scene.inclusions) or all(map(self.mitred.holds, local)):
            return self
        return _Space(Field(self.scene, self.mitred.free.clearance_m, reach=local))

    @property
    def scene(self) -> Scene:
        """The fence."""
        return self.mitred.scene

    @cached_property
    def on_map(self) -> MultiPolygon:
        """The polygons on the map."""
        return self.scene.to_map(self.mitred.free.geometry)

    @cached_property
    def rounded(self) -> Field:
        """The same with round corners: asked before anyone is told that there is no way."""
        return Field(self.scene, self.mitred.free.clearance_m, rounded=True)


@dataclass(frozen=True)
class _Found:
    """A path as a method finds it: what lies between start and goal, metres from the scene's origin."""

    turns: Sequence[Point]
    lower_bound_m: float | None  # None: the path is the shortest
    blocks: int
    expanded: int
    sequence: Sequence[int] = ()


def _optimal(
    field: Field, start: Point, goal: Point, should_stop: ShouldStop | None, *, compiled: bool
) -> _Found | None:
    result = shortest_path(field.slabs, start, goal, should_stop, compiled=compiled)
    blocks = len(field.slabs)
    if result.vertices is not None:
        turns = field.slabs.vertices.points[list(result.vertices)].tolist()
        bound_m = result.lower_bound_m if result.stopped else None
        return _Found([(east, north) for east, north in turns], bound_m, blocks, result.expanded)
    if not result.stopped:
        return None
    # Stopped before the goal was reached: the taut path through the best sequence of slabs is there in little time.
    quick = _over_blocks(field.graph("slabs"), start, goal, taut=True)
    return None if quick is None else replace(quick, lower_bound_m=result.lower_bound_m)


def _over_blocks(
    graph: BlockGraph,
    start: Point,
    goal: Point,
    *,
    taut: bool,
    cost: str = "metric",
    should_stop: ShouldStop | None = None,
) -> _Found | None:
    found = block_sequence(graph, start, goal, cost=cost, should_stop=should_stop)
    if found is None:
        return None
    sequence, crossings, expanded = found
    if taut:
        turns = taut_path(start, goal, crossings, [graph.centers[block] for block in sequence])[1:-1]
    else:
        # Free space is shrunk by the robot's radius already, so the paper's range is spent.
        turns = [crossing_point(crossing, goal) for crossing in crossings]
    straight_m = dist(start, goal)
    return _Found(turns, straight_m, len(graph.centers), expanded, sequence)
