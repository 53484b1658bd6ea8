"""A mission's items as they are edited: jumps hold on to the item they lead to, whatever is put in between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from missions.checking.execution import is_navigation
from missions.items import Command, CoordinateFrame, MissionItem
from missions.situation import Mission

if TYPE_CHECKING:
    from collections.abc import Iterable

    from missions.checking.execution import CourseLeg

LegKey = tuple[int, int, int | None]
"""A leg by its items: from seq, to seq, the jump taken in between."""

_CONDITION_DISTANCE = 114  # MAV_CMD_CONDITION_DISTANCE
_JUMP_TAG, _DO_JUMP_TAG = 600, 601  # MAV_CMD_JUMP_TAG, MAV_CMD_DO_JUMP_TAG
_FOREVER = -1.0  # DO_JUMP param2: repeat without end


@dataclass(eq=False)
class _Entry:
    """One item, as it is and where it comes from.

    Parameters
    ----------
    item : MissionItem
        What it is.
    seq : int or None
        Its number in the mission as it was.
    leg : tuple or None
        The leg that it was put in for.
    goal : _Entry or None
        Where it jumps to.
    is_after : bool
        Whether it was put in after the place that the leg leads to.
    """

    item: MissionItem
    seq: int | None = None
    leg: LegKey | None = None
    goal: _Entry | None = None
    is_after: bool = False


class ItemList:
    """A mission being repaired.

    Parameters
    ----------
    mission : Mission
        As it was; its jumps lead to items that are there.
    """

    def __init__(self, mission: Mission) -> None:
        self._home = mission.home
        self._old = [_Entry(item, seq) for seq, item in enumerate(mission.items, 1)]
        for entry in self._old:
            if entry.item.command == Command.DO_JUMP and 1 <= entry.item.params[0] <= len(self._old):
                entry.goal = self._old[int(entry.item.params[0]) - 1]
        self._entries = list(self._old)
        self.added: dict[LegKey, int] = {}
        self.changed: dict[int, tuple[MissionItem, MissionItem]] = {}

    @property
    def jumps(self) -> int:
        """How many jumps there are."""
        return sum(entry.item.command in (Command.DO_JUMP, _DO_JUMP_TAG) for entry in self._entries)

    @property
    def own_seqs(self) -> frozenset[int]:
        """Return the seqs of the waypoints and speed changes that routes have put in before the places of the mission."""
        return frozenset(
            seq
            for seq, entry in enumerate(self._entries, 1)
            if entry.leg is not None
            and not entry.is_after
            and entry.item.command in (Command.NAV_WAYPOINT, Command.DO_CHANGE_SPEED)
        )

    def mission(self) -> Mission:
        """Return the mission as it is now, its jumps renumbered."""
        number = {id(entry): seq for seq, entry in enumerate(self._entries, 1)}
        return Mission(
            tuple(
                replace(entry.item, params=(float(number[id(entry.goal)]), *entry.item.params[1:]))
                if entry.goal is not None
                else entry.item
                for entry in self._entries
            ),
            self._home,
        )

    def origin(self, leg: CourseLeg) -> LegKey:
        """Return the leg of the original mission that a leg of the present one belongs to."""
        first = self._entries[leg.first_item - 1] if leg.first_item else None
        last = self._entries[leg.last_item - 1]
        for entry in (last, first):
            if entry is not None and entry.leg is not None:
                return entry.leg
        jump = self._entries[leg.jump_item - 1].seq if leg.jump_item else None
        return (first.seq or 0) if first else 0, last.seq or 0, jump

    def replace_leg(
        self,
        key: LegKey,
        before: Iterable[MissionItem],
        goal: MissionItem,
        after: Iterable[MissionItem] = (),
    ) -> None:
        """Put a route in the place of a leg.

        Parameters
        ----------
        key : LegKey
            The leg, by the numbers of the mission as it was.
        before : iterable of MissionItem
            What is driven before the place that the leg leads to.
        goal : MissionItem
            That place's item, which may have been moved.
        after : iterable of MissionItem
            What comes right after it.
        """
        _, last, jump = key
        entry = self._old[last - 1]
        if goal != entry.item:
            self.changed[last] = (self.changed.get(last, (entry.item, goal))[0], goal)
            entry.item = goal
        put = [_Entry(item, leg=key) for item in before]
        self.added[key] = sum(is_navigation(one.item) for one in put)
        if jump is None:
            at = self._place_before(key)
            self._entries[at:at] = put
        elif put:
            self._put_on_jump(self._old[jump - 1], put)
        here = self._entries.index(entry) + 1
        self._entries[here:here] = [_Entry(item, leg=key, is_after=True) for item in after]

    def _place_before(self, key: LegKey) -> int:
        """Return where a leg's new places belong: just before the one it leads to.

        But before a condition on the distance to that place, which would else be taken for that to the first new one, and before what
        jumps lead to, which are no part of this leg.
        """
        goal = self._entries.index(self._old[key[1] - 1])
        first = self._entries.index(self._old[key[0] - 1]) + 1 if key[0] else 0
        goals = {id(entry.goal) for entry in self._entries}
        at = goal
        for index in range(goal - 1, first - 1, -1):
            entry = self._entries[index]
            if is_navigation(entry.item) or entry.goal is not None:
                break
            if entry.item.command in (_CONDITION_DISTANCE, _JUMP_TAG) or id(entry) in goals:
                at = index
        return at

    def _put_on_jump(self, jump: _Entry, put: list[_Entry]) -> None:
        """Let a jump lead over new places, which the vehicle passes by when the jump's count is used up.

        ``jump to 2, n times`` becomes ``jump over; the places; jump to 2; jump to the places, n times``.
        """
        at = self._entries.index(jump)
        item, goal = jump.item, jump.goal
        if item.params[1] < 0:  # always taken
            self._entries[at:at] = put
            return
        over = _Entry(_jump(_FOREVER), leg=put[0].leg, goal=jump)
        on = _Entry(
            replace(item, params=(item.params[0], _FOREVER, *item.params[2:])), leg=put[0].leg, goal=goal
        )
        jump.item, jump.goal = replace(item, command=Command.DO_JUMP), put[0]
        self._entries[at:at] = [over, *put, on]


def _jump(times: float) -> MissionItem:
    return MissionItem(Command.DO_JUMP, CoordinateFrame.MISSION, (0.0, times, 0.0, 0.0))
