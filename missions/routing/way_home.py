"""Where home is nearest: one tree of shortest paths from each place, asked again and again.

A way home keeps what the drawn lines of a route have to keep, so that a route can be planned along it. A position that is nearer to a fence first goes
straight to the nearest ground that is not. Of places whose ways differ by less than a tenth in length the one that is driven to sooner is the nearest.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPoint, MultiPolygon, Point

import pbpp
from missions.drive_model import envelope
from missions.fence import ZoneKind
from missions.geo import LocalPoint, distance_m
from missions.ground.frame import frame_around
from missions.ground.from_situation import MAX_FIELD_M, route_ground
from missions.ground.known_fence import known_fence
from missions.routing.drawn_route import INSIDE_M
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.ground.ground import Ground
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_AS_LONG = 1.1
"""Ways that differ by less are told apart by the time that they take: corners cost more than a tenth of a short way."""


class PlaceKind(StrEnum):
    """What makes a place one to go home to."""

    HOME = "home"
    RALLY = "rally"
    GIVEN = "given"


@dataclass(frozen=True, slots=True)
class Place:
    """A place to go home to."""

    name: str
    kind: PlaceKind
    position: LatLon


@dataclass(frozen=True, slots=True)
class WayHome:
    """A way to a place.

    Parameters
    ----------
    place : Place
        Where it leads.
    length_m, time_s : float
        How long it is, and how long the drive is predicted to take.
    path : tuple of LatLon
        Its straight lines, from where it begins.
    """

    place: Place
    length_m: float
    time_s: float
    path: tuple[LatLon, ...]


@dataclass(frozen=True, eq=False)
class WaysHome:
    """The ways home of a field.

    Parameters
    ----------
    places : tuple of Place
        All that were named.
    blocked : mapping of str to str
        Why a place, by its name, can be reached from nowhere.
    clearance_m : float
        What the ways keep to the fence.
    """

    places: tuple[Place, ...]
    blocked: Mapping[str, str]
    clearance_m: float
    ground: Ground
    vehicle: Vehicle
    _free: MultiPolygon
    _tree: pbpp.PathTree
    _near: tuple[Place, ...]

    def nearest(self, position: LatLon) -> WayHome | None:
        """Return the way to the nearest place; None where none can be reached."""
        return next(self.in_order(position), None)

    def in_order(self, position: LatLon, *, may_escape: bool = False) -> Iterator[WayHome]:
        """Return the ways to all places that can be reached, the nearest first.

        Parameters
        ----------
        position : LatLon
            Where they begin.
        may_escape : bool
            Whether they may lead out of forbidden ground first, straight to the nearest free ground.
        """
        here = LocalPoint(*self.ground.frame.to_local(position))
        begin = self._free_start(here, may_escape=may_escape)
        if begin is None:
            return
        lengths_m = self._tree.lengths([begin])[0]
        least_m = float(lengths_m.min(initial=np.inf))
        near = lengths_m <= least_m * _AS_LONG
        alike = np.flatnonzero(near & np.isfinite(lengths_m)).tolist()
        rest = np.flatnonzero(~near & np.isfinite(lengths_m)).tolist()
        ways = (self._way(here, begin, number) for number in alike)
        yield from sorted(ways, key=lambda way: (way.time_s, way.length_m))
        for number in sorted(rest, key=lambda number: float(lengths_m[number])):
            yield self._way(here, begin, number)

    def is_allowed(self, position: LatLon) -> bool:
        """Return whether the fence allows a position."""
        return bool(self.ground.allowed.covers(Point(self.ground.frame.to_local(position))))

    def reaches(self, position: LatLon) -> bool:
        """Return whether any place can be reached from a position."""
        begin = self._free_start(LocalPoint(*self.ground.frame.to_local(position)))
        return begin is not None and bool(self._reached.covers(Point(begin)))

    @cached_property
    def _inner(self) -> BaseGeometry:
        """Free ground without its edge."""
        inner = self._free.buffer(-INSIDE_M)
        return self._free if inner.is_empty else inner

    @cached_property
    def _reached(self) -> BaseGeometry:
        """The parts of free ground on which a place stands: only from there a way leads to one."""
        open_places = [place.position for place in self._near if place.name not in self.blocked]
        stand = MultiPoint(self.ground.frame.to_local_array(open_places))
        reached = MultiPolygon([part for part in self._free.geoms if part.dwithin(stand, INSIDE_M)])
        shapely.prepare(reached)
        return reached

    def _way(self, here: LocalPoint, begin: LocalPoint, number: int) -> WayHome:
        found = self._tree.path(begin, number)
        assert found is not None
        points = found if begin == here else np.vstack([here, found])
        points = points[np.r_[True, np.hypot(*np.diff(points, axis=0).T) > 0]]
        length_m = float(np.hypot(*np.diff(points, axis=0).T).sum())
        path = tuple(self.ground.frame.to_lat_lon(LocalPoint(*point)) for point in points.tolist())
        return WayHome(self._near[number], length_m, self._time_s(points), path)

    def _time_s(self, points: NDArray[np.float64]) -> float:
        if len(points) < 2:
            return 0.0
        east, north = points[1] - points[0]
        heading_deg = float(np.degrees(np.arctan2(east, north)))
        legs: list[float | None] = [None] * (len(points) - 1)
        return envelope(points, self.vehicle, heading_deg=heading_deg, speeds=legs, stops={}).duration_s

    def _free_start(self, here: LocalPoint, *, may_escape: bool = False) -> LocalPoint | None:
        """Return where free ground begins, straight from a position; None on forbidden ground that it may not escape from."""
        point = Point(here)
        if self._free.covers(point):
            return here
        is_outside = not self.ground.allowed.covers(point)
        if self._free.is_empty or (is_outside and not may_escape):
            return None
        line = shapely.shortest_line(point, self._inner)
        if not is_outside and not self.ground.allowed.covers(line):
            return None
        east, north = shapely.get_coordinates(line)[-1].tolist()
        return LocalPoint(east, north)


def places_of(situation: Situation, given: Mapping[str, LatLon]) -> tuple[Place, ...]:
    """Return the places that a situation and its owner name: home, rally points in their order, given ones."""
    home = [Place("home", PlaceKind.HOME, situation.home.value)] if situation.home is not None else []
    points = situation.rally.value if situation.rally is not None else ()
    rally = [
        Place(f"rally point {number}", PlaceKind.RALLY, point.position)
        for number, point in enumerate(points, 1)
    ]
    return (*home, *rally, *(Place(name, PlaceKind.GIVEN, position) for name, position in given.items()))


def ways_home(
    situation: Situation,
    vehicle: Vehicle,
    clearance_m: float,
    places: Sequence[Place],
    around: Sequence[LatLon],
) -> WaysHome:
    """Search the ways home of a field.

    Parameters
    ----------
    situation : Situation
        The fence, and home where a circle about it counts.
    vehicle : Vehicle
        What drives.
    clearance_m : float
        What drawn lines keep to the fence, as `Plan.asked_m`.
    places : sequence of Place
        Where ways may lead.
    around : sequence of LatLon
        Where they may begin; the ground is laid out about all of them.

    Raises
    ------
    MissionError
        As `missions.planning.plan.plan`, of the fence and the vehicle.
    """
    centre = frame_around(known_fence(situation).places).origin
    near = tuple(place for place in places if distance_m(centre, place.position) <= MAX_FIELD_M)
    ground = route_ground(situation, vehicle, (*around, *(place.position for place in near)))
    inclusions, exclusions = (ground.areas(kind) for kind in (ZoneKind.INCLUSION, ZoneKind.EXCLUSION))
    planner = pbpp.Planner(inclusions, exclusions, clearance_m=clearance_m, union=ground.union)
    points = ground.frame.to_local_array([place.position for place in near])
    tree = planner.tree(points, around=ground.frame.to_local_array(around))
    blocked = {place.name: "it is too far from the fence" for place in places if place not in near}
    for place, holds in zip(near, tree.holds, strict=True):
        if not holds:
            blocked[place.name] = _why_blocked(ground, place, clearance_m)
    shapely.prepare([planner.free_space, ground.allowed])
    return WaysHome(tuple(places), blocked, clearance_m, ground, vehicle, planner.free_space, tree, near)


def _why_blocked(ground: Ground, place: Place, clearance_m: float) -> str:
    """Return why no way leads to a place."""
    point = Point(ground.frame.to_local(place.position))
    if not ground.allowed.covers(point):
        names = [
            f"{'inside' if one.kind is ZoneKind.EXCLUSION else 'outside'} {one.name}"
            for one in ground.forbidding(point)
        ]
        return f"it is {' and '.join(names or ['outside the allowed area'])}"
    barrier, away_m = ground.nearest(point)
    if away_m >= clearance_m and barrier is not None:
        return f"it is too close to a sharp corner of {barrier.name}, around which ways home keep more than {metres(clearance_m)}"
    return f"it is {metres(away_m)} from {barrier.name if barrier else 'a fence'}, and a way home keeps {metres(clearance_m)}"
