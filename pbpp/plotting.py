"""Pictures of paths; needs matplotlib, the extra ``plot``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from matplotlib import pyplot as plt
from matplotlib.collections import PolyCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path

if TYPE_CHECKING:
    from .planned_path import PlannedPath

__all__ = ["plot_path"]

_FREE, _EDGE, _BLOCK, _SEQUENCE, _PATH = "#eef3f7", "#3b4a57", "#b7c4cf", "#f6d58a", "#c0392b"
_MOST_BLOCKS = 5_000  # more cannot be told apart in a picture


def plot_path(path: PlannedPath, ax: Any = None, *, show_blocks: bool = True) -> Any:  # noqa: ANN401 - matplotlib is an extra
    """Draw free space, the blocks, the sequence of blocks, and the path with its crossing points.

    Parameters
    ----------
    path : PlannedPath
        What to draw.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if left out.
    show_blocks : bool, default True
        Whether to draw the blocks; more than 5,000 are left out anyway.

    Returns
    -------
    matplotlib.axes.Axes
        The axes.
    """
    if ax is None:
        _, ax = plt.subplots(figsize=(6, 6))
    field = path.drawing.field
    for polygon in field.scene.to_map(field.free.geometry).geoms:
        rings = [
            Path(shapely.get_coordinates(ring), closed=True)
            for ring in (polygon.exterior, *polygon.interiors)
        ]
        ax.add_patch(
            PathPatch(Path.make_compound_path(*rings), facecolor=_FREE, edgecolor=_EDGE, linewidth=0.8)
        )
    partition = field.slabs if path.drawing.partition == "slabs" else field.blocks
    origin_m = field.scene.origin_m
    if show_blocks and len(partition) <= _MOST_BLOCKS:
        outlines = [partition.outline(block) + origin_m for block in range(len(partition))]
        ax.add_collection(PolyCollection(outlines, facecolor="none", edgecolor=_BLOCK, linewidth=0.5))
    if path.sequence:
        passed = [partition.outline(block) + origin_m for block in path.sequence]
        ax.add_collection(
            PolyCollection(passed, facecolor=_SEQUENCE, edgecolor=_BLOCK, linewidth=0.5, alpha=0.6)
        )
    crossings_m = path.drawing.crossings_m
    ax.plot(crossings_m[:, 0], crossings_m[:, 1], ".", color=_PATH, markersize=4)
    ax.plot(path.points[:, 0], path.points[:, 1], "-", color=_PATH, linewidth=1.8)
    ends = np.array([path.points[0], path.points[-1]])
    ax.plot(ends[:, 0], ends[:, 1], "o", color=_PATH, markerfacecolor="white", markersize=7)
    ax.set_aspect("equal")
    ax.set_xlabel("east, m")
    ax.set_ylabel("north, m")
    ax.set_title(
        f"{path.method}: {path.length_m:.2f} m, {path.blocks} blocks, {path.expanded} expanded", fontsize=10
    )
    ax.autoscale_view()
    return ax
