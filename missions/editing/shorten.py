"""Missions longer than the vehicle holds: what a route has put in itself is left out again, as far as its clearance allows.

Waypoints that hardly bend the line go first; then two corners one after the other become one, where their outer lines meet; then
changes of speed: a quick stretch between two slow ones is driven slowly too. Each step is checked as any mission is, its driven band
included; what breaks then is put back. Places, commands and speeds that were asked for are never touched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.checking.check import check_mission
from missions.editing.shorter_lines import deviation_m, length_m, meeting_place, runs, without
from missions.errors import MissionTooLongError
from missions.geo import distance_m, to_e7
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.items import MissionItem
    from missions.request import Request
    from missions.situation import Mission, Situation

_JUMPS = (Command.DO_JUMP, 601)
_WORSE_M = 0.01  # a leg that breaks the promise already may lose so much more to a shorter mission; chosen, not measured


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
        As for `missions.checking.check.check_mission`.
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
        It cannot be shortened so far; the message says how far.
    """
    search = _Shortening(mission, frozenset(own), situation, request, most, may_slow, should_stop)
    search.leave_out(search.waypoints)
    search.leave_out(search.corners)
    search.leave_out(search.quick_stretches)
    for again in (search.waypoints, search.corners):  # some stood between changes of speed
        search.leave_out(again)
    if search.count > most:
        home = search.check.vehicle.home_items
        raise MissionTooLongError(
            f"the mission needs {search.count + home} items{' including home' if home else ''}, but the vehicle holds {most + home}; {len(mission.items) - search.count} of "
            f"{len(own)} route items could be left out without coming closer to a fence",
            items=search.count + home,
            limit=most + home,
            left_out=len(mission.items) - search.count,
        )
    return search.check


@dataclass(frozen=True, slots=True)
class _Removal:
    """Seqs of items that are left out together; where ``put`` is given, it stands in the place of the last of them."""

    seqs: tuple[int, ...]
    put: MissionItem | None = None

    @property
    def out(self) -> tuple[int, ...]:
        return self.seqs if self.put is None else self.seqs[:-1]


@dataclass
class _Shortening:
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
        self.put: dict[int, MissionItem] = {}
        self.check = check_mission(self.mission, self.situation, self.request)
        self._tolerated = {
            (leg.leg.first_item, leg.leg.last_item): leg.driven_clearance_m for leg in self.check.broken
        }
        near = {seq for key in self._tolerated for seq in range(key[0], key[1] + 2)}
        self._near = near
        self._kept: set[tuple[int, ...]] = {(seq,) for seq in near}  # what must not be left out

    @property
    def count(self) -> int:
        """How many items there are now."""
        return len(self.mission.items) - len(self.out)

    def leave_out(self, candidates: Callable[[], list[_Removal]]) -> None:
        """Take the best candidates, as many as are needed, until it fits or there are no more."""
        while self.count > self.most and not (self.should_stop and self.should_stop()):
            steps = self._needed(candidates())
            if not steps:
                return
            while steps:
                out = self.out.union(*(step.out for step in steps))
                put = {**self.put, **{step.seqs[-1]: step.put for step in steps if step.put is not None}}
                mission, seqs = without(self._with(put), out)
                check = check_mission(mission, self.situation, self.request)
                worse = [leg for leg in check.broken if self._is_worse(leg, seqs)]
                if not worse and not check.troubles:
                    self.out, self.put, self.check = out, put, check
                    break
                guilty = self._guilty(steps, worse, seqs) or set(steps)
                self._kept |= {step.seqs for step in guilty}
                steps = [step for step in steps if step not in guilty]

    def _with(self, put: Mapping[int, MissionItem]) -> Mission:
        items = (put.get(seq, item) for seq, item in enumerate(self.mission.items, 1))
        return replace(self.mission, items=tuple(items))

    def waypoints(self) -> list[_Removal]:
        """Return waypoints that may be left out, first those whose removal moves the line the least."""
        found = []
        for before, seq, after in runs(self._rest(), 3):
            items = [self._item(one) for one in (before, seq, after)]
            if self._may_go(seq, Command.NAV_WAYPOINT) and all(item.is_placed for item in items):
                found.append((deviation_m(*items), seq))
        return [_Removal((seq,)) for _, seq in sorted(found)]

    def corners(self) -> list[_Removal]:
        """Return pairs of corners that may become one, first those that lengthen the way the least."""
        found = []
        for before, first, last, after in runs(self._rest(), 4):
            a, b, c, d = (self._item(one) for one in (before, first, last, after))
            if not (a.is_placed and d.is_placed) or not all(self._is_corner(one) for one in (first, last)):
                continue
            meeting = meeting_place(a.position, b.position, c.position, d.position)
            if meeting is not None:
                lat_e7, lon_e7 = to_e7(meeting)
                there_m = distance_m(b.position, meeting) + distance_m(meeting, c.position)
                put = replace(c, lat_e7=lat_e7, lon_e7=lon_e7)
                found.append((there_m - distance_m(b.position, c.position), first, last, put))
        return [
            _Removal((first, last), put) for _, first, last, put in sorted(found, key=lambda one: one[:3])
        ]

    def _is_corner(self, seq: int) -> bool:
        """Return whether an item is a plain waypoint of the route's own that may be moved: beside others that must stay, it may not."""
        item = self.mission.items[seq - 1]
        return (
            seq in self.own
            and item.command == Command.NAV_WAYPOINT
            and not item.params[0] > 0
            and seq not in self._near
        )

    def quick_stretches(self) -> list[_Removal]:
        """Return changes to a higher speed, with the change back where it has nothing left to do, first those that save the least time."""
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
                seqs = (seq, last) if next_mps == before_mps else (seq,)
                found.append((length_m([self._item(one) for one in between]), seqs))
            before_mps = mps
        return [_Removal(seqs) for _, seqs in sorted(found)]

    def _item(self, seq: int) -> MissionItem:
        return self.put.get(seq, self.mission.items[seq - 1])

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

    def _needed(self, steps: Sequence[_Removal]) -> list[_Removal]:
        """Return as many of the better half as are needed, no two of them neighbours."""
        taken: list[_Removal] = []
        blocked: set[int] = set()
        place = {seq: number for number, seq in enumerate(self._rest())}
        missing = self.count - self.most
        steps = [step for step in steps if step.seqs not in self._kept]
        for step in steps[: (len(steps) + 1) // 2]:
            if missing <= 0:
                break
            around = range(place[step.seqs[0]] - 1, place[step.seqs[-1]] + 2)
            if not blocked.isdisjoint(around):
                continue
            blocked.update(around)
            taken.append(step)
            missing -= len(step.out)
        return taken

    def _is_worse(self, leg: CheckedLeg, seqs: Sequence[int]) -> bool:
        """Return whether a broken leg kept its clearance before, or broke it by less."""
        key = (_seq(seqs, leg.leg.first_item), _seq(seqs, leg.leg.last_item))
        return leg.driven_clearance_m < self._tolerated.get(key, math.inf) - _WORSE_M

    def _guilty(
        self, steps: Iterable[_Removal], worse: Iterable[CheckedLeg], seqs: Sequence[int]
    ) -> set[_Removal]:
        """Return the steps that lie on the legs that broke, or on legs beside them."""
        guilty = set()
        for leg in worse:
            first, last = sorted((leg.leg.first_item, leg.leg.last_item))
            begin, end = _seq(seqs, max(0, first - 2)), _seq(seqs, min(len(seqs), last + 2))
            guilty |= {step for step in steps if any(begin <= seq <= end for seq in step.seqs)}
        return guilty


def _seq(seqs: Sequence[int], number: int) -> int:
    """Return the seq that an item had; 0 is the start."""
    return seqs[number - 1] if number else 0
