"""Free space: where the robot's centre may be.

The inclusions are intersected or united, shrunk by the clearance, and the grown exclusions are taken away. All of it happens about a
local origin, so that map coordinates of thousands of kilometres cost no precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry import GeometryCollection, MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from .clearance import Geometries, grow, shrink
from .errors import InvalidGeometryError
from .geometry import Floats, Point, Ring, parse_rings, polygons_only
from .subtract import subtracted

GeometryT = TypeVar("GeometryT", bound=BaseGeometry)

_OPEN_MARGIN_M = 100.0  # where no inclusion bounds the plane, so much room lies around all that is drawn; chosen, not measured: any would do
_TINY_EDGE_M = 2e-9  # twice the partition's tolerance: a shorter edge has no direction
_LEAST_RING = 4  # the coordinates of a triangle: the first one is repeated
_INSIDE_M = 1e-6  # an inclusion's edge lies inside the union from here on: far more than rounding; chosen, not measured
# Half a diagonal of the grids is what a vertex moves: 1.1e-8 and 1.4e-9 m. Powers of two, so that no coordinate is rounded again.
_GRID_M = 2.0**-26
_CLEAR_GRID_M = 2.0**-29


@dataclass(frozen=True)
class Scene:
    """The fence as given, valid and about a local origin.

    Parameters
    ----------
    inclusions, exclusions : (n,) array of shapely geometry
        Valid geometries, metres from ``origin_m``.
    union : bool
        True: free space lies in any inclusion. False: in all of them.
    origin_m : (2,) array
        East and north of the local origin in metres.
    """

    inclusions: Geometries
    exclusions: Geometries
    union: bool
    origin_m: Floats

    def to_local(self, point: Point) -> Point:
        """Return a point of the map, metres from the scene's origin."""
        return point[0] - float(self.origin_m[0]), point[1] - float(self.origin_m[1])

    def from_local(self, point: Point) -> Point:
        """Return a point given from the scene's origin as a point of the map."""
        return point[0] + float(self.origin_m[0]), point[1] + float(self.origin_m[1])

    def to_map(self, geometry: GeometryT) -> GeometryT:
        """Return a geometry given from the scene's origin as one of the map."""
        if not self.origin_m.any():
            return geometry
        return shapely.transform(geometry, lambda points: points + self.origin_m)

    def with_exclusion(self, ring: Ring) -> Scene:
        """Return the same fence with one exclusion more, as the last one."""
        part = parse_rings([ring], "exclusion")[0]
        if self.origin_m.any():
            part = shapely.transform(part, lambda points: points - self.origin_m)
        return replace(self, exclusions=np.append(self.exclusions, [part]))

    def without_exclusion(self, index: int) -> Scene:
        """Return the same fence without one of its exclusions."""
        return replace(self, exclusions=np.delete(self.exclusions, index))

    @cached_property
    def included(self) -> BaseGeometry | None:
        """What the inclusions leave at no clearance; None if there is no inclusion: the open plane."""
        if not len(self.inclusions):
            return None
        areas = np.array([MultiPolygon(polygons_only(one)) for one in self.inclusions], dtype=object)
        together = shapely.union_all(areas) if self.union else shapely.intersection_all(areas)
        return MultiPolygon(polygons_only(together))

    @cached_property
    def fence_lines(self) -> Geometries:
        """Boundary line of each part, (inclusions + exclusions,) array of shapely geometry."""
        inclusions = np.array([_line_of(part) for part in self.inclusions], dtype=object)
        if self.union and self.included is not None:
            # What lies inside the union bounds nothing.
            inclusions = shapely.difference(
                inclusions, shapely.buffer(self.included, -_INSIDE_M, join_style="mitre")
            )
        exclusions = np.array([_line_of(part) for part in self.exclusions], dtype=object)
        return np.concatenate((inclusions, exclusions))

    def part(self, index: int) -> tuple[str, int]:
        """Return what stands at a place of `fence_lines`: ("inclusion" or "exclusion", its index)."""
        count = len(self.inclusions)
        return ("inclusion", index) if index < count else ("exclusion", index - count)


@dataclass(frozen=True)
class FreeSpace:
    """Where the robot's centre may be, as disjoint polygons about the scene's origin.

    Parameters
    ----------
    polygons : tuple of shapely.Polygon
        One for each connected component, metres from the scene's origin.
    clearance_m : float
        The distance in metres that it keeps from the fence.
    grown : (n,) array of shapely geometry
        The area that each exclusion takes away.
    untidied : shapely geometry, optional
        The same before tiny edges were taken out, which may turn slivers inside out.
    """

    polygons: tuple[Polygon, ...]
    clearance_m: float
    grown: Geometries
    untidied: BaseGeometry | None = None

    @cached_property
    def geometry(self) -> MultiPolygon:
        """All components as one geometry."""
        return MultiPolygon(self.polygons)

    def components_at(self, point: Point, tolerance_m: float) -> frozenset[int]:
        """Return the components that a point lies in or within the tolerance of."""
        if not self.polygons:
            return frozenset()
        near = shapely.dwithin(np.array(self.polygons, dtype=object), shapely.Point(point), tolerance_m)
        return frozenset(np.flatnonzero(near).tolist())


def parse_scene(inclusions: Sequence[Ring], exclusions: Sequence[Ring], *, union: bool) -> Scene:
    """Return the fence made valid and moved to a local origin.

    Parameters
    ----------
    inclusions, exclusions : sequence of (n, 2) array-like or shapely polygon
        East and north in metres. No inclusion at all means the open plane.
    union : bool
        Whether free space lies in any inclusion or in all of them.

    Returns
    -------
    Scene
        The fence.

    Raises
    ------
    InvalidGeometryError
        If a ring cannot be used, or an inclusion that counts encloses no area.
    """
    parts = [parse_rings(inclusions, "inclusion"), parse_rings(exclusions, "exclusion")]
    for index, one in enumerate(parts[0]):
        if not polygons_only(one) and not (union and len(parts[0]) > 1):
            raise InvalidGeometryError(f"inclusion {index} encloses no area", ("inclusion", index))
    everything = np.array([*parts[0], *parts[1]], dtype=object)
    origin_m = np.zeros(2)
    if len(everything):
        bounds = shapely.total_bounds(everything)
        middle = 0.5 * (bounds[:2] + bounds[2:])
        # Near maps stay as they are: a shift would only add rounding. Whole metres keep far ones tidy.
        if np.abs(middle).max() > 4.0 * (bounds[2:] - bounds[:2]).max():
            origin_m = np.round(middle)
            everything = shapely.transform(everything, lambda points: points - origin_m)
    count = len(parts[0])
    return Scene(everything[:count], everything[count:], union, origin_m)


def build_free_space(
    scene: Scene,
    clearance_m: float,
    *,
    rounded: bool = False,
    reach: Sequence[Point] = (),
    grown: Geometries | None = None,
) -> FreeSpace:
    """Return where the robot's centre may be.

    Parameters
    ----------
    scene : Scene
        The fence.
    clearance_m : float
        Clearance in metres, at least 0.
    rounded : bool, default False
        Offset corners round in place of mitred: nearer to the truth, many more vertices.
    reach : sequence of (east, north)
        Without inclusions, points in metres from the scene's origin that the bounded part of the plane must hold.
    grown : (n,) array of shapely geometry, optional
        What `grow_exclusions` returns for this scene, if it is known already.

    Returns
    -------
    FreeSpace
        The polygons; none if nothing is free.
    """
    if grown is None:
        grown = grow_exclusions(scene, clearance_m, rounded=rounded)
    ground = _ground(scene, clearance_m, rounded=rounded, reach=reach)
    obstacles = list(grown)
    if clearance_m > 0.0:
        lines = np.array(loose_lines(scene.inclusions), dtype=object)
        obstacles += list(grow(lines, clearance_m, rounded=rounded)) if len(lines) else []
    free = subtracted(ground, obstacles) if obstacles else ground
    return _tidied(free, clearance_m, grown)


def tidied_rings(rings: Geometries) -> Geometries:
    """Return rings as those of free space are: without tiny edges, and none that encloses nothing."""
    tidy = np.asarray(shapely.remove_repeated_points(rings, _TINY_EDGE_M), dtype=object)
    return tidy[shapely.get_num_coordinates(tidy) >= _LEAST_RING]


def _tidied(free: BaseGeometry, clearance_m: float, grown: Geometries) -> FreeSpace:
    # Overlays leave vertices some 1e-10 m apart, which say nothing and make edges without direction.
    try:
        tidy = shapely.remove_repeated_points(free, _TINY_EDGE_M)
    except shapely.GEOSException:  # a hole no larger than that
        return snapped(FreeSpace((), clearance_m, grown, free))
    return FreeSpace(tuple(_without_flat_rings(polygons_only(tidy))), clearance_m, grown, free)


def _without_flat_rings(polygons: Sequence[Polygon]) -> list[Polygon]:
    """Return polygons without the rings that taking out repeated points has left with two points: they enclose nothing, and part nothing."""
    rings = shapely.get_rings(np.array(polygons, dtype=object))
    if not len(rings) or shapely.get_num_coordinates(rings).min() >= _LEAST_RING:
        return list(polygons)
    return [
        Polygon(one.exterior, [hole for hole in one.interiors if len(hole.coords) >= _LEAST_RING])
        for one in polygons
        if len(one.exterior.coords) >= _LEAST_RING
    ]


def snapped(free: FreeSpace) -> FreeSpace:
    """Return free space with its vertices on a grid: slivers vanish, and lines that cross within rounding meet in a vertex.

    Parameters
    ----------
    free : FreeSpace
        Polygons that nearly touch themselves.

    Returns
    -------
    FreeSpace
        The same to 1.1e-8 m; with a clearance to 1.4e-9 m, which its offsets have in reserve.

    Raises
    ------
    InvalidGeometryError
        If they cross themselves for good.
    """
    grid_m = _CLEAR_GRID_M if free.clearance_m > 0.0 else _GRID_M
    try:
        tidy = shapely.set_precision(free.geometry if free.untidied is None else free.untidied, grid_m)
    except shapely.GEOSException as error:
        raise InvalidGeometryError("the rings of free space do not fit together") from error
    if not shapely.is_valid(tidy):
        raise InvalidGeometryError("the rings of free space do not fit together")
    return replace(free, polygons=tuple(polygons_only(tidy)))


def grow_exclusions(scene: Scene, clearance_m: float, *, rounded: bool = False) -> Geometries:
    """Return the area that each exclusion keeps the robot's centre out of, (n,) array of polygons and multipolygons."""
    grown = scene.exclusions
    if clearance_m > 0.0 and len(grown):
        grown = grow(grown, clearance_m, rounded=rounded)
    areas = [one if isinstance(one, Polygon) else MultiPolygon(polygons_only(one)) for one in grown]
    return np.array(areas, dtype=object)


def loose_lines(inclusions: Geometries) -> list[BaseGeometry]:
    """Return the lines of self-crossing inclusions: a slit cut into one has no area, yet it is part of the fence."""
    parts = shapely.get_parts(
        inclusions[shapely.get_type_id(inclusions) == shapely.GeometryType.GEOMETRYCOLLECTION]
    )
    return list(parts[shapely.get_dimensions(parts) == 1])


def ground_box(scene: Scene) -> list[Point]:
    """Return the south-west and the north-east corner of the exclusions where nothing else bounds the plane; none without any, or within inclusions."""
    if len(scene.inclusions) or not len(scene.exclusions):
        return []
    west, south, east, north = shapely.total_bounds(scene.exclusions).tolist()
    return [(west, south), (east, north)]


def _ground(scene: Scene, clearance_m: float, *, rounded: bool, reach: Sequence[Point]) -> BaseGeometry:
    if scene.included is not None:
        return shrink(scene.included, clearance_m, rounded=rounded) if clearance_m > 0.0 else scene.included
    points = np.array([*reach, *ground_box(scene)]).reshape(-1, 2)
    if not len(points):
        points = np.zeros((1, 2))
    # A shortest path stays in the convex hull of its ends and of what it turns around.
    margin_m = _OPEN_MARGIN_M + 4.0 * clearance_m
    return box(*(points.min(axis=0) - margin_m), *(points.max(axis=0) + margin_m))


def _line_of(part: BaseGeometry) -> BaseGeometry:
    if isinstance(part, GeometryCollection):
        return shapely.union_all([_line_of(one) for one in part.geoms])
    return shapely.boundary(part) if isinstance(part, Polygon | MultiPolygon) else part
