"""How far a predicted area reaches to either side of a corner's legs, as the rows were measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString

if TYPE_CHECKING:
    from missions.drive_model import Envelope


def area_extents(track: Envelope, number: int, before_m: float, after_m: float) -> tuple[float, float]:
    """Measure, on the area alone, how far it lies to the inside and the outside of a corner's legs, as the rows were measured."""
    mine = np.isin(track.waypoints, range(number - 1, number + 3))
    edge = shapely.segmentize(shapely.union_all(track.pieces[mine]).boundary, 0.2)
    place = track.points[number]
    ahead, onward = place - track.points[number - 1], track.points[number + 1] - place
    ahead, onward = ahead / np.hypot(*ahead), onward / np.hypot(*onward)
    offsets = shapely.get_coordinates(edge) - place
    first = LineString([place - ahead * before_m, place])
    second = LineString([place, place + onward * after_m])
    points = shapely.points(offsets + place)
    is_first = shapely.distance(first, points) <= shapely.distance(second, points)
    along = np.where(is_first, -offsets @ ahead, offsets @ onward)
    right = np.where(is_first, offsets @ (ahead[1], -ahead[0]), offsets @ (onward[1], -onward[0]))
    window = along < np.where(is_first, before_m / 2, after_m / 2)
    inside = right if ahead[0] * onward[1] - ahead[1] * onward[0] <= 0 else -right
    return inside[window].max(), -inside[window].min()
