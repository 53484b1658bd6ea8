"""What the autopilot tells of breaches and failsafes, with a drive of ours or without; and which change of mode it answers them with.

A breach is told by FENCE_STATUS, which ArduPilot sends at once and then in its stream; Rover gives no text of it, other vehicles do, and PX4 tells it by
text alone. A failsafe is told by a text: of ArduPilot's "Radio Failsafe" and "GCS Failsafe" before the mode is switched, "EKF failsafe" after it, "Crash: Going
to HOLD", "Battery 1 is low …"; on PX4 the heartbeat shows it. Which texts those are, and what they are answered with, stands in the autopilot's table
(`mavlink.incident_rules`). The heartbeat of the new mode goes out on its own and may come before or after: neither order may lead to a claim that is not true.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.takeover import Cause
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import ARDUPILOT, AutopilotTable
from missions.checking.fence_place import fence_place

if TYPE_CHECKING:
    from mavlink_bridge.director.takeover import Takeover
    from mavlink_bridge.director.voice import Voice
    from mavlink_bridge.mavlink.incident_rules import IncidentRules
    from missions.checking.fence_place import FencePlace
    from missions.request import Request
    from missions.situation import Known, Pose, Situation

_SAME_S = 2.0
"""A text and a FENCE_STATUS, or two texts on one failsafe, that come so soon after another tell of the same."""

_AT_MOST_EVERY_S = 1.0
"""A vehicle on a fence's line, or one that means harm, may count many breaches a second."""

_OLD_S = 2.0
"""A position older than this is said to be: it comes four times a second."""

_TOLD_LATE_M = 2.0
"""How far before a fence the position told last may lie at a breach: a quarter of a second at 5 m/s, and its own error."""

_BREACH = "fence breach"
_BREACH_TYPES = {1: "minimum altitude", 2: "maximum altitude", 3: "boundary"}
"""FENCE_BREACH; ArduPilot calls circles and polygons alike boundary."""

_UNTOLD = "failsafe"
"""What a heartbeat shows where no text told of it."""


class BreachTexts:
    """Hears of breaches that nothing but a text tells of; what comes soon after tells of the same."""

    def __init__(self) -> None:
        self._heard_s = -math.inf

    def tells_new(self, text: str, rules: IncidentRules, now_s: float) -> bool:
        """Return whether a text tells of another breach."""
        if not rules.tells_breach_alone(text):
            return False
        is_new = now_s > self._heard_s + _SAME_S
        self._heard_s = now_s
        return is_new


class Incidents:
    """Hears what befalls the vehicle and tells it.

    Parameters
    ----------
    voice : Voice
        Whom to tell.
    request : Request
        What is asked of routes; it says by which margins the ground is laid out.

    Attributes
    ----------
    autopilot : AutopilotTable
        How the vehicle's autopilot speaks.
    """

    def __init__(self, voice: Voice, request: Request) -> None:
        self.autopilot: AutopilotTable = ARDUPILOT
        self._voice = voice
        self._request = request
        self._causes: dict[str, Cause] = {}
        self._unexplained: tuple[Takeover, float] | None = None
        self._count: int | None = None
        self._is_breached = False
        self._breaches = 0
        self._breach_told_s = self._breach_text_s = -math.inf
        self._told_s: dict[str, float] = {}

    def receive(self, message: m.Message, situation: Situation, now_s: float) -> None:
        """Take a message of the vehicle's autopilot; the situation after it is given."""
        if isinstance(message, m.FenceStatus):
            self._take_fence_status(message, situation, now_s)
        elif isinstance(message, m.Statustext):
            self._take_text(message.text.strip(), situation, now_s)

    def forget(self) -> None:
        """Take notice that the vehicle was switched off and on: it counts anew."""
        self._count = None
        self._is_breached = False
        self._causes.clear()

    def cause_of(self, takeover: Takeover, now_s: float) -> Cause | None:
        """Return what the autopilot has answered with a takeover; None where nothing was heard that explains it (yet)."""
        found = [cause for cause in self._fresh(now_s) if cause.explains(takeover)] or self._shown(
            takeover, now_s
        )
        self._unexplained = (takeover, now_s) if not found and takeover.asker is None else None
        return min(found, key=lambda cause: cause.heard_s, default=None)

    def explains(self, takeover: Takeover, now_s: float) -> bool:
        """Return whether something was heard just before that the autopilot answers so."""
        return any(cause.explains(takeover) for cause in (*self._fresh(now_s), *self._shown(takeover, now_s)))

    def refuses_mission(self, now_s: float) -> bool:
        """Return whether the autopilot has just told that it does not drive the mission any more."""
        told = self.autopilot.incidents.shown_by_text
        return any(
            cause.reason in told and now_s <= cause.heard_s + _SAME_S for cause in self._causes.values()
        )

    def heard_before(self, now_s: float) -> Cause | None:
        """Return the newest thing heard that the autopilot may answer, if it was just now."""
        return max(self._fresh(now_s), key=lambda cause: cause.heard_s, default=None)

    def _fresh(self, now_s: float) -> list[Cause]:
        within_s = self.autopilot.incidents.answered_within_s
        return [cause for cause in self._causes.values() if now_s <= cause.heard_s + within_s]

    def _shown(self, takeover: Takeover, now_s: float) -> list[Cause]:
        """Return the failsafe that a heartbeat shows, where no text told of it."""
        rules = self.autopilot.incidents
        if not (rules.shown_by_heartbeat and takeover.shows_failsafe):
            return []
        cause = Cause(_UNTOLD, now_s, rules.any_action)
        return [cause] if cause.explains(takeover) else []

    def _note(self, cause: Cause) -> str | None:
        """Remember a cause; return the name of the mode that the vehicle went to for it, where that was seen before it."""
        self._causes[cause.reason] = cause
        if self._unexplained is None:
            return None
        takeover, seen_s = self._unexplained
        if cause.heard_s > seen_s + self.autopilot.incidents.answered_within_s or not cause.explains(
            takeover
        ):
            return None
        self._unexplained = None
        return "disarmed" if takeover.mode is None else self.autopilot.modes.words(takeover.mode)

    # Breaches

    def _take_fence_status(self, status: m.FenceStatus, situation: Situation, now_s: float) -> None:
        before, was_breached = self._count, self._is_breached
        self._count, self._is_breached = status.breach_count, bool(status.breach_status)
        if before is None:
            if self._is_breached:
                self._tell_breach(1, status.breach_type, situation, now_s, is_new=False)
            return
        new = status.breach_count - before
        if new <= 0:  # the count has started anew where it is less
            new = int(self._is_breached and not was_breached)
        if new and now_s <= self._breach_text_s + _SAME_S:  # its text has told of it
            self._breach_text_s = -math.inf
            new -= 1
        if new and now_s < self._breach_told_s + _AT_MOST_EVERY_S:  # counted with the next status after that
            self._count, self._is_breached = before, was_breached
            self._note(self._breach(situation, now_s))
        elif new:
            self._tell_breach(new, status.breach_type, situation, now_s)

    def _breach(self, situation: Situation, now_s: float) -> Cause:
        rules = self.autopilot.incidents
        modes = rules.breach_action.answers(situation.parameters)
        return Cause(_BREACH, now_s, modes, needs_heartbeat=rules.shown_by_heartbeat)

    def _take_breach_text(self, situation: Situation, now_s: float) -> None:
        if now_s > self._breach_told_s + _SAME_S:
            self._tell_breach(1, None, situation, now_s)
            self._breach_text_s = now_s

    def _tell_breach(
        self, new: int, breach_type: int | None, situation: Situation, now_s: float, *, is_new: bool = True
    ) -> None:
        """Report a breach, with its place and fence."""
        self._breach_told_s = now_s
        self._breaches += new
        mode = None
        if is_new:
            mode = self._note(self._breach(situation, now_s))
        pose = situation.pose
        place = fence_place(situation, self._request, pose.value.position) if pose is not None else None
        since = "" if is_new else ", from before pbpp connected"
        answer = f"; the autopilot switched to {mode}" if mode is not None else ""
        self._voice.tell(
            now_s,
            EventName.BREACH,
            f"{_BREACH} {self._breaches}{since}{_by(place)}{_at(pose, now_s)}{answer}",
            self._breaches,
            list(pose.value.position) if pose is not None else None,
            place.fence if place is not None else None,
            round(place.beyond_m, 2) if place is not None else None,
            None if breach_type is None else _BREACH_TYPES.get(breach_type, "unknown"),
            mode,
        )

    # Failsafes

    def _take_text(self, text: str, situation: Situation, now_s: float) -> None:
        rules = self.autopilot.incidents
        if rules.tells_breach(text):
            self._take_breach_text(situation, now_s)
        elif rules.goes_on_text is not None and _matches(rules.goes_on_text, text):  # then it does not switch
            self._causes.clear()
        elif rules.warning is not None and _matches(rules.warning[0], text):
            self._note(Cause(rules.warning[1], now_s, rules.actions_of[rules.warning[1]]))
        elif (
            reason := next((name for pattern, name in rules.failsafes if _matches(pattern, text)), None)
        ) is not None:
            self._tell_failsafe(reason, text, situation, now_s)

    def _tell_failsafe(self, reason: str, text: str, situation: Situation, now_s: float) -> None:
        rules = self.autopilot.incidents
        modes = rules.actions_of.get(reason, rules.any_action)
        action = rules.failsafe_action if reason in rules.by_parameter else None
        if action is not None and action.parameter in situation.parameters:
            modes = action.answers(situation.parameters)
        elif action is not None and action.parameter in situation.no_numbers:
            modes = frozenset()  # the vehicle's own word for it says nothing, so nothing is claimed
        needs_heartbeat = rules.shown_by_heartbeat and reason not in rules.shown_by_text
        mode = self._note(Cause(reason, now_s, modes, needs_heartbeat=needs_heartbeat))
        is_told = now_s <= self._told_s.get(reason, -math.inf) + _SAME_S
        self._told_s[reason] = now_s
        if is_told and mode is None:
            return
        answer = f"; the autopilot switched to {mode}" if mode is not None else ""
        self._voice.tell(now_s, EventName.FAILSAFE, f"{reason}: {text}{answer}", reason, mode)


def _matches(pattern: str, text: str) -> bool:
    return re.match(pattern, text, re.IGNORECASE) is not None


def _by(place: FencePlace | None) -> str:
    """Return in words by which fence a place is."""
    if place is None:
        return ""
    if place.beyond_m > 0:
        return f", {place.beyond_m:.1f} m beyond {place.fence}"
    if place.beyond_m >= -_TOLD_LATE_M:
        return f", at {place.fence} ({-place.beyond_m:.1f} m from its edge by its last position)"
    away_m = -place.beyond_m
    return f"; no known fence is breached there, the nearest is {place.fence}, {away_m:.1f} m away"


def _at(pose: Known[Pose] | None, now_s: float) -> str:
    """Return in words where it was, and how old that is where it is not of now."""
    if pose is None:
        return ""
    age_s = 0.0 if pose.time_s is None else now_s - pose.time_s
    return f", at {pose.value.position}" + (f" ({age_s:.0f} s earlier)" if age_s > _OLD_S else "")
