"""The part of the director that knows when the vehicle's fence counts, which of its zones never do, and whether the vehicle takes our mission.

"Accepted and read back" is not "enforced". PX4 makes a fence count vertex by vertex, 0.1 s each, and until then neither refuses a mission nor stops the vehicle;
a zone that has home, or the armed vehicle, on its forbidden side it leaves out, and says so by a text. So between a verified mission and its drive::

    VERIFIED ──the fence counts, the mission is not refused──► ENFORCED ──► STARTING
        ▲                                                        │
        └──────────────another fence, which does not count yet───┘

Which zones are left out is foreseen from where home and the vehicle are, and told; a text of the vehicle's confirms it. What is promised does not rest on them:
the route keeps its clearance alone. Where a fence counts at once, as on ArduPilot, nothing is waited for.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.states import Cue, Signal, State
from mavlink_bridge.errors import RefusedError
from mavlink_bridge.mavlink import messages as m
from missions.ground.px4_fence import unenforced_zones
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.messages import Frame
    from missions.fence import Fence
    from missions.situation import Known

_JUDGED_WITHIN_S = 4.0
"""MISSION_CURRENT comes once a second, and with the id of a new list up to a second late; so long it is waited for, then the vehicle's answer to AUTO has to do."""

_ID_LATE_S = 1.2
"""So long after an upload MISSION_CURRENT may still be about the mission before: measured was a second."""

_INVALID = 1
"""MISSION_STATE_NO_MISSION: there is none, or the one there is is not valid."""

_MOST_TEXTS = 4  # of reasons; chosen
_TEXTS_S = 15.0
"""So long ago a text may be a reason: a mission is judged when its last item is stored, and again when the fence counts, up to 6.5 s later."""

_GRAVE = 4  # MAV_SEVERITY_WARNING


class FenceGuard(Part):
    """Knows when the vehicle's fence counts, and whether its mission does.

    Attributes
    ----------
    has_refused : bool
        Whether the vehicle did not take our newest mission for valid.
    """

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        self._fence: Known[Fence] | None = None
        self._counts_from_s = -math.inf
        self._told_counting = True
        self._verified_s = math.inf
        self._mission_id = 0
        self._judged: tuple[float, bool] = (-math.inf, True)  # when, and whether it is valid
        self._texts: deque[tuple[float, str]] = deque(maxlen=_MOST_TEXTS)
        self._left_out: dict[str, str] = {}  # zones and why
        self._told: frozenset[tuple[str, str]] = frozenset()
        self.has_refused = False

    @property
    def deadline_s(self) -> float | None:
        """When a fence begins to count, or a mission was waited for long enough."""
        if self.core.state is State.VERIFIED and math.isfinite(self._verified_s):
            return max(self._counts_from_s, -math.inf if self._is_judged else self._give_up_s)
        return None if self._told_counting else self._counts_from_s

    def counts(self, now_s: float) -> bool:
        """Return whether the fence counts by now."""
        return now_s >= self._counts_from_s

    def verified(self, now_s: float, *, may_begin: bool) -> Sequence[Signal]:
        """Go on from a verified mission: at once where a fence counts at once, else when it does and the mission was not refused."""
        self.has_refused = False
        if not self._has_to_wait:
            return [Cue.DRIVE] if may_begin else self.core.end()
        if self.core.orders.once and not self.core.orders.drive:
            return self.core.end()
        self._verified_s = now_s
        return []

    def enforced(self, now_s: float, *, may_begin: bool) -> Sequence[Signal]:
        """Report that the fence counts, and go on."""
        self._verified_s = math.inf
        self._tell_counting(now_s)
        return [Cue.DRIVE] if may_begin else []

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Notice another fence, what the vehicle says of it, and what it makes of our mission."""
        core, message = self.core, frame.message
        if core.situation.fence is not self._fence:
            self._take_fence(self._fence, now_s)
        if not core.is_from_vehicle(frame):
            return []
        if isinstance(message, m.MissionAck | m.MissionCount):
            self._note_id(message)
        elif isinstance(message, m.MissionCurrent):
            self._judge(message, now_s)
        elif isinstance(message, m.Statustext):
            self._take_text(message, now_s)
        return self._go_on(now_s)

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Notice that a fence counts by now."""
        if not self._told_counting and self.counts(now_s):
            self._tell_counting(now_s)
        return self._go_on(now_s)

    @property
    def is_waiting(self) -> bool:
        """Whether a verified mission waits for its fence to count."""
        return self.core.state is State.VERIFIED and math.isfinite(self._verified_s)

    @property
    def _has_to_wait(self) -> bool:
        table = self.core.autopilot
        return table.fence.seconds_a_vertex > 0 or table.driving.judges_missions

    @property
    def _give_up_s(self) -> float:
        return max(self._verified_s, self._counts_from_s) + _JUDGED_WITHIN_S

    @property
    def _is_judged(self) -> bool:
        """Whether the vehicle has told what it makes of our mission, with the fence that counts."""
        return self._judged[0] >= max(self._verified_s, self._counts_from_s)

    def _go_on(self, now_s: float) -> Sequence[Signal]:
        core = self.core
        if core.state is not State.VERIFIED or not math.isfinite(self._verified_s) or not self.counts(now_s):
            return []
        if not self._is_judged and now_s < self._give_up_s:
            return []
        if self._is_judged and not self._judged[1]:
            return self._refused(now_s)
        return [Cue.ENFORCED]

    def _refused(self, now_s: float) -> Sequence[Signal]:
        self._verified_s = math.inf
        self.has_refused = True
        told = dict.fromkeys(text for time_s, text in self._texts if now_s <= time_s + _TEXTS_S)
        why = "".join(f"; {text}" for text in told)
        name = self.core.autopilot.kind
        trouble = RefusedError(
            f"the mission is verified on the vehicle, but {name} reports it as not valid and would not drive it{why}",
            advice="check the fence and GF_MAX_HOR_DIST: every waypoint must be within them",
        )
        self.core.voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        return self.core.fail_step(trouble)

    # What is heard

    def _take_fence(self, before: Known[Fence] | None, now_s: float) -> None:
        """Take notice of another fence: read just now it may have been written just before."""
        fence = self._fence = self.core.situation.fence
        rules = self.core.autopilot.fence
        is_known = fence is not None and before is not None and fence.value == before.value
        if fence is None or is_known or not rules.seconds_a_vertex:
            return
        # A circle counts as a vertex does: it is an item of the list.
        self._counts_from_s = now_s + rules.counts_after_s(fence.value.vertex_count)
        self._told_counting = False
        self._left_out = {}
        self._told = frozenset()

    def _note_id(self, message: m.MissionAck | m.MissionCount) -> None:
        is_ours = (message.target_system, message.target_component) == self.core.identity
        if is_ours and message.mission_type == m.MissionType.MISSION and message.opaque_id:
            self._mission_id = message.opaque_id

    def _judge(self, message: m.MissionCurrent, now_s: float) -> None:
        if not self.core.autopilot.driving.judges_missions or not math.isfinite(self._verified_s):
            return
        is_known = bool(message.mission_id and self._mission_id)
        if is_known and message.mission_id != self._mission_id:
            return
        if is_known or now_s >= self._verified_s + _ID_LATE_S:
            self._judged = (now_s, message.mission_state != _INVALID)

    def _take_text(self, message: m.Statustext, now_s: float) -> None:
        if message.severity <= _GRAVE:
            self._texts.append((now_s, message.text.strip()))
        reason = self.core.autopilot.fence.reason_of(message.text)
        if reason is None:
            return
        zones = [zone for zone, why in unenforced_zones(self.core.situation) if why == reason]
        self._tell_left_out(zones or ["a zone that it does not name"], reason, message.text.strip(), now_s)

    # What is told

    def _tell_left_out(self, zones: Sequence[str], reason: str, text: str, now_s: float) -> None:
        told = frozenset((zone, reason) for zone in zones)
        if told <= self._told:
            return
        self._told |= told
        self._left_out |= dict.fromkeys(zones, reason)
        because = "" if reason not in _SIDES else f": {_SIDES[reason]}"
        said = f' ("{text}")' if text else ""
        words = f"the vehicle does not enforce {', '.join(zones)}{because}{said}"
        self.core.voice.tell(now_s, EventName.NOT_ENFORCED, words, list(zones), reason)

    def _tell_counting(self, now_s: float) -> None:
        if self._told_counting:
            return
        self._told_counting = True
        fence = self.core.situation.fence
        if fence is None or not fence.value.zones:
            return
        for reason in _SIDES:
            zones = [zone for zone, why in unenforced_zones(self.core.situation) if why == reason]
            if zones:
                self._tell_left_out(zones, reason, "", now_s)
        count, left_out = len(fence.value.zones), list(self._left_out)
        text = f"the fence is in force: {counted(count, 'zone')}"
        text += f", but for {', '.join(left_out)}" if left_out else ""
        self.core.voice.tell(now_s, EventName.ENFORCED, text, count, fence.value.vertex_count, left_out)


_SIDES = {
    "home": "home is on its forbidden side",
    "the vehicle": "the vehicle is armed on its forbidden side",
}
"""Why a zone is left out."""
