"""Slabs as arrays: what the compiled search reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .sweep import PortalView
    from .vertices import Ints, Vertices

__all__ = ["FlatSlabs", "Records", "flatten", "record"]

Records = npt.NDArray[Any]
"""An array of records: numba reads their fields as attributes."""


def record(metres: str, indices: str) -> np.dtype[np.void]:
    """Return the type of records with so named fields: lengths and slopes, then indices."""
    return np.dtype(
        [*((name, np.float64) for name in metres.split()), *((name, np.int64) for name in indices.split())],
    )


_WAY = record("east south north", "low_end high_end block")
_CORNER = record(
    "x y before_east before_north after_east after_north",
    "west_above west_below east_above east_below above below",
)


class FlatSlabs(NamedTuple):
    """Slabs as arrays.

    Parameters
    ----------
    first : (2, b + 1) array of int
        Where the ways of each block begin, westwards and eastwards.
    ways : (2, p) array of records
        East, low and high north of each portal in metres, its low and its high vertex and the block behind it.
    corners : (n,) array of records
        Of each vertex east and north, the way to the vertex before it and to the one after it in metres, the blocks around it and the corners
        straight above and straight below it.
    """

    first: Ints
    ways: Records
    corners: Records


def flatten(
    vertices: Vertices,
    ways: Sequence[Sequence[Sequence[PortalView]]],
    beside: Sequence[Sequence[int]],
    above: Sequence[int],
    below: Sequence[int],
) -> FlatSlabs:
    """Return as arrays what `Slabs` keeps in lists under the same names."""
    corners = zip(vertices.fans, *beside, above, below, strict=True)
    return FlatSlabs(
        np.array([np.cumsum([0, *map(len, side)]) for side in ways], dtype=np.int64),
        np.array([[way for block in side for way in block] for side in ways], dtype=_WAY),
        np.array([(*fan, *around) for fan, *around in corners], dtype=_CORNER),
    )
