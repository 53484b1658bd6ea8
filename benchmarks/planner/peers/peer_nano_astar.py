# ruff: noqa: ANN001, ANN201
"""nano-astar: grid A* in C++."""

import nano_astar
import numpy as np
from raster import Raster


def build(case):
    raster = Raster(case)
    raster.grid = np.ascontiguousarray(raster.blocked.astype(np.uint8))
    return raster


def query(raster, start, goal):
    path = nano_astar.astar(raster.grid, raster.cell(start)[::-1], raster.cell(goal)[::-1])[0]
    return None if path is None else raster.path(np.asarray(path)[:, ::-1], start, goal)
