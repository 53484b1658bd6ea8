"""Free space changed by one obstacle: most obstacles lie within it as holes, alone or in a cluster, and one more or one less changes these holes only.

Where more than that changes (an obstacle at the edge, one that parts free space, one within an island), this says so, and free space is made anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry import MultiLineString

from .free_space import FreeSpace, tidied_rings
from .subtract import united

if TYPE_CHECKING:
    from .clearance import Geometries
    from .geometry import Floats
    from .partition.vertices import Flags, Ints


@dataclass(frozen=True)
class Change:
    """What one obstacle more or less changes.

    Parameters
    ----------
    holes : Holes
        Free space then.
    gone : (k,) array of int
        The vertices that are no more.
    rings : list of (n, 2) array
        The holes that are new, clockwise, the first point not repeated.
    owner : int
        The polygon that they are in.
    """

    holes: Holes
    gone: Ints
    rings: list[Floats]
    owner: int


@dataclass(frozen=True)
class Holes:
    """The holes of free space.

    Parameters
    ----------
    free : FreeSpace
        Free space.
    shells : (p,) array of shapely.Polygon
        What the outer ring of each of its polygons encloses.
    edges : shapely.MultiLineString
        These rings.
    rings : (h,) array of shapely.LinearRing
        The holes.
    holes : (h,) array of shapely.Polygon
        What each encloses.
    bounds : (h, 4) array
        West, south, east and north of each.
    owner : (h,) array of int
        The polygon that each is in.
    has_island : (h,) array of bool
        Whether another polygon of free space lies in it.
    first, size : (h,) array of int
        Which vertices of free space are its own.
    vertices : int
        How many numbers of vertices there are.
    """

    free: FreeSpace
    shells: Geometries
    edges: MultiLineString
    rings: Geometries
    holes: Geometries
    bounds: Floats
    owner: Ints
    has_island: Flags
    first: Ints
    size: Ints
    vertices: int

    @classmethod
    def of(cls, free: FreeSpace) -> Holes:
        """Return the holes of a free space, its vertices numbered as `pbpp.partition.vertices` numbers them."""
        rings, owner = shapely.get_rings(np.array(free.polygons, dtype=object), return_index=True)
        is_shell = np.diff(owner, prepend=-1) > 0
        sizes = shapely.get_num_coordinates(rings).astype(np.intp) - 1
        first = np.cumsum(sizes) - sizes
        shells, holes = (
            np.asarray(shapely.polygons(rings[which]), dtype=object) for which in (is_shell, ~is_shell)
        )
        shapely.prepare(shells)
        edges = MultiLineString(rings[is_shell].tolist())
        shapely.prepare(edges)
        has_island = np.zeros(len(holes), dtype=bool)
        if len(shells) > 1:
            corners = shapely.points(shapely.get_coordinates(rings)[first[is_shell]])
            has_island[shapely.STRtree(holes).query(corners, predicate="intersects")[1]] = True
        return cls(
            free=free,
            shells=shells,
            edges=edges,
            rings=rings[~is_shell],
            holes=holes,
            bounds=shapely.bounds(holes),
            owner=owner[~is_shell],
            has_island=has_island,
            first=first[~is_shell],
            size=sizes[~is_shell],
            vertices=int(sizes.sum()),
        )

    def with_obstacle(self, added: Geometries) -> Change | None:
        """Return what a grown exclusion changes that becomes the last one; None if more than holes."""
        return self._changed(
            np.append(self.free.grown, added), shapely.get_parts(added), shapely.get_parts(added)
        )

    def without_obstacle(self, index: int) -> Change | None:
        """Return what changes without a grown exclusion; None if more than holes."""
        gone = shapely.get_parts(self.free.grown[index : index + 1])
        change = self._changed(np.delete(self.free.grown, index), gone, gone[:0])
        return change if change is not None and len(change.gone) else None

    def _changed(self, grown: Geometries, there: Geometries, added: Geometries) -> Change | None:
        """Return what changes where some parts of obstacles were or shall be: then there stand those of the grown exclusions, and what is added."""
        if not len(there) or shapely.is_empty(there).any() or shapely.intersects(self.edges, there).any():
            return None
        around = np.flatnonzero(shapely.contains_properly(self.shells[:, np.newaxis], there).all(axis=1))
        touched = _meeting(there, self.holes, self.bounds)
        if len(around) != 1 or self.has_island[touched].any() or (self.owner[touched] != around[0]).any():
            return None
        if len(touched):
            parts = shapely.get_parts(grown)
            added = parts[_meeting(np.append(self.holes[touched], added), parts, shapely.bounds(parts))]
        try:
            holes = united(added) if len(added) else added
            if shapely.get_num_interior_rings(holes).any():
                return None
            rings = tidied_rings(shapely.get_exterior_ring(holes))
        except shapely.GEOSException:
            return None
        return self._with_rings(grown, touched, rings, int(around[0]))

    def _with_rings(self, grown: Geometries, touched: Ints, rings: Geometries, owner: int) -> Change:
        sizes = shapely.get_num_coordinates(rings) - 1
        kept = np.ones(len(self.holes), dtype=bool)
        kept[touched] = False
        first = self.vertices + np.cumsum(sizes) - sizes
        new = np.asarray(shapely.polygons(rings), dtype=object)
        holes = replace(
            self,
            rings=np.append(self.rings[kept], rings),
            holes=np.append(self.holes[kept], new),
            bounds=np.concatenate((self.bounds[kept], shapely.bounds(new))),
            owner=np.append(self.owner[kept], np.full(len(rings), owner)),
            has_island=np.append(self.has_island[kept], np.zeros(len(rings), dtype=bool)),
            first=np.append(self.first[kept], first),
            size=np.append(self.size[kept], sizes),
            vertices=self.vertices + int(sizes.sum()),
        )
        within = holes.rings[holes.owner == owner]
        polygons = list(self.free.polygons)
        polygons[owner] = shapely.polygons(shapely.get_exterior_ring(self.shells[owner]), within)
        free = replace(self.free, polygons=tuple(polygons), grown=grown, untidied=None)
        numbers = [np.arange(self.first[one], self.first[one] + self.size[one]) for one in touched.tolist()]
        points = [shapely.get_coordinates(ring)[:-1] for ring in rings]
        clockwise = [
            ring[::-1] if is_ccw else ring for ring, is_ccw in zip(points, shapely.is_ccw(rings), strict=True)
        ]
        return Change(
            replace(holes, free=free),
            np.concatenate([np.empty(0, dtype=np.intp), *numbers]),
            clockwise,
            owner,
        )


def _meeting(some: Geometries, others: Geometries, bounds: Floats) -> Ints:
    """Return the places of those of many geometries, with their bounds, that meet any of a few."""
    west, south, east, north = bounds.T
    meets = np.zeros(len(others), dtype=bool)
    for one, (one_west, one_south, one_east, one_north) in zip(
        some, shapely.bounds(some).tolist(), strict=True
    ):
        near = (west <= one_east) & (east >= one_west) & (south <= one_north) & (north >= one_south)
        meets[near] |= shapely.intersects(others[near], one)
    return np.flatnonzero(meets)
