"""The part of the director that always has an answer to "and now home?": from where the vehicle is, the nearest place that can be reached.

How it is kept
--------------
The ways home are one tree of shortest paths from each place (home, rally points, `--place`), for the fence that stands. It is made anew only where what it
rests on is another one; where the vehicle has moved, the tree is asked again. Both are done by the shell, beside the messages, as plans are::

    fence, home, rally points, parameters, fix ──┐
                                                 ├─► WaysTask ──shell──► HomeWays ──► the view; an event where the place is another one, or none
    position, where it is another one ───────────┘

`HomeCaller` drives a way home; `RouteDesk` has the plan to it made, with these ways. What is shown here is not driven: a plan begins where the vehicle has
come to rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.plan_task import HomeWays, WaysTask
from mavlink_bridge.director.states import Notice, Signal, State
from missions.errors import MissionError
from missions.fence import Obstacles
from missions.geo import distance_m
from missions.promise import FIX_ERRORS_M
from missions.routing.way_home import places_of
from missions.vehicle.parameters import PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.fence import Fence
    from missions.firmware import Firmware
    from missions.geo import LatLon
    from missions.rally import RallyPoint
    from missions.routing.way_home import WayHome, WaysHome
    from missions.situation import Situation

_EVERY_S = 2.0
"""Between two looks: a rover of 5 m/s drives 10 m meanwhile. A look takes milliseconds, beside the messages. Chosen, not measured."""

_MOVED_M = 1.0
"""What the vehicle has to move before it is asked again; chosen, not measured."""

_TELL_EVERY_S = 10.0
"""How often another place is told at most: between two that are as near, a vehicle may go back and forth."""

_HOME_MOVED_M, _ERROR_CHANGED_M = 0.5, 0.25
"""What home and the fix may differ by and still be the same: the fix's own wandering; chosen, not measured."""

_NOT_KNOWN = frozenset({State.LISTENING, State.LEARNING, State.LOST, State.DONE, State.FAILED})
"""States in which what ways rest on is not known."""


@dataclass(frozen=True, slots=True)
class _Field:
    """What ways home rest on."""

    fence: Fence | None
    home: LatLon | None
    rally: tuple[RallyPoint, ...]
    parameters: Mapping[str, float]
    firmware: Firmware | None
    error_m: float | None

    @classmethod
    def of(cls, situation: Situation) -> Self:
        fix = situation.fix.value if situation.fix is not None else None
        error_m = None if fix is None else fix.error_m or FIX_ERRORS_M.get(fix.kind)
        return cls(
            situation.fence.value if situation.fence is not None else None,
            situation.home.value if situation.home is not None else None,
            situation.rally.value if situation.rally is not None else (),
            situation.parameters,
            situation.firmware,
            error_m,
        )

    def is_like(self, other: _Field) -> bool:
        """Return whether ways are the same, but for the wandering of a fix."""
        return (
            (self.fence is other.fence or self.fence == other.fence)
            and (self.rally, self.firmware) == (other.rally, other.firmware)
            and _are_near(self.home, other.home)
            and abs((self.error_m or 0.0) - (other.error_m or 0.0)) <= _ERROR_CHANGED_M
            and (
                self.parameters is other.parameters
                or all(self.parameters.get(name) == other.parameters.get(name) for name in PARAMETERS)
            )
        )


class HomeKeeper(Part):
    """Knows the way home.

    Attributes
    ----------
    pending : WaysTask or None
        What the shell is to make.
    way : WayHome or None
        The way to the nearest place, from where the vehicle was a moment ago.
    trouble : str
        Why there is none; empty where there is one, and before it is known.
    """

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        self.pending: WaysTask | None = None
        self.way: WayHome | None = None
        self.trouble = ""
        self._ways: WaysHome | None = None
        self._field = self._asked_field = _Field.of(core.situation)
        self._asked_at: LatLon | None = None
        self._due_s = -math.inf
        self._told: tuple[str, str] = ("", "")
        self._told_s = -math.inf

    @property
    def deadline_s(self) -> float | None:
        """When the vehicle's position is looked at again."""
        return self._due_s if self._may_ask else None

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Have the way home made where it is due."""
        if not self._may_ask or now_s < self._due_s:
            return []
        self._due_s = now_s + _EVERY_S
        situation, is_current = self.core.situation, self.ways is not None
        pose = situation.pose
        assert pose is not None
        is_asked = self._asked_at is not None and _Field.of(situation).is_like(self._asked_field)
        has_moved = self._asked_at is None or distance_m(self._asked_at, pose.value.position) > _MOVED_M
        if not is_asked or has_moved:
            self._asked_field, self._asked_at = _Field.of(situation), pose.value.position
            self.pending = self._task(situation, self._ways if is_current else None)
        return []

    @property
    def ways(self) -> WaysHome | None:
        """The ways home of the field as it is now; None where they are not known."""
        is_current = self._ways is not None and _Field.of(self.core.situation).is_like(self._field)
        return self._ways if is_current else None

    def name_of(self, position: LatLon) -> str:
        """Return the name of the place that lies at a position."""
        places = places_of(self.core.situation, self.core.orders.homing.places)
        return min(places, key=lambda place: distance_m(place.position, position)).name if places else "home"

    def hurry(self) -> None:
        """Look again at once: what ways rest on has changed."""
        self._due_s = -math.inf

    def forget(self) -> None:
        """Take notice that the vehicle is not heard, or was switched off and on: nothing is known of where it is."""
        self.pending = self.way = self._asked_at = None
        self.trouble = ""
        self._told = ("", "")

    def ways_made(self, task: WaysTask, made: HomeWays | MissionError, now_s: float) -> Sequence[Signal]:
        """Take the ways; those that nobody waits for any more are left."""
        if task is not self.pending:
            return []
        self.pending = None
        if isinstance(made, MissionError):
            self.way, self._ways = None, None
            self._tell_none(str(made).removeprefix("no way home: "), now_s)
            return []
        is_new = made.ways is not self._ways
        self._field, self._ways, self.way = self._asked_field, made.ways, made.way
        if made.way is None:
            self._tell_none(self._why_none(task, made.ways), now_s)
        else:
            self._tell_place(made.way, now_s)
        return [Notice.WAYS_KNOWN] if is_new else []

    @property
    def _may_ask(self) -> bool:
        core = self.core
        is_known = core.state not in _NOT_KNOWN and core.situation.pose is not None
        return core.orders.homing.is_kept and is_known and self.pending is None

    def _task(self, situation: Situation, ways: WaysHome | None) -> WaysTask:
        orders = self.core.orders
        fence = replace(
            situation, obstacles=Obstacles()
        )  # obstacles go: a drive home is planned around them then
        return WaysTask(fence, orders.request, orders.homing.places, ways)

    def _why_none(self, task: WaysTask, ways: WaysHome) -> str:
        pose = task.situation.pose
        if pose is not None and not ways.is_allowed(pose.value.position):
            return "the vehicle is outside the fence or in an exclusion"
        return f"none of {len(ways.places)} (home, rally points, --place) can be reached from here with {ways.clearance_m:.2f} m to every fence"

    def _tell_none(self, why: str, now_s: float) -> None:
        self.trouble = why
        if self._told != ("none", why):
            self._told, self._told_s = ("none", why), now_s
            pose = self.core.situation.pose
            position = list(pose.value.position) if pose is not None else None
            self.core.voice.tell(now_s, EventName.NO_WAY_HOME, f"no way home: {why}", why, position)

    def _tell_place(self, way: WayHome, now_s: float) -> None:
        self.trouble = ""
        told = ("place", way.place.name)
        is_too_soon = self._told[0] == "place" and now_s < self._told_s + _TELL_EVERY_S
        if told == self._told or is_too_soon:
            return
        self._told, self._told_s = told, now_s
        text = (
            f"nearest place to go home to: {way.place.name}, {way.length_m:.0f} m, about {way.time_s:.0f} s"
        )
        kind, length_m, time_s = str(way.place.kind), round(way.length_m, 1), round(way.time_s, 1)
        self.core.voice.tell(now_s, EventName.WAY_HOME, text, way.place.name, kind, length_m, time_s)


def _are_near(one: LatLon | None, other: LatLon | None) -> bool:
    if one is None or other is None:
        return one is other
    return distance_m(one, other) <= _HOME_MOVED_M
