"""AUTO: which mission item is driven, and what the items between the waypoints do (ArduPilot's AP_Mission and ModeAuto)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.items import Command, MissionItem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mavlink_bridge.simulator.drive import Driver
    from mavlink_bridge.simulator.flat import FlatFrame

_TURNS = (Command.NAV_LOITER_TURNS, Command.NAV_LOITER_TIME)
_PLACED = (Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LAND, Command.NAV_TAKEOFF, *_TURNS)
_NAVIGATION = (*_PLACED, Command.NAV_RETURN_TO_LAUNCH, Command.NAV_DELAY)
_MAX_COMMANDS = 64  # passed at once, so that jumps in a circle end; chosen, not measured


class MissionRun:
    """The mission as it is driven.

    Parameters
    ----------
    items : callable
        Returns the mission as it reads back; item 0 is home.
    drive : Driver
        The driver.
    frame : FlatFrame
        Where the driver's metres count from.
    return_place : callable
        Returns where RTL leads from where the rover is.
    """

    def __init__(
        self,
        items: Callable[[], Sequence[MissionItem]],
        drive: Driver,
        frame: FlatFrame,
        return_place: Callable[[], complex],
    ) -> None:
        self._return_place = return_place
        self._items = items
        self._drive = drive
        self._frame = frame
        self.seq = 0
        self.is_complete = False
        self.reached: list[int] = []
        self.texts: list[str] = []
        self._watched: tuple[MissionItem, ...] = ()
        self._wait_until_s: float | None = None
        self._jumps: dict[int, int] = {}

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to drive."""
        return len(self._items()) <= 1

    def start(self, now_s: float) -> None:
        """Begin or resume; a mission that was complete begins anew."""
        if self.is_complete or self.seq == 0 or self.seq >= len(self._items()):
            self.restart()
        self._drive.stop()
        self._go_on(max(1, self.seq), now_s)

    def restart(self) -> None:
        """Begin at the first item next time."""
        self.seq = 0
        self.is_complete = False
        self._jumps.clear()

    def set_current(self, seq: int, *, now_s: float, driving: bool) -> bool:
        """Go to an item; return whether there is one."""
        if not 0 <= seq < max(1, len(self._items())):
            return False
        self.seq = max(1, seq)
        self.is_complete = False
        if driving:
            self._drive.stop()
            self._go_on(self.seq, now_s)
        return True

    def step(self, now_s: float) -> None:
        """Look whether the item is done, and whether the mission has changed under way."""
        if self.is_complete:
            return
        if self._upcoming(self.seq) != self._watched:
            self.texts.append("Auto mission changed, restarted command")
            self._drive.stop()
            self._go_on(self.seq, now_s)
            return
        item = self._items()[self.seq]
        if item.command == Command.NAV_DELAY:
            self._wait(item.params[0], now_s)
        elif self._drive.has_arrived and item.command != Command.NAV_LOITER_UNLIM:
            if item.command in (Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME) and item.params[0] > 0:
                self._wait(item.params[0], now_s)
            else:
                self._done(now_s)

    def _wait(self, wait_s: float, now_s: float) -> None:
        if self._wait_until_s is None:
            self._wait_until_s = now_s + wait_s
        elif now_s >= self._wait_until_s:
            self._done(now_s)

    def _done(self, now_s: float) -> None:
        self.reached.append(self.seq)
        self.texts.append(f"Reached waypoint #{self.seq}")
        self._go_on(self.seq + 1, now_s)

    def _go_on(self, seq: int, now_s: float) -> None:
        """Do what stands from ``seq`` on until a navigation item is found, and drive to that."""
        self._wait_until_s = None
        found = self._run_commands(seq)
        if found is None:
            self._complete()
            return
        self.seq = found
        self._watched = self._upcoming(found)
        item = self._items()[found]
        self.texts.append(f"Mission: {found} {_SHORT_NAMES.get(item.command, 'WP')}")
        place_m = self._place(item)
        if place_m is None:
            self._drive.stop()
            self._wait(item.params[0], now_s)
        else:
            self._drive.go_to(place_m, self._next_place(found))

    def _run_commands(self, seq: int) -> int | None:
        items = self._items()
        for _ in range(_MAX_COMMANDS):
            if seq >= len(items):
                return None
            item = items[seq]
            if item.command in _NAVIGATION:
                return seq
            if item.command == Command.DO_CHANGE_SPEED and item.params[1] > 0:
                self._drive.change_speed(item.params[1])
            seq = self._after(seq, self._jumps)
        return None

    def _after(self, seq: int, jumps: dict[int, int]) -> int:
        """Return what follows an item, counting jumps in ``jumps``."""
        item = self._items()[seq]
        if item.command != Command.DO_JUMP:
            return seq + 1
        target, times = int(item.params[0]), int(item.params[1])
        done = jumps.get(seq, 0)
        if 0 <= times <= done:
            return seq + 1
        jumps[seq] = done + 1
        return target

    def _next_place(self, seq: int) -> complex | None:
        """Return the place after an item at which the rover need not stop; None if it must."""
        items = self._items()
        if items[seq].command != Command.NAV_WAYPOINT or items[seq].params[0] > 0:
            return None
        jumps = dict(self._jumps)
        for _ in range(_MAX_COMMANDS):
            seq = self._after(seq, jumps)
            if seq >= len(items):
                return None
            if items[seq].command in _NAVIGATION:
                return self._place(items[seq])
        return None

    def _place(self, item: MissionItem) -> complex | None:
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            return self._return_place()
        if item.command not in _PLACED:
            return None
        if (item.lat_e7, item.lon_e7) == (0, 0):
            return self._drive.body.position_m
        return self._frame.to_flat(item.position)

    def _upcoming(self, seq: int) -> tuple[MissionItem, ...]:
        return tuple(item for item in self._items()[seq : seq + 8] if item.command in _NAVIGATION)[:3]

    def _complete(self) -> None:
        self.is_complete = True
        self._drive.stop()
        self.texts.append("Mission Complete")


_SHORT_NAMES: dict[int, str] = {
    Command.NAV_WAYPOINT: "WP",
    Command.NAV_LOITER_UNLIM: "LoitUnlim",
    Command.NAV_LOITER_TURNS: "LoitTurns",
    Command.NAV_LOITER_TIME: "LoitTime",
    Command.NAV_RETURN_TO_LAUNCH: "RTL",
    Command.NAV_DELAY: "Delay",
}
