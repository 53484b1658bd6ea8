"""What the planner returns."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from math import sqrt
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .geometry import Floats
    from .plotting import Drawing

STRAIGHT_M = 1e-9
"""Rounding: a point that lies no farther beside the straight line is on it."""


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A path from start to goal in free space, with its certificate.

    Parameters
    ----------
    points : (n, 2) array
        East and north of the start, the turning points and the goal in metres.
    length_m : float
        Its length in metres.
    lower_bound_m : float
        No path in this free space is shorter, in metres: equal to `length_m` when ``method="optimal"`` ran to its end.
    method : str
        The method that found it.
    blocks : int
        Number of blocks of the partition that was searched.
    expanded : int
        Number of search nodes taken from the queue.
    sequence : tuple of int
        The blocks passed, for the methods that search blocks; empty otherwise.
    """

    points: Floats
    length_m: float
    lower_bound_m: float
    method: str
    blocks: int
    expanded: int
    sequence: tuple[int, ...] = ()
    drawing: Drawing = field(repr=False, kw_only=True)

    def plot(self, ax: Any = None, *, show_blocks: bool = True) -> Any:  # noqa: ANN401 - matplotlib is an extra
        """Draw free space, the blocks, the sequence of blocks, and the path with its turning points.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure if left out.
        show_blocks : bool, default True
            Whether to draw the blocks.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.
        """
        ax = self.drawing.draw(self.points, self.sequence, ax, show_blocks=show_blocks)
        ax.set_title(
            f"{self.method}: {self.length_m:.2f} m, {self.blocks} blocks, {self.expanded} expanded",
            fontsize=10,
        )
        return ax


def length_of(points: Floats) -> float:
    """Return the length of a polyline, (n, 2) array, in the unit of its coordinates."""
    # Roots added up in order: the compiled search does the same, to the last bit.
    length = 0.0
    for (east, north), (next_east, next_north) in itertools.pairwise(points.tolist()):
        way_east, way_north = next_east - east, next_north - north
        length += sqrt(way_east * way_east + way_north * way_north)
    return length


def straightened(points: Floats) -> Floats:
    """Return a polyline, (n, 2) array in metres, without repeated points and without those on the straight way between their neighbours."""
    # On plain floats: paths are short, and arrays of two cost more than they spare.
    rows = points.tolist()
    kept = [0]
    for index, ((east, north), (next_east, next_north)) in enumerate(itertools.pairwise(rows)):
        before_east, before_north = rows[kept[-1]]
        way_east, way_north = east - before_east, north - before_north
        rest_east, rest_north = next_east - east, next_north - north
        whole_east, whole_north = next_east - before_east, next_north - before_north
        length_m = sqrt(whole_east * whole_east + whole_north * whole_north)
        aside_m = abs(way_east * rest_north - way_north * rest_east)
        onwards = way_east * rest_east + way_north * rest_north >= 0.0
        if (way_east or way_north) and not (onwards and aside_m <= STRAIGHT_M * length_m):
            kept.append(index)
    kept.append(len(rows) - 1)
    return points[kept]
