"""Reported obstacles laid out in the plane: exclusions that the planner keeps off, and of which the vehicle itself knows nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from shapely import Polygon

from missions.fence import ZoneKind
from missions.ground.ground import Barrier

if TYPE_CHECKING:
    from missions.fence import Obstacles
    from missions.geo import LocalPoint
    from missions.ground.ground import Ground

_CORNERS = 12
"""Of the polygon around an obstacle's circle, which it leaves by 3.5 % of the radius: how large it is, is not known better, and each corner costs planning time."""


def with_obstacles(ground: Ground, obstacles: Obstacles) -> Ground:
    """Return a ground with obstacles as exclusions, each as large as it may be at their time.

    Parameters
    ----------
    ground : Ground
        The fence.
    obstacles : Obstacles
        What was reported.
    """
    if not obstacles.known:
        return ground
    reported = tuple(
        Barrier(
            obstacle.name,
            ZoneKind.EXCLUSION,
            _around(ground.frame.to_local(obstacle.position), obstacles.radius_m(obstacle)),
            is_reported=True,
        )
        for obstacle in obstacles.known
    )
    return replace(ground, barriers=(*ground.barriers, *reported), obstacles=obstacles)


def _around(middle: LocalPoint, radius_m: float) -> Polygon:
    """Return a polygon around a circle."""
    angles = (np.arange(_CORNERS) + 0.5) * (2 * math.pi / _CORNERS)
    corners = np.column_stack((np.cos(angles), np.sin(angles))) * radius_m / math.cos(math.pi / _CORNERS)
    return Polygon(corners + middle)
