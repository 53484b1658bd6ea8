# ruff: noqa: ANN001, ANN201, ANN204
"""The free cells of a case, for the planners that know only grids: a cell that an obstacle's inside touches is blocked."""

import numpy as np
import shapely


class Raster:
    def __init__(self, case):
        west, south, east, north = case["bounds"]
        self.cell_m = 1.0 if east - west <= 200 else 2.0
        self.origin = np.array([west, south])
        columns, rows = int((east - west) / self.cell_m), int((north - south) / self.cell_m)
        x, y = np.meshgrid(west + np.arange(columns) * self.cell_m, south + np.arange(rows) * self.cell_m)
        cells = shapely.box(x, y, x + self.cell_m, y + self.cell_m)
        inside = shapely.buffer(
            shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]]), -1e-9
        )
        outside = shapely.difference(
            shapely.box(west - 1, south - 1, east + 1, north + 1), shapely.Polygon(case["inclusion"])
        )
        blocked = shapely.union(inside, shapely.buffer(outside, -1e-9))
        shapely.prepare(blocked)
        self.blocked = shapely.intersects(blocked, cells)

    def cell(self, point):
        """Return the (column, row) of the free cell nearest to a point."""
        column, row = ((np.array(point) - self.origin) / self.cell_m).astype(int)
        rows, columns = np.nonzero(~self.blocked)
        nearest = np.argmin((rows - row) ** 2 + (columns - column) ** 2)
        return int(columns[nearest]), int(rows[nearest])

    def path(self, cells, start, goal):
        """Return a path of (column, row) cells as points between start and goal."""
        middles = self.origin + (np.asarray(cells, dtype=float) + 0.5) * self.cell_m
        return [start, *middles[1:-1].tolist(), goal]
