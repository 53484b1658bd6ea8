"""The driven track, position by position in batches: its length, its shape for drawing, how near to the fence it came."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import shapely

from missions.fence import ZoneKind

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.ground.ground import Ground

MOVED_M: Final = 0.3
"""A vehicle has moved when it is so far from where it was last found to have moved to: less is its position's wandering."""

_JOINED_M, _JOINED_S = 20.0, 3.0
"""Positions farther apart are not joined by a line: between them something is missing."""

_MOST_POINTS: Final = 20_000  # of a track's parts; chosen, bounds memory and pictures


class TrackFix(NamedTuple):
    """A position as GLOBAL_POSITION_INT reports it.

    Parameters
    ----------
    time_s : float
        Since the log's begin.
    boot_s : float
        The vehicle's own time.
    position : LatLon
    speed_mps : float
    item : int
        MISSION_CURRENT then.
    heading_deg : float or None
        Clockwise from north.
    """

    time_s: float
    boot_s: float
    position: LatLon
    speed_mps: float
    item: int
    heading_deg: float | None


def pieces(fixes: list[TrackFix], points: NDArray[np.float64]) -> NDArray[np.object_]:
    """Return the track fix by fix as lines from the one before; as points at the first and where something is missing.

    Parameters
    ----------
    fixes : list of TrackFix
    points : ndarray of float, shape (n, 2)
        Their places in metres.
    """
    found = _as_points(points)
    if len(fixes) > 1:
        times_s = np.array([fix.time_s for fix in fixes])
        steps_m = np.hypot(*np.diff(points, axis=0).T)
        joined = (steps_m <= _JOINED_M) & (np.diff(times_s) <= _JOINED_S) & (steps_m > 0)
        ends = np.stack((points[:-1], points[1:]), axis=1)[joined]
        found[1:][joined] = shapely.linestrings(ends)
    return found


class FenceMeter:
    """Measures a track against a fence.

    Parameters
    ----------
    ground : Ground
        The fence laid out.
    """

    def __init__(self, ground: Ground) -> None:
        self.ground = ground
        has_inclusion = any(barrier.kind is ZoneKind.INCLUSION for barrier in ground.barriers)
        self._allowed: BaseGeometry | None = ground.allowed if has_inclusion else None
        self._kept_out: BaseGeometry = shapely.union_all(ground.areas(ZoneKind.EXCLUSION))
        shapely.prepare(self._kept_out)
        if self._allowed is not None:
            shapely.prepare(self._allowed)
        self._edges = shapely.STRtree(_segments(ground.edge))

    def measure(
        self, track: NDArray[np.object_], points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Measure pieces of a track.

        Parameters
        ----------
        track : ndarray of shapely geometries, shape (n,)
            Points, or lines that end in them.
        points : ndarray of float, shape (n, 2)
            In the ground's frame, metres.

        Returns
        -------
        clearances_m : ndarray of float, shape (n,)
            Of each piece to forbidden ground; 0 where it touches it, infinite where there is no fence.
        depths_m : ndarray of float, shape (n,)
            How far each point is inside forbidden ground; 0 where it is not.
        """
        forbidden = self._is_forbidden(points)
        clearances_m, depths_m = self._to_edge_m(track), np.zeros(len(points))
        clearances_m[forbidden] = 0.0
        depths_m[forbidden] = self._to_edge_m(_as_points(points[forbidden]))
        return clearances_m, depths_m

    def at_points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the clearances of points by themselves."""
        return self.measure(_as_points(points), points)[0]

    def zone_near(self, piece: BaseGeometry, point: NDArray[np.float64]) -> str:
        """Name the zone that forbids a point, else the one nearest to a piece of the track."""
        forbidding = self.ground.forbidding(shapely.Point(point))
        barrier = forbidding[0] if forbidding else self.ground.nearest(piece)[0]
        return barrier.name if barrier else "no fence"

    def _is_forbidden(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        x, y = points.T
        if self._allowed is None:
            inside: NDArray[np.bool_] = shapely.contains_xy(self._kept_out, x, y)
            return inside
        allowed: NDArray[np.bool_] = shapely.intersects_xy(self._allowed, x, y)
        return ~allowed

    def _to_edge_m(self, shapes: NDArray[np.object_]) -> NDArray[np.float64]:
        distances_m = np.full(len(shapes), math.inf)
        if len(self._edges) and len(shapes):
            (found, _), nearest_m = self._edges.query_nearest(shapes, return_distance=True, all_matches=False)
            distances_m[found] = nearest_m
        return distances_m


def _segments(edge: BaseGeometry) -> NDArray[np.object_]:
    """Cut lines into their segments."""
    parts = [np.asarray(part.coords) for part in shapely.get_parts(edge) if part.geom_type == "LineString"]
    pairs = [np.stack((part[:-1], part[1:]), axis=1) for part in parts if len(part) > 1]
    if not pairs:
        return np.empty(0, dtype=np.object_)
    return np.asarray(shapely.linestrings(np.concatenate(pairs)), dtype=np.object_)


def _as_points(points: NDArray[np.float64]) -> NDArray[np.object_]:
    return np.asarray(shapely.points(points), dtype=np.object_)


class Odometer:
    """Adds up how far a vehicle drove, and keeps a thinned track in parts: one a mode, and a new one where a drive begins.

    The parts hold `_MOST_POINTS` at the most: beyond, every other point goes and the spacing doubles.
    """

    def __init__(self) -> None:
        self.parts: list[tuple[str, float, list[LatLon]]] = []
        """Mode, time of the first position, positions."""
        self._begins_part = True
        self._last: tuple[float, float] | None = None
        self._count = 0
        self._spacing_m = MOVED_M
        self._kept: tuple[float, float] | None = None

    def begin_part(self) -> None:
        """Note that what follows is another drive."""
        self._begins_part = True

    def drive(self, mode: str, fixes: list[TrackFix], points: NDArray[np.float64]) -> float:
        """Take positions driven in a mode; return how far that was, in metres."""
        if self._begins_part or self.parts[-1][0] != mode:
            self._begins_part = False
            joint = self.parts[-1][2][-1:] if self.parts else []
            self.parts.append((mode, fixes[0].time_s, joint))
            self._kept = None
        kept = self.parts[-1][2]
        driven_m = 0.0
        for fix, (east_m, north_m) in zip(fixes, points.tolist(), strict=True):
            here = (east_m, north_m)
            step_m = MOVED_M if self._last is None else math.dist(self._last, here)
            if step_m < MOVED_M:
                continue
            driven_m += step_m if self._last is not None else 0.0
            self._last = here
            if self._kept is None or math.dist(self._kept, here) >= self._spacing_m:
                kept.append(fix.position)
                self._kept = here
                self._count += 1
        if self._count > _MOST_POINTS:
            self._thin()
        return driven_m

    def _thin(self) -> None:
        self.parts = [
            (mode, begun_s, [*positions[:-1:2], *positions[-1:]]) for mode, begun_s, positions in self.parts
        ]
        self._count = sum(len(positions) for _, _, positions in self.parts)
        self._spacing_m *= 2
