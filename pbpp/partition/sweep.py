"""The sweep that makes slabs: from west to east over the lines that carry vertices."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from .base import TOLERANCE_M
from .window import BlockArrays, Window

if TYPE_CHECKING:
    from .vertices import Vertices
    from .window import Patch

PortalView = tuple[float, float, float, int, int, int]
"""(east, low north, high north, low vertex, high vertex, block behind): how the search sees a portal."""

OPEN_END = -1
"""In place of a vertex: the portal ends on an edge."""

DULL_END = -2
"""In place of a vertex: the portal ends at one around which no shortest path turns."""

_AROUND = ("west_above", "west_below", "east_above", "east_below", "above", "below")

_Slot = list[int]
"""An open block: [floor edge, ceiling edge, block]. Edges are numbered by the vertex they start at."""

_Side = tuple[float, int, float, int, int]
"""A block's side on the line: (low north, low vertex, high north, high vertex, block); vertex -1 for none."""


def _way_to(block: int, way: PortalView) -> PortalView:
    """Return a portal with another block behind it."""
    return (way[0], way[1], way[2], way[3], way[4], block)


class Sweep:
    """One sweep over free space.

    Parameters
    ----------
    vertices : Vertices or Window
        Of free space, or of some lines of it: then it begins and ends with open blocks.
    """

    # Many attributes: the arrays of one algorithm, each read in its inner loop; held by another object each step would cost a look-up more.

    def __init__(self, vertices: Vertices | Window) -> None:
        v = vertices
        count = len(v.x)
        self._vertices = v
        east = v.x[v.next] - v.x
        self._y: list[float] = v.y.tolist()
        self._next: list[int] = v.next.tolist()
        self._prev: list[int] = v.prev.tolist()
        # The left end and the slope of the edge that starts at each vertex; vertical edges never open a block.
        forward = east > 0.0
        run = abs(east)
        run[run == 0.0] = 1.0
        rise = v.y[v.next] - v.y
        rise[~forward] *= -1.0
        self._slope: list[float] = (rise / run).tolist()
        left = v.next.copy()
        left[forward] = (forward.nonzero())[0]
        self._left_x: list[float] = v.x[left].tolist()
        self._left_y: list[float] = v.y[left].tolist()
        # +1: the edge leaves the vertex eastwards (a floor), -1: westwards (a ceiling), 0: vertical.
        self._out: list[int] = ((east > 0.0).astype(int) - (east < 0.0)).tolist()
        self._end: list[int] = np.where(v.corner, v.names, DULL_END).tolist()
        self._active: list[_Slot] = []
        self._by_floor: list[_Slot] = [[]] * count
        self._by_ceiling: list[_Slot] = [[]] * count

        self.floor: list[int] = []
        self.ceiling: list[int] = []
        self.west: list[float] = []
        self.east: list[float] = []
        self.portals: list[tuple[float, float, float, int, int]] = []
        self.ways: tuple[list[list[PortalView]], list[list[PortalView]]] = ([], [])
        self.west_above = [-1] * count
        self.west_below = [-1] * count
        self.east_above = [-1] * count
        self.east_below = [-1] * count
        self.above = [-1] * count
        self.below = [-1] * count
        if isinstance(v, Window):
            self._begin(v.begins_with)

    def _begin(self, blocks: BlockArrays) -> None:
        """Begin with blocks that are open."""
        for west, floor, ceiling in zip(
            *(column.tolist() for column in (blocks.west, blocks.floor, blocks.ceiling)), strict=True
        ):
            slot = [floor, ceiling, self._new_block(west, floor, ceiling)]
            self._by_floor[floor] = self._by_ceiling[ceiling] = slot
            self._active.append(slot)

    @property
    def ends_with(self) -> list[int]:
        """The blocks that are open at the end: of a whole free space none."""
        return [block for _, _, block in self._active]

    @property
    def blocks(self) -> BlockArrays:
        """The blocks as arrays."""
        edges = np.array((self.floor, self.ceiling), dtype=np.intp)
        return BlockArrays(edges[0], edges[1], np.array(self.west), np.array(self.east))

    def patched(self, patch: Patch, part: Sweep) -> Sweep:
        """Return a copy with a window of it replaced; it can be searched, and no more be swept."""
        new = copy(self)
        numbers, names = patch.numbers.tolist(), patch.window.names
        count, total = len(patch.blocks.west), int(names.max()) + 1
        westwards, eastwards = ([*ways, *([[]] * (count - len(ways)))] for ways in self.ways)
        new.ways = (westwards, eastwards)
        for block in patch.dead.tolist():
            westwards[block] = eastwards[block] = []
        for was, now, _ in patch.moved:
            eastwards[now] = self.ways[1][was]
            for *_, other in eastwards[now]:
                westwards[other] = [_way_to(now, way) if way[5] == was else way for way in westwards[other]]
        for direction, changes in enumerate((patch.is_new, patch.is_closed)):
            for block in np.flatnonzero(changes).tolist():
                ways = part.ways[direction][block]
                new.ways[direction][numbers[block]] = [_way_to(numbers[way[5]], way) for way in ways]
        there = patch.window.order.tolist()
        vertices = names[there].tolist()
        for name in _AROUND:
            around = [*getattr(self, name), *([-1] * (total - len(self.above)))]
            found = getattr(part, name)
            is_block = name not in {"above", "below"}
            for one, vertex in zip(there, vertices, strict=True):
                around[vertex] = numbers[found[one]] if is_block and found[one] >= 0 else found[one]
            setattr(new, name, around)
        for was, now, ends in patch.moved:
            for vertex in ends:
                for around in (new.west_above, new.west_below):
                    if around[vertex] == was:
                        around[vertex] = now
        return new

    def run(self) -> None:
        """Sweep all lines.

        Raises
        ------
        IndexError, ValueError
            If the rings do not fit together, as those of valid polygons do.
        """
        starts = self._vertices.line_start.tolist()
        order = self._vertices.order.tolist()
        for x, first, last in zip(self._vertices.line_x.tolist(), starts, starts[1:], strict=False):
            there = order[first:last]
            if len(there) == 1 or self._independent(x, there):
                for vertex in there:
                    self._vertex(x, vertex)
            else:
                self._line(x, there)

    def _new_block(self, x: float, floor: int, ceiling: int) -> int:
        block = len(self.west)
        self.west.append(x)
        self.east.append(x)
        self.floor.append(floor)
        self.ceiling.append(ceiling)
        self.ways[0].append([])
        self.ways[1].append([])
        return block

    def _new_portal(
        self, portal: tuple[float, float, float], ends: tuple[int, int], west: int, east: int
    ) -> bool:
        """Make a portal, and return whether there is one: a narrower gap is closed."""
        x, low, high = portal
        if high - low <= TOLERANCE_M:
            return False
        self.portals.append((x, low, high, west, east))
        self.ways[1][west].append((x, low, high, ends[0], ends[1], east))
        self.ways[0][east].append((x, low, high, ends[0], ends[1], west))
        return True

    def _vertex(self, x: float, vertex: int) -> None:
        """Do what `_line` does for a line with one vertex, by far the most frequent one."""
        before = self._prev[vertex]
        leaves, arrives = self._out[vertex], self._out[before]
        if leaves == arrives:
            self._bend(x, vertex, before, floor=leaves > 0)
        elif leaves > 0:
            rise = self._slope[vertex] - self._slope[before]
            # Of edges on one line only the vertex tells whether an obstacle lies between them or free space.
            if rise > 0.0 or (rise == 0.0 and self._end[vertex] >= 0):
                self._divide(x, vertex, before)
            else:
                slot = [vertex, before, self._new_block(x, vertex, before)]
                self._by_floor[vertex] = self._by_ceiling[before] = slot
                self._active.insert(self._find(x, self._y[vertex]), slot)
        elif self._by_ceiling[vertex] is self._by_floor[before]:
            slot = self._by_ceiling[vertex]
            self.east[slot[2]] = x
            del self._active[self._index(slot, x)]
        else:
            self._unite(x, vertex, before)

    def _bend(self, x: float, vertex: int, before: int, *, floor: bool) -> None:
        """Go on where a floor or a ceiling bends: two in three vertices do, so its calls are written out."""
        y, end = self._y[vertex], self._end[vertex]
        slot = self._by_floor[before] if floor else self._by_ceiling[vertex]
        west = slot[2]
        self.east[west] = x
        # As in _new_block.
        slot[2] = east = len(self.west)
        if floor:
            slot[0] = vertex
            self._by_floor[vertex] = slot
            other = slot[1]
            self.floor.append(vertex)
            self.ceiling.append(other)
            low, high = y, self._left_y[other] + self._slope[other] * (x - self._left_x[other])
            low_end, high_end = end, OPEN_END
            beside = self.west_above, self.east_above
        else:
            slot[1] = before
            self._by_ceiling[before] = slot
            other = slot[0]
            self.floor.append(other)
            self.ceiling.append(before)
            low, high = self._left_y[other] + self._slope[other] * (x - self._left_x[other]), y
            low_end, high_end = OPEN_END, end
            beside = self.west_below, self.east_below
        self.west.append(x)
        self.east.append(x)
        westwards, eastwards = self.ways
        eastwards.append([])
        # As in _new_portal.
        if high - low > TOLERANCE_M:
            self.portals.append((x, low, high, west, east))
            eastwards[west].append((x, low, high, low_end, high_end, east))
            westwards.append([(x, low, high, low_end, high_end, west)])
            beside[0][vertex], beside[1][vertex] = west, east
        else:
            westwards.append([])

    def _divide(self, x: float, vertex: int, before: int) -> None:
        """Split a block where an obstacle begins."""
        y, end = self._y[vertex], self._end[vertex]
        place = self._find(x, y)
        slot = self._active[place]
        floor, ceiling, west = slot
        self.east[west] = x
        lower, upper = self._new_block(x, floor, before), self._new_block(x, vertex, ceiling)
        slot[1:] = before, lower
        self._by_ceiling[before] = slot
        above = [vertex, ceiling, upper]
        self._by_floor[vertex] = self._by_ceiling[ceiling] = above
        self._active.insert(place + 1, above)
        if self._new_portal((x, self._north(floor, x), y), (OPEN_END, end), west, lower):
            self.west_below[vertex], self.east_below[vertex] = west, lower
        if self._new_portal((x, y, self._north(ceiling, x)), (end, OPEN_END), west, upper):
            self.west_above[vertex], self.east_above[vertex] = west, upper

    def _unite(self, x: float, vertex: int, before: int) -> None:
        """Join two blocks where the obstacle between them ends."""
        y, end = self._y[vertex], self._end[vertex]
        below, above = self._by_ceiling[vertex], self._by_floor[before]
        floor, _, lower = below
        _, ceiling, upper = above
        self.east[lower] = self.east[upper] = x
        del self._active[self._index(above, x)]
        east = self._new_block(x, floor, ceiling)
        below[1:] = ceiling, east
        self._by_ceiling[ceiling] = below
        if self._new_portal((x, self._north(floor, x), y), (OPEN_END, end), lower, east):
            self.west_below[vertex], self.east_below[vertex] = lower, east
        if self._new_portal((x, y, self._north(ceiling, x)), (end, OPEN_END), upper, east):
            self.west_above[vertex], self.east_above[vertex] = upper, east

    def _line(self, x: float, there: list[int]) -> None:
        """Close the blocks that end on a line, open those that begin, and join them by portals."""
        closing = self._touched(x, there)
        ends_here = set(there)
        left = [self._close(slot, x, ends_here) for slot in closing]
        floors: list[tuple[float, float, int, int]] = []
        ceilings: list[tuple[float, float, int, int]] = []
        for slot in closing:
            floor, ceiling, _ = slot
            if self._next[floor] not in ends_here:
                floors.append((self._north(floor, x), self._slope[floor], floor, -1))
            if ceiling not in ends_here:
                ceilings.append((self._north(ceiling, x), self._slope[ceiling], ceiling, -1))
        out, prev, y = self._out, self._prev, self._y
        for vertex in there:
            if out[vertex] > 0:
                floors.append((y[vertex], self._slope[vertex], vertex, vertex))
            edge = prev[vertex]
            if out[edge] < 0:
                ceilings.append((y[vertex], self._slope[edge], edge, vertex))
            elif out[edge] == 0:
                self._link(edge, vertex)
        right = self._open(x, floors, ceilings)
        self._join(x, left, right)
        self._place(there, left, right)

    def _independent(self, x: float, there: list[int]) -> bool:
        """Return whether no two vertices of a line concern the same block, so that each can be handled as if alone."""
        seen: set[int] = set()
        out, prev, y = self._out, self._prev, self._y
        for vertex in there:
            before = prev[vertex]
            leaves, arrives = out[vertex], out[before]
            if not leaves or not arrives:
                return False
            slots = []
            if leaves < 0:
                slots.append(self._by_ceiling[vertex])
            if arrives > 0:
                slots.append(self._by_floor[before])
            if not slots:
                place = self._find(x, y[vertex])
                slots += self._active[max(place - 1, 0) : place + 1]
            names = {id(slot) for slot in slots}
            if names & seen:
                return False
            seen |= names
        return True

    def _touched(self, x: float, there: list[int]) -> list[_Slot]:
        """Take the open blocks that end at or are met by the vertices of a line out of the order, and return them."""
        found: dict[int, _Slot] = {}
        out, prev, y = self._out, self._prev, self._y
        for vertex in there:
            known = False
            if out[vertex] < 0:
                slot = self._by_ceiling[vertex]
                found[id(slot)] = slot
                known = True
            if out[prev[vertex]] > 0:
                slot = self._by_floor[prev[vertex]]
                found[id(slot)] = slot
                known = True
            if not known:
                place = self._find(x, y[vertex])
                if place < len(self._active):
                    slot = self._active[place]
                    if self._north(slot[0], x) < y[vertex]:
                        found[id(slot)] = slot
        if len(found) == len(self._active):
            closing = self._active
            self._active = []
            return closing
        places = sorted(self._index(slot, x) for slot in found.values())
        closing = [self._active[place] for place in places]
        for place in reversed(places):
            del self._active[place]
        return closing

    def _north(self, edge: int, x: float) -> float:
        return self._left_y[edge] + self._slope[edge] * (x - self._left_x[edge])

    def _find(self, x: float, y: float) -> int:
        """Return the place of the lowest open block whose ceiling lies above a point."""
        active, left_x, left_y, slope = self._active, self._left_x, self._left_y, self._slope
        low, high = 0, len(active)
        while low < high:
            middle = (low + high) // 2
            edge = active[middle][1]
            if left_y[edge] + slope[edge] * (x - left_x[edge]) > y:
                high = middle
            else:
                low = middle + 1
        return low

    def _index(self, slot: _Slot, x: float) -> int:
        place = self._find(x, 0.5 * (self._north(slot[0], x) + self._north(slot[1], x)))
        if place < len(self._active) and self._active[place] is slot:
            return place
        # Neighbours that meet within rounding: look from one end to the other.
        return self._active.index(slot)

    def _close(self, slot: _Slot, x: float, ends_here: set[int]) -> _Side:
        floor, ceiling, block = slot
        self.east[block] = x
        low_vertex, high_vertex = self._next[floor], ceiling
        if low_vertex in ends_here:
            low = self._y[low_vertex]
        else:
            low, low_vertex = self._north(floor, x), -1
        if high_vertex in ends_here:
            high = self._y[high_vertex]
        else:
            high, high_vertex = self._north(ceiling, x), -1
        return low, low_vertex, high, high_vertex, block

    def _open(
        self,
        x: float,
        floors: list[tuple[float, float, int, int]],
        ceilings: list[tuple[float, float, int, int]],
    ) -> list[_Side]:
        floors.sort()
        ceilings.sort()
        sides: list[_Side] = []
        for (low, _, floor, low_vertex), (high, _, ceiling, high_vertex) in zip(
            floors, ceilings, strict=True
        ):
            block = self._new_block(x, floor, ceiling)
            slot = [floor, ceiling, block]
            self._by_floor[floor] = slot
            self._by_ceiling[ceiling] = slot
            sides.append((low, low_vertex, high, high_vertex, block))
            self._active.insert(self._slot_place(x, low, high), slot)
        return sides

    def _slot_place(self, x: float, low: float, high: float) -> int:
        # Open blocks do not overlap, so the first one whose middle lies above this one's is its upper neighbour.
        target = low + high
        first, last = 0, len(self._active)
        while first < last:
            middle = (first + last) // 2
            floor, ceiling, _ = self._active[middle]
            if self._north(floor, x) + self._north(ceiling, x) > target:
                last = middle
            else:
                first = middle + 1
        return first

    def _link(self, edge: int, vertex: int) -> None:
        """Note a vertical edge of the boundary: a path may run along it."""
        low, high = (edge, vertex) if self._y[edge] < self._y[vertex] else (vertex, edge)
        self.above[low], self.below[high] = self._end[high], self._end[low]

    def _join(self, x: float, left: list[_Side], right: list[_Side]) -> None:
        """Make a portal wherever a closed and an opened block share a piece of the line."""
        i = j = 0
        while i < len(left) and j < len(right):
            left_low, left_low_vertex, left_high, left_high_vertex, west = left[i]
            right_low, right_low_vertex, right_high, right_high_vertex, east = right[j]
            low, low_vertex = (
                (left_low, left_low_vertex) if left_low > right_low else (right_low, right_low_vertex)
            )
            if left_low == right_low and low_vertex < 0:
                low_vertex = left_low_vertex
            high, high_vertex = (
                (left_high, left_high_vertex) if left_high < right_high else (right_high, right_high_vertex)
            )
            if left_high == right_high and high_vertex < 0:
                high_vertex = left_high_vertex
            low_end = self._end[low_vertex] if low_vertex >= 0 else OPEN_END
            high_end = self._end[high_vertex] if high_vertex >= 0 else OPEN_END
            self._new_portal((x, low, high), (low_end, high_end), west, east)
            if high - low > TOLERANCE_M and OPEN_END not in {low_end, high_end}:
                self.above[low_vertex], self.below[high_vertex] = high_end, low_end
            if left_high < right_high:
                i += 1
            else:
                j += 1

    def _place(self, there: list[int], left: list[_Side], right: list[_Side]) -> None:
        """Note which blocks lie beside each vertex of a line; none that only a closed gap leads to."""
        for sides, above, below in (
            (left, self.west_above, self.west_below),
            (right, self.east_above, self.east_below),
        ):
            for vertex in there:
                y = self._y[vertex]
                for low, _, high, _, block in sides:
                    if low <= y and high - y > TOLERANCE_M:
                        above[vertex] = block
                    if y - low > TOLERANCE_M and y <= high:
                        below[vertex] = block
