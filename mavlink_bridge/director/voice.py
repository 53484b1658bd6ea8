"""The director's words: events for the shell, and STATUSTEXTs for the ground stations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.director.announcer import Announcer
from mavlink_bridge.director.events import Event, EventName
from missions.words import counted
from missions.words import metres as metres_text

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Statustext
    from missions.checking.recheck import Recheck
    from missions.errors import MissionError
    from missions.planned import Plan
    from missions.situation import Situation

_NOT_ANNOUNCED = frozenset({EventName.PROGRESS, EventName.FAILSAFE, EventName.WAY_HOME})
"""What the ground stations hear from the vehicle itself, or far too often."""


class Voice:
    """Collects events, and the texts that follow from them.

    Parameters
    ----------
    announce : bool
        Whether ground stations are told.
    """

    def __init__(self, *, announce: bool) -> None:
        self._announce = announce
        self._announcer = Announcer()
        self._events: list[Event] = []

    @property
    def deadline_s(self) -> float | None:
        """When the next text may go."""
        return self._announcer.deadline_s

    def take_events(self) -> list[Event]:
        """Return and forget what was told."""
        events, self._events = self._events, []
        return events

    def due(self, now_s: float) -> list[Statustext]:
        """Return the texts that may go now."""
        return self._announcer.due(now_s)

    def tell(self, now_s: float, name: EventName, text: str, *values: object) -> None:
        """Report an event; the values are those of its schema, in order."""
        event = Event.of(now_s, name, text, values)
        self._events.append(event)
        if self._announce and name not in _NOT_ANNOUNCED:
            self._announcer.say(event.severity, text)

    def error(self, now_s: float, name: EventName, error: Exception, details: object) -> None:
        """Report an error."""
        self.tell(now_s, name, str(error), type(error).__name__, details)

    def learnt(self, now_s: float, situation: Situation) -> None:
        """Report what is known of the vehicle."""
        fence, mission, pose = situation.fence, situation.mission, situation.pose
        zones = len(fence.value.zones) if fence else 0
        items = mission.value.item_count(has_home=situation.ardupilot is not False) if mission else 0
        seen = (
            f"fence of {counted(zones, 'zone')}" if fence else "no fence seen",
            f"mission of {counted(items, 'item')}" if mission else "no mission seen",
        )
        self.tell(
            now_s,
            EventName.LEARNT,
            ", ".join(seen),
            zones,
            fence.value.vertex_count if fence else 0,
            items,
            len(situation.parameters),
            list(pose.value.position) if pose else None,
        )

    def planned(self, now_s: float, plan: Plan) -> None:
        """Report a plan."""
        self.tell(
            now_s,
            EventName.PLANNED,
            f"route {plan.length_m:.0f} m, fence clearance {plan.drawn_clearance_m:.1f} m along straight legs"
            + ", extrapolated beyond what was measured" * bool(plan.extrapolated),
            round(plan.length_m, 2),
            metres(plan.drawn_clearance_m),
            plan.clearance_m,
            round(plan.duration_s, 1),
            len(plan.items),
            [list(position) for position in plan.path],
            list(plan.extrapolated),
            list(plan.info),
            list(plan.warnings),
        )

    def no_plan(self, now_s: float, error: MissionError) -> None:
        """Report why there is no plan."""
        self.error(now_s, EventName.NO_PLAN, error, dict(error.details))

    def going_home(self, now_s: float, call: object, place: str, plan: Plan) -> None:
        """Report where a way home leads; one inside the mission is named by its first item."""
        length_m, duration_s = round(plan.length_m, 1), round(plan.duration_s, 1)
        to = "" if place == "home" else f" {'by' if place.startswith('item ') else 'to'} {place}"
        text = f"going home{to}: {length_m:.0f} m, about {duration_s:.0f} s"
        self.tell(now_s, EventName.GOING_HOME, text, str(call), place, length_m, duration_s)

    def home_waits(self, now_s: float, call: object, why: str) -> None:
        """Report why a way home waits; the vehicle is held."""
        text = f"the way home waits, the vehicle stays in HOLD: {why}"
        self.tell(now_s, EventName.HOME_WAITS, text, str(call), why)

    def rechecked(self, now_s: float, name: EventName, what: str, found: Recheck) -> None:
        """Report that lines do not keep what they have to."""
        asked = metres_text(found.asked_m)
        text = f"{what} keeps only {metres_text(found.clearance_m)} of the required {asked} ({found.fence})"
        if found.clearance_m <= 0:
            text = f"{what} crosses {found.fence} ({asked} is required)"
        self.tell(now_s, name, text, metres(found.clearance_m), round(found.asked_m, 3), found.fence)


def metres(value_m: float) -> float | None:
    """Return a length for JSON, to the millimetre; None for an infinite one."""
    return round(value_m, 3) if math.isfinite(value_m) else None
