"""Which lists went over a link: every upload, read-back and deletion that a log shows, whole or in part."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.fold import KINDS, kinds_of
from mavlink_bridge.logbook.facts import Ending, Sender, Transfer, Way
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.wire import mission_result

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message
    from missions.situation import ListKind

_GUIDED = (2, 3)
"""MISSION_ITEM.current of what is no item but a target or an altitude."""

_LATE_S = 3.0
"""Items and requests so shortly after a transfer's end are late repeats."""

TRANSFER_TYPES = frozenset(
    {
        m.MissionCount,
        m.MissionItem,
        m.MissionItemInt,
        m.MissionRequest,
        m.MissionRequestInt,
        m.MissionAck,
        m.MissionClearAll,
        m.MissionWritePartialList,
    }
)
"""The message types looked at."""


@dataclass(slots=True)
class _Open:
    kind: ListKind
    way: Way
    station: Sender | None
    begun_s: float
    ended_s: float
    announced: int | None
    seen: set[int] = field(default_factory=set)
    repeats: int = 0

    @property
    def is_whole(self) -> bool:
        return self.announced is not None and len(self.seen) >= self.announced


class TransferWatch:
    """Follows the transfers of one vehicle.

    Parameters
    ----------
    system, component : int
        The vehicle's autopilot; everybody else is a station.
    """

    def __init__(self, system: int, component: int) -> None:
        self._vehicle = (system, component)
        self._open: dict[tuple[ListKind, bool], _Open] = {}
        self._ended_s: dict[tuple[ListKind, bool], float] = {}
        self._finished: list[Transfer] = []

    def look(self, frame: Frame, now_s: float) -> None:
        """Take a frame of any sender."""
        message = frame.message
        if type(message) not in TRANSFER_TYPES:
            return
        sender = (frame.system, frame.component)
        if sender == self._vehicle:
            self._told(message, now_s)
        elif getattr(message, "target_system", 0) in (0, self._vehicle[0]):
            self._asked(message, sender, now_s)

    def finish(self) -> tuple[Transfer, ...]:
        """Return all transfers in the order of their beginning; what is still open ends here."""
        for key in list(self._open):
            self._close(key)
        return tuple(sorted(self._finished, key=lambda transfer: transfer.begun_s))

    def _told(self, message: Message, now_s: float) -> None:
        if isinstance(message, m.MissionAck):
            for each in kinds_of(message.mission_type):
                self._answered(each, message, now_s)
        elif (kind := _kind(message)) is not None:
            station = _addressee(message)
            if isinstance(message, m.MissionCount):
                self._begin(kind, Way.READ_BACK, station, message.count, now_s)
            elif isinstance(message, m.MissionItem | m.MissionItemInt):
                self._item(kind, Way.READ_BACK, station, message.seq, now_s)
            elif isinstance(message, m.MissionRequest | m.MissionRequestInt):
                # The only trace of an upload in a log that holds the vehicle's side alone.
                self._reach(kind, Way.UPLOAD, station, now_s)

    def _asked(self, message: Message, sender: Sender, now_s: float) -> None:
        if isinstance(message, m.MissionClearAll):
            for each in kinds_of(message.mission_type):
                self._begin(each, Way.CLEAR, sender, 0, now_s)
        elif (kind := _kind(message)) is not None:
            if isinstance(message, m.MissionCount):
                self._begin(kind, Way.UPLOAD, sender, message.count, now_s)
            elif isinstance(message, m.MissionWritePartialList):
                count = max(0, message.end_index - message.start_index + 1)
                self._begin(kind, Way.PARTIAL_WRITE, sender, count, now_s)
            elif isinstance(message, m.MissionItem | m.MissionItemInt) and message.current not in _GUIDED:
                self._item(kind, Way.UPLOAD, sender, message.seq, now_s)

    def _begin(self, kind: ListKind, way: Way, station: Sender | None, count: int, now_s: float) -> None:
        key = (kind, way is not Way.READ_BACK)
        known = self._open.get(key)
        if known and (known.way, known.station, known.announced) == (way, station, count) and not known.seen:
            known.ended_s = now_s
            known.repeats += 1
            return
        self._close(key)
        self._open[key] = _Open(kind, way, station, now_s, now_s, count)
        if way is Way.READ_BACK and count == 0:
            self._close(key)

    def _item(self, kind: ListKind, way: Way, station: Sender | None, seq: int, now_s: float) -> None:
        transfer = self._reach(kind, way, station, now_s)
        if transfer is None:
            return
        transfer.repeats += seq in transfer.seen
        transfer.seen.add(seq)
        if way is Way.READ_BACK and transfer.is_whole:
            self._close((kind, False))

    def _reach(self, kind: ListKind, way: Way, station: Sender | None, now_s: float) -> _Open | None:
        """Return the transfer under way, or one whose announcement was not seen; None for a message that comes late."""
        key = (kind, way is not Way.READ_BACK)
        if key not in self._open:
            if now_s <= self._ended_s.get(key, -math.inf) + _LATE_S:
                return None
            self._open[key] = _Open(kind, way, station, now_s, now_s, None)
        self._open[key].ended_s = now_s
        return self._open[key]

    def _answered(self, kind: ListKind, ack: m.MissionAck, now_s: float) -> None:
        key = (kind, True)
        if key not in self._open or ack.type == m.MissionResult.INVALID_SEQUENCE:
            return
        self._open[key].ended_s = now_s
        known = mission_result(ack.type)
        self._close(key, known.name if known is not None else str(ack.type))

    def _close(self, key: tuple[ListKind, bool], result: str | None = None) -> None:
        transfer = self._open.pop(key, None)
        if transfer is None:
            return
        self._ended_s[key] = transfer.ended_s
        is_written = transfer.way is not Way.READ_BACK
        if result not in (None, m.MissionResult.ACCEPTED.name):
            ending = Ending.REFUSED
        elif not transfer.is_whole:
            ending = Ending.PARTIAL
        else:
            ending = Ending.UNANSWERED if is_written and result is None else Ending.COMPLETE
        self._finished.append(
            Transfer(
                transfer.kind,
                transfer.way,
                transfer.station,
                transfer.begun_s,
                transfer.ended_s,
                transfer.announced,
                len(transfer.seen),
                ending,
                result,
                transfer.repeats,
            )
        )


def _kind(message: Message) -> ListKind | None:
    return KINDS.get(message.mission_type)  # type: ignore[attr-defined]


def _addressee(message: Message) -> Sender | None:
    target = (getattr(message, "target_system", 0), getattr(message, "target_component", 0))
    return target if target[0] else None
