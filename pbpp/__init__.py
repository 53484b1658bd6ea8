"""Shortest safe paths in the plane: partitioning-based path planning (PBPP), made exact.

Everything is in metres, east then north. See `plan_path` for one query and `Planner` for many on the same fence.
"""

from .errors import (
    GoalBlockedError,
    InvalidGeometryError,
    NoPathError,
    PlanningError,
    SearchStoppedError,
    StartBlockedError,
    TooManyBlocksError,
)
from .geometry import circle_ring
from .path_tree import PathTree
from .planned_path import PlannedPath
from .planner import Planner, plan_path
from .widest import WidestWay, widest

__all__ = [
    "GoalBlockedError",
    "InvalidGeometryError",
    "NoPathError",
    "PathTree",
    "PlannedPath",
    "Planner",
    "PlanningError",
    "SearchStoppedError",
    "StartBlockedError",
    "TooManyBlocksError",
    "WidestWay",
    "circle_ring",
    "plan_path",
    "widest",
]
