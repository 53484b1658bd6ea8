"""Missions longer than the vehicle holds: what a route has put in itself is left out again, as far as its clearance allows.

Waypoints that hardly bend the line go first, then changes of speed: a quick stretch between two slow ones is driven slowly too. Each
step is checked as any mission is, its driven band included; what breaks then is put back. Places, commands and speeds that were
asked for are never touched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.check import check_mission
from missions.errors import MissionTooLongError
from missions.geo import bearing_deg, distance_m
from missions.items import Command
from missions.situation import Mission

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from missions.check import CheckedLeg, MissionCheck
    from missions.items import MissionItem
    from missions.request import Request
    from missions.situation import Situation

_JUMPS = (Command.DO_JUMP, 601)
_WORSE_M = 0.01


def shortened(
    mission: Mission,
    own: Collection[int],
    situation: Situation,
    request: Request,
    *,
    most: int,
    may_slow: bool = False,
    should_stop: Callable[[], bool] | None = None,
) -> MissionCheck:
    """Leave items out of a mission until it fits.

    Parameters
    ----------
    mission : Mission
        The items, without the home item.
    own : collection of int
        Seqs of the items that may be left out: NAV_WAYPOINT and DO_CHANGE_SPEED that a route has put in.
    situation, request : Situation, Request
        As for `missions.check.check_mission`.
    most : int
        The items that there may be, home not included.
    may_slow : bool
        Whether places that are not left out may be come to more slowly.
    should_stop : callable, optional
        Asked now and then; True ends the search.

    Returns
    -------
    MissionCheck
        The shorter mission, and that it keeps what the longer one kept.

    Raises
    ------
    MissionTooLongError
        It cannot be shortened so far; says how far.
    """
    search = _Search(mission, frozenset(own), situation, request, most, may_slow, should_stop)
    search.leave_out(search.waypoints)
    search.leave_out(search.quick_stretches)
    search.leave_out(search.waypoints)  # some stood between changes of speed
    if search.count > most:
        raise MissionTooLongError(
            f"the mission needs {search.count + 1} items with home, and the vehicle holds {most + 1}: {len(mission.items) - search.count} of "
            f"{len(own)} items of its route could be left out without coming nearer to a fence; give fewer targets, or drive in parts",
            items=search.count + 1,
            limit=most + 1,
            left_out=len(mission.items) - search.count,
        )
    return search.check


_Group = tuple[int, ...]
"""Seqs of items that are left out together."""


@dataclass
class _Search:
    """What is left out, by the seqs of the mission as it was."""

    mission: Mission
    own: frozenset[int]
    situation: Situation
    request: Request
    most: int
    may_slow: bool
    should_stop: Callable[[], bool] | None

    def __post_init__(self) -> None:
        self.out: frozenset[int] = frozenset()
        self.check = check_mission(self.mission, self.situation, self.request)
        self._tolerated = {
            (leg.leg.first_item, leg.leg.last_item): leg.driven_clearance_m for leg in self.check.broken
        }
        near = {seq for key in self._tolerated for seq in range(key[0], key[1] + 2)}
        self._kept: set[_Group] = {(seq,) for seq in near}  # what must not be left out

    @property
    def count(self) -> int:
        """How many items there are now."""
        return len(self.mission.items) - len(self.out)

    def leave_out(self, candidates: Callable[[], list[_Group]]) -> None:
        """Leave out the best candidates, as many as are needed, until it fits or there are no more."""
        while self.count > self.most and not (self.should_stop and self.should_stop()):
            groups = self._needed(candidates())
            if not groups:
                return
            while groups:
                out = self.out.union(*groups)
                mission, seqs = without(self.mission, out)
                check = check_mission(mission, self.situation, self.request)
                worse = [leg for leg in check.broken if self._is_worse(leg, seqs)]
                if not worse and not check.troubles:
                    self.out, self.check = out, check
                    break
                guilty = self._guilty(groups, worse, seqs) or set(groups)
                self._kept |= guilty
                groups = [group for group in groups if group not in guilty]

    def waypoints(self) -> list[_Group]:
        """Give waypoints that may be left out, those first whose leaving moves the line the least."""
        rest = self._rest()
        found = []
        for before, seq, after in zip(rest, rest[1:], rest[2:], strict=False):
            items = [self.mission.items[one - 1] for one in (before, seq, after)]
            if self._may_go(seq, Command.NAV_WAYPOINT) and all(item.is_placed for item in items):
                found.append((_deviation_m(*items), (seq,)))
        return [group for _, group in sorted(found)]

    def quick_stretches(self) -> list[_Group]:
        """Give changes to a higher speed, with the change back where that has nothing left to do; those first that save the least time."""
        goals = {int(item.params[0]) for item in self.mission.items if item.command in _JUMPS}
        found = []
        before_mps = self.check.vehicle.speed_mps
        rest = self._rest()
        places = [place for place, seq in enumerate(rest) if self._is_speed(seq)]
        for place, following in pairwise(places):
            seq, last = rest[place], rest[following]
            mps, next_mps = self._speed(seq), self._speed(last)
            between = rest[place : following + 1]
            if (
                before_mps < mps
                and all(self._may_go(one) for one in (seq, last))
                and all((self.may_slow or one in self.own) and one not in goals for one in between)
            ):
                group = (seq, last) if next_mps == before_mps else (seq,)
                found.append((_length_m([self.mission.items[one - 1] for one in between]), group))
            before_mps = mps
        return [group for _, group in sorted(found)]

    def _rest(self) -> list[int]:
        return [seq for seq in range(1, len(self.mission.items) + 1) if seq not in self.out]

    def _is_speed(self, seq: int) -> bool:
        return self.mission.items[seq - 1].command == Command.DO_CHANGE_SPEED

    def _speed(self, seq: int) -> float:
        return self.mission.items[seq - 1].params[1]

    def _may_go(self, seq: int, command: int = Command.DO_CHANGE_SPEED) -> bool:
        item = self.mission.items[seq - 1]
        return (
            seq in self.own
            and item.command == command
            and (seq,) not in self._kept
            and not (command == Command.NAV_WAYPOINT and item.params[0] > 0)
        )

    def _needed(self, groups: Sequence[_Group]) -> list[_Group]:
        """Give so many of the better half as are needed, no two of them beside one another."""
        taken: list[_Group] = []
        blocked: set[int] = set()
        rest = self._rest()
        place = {seq: number for number, seq in enumerate(rest)}
        missing = self.count - self.most
        for group in groups[: (len(groups) + 1) // 2]:
            if missing <= 0:
                break
            around = range(place[group[0]] - 1, place[group[-1]] + 2)
            if group in self._kept or not blocked.isdisjoint(around):
                continue
            blocked.update(around)
            taken.append(group)
            missing -= len(group)
        return taken

    def _is_worse(self, leg: CheckedLeg, seqs: Sequence[int]) -> bool:
        """Tell whether a broken leg was none before, or less so."""
        key = (_seq(seqs, leg.leg.first_item), _seq(seqs, leg.leg.last_item))
        return leg.driven_clearance_m < self._tolerated.get(key, math.inf) - _WORSE_M

    def _guilty(
        self, groups: Iterable[_Group], worse: Iterable[CheckedLeg], seqs: Sequence[int]
    ) -> set[_Group]:
        """Give the groups that lie on the legs that broke, or on those beside them."""
        guilty = set()
        for leg in worse:
            first, last = sorted((leg.leg.first_item, leg.leg.last_item))
            begin, end = _seq(seqs, max(0, first - 2)), _seq(seqs, min(len(seqs), last + 2))
            guilty |= {group for group in groups if any(begin <= seq <= end for seq in group)}
        return guilty


def without(mission: Mission, out: Collection[int]) -> tuple[Mission, tuple[int, ...]]:
    """Give a mission without some of its items, its jumps numbered anew, and the seqs that its items had.

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


def _seq(seqs: Sequence[int], number: int) -> int:
    """Give the seq that an item had; 0 is the start."""
    return seqs[number - 1] if number else 0


def _deviation_m(before: MissionItem, item: MissionItem, after: MissionItem) -> float:
    """Give how far an item is from the line between its neighbours, or from the nearer of them."""
    along_deg = bearing_deg(before.position, after.position)
    turn_rad = math.radians(bearing_deg(before.position, item.position) - along_deg)
    leg_m = distance_m(before.position, item.position)
    beyond_m = distance_m(item.position, after.position)
    return min(leg_m, beyond_m) if math.cos(turn_rad) <= 0 else abs(leg_m * math.sin(turn_rad))


def _length_m(items: Iterable[MissionItem]) -> float:
    places = [item.position for item in items if item.is_placed]
    return sum(distance_m(a, b) for a, b in pairwise(places))
