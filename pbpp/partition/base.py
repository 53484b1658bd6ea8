"""What every partition of free space offers: convex blocks, and portals between neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from pbpp.geometry import Floats, Point

TOLERANCE_M = 1e-9
"""Lengths up to this are taken as none: gaps so narrow are closed, vertices so near to one line stand on it."""


@dataclass(frozen=True)
class Portals:
    """The common edges of neighbouring blocks.

    Parameters
    ----------
    blocks : (p, 2) array of int
        The two blocks that each portal joins.
    ends_m : (p, 2, 2) array
        Its two ends, (east, north) in metres from the scene's origin.
    """

    blocks: npt.NDArray[np.intp]
    ends_m: Floats

    def __len__(self) -> int:
        return len(self.blocks)


class Partition(Protocol):
    """Convex blocks that fill free space."""

    @property
    def name(self) -> str:
        """How the partition is called in ``Planner(partition=...)``."""

    def __len__(self) -> int:
        """Return the number of blocks."""

    @property
    def portals(self) -> Portals:
        """The portals between blocks."""

    @property
    def centers(self) -> Floats:
        """The middle of each block, (b, 2) array, metres from the scene's origin."""

    def outline(self, block: int) -> Floats:
        """Return the corners of a block, (k, 2) array, counter-clockwise, metres from the scene's origin."""

    def locate(self, point: Point) -> list[int]:
        """Return the blocks that a point lies in or on the edge of, in rising order."""
