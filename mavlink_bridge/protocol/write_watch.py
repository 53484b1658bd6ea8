"""Hearing that somebody else writes a list while it is read.

A list is read item by item. Whoever replaces an item that was read already is not seen in what is read, but mostly heard on the link: the
vehicle asks the other station for the item and acknowledges it, and the other station's own messages come by where links are joined. Reading is
no writing: stations read lists all the time, so MISSION_REQUEST_LIST, item requests to the vehicle, and the vehicle's counts and items to others
say nothing.

What is addressed to us, or comes with our ids, may be a late copy of our own upload's. It counts from the moment when the vehicle reported the length of
the list: a vehicle that does so is taking no items from us. What comes with our ids counts unless we have sent the same.

What no message on this link carries cannot be heard: a write on another port of the vehicle, by MAVFTP, or one of which every message was lost here.
Where the vehicle fills the ids of MISSION_CURRENT, its total, or the number in the parameters MIS_TOTAL and so on, a change of these counts too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.protocol.wire import wire_key

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.protocol.peer import Peer

_WRITES = (m.MissionCount, m.MissionItem, m.MissionItemInt, m.MissionWritePartialList, m.MissionClearAll)
_REQUESTS = (m.MissionRequest, m.MissionRequestInt)
_NOT_STORED = frozenset({2, 3})
"""MISSION_ITEM(_INT).current of a place to go to or an altitude, which is no item of a list."""

_ANSWERS_TO_READERS = frozenset(
    {
        MissionResult.ERROR,
        MissionResult.UNSUPPORTED,
        MissionResult.NO_SPACE,
        MissionResult.INVALID_SEQUENCE,
        MissionResult.DENIED,
    }
)
"""What a vehicle also answers to one that reads, or to a write that changed nothing; before one that did it asks for items."""

_PREFLIGHT_STORAGE = 245
"""MAV_CMD whose param2 writes (1) or resets (2) the stored mission."""

_TOTALS = {
    MissionType.MISSION: "MIS_TOTAL",
    MissionType.FENCE: "FENCE_TOTAL",
    MissionType.RALLY: "RALLY_TOTAL",
}
_IDS = {
    MissionType.MISSION: ("total", "mission_id"),
    MissionType.FENCE: ("fence_id",),
    MissionType.RALLY: ("rally_points_id",),
}


class WriteWatch:
    """Listens for writes of one list that are not ours.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mission_type : MissionType
        Which list.

    Attributes
    ----------
    writer : tuple of int, optional
        System and component of the other station last heard to write, as far as that is known; our own ids if somebody speaks with these.
    """

    def __init__(self, peer: Peer, mission_type: MissionType) -> None:
        self.writer: tuple[int, int] | None = None
        self._peer = peer
        self._own = (peer.own_system, peer.own_component)
        self._mission_type = mission_type
        self._sent: set[tuple[object, ...]] = set()
        self._expects_text = False
        self._is_counted = False
        self._told: dict[str, float] = {}
        self._heard_s = -math.inf
        self._is_disturbed = False

    @property
    def is_disturbed(self) -> bool:
        """Whether somebody else was heard to write since `begin`."""
        return self._is_disturbed

    @property
    def heard_s(self) -> float:
        """When somebody else was last heard to write."""
        return self._heard_s

    def begin(self) -> None:
        """Forget what was heard: the list is read afresh."""
        self._is_disturbed = self._is_counted = False
        self._told.clear()

    def counted(self) -> None:
        """Note that the vehicle has sent the length of the list: it takes no items from us."""
        self._is_counted = True

    def note_sent(self, message: Message) -> None:
        """Remember what we write ourselves."""
        if isinstance(message, _WRITES):
            self._sent.add(wire_key(message))
            self._expects_text = self._expects_text or isinstance(message, m.MissionCount)

    def look(self, frame: Frame, now_s: float) -> None:
        """Take any frame heard on the link."""
        sender = (frame.system, frame.component)
        if sender == (self._peer.system, self._peer.component):
            self._look_at_vehicle(frame.message, now_s)
        elif self._is_write(frame.message, sender):
            self._disturb(sender, now_s)

    def _disturb(self, writer: tuple[int, int] | None, now_s: float) -> None:
        self._is_disturbed = True
        self._heard_s = now_s
        self.writer = writer or self.writer

    def _is_ours(self, mission_type: int) -> bool:
        return mission_type in (self._mission_type, MissionType.ALL)

    def _is_write(self, message: Message, sender: tuple[int, int]) -> bool:
        if getattr(message, "target_system", None) not in (0, self._peer.system):
            return False
        if isinstance(message, m.CommandLong | m.CommandInt):
            return message.command == _PREFLIGHT_STORAGE and message.param2 != 0
        if not isinstance(message, _WRITES) or not self._is_ours(message.mission_type):
            return False
        if isinstance(message, m.MissionItem | m.MissionItemInt) and message.current in _NOT_STORED:
            return False
        return sender != self._own or wire_key(message) not in self._sent

    def _look_at_vehicle(self, message: Message, now_s: float) -> None:
        if isinstance(message, _REQUESTS) and self._is_ours(message.mission_type):
            self._answered((message.target_system, message.target_component), now_s)
        elif isinstance(message, m.MissionAck) and self._is_ours(message.mission_type):
            if message.type not in _ANSWERS_TO_READERS:
                self._answered((message.target_system, message.target_component), now_s)
        elif isinstance(message, m.MissionCurrent):
            for field in _IDS.get(self._mission_type, ()):
                self._compare(field, getattr(message, field), now_s)
        elif isinstance(message, m.ParamValue):
            if message.param_id == _TOTALS.get(self._mission_type):
                self._compare(message.param_id, message.param_value, now_s)
        elif isinstance(message, m.Statustext):
            stored = self._peer.autopilot.texts.list_stored
            if stored is not None and message.text.lower().startswith(stored):
                self._take_stored_text(now_s)

    def _take_stored_text(self, now_s: float) -> None:
        """Take the word that a mission was written: once for each upload of ours it is about that."""
        is_ours, self._expects_text = self._expects_text, False
        if self._mission_type is MissionType.MISSION and self._is_counted and not is_ours:
            self._disturb(None, now_s)

    def _answered(self, target: tuple[int, int], now_s: float) -> None:
        may_be_ours = target in (self._own, (0, 0))
        if self._is_counted or not may_be_ours:
            self._disturb(self._own if may_be_ours else target, now_s)

    def _compare(self, name: str, value: float, now_s: float) -> None:
        """Notice that a number changed which the vehicle reports of the list."""
        if self._is_counted and self._told.setdefault(name, value) != value:
            self._told[name] = value
            self._disturb(None, now_s)
