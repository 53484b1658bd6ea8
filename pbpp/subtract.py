"""Ground without obstacles: most obstacles of a map touch nothing, and become holes without an overlay.

An overlay goes over all edges of a map: it was a quarter of a build. Here only those obstacles are overlaid that cross each other or the edge of the ground.
Of houses whose common walls run between the same points the walls are dropped that occur twice.
"""

from __future__ import annotations

from cmath import phase, tau
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry import LinearRing, MultiPolygon, Polygon

from .geometry import polygons_only

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from .clearance import Geometries
    from .partition.vertices import Flags, Ints


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
    alone, together, touching = _grouped(parts[~shapely.is_empty(parts)])
    cut = np.concatenate((alone, together))
    shapely.prepare(ground)
    is_within = np.asarray(shapely.contains_properly(ground, cut), dtype=bool)
    across = np.concatenate((cut[~is_within], touching))
    if len(across):
        ground = shapely.difference(ground, MultiPolygon(across.tolist()))
    cut = cut[is_within]
    courts: list[Polygon] = []
    if shapely.get_num_interior_rings(cut).any():
        # What they enclose lies apart from all other ground.
        rings, owner = shapely.get_rings(cut, return_index=True)
        courts = shapely.polygons(rings[np.diff(owner, prepend=-1) == 0]).tolist()
    grounds = np.array([*polygons_only(ground), *courts, None], dtype=object)[:-1]
    return _with_holes(grounds, shapely.get_exterior_ring(cut))


def united(parts: Geometries) -> Geometries:
    """Return polygons that do not overlap in place of obstacles, as `subtracted` cuts them out: those that touch nothing stay as they are."""
    return np.concatenate(_grouped(parts))


def _grouped(parts: Geometries) -> tuple[Geometries, Geometries, Geometries]:
    """Return the obstacles that touch nothing, the unions of clusters that are one polygon, and the polygons of all others, which may touch one another."""
    none = parts[:0]
    if len(parts) == 1:
        return parts, none, none
    cluster, has_common_corners = _clusters(parts)
    is_alone = np.bincount(cluster, minlength=len(parts))[cluster] == 1
    alone = parts[is_alone]
    if is_alone.all():
        return alone, none, none
    is_tried = np.zeros(len(parts), dtype=bool)
    is_tried[cluster[has_common_corners]] = True
    is_tried = is_tried[cluster]
    found = _within_walls(parts[is_tried], cluster[is_tried])
    is_done = is_alone.copy()
    is_done[list(found)] = True
    others = parts[~is_done[cluster]]
    united = polygons_only(shapely.disjoint_subset_union_all(others)) if len(others) else []
    single = [polygons[0] for polygons in found.values() if len(polygons) == 1]
    several = [polygon for polygons in found.values() if len(polygons) > 1 for polygon in polygons]
    rest = np.array([*united, *several, None], dtype=object)[:-1]
    touches = np.zeros(len(rest), dtype=bool)
    one, other = shapely.STRtree(rest).query(rest, predicate="intersects")
    touches[one[one != other]] = True
    return alone, np.array([*single, *rest[~touches], None], dtype=object)[:-1], rest[touches]


def _clusters(parts: Geometries) -> tuple[Ints, Flags]:
    """Return for each obstacle the least number of those that it hangs together with, and whether it has a corner in common with another."""
    points, owner = shapely.get_coordinates(parts, return_index=True)
    places = points.view(np.complex128).ravel()
    order = np.argsort(places, kind="stable")
    same = np.flatnonzero(np.diff(places[order]) == 0)
    # Most neighbours have corners in common: only of the others it must be asked whether they meet.
    one, other = owner[order[same]], owner[order[same + 1]]
    cluster = _least(np.arange(len(parts)), one, other)
    has_common_corners = np.zeros(len(parts), dtype=bool)
    has_common_corners[one[one != other]] = True
    one, other = shapely.STRtree(parts).query(parts)
    is_asked = cluster[one] < cluster[other]
    one, other = one[is_asked], other[is_asked]
    meets = shapely.intersects(parts[one], parts[other])
    return _least(cluster, one[meets], other[meets]), has_common_corners


def _least(cluster: Ints, one: Ints, other: Ints) -> Ints:
    """Return clusters, each named after its least member, after some of their members have been joined."""
    while True:
        least = cluster.copy()
        joined = np.minimum(cluster[one], cluster[other])
        for members in (cluster[one], cluster[other]):
            np.minimum.at(least, members, joined)
        least = least[least[cluster]]
        if (least == cluster).all():
            return cluster
        cluster = least


def _within_walls(parts: Geometries, cluster: Ints) -> dict[int, list[Polygon]]:
    """Return the unions of those clusters that all walls bound which do not occur twice: houses with common walls between the same points."""
    if not len(parts):
        return {}
    rings, owner = shapely.get_rings(parts, return_index=True)
    is_turned = shapely.is_ccw(rings) != (np.diff(owner, prepend=-1) > 0)
    rings[is_turned] = shapely.reverse(rings[is_turned])
    points, ring = shapely.get_coordinates(rings, return_index=True)
    places, number = np.unique(points.view(np.complex128).ravel(), return_inverse=True)
    is_wall = (ring[1:] == ring[:-1]) & (number[1:] != number[:-1])  # a corner said twice is none
    start, end = number[:-1][is_wall], number[1:][is_wall]
    members = cluster[owner[ring[:-1][is_wall]]]
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, wall, count = np.unique(low * len(places) + high, return_inverse=True, return_counts=True)
    ways = np.bincount(wall, np.sign(end - start))
    is_odd = (count > 2) | ((count == 2) & (ways != 0.0))
    is_outer = (count[wall] == 1) & ~np.isin(members, members[is_odd[wall]])
    cluster_at = np.zeros(len(places), dtype=np.intp)
    cluster_at[start] = members
    loops = _loops(start[is_outer], end[is_outer], places.tolist())
    if not loops:
        return {}
    sizes = list(map(len, loops))
    corners = np.concatenate(loops)
    at = places[corners]
    outlines = np.asarray(
        shapely.linearrings(at.real, at.imag, indices=np.repeat(np.arange(len(loops)), sizes)), dtype=object
    )
    first = np.cumsum(sizes) - sizes
    return _assembled(outlines, cluster_at[corners[first]])


def _loops(start: Ints, end: Ints, places: Sequence[complex]) -> list[list[int]]:
    """Return the walls' loops, none of which comes to a point twice; where houses touch in a point, each has its own."""
    onwards = np.full(len(places), -1)
    onwards[start] = end
    forked = np.flatnonzero(np.bincount(start, minlength=len(places)) > 1)
    onwards[forked] = -1
    forks: dict[int, list[int]] = {place: [] for place in forked.tolist()}
    at_fork = np.isin(start, forked)
    for one, other in zip(start[at_fork].tolist(), end[at_fork].tolist(), strict=True):
        forks[one].append(other)
    ways = onwards.tolist()
    loops = [loop for fork in forks for loop in _loops_from(fork, forks, ways, places)]
    for first in range(len(ways)):
        loop = [first]
        while ways[loop[-1]] >= 0:
            here = loop[-1]
            loop.append(ways[here])
            ways[here] = -1
        if len(loop) > 1:
            loops.append(loop[:-1])
    return loops


def _loops_from(
    first: int, forks: dict[int, list[int]], ways: list[int], places: Sequence[complex]
) -> list[list[int]]:
    """Return the loops of the walls that lead on from a place where houses touch, and mark the ways that they take as gone."""
    loops = []
    path, at, before = [first], {first: 0}, first
    while forks[first] or len(path) > 1:
        here = path[-1]
        onwards = forks[here]
        if len(onwards) > 1 and before != here:
            back = places[before] - places[here]
            # The house lies to the left: on the way back from here its other wall comes first, clockwise.
            onwards.sort(key=lambda other: -(phase(back / (places[other] - places[here])) % tau))
        before, point = here, onwards.pop()
        while ways[point] >= 0:
            path.append(point)
            ways[point], before, point = -1, point, ways[point]
        since = at.get(point)  # only where houses touch a loop may come twice
        if since is None:
            at[point] = len(path)
            path.append(point)
            continue
        loops.append(path[since:])
        for passed in path[since + 1 :]:
            at.pop(passed, None)
        del path[since + 1 :]
    return loops


def _assembled(outlines: Geometries, cluster: Ints) -> dict[int, list[Polygon]]:
    """Return the polygons that loops bound, counter-clockwise about them and clockwise about their courts, of those clusters where they are valid."""
    is_shell = np.asarray(shapely.is_ccw(outlines), dtype=bool)
    shells = np.bincount(cluster, is_shell)
    is_lone = shells[cluster] == 1  # the shell of its cluster, or a court in it
    names, courts = cluster[is_shell & is_lone], cluster[~is_shell & is_lone]
    order = np.argsort(courts, kind="stable")
    number = np.bincount(courts, minlength=len(shells))
    first = np.cumsum(number) - number
    holes = np.full((len(names), int(number.max(initial=0))), None, dtype=object)
    rows = np.zeros(len(shells), dtype=np.intp)
    rows[names] = np.arange(len(names))
    courts = courts[order]
    holes[rows[courts], np.arange(len(courts)) - first[courts]] = outlines[~is_shell & is_lone][order]
    polygons = np.asarray(shapely.polygons(outlines[is_shell & is_lone], holes), dtype=object)
    is_valid = shapely.is_valid(polygons)
    valid = zip(names[is_valid].tolist(), polygons[is_valid].tolist(), strict=True)
    found = {name: [polygon] for name, polygon in valid}
    loops: dict[int, tuple[list[LinearRing], list[LinearRing]]] = {}
    for place in np.flatnonzero(shells[cluster] > 1).tolist():
        loops.setdefault(int(cluster[place]), ([], []))[not is_shell[place]].append(outlines[place])
    for name, (rings, within) in loops.items():
        several = _each(rings, within)
        if shapely.is_valid(MultiPolygon(several)):
            found[name] = several
    return found


def _each(shells: list[LinearRing], courts: list[LinearRing]) -> list[Polygon]:
    """Return the polygons of several shells; each court is within the smallest that holds it."""
    areas = sorted(map(Polygon, shells), key=lambda shell: float(shell.area))
    holes: list[list[LinearRing]] = [[] for _ in areas]
    for court in courts:
        inside = shapely.contains(np.array(areas, dtype=object), Polygon(court).representative_point())
        holes[int(inside.argmax())].append(court)
    return [Polygon(shell.exterior, rings) for shell, rings in zip(areas, holes, strict=True)]


def _with_holes(grounds: Geometries, holes: Geometries) -> BaseGeometry:
    """Return disjoint polygons with rings cut out that touch neither them nor one another; each ring lies in the smallest that holds it."""
    if not len(holes):
        return MultiPolygon(grounds.tolist())
    if len(grounds) == 1:
        return Polygon(grounds[0].exterior, [*grounds[0].interiors, *holes])
    points, owner = shapely.get_coordinates(holes, return_index=True)
    corners = np.asarray(shapely.points(points[np.diff(owner, prepend=-1) > 0]), dtype=object)
    around = np.zeros(len(holes), dtype=np.intp)
    ground, hole = shapely.STRtree(corners).query(grounds, predicate="contains")
    # From the largest to the smallest, the last one counts.
    order = np.argsort(-shapely.area(grounds[ground]), kind="stable")
    around[hole[order]] = ground[order]
    found = grounds.tolist()
    for number in np.unique(around).tolist():
        polygon = found[number]
        found[number] = Polygon(polygon.exterior, [*polygon.interiors, *holes[around == number]])
    return MultiPolygon(found)
