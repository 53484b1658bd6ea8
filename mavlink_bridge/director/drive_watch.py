"""Watching a drive: how far, how near to the fence, within the band that was foreseen or not."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from shapely import LineString, Point, prepare

from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.incidents import BreachTexts
from mavlink_bridge.director.voice import metres
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import ARDUPILOT
from mavlink_bridge.mavlink.drive_rules import FirstItem
from mavlink_bridge.protocol.vehicle_watch import MISSION_COMPLETE
from missions.geo import from_e7

if TYPE_CHECKING:
    from mavlink_bridge.director.voice import Voice
    from mavlink_bridge.mavlink.autopilots import AutopilotTable
    from mavlink_bridge.mavlink.incident_rules import IncidentRules
    from mavlink_bridge.mavlink.messages import Frame
    from missions.geo import LatLon
    from missions.planned import Plan

OUTSIDE_M = 0.25
"""How far outside the foreseen band counts: the vehicle's own estimate of its place is off by as much."""

PROGRESS_EVERY_S = 1.0  # as heartbeats; chosen, not measured
_STANDING_MPS = 0.15  # beyond the noise of a position that stands; chosen, not measured
_STANDING_S = 3.0  # longer than a pivot's turning point or a change of direction; chosen, not measured
_END_M = 1.0
"""How near to its last waypoint a mission's end counts, beyond the waypoint's radius: measured were 0.1 to 0.6 m, and the estimate is up to 0.4 m off."""

_ACTIVE = 3
"""MISSION_STATE_ACTIVE."""


_SETTLED_S = 1.0
"""MISSION_CURRENT that is told sooner may be about the drive before."""

_FASTER = 1.25
"""PX4 rovers drove up to a fifth faster than they were told to: 1.2 m/s at 1 m/s, as measured."""

_UNSEEN_S = 1.5
"""A heartbeat shows that it drives up to a second after it has begun to, and a link adds to it."""

_EARLY_M = 4.0
"""How far before a waypoint the next item may be told, and how far the vehicle may stand off its route's start: 3 m and 1 m."""


class _Here(NamedTuple):
    """Where the vehicle is."""

    place: LatLon
    point: Point  # in the local frame of the plan's ground
    seen_s: float
    speed_mps: float


class _BreachCount:
    """Counts the breaches of a drive; `incidents` tells of each.

    Parameters
    ----------
    rules : IncidentRules
        How the vehicle's autopilot tells of them.
    """

    def __init__(self, rules: IncidentRules) -> None:
        self._rules = rules
        self._before: int | None = None
        self._texts = BreachTexts()
        self.count = 0

    def receive(self, message: m.Message, now_s: float) -> None:
        """Take a message of the vehicle."""
        if isinstance(message, m.FenceStatus):
            if self._before is None:
                self._before = message.breach_count
            self.count = max(self.count, message.breach_count - self._before)
        elif isinstance(message, m.Statustext):
            self.count += self._texts.tells_new(message.text, self._rules, now_s)


class DriveWatch:
    """What a drive on a plan looks like, position by position; tells what is worth telling.

    Parameters
    ----------
    plan : Plan
        What is driven.
    voice : Voice
        Whom to tell.
    now_s : float
        When the drive began.
    autopilot : AutopilotTable, optional
        How the vehicle's autopilot speaks.
    """

    def __init__(self, plan: Plan, voice: Voice, now_s: float, autopilot: AutopilotTable = ARDUPILOT) -> None:
        self._autopilot = autopilot
        self.begun_s = now_s
        self.progress_due_s = now_s + PROGRESS_EVERY_S
        self.item = 1
        self._point = plan.path_index(1)  # of the path: items may be driven to several times
        self._current_seq: int | None = None
        self._is_executing = False
        self._is_begun = False  # which item was driven to first is known
        self.least_clearance_m = math.inf
        self.driven_m = 0.0
        self.deviation_m = 0.0
        self.has_arrived = False
        self._breaches = _BreachCount(autopilot.incidents)
        self._voice = voice
        self._here: _Here | None = None
        self._is_outside = False
        self._standing_since_s: float | None = None
        self._lay_out(plan)

    def _lay_out(self, plan: Plan) -> None:
        self._plan = plan
        self._points = plan.points
        self._line = LineString(self._points)
        prepare(plan.envelope.area)

    @property
    def distance_left_m(self) -> float:
        """What is left of the drawn lines."""
        rest = self._points[self._point :]
        legs_m = float(np.hypot(*np.diff(rest, axis=0).T).sum()) if len(rest) > 1 else 0.0
        return legs_m + (self._here.point.distance(Point(rest[0])) if self._here else 0.0)

    @property
    def time_left_s(self) -> float:
        """What the drive model foresees for it."""
        whole_m = self._line.length or 1.0
        return self._plan.envelope.duration_s * min(1.0, self.distance_left_m / whole_m)

    @property
    def is_outside(self) -> bool:
        """Whether it is outside the predicted corridor."""
        return self._is_outside

    @property
    def breaches(self) -> int:
        """How many breaches were told of since the drive began."""
        return self._breaches.count

    @property
    def so_far(self) -> str:
        """How the drive went until its early end, in words that follow others."""
        is_fenced = math.isfinite(self.least_clearance_m)
        kept = f", least clearance {self.least_clearance_m:.2f} m" if is_fenced else ""
        return f" (after {self.driven_m:.1f} m{kept}, {self.distance_left_m:.0f} m left)"

    def join(self, item: int) -> None:
        """Take notice that the drive was begun before it was watched, and which item it leads to now."""
        self.item = item
        self._point = self._plan.path_index(item)
        self._is_executing = self._is_begun = True

    def has_skipped(self, message: m.MissionCurrent, now_s: float) -> bool:
        """Return whether the first item that the vehicle reports to drive to is one that it cannot have come to since the drive began."""
        is_asked_before = self._autopilot.driving.first_item is FirstItem.BY_MESSAGE_BEFORE
        is_early = message.mission_state != _ACTIVE or now_s < self.begun_s + _SETTLED_S
        if self._is_begun or is_early or not is_asked_before:
            return False
        self._is_begun = True
        passed = self._points[: self._plan.path_index(message.seq + self._first_number)]
        passed_m = float(np.hypot(*np.diff(passed, axis=0).T).sum()) if len(passed) > 1 else 0.0
        fastest_mps = max(self._plan.vehicle.speed_mps, 1.0) * _FASTER
        return passed_m > fastest_mps * (now_s - self.begun_s + _UNSEEN_S) + _EARLY_M

    def follow(self, plan: Plan, item: int) -> None:
        """Go on along another plan of the same mission: a way home inside it was chosen."""
        self._lay_out(plan)
        if self._here is not None:  # in another plane
            self._here = self._here._replace(point=Point(plan.ground.frame.to_local(self._here.place)))
        self.item, self._point = item, plan.path_index(item)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame of the vehicle."""
        message = frame.message
        if isinstance(message, m.GlobalPositionInt) and (message.lat, message.lon) != (0, 0):
            self._move(message, now_s)
        elif isinstance(message, m.MissionCurrent) and message.seq + self._first_number:
            self._take_current(message, message.seq + self._first_number)
        elif isinstance(message, m.MissionItemReached) and not self._autopilot.driving.repeats_reached:
            self._take_reached(message.seq + self._first_number)
        elif isinstance(message, m.Statustext):
            self._take_text(message.text)
        self._breaches.receive(message, now_s)

    def tell_progress(self, now_s: float) -> None:
        """Report how far the drive is."""
        self.progress_due_s = now_s + PROGRESS_EVERY_S
        if self._here is None:
            return
        self._voice.tell(
            now_s,
            EventName.PROGRESS,
            f"{self.distance_left_m:.0f} m left",
            self.item,
            round(self.distance_left_m, 1),
            round(self.time_left_s, 1),
            metres(self.least_clearance_m),
            round(self.deviation_m, 2),
            list(self._here.place),
        )

    def tell_arrival(self, now_s: float, *, holds: bool) -> None:
        """Report the end of the drive, and whether the vehicle is switched to HOLD."""
        took_s = now_s - self.begun_s
        self._voice.tell(
            now_s,
            EventName.ARRIVED,
            f"arrived after {self.driven_m:.0f} m in {took_s:.0f} s{'; HOLD' if holds else ''}",
            round(self.driven_m, 2),
            round(took_s, 1),
            metres(self.least_clearance_m),
            self.breaches,
        )

    def is_at_end(self, now_s: float) -> bool:
        """Return whether a vehicle that holds now does so at the end of its drive: on its last legs, as near to its end as it may have come since it was seen last."""
        vehicle = self._plan.vehicle
        radius_m = vehicle.waypoint_radius_m if vehicle.pursuit is None else vehicle.pursuit.acceptance_m
        if self._here is None or not self._is_near_last:
            return False
        reach_m = radius_m + _END_M + self._here.speed_mps * (now_s - self._here.seen_s)
        return self._here.point.distance(Point(self._points[-1])) <= reach_m

    def _take_text(self, text: str) -> None:
        """Take the text that the mission is finished, on its last leg, for arrival."""
        pattern = self._autopilot.driving.finished_text
        if pattern is not None and re.match(pattern, text.strip(), re.IGNORECASE):
            self.has_arrived = self.has_arrived or self._is_near_last

    @property
    def _first_number(self) -> int:
        """The number in the plan of the item that the vehicle counts as 0."""
        return int(not self._autopilot.lists.form.has_home_item)

    @property
    def _is_near_last(self) -> bool:
        """Whether the vehicle is on its last leg, or on the one before: which item it drives to is told once a second."""
        return self._point >= len(self._points) - 2

    def _take_current(self, message: m.MissionCurrent, number: int) -> None:
        if number != self._current_seq:  # told again and again, also just after it was reached
            self._current_seq = self.item = number
            self._point = self._plan.path_index(number, self._point)
        self._is_executing = self._is_executing or message.mission_state == _ACTIVE
        self.has_arrived = self.has_arrived or (
            self._is_executing and message.mission_state == MISSION_COMPLETE
        )

    def _take_reached(self, seq: int) -> None:
        last = len(self._points) - 1
        if seq not in self._plan.seqs:  # a delay, not a place
            return
        reached = self._plan.path_index(seq, self._point)
        self.has_arrived = self.has_arrived or reached == last
        self._point = min(reached + 1, last)
        self.item = self._plan.seqs[self._point]

    def _move(self, message: m.GlobalPositionInt, now_s: float) -> None:
        place = from_e7(message.lat, message.lon)
        here = Point(self._plan.ground.frame.to_local(place))
        if self._here is not None:
            self.driven_m += here.distance(self._here.point)
        self._here = _Here(place, here, now_s, math.hypot(message.vx, message.vy) / 100)
        self.least_clearance_m = min(self.least_clearance_m, self._plan.ground.enforced.clearance_m(here))
        self.deviation_m = here.distance(self._line)
        self._notice_leaving(here, place, now_s)
        self._notice_standing(here, math.hypot(message.vx, message.vy) / 100, now_s)

    def _notice_leaving(self, here: Point, place: LatLon, now_s: float) -> None:
        outside_m = here.distance(self._plan.envelope.area)
        if outside_m > OUTSIDE_M and not self._is_outside:
            text = f"{outside_m:.1f} m outside the predicted corridor"
            self._voice.tell(now_s, EventName.LEFT_ENVELOPE, text, round(outside_m, 2), list(place))
        self._is_outside = outside_m > OUTSIDE_M

    def _notice_standing(self, here: Point, speed_mps: float, now_s: float) -> None:
        """Take standing at the last waypoint for arrival: the message that says so may be lost."""
        reach_m = self._plan.vehicle.waypoint_radius_m + 1.0
        is_there = self._point == len(self._points) - 1 and here.distance(Point(self._points[-1])) <= reach_m
        if not is_there or speed_mps > _STANDING_MPS:
            self._standing_since_s = None
        elif self._standing_since_s is None:
            self._standing_since_s = now_s
        elif now_s - self._standing_since_s >= _STANDING_S:
            self.has_arrived = True
