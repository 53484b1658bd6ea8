"""Noticing what others change on the vehicle: its fence, its mission, its rally points; and that it was switched off and on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.fold import KINDS, kinds_of
from mavlink_bridge.mavlink import messages as m
from missions.situation import ListKind

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message

_TEXTS = {
    "fence indexed": ListKind.FENCE,
    "fence upload": ListKind.FENCE,
    "flight plan received": ListKind.MISSION,
    "mission upload timeout": ListKind.MISSION,
}
_IDS = (
    ("mission_id", ListKind.MISSION),
    ("fence_id", ListKind.FENCE),
    ("rally_points_id", ListKind.RALLY),
)
"""What MISSION_CURRENT tells of each list; the ids are 0 where the autopilot does not fill them, and of an empty list."""

_ID_LATE_S = 1.5
"""For so long after a list was changed MISSION_CURRENT may tell its former id: measured was a second."""

_FENCE_TOTAL, _MISSION_TOTAL = "FENCE_TOTAL", "MIS_TOTAL"
_REBOOT_MS = 5000  # GLOBAL_POSITION_INT.time_boot_ms this much earlier is no message out of order; chosen, not measured

POLL_EVERY_S = 60.0
"""How often lists are read again without any sign of change."""

FENCE_EVERY_S = 8.0
"""How often the fence is, while the vehicle drives: the one message that tells of a change may be lost."""

WRITTEN_AFTER_S = 1.5
"""So long after the vehicle last asked somebody for an item of a list, that is taken for written: the word that it is may be lost."""


class ChangeWatch:
    """Looks at the vehicle's frames for signs of change, and suspects every list now and then.

    Parameters
    ----------
    identity : tuple of int
        Our ids; what is acknowledged to us we did ourselves.
    kinds : frozenset of ListKind
        The lists that matter.
    """

    def __init__(self, identity: tuple[int, int], kinds: frozenset[ListKind]) -> None:
        self.suspects: set[ListKind] = set()
        self._poll_due_s = self._fence_due_s = math.inf
        self._identity = identity
        self._kinds = kinds
        self._totals: dict[str, float] = {}
        self._asked_for_s: dict[ListKind, float] = {}  # lists that somebody is writing
        self._known_ids: dict[ListKind, tuple[int, float]] = {}  # as we wrote or read the list, and when

    def deadline_s(self, *, is_driving: bool) -> float:
        """When lists are to be read again."""
        if self.suspects:
            return -math.inf
        written_s = min(self._asked_for_s.values(), default=math.inf) + WRITTEN_AFTER_S
        return min(self._poll_due_s, self._fence_due_s if is_driving else math.inf, written_s)

    def settle(self, now_s: float) -> None:
        """Take notice that all lists were just read."""
        self.suspects.clear()
        self._asked_for_s.clear()
        self._poll_due_s = now_s + POLL_EVERY_S
        self._fence_due_s = now_s + FENCE_EVERY_S

    def suspect_all(self) -> None:
        """Suspect every list that matters."""
        self.suspects |= self._kinds

    def due(self, now_s: float, *, is_driving: bool) -> set[ListKind]:
        """Return and forget the lists that are to be read again."""
        if now_s >= self._poll_due_s:
            self._poll_due_s = now_s + POLL_EVERY_S
            self.suspects |= self._kinds
        if is_driving and now_s >= self._fence_due_s:
            self.suspects.add(ListKind.FENCE)
        written = {one for one, asked_s in self._asked_for_s.items() if now_s >= asked_s + WRITTEN_AFTER_S}
        for kind in written:
            del self._asked_for_s[kind]
        self.suspects |= written
        if ListKind.FENCE in self.suspects:
            self._fence_due_s = now_s + FENCE_EVERY_S
        suspects, self.suspects = self.suspects, set()
        return suspects

    def look(self, frame: Frame, now_s: float) -> None:
        """Suspect the lists that a frame of the vehicle says may have changed."""
        message = frame.message
        signs = self._signs(message, now_s) & self._kinds
        self.suspects |= signs
        for kind in signs:
            self._asked_for_s.pop(kind, None)
        if isinstance(message, m.MissionRequest | m.MissionRequestInt) and not self._is_to_us(message):
            asked_for = KINDS.get(message.mission_type)
            if asked_for in self._kinds:
                self._asked_for_s[asked_for] = now_s

    def _is_to_us(
        self, message: m.MissionAck | m.MissionCount | m.MissionRequest | m.MissionRequestInt
    ) -> bool:
        return (message.target_system, message.target_component) == self._identity

    def _signs(self, message: Message, now_s: float) -> set[ListKind]:
        if isinstance(message, m.MissionAck):
            if message.type != m.MissionResult.ACCEPTED:
                return set()
            if self._is_to_us(message):
                self._note_id(message, now_s)
                return set()
            return set(kinds_of(message.mission_type))
        if isinstance(message, m.MissionCount):
            return self._signs_of_count(message, now_s)
        if isinstance(message, m.Statustext):
            text = message.text.lower()
            return {kind for start, kind in _TEXTS.items() if text.startswith(start)}
        if isinstance(message, m.MissionCurrent):
            return self._signs_of_current(message, now_s)
        if isinstance(message, m.ParamValue) and message.param_id in (_FENCE_TOTAL, _MISSION_TOTAL):
            kind = ListKind.FENCE if message.param_id == _FENCE_TOTAL else ListKind.MISSION
            return {kind} if self._changed(message.param_id, message.param_value) else set()
        return set()

    def _note_id(self, message: m.MissionAck | m.MissionCount, now_s: float) -> None:
        """Remember the id of a list that we have just written or read."""
        for kind in kinds_of(message.mission_type):
            if message.opaque_id:
                self._known_ids[kind] = (message.opaque_id, now_s)
            elif isinstance(message, m.MissionCount):
                self._known_ids.pop(kind, None)  # empty, or the autopilot has no ids

    def _signs_of_count(self, message: m.MissionCount, now_s: float) -> set[ListKind]:
        """Compare the list that somebody reads with what is known of it, where it has an id."""
        if self._is_to_us(message):
            self._note_id(message, now_s)
            return set()
        known = self._known_ids
        return {
            kind
            for kind in kinds_of(message.mission_type)
            if message.opaque_id and kind in known and known[kind][0] != message.opaque_id
        }

    def _signs_of_current(self, message: m.MissionCurrent, now_s: float) -> set[ListKind]:
        """Compare ids with those that are known; where a list has none, what is told with what was told before."""
        signs: set[ListKind] = set()
        for field, kind in _IDS:
            told, known = getattr(message, field), self._known_ids.get(kind)
            has_changed = self._changed(field, told)
            if told and known is not None:
                is_other = told != known[0] and now_s >= known[1] + _ID_LATE_S
                signs |= {kind} if is_other else set()
            elif has_changed:
                signs.add(kind)
        has_id = bool(message.mission_id) and ListKind.MISSION in self._known_ids
        if self._changed("total", message.total) and not has_id:
            signs.add(ListKind.MISSION)
        return signs

    def _changed(self, name: str, value: float) -> bool:
        before = self._totals.get(name)
        self._totals[name] = value
        return before is not None and before != value


class RebootWatch:
    """Looks at the vehicle's own clock."""

    def __init__(self) -> None:
        self._boot_ms = 0

    def is_reboot(self, message: Message) -> bool:
        """Return whether the vehicle's clock has started anew."""
        if not isinstance(message, m.GlobalPositionInt):
            return False
        before, self._boot_ms = self._boot_ms, message.time_boot_ms
        return message.time_boot_ms < before - _REBOOT_MS
