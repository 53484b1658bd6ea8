"""What a mission has a rover drive: its items followed in the order in which the autopilot executes them, jumps and all.

The commands that ArduPilot Rover executes (ModeAuto::start_command), and what it does with them (AP_Mission): DO_ commands between two
places take effect as the leg to the second one begins; jumps count how often they were taken and are passed by when the count is used up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from missions.items import PLACED_COMMANDS as _PLACED
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.situation import Mission

MOST_LEGS = 2000
"""Missions that repeat themselves longer than this are followed with each jump taken twice: every leg there is occurs in that."""

_FEW_TIMES = 2  # a jump taken twice and then passed: every leg that a repeated jump makes occurs
_SKIPPED = {Command.NAV_TAKEOFF: "TAKEOFF", Command.NAV_LAND: "LAND"}
_STRAYING = {
    Command.NAV_GUIDED_ENABLE: "hands control to a companion computer (NAV_GUIDED_ENABLE)",
    Command.NAV_SET_YAW_SPEED: "drives by heading and speed (NAV_SET_YAW_SPEED)",
    42702: "hands control to a Lua script (NAV_SCRIPT_TIME)",
    42703: "holds an attitude (NAV_ATTITUDE_TIME)",
}
_CONDITIONS = range(112, 160)
CIRCLE_M = 20.0
"""ArduPilot Rover's CIRC_RADIUS, for LOITER_TURNS without a radius of its own."""


@dataclass(frozen=True, slots=True)
class CourseLeg:
    """A straight leg that a mission has the vehicle drive.

    Parameters
    ----------
    first_item, last_item : int
        Seq of the items that it leaves and leads to; 0 is where the vehicle stands (home in ArduPilot's count).
    start, end : LatLon
        From where to where.
    jump_item : int or None
        Seq of the jump that was taken between them.
    speed_mps : float or None
        What DO_CHANGE_SPEED asked for; None is the vehicle's own speed.
    stop_s : float or None
        How long it stops at the end; None where it drives on.
    circle_m : float
        The radius it circles with at the end (LOITER_TURNS); 0 where it does not.
    is_return : bool
        Whether it is the straight line of an RTL item.
    """

    first_item: int
    last_item: int
    start: LatLon
    end: LatLon
    jump_item: int | None = None
    speed_mps: float | None = None
    stop_s: float | None = None
    circle_m: float = 0.0
    is_return: bool = False


@dataclass(frozen=True, slots=True)
class Course:
    """The legs of a mission in the order in which they are driven.

    Parameters
    ----------
    legs : tuple of CourseLeg
        Each as often as it is driven.
    troubles : tuple of str
        What was not understood: where the vehicle goes then is not known.
    notes : tuple of str
        Further remarks.
    is_endless : bool
        Whether the mission goes round without end.
    ends_in_loiter : bool
        Whether it ends with LOITER_UNLIM.
    """

    legs: tuple[CourseLeg, ...]
    troubles: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    is_endless: bool = False
    ends_in_loiter: bool = False

    @property
    def path(self) -> tuple[LatLon, ...]:
        """The places between the legs, the start first."""
        return (self.legs[0].start, *(leg.end for leg in self.legs))


def is_navigation(item: MissionItem) -> bool:
    """Return whether an item is a navigation command: one that the vehicle is busy with until it is done (AP_Mission::is_nav_cmd)."""
    return 0 < item.command <= Command.NAV_LAST or item.command in _STRAYING


def follow_mission(
    mission: Mission,
    start: LatLon | None,
    *,
    return_to: Callable[[LatLon, LatLon | None], LatLon | None] = lambda _here, home: home,
    home: LatLon | None = None,
    return_speed_mps: float | None = None,
    circle_m: float = CIRCLE_M,
    own_speed_mps: float = 0.0,
    most_legs: int = MOST_LEGS,
) -> Course:
    """Follow a mission from its first item to its end.

    Parameters
    ----------
    mission : Mission
        The items, without the home item.
    start : LatLon or None
        Where the vehicle stands; not known: the first leg is the one from the first place.
    return_to : callable
        Where RTL leads from a place, with the home of that moment; default: home.
    home : LatLon, optional
        Where the vehicle's home is.
    return_speed_mps : float, optional
        The speed of RTL (RTL_SPEED); default: the vehicle's own.
    circle_m : float
        The radius of LOITER_TURNS without one of their own (CIRC_RADIUS).
    own_speed_mps : float
        The vehicle's own speed, which holds until the mission changes it.
    most_legs : int
        How many legs are followed.
    """
    for most_repeats in (None, _FEW_TIMES):
        walk = _Execution(
            mission.items,
            start,
            home,
            return_to,
            return_speed_mps,
            circle_m,
            own_speed_mps,
            most_repeats,
            most_legs,
        )
        walk.run()
        if len(walk.legs) < most_legs:
            break
    if len(walk.legs) >= most_legs:
        walk.troubles.append(
            f"the mission has more than {most_legs} legs, jumps included; the rest was not checked"
        )
    elif most_repeats is not None:
        walk.notes.append(
            f"the mission has more than {most_legs} legs, jumps included; length and time count each jump {_FEW_TIMES} times"
        )
    return walk.course()


@dataclass
class _Execution:
    """The autopilot's state while it executes a mission."""

    items: tuple[MissionItem, ...]
    here: LatLon | None
    home: LatLon | None
    return_to: Callable[[LatLon, LatLon | None], LatLon | None]
    return_speed_mps: float | None
    default_circle_m: float
    own_speed_mps: float
    most_repeats: int | None
    most_legs: int
    here_item: int = 0
    speed_mps: float | None = None
    is_conditional: bool = False
    jump_item: int | None = None
    taken: dict[int, int] = field(default_factory=dict)
    seen: set[tuple[object, ...]] = field(default_factory=set)
    legs: list[CourseLeg] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    is_endless: bool = False
    ends_in_loiter: bool = False

    def course(self) -> Course:
        troubles, notes = tuple(dict.fromkeys(self.troubles)), tuple(dict.fromkeys(self.notes))
        return Course(tuple(self.legs), troubles, notes, self.is_endless, self.ends_in_loiter)

    def run(self) -> None:
        index: int | None = 0
        jumps_in_a_row = 0
        while index is not None and index < len(self.items) and len(self.legs) < self.most_legs:
            item = self.items[index]
            if item.command in (Command.DO_JUMP, Command.DO_JUMP_TAG):
                jumps_in_a_row += 1
                if jumps_in_a_row > 2 * len(self.items):
                    self._trouble(index, "jumps in a loop without a waypoint")
                    break
                index = self._jump(index)
                continue
            if is_navigation(item):
                jumps_in_a_row = 0
                if not self._navigate(index):
                    break
                self.jump_item = None
            else:
                self._do(index)
            index += 1

    def _trouble(self, index: int, text: str) -> None:
        self.troubles.append(f"item {index + 1} {text}")

    def _note(self, index: int, text: str) -> None:
        self.notes.append(f"item {index + 1} {text}")

    def _navigate(self, index: int) -> bool:
        """Execute a navigation command; return whether the mission goes on after it."""
        item = self.items[index]
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            self._return(index)
        elif item.command == Command.NAV_DELAY:
            self._stop(item.params[0])
        elif item.command in _SKIPPED:
            self._note(index, f"is a {_SKIPPED[Command(item.command)]}, which rovers ignore")
        elif item.command in _STRAYING:
            self._trouble(
                index, f"{_STRAYING[item.command]}: where the vehicle drives then cannot be predicted"
            )
        elif item.is_placed:
            self._drive(index)
        elif item.command in _PLACED and (item.lat_e7, item.lon_e7) == (0, 0):
            self._stop(item.params[0] if item.command != Command.NAV_LOITER_TURNS else 0.0)
        elif item.command in _PLACED:
            self._trouble(index, f"has a position in frame {item.frame}, which is not a global frame")
        else:
            self._trouble(
                index,
                f"is command {item.command}, which is not supported: where the vehicle drives then cannot be predicted",
            )
        if item.command == Command.NAV_LOITER_UNLIM:
            self.ends_in_loiter = True
            if index + 1 < len(self.items):
                self._note(index, "loiters forever; later items are never reached")
            return False
        return True

    def _drive(self, index: int) -> None:
        item = self.items[index]
        stop_s = (
            None
            if item.command == Command.NAV_WAYPOINT and not item.params[0] > 0
            else max(0.0, item.params[0])
        )
        circle_m = 0.0
        if item.command in (Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TURNS):
            stop_s = 0.0
        if item.command == Command.NAV_LOITER_TURNS:
            radius_m = abs(item.params[2])
            circle_m = radius_m if 0 < radius_m < math.inf else self.default_circle_m
            self._note(
                index,
                f"circles with a radius of {circle_m:g} m (LOITER_TURNS); the drive model was not tested for that",
            )
        self._go(index, item.position, stop_s=stop_s, circle_m=circle_m)

    def _return(self, index: int) -> None:
        goal = self.return_to(self.here, self.home) if self.here else self.home
        if goal is None:
            self._trouble(index, "returns to launch, but home is unknown")
            return
        self.speed_mps = self.return_speed_mps  # entering RTL sets the speed anew
        self._go(index, goal, stop_s=0.0, is_return=True)
        self.speed_mps = None

    def _go(
        self, index: int, end: LatLon, *, stop_s: float | None, circle_m: float = 0.0, is_return: bool = False
    ) -> None:
        if self.here is not None:
            self.legs.append(
                CourseLeg(
                    self.here_item,
                    index + 1,
                    self.here,
                    end,
                    self.jump_item,
                    self.speed_mps,
                    stop_s,
                    circle_m,
                    is_return,
                )
            )
        self.here, self.here_item = end, index + 1
        self.is_conditional = False

    def _stop(self, delay_s: float) -> None:
        """Stop where the last leg ended."""
        if self.legs:
            last = self.legs[-1]
            stop_s = (last.stop_s or 0.0) + max(0.0, 0.0 if math.isnan(delay_s) else delay_s)
            self.legs[-1] = replace(last, stop_s=stop_s)

    def _do(self, index: int) -> None:
        """Execute a command that moves nothing by itself."""
        item = self.items[index]
        if item.command in _CONDITIONS:
            self.is_conditional = True
        elif item.command == Command.DO_CHANGE_SPEED:
            self._change_speed(item.params[1])
        elif item.command == Command.DO_SET_HOME:
            self.home = self.here if item.params[0] == 1 else item.position
        elif item.command == Command.DO_SET_REVERSE and item.params[0] == 1:
            self._note(
                index, "sets the vehicle to reverse (DO_SET_REVERSE); the drive model was not tested for that"
            )
        elif item.command == Command.DO_FENCE_ENABLE and item.params[0] == 0:
            self._note(index, "turns the autopilot's own fence off (DO_FENCE_ENABLE 0)")

    def _change_speed(self, speed_mps: float) -> None:
        if not 0 < speed_mps < math.inf:
            return  # the autopilot refuses it and keeps its speed
        if self.is_conditional:  # it may come late on this leg, or never: the faster one counts
            speed_mps = max(speed_mps, self.own_speed_mps if self.speed_mps is None else self.speed_mps)
        self.speed_mps = speed_mps

    def _jump(self, index: int) -> int | None:
        """Return the index at which the mission goes on; None where it ends here."""
        item = self.items[index]
        goal = self._jump_goal(item)
        if goal is None:
            name = "tag" if item.command == Command.DO_JUMP_TAG else "item"
            self._trouble(index, f"jumps to {name} {item.params[0]:g}, which does not exist")
            return index + 1
        repeats = int(item.params[1]) if math.isfinite(item.params[1]) else 0
        if repeats < 0:
            finite = tuple(sorted(self.taken.items()))
            state = (index, finite, self.speed_mps, self.here_item)
            if state in self.seen:
                self.is_endless = True
                if index + 1 < len(self.items):
                    self._note(index, "repeats forever; the items after it are never reached from it")
                return None
            self.seen.add(state)
        else:
            if self.most_repeats is not None:
                repeats = min(repeats, self.most_repeats)
            if self.taken.get(index, 0) >= repeats:
                return index + 1
            self.taken[index] = self.taken.get(index, 0) + 1
        self.jump_item = index + 1
        return goal

    def _jump_goal(self, item: MissionItem) -> int | None:
        """Return the index that a jump leads to; None where there is no such item."""
        wanted = item.params[0]
        if item.command == Command.DO_JUMP_TAG:
            tags = (
                i
                for i, one in enumerate(self.items)
                if one.command == Command.JUMP_TAG and one.params[0] == wanted
            )
            return next(tags, None)
        return int(wanted) - 1 if 1 <= wanted <= len(self.items) else None
