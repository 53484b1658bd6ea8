"""Straight legs as the autopilot draws them, and what rounding and that may take away."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from shapely import LineString, Point

from missions.geo import distance_m
from missions.ground.frame import MAX_LATITUDE_DEG, autopilot_line, bow_m

if TYPE_CHECKING:
    from missions.geo import LatLon
    from missions.ground.ground import Ground

MAX_LEG_M = 1000.0
"""Longer legs are split: the autopilot's straight line bows off ours with the square of the length."""

ROUNDING_RESERVE_M = 0.01
"""Rounding to degE7 moves a waypoint by 8 mm at most."""

# Longest straight piece of the autopilot's line, which bows in the frame; chosen, not measured
_SAMPLE_M = 50.0


def reserve_m(ground: Ground) -> float:
    """Return by how much rounding and the autopilot's own idea of a straight line may bring drawn lines nearer to a fence."""
    east_min_m, north_min_m, east_max_m, north_max_m = ground.allowed.bounds
    diagonal_m = math.hypot(east_max_m - east_min_m, north_max_m - north_min_m)
    farthest_lat_deg = min(abs(ground.frame.origin.lat_deg) + diagonal_m / 1.1e5, MAX_LATITUDE_DEG)
    return ROUNDING_RESERVE_M + bow_m(min(diagonal_m, MAX_LEG_M), farthest_lat_deg)


def drawn_leg(ground: Ground, a: LatLon, b: LatLon) -> LineString | Point:
    """Return the autopilot's straight line between two positions, in the plane."""
    pieces = max(1, math.ceil(distance_m(a, b) / _SAMPLE_M))
    line = ground.frame.to_local_array(autopilot_line(a, b, pieces))
    return Point(line[0]) if a == b else LineString(line)
