"""PX4's side of the mission protocol, as measured: one transfer at a time on a link, with a state for downloads, too. Sans-IO, without a clock."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum, auto
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.simulator.mission_server import float_message, int_message, item_of_floats, item_of_ints
from missions.items import CoordinateFrame

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mavlink_bridge.simulator.px4.lists import Px4List
    from missions.items import MissionItem

REQUEST_AGAIN_S = 0.25
TIMEOUT_S = 5.0
"""A transfer without a message for so long is given up, without a MISSION_ACK."""

COUNT_AGAIN = 20
"""How often 1.18 repeats a list's MISSION_COUNT until the first request."""

_CACHE_ITEMS = 500
_CRITICAL, _INFO, _WARNING = 2, 6, 4  # MAV_SEVERITY
_COMPONENTS = (0, 1, 190)
"""The components that answer: everybody, the autopilot, and that of missions."""


class _Phase(Enum):
    IDLE = auto()
    TAKING = auto()
    GIVING = auto()


class Px4Transfers:
    """The vehicle's side of all transfers on one link.

    Parameters
    ----------
    lists : mapping of MissionType to Px4List
        What is written to and read from.
    system : int
        The vehicle's system id.
    repeats_count : bool
        Whether a MISSION_COUNT is repeated until the first request, and texts are those of 1.18.
    current : callable
        Returns the mission's item that is the current one: it is marked where the mission is read.
    """

    def __init__(
        self,
        lists: Mapping[MissionType, Px4List],
        system: int = 1,
        *,
        repeats_count: bool = False,
        current: Callable[[], int] = lambda: -1,
    ) -> None:
        self.lists = lists
        self._current = current
        self._by_number = {int(kind): stored for kind, stored in lists.items()}
        self._system = system
        self._repeats_count = repeats_count
        self._outbox: list[m.Message] = []
        self.reboot()

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called; None while no transfer is under way."""
        if self._state is _Phase.IDLE:
            return None
        if self._state is _Phase.TAKING or self._counts_left:
            return min(self._sent_s + REQUEST_AGAIN_S, self._heard_s + TIMEOUT_S)
        return self._heard_s + TIMEOUT_S

    @property
    def is_idle(self) -> bool:
        """Whether no transfer is under way."""
        return self._state is _Phase.IDLE

    def messages_to_send(self) -> list[m.Message]:
        """Return what is to be sent, and forget it."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def reboot(self) -> None:
        """Forget what is not stored."""
        self._state = _Phase.IDLE
        self._partner = (0, 0)
        self._type = int(MissionType.MISSION)
        self._seq = self._count = 0
        self._counts_left = 0
        self._is_claimed = False
        self._is_exact = True
        self._sent_s = self._heard_s = 0.0
        self._outbox.clear()

    def receive(self, frame: m.Frame, now_s: float) -> None:
        """Take a frame; what is not the mission protocol's is ignored."""
        message, client = frame.message, (frame.system, frame.component)
        if not isinstance(message, m.Addressed) or message.target_system != self._system:
            return  # to system 0, too: silence
        if message.target_component not in _COMPONENTS:
            return
        match message:
            case m.MissionCount():
                self._take_count(client, message, now_s)
            case m.MissionItemInt() | m.MissionItem():
                self._is_exact = isinstance(message, m.MissionItemInt)
                self._take_item(client, message, now_s)
            case m.MissionRequestList():
                self._begin_giving(client, message.mission_type, now_s)
            case m.MissionRequestInt() | m.MissionRequest():
                self._is_exact = isinstance(message, m.MissionRequestInt)
                self._give(client, message.seq, message.mission_type, now_s)
            case m.MissionAck():
                self._take_ack(client, message, now_s)
            case m.MissionClearAll():
                self._clear(client, message.mission_type)

    def handle_timer(self, now_s: float) -> None:
        """Repeat a request or a count, or give a transfer up."""
        if self._state is _Phase.IDLE:
            return
        if now_s >= self._heard_s + TIMEOUT_S:
            self._say(_CRITICAL, "Mission sync timeout" if self._repeats_count else "Operation timeout")
            self._end()
        elif self._state is _Phase.TAKING and now_s >= self._sent_s + REQUEST_AGAIN_S:
            self._ask(now_s)
        elif self._counts_left and now_s >= self._sent_s + REQUEST_AGAIN_S:
            self._counts_left -= 1
            self._send_count(now_s)

    def _take_count(self, client: tuple[int, int], message: m.MissionCount, now_s: float) -> None:
        if self._state is _Phase.GIVING:
            self._say(_CRITICAL, "WPM: IGN MISSION_COUNT: Busy")
            self._ack(client, MissionResult.ERROR, message.mission_type)
        elif self._state is _Phase.TAKING:
            self._heard_s = now_s
            if client != self._partner:
                self._ack(client, MissionResult.ERROR)
            elif self._seq == 0:
                self._ask(now_s)  # the first count stays
            else:
                self._say(_CRITICAL, "WPM: REJ. CMD: Busy")
                self._ack(client, MissionResult.ERROR)
        elif self._is_claimed:
            self._ack(client, MissionResult.ERROR, message.mission_type)
        else:
            self._begin_taking(client, message, now_s)

    def _begin_taking(self, client: tuple[int, int], message: m.MissionCount, now_s: float) -> None:
        stored = self._by_number.get(message.mission_type)
        self._partner, self._type = client, message.mission_type
        if message.count > (stored.limit if stored is not None else 0):
            self._ack(client, MissionResult.NO_SPACE)
        elif message.count == 0:
            if stored is not None:
                stored.clear()
            self._ack(client, MissionResult.ACCEPTED)
        else:
            assert stored is not None
            stored.begin()
            self._state, self._is_claimed = _Phase.TAKING, True
            self._seq, self._count = 0, message.count
            self._heard_s = now_s
            self._ask(now_s)

    def _take_item(
        self, client: tuple[int, int], message: m.MissionItemInt | m.MissionItem, now_s: float
    ) -> None:
        if client != self._partner:
            self._say(_CRITICAL, "REJ. MIS ITEM: partner id mismatch")
        elif message.mission_type != self._type:
            self._ack(client, MissionResult.ERROR)
        elif self._state is _Phase.GIVING:
            self._say(_CRITICAL, "IGN MISSION_ITEM: Busy")
            self._ack(client, MissionResult.ERROR)
        elif self._state is _Phase.IDLE:
            if message.seq + 1 == self._seq:
                self._ack(client, MissionResult.ACCEPTED)
            else:
                self._say(_CRITICAL, "IGN MISSION_ITEM: No transfer")
                self._ack(client, MissionResult.ERROR)
        else:
            self._heard_s = now_s
            if message.seq == self._seq:
                self._store(message, now_s)

    def _store(self, message: m.MissionItemInt | m.MissionItem, now_s: float) -> None:
        stored = self._by_number[self._type]
        result = stored.take(_item(message), current=message.current)
        if result is not MissionResult.ACCEPTED:
            if result is not MissionResult.ERROR:
                self._say(_CRITICAL, "IGN MISSION_ITEM: Invalid item")
            self._ack(self._partner, result)
            self._end()
            return
        self._seq += 1
        if self._seq < self._count:
            self._ask(now_s)
            return
        stored.finish()
        if self._repeats_count and len(stored) > _CACHE_ITEMS and self._type == MissionType.MISSION:
            self._say(
                _WARNING, f"Mission with {len(stored)} items exceeds route cache capacity {_CACHE_ITEMS}"
            )
        self._end()
        self._ack(self._partner, MissionResult.ACCEPTED)

    def _begin_giving(self, client: tuple[int, int], mission_type: int, now_s: float) -> None:
        stored = self._by_number.get(self._type)
        if stored is not None and self._seq == len(stored):
            # As read in the source: a transfer at the stored list's end counts as over. An upload that happens to stand there ends, and stays the one under way.
            self._state = _Phase.IDLE
        is_again = self._state is _Phase.GIVING and (client, mission_type) == (self._partner, self._type)
        if self._state is not _Phase.IDLE and not is_again:
            self._say(_INFO, "Mission download request ignored, already active")
            return
        self._state, self._partner, self._type = _Phase.GIVING, client, mission_type
        self._seq = 0
        wanted = self._by_number.get(mission_type)
        self._count = len(wanted) if wanted is not None else 0
        self._heard_s = now_s
        self._counts_left = COUNT_AGAIN if self._repeats_count else 0
        self._send_count(now_s)

    def _send_count(self, now_s: float) -> None:
        self._sent_s = now_s
        stored = self._by_number.get(self._type)
        list_id = stored.id if stored is not None else 0
        self._outbox.append(m.MissionCount(*self._partner, self._count, self._type, list_id))

    def _give(self, client: tuple[int, int], seq: int, mission_type: int, now_s: float) -> None:
        if client != self._partner:
            self._say(_CRITICAL, "WPM: REJ. CMD: partner id mismatch")
            return
        if self._state is not _Phase.GIVING:
            if self._state is _Phase.TAKING:
                self._say(_CRITICAL, "WPM: REJ. CMD: Busy")
            return
        if mission_type != self._type:
            return
        self._heard_s, self._counts_left = now_s, 0
        if seq == self._seq and seq < self._count:
            self._seq += 1
        elif seq != self._seq - 1:
            self._end()
            self._ack(client, MissionResult.ERROR)
            self._say(_CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected")
            return
        item = self._by_number[self._type].read(seq)
        if self._type == MissionType.MISSION:
            item = replace(item, current=seq == self._current())
        if self._is_exact:
            self._outbox.append(int_message(client, seq, item, self._type))
            return
        message = float_message(client, seq, item, self._type)
        if item.frame == CoordinateFrame.MISSION:
            message = replace(message, x=float(item.lat_e7), y=float(item.lon_e7))
        self._outbox.append(message)

    def _take_ack(self, client: tuple[int, int], message: m.MissionAck, now_s: float) -> None:
        if client != self._partner:
            self._say(_CRITICAL, "REJ. WP CMD: partner id mismatch")
        elif self._state is _Phase.GIVING and message.mission_type == self._type:
            self._heard_s = now_s
            self._end()
        elif self._state is _Phase.TAKING and message.type == MissionResult.OPERATION_CANCELLED:
            self._end()

    def _clear(self, client: tuple[int, int], mission_type: int) -> None:
        if self._state is not _Phase.IDLE:
            self._say(_CRITICAL, "WPM: IGN CLEAR CMD: Busy")
            return
        self._type = mission_type
        for kind, stored in self._by_number.items():
            if mission_type in (kind, MissionType.ALL):
                stored.clear()
        self._ack(client, MissionResult.ACCEPTED)

    def _ask(self, now_s: float) -> None:
        self._sent_s = now_s
        request = m.MissionRequestInt if self._is_exact else m.MissionRequest
        self._outbox.append(request(*self._partner, self._seq, self._type))

    def _end(self) -> None:
        self._state = _Phase.IDLE
        self._is_claimed = False
        self._counts_left = 0

    def _ack(self, client: tuple[int, int], result: MissionResult, mission_type: int | None = None) -> None:
        kind = self._type if mission_type is None else mission_type
        stored = self._by_number.get(kind)
        list_id = stored.id if stored is not None and result is MissionResult.ACCEPTED else 0
        self._outbox.append(m.MissionAck(*client, result, kind, list_id))

    def _say(self, severity: int, text: str) -> None:
        self._outbox.append(m.Statustext(severity, f"{text}\t"[:50]))


def _item(message: m.MissionItemInt | m.MissionItem) -> MissionItem:
    if isinstance(message, m.MissionItemInt):
        item = item_of_ints(message)
    else:
        item = item_of_floats(message)
        if message.frame == CoordinateFrame.MISSION:
            item = replace(item, lat_e7=int(message.x), lon_e7=int(message.y))
    return replace(item, autocontinue=bool(message.autocontinue))
