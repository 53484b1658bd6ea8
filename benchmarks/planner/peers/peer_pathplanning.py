# ruff: noqa: ANN001, ANN201
"""pathplanning: Theta* on a grid, native code."""

from pathplanning import plan_discrete
from pathplanning.core.contracts import DiscreteProblem
from pathplanning.spaces.grid2d import Grid2DSearchSpace
from raster import Raster


def build(case):
    raster = Raster(case)
    rows, columns = raster.blocked.shape
    raster.space = Grid2DSearchSpace(columns, rows, occupancy=raster.blocked)
    return raster


def query(raster, start, goal):
    problem = DiscreteProblem(raster.space, raster.cell(start), raster.cell(goal))
    path = plan_discrete(problem, planner="theta_star").path
    return None if path is None or len(path) == 0 else raster.path(path, start, goal)
