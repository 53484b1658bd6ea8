"""A drawn route in the plane: from start over targets, keeping the clearance, leading away first where the start is nearer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon

import pbpp
from missions.fence import ZoneKind
from missions.geo import LocalPoint, bearing_deg, distance_m
from missions.ground.ground import COMMON_GROUND, COMMON_GROUND_ADVICE
from missions.routing.bottleneck import narrowest_place
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from missions.geo import LatLon
    from missions.ground.ground import Barrier, Ground
    from missions.routing.bottleneck import NarrowestPlace

INSIDE_M = 0.005
"""Points put on the edge of free space stand this far inside it, so that rounding leaves them there."""

_ROUNDED_EXCESS_M = 0.005
"""What pbpp's round offsets may keep beyond the clearance, and a little."""

_NEAR_M = 0.01  # within which the widest clearance is looked for: promises are whole centimetres

_WIDER = (1, 4, 16, 64)  # multiples of the reach within which free ground is looked for, nearest first

_CHORDS = 64  # in a quarter circle
_CHORD_SHARE = 1.0002
"""By so much an arc of that many chords a quarter turn must be wider to keep its distance all along."""


@dataclass(frozen=True, eq=False)
class Route:
    """Straight lines through local points.

    Parameters
    ----------
    points : (n, 2) array
        East and north in metres, start first.
    lead_away : int
        How many of the first legs lead away from a fence that the start stands nearer to than the clearance.
    start_clearance_m : float
        The start's distance to the nearest fence; negative on forbidden ground, by the distance to free ground.
    target_indices : tuple of int
        Which points are the targets, in order.
    blocks : int
        Blocks of the partition the planner searched.
    """

    points: NDArray[np.float64]
    lead_away: int
    start_clearance_m: float
    target_indices: tuple[int, ...]
    blocks: int

    @property
    def places(self) -> list[LocalPoint]:
        """The points one by one."""
        return [LocalPoint(*point) for point in self.points.tolist()]

    @property
    def targets(self) -> tuple[LocalPoint, ...]:
        """The targets as reached, in order."""
        return tuple(self.places[index] for index in self.target_indices)

    @property
    def length_m(self) -> float:
        """How long the lines are."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Sought:
    """What a route is sought for, at whatever clearance.

    Parameters
    ----------
    ground : Ground
        The field.
    start, targets : LocalPoint
        Where from, and where to, in the order of visits.
    method : str
        ``optimal``, ``pbpp-taut`` or ``pbpp``.
    snap_m : float
        A blocked target is moved to free ground within this distance.
    asked : str
        The clearance that is asked for, as the one who asked knows it.
    escape : bool
        Whether a start on forbidden ground is left by the shortest straight line that crosses no other forbidden ground.
    should_stop : callable, optional
        Asked now and then; True ends the search.
    compares : bool
        Whether a refusal for want of room names what the widest route keeps while driven; else what straight legs keep.
    """

    ground: Ground
    start: LocalPoint
    targets: Sequence[LocalPoint]
    method: str = "optimal"
    snap_m: float = 0.0
    escape: bool = False
    should_stop: Callable[[], bool] | None = None
    asked: str = ""
    compares: bool = True
    _narrowest: dict[tuple[LocalPoint, LocalPoint], NarrowestPlace | None] = field(
        default_factory=dict, init=False
    )

    def narrowest_place(self, a: LocalPoint, b: LocalPoint) -> NarrowestPlace | None:
        """Return the narrowest place of the widest route between two points, whatever the clearance: looked for once."""
        if (a, b) not in self._narrowest:
            self._narrowest[a, b] = narrowest_place(self.ground, a, b, self.should_stop)
        return self._narrowest[a, b]

    @property
    def widest_ground_m(self) -> float:
        """A clearance that no route exceeds once it has left the start."""
        bounds_m = [self.ground.clearance_m(Point(target)) + self.snap_m for target in self.targets]
        start_m = self.ground.clearance_m(Point(self.start))
        for a, b in pairwise((self.start, *self.targets)):
            place = self.narrowest_place(a, b)
            if place is not None and (a is not self.start or place.clearance_m < start_m - _NEAR_M):
                bounds_m.append(place.clearance_m)
        return min(*bounds_m, self.ground.bounds.bounds[2] - self.ground.bounds.bounds[0])

    def narrowest_places(self) -> list[NarrowestPlace | None]:
        """Return those on the way from the start to the first target, and from each to the next."""
        return [self.narrowest_place(a, b) for a, b in pairwise((self.start, *self.targets))]


def widest_drawn_m(sought: Sought, beside_m: float = 0.0) -> float | NoRoute:
    """Return the greatest clearance, beside some room, that routes are drawn at, within a centimetre; why there are none where there are none at all."""

    def drawn(clearance_m: float) -> Route | NoRoute:
        return DrawnRoutes.at(sought, clearance_m + beside_m).find()

    least = drawn(0.0)
    if isinstance(least, NoRoute):
        return least
    low_m, high_m = 0.0, max(sought.widest_ground_m - beside_m, 0.0)
    if isinstance(drawn(high_m), Route):
        return high_m
    while high_m - low_m > _NEAR_M:
        middle_m = (low_m + high_m) / 2
        low_m, high_m = (middle_m, high_m) if isinstance(drawn(middle_m), Route) else (low_m, middle_m)
    return low_m


def simplified(ground: Ground, route: Route, clearance_m: float) -> Route:
    """Return the route with fewer points: those left out whose neighbours a straight line joins at the clearance."""
    fixed = {*range(route.lead_away + 1), *route.target_indices}
    kept = [0]
    while kept[-1] < len(route.points) - 1:
        here = kept[-1]
        last = min(index for index in fixed | {len(route.points) - 1} if index > here)
        reachable = (
            index
            for index in range(last, here + 1, -1)
            if ground.clearance_m(LineString(route.points[[here, index]])) >= clearance_m
        )
        kept.append(next(reachable, here + 1))
    return replace(
        route,
        points=route.points[kept],
        target_indices=tuple(kept.index(index) for index in route.target_indices),
    )


class _NoWayError(Exception):
    """Carries the reason out of a search that has come to its end."""

    def __init__(self, why: NoRoute) -> None:
        super().__init__(why.text)
        self.why = why


@dataclass(frozen=True, eq=False)
class DrawnRoutes:
    """Routes drawn at one clearance: what is free at it is computed once for all of them.

    Parameters
    ----------
    sought : Sought
        What for.
    clearance_m : float
        What the drawn lines keep to any fence; where the start is nearer, a route first leads away, never nearer than the start is.
    planner : pbpp.Planner
        Plans at that clearance.
    is_other_way : bool
        Whether places are blocked that are none of the fence's, to find another way round.
    """

    sought: Sought
    clearance_m: float
    planner: pbpp.Planner
    is_other_way: bool = False

    @classmethod
    def at(cls, sought: Sought, clearance_m: float) -> DrawnRoutes:
        """Return those at a clearance."""
        inclusions, exclusions = (
            sought.ground.areas(kind) for kind in (ZoneKind.INCLUSION, ZoneKind.EXCLUSION)
        )
        planner = pbpp.Planner(inclusions, exclusions, clearance_m=clearance_m, union=sought.ground.union)
        return cls(sought, clearance_m, planner)

    def around(self, place: Polygon) -> DrawnRoutes:
        """Return those that keep away from one more place, as from an exclusion."""
        return replace(self, planner=self.planner.with_exclusion(place), is_other_way=True)

    def find(self, start: LocalPoint | None = None) -> Route | NoRoute:
        """Find the shortest route over the targets in their order, from their start or another one."""
        try:
            return self._shortest(start or self.sought.start)
        except _NoWayError as end:
            return end.why

    def _shortest(self, start: LocalPoint) -> Route:
        start_clearance_m = self.check_start(start)
        goals = [self.free_target(target, start) for target in self.sought.targets]
        lead: list[LocalPoint] = [start]
        if start_clearance_m < 0:
            lead = self.escape(start, goals[0])
        elif not self.is_free(start):
            lead = self.lead_away(start, start_clearance_m, goals[0])
        points = [np.array(lead)]
        target_indices = []
        blocks = 0
        here = lead[-1]
        for goal in goals:
            path = self.path(here, goal)
            points.append(path.points[1:])
            target_indices.append(sum(map(len, points)) - 1)
            blocks = max(blocks, path.blocks)
            here = goal
        return Route(np.concatenate(points), len(lead) - 1, start_clearance_m, tuple(target_indices), blocks)

    @property
    def ground(self) -> Ground:
        """The field."""
        return self.sought.ground

    @property
    def asked(self) -> str:
        """The clearance in words."""
        drawn = metres(self.clearance_m)
        return f"{self.sought.asked} ({drawn} along straight legs)" if self.sought.asked else drawn

    def is_free(self, point: LocalPoint) -> bool:
        """Whether the planner takes a point: mitred offsets hold it, or its true distance is what round ones hold."""
        here = Point(point)
        if self.planner.free_space.covers(here):
            return True
        return self.ground.clearance_m(here) >= self.clearance_m + _ROUNDED_EXCESS_M

    @cached_property
    def roomy(self) -> list[Polygon]:
        """Where points are free with some millimetres to spare, part by part.

        Raises
        ------
        _NoWayError
            There is no such place.
        """
        reach_m = self.clearance_m * _CHORD_SHARE + _ROUNDED_EXCESS_M + INSIDE_M
        inner = self.ground.allowed.buffer(-reach_m, quad_segs=_CHORDS)
        parts: list[Polygon] = [part for part in shapely.get_parts(inner) if not part.is_empty]
        if not parts:
            raise _NoWayError(
                NoRoute(
                    NoRouteKind.NOWHERE_FREE,
                    f"no place in the field keeps {self.asked} from every fence",
                    {"clearance_m": self.clearance_m},
                )
            )
        return parts

    def check_start(self, start: LocalPoint) -> float:
        """Return the start's clearance; on ground that it may escape from, minus the distance to free ground.

        Raises
        ------
        _NoWayError
            The start is on forbidden ground.
        """
        point = Point(start)
        forbidding = self.ground.forbidding(point)
        if not forbidding and self.ground.allowed.covers(point):
            return self.ground.clearance_m(point)
        free = self.ground.nearest_point(self.ground.allowed, point)
        distance, bearing, position = self._way(start, free)
        if self.sought.escape:
            return -max(distance, INSIDE_M)
        names = [barrier.name for barrier in forbidding]
        raise _blocked(
            NoRouteKind.START_BLOCKED,
            f"the start is {_standing(forbidding)} ({self._position(start)}); "
            f"the allowed area is {distance:.2f} m away, bearing {round(bearing) % 360}°, at {position}",
            names,
            is_overlap=self.ground.is_in_some_inclusions_only(point),
            distance_m=round(distance, 3),
            bearing_deg=round(bearing, 1),
            nearest_free=list(position),
        )

    def free_target(self, target: LocalPoint, start: LocalPoint) -> LocalPoint:
        """Return the target, or the nearest free point that it may be moved to, on the start's side of the fences if there is one.

        Raises
        ------
        _NoWayError
            There is none that near.
        """
        if self.is_free(target):
            return target
        snap_m = self.sought.snap_m
        point = Point(target)
        free = self.ground.nearest_point(self._component(start), point)
        if not snap_m or point.distance(free) > snap_m:
            free = self.ground.nearest_point(MultiPolygon(self.roomy), point)
        distance, bearing, position = self._way(target, free)
        if distance <= snap_m:
            return LocalPoint(free.x, free.y)
        forbidding = self.ground.forbidding(point)
        nearest, gap_m = self.ground.nearest(point)
        if forbidding:
            names = [barrier.name for barrier in forbidding]
            # A ground station shows 50 letters: what stands in the way comes first.
            problem = f"the target is {_standing(forbidding)} ({self._position(target)})"
        else:
            names = [nearest.name] if nearest else []
            problem = f"the target is {metres(gap_m)} from {_names(names)}, closer than {self.asked}"
        raise _blocked(
            NoRouteKind.TARGET_BLOCKED,
            f"{problem}; the nearest free point is {distance:.2f} m away, bearing {round(bearing) % 360}°, at {position}",
            names,
            is_overlap=self.ground.is_in_some_inclusions_only(point),
            clearance_m=round(self.clearance_m, 3),
            distance_m=round(distance, 3),
            bearing_deg=round(bearing, 1),
            nearest_free=list(position),
        )

    def path(self, start: LocalPoint, goal: LocalPoint) -> pbpp.PlannedPath:
        """Plan between two free points."""
        method, should_stop = self.sought.method, self.sought.should_stop
        try:
            return self.planner.plan(start, goal, method=method, should_stop=should_stop)
        except (pbpp.NoPathError, pbpp.StartBlockedError, pbpp.GoalBlockedError):
            raise _NoWayError(self._no_route(start, goal)) from None

    def lead_away(self, start: LocalPoint, start_clearance_m: float, goal: LocalPoint) -> list[LocalPoint]:
        """Return the first points of a route that leaves a fence's neighbourhood without ever coming nearer to one.

        Little further than need be: of the places not much farther than the nearest, the one most on the way.
        """
        free = self._component(goal)
        nearest = self.ground.nearest_point(free, Point(start))
        onward = self.path(LocalPoint(nearest.x, nearest.y), goal).points[1]
        reach_m = 2 * Point(start).distance(nearest) + 1.0
        for wider in _WIDER:  # out of a corridor it may be far
            exits = self._exits(start, start_clearance_m, free, wider * reach_m)
            if len(exits):
                detours_m = np.hypot(*(exits - start).T) + np.hypot(*(exits - onward).T)
                east_m, north_m = exits[np.argmin(detours_m)].tolist()
                return [start, LocalPoint(east_m, north_m)]
        raise _NoWayError(self._no_route(start, goal))

    def escape(self, start: LocalPoint, goal: LocalPoint) -> list[LocalPoint]:
        """Return the first points of a route off forbidden ground: straight out, across no other forbidden ground.

        Raises
        ------
        _NoWayError
            Every such line crosses other forbidden ground.
        """
        ground = self.ground
        free = self._component(goal)
        forbidding = ground.forbidding(Point(start))
        own = shapely.union_all(
            [
                barrier.area if barrier.kind is ZoneKind.EXCLUSION else ground.bounds.difference(barrier.area)
                for barrier in forbidding
            ]
        )
        for wider in _WIDER:
            reach_m = wider * (2 * Point(start).distance(free) + 1.0)
            near = free.boundary.intersection(Point(start).buffer(reach_m))
            exits = shapely.get_coordinates(near.segmentize(max(0.25, reach_m / 200)))
            legs = shapely.linestrings([[start, xy] for xy in exits]) if len(exits) else np.array([])
            outside = shapely.difference(legs, ground.allowed)
            # Straight out: forbidden ground ahead is that of the start, in one piece.
            keeps = (shapely.length(shapely.difference(outside, own)) < INSIDE_M) & (
                shapely.get_num_geometries(outside) == 1
            )
            if keeps.any():
                east_m, north_m = exits[keeps][np.argmin(shapely.length(legs[keeps]))].tolist()
                return [start, LocalPoint(east_m, north_m)]
        names = [barrier.name for barrier in forbidding]
        raise _blocked(
            NoRouteKind.START_BLOCKED,
            f"the start ({self._position(start)}) is {_standing(forbidding)}; every straight way out crosses another fence",
            names,
        )

    def _exits(
        self, start: LocalPoint, start_clearance_m: float, free: Polygon, reach_m: float
    ) -> NDArray[np.float64]:
        """Return the points on a free part's edge that a straight line reaches without coming nearer to a fence, (n, 2)."""
        near = free.boundary.intersection(Point(start).buffer(reach_m))
        nearest = shapely.shortest_line(free, Point(start))
        exits: NDArray[np.float64] = np.vstack(
            [
                shapely.get_coordinates(nearest)[:1],
                shapely.get_coordinates(near.segmentize(max(0.25, reach_m / 200))),
            ]
        )
        legs = shapely.linestrings([[start, xy] for xy in exits])
        keeps: NDArray[np.bool_] = shapely.distance(self.ground.edge, legs) >= start_clearance_m - 1e-9
        keeps[keeps] = shapely.covers(self.ground.allowed, legs[keeps])
        return np.asarray(exits[keeps])

    def _component(self, point: LocalPoint) -> Polygon:
        """Return the part of free ground that a point is on, or nearest to."""
        return min(self.roomy, key=lambda part: float(part.distance(Point(point))))

    def _no_route(self, start: LocalPoint, goal: LocalPoint) -> NoRoute:
        """Return how wide a route there is, or which fences part start and target (those along the edge of the smaller area)."""
        asked_m = {"clearance_m": round(self.clearance_m, 3)}
        if self.is_other_way:
            return NoRoute(NoRouteKind.NO_OTHER_WAY, f"no other route keeps {self.asked}", asked_m)
        place = self.sought.narrowest_place(start, goal)
        if place is not None:
            facts = {
                **asked_m,
                "widest_m": round(place.clearance_m, 3),
                "fences": list(place.between),
                "narrowest_at": list(place.at) if place.at else None,
            }
            return NoRoute(
                NoRouteKind.TOO_NARROW, f"no route keeps {self.asked}; {place}", facts, place.between
            )
        areas = {"start": self._component(start), "target": self._component(goal)}
        walled = min(areas, key=lambda end: areas[end].area)
        outline = areas[walled].exterior
        reach_m = self.clearance_m * 1.01 + 2 * INSIDE_M + 0.01
        names = [b.name for b in self.ground.barriers if self.ground.distance_m(b, outline) <= reach_m]
        other = "choose another target" if walled == "target" else "drive it out manually"
        return NoRoute(
            NoRouteKind.WALLED_IN,
            f"no route at any clearance: the {walled} is enclosed by {_names(names)}",
            {**asked_m, "walled_in": walled, "fences": names},
            names,
            advice=f"less clearance does not help: open a gap in {_names(names)}, or {other}",
        )

    def _way(self, point: LocalPoint, to: Point) -> tuple[float, float, LatLon]:
        """Return distance, bearing and position of another point, on Earth."""
        here = self._position(point)
        there = self.ground.frame.to_lat_lon(LocalPoint(to.x, to.y))
        return distance_m(here, there), bearing_deg(here, there), there

    def _position(self, point: LocalPoint) -> LatLon:
        return self.ground.frame.to_lat_lon(point)


def _blocked(
    kind: NoRouteKind, text: str, fences: list[str], *, is_overlap: bool = False, **facts: object
) -> _NoWayError:
    """Return the end of a search whose start or target is blocked, perhaps because inclusions overlap and it lies in some of them only."""
    why = NoRoute(kind, text, {"fences": fences, **facts}, fences)
    if is_overlap:
        why = replace(why, text=f"{text}; {COMMON_GROUND}", advice=COMMON_GROUND_ADVICE)
    return _NoWayError(why)


def _standing(forbidding: list[Barrier]) -> str:
    """Return where a point stands that is not allowed: inside which exclusions, outside which inclusions."""
    kinds = (("inside", ZoneKind.EXCLUSION), ("outside", ZoneKind.INCLUSION))
    found = [(word, [b.name for b in forbidding if b.kind is kind]) for word, kind in kinds]
    said = [f"{word} {_names(names)}" for word, names in found if names]
    return " and ".join(said) or "inside an exclusion or outside the fence"


def _names(names: list[str]) -> str:
    """Join names as a sentence does."""
    if len(names) < 2:
        return "".join(names) or "no fence in particular"
    return f"{', '.join(names[:-1])} and {names[-1]}"
