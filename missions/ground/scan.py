"""What a distance sensor sees around the vehicle: from distances by direction to discs in the plane.

A disc is as deep as it is wide: of what stands there only the near side is seen. Each direction's distance stands for the whole sector around it, so a
disc is drawn rather too wide than too narrow (of 700 round things 2 to 13 m away, seen in sectors of 5°, none stood out of its disc by more than 0.16 m; of a wall 0.44 m; where the discs of sectors wider than 5°, or of a ring, meet, a point stood out by up to 1.05 m). What lies on the fence's own edges or beyond is left out: there no route leads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from missions.geo import LocalPoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from missions.ground.ground import Ground

EDGE_M = 0.5
"""So near to the fence's edge, and half a sector's width, nothing counts: it may be what the fence was drawn along. Chosen."""

_GAP_M = 1.0  # neighbouring directions whose points are farther apart see different things; chosen
_WIDEST_M = 4.0  # what is wider is several discs in a row: one would stand far into free ground; chosen
_LEAST_RADIUS_M = 0.3  # of a disc: a post; chosen
_MOST_RADIUS_M = 4.0  # of what stands at the sensor itself; chosen
_FINE = math.radians(15.0)  # sectors are cut so fine, for discs that are about as wide as each other; chosen
_STEEPEST = math.radians(60.0)  # half of the widest angle that a disc is drawn into; chosen


@dataclass(frozen=True)
class RangeScan:
    """Distances by direction.

    Parameters
    ----------
    distances_m : ndarray of float, shape (n,)
        NaN where nothing is seen, or not known.
    first_deg : float
        The middle of the first sector, clockwise from the vehicle's front.
    step_deg : float
        From one to the next, clockwise.
    """

    distances_m: NDArray[np.float64]
    first_deg: float
    step_deg: float

    def in_parts(self, count: int) -> RangeScan:
        """Return the same with each sector cut into so many, which see what it sees."""
        step_deg = self.step_deg / count
        first_deg = self.first_deg - (self.step_deg - step_deg) / 2
        return RangeScan(np.repeat(self.distances_m, count), first_deg, step_deg)


class Disc(NamedTuple):
    """Something that is seen: the point that is nearest, the direction from the sensor (east and north, length 1), and the radius."""

    near: LocalPoint
    way: tuple[float, float]
    radius_m: float


def discs_seen(scan: RangeScan, here: LocalPoint, heading_deg: float, ground: Ground) -> list[Disc]:
    """Return what a scan sees on allowed ground.

    Parameters
    ----------
    scan : RangeScan
        The distances.
    here : LocalPoint
        Where the sensor is.
    heading_deg : float
        Where the vehicle's front points, clockwise from north.
    ground : Ground
        The fence, without obstacles.
    """
    off_m = EDGE_M + scan.distances_m * math.radians(abs(scan.step_deg)) / 2
    parts = _parts(scan)
    scan, off_m = scan.in_parts(parts), np.repeat(off_m, parts)
    count = len(scan.distances_m)
    bearings = np.radians(heading_deg + scan.first_deg + scan.step_deg * np.arange(count))
    ways = np.column_stack((np.sin(bearings), np.cos(bearings)))
    points = np.array(here) + ways * np.nan_to_num(scan.distances_m)[:, None]
    counts = np.isfinite(scan.distances_m)
    step = math.radians(abs(scan.step_deg))
    counts[counts] = _on_open_ground(points[counts], off_m[counts], ground)
    found = []
    for group in _groups(
        counts, points, scan.distances_m * step, is_round=count * step > 2 * math.pi - step / 2
    ):
        across_m = len(group) * step * float(scan.distances_m[group].min())
        pieces = max(1, math.ceil(across_m / _WIDEST_M), math.ceil(len(group) * step / (2 * _STEEPEST)))
        found += [
            _disc(part, points, ways, scan.distances_m, np.array(here), step)
            for part in np.array_split(group, pieces)
        ]
    return found


def _parts(scan: RangeScan) -> int:
    """Return into how many each sector is cut: so that none is wider than a disc is drawn, and discs are about as wide as each other."""
    step = math.radians(abs(scan.step_deg))
    seen_m = scan.distances_m[np.isfinite(scan.distances_m)]
    widest_m = step * float(seen_m.max(initial=0.0))
    return max(1, math.ceil(2 * widest_m / _WIDEST_M), math.ceil(step / _FINE))


def _on_open_ground(
    points: NDArray[np.float64], off_m: NDArray[np.float64], ground: Ground
) -> NDArray[np.bool_]:
    """Return which points lie on allowed ground, so far off its edges."""
    places = np.asarray(shapely.points(points))
    inside = np.asarray(shapely.covers(ground.allowed, places))
    if ground.edge.is_empty:
        return inside
    return inside & (shapely.distance(ground.edge, places) > off_m)


def _groups(
    counts: NDArray[np.bool_], points: NDArray[np.float64], widths_m: NDArray[np.float64], *, is_round: bool
) -> list[NDArray[np.intp]]:
    """Return the directions that see one thing, in order; in a round scan the last one is a neighbour of the first."""
    groups: list[list[int]] = []
    for number in np.flatnonzero(counts):
        if groups and _are_one(groups[-1][-1], int(number), points, widths_m, len(counts)):
            groups[-1].append(int(number))
        else:
            groups.append([int(number)])
    if is_round and len(groups) > 1 and _are_one(groups[-1][-1], groups[0][0], points, widths_m, len(counts)):
        groups[0] = groups.pop() + groups[0]
    return [np.array(group) for group in groups]


def _are_one(a: int, b: int, points: NDArray[np.float64], widths_m: NDArray[np.float64], count: int) -> bool:
    is_next = b == (a + 1) % count
    return is_next and math.dist(points[a], points[b]) <= _GAP_M + max(widths_m[a], widths_m[b])


def _disc(
    part: NDArray[np.intp],
    points: NDArray[np.float64],
    ways: NDArray[np.float64],
    distances_m: NDArray[np.float64],
    here: NDArray[np.float64],
    step: float,
) -> Disc:
    """Return the disc that fills the sectors of its directions and holds their points."""
    middle = ways[part].sum(axis=0)
    way = middle / np.hypot(*middle)
    near_m = float(distances_m[part].min())
    sine = math.sin(min(len(part) * step / 2, _STEEPEST))
    radius_m = max(near_m * sine / (1 - sine), _LEAST_RADIUS_M)
    centre = here + way * (near_m + radius_m)
    radius_m = max(radius_m, float(np.hypot(*(points[part] - centre).T).max()))
    near = here + way * near_m
    return Disc(LocalPoint(*near.tolist()), (float(way[0]), float(way[1])), min(radius_m, _MOST_RADIUS_M))
