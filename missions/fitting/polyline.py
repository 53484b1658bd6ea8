"""Lines being drawn: waypoints with the speed of the leg to each, and what the driven band has to keep there."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from missions.geo import LocalPoint, change_deg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from missions.geo import Vector


class DrawnPoint(NamedTuple):
    """One point of the lines; a tuple, because hundreds of thousands are made and compared for one plan.

    Parameters
    ----------
    place : LocalPoint
        Where, in the plane.
    required_m : float
        What the band about it, and about the leg to it, has to keep.
    line_m : float
        What the drawn leg to it has to keep.
    speed_mps : float or None
        Asked for on the leg to it; None is the vehicle's own.
    stop_s : float or None
        How long the vehicle waits there; None where it drives on.
    is_fixed : bool
        Whether it has to stay: the start, a target.
    """

    place: LocalPoint
    required_m: float
    line_m: float
    speed_mps: float | None = None
    stop_s: float | None = None
    is_fixed: bool = False

    def at(self, place: LocalPoint) -> DrawnPoint:
        """Return the point at another place."""
        return DrawnPoint(place, *self[1:])


Drawing = tuple[DrawnPoint, ...]


def is_end_or_fixed(drawing: Sequence[DrawnPoint], index: int) -> bool:
    """Return whether a point has to stay."""
    return not 0 < index < len(drawing) - 1 or drawing[index].is_fixed


def places(drawing: Sequence[DrawnPoint]) -> NDArray[np.float64]:
    """Return the points' places, (n, 2)."""
    return np.array([point.place for point in drawing])


def legs(drawing: Sequence[DrawnPoint]) -> list[tuple[LocalPoint, LocalPoint]]:
    """Return the ends of each leg."""
    return [(a.place, b.place) for a, b in pairwise(drawing)]


def speeds(drawing: Sequence[DrawnPoint]) -> list[float | None]:
    """Return the speed asked for on each leg."""
    return [point.speed_mps for point in drawing[1:]]


def stops(drawing: Sequence[DrawnPoint]) -> dict[int, float]:
    """Return where the vehicle waits, and how long."""
    return {number: point.stop_s for number, point in enumerate(drawing) if point.stop_s is not None}


def direction(a: DrawnPoint, b: DrawnPoint) -> Vector:
    """Return the unit vector from one point to another."""
    length_m = math.dist(a.place, b.place) or 1.0
    return ((b.place[0] - a.place[0]) / length_m, (b.place[1] - a.place[1]) / length_m)


def directions(drawing: Sequence[DrawnPoint], index: int) -> tuple[Vector, Vector]:
    """Return the directions of the legs before and after an inner point."""
    here = drawing[index]
    return direction(drawing[index - 1], here), direction(here, drawing[index + 1])


def turn_deg(drawing: Sequence[DrawnPoint], index: int) -> float:
    """Return how the course changes at an inner point, positive to the right."""
    return change_deg(*directions(drawing, index))


def outward(drawing: Sequence[DrawnPoint], index: int) -> Vector | None:
    """Return the unit vector out of a corner along its bisector; None where it hardly turns."""
    before, after = directions(drawing, index)
    east, north = before[0] - after[0], before[1] - after[1]
    length = math.hypot(east, north)
    return (east / length, north / length) if length > 0.02 else None


def shifted(place: LocalPoint, along: Vector, by_m: float) -> LocalPoint:
    """Return a place moved along a unit vector."""
    return LocalPoint(place[0] + along[0] * by_m, place[1] + along[1] * by_m)


def crossing(a: DrawnPoint, b: DrawnPoint, c: DrawnPoint, d: DrawnPoint) -> LocalPoint | None:
    """Return where the line from a through b, prolonged, meets the line from d through c, prolonged."""
    ahead, back = direction(a, b), direction(d, c)
    cross = ahead[0] * back[1] - ahead[1] * back[0]
    if abs(cross) < 1e-3:
        return None
    between = (c.place.east_m - b.place.east_m, c.place.north_m - b.place.north_m)
    ahead_m = (between[0] * back[1] - between[1] * back[0]) / cross
    back_m = (between[0] * ahead[1] - between[1] * ahead[0]) / cross
    return shifted(b.place, ahead, ahead_m) if ahead_m >= 0 and back_m >= 0 else None


def distances_m(drawing: Sequence[DrawnPoint]) -> list[float]:
    """Return how far along the lines each point lies."""
    found = [0.0]
    for a, b in pairwise(drawing):
        found.append(found[-1] + math.dist(a.place, b.place))
    return found


def place_at(drawing: Drawing, along_m: float) -> LocalPoint:
    """Return the place at a distance along the lines."""
    along = distances_m(drawing)
    after = next((number for number, there_m in enumerate(along) if there_m > along_m), len(along) - 1)
    ahead = direction(drawing[after - 1], drawing[after])
    return shifted(drawing[after - 1].place, ahead, along_m - along[after - 1])


def with_point_at(drawing: Drawing, along_m: float, near_m: float) -> tuple[Drawing, int]:
    """Return the lines with a point at a distance along them, and its number; a point that lies nearer than ``near_m`` is used instead."""
    along = distances_m(drawing)
    nearest = min(range(len(along)), key=lambda number: abs(along[number] - along_m))
    if abs(along[nearest] - along_m) <= near_m:
        return drawing, nearest
    after = next(number for number, there_m in enumerate(along) if there_m > along_m)
    new = drawing[after].at(place_at(drawing, along_m))._replace(stop_s=None, is_fixed=False)
    return (*drawing[:after], new, *drawing[after:]), after
