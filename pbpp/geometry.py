"""Rings and points as they come in, made into shapely geometries about a local origin.

A ring may be an (n, 2) array-like of east and north in metres, closed or not, or a shapely polygon. Self-crossing rings are read
on the safe side: an exclusion excludes everything its line encloses, an inclusion includes what an odd number of its windings
encloses. A ring without area is a wall, or a post, as soon as there is a clearance; without one paths may pass it.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import GeometryCollection, MultiPolygon, Polygon

from .errors import InvalidGeometryError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

Floats = npt.NDArray[np.float64]
Point = tuple[float, float]
Ring = npt.ArrayLike | Polygon | MultiPolygon


def circle_ring(
    center: Sequence[float], radius_m: float, *, outer: bool = True, segments: int = 32
) -> Floats:
    """Return a regular polygon about or within a circle.

    Parameters
    ----------
    center : sequence of float
        (east, north) in metres.
    radius_m : float
        Radius in metres.
    outer : bool, default True
        True: the polygon contains the circle (for an exclusion). False: the circle contains the polygon (for an inclusion).
    segments : int, default 32
        Number of corners.

    Returns
    -------
    (segments, 2) array
        East and north of the corners in metres, counter-clockwise.
    """
    angle_rad = (np.arange(segments) + 0.5) * (2.0 * np.pi / segments)
    # The factor beyond the secant keeps rounding from letting the circle poke out by a nanometre.
    reach_m = radius_m / np.cos(np.pi / segments) * (1.0 + 1e-12) if outer else radius_m
    east_m, north_m = center
    return np.column_stack((east_m + reach_m * np.cos(angle_rad), north_m + reach_m * np.sin(angle_rad)))


def parse_point(point: Sequence[float] | npt.ArrayLike, name: str) -> Point:
    """Return a point as two floats.

    Parameters
    ----------
    point : pair of float
        (east, north) in metres.
    name : str
        What the point is, for the error.

    Returns
    -------
    tuple of float
        (east, north) in metres.

    Raises
    ------
    InvalidGeometryError
        If it is not a pair of finite numbers.
    """
    # Pairs of floats, as most are: an array of two takes ten times as long.
    if isinstance(point, tuple | list) and len(point) == 2:
        east, north = point
        if isinstance(east, float) and isinstance(north, float) and isfinite(east) and isfinite(north):
            return float(east), float(north)
    try:
        array = np.asarray(point, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidGeometryError(f"the {name} is not a pair of numbers: {point!r}") from error
    if array.shape != (2,) or not np.isfinite(array).all():
        raise InvalidGeometryError(f"the {name} is not a pair of finite numbers: {point!r}")
    return float(array[0]), float(array[1])


def parse_points(points: npt.ArrayLike, name: str) -> Floats:
    """Return points as an (n, 2) array.

    Parameters
    ----------
    points : (n, 2) array-like
        East and north in metres.
    name : str
        What the points are, for the error.

    Returns
    -------
    (n, 2) array
        East and north in metres.

    Raises
    ------
    InvalidGeometryError
        If they are not pairs of finite numbers.
    """
    try:
        array = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidGeometryError(f"the {name} are not pairs of numbers") from error
    if array.size == 0:
        return array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise InvalidGeometryError(
            f"the {name} are not pairs of finite numbers: their shape is {array.shape}"
        )
    return array


def parse_rings(rings: Sequence[Ring], kind: str) -> list[BaseGeometry]:
    """Return one valid geometry for each ring.

    Parameters
    ----------
    rings : sequence of (n, 2) array-like or shapely polygon
        East and north in metres.
    kind : str
        ``"inclusion"`` or ``"exclusion"``: decides how a self-crossing ring is read, and names the ring in errors.

    Returns
    -------
    list of shapely geometry
        Valid polygons; for an invalid ring a collection of what it encloses and of its line; for a ring without area its line.

    Raises
    ------
    InvalidGeometryError
        If a ring has fewer than three points or a coordinate that is not a finite number.
    """
    found: list[BaseGeometry | None] = [None] * len(rings)
    arrays: list[Floats] = []
    places: list[int] = []
    for index, ring in enumerate(rings):
        if isinstance(ring, Polygon | MultiPolygon):
            if ring.is_empty or not np.isfinite(shapely.get_coordinates(ring)).all():
                raise InvalidGeometryError(f"{kind} {index} is empty or not finite", (kind, index))
            found[index] = shapely.force_2d(ring)
        else:
            arrays.append(_ring_array(ring, kind, index))
            places.append(index)
    if arrays:
        owner = np.repeat(np.arange(len(arrays)), [len(array) for array in arrays])
        points = np.concatenate(arrays)
        if not np.isfinite(points).all():
            index = places[owner[np.flatnonzero(~np.isfinite(points).all(axis=1))[0]]]
            raise InvalidGeometryError(
                f"{kind} {index} has a coordinate that is not a finite number", (kind, index)
            )
        polygons = np.asarray(shapely.polygons(shapely.linearrings(points, indices=owner)), dtype=object)
        for place, polygon in zip(places, polygons.tolist(), strict=True):
            found[place] = polygon
    parts: list[BaseGeometry] = [part for part in found if part is not None]
    for index in np.flatnonzero(~shapely.is_valid(parts)).tolist():
        parts[index] = _repaired(parts[index], kind)
    return parts


def polygons_only(geometry: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a geometry, leaving out lines, points and empty parts.

    Parameters
    ----------
    geometry : shapely geometry
        Any geometry.

    Returns
    -------
    list of shapely.Polygon
        Its polygons, in its order.
    """
    parts: list[Any] = [geometry]
    polygons: list[Polygon] = []
    while parts:
        part = parts.pop(0)
        if isinstance(part, Polygon):
            if part.area > 0.0:
                polygons.append(part)
        elif hasattr(part, "geoms"):
            parts[:0] = part.geoms
    return polygons


def _ring_array(ring: npt.ArrayLike, kind: str, index: int) -> Floats:
    try:
        array = np.asarray(ring, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidGeometryError(
            f"{kind} {index} is not a list of pairs of numbers", (kind, index)
        ) from error
    if array.ndim != 2 or array.shape[1] != 2 or len(array) < 3:
        raise InvalidGeometryError(
            f"{kind} {index} needs at least three (east, north) pairs, its shape is {array.shape}",
            (kind, index),
        )
    return array


def _repaired(geometry: BaseGeometry, kind: str) -> BaseGeometry:
    lines = shapely.union_all(shapely.boundary(polygons_with_rings(geometry)))
    if lines.is_empty:
        lines = shapely.Point(shapely.get_coordinates(geometry)[0])  # all of its points are one
    if kind == "inclusion":
        areas = polygons_only(shapely.make_valid(geometry, method="linework"))
    else:
        areas = [Polygon(face.exterior) for face in polygons_only(shapely.polygonize([lines]))]
    return GeometryCollection([shapely.union_all(areas), lines] if areas else [lines])


def polygons_with_rings(geometry: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a geometry, even those without area.

    Parameters
    ----------
    geometry : shapely geometry
        A polygon or multipolygon, valid or not.

    Returns
    -------
    list of shapely.Polygon
        Its polygons.
    """
    return [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon)]
