"""ArduPilot's side of the mission protocol, as measured: sans-IO, without a clock.

One `TransferServer` keeps one list (mission, fence or rally points) and knows at most one upload; `MissionServer` hands each message
to the server of its mission type. A download has no state: every request is answered for itself.

What is answered by which row stands in ``docs/simulator.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, assert_never

from mavlink_bridge.mavlink.messages import (
    Frame,
    Message,
    MissionAck,
    MissionClearAll,
    MissionCount,
    MissionItem,
    MissionItemInt,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionWritePartialList,
    Statustext,
)
from mavlink_bridge.simulator.parameters import float32
from missions import items

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mavlink_bridge.simulator.item_lists import StoredList

REQUEST_AGAIN_S = 1.0
"""A request that brought no item is repeated after this long."""

UPLOAD_TIMEOUT_S = 8.1
"""An upload without a good item for this long is given up."""

WARNING = 4  # MAV_SEVERITY_WARNING
INFO = 6
"""MAV_SEVERITY of texts about transfers."""

MissionMessage = (
    MissionCount
    | MissionItem
    | MissionItemInt
    | MissionRequest
    | MissionRequestInt
    | MissionRequestList
    | MissionClearAll
    | MissionWritePartialList
)


@dataclass(slots=True)
class _UploadUnderWay:
    """An upload under way: who sends it, which item is wanted, where it ends."""

    client: tuple[int, int]
    wanted: int
    last: int
    count: int
    requested_s: float
    received_s: float


class TransferServer:
    """The vehicle's side of all transfers of one list.

    Parameters
    ----------
    stored : StoredList
        What is written to and read from.
    """

    def __init__(self, stored: StoredList) -> None:
        self.stored = stored
        self._upload: _UploadUnderWay | None = None
        self._outbox: list[Message] = []

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called; None while no upload is under way."""
        if self._upload is None:
            return None
        return min(self._upload.requested_s + REQUEST_AGAIN_S, self._upload.received_s + UPLOAD_TIMEOUT_S)

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent, and forget it."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def receive(self, frame: Frame, message: MissionMessage, now_s: float) -> None:
        """Take a message of this server's mission type; ``message`` is ``frame.message``, its type known."""
        client = (frame.system, frame.component)
        match message:
            case MissionCount():
                self._begin(client, message.count, now_s)
            case MissionWritePartialList():
                self._begin_part(client, message, now_s)
            case MissionItemInt():
                self._take(client, message.seq, item_of_ints(message), now_s)
            case MissionItem():
                self._take(client, message.seq, item_of_floats(message), now_s)
            case MissionRequestList():
                if self._refused(client):
                    return
                self._outbox.append(MissionCount(*client, len(self.stored), self.stored.mission_type))
            case MissionRequestInt():
                self._give(client, message.seq, as_float=False)
            case MissionRequest():
                self._give(client, message.seq, as_float=True)
            case MissionClearAll():
                cleared = self._upload is None and self.stored.clear()
                self._ack(client, MissionResult.ACCEPTED if cleared else MissionResult.ERROR)
            case _:  # pragma: no cover - mypy checks that nothing is left
                assert_never(message)

    def handle_timer(self, now_s: float) -> None:
        """Repeat a request, or give an upload up."""
        upload = self._upload
        if upload is None:
            return
        if now_s >= upload.received_s + UPLOAD_TIMEOUT_S:
            self._end()
            self._say(f"{self.stored.name} upload timeout", WARNING)
            self._ack(upload.client, MissionResult.OPERATION_CANCELLED)
        elif now_s >= upload.requested_s + REQUEST_AGAIN_S:
            self._request(upload, now_s)

    def reboot(self) -> None:
        """Forget what is not stored."""
        self._end()
        self._outbox = []

    def _begin(self, client: tuple[int, int], count: int, now_s: float) -> None:
        if self._upload is not None and self._upload.client != client:
            self._ack(client, MissionResult.DENIED)
            return
        if count > self.stored.limit:
            self._say(f"Only {self.stored.limit} items are supported", WARNING)
            self._ack(client, MissionResult.NO_SPACE)
            return
        self._end()
        self.stored.begin(count)
        if count == 0:
            self._ack(client, MissionResult.ACCEPTED)
            return
        self._start(client, 0, count - 1, count, now_s)

    def _begin_part(self, client: tuple[int, int], message: MissionWritePartialList, now_s: float) -> None:
        if self._refused(client):
            return
        count = len(self.stored)
        if not 0 <= message.start_index <= message.end_index <= count:
            self._say("Flight plan update rejected", WARNING)
            self._ack(client, MissionResult.ERROR)
            return
        self.stored.begin_part()
        self._start(client, message.start_index, message.end_index, max(count, message.end_index + 1), now_s)

    def _start(self, client: tuple[int, int], first: int, last: int, count: int, now_s: float) -> None:
        self._upload = _UploadUnderWay(client, first, last, count, now_s, now_s)
        self._request(self._upload, now_s)

    def _take(self, client: tuple[int, int], seq: int, item: items.MissionItem, now_s: float) -> None:
        upload = self._upload
        if upload is None:
            self._ack(client, MissionResult.ERROR)
        elif seq != upload.wanted:
            self._ack(client, MissionResult.INVALID_SEQUENCE)
        elif client != upload.client:
            self._ack(client, MissionResult.DENIED)
        else:
            self._write(upload, item, now_s)

    def _write(self, upload: _UploadUnderWay, item: items.MissionItem, now_s: float) -> None:
        result = self.stored.write(upload.wanted, item, upload.count)
        if result == MissionResult.ACCEPTED:
            upload.received_s = now_s
            upload.wanted += 1
            if upload.wanted <= upload.last:
                self._request(upload, now_s)
                return
            result = self.stored.finish()
            for text in self.stored.texts:
                self._say(text, INFO if result == MissionResult.ACCEPTED else WARNING)
            self.stored.texts.clear()
        self._end()
        self._ack(upload.client, result)

    def _give(self, client: tuple[int, int], seq: int, *, as_float: bool) -> None:
        if self._refused(client):
            return
        item = self.stored.read(seq)
        if item is None:
            self._outbox.append(MissionCount(*client, len(self.stored), self.stored.mission_type))
            self._ack(client, MissionResult.INVALID_SEQUENCE)
        elif as_float:
            self._outbox.append(float_message(client, seq, item, self.stored.mission_type))
            self._say("got MISSION_REQUEST; use MISSION_REQUEST_INT!", WARNING)
        else:
            self._outbox.append(int_message(client, seq, item, self.stored.mission_type))

    def _refused(self, client: tuple[int, int]) -> bool:
        if self._upload is None:
            return False
        self._ack(client, MissionResult.DENIED)
        return True

    def _request(self, upload: _UploadUnderWay, now_s: float) -> None:
        upload.requested_s = now_s
        self._outbox.append(MissionRequest(*upload.client, upload.wanted, self.stored.mission_type))

    def _end(self) -> None:
        self._upload = None
        self.stored.abandon()

    def _ack(self, client: tuple[int, int], result: MissionResult) -> None:
        self._outbox.append(MissionAck(*client, result, self.stored.mission_type))

    def _say(self, text: str, severity: int) -> None:
        self._outbox.append(Statustext(severity, text[:50]))


class MissionServer:
    """All lists of a vehicle; a mission type it does not keep is answered with UNSUPPORTED."""

    def __init__(self, lists: Iterable[StoredList]) -> None:
        self._servers = {int(stored.mission_type): TransferServer(stored) for stored in lists}
        self._outbox: list[Message] = []

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called; None while no upload is under way."""
        deadlines = [server.deadline_s for server in self._servers.values()]
        return min((deadline_s for deadline_s in deadlines if deadline_s is not None), default=None)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not the mission protocol's is ignored."""
        message = frame.message
        if not isinstance(message, MissionMessage):
            return
        server = self._servers.get(message.mission_type)
        if server is None:
            self._outbox.append(
                MissionAck(frame.system, frame.component, MissionResult.UNSUPPORTED, message.mission_type)
            )
            return
        server.receive(frame, message, now_s)
        self._outbox += server.messages_to_send()

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        for server in self._servers.values():
            server.handle_timer(now_s)
            self._outbox += server.messages_to_send()

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent, and forget it."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def reboot(self) -> None:
        """Forget what is not stored: uploads under way and unsent answers."""
        for server in self._servers.values():
            server.reboot()
        self._outbox = []


def int_message(
    client: tuple[int, int], seq: int, item: items.MissionItem, mission_type: int
) -> MissionItemInt:
    """Return the message that carries an item."""
    return MissionItemInt(
        *client,
        seq,
        item.frame,
        item.command,
        int(item.current),
        int(item.autocontinue),
        *item.params,
        item.lat_e7,
        item.lon_e7,
        item.alt_m,
        mission_type,
    )


def float_message(
    client: tuple[int, int], seq: int, item: items.MissionItem, mission_type: int
) -> MissionItem:
    """Return the message of the old form that carries an item."""
    return MissionItem(
        *client,
        seq,
        item.frame,
        item.command,
        int(item.current),
        int(item.autocontinue),
        *item.params,
        float32(item.lat_e7 * 1e-7),
        float32(item.lon_e7 * 1e-7),
        item.alt_m,
        mission_type,
    )


def item_of_ints(message: MissionItemInt) -> items.MissionItem:
    """Return the item that a message carries; whether it is the current one is left out."""
    params = (message.param1, message.param2, message.param3, message.param4)
    return items.MissionItem(message.command, message.frame, params, message.x, message.y, message.z)


def item_of_floats(message: MissionItem) -> items.MissionItem:
    """Return the item that a message of the old form carries, its degrees in degE7."""
    params = (message.param1, message.param2, message.param3, message.param4)
    x_e7, y_e7 = (_e7(value) for value in (message.x, message.y))
    return items.MissionItem(message.command, message.frame, params, x_e7, y_e7, message.z)


def _e7(degrees: float) -> int:
    # What is no place must stay none: 999 degrees is out of every range.
    return int(float32(degrees) * 1e7) if abs(degrees) <= 999.0 else 9_990_000_000
