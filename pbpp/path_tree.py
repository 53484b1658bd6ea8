"""Shortest paths from anywhere to a few places: one search from each place, made once, then every question is answered by what it sees.

From a place the any-angle search is run without a goal until nothing is left in its queue: it knows then for every corner of free space that a
shortest path may turn at how far the place is. A path from a point goes straight to the place, or straight to one of the corners that the point sees
and from there as the search found it. What a point sees is found by the same search, stopped at its first turns. So a question costs the look around,
not a search, and the tree of a place costs one search of all there is.
"""

from __future__ import annotations

from functools import cached_property
from math import dist, inf
from typing import TYPE_CHECKING

import numpy as np

from .any_angle import Everywhere, Sight
from .errors import GoalBlockedError, InvalidGeometryError, StartBlockedError
from .geometry import Floats, parse_point, parse_points
from .partition.sweep import Sweep
from .planned_path import straightened

if TYPE_CHECKING:
    import numpy.typing as npt

    from .field import Field
    from .geometry import Point


class PathTree:
    """The shortest ways from anywhere in free space to a few places; made by `Planner.tree`.

    Parameters
    ----------
    field : Field
        Free space.
    places : (m, 2) array
        East and north in metres on the map.

    Attributes
    ----------
    holds : (m,) array of bool
        Which places lie in free space; no way leads to the others. Searches are made when the first way is asked for.
    """

    def __init__(self, field: Field, places: Floats) -> None:
        swept = field.slabs.swept
        if not isinstance(swept, Sweep):
            raise InvalidGeometryError("a tree needs a planner that is not compiled")
        self._field = field
        self._swept = swept
        self._places = [_placed(field, (east, north)) for east, north in places.tolist()]
        self._map = places
        self.holds = np.array([place is not None for place in self._places], dtype=bool)

    @cached_property
    def _trees(self) -> list[Everywhere | None]:
        slabs, swept = self._field.slabs, self._swept
        return [None if place is None else Everywhere(slabs, swept, place) for place in self._places]

    @cached_property
    def _corners_m(self) -> Floats:
        """How far each corner is from each place, a row a place."""
        corners_m = np.full((len(self._trees), len(self._field.slabs.vertices.points)), inf)
        for row, tree in enumerate(self._trees):
            if tree is not None:
                corners_m[row] = tree.corners_m()
        return corners_m

    def lengths(self, points: npt.ArrayLike) -> Floats:
        """Return how far it is from points to each place.

        Parameters
        ----------
        points : (n, 2) array-like
            East and north in metres.

        Returns
        -------
        (n, m) array
            Lengths in metres; infinite where there is no path, or an end lies outside free space.

        Raises
        ------
        InvalidGeometryError
            If a point is not a pair of finite numbers.
        """
        found = parse_points(points, "points")
        return np.array(
            [[length_m for length_m, _ in self._ways(point)] for point in found.tolist()]
        ).reshape(len(found), len(self._places))

    def path(self, point: npt.ArrayLike, place: int) -> Floats | None:
        """Return the shortest path from a point to a place.

        Parameters
        ----------
        point : pair of float
            (east, north) in metres.
        place : int
            Its number, from 0.

        Returns
        -------
        (n, 2) array or None
            The path's points, east and north in metres; None where there is no path.
        """
        start = parse_point(point, "point")
        length_m, corner = self._ways(start)[place]
        tree = self._trees[place]
        if length_m == inf or tree is None:
            return None
        turns = [] if corner < 0 else tree.turns_from(corner)
        inner = self._field.slabs.vertices.points[turns].reshape(-1, 2) + self._field.scene.origin_m
        return straightened(np.array([start, *inner, self._map[place]]))

    def _ways(self, point: Point) -> list[tuple[float, int]]:
        """Return for each place how far it is and by which corner first; -1 where the way is straight."""
        here = _placed(self._field, point)
        if here is None:
            return [(inf, -1)] * len(self._places)
        seen, away = Sight(self._field.slabs, self._swept, here).corners()
        corners, away_m = np.array(seen, dtype=np.intp), np.array(away)
        ways = []
        for place, rest_m in zip(self._places, self._corners_m, strict=True):
            if place is not None and Sight(self._field.slabs, self._swept, here, place).sees_goal():
                ways.append((dist(here, place), -1))
                continue
            whole_m = away_m + rest_m[corners]
            best = int(whole_m.argmin()) if len(whole_m) else -1
            ways.append((float(whole_m[best]), int(corners[best])) if best >= 0 else (inf, -1))
        return ways


def _placed(field: Field, point: Point) -> Point | None:
    """Return a point of the map as searches need it, metres from the scene's origin; None outside free space."""
    try:
        components = field.require(point, StartBlockedError)
    except (StartBlockedError, GoalBlockedError):
        return None
    return field.onto(field.scene.to_local(point), components)
