"""Slabs of a changed free space: swept anew only on the vertical lines between the west and the east end of what has changed.

West and east of these lines the sweep would do what it did: it begins with the blocks that are open there and must end with those that were. Blocks and
vertices that are no more leave their numbers to others, or without meaning to nothing, so that all others keep theirs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from pbpp.geometry import Floats

    from .vertices import Flags, Ints, Vertices

ColumnT = TypeVar("ColumnT", npt.NDArray[np.intp], npt.NDArray[np.float64])


class BlockArrays(NamedTuple):
    """Blocks: floor and ceiling, each the vertex that its edge starts at, and east of the west and the east side in metres."""

    floor: Ints
    ceiling: Ints
    west: Floats
    east: Floats


class Window(NamedTuple):
    """Some neighbouring lines with all that a sweep over them reads, its vertices numbered among themselves.

    Parameters
    ----------
    x, y, next, prev, corner, line_x, line_start, order
        As of `Vertices`.
    names : (n,) array of int
        The vertices' numbers in all of free space.
    begins_with : BlockArrays
        The blocks that are open west of the lines, from south to north.
    """

    x: Floats
    y: Floats
    next: Ints
    prev: Ints
    corner: npt.NDArray[np.bool_]
    line_x: Floats
    line_start: Ints
    order: Ints
    names: Ints
    begins_with: BlockArrays


class Moved(NamedTuple):
    """A block that reaches beyond a window and has another number than the one known there; with the vertices on the line where it ends."""

    was: int
    now: int
    vertices: list[int]


class Patch(NamedTuple):
    """How the blocks of a window stand among all.

    Parameters
    ----------
    window : Window
        The window.
    numbers : (m,) array of int
        The number among all of each of its blocks.
    is_new, is_closed : (m,) array of bool
        Which of them begin in it, and which end in it.
    moved : list of Moved
        The blocks whose numbers change east of it.
    dead : (d,) array of int
        The numbers of all blocks that are no more.
    blocks : BlockArrays
        All blocks then.
    """

    window: Window
    numbers: Ints
    is_new: npt.NDArray[np.bool_]
    is_closed: npt.NDArray[np.bool_]
    moved: list[Moved]
    dead: Ints
    blocks: BlockArrays


def window_of(
    vertices: Vertices, blocks: BlockArrays, dead: Ints, ends: tuple[float, float]
) -> tuple[Window, Ints] | None:
    """Return the lines from one to another, and the numbers of the blocks that are open west of them.

    Parameters
    ----------
    vertices : Vertices
        Those of the changed free space.
    blocks, dead
        The blocks before the change, and the numbers of those that are none.
    ends : pair of float
        East of the first and of the last line in metres.

    Returns
    -------
    tuple or None
        None if rounding decides about the blocks' order.
    """
    v, (west, east) = vertices, ends
    first, last = int(np.searchsorted(v.line_x, west, "left")), int(np.searchsorted(v.line_x, east, "right"))
    is_open = (blocks.west < west) & (blocks.east >= west)
    is_open[dead] = False
    opened = np.flatnonzero(is_open)
    at = np.full(len(opened), 0.5 * (west + v.line_x[max(first - 1, 0)]))
    heights = v.edge_north(blocks.floor[opened], at) + v.edge_north(blocks.ceiling[opened], at)
    rising = np.argsort(heights)
    if (np.diff(heights[rising]) <= 0.0).any():
        return None
    opened = opened[rising]
    floor, ceiling = blocks.floor[opened], blocks.ceiling[opened]
    there = v.order[v.line_start[first] : v.line_start[last]]
    edges = np.concatenate((there, v.prev[there], floor, ceiling))
    is_there = np.zeros(len(v.x), dtype=bool)
    is_there[edges] = is_there[v.next[edges]] = True
    names = np.flatnonzero(is_there)

    def numbered(vertices: Ints) -> Ints:
        # What lies beyond is not asked for: it is put at some place that is there.
        return np.minimum(np.searchsorted(names, vertices), len(names) - 1)

    return Window(
        v.x[names],
        v.y[names],
        numbered(v.next[names]),
        numbered(v.prev[names]),
        v.corner[names],
        v.line_x[first:last],
        v.line_start[first : last + 1] - v.line_start[first],
        numbered(there),
        names,
        BlockArrays(numbered(floor), numbered(ceiling), blocks.west[opened], blocks.east[opened]),
    ), opened


def patch_of(
    *,
    vertices: Vertices,
    before: BlockArrays,
    dead: Ints,
    ends: tuple[float, float],
    window: Window,
    opened: Ints,
    swept: BlockArrays,
    ends_with: Ints,
) -> Patch | None:
    """Return how the blocks of a window stand among all; None if they do not end with the blocks that were open there.

    Parameters
    ----------
    vertices, before, dead, ends, window, opened
        As for `window_of`, and what it has returned.
    swept : BlockArrays
        The blocks of the window, the open ones first.
    ends_with : (k,) array of int
        Those that are open at its end.
    """
    west, east = ends
    there = (before.west >= west) & (before.west <= east)
    beyond = (before.west <= east) & (before.east > east)
    there[dead] = beyond[dead] = False
    floor, ceiling = window.names[swept.floor], window.names[swept.ceiling]
    were = {
        (int(before.floor[one]), int(before.ceiling[one])): one for one in np.flatnonzero(beyond).tolist()
    }
    now = {(int(floor[one]), int(ceiling[one])): one for one in ends_with.tolist()}
    if were.keys() != now.keys():
        return None
    kept = [(one, were[edges]) for edges, one in now.items()]
    there[dead] = True
    numbers, dead, count = _numbered(opened, len(floor), kept, there)
    moved = []
    east_of = swept.east.copy()
    for one, was in kept:
        east_of[one] = before.east[was]
        if numbers[one] != was:
            line = int(np.searchsorted(vertices.line_x, before.east[was]))
            ends_there = vertices.order[vertices.line_start[line] : vertices.line_start[line + 1]]
            moved.append(Moved(was, int(numbers[one]), ends_there.tolist()))
    is_closed = np.ones(len(numbers), dtype=bool)
    is_closed[ends_with] = False
    after = BlockArrays(
        _with_values(before.floor, count, numbers, floor),
        _with_values(before.ceiling, count, numbers, ceiling),
        _with_values(before.west, count, numbers, swept.west),
        _with_values(before.east, count, numbers, east_of),
    )
    # What is no more is a block without any width or height.
    after.floor[dead] = after.ceiling[dead] = floor[0]
    after.west[dead] = after.east[dead] = vertices.x[floor[0]]
    return Patch(window, numbers, np.arange(len(numbers)) >= len(opened), is_closed, moved, dead, after)


def _numbered(opened: Ints, size: int, kept: list[tuple[int, int]], is_free: Flags) -> tuple[Ints, Ints, int]:
    """Return the numbers of a window's blocks, those that are left without one, and how many there are in all.

    Blocks that were open before keep theirs, those that are open at its end have the one known there, if it is free; the others take what is free.
    """
    numbers = np.full(size, -1)
    numbers[: len(opened)] = opened
    for one, was in kept:
        if numbers[one] < 0 and is_free[was]:
            numbers[one] = was
    is_free[numbers[numbers >= 0]] = False
    free = np.flatnonzero(is_free)
    unnumbered = np.flatnonzero(numbers < 0)
    count = len(is_free) + max(0, len(unnumbered) - len(free))
    free = np.append(free, np.arange(len(is_free), count))
    numbers[unnumbered], dead = np.split(free, [len(unnumbered)])
    return numbers, dead, count


def _with_values(column: ColumnT, count: int, numbers: Ints, values: ColumnT) -> ColumnT:
    """Return a column of that many rows with other values in some of them."""
    new = np.empty(count, column.dtype)
    new[: len(column)] = column
    new[numbers] = values
    return new
