"""What every picture shows, in local metres, east then north: the same for images and the terminal."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from missions.fence import ZoneKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.ground.ground import Barrier, Ground

_BORDER_SHARE = 0.06  # white around the drawing
_SCALE_STEPS_M = tuple(step * 10**power for power in range(5) for step in (1, 2, 5))
_MOST_SECTIONS = 400  # across the route, to find its narrowest place; chosen: a picture shows no more
_NARROW_SHARE = 0.25  # of the picture: what is wider is no narrow place
_AWAY_M = 1e-3  # a ray across begins so far from the fence that it starts at


def no_points() -> NDArray[np.float64]:
    """Return an empty array of points, (0, 2)."""
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class TrackLine:
    """A driven line: its name in the legend, and its points (n, 2)."""

    name: str
    points: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mark:
    """A place that a person must not miss, with its name; empty where the legend says enough."""

    point: NDArray[np.float64]
    name: str = ""


@dataclass(frozen=True, eq=False)
class NarrowSection:
    """Where the fences on both sides of a route are nearest to each other: two points on them, and how wide it is."""

    ends: NDArray[np.float64]
    width_m: float


@dataclass(frozen=True, eq=False, kw_only=True)
class PictureScene:
    """What a picture shows.

    Parameters
    ----------
    title : tuple of str
        The lines above the picture.
    ground : Ground
        The fence.
    zone_count : int
        How many of the ground's barriers are shown whole: the fence's own. The home circle, which may be vast, is seen as far as it
        reaches into the picture.
    clearance_m : float
        The clearance that the route promises, or its drawn lines keep where it promises none; 0 draws none.
    route_name : str
        What the legend calls the drawn lines.
    route : ndarray of float, shape (n, 2)
        The drawn lines.
    point_texts : tuple of str
        What is known of each point of the route, a line each.
    numbers : tuple of int or None
        The mission item of each point of the route; None where it is none, as at the start.
    unsafe_legs : tuple of int
        The legs that are not safe to drive, counted from 0.
    marks_name : str
        What the legend calls the marks.
    marks : tuple of Mark
        Where the fence is crossed, or what else must not be missed.
    band : shapely geometry
        The predicted corridor.
    start : ndarray of float, shape (2,), or None
    targets, asked : ndarray of float, shape (t, 2)
        Where the route leads to, and what was asked for where that is somewhere else: as many rows, NaN where it is the same.
    tracks : tuple of TrackLine
        What was driven.
    blocks : tuple of ndarray
        Corners of the blocks of the free space.
    marks_narrowest : bool
        Whether the narrowest place of the route is marked.
    """

    title: tuple[str, ...]
    ground: Ground
    zone_count: int
    clearance_m: float = 0.0
    route_name: str = "route"
    route: NDArray[np.float64] = field(default_factory=no_points)
    point_texts: tuple[str, ...] = ()
    numbers: tuple[int | None, ...] = ()
    unsafe_legs: tuple[int, ...] = ()
    marks_name: str = "crossed or too near"
    marks: tuple[Mark, ...] = ()
    band: BaseGeometry = field(default_factory=Polygon)
    start: NDArray[np.float64] | None = None
    targets: NDArray[np.float64] = field(default_factory=no_points)
    asked: NDArray[np.float64] = field(default_factory=no_points)
    tracks: tuple[TrackLine, ...] = ()
    blocks: tuple[NDArray[np.float64], ...] = ()
    marks_narrowest: bool = False

    @cached_property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """West, south, east, north: the fence's zones and the lines, with a border."""
        shapes = [zone.area.envelope for zone in self.ground.barriers[: self.zone_count]]
        start = no_points() if self.start is None else self.start[None]
        places = np.concatenate(
            (self.route, self.targets, self.asked, start, *(track.points for track in self.tracks))
        )
        points = shapely.MultiPoint(places[~np.isnan(places).any(axis=1)])
        west, south, east, north = shapely.union_all([*shapes, points]).bounds
        border_m = max(1.0, _BORDER_SHARE * max(east - west, north - south))
        return west - border_m, south - border_m, east + border_m, north + border_m

    @cached_property
    def frame(self) -> Polygon:
        """The picture's rectangle."""
        return shapely.box(*self.bounds_m)

    @property
    def outside(self) -> BaseGeometry:
        """What lies outside the inclusions."""
        return self.frame.difference(self.ground.keep_in)

    @property
    def has_inclusion(self) -> bool:
        """Whether the fence keeps the vehicle in."""
        return any(zone.kind is ZoneKind.INCLUSION for zone in self.ground.barriers)

    @property
    def inner_edges(self) -> BaseGeometry:
        """The edges of inclusions that are no edge of what is allowed: inside the union, or beyond another inclusion."""
        edges = [zone.area.boundary for zone in self.ground.barriers if zone.kind is ZoneKind.INCLUSION]
        kept = self.ground.keep_in.boundary.buffer(0.01)
        return shapely.union_all(edges).difference(kept).intersection(self.frame)

    @property
    def kept_off(self) -> BaseGeometry:
        """The allowed ground within the clearance of a fence."""
        if not (math.isfinite(self.clearance_m) and self.clearance_m > 0):
            return Polygon()
        return self.ground.edge.buffer(self.clearance_m).intersection(self.ground.allowed)

    @property
    def exclusions(self) -> BaseGeometry:
        """The ground that is kept out of."""
        return shapely.union_all(self.ground.areas(ZoneKind.EXCLUSION))

    @property
    def named_zones(self) -> Iterator[tuple[Barrier, BaseGeometry]]:
        """The zones whose names belong into the picture, each with what is seen of it: exclusions, and inclusions where there are several.

        An inclusion whose edge is not in the picture has no name in it.
        """
        zones = self.ground.barriers
        inclusions = [zone for zone in zones if zone.kind is ZoneKind.INCLUSION]
        for zone in zones:
            seen = zone.area.intersection(self.frame)
            if zone.kind is ZoneKind.INCLUSION:
                if len(inclusions) == 1 or not zone.area.boundary.intersects(self.frame):
                    continue
                seen = seen.difference(
                    shapely.union_all([other.area for other in zones if other is not zone])
                )
            if not seen.is_empty:
                yield zone, seen

    @property
    def waypoints(self) -> list[tuple[int, NDArray[np.float64], str]]:
        """The waypoints of the route: number, place, and what is known of each."""
        points = zip(self.numbers, self.route, self.point_texts, strict=True)
        return [(number, point, text) for number, point, text in points if number is not None]

    @property
    def legs(self) -> list[LineString]:
        """The drawn lines, leg by leg."""
        return [LineString(leg) for leg in zip(self.route[:-1], self.route[1:], strict=True)]

    @cached_property
    def narrowest(self) -> NarrowSection | None:
        """The narrowest place of the route; None without a fence on both sides, or where it is wide.

        Sections are laid across the route through the fence that is nearest, up to the fence on the other side.
        """
        if not self.marks_narrowest or self.unsafe_legs or self.ground.edge.is_empty:
            return None
        edge, line = self.ground.edge, LineString(self.route)
        reach_m = _NARROW_SHARE * (self.bounds_m[2] - self.bounds_m[0])
        count = min(_MOST_SECTIONS, math.ceil(line.length / 0.1) + 1)
        steps = shapely.line_interpolate_point(line, np.linspace(0, line.length, count))
        along = shapely.points(np.concatenate((shapely.get_coordinates(steps), self.route)))
        near = shapely.get_coordinates(shapely.shortest_line(along, edge)).reshape(-1, 2, 2)
        found: NarrowSection | None = None
        for place, fence in near:
            distance_m = math.dist(place, fence)
            if not _AWAY_M < distance_m < (found.width_m if found else reach_m):
                continue
            across = (place - fence) / distance_m
            ray = LineString(
                (fence + across * _AWAY_M, fence + across * (found.width_m if found else reach_m))
            )
            hit = ray.intersection(edge)
            if hit.is_empty:
                continue
            width_m = float(Point(fence).distance(hit))
            if width_m > distance_m:  # the fence on the other side of the route
                found = NarrowSection(np.array((fence, fence + across * width_m)), width_m)
        return found

    def scale_m(self, share: float = 0.2) -> int:
        """Return a round length of at most a share of the picture's width."""
        width_m = self.bounds_m[2] - self.bounds_m[0]
        return max((step for step in _SCALE_STEPS_M if step <= share * width_m), default=1)

    def target_sign(self, number: int) -> str:
        """Return the sign of a target, counted from 0."""
        return f"T{number + 1}" if len(self.targets) > 1 else "T"


def crossings(
    legs: list[LineString], unsafe: tuple[int, ...], allowed: BaseGeometry
) -> list[NDArray[np.float64]]:
    """Return where unsafe legs cross the fence, in or out."""
    found: list[NDArray[np.float64]] = []
    for number in unsafe:
        for part in shapely.get_parts(legs[number].difference(allowed)):
            ends = shapely.get_coordinates(part)[[0, -1]]
            own = shapely.get_coordinates(legs[number])
            found += [end for end in ends if np.hypot(*(own - end).T).min() > _AWAY_M]
    return found


def arrow_place(
    a: NDArray[np.float64], b: NDArray[np.float64], marks: Sequence[NDArray[np.float64]], away_m: float
) -> NDArray[np.float64]:
    """Return the place of a leg's arrow: its middle, or beside it where a mark would cover it."""
    places = [a + share * (b - a) for share in (0.5, 0.4, 0.6, 0.3, 0.7)]
    return next(
        (place for place in places if all(math.dist(place, mark) > away_m for mark in marks)), places[0]
    )


def polygons(area: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a geometry, outer rings counter-clockwise and holes clockwise."""
    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and not part.is_empty]
    return list(shapely.orient_polygons(parts)) if parts else []
