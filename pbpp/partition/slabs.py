"""Slabs: the paper's blocks merged along the vertical, which leaves O(n) of them.

Only the vertical extension lines VL of the paper (section 2.2) are drawn: from every vertex up and down to the first obstacle or
boundary. What lies between two neighbouring lines, a floor edge and a ceiling edge is one block, a trapezoid. All portals are
pieces of vertical lines, which is what makes the exact search in `pbpp.any_angle` cheap.

One sweep from west to east keeps the open blocks in their order from south to north. Vertices on one vertical line (rectilinear maps
have many) are taken together, so no block has zero width. A vertex where two obstacles touch splits free space there: its rings are
linked anew, so that each of its free fans is a vertex of its own.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from .base import TOLERANCE_M, Portals
from .places import Places
from .sweep import Sweep
from .vertices import Ints, Vertices
from .window import BlockArrays, patch_of, window_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry import Polygon

    from pbpp.geometry import Floats, Point

    from .flat import Engine, FlatSearch, FlatSlabs
    from .window import Patch, Window

_LIVE = 0.75  # of the numbers of vertices, before slabs are made anew with none without meaning; chosen, not measured


def _swept(vertices: Vertices | Window, engine: Engine | None) -> tuple[Sweep | FlatSlabs, BlockArrays]:
    """Return what a sweep writes, and its blocks."""
    if engine is None:
        lists = Sweep(vertices)
        lists.run()
        return lists, lists.blocks
    flat = engine.sweep(vertices)
    floor, ceiling = (flat.blocks[name].astype(np.intp) for name in ("floor", "ceiling"))
    return flat, BlockArrays(floor, ceiling, flat.blocks["west"], flat.blocks["east"])


class Slabs:
    """The slab partition of free space.

    Parameters
    ----------
    polygons : sequence of shapely.Polygon
        Disjoint polygons, metres from the scene's origin.

    engine : Engine, optional
        The compiled sweep and search; they give the same.

    Attributes
    ----------
    vertices : Vertices
        Of free space.
    swept : Sweep or FlatSlabs
        What the search reads: lists, or arrays if compiled.
    """

    name = "slabs"

    def __init__(self, polygons: Sequence[Polygon], engine: Engine | None = None) -> None:
        self.vertices = Vertices(polygons)
        self._engine = engine
        self.swept, self._blocks = _swept(self.vertices, engine)
        self._dead: Ints = np.empty(0, dtype=np.intp)

    def __len__(self) -> int:
        return len(self._blocks.west) - len(self._dead)

    def changed(self, gone: Ints, rings: Sequence[Floats], owner: int) -> Slabs | None:
        """Return the slabs without some holes of free space and with others, swept anew only where that is.

        They can be searched; as a partition they have numbers without a block.

        Parameters
        ----------
        gone, rings, owner
            As for `Vertices.changed`.

        Returns
        -------
        Slabs or None
            The slabs; None if they must be made anew.
        """
        vertices = self.vertices.changed(gone, rings, owner)
        if vertices is None or len(vertices) < _LIVE * len(vertices.x):
            return None
        easts = np.concatenate((self.vertices.x[gone], vertices.x[len(self.vertices.x) :]))
        ends = float(easts.min()), float(easts.max())
        found = window_of(vertices, self._blocks, self._dead, ends)
        if found is None:
            return None
        window, opened = found
        part, swept = _swept(window, self._engine)
        patch = patch_of(
            vertices=vertices,
            before=self._blocks,
            dead=self._dead,
            ends=ends,
            window=window,
            opened=opened,
            swept=swept,
            ends_with=np.asarray(part.ends_with, dtype=np.intp),
        )
        return None if patch is None else self._patched(vertices, patch, part)

    def _patched(self, vertices: Vertices, patch: Patch, part: Sweep | FlatSlabs) -> Slabs:
        new = copy(self)
        for name in ("centers", "portals", "places", "searcher"):
            new.__dict__.pop(name, None)
        new._patch(vertices, patch, part)  # noqa: SLF001 - a copy
        return new

    def _patch(self, vertices: Vertices, patch: Patch, part: Sweep | FlatSlabs) -> None:
        """Take over a window swept anew, before anything but the sides was asked for."""
        more = np.zeros(len(patch.blocks.west) - len(self._blocks.west))
        sides = [np.append(side, more) for side in self._sides]
        self.vertices, self._blocks, self._dead = vertices, patch.blocks, patch.dead
        if isinstance(self.swept, Sweep):
            assert isinstance(part, Sweep)  # by the same engine
            self.swept = self.swept.patched(patch, part)
        else:
            assert not isinstance(part, Sweep)
            self.swept = self.swept.patched(patch, part)
        changed = np.append(patch.numbers, patch.dead)
        for side, values in zip(sides, self._sides_of(changed), strict=True):
            side[changed] = values
        self._sides = (sides[0], sides[1], sides[2], sides[3])
        opened, closed = patch.numbers[patch.is_new], patch.numbers[patch.is_closed]
        self.unjoined_m = self._unjoined_m(patch.window, part, opened, closed)

    @cached_property
    def _sides(self) -> tuple[Floats, Floats, Floats, Floats]:
        """North of floor west, floor east, ceiling west, ceiling east of each block."""
        return self._sides_of(np.arange(len(self._blocks.west)))

    def _sides_of(self, blocks: Ints) -> tuple[Floats, Floats, Floats, Floats]:
        of, north = self._blocks, self.vertices.edge_north
        floor, ceiling, west, east = of.floor[blocks], of.ceiling[blocks], of.west[blocks], of.east[blocks]
        return north(floor, west), north(floor, east), north(ceiling, west), north(ceiling, east)

    @property
    def area_m2(self) -> float:
        """Sum of the areas of all blocks in square metres."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        heights = (ceiling_west - floor_west) + (ceiling_east - floor_east)
        return float(0.5 * np.dot(heights, self._blocks.east - self._blocks.west))

    @property
    def north_range(self) -> tuple[Floats, Floats]:
        """Lowest and highest north of each block."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        return np.minimum(floor_west, floor_east), np.maximum(ceiling_west, ceiling_east)

    @cached_property
    def centers(self) -> Floats:
        """CP, (b, 2) array: the middle of each block."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        north = 0.25 * (floor_west + floor_east + ceiling_west + ceiling_east)
        return np.column_stack((0.5 * (self._blocks.west + self._blocks.east), north))

    def chord(self, block: Ints, north: Floats) -> tuple[Floats, Floats]:
        """Return the west and east ends of blocks' horizontal chords at given norths."""
        west, east = self._blocks.west[block].copy(), self._blocks.east[block].copy()
        floor_west, floor_east, ceiling_west, ceiling_east = (side[block] for side in self._sides)
        for at_west, at_east, above in ((floor_west, floor_east, True), (ceiling_west, ceiling_east, False)):
            rise = at_east - at_west
            slanted = np.abs(rise) > TOLERANCE_M
            share = np.divide(north - at_west, rise, out=np.zeros_like(north), where=slanted)
            cross = self._blocks.west[block] + np.clip(share, 0.0, 1.0) * (
                self._blocks.east[block] - self._blocks.west[block]
            )
            # Above a rising floor, and below a falling ceiling, lies the west; else the east.
            ends_east = slanted & ((rise > 0.0) == above)
            east = np.where(ends_east, np.minimum(east, cross), east)
            west = np.where(slanted & ~ends_east, np.maximum(west, cross), west)
        return west, east

    @property
    def least_height_m(self) -> float:
        """The least height of any side of a block in metres: 0 but for rounding."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        heights = np.concatenate((ceiling_west - floor_west, ceiling_east - floor_east))
        return float(heights.min(initial=0.0))

    @cached_property
    def unjoined_m(self) -> float:
        """How much of the blocks' sides is neither portal nor vertical boundary in metres, at least: 0 but for rounding.

        Less than nothing where a portal leads through a boundary. Of changed slabs: where they were swept anew.
        """
        everything = np.arange(len(self._blocks.west))
        return self._unjoined_m(self.vertices, self.swept, everything, everything)

    def _unjoined_m(self, v: Vertices | Window, swept: Sweep | FlatSlabs, wests: Ints, easts: Ints) -> float:
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        sides_m = float((ceiling_west - floor_west)[wests].sum() + (ceiling_east - floor_east)[easts].sum())
        after = v.next[v.order]
        upright_m = float(np.abs(v.y[after] - v.y[v.order])[v.x[after] == v.x[v.order]].sum())
        portals = swept.portals
        # Added up in one order, so that both sweeps pass the check or none does.
        if isinstance(portals, list):
            portals_m: float = sum(map(itemgetter(2), portals)) - sum(map(itemgetter(1), portals))
        else:
            portals_m = sum(portals["high"].tolist()) - sum(portals["low"].tolist())
        return sides_m - upright_m - 2.0 * portals_m

    @cached_property
    def portals(self) -> Portals:
        """The portals between blocks."""
        portals = self.swept.portals
        if isinstance(portals, list):
            rows = np.array(portals, dtype=np.float64).reshape(-1, 5)
            east, low, high = rows[:, :3].T
            blocks = rows[:, 3:].astype(np.intp)
        else:
            east, low, high = portals["east"], portals["low"], portals["high"]
            blocks = np.column_stack((portals["west_block"], portals["east_block"]))
        ends = np.stack((np.column_stack((east, low)), np.column_stack((east, high))), axis=1)
        return Portals(blocks, ends)

    def outline(self, block: int) -> Floats:
        """Return the corners of a block, (3 or 4, 2) array, counter-clockwise, metres from the scene's origin."""
        floor_west, floor_east, ceiling_west, ceiling_east = (float(side[block]) for side in self._sides)
        west, east = float(self._blocks.west[block]), float(self._blocks.east[block])
        corners = [(west, floor_west), (east, floor_east)]
        if ceiling_east > floor_east:
            corners.append((east, ceiling_east))
        if ceiling_west > floor_west:
            corners.append((west, ceiling_west))
        return np.array(corners)

    @cached_property
    def places(self) -> Places:
        """Where points lie among the blocks."""
        floor_west, floor_east, ceiling_west, ceiling_east = self._sides
        height_m = np.maximum(ceiling_west - floor_west, ceiling_east - floor_east)
        return Places(self.vertices, self._blocks, height_m)

    @cached_property
    def searcher(self) -> FlatSearch | None:
        """The compiled search over them; None if they were swept plainly."""
        if self._engine is None or isinstance(self.swept, Sweep):
            return None
        return self._engine.searcher(self.swept, self.vertices, self.places)

    def locate(self, point: Point) -> list[int]:
        """Return the blocks that a point lies in or on the edge of, from west to east and then from south to north."""
        return self.places.locate(point)

    def components(self, blocks: Sequence[int]) -> frozenset[int]:
        """Return the polygons that blocks lie in, by their place among those the slabs were made of."""
        return self.places.components(blocks)

    def line_neighbours(self, point: Point, block: int) -> list[tuple[int, bool]]:
        """Return the vertices next to a point on the side line of a block that it stands on.

        Parameters
        ----------
        point : (east, north)
            A point in the block or on its edge, metres from the scene's origin.
        block : int
            The block.

        Returns
        -------
        list of (vertex, upwards)
            The corners at the nearest place above and at the nearest place below; none if the point stands on neither side line.
        """
        v = self.vertices
        east, north = point
        found: list[tuple[int, bool]] = []
        floor_west, floor_east, ceiling_west, ceiling_east = (float(side[block]) for side in self._sides)
        for side, low, high in (
            (float(self._blocks.west[block]), floor_west, ceiling_west),
            (float(self._blocks.east[block]), floor_east, ceiling_east),
        ):
            if abs(side - east) > TOLERANCE_M:
                continue
            line = int(np.searchsorted(v.line_x, side))
            there = v.order[v.line_start[line] : v.line_start[line + 1]]
            there = there[v.corner[there] & (v.y[there] >= low) & (v.y[there] <= high)]
            up = there[v.y[there] > north + TOLERANCE_M]
            down = there[v.y[there] < north - TOLERANCE_M]
            found += [(int(one), True) for one in up[v.y[up] == v.y[up].min()]] if len(up) else []
            found += [(int(one), False) for one in down[v.y[down] == v.y[down].max()]] if len(down) else []
        return found
