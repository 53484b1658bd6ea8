"""The sweep of `pbpp.partition.sweep`, compiled by numba: it writes the arrays that the compiled search reads.

It does the same operations in the same order as the plain sweep, so that blocks, their numbers and all coordinates are the same to the last bit; the tests
compare them. What is explained there is not explained again here. Where the plain sweep raises IndexError or ValueError, this one fails too: steps return
whether they went well.
"""

# numba reads loops over indices and explicit comparisons best.
# ruff: noqa: PLR1714

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pbpp.compiled.jit import compiled as _compiled
from pbpp.compiled.jit import inlined as _inlined
from pbpp.compiled.jit import uncounted as _uncounted
from pbpp.partition.base import TOLERANCE_M
from pbpp.partition.flat import BLOCK, CORNER, PORTAL, WAY, FlatSlabs, Records, record
from pbpp.partition.sweep import DULL_END, OPEN_END
from pbpp.partition.window import BlockArrays, Window

if TYPE_CHECKING:
    from pbpp.geometry import Floats
    from pbpp.partition.vertices import Ints, Vertices

_NOTHING = BlockArrays(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0), np.empty(0))
_NONE = -1
_NEVER = -1  # as a stamp
# A vertex opens two blocks at the most; a line one for each of its vertices and one for each block that it closes, of which a vertex touches two.
_MOST_BLOCKS = 3
_MOST_PORTALS = 5  # of each vertex: a portal ends where one of the closed or of the opened blocks does
_BLOCKS, _PORTALS, _SLOTS, _OPEN = 0, 1, 2, 3  # what is counted in `_State.sizes`
_CLOSED, _OPENED = 0, 1
_FLOORS, _CEILINGS = 0, 1

_EDGE = record(
    "x y slope left_x left_y", "next prev out end by_floor by_ceiling"
)  # numbered by the vertex it starts at
_SLOT = record("", "floor ceiling block stamp")  # an open block, and the line that it was met on last
_SIDE = record("low high", "low_vertex high_vertex block")
_OPENING = record("north slope", "edge vertex")


class _State(NamedTuple):
    """What the sweep reads and writes; slot 0 stands for the one that no edge has."""

    edges: Records
    corners: Records
    slots: Records
    active: Ints
    blocks: Records
    portals: Records
    sides: Records
    openings: Records
    sizes: Ints


def sweep(vertices: Vertices | Window) -> FlatSlabs:
    """Return the slabs of free space, or of some lines of it.

    Parameters
    ----------
    vertices : Vertices or Window
        Of free space, or of the lines, which begin and end with open blocks.

    Returns
    -------
    FlatSlabs
        The slabs as arrays.

    Raises
    ------
    ValueError
        If the rings do not fit together, as those of valid polygons do.
    """
    v = vertices
    count = len(v.x)
    begins_with = v.begins_with if isinstance(v, Window) else _NOTHING
    most = _MOST_BLOCKS * count + len(begins_with.west) + 1
    state = _State(
        np.empty(count, _EDGE),
        np.empty(count, CORNER),
        np.empty(most, _SLOT),
        np.empty(most, np.int64),
        np.empty(most, BLOCK),
        np.empty(_MOST_PORTALS * count, PORTAL),
        np.empty((2, most), _SIDE),
        np.empty((2, most), _OPENING),
        np.array([0, 0, 1, 0]),
    )
    _lay_out(state, v.x, v.y, v.next, v.prev, v.corner, v.names)
    _begin(state, *begins_with)
    if not _sweep(state, v.line_x, v.line_start, v.order):
        raise ValueError("the rings of free space do not fit together")
    blocks = state.blocks[: state.sizes[_BLOCKS]].copy()
    portals = state.portals[: state.sizes[_PORTALS]].copy()
    first, last = (np.zeros((2, len(blocks)), np.int64) for _ in range(2))
    ways = np.empty((2, len(portals)), WAY)
    _sort(portals, first, last, ways)
    ends_with = state.slots["block"][state.active[: state.sizes[_OPEN]]]
    return FlatSlabs(blocks, portals, first, last, ways, state.corners, ends_with)


@_compiled
def _sweep(state: _State, line_x: Floats, line_start: Ints, order: Ints) -> bool:
    for line in range(len(line_x)):
        there = order[line_start[line] : line_start[line + 1]]
        if len(there) == 1 or _independent(state, line, line_x[line], there):
            for vertex in there:
                if not _vertex(state, line_x[line], vertex):
                    return False
        elif not _line(state, line, line_x[line], there):
            return False
    return True


@_uncounted
def _begin(state: _State, floor: Ints, ceiling: Ints, west: Floats, east: Floats) -> None:
    for place in range(len(floor)):
        slot = _new_slot(
            state, floor[place], ceiling[place], _new_block(state, west[place], floor[place], ceiling[place])
        )
        state.active[place] = slot
        state.blocks[place].east = east[place]
    state.sizes[_OPEN] = len(floor)


@_uncounted
def _lay_out(
    state: _State,
    x: Floats,
    y: Floats,
    after: Ints,
    before: Ints,
    corner: Any,  # noqa: ANN401 - an array of bool
    names: Ints,
) -> None:
    for one in range(len(x)):
        edge, around = state.edges[one], state.corners[one]
        other = after[one]
        edge.x, edge.y, edge.next, edge.prev = x[one], y[one], other, before[one]
        edge.end = names[one] if corner[one] else DULL_END
        edge.by_floor = edge.by_ceiling = 0
        east = x[other] - x[one]
        edge.out = 1 if east > 0.0 else -1 if east < 0.0 else 0
        run = abs(east) if east != 0.0 else 1.0
        rise = y[other] - y[one]
        left = one if east > 0.0 else other
        edge.slope = (rise if east > 0.0 else -rise) / run
        edge.left_x, edge.left_y = x[left], y[left]
        around.x, around.y = x[one], y[one]
        around.before_east, around.before_north = x[before[one]] - x[one], y[before[one]] - y[one]
        around.after_east, around.after_north = east, rise
        around.west_above = around.west_below = around.east_above = around.east_below = _NONE
        around.above = around.below = _NONE
    state.slots[0].stamp = _NEVER


@_compiled
def _sort(portals: Records, first: Ints, last: Ints, ways: Records) -> None:
    """Lay out the ways of each block one after the other, in the order in which they were made."""
    for portal in portals:
        last[0, portal.east_block] += 1
        last[1, portal.west_block] += 1
    for direction in range(2):
        place = 0
        for block in range(first.shape[1]):
            count = last[direction, block]
            first[direction, block] = last[direction, block] = place
            place += count
    for portal in portals:
        for direction in range(2):
            block, behind = (
                (portal.west_block, portal.east_block)
                if direction
                else (portal.east_block, portal.west_block)
            )
            way = ways[direction, last[direction, block]]
            last[direction, block] += 1
            way.east, way.south, way.north = portal.east, portal.low, portal.high
            way.low_end, way.high_end, way.block = portal.low_end, portal.high_end, behind


@_inlined
def _north(edges: Records, edge: int, x: float) -> float:
    one = edges[edge]
    return float(one.left_y + one.slope * (x - one.left_x))


@_uncounted
def _find(state: _State, x: float, y: float) -> int:
    low, high = 0, state.sizes[_OPEN]
    while low < high:
        middle = (low + high) // 2
        if _north(state.edges, state.slots[state.active[middle]].ceiling, x) > y:
            high = middle
        else:
            low = middle + 1
    return int(low)


@_uncounted
def _index(state: _State, slot: int, x: float) -> int:
    """Return the place of an open block, or `_NONE`."""
    one = state.slots[slot]
    place = _find(state, x, 0.5 * (_north(state.edges, one.floor, x) + _north(state.edges, one.ceiling, x)))
    if place < state.sizes[_OPEN] and state.active[place] == slot:
        return int(place)
    for other in range(state.sizes[_OPEN]):
        if state.active[other] == slot:
            return other
    return _NONE


@_inlined
def _insert(state: _State, place: int, slot: int) -> None:
    for one in range(state.sizes[_OPEN], place, -1):
        state.active[one] = state.active[one - 1]
    state.active[place] = slot
    state.sizes[_OPEN] += 1


@_inlined
def _remove(state: _State, place: int) -> None:
    state.sizes[_OPEN] -= 1
    for one in range(place, state.sizes[_OPEN]):
        state.active[one] = state.active[one + 1]


@_inlined
def _new_block(state: _State, x: float, floor: int, ceiling: int) -> int:
    number = state.sizes[_BLOCKS]
    block = state.blocks[number]
    block.west = block.east = x
    block.floor, block.ceiling = floor, ceiling
    state.sizes[_BLOCKS] += 1
    return int(number)


@_inlined
def _new_slot(state: _State, floor: int, ceiling: int, block: int) -> int:
    number = state.sizes[_SLOTS]
    slot = state.slots[number]
    slot.floor, slot.ceiling, slot.block, slot.stamp = floor, ceiling, block, _NEVER
    state.sizes[_SLOTS] += 1
    state.edges[floor].by_floor = state.edges[ceiling].by_ceiling = number
    return int(number)


@_inlined
def _new_portal(
    state: _State, x: float, low: float, high: float, low_end: int, high_end: int, west: int, east: int
) -> bool:
    if high - low <= TOLERANCE_M:
        return False
    portal = state.portals[state.sizes[_PORTALS]]
    portal.east, portal.low, portal.high = x, low, high
    portal.low_end, portal.high_end, portal.west_block, portal.east_block = low_end, high_end, west, east
    state.sizes[_PORTALS] += 1
    return True


@_uncounted
def _vertex(state: _State, x: float, vertex: int) -> bool:
    edges = state.edges
    before = edges[vertex].prev
    leaves, arrives = edges[vertex].out, edges[before].out
    if leaves == arrives:
        return bool(_bend(state, x, vertex, before, leaves > 0))
    if leaves > 0:
        rise = edges[vertex].slope - edges[before].slope
        if rise > 0.0 or (rise == 0.0 and edges[vertex].end >= 0):
            return bool(_divide(state, x, vertex, before))
        slot = _new_slot(state, vertex, before, _new_block(state, x, vertex, before))
        _insert(state, _find(state, x, edges[vertex].y), slot)
        return True
    slot = edges[vertex].by_ceiling
    if slot != edges[before].by_floor:
        return bool(_unite(state, x, vertex, before))
    if slot == 0:
        return False
    state.blocks[state.slots[slot].block].east = x
    place = _index(state, slot, x)
    if place == _NONE:
        return False
    _remove(state, place)
    return True


@_uncounted
def _bend(state: _State, x: float, vertex: int, before: int, is_floor: bool) -> bool:  # noqa: FBT001 - compiled
    edges = state.edges
    y, end = edges[vertex].y, edges[vertex].end
    number = edges[before].by_floor if is_floor else edges[vertex].by_ceiling
    if number == 0:
        return False
    slot, around = state.slots[number], state.corners[vertex]
    west = slot.block
    state.blocks[west].east = x
    if is_floor:
        slot.floor = vertex
        edges[vertex].by_floor = number
    else:
        slot.ceiling = before
        edges[before].by_ceiling = number
    east = _new_block(state, x, slot.floor, slot.ceiling)
    slot.block = east
    if is_floor:
        if _new_portal(state, x, y, _north(edges, slot.ceiling, x), end, OPEN_END, west, east):
            around.west_above, around.east_above = west, east
    elif _new_portal(state, x, _north(edges, slot.floor, x), y, OPEN_END, end, west, east):
        around.west_below, around.east_below = west, east
    return True


@_uncounted
def _divide(state: _State, x: float, vertex: int, before: int) -> bool:
    edges, around = state.edges, state.corners[vertex]
    y, end = edges[vertex].y, edges[vertex].end
    place = _find(state, x, y)
    if place >= state.sizes[_OPEN]:
        return False
    number = state.active[place]
    slot = state.slots[number]
    floor, ceiling, west = slot.floor, slot.ceiling, slot.block
    state.blocks[west].east = x
    lower = _new_block(state, x, floor, before)
    upper = _new_block(state, x, vertex, ceiling)
    slot.ceiling, slot.block = before, lower
    edges[before].by_ceiling = number
    _insert(state, place + 1, _new_slot(state, vertex, ceiling, upper))
    if _new_portal(state, x, _north(edges, floor, x), y, OPEN_END, end, west, lower):
        around.west_below, around.east_below = west, lower
    if _new_portal(state, x, y, _north(edges, ceiling, x), end, OPEN_END, west, upper):
        around.west_above, around.east_above = west, upper
    return True


@_uncounted
def _unite(state: _State, x: float, vertex: int, before: int) -> bool:
    edges, around = state.edges, state.corners[vertex]
    y, end = edges[vertex].y, edges[vertex].end
    below, above = edges[vertex].by_ceiling, edges[before].by_floor
    if below == 0 or above == 0:
        return False
    slot = state.slots[below]
    floor, lower = slot.floor, slot.block
    ceiling, upper = state.slots[above].ceiling, state.slots[above].block
    state.blocks[lower].east = state.blocks[upper].east = x
    place = _index(state, above, x)
    if place == _NONE:
        return False
    _remove(state, place)
    east = _new_block(state, x, floor, ceiling)
    slot.ceiling, slot.block = ceiling, east
    edges[ceiling].by_ceiling = below
    if _new_portal(state, x, _north(edges, floor, x), y, OPEN_END, end, lower, east):
        around.west_below, around.east_below = lower, east
    if _new_portal(state, x, y, _north(edges, ceiling, x), end, OPEN_END, upper, east):
        around.west_above, around.east_above = upper, east
    return True


@_uncounted
def _meet(state: _State, slot: int, line: int) -> bool:
    """Stamp a slot, and return whether it had not been met on the line."""
    if state.slots[slot].stamp == line:
        return False
    state.slots[slot].stamp = line
    return True


@_uncounted
def _independent(state: _State, line: int, x: float, there: Ints) -> bool:
    edges = state.edges
    stamp = -2 - line  # unlike those of `_touched`
    for vertex in there:
        before = edges[vertex].prev
        leaves, arrives = edges[vertex].out, edges[before].out
        if leaves == 0 or arrives == 0:
            return False
        first = last = _NONE
        if leaves < 0:
            first = last = edges[vertex].by_ceiling
        if arrives > 0:
            last = edges[before].by_floor
            if first == _NONE:
                first = last
        if first == _NONE:
            place = _find(state, x, edges[vertex].y)
            if place > 0:
                first = state.active[place - 1]
            if place < state.sizes[_OPEN]:
                last = state.active[place]
        # Which of the two are there: both, one or none.
        if (first != _NONE and state.slots[first].stamp == stamp) or (
            last != _NONE and state.slots[last].stamp == stamp
        ):
            return False
        if first != _NONE:
            state.slots[first].stamp = stamp
        if last != _NONE:
            state.slots[last].stamp = stamp
    return True


@_uncounted
def _met(state: _State, line: int, x: float, there: Ints) -> int:
    """Write the slots that the vertices of a line concern into the first of `_State.sides`, and return how many there are."""
    edges, met = state.edges, state.sides[_CLOSED]
    count = 0
    for vertex in there:
        before = edges[vertex].prev
        known = False
        if edges[vertex].out < 0:
            met[count].block = edges[vertex].by_ceiling
            count += _meet(state, met[count].block, line)
            known = True
        if edges[before].out > 0:
            met[count].block = edges[before].by_floor
            count += _meet(state, met[count].block, line)
            known = True
        if not known:
            place = _find(state, x, edges[vertex].y)
            if place < state.sizes[_OPEN]:
                slot = state.active[place]
                if _north(edges, state.slots[slot].floor, x) < edges[vertex].y:
                    met[count].block = slot
                    count += _meet(state, slot, line)
    return count


@_uncounted
def _touched(state: _State, line: int, x: float, there: Ints) -> int:
    """Take the open blocks that a line concerns out of the order, into the first of `_State.sides`; return how many, or `_NONE`."""
    closing = state.sides[_CLOSED]
    count = _met(state, line, x, there)
    if count == state.sizes[_OPEN]:
        for place in range(count):
            closing[place].block = state.active[place]
        state.sizes[_OPEN] = 0
        return int(count)
    for one in range(count):
        slot = closing[one].block
        if slot == 0 or _index(state, slot, x) == _NONE:
            return _NONE
    # In the order of the line; what is between them closes up.
    found = kept = 0
    for place in range(state.sizes[_OPEN]):
        slot = state.active[place]
        if state.slots[slot].stamp == line:
            closing[found].block = slot
            found += 1
        else:
            state.active[kept] = slot
            kept += 1
    state.sizes[_OPEN] = kept
    return found


@_uncounted
def _line(state: _State, line: int, x: float, there: Ints) -> bool:
    edges, corners, left, openings = state.edges, state.corners, state.sides[_CLOSED], state.openings
    closed = _touched(state, line, x, there)
    if closed == _NONE:
        return False
    floors = ceilings = 0
    for side in left[:closed]:
        slot = state.slots[side.block]
        floor, ceiling = slot.floor, slot.ceiling
        side.block = slot.block
        state.blocks[slot.block].east = x
        low_vertex, high_vertex = edges[floor].next, ceiling
        if edges[low_vertex].x == x:
            side.low, side.low_vertex = edges[low_vertex].y, low_vertex
        else:
            side.low, side.low_vertex = _north(edges, floor, x), _NONE
            _note(openings[_FLOORS, floors], side.low, edges[floor].slope, floor, _NONE)
            floors += 1
        if edges[high_vertex].x == x:
            side.high, side.high_vertex = edges[high_vertex].y, high_vertex
        else:
            side.high, side.high_vertex = _north(edges, ceiling, x), _NONE
            _note(openings[_CEILINGS, ceilings], side.high, edges[ceiling].slope, ceiling, _NONE)
            ceilings += 1
    for vertex in there:
        y = edges[vertex].y
        if edges[vertex].out > 0:
            _note(openings[_FLOORS, floors], y, edges[vertex].slope, vertex, vertex)
            floors += 1
        edge = edges[vertex].prev
        if edges[edge].out < 0:
            _note(openings[_CEILINGS, ceilings], y, edges[edge].slope, edge, vertex)
            ceilings += 1
        elif edges[edge].out == 0:
            low, high = (edge, vertex) if edges[edge].y < y else (vertex, edge)
            corners[low].above, corners[high].below = edges[high].end, edges[low].end
    if floors != ceilings:
        return False
    _open(state, x, floors)
    _join(state, x, closed, floors)
    _place(state, there, _CLOSED, closed)
    _place(state, there, _OPENED, floors)
    return True


@_inlined
def _note(opening: Any, north: float, slope: float, edge: int, vertex: int) -> None:  # noqa: ANN401 - a record
    opening.north, opening.slope, opening.edge, opening.vertex = north, slope, edge, vertex


@_uncounted
def _order(openings: Records, count: int) -> None:
    """Sort by north, then slope, then edge: mostly they are in order already."""
    for last in range(1, count):
        north, slope, edge, vertex = (
            openings[last].north,
            openings[last].slope,
            openings[last].edge,
            openings[last].vertex,
        )
        place = last
        while place > 0:
            other = openings[place - 1]
            if other.north < north or (
                other.north == north and (other.slope < slope or (other.slope == slope and other.edge < edge))
            ):
                break
            _note(openings[place], other.north, other.slope, other.edge, other.vertex)
            place -= 1
        _note(openings[place], north, slope, edge, vertex)


@_uncounted
def _open(state: _State, x: float, count: int) -> None:
    floors, ceilings, right = state.openings[_FLOORS], state.openings[_CEILINGS], state.sides[_OPENED]
    _order(floors, count)
    _order(ceilings, count)
    for one in range(count):
        floor, ceiling, side = floors[one], ceilings[one], right[one]
        block = _new_block(state, x, floor.edge, ceiling.edge)
        slot = _new_slot(state, floor.edge, ceiling.edge, block)
        side.low, side.low_vertex, side.high, side.high_vertex = (
            floor.north,
            floor.vertex,
            ceiling.north,
            ceiling.vertex,
        )
        side.block = block
        _insert(state, _slot_place(state, x, floor.north + ceiling.north), slot)


@_uncounted
def _slot_place(state: _State, x: float, target: float) -> int:
    first, last = 0, state.sizes[_OPEN]
    while first < last:
        middle = (first + last) // 2
        slot = state.slots[state.active[middle]]
        if _north(state.edges, slot.floor, x) + _north(state.edges, slot.ceiling, x) > target:
            last = middle
        else:
            first = middle + 1
    return int(first)


@_uncounted
def _join(state: _State, x: float, closed: int, opened: int) -> None:
    edges, corners = state.edges, state.corners
    i = j = 0
    while i < closed and j < opened:
        left, right = state.sides[_CLOSED, i], state.sides[_OPENED, j]
        if left.low > right.low:
            low, low_vertex = left.low, left.low_vertex
        else:
            low, low_vertex = right.low, right.low_vertex
        if left.low == right.low and low_vertex < 0:
            low_vertex = left.low_vertex
        if left.high < right.high:
            high, high_vertex = left.high, left.high_vertex
        else:
            high, high_vertex = right.high, right.high_vertex
        if left.high == right.high and high_vertex < 0:
            high_vertex = left.high_vertex
        low_end = edges[low_vertex].end if low_vertex >= 0 else OPEN_END
        high_end = edges[high_vertex].end if high_vertex >= 0 else OPEN_END
        _new_portal(state, x, low, high, low_end, high_end, left.block, right.block)
        if high - low > TOLERANCE_M and low_end != OPEN_END and high_end != OPEN_END:
            corners[low_vertex].above, corners[high_vertex].below = high_end, low_end
        if left.high < right.high:
            i += 1
        else:
            j += 1


@_uncounted
def _place(state: _State, there: Ints, which: int, count: int) -> None:
    sides = state.sides[which]
    for vertex in there:
        y, around = state.edges[vertex].y, state.corners[vertex]
        above = below = _NONE
        for side in sides[:count]:
            if side.low <= y and side.high - y > TOLERANCE_M:
                above = side.block
            if y - side.low > TOLERANCE_M and y <= side.high:
                below = side.block
        if which == _CLOSED:
            around.west_above, around.west_below = above, below
        else:
            around.east_above, around.east_below = above, below
