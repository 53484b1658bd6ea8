"""The planner: built once for a fence, it answers many queries."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain
from math import dist, isfinite
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .any_angle import shortest_path
from .block_search import BlockGraph, block_sequence
from .compiled import load_engine
from .compiled.batch import spread
from .errors import (
    GoalBlockedError,
    InvalidGeometryError,
    NoPathError,
    PlanningError,
    SearchStoppedError,
    StartBlockedError,
)
from .field import Field
from .free_space import Scene, grow_exclusions, parse_scene
from .funnel import taut_path
from .geometry import Floats, Point, Ring, parse_point, parse_points
from .path_tree import PathTree
from .planned_path import PlannedPath, length_of, straightened
from .plotting import Drawing
from .three_cases import crossing_point
from .uncollected import uncollected
from .widest import WidestWay, widest_in

if TYPE_CHECKING:
    from shapely.geometry import MultiPolygon

    from .clearance import Geometries
    from .holes import Change
    from .partition.flat import DirectPath, Engine

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
        Whether the partition is swept and the exact search runs in compiled form: the same paths, many times faster once numba has compiled it,
        which takes some seconds the first time and a good part of one in each later process. It pays for some hundred queries and more. Needs the extra
        ``fast``.

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
        engine = load_engine() if compiled else None
        self._partition = partition
        scene = parse_scene(inclusions, exclusions, union=union)
        self._space = _Space.swept(scene, float(clearance_m), engine)

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
        scene, before = self._space.scene.with_exclusion(ring), self._space.mitred
        added = grow_exclusions(replace(scene, exclusions=scene.exclusions[-1:]), self.clearance_m)
        change = None if before.holes is None else before.holes.with_obstacle(added)
        return self._changed(scene, np.concatenate((before.free.grown, added)), change)

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
        before = self._space.mitred
        grown = np.delete(before.free.grown, index)
        change = None if before.holes is None else before.holes.without_obstacle(index)
        return self._changed(self._space.scene.without_exclusion(index), grown, change)

    def _changed(self, scene: Scene, grown: Geometries, change: Change | None) -> Planner:
        changed, before = copy(self), self._space.mitred
        with uncollected():
            field = before.changed(scene, change)
        changed._space = (  # noqa: SLF001 - one of our own
            _Space(field) if field else _Space.swept(scene, self.clearance_m, before.engine, grown=grown)
        )
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

    def lengths(
        self,
        starts: npt.ArrayLike,
        goals: npt.ArrayLike | None = None,
        *,
        should_stop: ShouldStop | None = None,
    ) -> Floats:
        """Return the lengths of the shortest paths between many points, as `plan` finds them.

        A compiled planner searches in as many threads as there are processors.

        Parameters
        ----------
        starts : (n, 2) array-like
            East and north in metres.
        goals : (m, 2) array-like, optional
            East and north in metres; if left out, the starts, and each pair of points is searched one way only.
        should_stop : callable, optional
            Asked now and then.

        Returns
        -------
        (n, m) array
            Lengths in metres; infinite where there is no path, or an end lies outside free space.

        Raises
        ------
        InvalidGeometryError
            If a point is not a pair of finite numbers.
        SearchStoppedError
            If ``should_stop`` returned True.
        """
        from_points = parse_points(starts, "starts")
        to_points = from_points if goals is None else parse_points(goals, "goals")
        count, width = len(from_points), len(to_points)
        one, other = np.triu_indices(count, 1) if goals is None else np.indices((count, width)).reshape(2, -1)
        ends = np.stack((from_points[one], to_points[other]), axis=1)
        lengths_m = np.full(len(ends), np.inf)
        self._space = self._space.holding([*from_points, *to_points])
        searcher = self._space.mitred.searched.searcher
        if searcher is not None:
            search = partial(searcher.lengths_m, origin_m=self._space.scene.origin_m, should_stop=should_stop)
            lengths_m = np.concatenate([lengths_m[:0], *spread(search, ends)])
        for place in np.flatnonzero(np.isinf(lengths_m)).tolist():
            if should_stop is not None and should_stop():
                raise SearchStoppedError
            with suppress(NoPathError, StartBlockedError, GoalBlockedError):
                lengths_m[place] = self.plan(*ends[place]).length_m
        matrix_m = np.zeros((count, width))
        matrix_m[one, other] = lengths_m
        return matrix_m + matrix_m.T if goals is None else matrix_m

    def plan_many(self, ends: npt.ArrayLike) -> list[PlannedPath | PlanningError]:
        """Return the shortest paths of many queries, as `plan` finds them.

        A compiled planner searches in as many threads as there are processors.

        Parameters
        ----------
        ends : (n, 2, 2) array-like
            Start and goal of each query, east and north in metres.

        Returns
        -------
        list of PlannedPath or PlanningError
            For each query its path, or the error that `plan` raises.

        Raises
        ------
        InvalidGeometryError
            If a point is not a pair of finite numbers.
        """
        points = parse_points(np.asarray(ends, dtype=np.float64).reshape(-1, 2), "ends").reshape(-1, 2, 2)
        self._space = self._space.holding(points.reshape(-1, 2))
        field = self._space.mitred
        searcher = field.searched.searcher
        answers: Iterable[DirectPath | None] = [None] * len(points)
        if searcher is not None:
            search = partial(searcher.answers, origin_m=field.scene.origin_m)
            answers = chain.from_iterable(spread(search, points))
        found: list[PlannedPath | PlanningError] = []
        for pair, answer in zip(points, answers, strict=True):
            try:
                found.append(
                    self.plan(*pair) if answer is None else _direct_path(field, answer, self._partition)
                )
            except PlanningError as error:
                found.append(error)
        return found

    def tree(self, places: npt.ArrayLike, *, around: npt.ArrayLike = ()) -> PathTree:
        """Return the shortest ways from anywhere to a few places, searched once for all questions.

        Parameters
        ----------
        places : (m, 2) array-like
            East and north in metres.
        around : (n, 2) array-like
            From where ways will be asked for: without inclusions free space is as wide as these, the places and the exclusions need.

        Returns
        -------
        PathTree
            Its ways keep the clearance with mitred corners: where `plan` takes round ones, so that it finds a way at all, a tree finds none.

        Raises
        ------
        InvalidGeometryError
            If a point is not a pair of finite numbers, or the planner is compiled.
        """
        points = parse_points(places, "places")
        self._space = self._space.holding([*points.tolist(), *parse_points(around, "around").tolist()])
        return PathTree(self._space.mitred, points)

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
        searcher = field.searched.searcher
        if method == "optimal" and searcher is not None and should_stop is None:
            answer = searcher.direct(*ends, field.scene.origin_m)
            if answer is not None:
                return _direct_path(field, answer, self._partition)
        common = field.require(ends[0], StartBlockedError) & field.require(ends[1], GoalBlockedError)
        if not common:
            raise NoPathError(self.clearance_m)
        start, goal = (field.onto(field.scene.to_local(end), common) for end in ends)
        if method == "optimal":
            found = _optimal(field, start, goal, should_stop)
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
    def swept(
        cls,
        scene: Scene,
        clearance_m: float,
        engine: Engine | None,
        *,
        grown: Geometries | None = None,
    ) -> _Space:
        """Return the space with its slabs made: searches need them, and better now than in the first query."""
        with uncollected():
            field = Field(scene, clearance_m, grown=grown, engine=engine)
            _ = field.slabs
        return cls(field)

    def holding(self, ends: Iterable[Point]) -> _Space:
        """Return the same space; without inclusions one whose bounded part of the plane holds all ends."""
        if len(self.scene.inclusions):
            return self
        local = [self.scene.to_local(end) for end in ends]
        if all(map(self.mitred.holds, local)):
            return self
        clearance_m, engine = self.mitred.free.clearance_m, self.mitred.engine
        return _Space(Field(self.scene, clearance_m, reach=local, engine=engine))

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
        clearance_m, engine = self.mitred.free.clearance_m, self.mitred.engine
        return Field(self.scene, clearance_m, rounded=True, engine=engine)


@dataclass(frozen=True)
class _Found:
    """A path as a method finds it: what lies between start and goal, metres from the scene's origin."""

    turns: Sequence[Point]
    lower_bound_m: float | None  # None: the path is the shortest
    blocks: int
    expanded: int
    sequence: Sequence[int] = ()


def _direct_path(field: Field, answer: DirectPath, partition: str | None) -> PlannedPath:
    return PlannedPath(
        points=answer.points,
        length_m=answer.length_m,
        lower_bound_m=answer.length_m,
        method="optimal",
        blocks=len(field.searched),
        expanded=answer.expanded,
        drawing=Drawing(field, partition or "slabs", answer.turns[1:-1]),
    )


def _optimal(field: Field, start: Point, goal: Point, should_stop: ShouldStop | None) -> _Found | None:
    result = shortest_path(field.searched, start, goal, should_stop)
    blocks = len(field.searched)
    if result.vertices is not None:
        turns = field.searched.vertices.points[list(result.vertices)].tolist()
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
