"""Client machines and the simulated vehicle's mission server on one bad link, in stepped time: no sockets, no clocks.

A client is any protocol machine with a `Peer`; a rival ground station is a second client with other ids, or with ours. All hear what the vehicle
says to any of them; on a shared link they hear each other too. The vehicle takes its input at
ticks of 20 ms, as the measured autopilot does.
"""

from __future__ import annotations

import heapq
import math
import random
from dataclasses import dataclass, field, replace
from itertools import count

from mavlink_bridge.mavlink.autopilots import ARDUPILOT, PX4_1_17, AutopilotTable
from mavlink_bridge.mavlink.messages import (
    Frame,
    Heartbeat,
    Message,
    MissionCount,
    MissionCurrent,
    MissionItem,
    MissionItemInt,
    MissionRequest,
    MissionRequestInt,
    MissionType,
    MissionWritePartialList,
    Statustext,
)
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.wire import item_to_message
from mavlink_bridge.simulator.item_lists import FenceList, MissionList, RallyList
from mavlink_bridge.simulator.mission_server import MissionServer
from mavlink_bridge.simulator.px4.lists import Px4List
from mavlink_bridge.simulator.px4.transfers import Px4Transfers
from missions.geo import LatLon
from missions.items import Command, CoordinateFrame
from missions.items import MissionItem as Item

HOME = LatLon(40.071374, -105.229930)
TICK_S = 0.02
HEARTBEAT_EVERY_S = 1.0
PEER = Peer(1, 1, 245, 190)
RIVAL = Peer(1, 1, 255, 190)
WRITES = (MissionCount, MissionItem, MissionItemInt, MissionWritePartialList)


BYTES = {Statustext: 66, MissionItemInt: 50, MissionItem: 50}
OTHER_BYTES = 18


@dataclass(frozen=True)
class Faults:
    """What a link does to single frames, each way; a narrow one queues them up to so many bytes and drops the rest."""

    loss: float = 0.0
    duplicates: float = 0.0
    least_delay_s: float = 0.0005
    most_delay_s: float = 0.0005
    keeps_order: bool = True
    bytes_per_s: float | None = None
    queue_bytes: float = math.inf


@dataclass
class Vehicle:
    """The vehicle's mission server, its clock ticks, when it is off, and which items it keeps otherwise than they were sent."""

    is_running: bool = False
    off: list[tuple[float, float]] = field(default_factory=list)
    keeps: dict[int, Item] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.lists = {
            MissionType.MISSION: MissionList(lambda: HOME, lambda: self.is_running),
            MissionType.FENCE: FenceList(),
            MissionType.RALLY: RallyList(),
        }
        self.server = MissionServer(self.lists.values())

    def hold(self, mission_type: MissionType, items: list[Item]) -> None:
        """Put a list into the vehicle, home item included."""
        stored = self.lists[mission_type]
        stored.begin(len(items))
        for seq, item in enumerate(items):
            assert stored.write(seq, item, len(items)) == 0
        assert stored.finish() == 0
        stored.texts.clear()

    def held(self, mission_type: MissionType) -> tuple[Item, ...]:
        """Return what it holds, as it reads back."""
        stored = self.lists[mission_type]
        return tuple(stored.read(seq) for seq in range(len(stored)))

    def spoil(self, mission_type: MissionType) -> None:
        """Keep some items otherwise than they were sent; what is not a number is another object at each read."""
        stored = self.lists[mission_type]
        read = stored.read

        def read_anew(seq: int) -> Item | None:
            item = self.keeps.get(seq, read(seq)) if seq < len(stored) else read(seq)
            return item and replace(item, params=tuple(float(repr(param)) for param in item.params))

        stored.read = read_anew

    def telemetry(self, now_s: float) -> list[Message]:
        """Return what it sends unasked each second."""
        mode = (129, 10) if self.is_running else (1, 4)
        return [Heartbeat(10, 3, base_mode=mode[0], custom_mode=mode[1])]

    def is_off(self, now_s: float) -> bool:
        return any(begin_s <= now_s < end_s for begin_s, end_s in self.off)


_IDS_LATE_S = 1.0


@dataclass
class Px4Vehicle(Vehicle):
    """PX4's mission server: no home item, lists replaced as a whole, ids of them a second late."""

    autopilot: AutopilotTable = PX4_1_17

    def __post_init__(self) -> None:
        is_new = self.autopilot is not PX4_1_17
        kinds = (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY)
        self.lists = {kind: Px4List(kind, checks_unused=is_new) for kind in kinds}
        self.server = Px4Transfers(self.lists, repeats_count=is_new)
        self._ids = [(-math.inf, (0, 0, 0))]

    def hold(self, mission_type: MissionType, items: list[Item]) -> None:
        """Put a list into the vehicle."""
        stored = self.lists[mission_type]
        stored.begin()
        for item in items:
            assert stored.take(item, current=0) == 0
        stored.finish()

    def telemetry(self, now_s: float) -> list[Message]:
        """Return a heartbeat and MISSION_CURRENT, whose ids are those of a second ago."""
        ids = tuple(self.lists[kind].id for kind in self.lists)
        if ids != self._ids[-1][1]:
            self._ids.append((now_s, ids))
        told = next(known for from_s, known in reversed(self._ids) if now_s >= from_s + _IDS_LATE_S)
        mode = (157, 0x04040000) if self.is_running else (29, 0x03040000)
        total = len(self.lists[MissionType.MISSION]) or 65535
        return [
            Heartbeat(10, 12, base_mode=mode[0], custom_mode=mode[1]),
            MissionCurrent(0, total, 2 if total < 65535 else 1, 0, *told),
        ]


def vehicle_of(autopilot: AutopilotTable, **arguments: object) -> Vehicle:
    """Return a vehicle with that autopilot."""
    return Vehicle(**arguments) if autopilot is ARDUPILOT else Px4Vehicle(autopilot=autopilot, **arguments)


@dataclass
class Client:
    """A machine on the link, and what it did."""

    machine: object
    peer: Peer
    begins_s: float = 0.0
    sent: list[tuple[float, Message]] = field(default_factory=list)
    heard: list[tuple[float, float, Frame]] = field(default_factory=list)  # when sent, when it came, and what
    ended_s: float | None = None
    mute_after: int | None = None
    breaks_after: int | None = None  # messages sent and heard until the link is gone
    is_broken: bool = False


class Twin:
    """One link with a vehicle on one end and clients on the other.

    Parameters
    ----------
    vehicle : Vehicle
    clients : list of Client
    faults : Faults
    seed : int
    store_backup : bool
        Whether a backup that a client hands out is stored at once.
    is_shared : bool
        Whether clients hear what others send.
    """

    def __init__(self, vehicle, clients, faults=None, seed=0, store_backup=True, is_shared=False):
        self.vehicle = vehicle
        self.clients = clients
        self.faults = faults or Faults()
        self.random = random.Random(seed)
        self.store_backup = store_backup
        self.is_shared = is_shared
        self.now_s = 0.0
        self.after_vehicle = None
        self.after_client = None
        self._sent_at_s = {}
        self._order = count()
        self._events = []
        self._inbox = []
        self._last_arrival_s = {}
        self._free_s = {}
        self._reboots = sorted(begin_s for begin_s, _ in vehicle.off)

    def run(self, limit_s=4000.0):
        """Run until every client has ended or the limit is reached; return the time that took."""
        self._schedule()
        while any(client.ended_s is None for client in self.clients):
            if not self._step(limit_s):
                break
        return self.now_s

    def run_until_ended(self, client, limit_s):
        """Run until one client has ended or the limit is reached."""
        self._schedule()
        while client.ended_s is None and not client.is_broken and self._step(limit_s):
            pass

    def begin(self, client, at_s):
        """Let a client that did not begin by itself begin then."""
        client.begins_s = at_s
        self._at(at_s, self._begin, client)

    def drain(self, for_s=30.0):
        """Let what is still under way arrive, and the vehicle's own timers run out."""
        limit_s = self.now_s + for_s
        while self._step(limit_s):
            pass
        self.now_s = limit_s

    def _schedule(self):
        for client in self.clients:
            if client.begins_s < math.inf:
                self._at(client.begins_s, self._begin, client)
        for reboot_s in self._reboots:
            self._at(reboot_s, self.vehicle.server.reboot)

        self._at(HEARTBEAT_EVERY_S / 2, self._beat)

    def _beat(self):
        self._at(self.now_s + HEARTBEAT_EVERY_S, self._beat)
        if not self.vehicle.is_off(self.now_s):
            for message in self.vehicle.telemetry(self.now_s):
                self._carry(("down",), self._to_clients, Frame(1, 1, message))

    def _step(self, limit_s):
        wake = min(
            (
                (deadline_s, client)
                for client in self.clients
                if client.ended_s is None
                and not client.is_broken
                and self.now_s >= client.begins_s
                and (deadline_s := client.machine.deadline_s) is not None
            ),
            key=lambda pair: pair[0],
            default=(math.inf, None),
        )
        server_s = self.vehicle.server.deadline_s
        server_s = math.inf if server_s is None else max(server_s, self.now_s)
        event_s = self._events[0][0] if self._events else math.inf
        next_s = min(event_s, wake[0], server_s)
        if next_s > limit_s:
            return False
        self.now_s = max(self.now_s, next_s)
        if event_s <= next_s:
            _, _, act, args = heapq.heappop(self._events)
            act(*args)
        elif server_s <= next_s:
            self.vehicle.server.handle_timer(self.now_s)
            self._from_vehicle()
        else:
            wake[1].machine.handle_timer(self.now_s)
            self._from_client(wake[1])
        return True

    def _at(self, time_s, act, *args):
        heapq.heappush(self._events, (time_s, next(self._order), act, args))

    def _begin(self, client):
        client.machine.start(self.now_s)
        self._from_client(client)

    def _from_client(self, client):
        machine = client.machine
        if self.store_backup and getattr(machine, "pending_backup", None) is not None:
            machine.backup_stored(self.now_s)
        for message in machine.messages_to_send():
            if client.mute_after is not None and len(client.sent) >= client.mute_after:
                continue
            if self._breaks(client):
                return
            client.sent.append((self.now_s, message))
            frame = Frame(client.peer.own_system, client.peer.own_component, message)
            self._carry(("up", client.peer), self._to_vehicle, frame)
            if self.is_shared:
                others = [other for other in self.clients if other is not client]
                self._carry(("across", client.peer), lambda frame, to=others: self._hear(frame, to), frame)
        if self.after_client:
            self.after_client(client)
        if machine.is_done and client.ended_s is None:
            client.ended_s = self.now_s

    def _to_vehicle(self, frame):
        if self.vehicle.is_off(self.now_s):
            return
        if not self._inbox:
            tick_s = math.ceil(self.now_s / TICK_S - 1e-9) * TICK_S
            self._at(max(tick_s, self.now_s), self._tick)
        self._inbox.append(frame)

    def _tick(self):
        frames, self._inbox = self._inbox, []
        if self.vehicle.is_off(self.now_s):
            return
        for frame in frames:
            self.vehicle.server.receive(frame, self.now_s)
        self._from_vehicle()

    def _from_vehicle(self):
        if self.after_vehicle:
            self.after_vehicle()
        for message in self.vehicle.server.messages_to_send():
            if not self.vehicle.is_off(self.now_s):
                self._carry(("down",), self._to_clients, Frame(1, 1, message))

    def _to_clients(self, frame):
        self._hear(frame, self.clients)

    def _hear(self, frame, clients):
        for client in clients:
            if client.ended_s is None and not client.is_broken and self.now_s >= client.begins_s:
                if self._breaks(client):
                    continue
                sent_s, _ = self._sent_at_s.get(id(frame), (self.now_s, frame))
                client.heard.append((sent_s, self.now_s, frame))
                client.machine.receive(frame, self.now_s)
                self._from_client(client)

    def _breaks(self, client):
        """Break the link at the message that is the last; return whether it is broken."""
        if client.breaks_after is not None and len(client.sent) + len(client.heard) >= client.breaks_after:
            client.is_broken = True
        return client.is_broken

    def _carry(self, direction, deliver, frame):
        faults = self.faults
        self._sent_at_s[id(frame)] = (self.now_s, frame)
        copies = 1 + (self.random.random() < faults.duplicates)
        for _ in range(copies):
            if self.random.random() < faults.loss:
                continue
            left_s = self._leaves_at_s(direction[0], frame)
            if left_s is None:
                continue
            arrival_s = left_s + self.random.uniform(faults.least_delay_s, faults.most_delay_s)
            if faults.keeps_order:
                arrival_s = max(arrival_s, self._last_arrival_s.get(direction, 0.0))
                self._last_arrival_s[direction] = arrival_s
            self._at(arrival_s, deliver, frame)

    def _leaves_at_s(self, way, frame):
        """Put a frame into the queue of a narrow link; return when it has left, None if there is no room."""
        faults = self.faults
        if faults.bytes_per_s is None:
            return self.now_s
        begins_s = max(self.now_s, self._free_s.get(way, 0.0))
        size = BYTES.get(type(frame.message), OTHER_BYTES)
        if (begins_s - self.now_s) * faults.bytes_per_s + size > faults.queue_bytes:
            return None
        self._free_s[way] = begins_s + size / faults.bytes_per_s
        return self._free_s[way]


class PartialWriter:
    """A rival that replaces one item of the vehicle's list, as Mission Planner does, once or again and again.

    Parameters
    ----------
    peer : Peer
        The vehicle and its identity.
    mission_type : MissionType
    seq : int
        Which item.
    items : list of Item
        What is written there, one after the other.
    every_s : float
        How long after the last write was begun.
    is_blind : bool
        Whether the item is sent at once, without waiting to be asked.
    """

    pending_backup = None
    progress = (0, 0)

    def __init__(self, peer, mission_type, seq, items, every_s=2.0, is_blind=False):
        self._peer, self._type, self._seq = peer, mission_type, seq
        self._items = iter(items)
        self._item = None
        self._every_s, self._is_blind = every_s, is_blind
        self._next_s = math.inf
        self._outgoing = []

    @property
    def deadline_s(self):
        return self._next_s

    @property
    def is_done(self):
        return False

    def start(self, now_s):
        self._next_s = now_s
        self.handle_timer(now_s)

    def receive(self, frame, now_s):
        message = frame.message
        is_asked = isinstance(message, MissionRequest | MissionRequestInt) and self._item is not None
        if is_asked and self._peer.accepts(frame, self._type) and message.seq == self._seq:
            self._send_item()

    def handle_timer(self, now_s):
        if now_s < self._next_s:
            return
        self._next_s = now_s + self._every_s
        self._item = next(self._items, None)
        if self._item is None:
            self._next_s = math.inf
            return
        peer = self._peer
        part = MissionWritePartialList(peer.system, peer.component, self._seq, self._seq, int(self._type))
        self._outgoing.append(part)
        if self._is_blind:
            self._send_item()

    def _send_item(self):
        self._outgoing.append(item_to_message(self._item, self._seq, self._peer, self._type))

    def messages_to_send(self):
        outgoing, self._outgoing = self._outgoing, []
        return outgoing


def plain_mission(length, salt=0):
    """Return a mission of so many items with home at 0, every item another place."""
    home = Item(Command.NAV_WAYPOINT, CoordinateFrame.GLOBAL, lat_e7=400713740, lon_e7=-1052299300)
    return [
        home,
        *(
            Item(
                Command.NAV_WAYPOINT,
                params=(float(seq % 5), 2.0, 0.0, 0.0),
                lat_e7=400713740 + 1000 * seq + 7 * salt,
                lon_e7=-1052299300 - 900 * seq - 11 * salt,
                alt_m=salt * 0.5,
            )
            for seq in range(1, length)
        ),
    ]


def plain_fence(polygons, salt=0, vertices=4):
    """Return a fence of so many exclusion polygons."""
    return [
        Item(
            Command.FENCE_POLYGON_VERTEX_EXCLUSION,
            CoordinateFrame.GLOBAL,
            (float(vertices), 0.0, 0.0, 0.0),
            400713740 + 20000 * polygon + (vertex % 3) * 5000 + salt,
            -1052299300 + (vertex // 2) * 5000 + salt,
        )
        for polygon in range(polygons)
        for vertex in range(vertices)
    ]
