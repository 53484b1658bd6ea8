"""Pictures of paths; needs matplotlib, the extra ``plot``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .field import Field
    from .geometry import Floats

_FREE, _EDGE, _BLOCK, _SEQUENCE, _PATH = "#eef3f7", "#3b4a57", "#b7c4cf", "#f6d58a", "#c0392b"
_MOST_BLOCKS = 5_000  # more cannot be told apart in a picture


@dataclass(frozen=True)
class Drawing:
    """What is drawn besides the path.

    Parameters
    ----------
    field : Field
        Free space with its partitions.
    partition : str
        ``"slabs"`` or ``"blocks"``.
    crossings_m : (n, 2) array
        The points at which the path was fixed, before points on a straight line were left out; east and north in metres.
    """

    field: Field
    partition: str
    crossings_m: Floats

    def draw(self, points: Floats, sequence: Sequence[int], ax: Any, *, show_blocks: bool) -> Any:  # noqa: ANN401 - matplotlib is an extra
        """Draw free space, the blocks, the sequence of blocks, and the path with its crossing points; see `PlannedPath.plot`."""
        from matplotlib import collections, patches  # noqa: PLC0415 - loaded only when a picture is asked for
        from matplotlib import pyplot as plt  # noqa: PLC0415 - as above
        from matplotlib.path import Path  # noqa: PLC0415 - as above

        if ax is None:
            _, ax = plt.subplots(figsize=(6, 6))
        field = self.field
        for polygon in field.scene.to_map(field.free.geometry).geoms:
            rings = [
                Path(shapely.get_coordinates(ring), closed=True)
                for ring in (polygon.exterior, *polygon.interiors)
            ]
            ax.add_patch(
                patches.PathPatch(
                    Path.make_compound_path(*rings), facecolor=_FREE, edgecolor=_EDGE, linewidth=0.8
                )
            )
        partition = field.slabs if self.partition == "slabs" else field.blocks
        origin_m = field.scene.origin_m
        if show_blocks and len(partition) <= _MOST_BLOCKS:
            outlines = [partition.outline(block) + origin_m for block in range(len(partition))]
            ax.add_collection(
                collections.PolyCollection(outlines, facecolor="none", edgecolor=_BLOCK, linewidth=0.5)
            )
        if sequence:
            passed = [partition.outline(block) + origin_m for block in sequence]
            ax.add_collection(
                collections.PolyCollection(
                    passed, facecolor=_SEQUENCE, edgecolor=_BLOCK, linewidth=0.5, alpha=0.6
                )
            )
        crossings_m = self.crossings_m
        ax.plot(crossings_m[:, 0], crossings_m[:, 1], ".", color=_PATH, markersize=4)
        ax.plot(points[:, 0], points[:, 1], "-", color=_PATH, linewidth=1.8)
        ends = np.array([points[0], points[-1]])
        ax.plot(ends[:, 0], ends[:, 1], "o", color=_PATH, markerfacecolor="white", markersize=7)
        ax.set_aspect("equal")
        ax.set_xlabel("east, m")
        ax.set_ylabel("north, m")
        ax.autoscale_view()
        return ax
