"""Ground without obstacles: most obstacles of a map touch nothing, and become holes without an overlay.

An overlay goes over all edges of a map: it was a quarter of a build. Here only those obstacles are overlaid that cross each other or the edge of the ground.
Of houses whose common walls run between the same points the walls are dropped that occur twice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from .geometry import polygons_only

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from .clearance import Geometries
    from .partition.vertices import Ints

__all__ = ["subtracted", "united"]

_MISSES = 4  # clusters that are not houses, beyond those that are: then no more of them are tried. A try costs a third of a union
_AREA_SLACK = 1e-12  # so small a share of houses that lies in two of them is rounding; chosen, not measured


def subtracted(ground: BaseGeometry, obstacles: Sequence[BaseGeometry]) -> BaseGeometry:
    """Return ground without obstacles.

    Parameters
    ----------
    ground : shapely geometry
        A polygon or multipolygon.
    obstacles : sequence of shapely geometry
        Valid polygons and multipolygons; they may overlap.

    Returns
    -------
    shapely geometry
        The area that `shapely.difference` leaves; the vertices of obstacles that touch nothing stay as they are.
    """
    parts = shapely.get_parts(obstacles)
    parts = parts[~shapely.is_empty(parts)]
    cluster = _clusters(parts)
    apart = np.bincount(cluster, minlength=len(parts))[cluster] == 1
    shapely.prepare(ground)
    apart &= shapely.contains_properly(ground, parts) & (shapely.get_num_interior_rings(parts) == 0)
    if not apart.all():
        ground = shapely.difference(ground, _united(parts[~apart], cluster[~apart]))
    return _with_holes(np.array(polygons_only(ground), dtype=object), shapely.get_exterior_ring(parts[apart]))


def united(parts: Geometries) -> Geometries:
    """Return polygons that touch nothing but themselves in place of obstacles, as `subtracted` cuts them out: those that touch nothing stay as they are."""
    cluster = _clusters(parts)
    apart = np.bincount(cluster, minlength=len(parts))[cluster] == 1
    if apart.all():
        return parts
    return np.append(
        parts[apart], np.array(polygons_only(_united(parts[~apart], cluster[~apart])), dtype=object)
    )


def _clusters(parts: Geometries) -> Ints:
    """Return for each obstacle the least number of those that it hangs together with."""
    one, other = shapely.STRtree(parts).query(parts, predicate="intersects")
    cluster = np.arange(len(parts))
    while True:
        least = cluster.copy()
        np.minimum.at(least, one, cluster[other])
        least = least[least]
        if (least == cluster).all():
            return cluster
        cluster = least


def _united(parts: Geometries, cluster: Ints) -> BaseGeometry:
    """Return the union of obstacles, clusters of houses by their outer walls."""
    parts = parts[np.argsort(cluster, kind="stable")]
    together: list[Polygon] = []
    others: list[BaseGeometry] = []
    misses = 0
    for members in np.split(parts, np.flatnonzero(np.diff(np.sort(cluster))) + 1):
        outer = _within_walls(members) if misses < _MISSES else None
        misses += 1 if outer is None else -1
        if outer is None:
            others += members.tolist()
        else:
            together += polygons_only(outer)
    together += polygons_only(shapely.disjoint_subset_union_all(others))
    return MultiPolygon(together)


def _within_walls(parts: Geometries) -> BaseGeometry | None:
    """Return the union of houses as all walls that do not occur twice bound it; None if it is not that."""
    try:
        together: BaseGeometry = shapely.coverage_union_all(parts)
    except shapely.GEOSException:  # walls between other points
        return None
    # What lies in two of them would be missing, in three there again: then the area tells.
    area_m2 = float(shapely.area(parts).sum())
    if shapely.is_valid(together) and abs(together.area - area_m2) <= _AREA_SLACK * area_m2:
        return together
    return None


def _with_holes(grounds: Geometries, holes: Geometries) -> BaseGeometry:
    """Return disjoint polygons with rings cut out that touch neither them nor one another."""
    if not len(holes):
        return MultiPolygon(grounds.tolist())
    if len(grounds) == 1:
        return Polygon(grounds[0].exterior, [*grounds[0].interiors, *holes])
    points, owner = shapely.get_coordinates(holes, return_index=True)
    corners = np.asarray(shapely.points(points[np.diff(owner, prepend=-1) > 0]), dtype=object)
    around = np.zeros(len(holes), dtype=np.intp)
    ground, hole = shapely.STRtree(corners).query(grounds, predicate="contains")
    around[hole] = ground
    found = grounds.tolist()
    for number in np.unique(around).tolist():
        polygon = found[number]
        found[number] = Polygon(polygon.exterior, [*polygon.interiors, *holes[around == number]])
    return MultiPolygon(found)
