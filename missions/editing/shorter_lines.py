"""Lines with fewer points: what leaving one out does, and where two corners become one."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.geo import LatLon, bearing_deg, distance_m
from missions.items import Command
from missions.situation import Mission

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from missions.items import MissionItem

_MOST_TURN_DEG = 120.0  # of two corners together: beyond, the lines meet far off. Chosen, not measured


def without(mission: Mission, out: Collection[int]) -> tuple[Mission, tuple[int, ...]]:
    """Return a mission without some of its items, its jumps renumbered, and the seqs that its items had.

    A jump to an item that is left out leads to the next one that is there.
    """
    seqs = tuple(seq for seq in range(1, len(mission.items) + 1) if seq not in out)
    number = {seq: new for new, seq in enumerate(seqs, 1)}
    items = []
    for seq in seqs:
        item = mission.items[seq - 1]
        if item.command == Command.DO_JUMP and 1 <= item.params[0] <= len(mission.items):
            goal = next(one for one in range(int(item.params[0]), len(mission.items) + 1) if one in number)
            item = replace(item, params=(float(number[goal]), *item.params[1:]))
        items.append(item)
    return Mission(tuple(items), mission.home), seqs


def runs(seqs: Sequence[int], count: int) -> Iterable[tuple[int, ...]]:
    """Return every group of so many seqs that follow one another."""
    return (tuple(seqs[begin : begin + count]) for begin in range(len(seqs) - count + 1))


def meeting_place(a: LatLon, b: LatLon, c: LatLon, d: LatLon) -> LatLon | None:
    """Return where the lines from a over b and from d over c meet, if both corners turn the same way and not too far."""
    if a == b or c == d:
        return None
    along_deg = bearing_deg(b, c)
    at_b_deg, at_c_deg = _turn_deg(bearing_deg(a, b), along_deg), _turn_deg(along_deg, bearing_deg(c, d))
    whole_deg = at_b_deg + at_c_deg
    if at_b_deg * at_c_deg <= 0 or abs(whole_deg) > _MOST_TURN_DEG:
        return None
    # The sines of the triangle that b, c and the meeting make.
    share = math.sin(math.radians(at_c_deg)) / math.sin(math.radians(whole_deg))
    beyond = share * distance_m(b, c) / distance_m(a, b)
    return LatLon(b.lat_deg + beyond * (b.lat_deg - a.lat_deg), b.lon_deg + beyond * (b.lon_deg - a.lon_deg))


def _turn_deg(before_deg: float, after_deg: float) -> float:
    return (after_deg - before_deg + 180.0) % 360.0 - 180.0


def deviation_m(before: MissionItem, item: MissionItem, after: MissionItem) -> float:
    """Return how far an item is from the line between its neighbours, or from the nearer of them."""
    along_deg = bearing_deg(before.position, after.position)
    turn_rad = math.radians(bearing_deg(before.position, item.position) - along_deg)
    leg_m = distance_m(before.position, item.position)
    beyond_m = distance_m(item.position, after.position)
    return min(leg_m, beyond_m) if math.cos(turn_rad) <= 0 else abs(leg_m * math.sin(turn_rad))


def length_m(items: Iterable[MissionItem]) -> float:
    """Return the length of the lines through the items that have a place."""
    places = [item.position for item in items if item.is_placed]
    return sum(distance_m(a, b) for a, b in pairwise(places))
