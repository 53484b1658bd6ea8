"""A scripted ground station in front of a simulated vehicle, in stepped time."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame, Message, MissionResult, MissionType
from mavlink_bridge.simulator import SimulatorConfig
from mavlink_bridge.simulator.any_vehicle import vehicle_of
from mavlink_bridge.simulator.mission_server import int_message
from missions.geo import LatLon
from missions.items import Command, CoordinateFrame, MissionItem, waypoint

HOME = LatLon(40.071374, -105.229930)
GCS = (255, 190)
RIVAL = (254, 191)
TICK_S = 0.02


def at(north_m: float, east_m: float) -> LatLon:
    """Return a place so many of ArduPilot's metres from home."""
    lat_deg = HOME.lat_deg + north_m / 1.113195e5
    shrink = math.cos(math.radians((lat_deg + HOME.lat_deg) / 2))
    return LatLon(lat_deg, HOME.lon_deg + east_m / (1.113195e5 * shrink))


def line(count: int) -> tuple[MissionItem, ...]:
    """Return so many waypoints in a line to the north, 10 m apart, as they read back."""
    return tuple(kept(waypoint(at(10.0 * (index + 1), 0.0))) for index in range(count))


def kept(item: MissionItem) -> MissionItem:
    """Return a waypoint of ours as the vehicle reads it back."""
    return MissionItem(
        item.command, CoordinateFrame.GLOBAL_RELATIVE_ALT, item.params, item.lat_e7, item.lon_e7
    )


def vertex(position: LatLon, count: float, *, inclusion: bool = False) -> MissionItem:
    """Return a fence vertex."""
    command = Command.FENCE_POLYGON_VERTEX_INCLUSION if inclusion else Command.FENCE_POLYGON_VERTEX_EXCLUSION
    return placed(command, position, count)


def placed(command: int, position: LatLon, param1: float = 0.0) -> MissionItem:
    """Return an item in frame 0 at a place."""
    item = waypoint(position)
    return MissionItem(command, CoordinateFrame.GLOBAL, (param1, 0.0, 0.0, 0.0), item.lat_e7, item.lon_e7)


def square(
    north_m: float, east_m: float, half_m: float = 5.0, *, inclusion: bool = False
) -> list[MissionItem]:
    """Return a square of fence vertices round a point."""
    corners = ((-1, -1), (-1, 1), (1, 1), (1, -1))
    return [vertex(at(north_m + half_m * n, east_m + half_m * e), 4, inclusion=inclusion) for n, e in corners]


@dataclass
class Bench:
    """A vehicle, a clock, and all it has said with the time it said it."""

    config: SimulatorConfig = field(default_factory=lambda: SimulatorConfig(streams=False))
    now_s: float = 0.0
    heard: list[tuple[float, Message]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.vehicle = vehicle_of(self.config)
        self.run(0.1)
        self.heard.clear()

    def send(self, *messages: Message, sender: tuple[int, int] = GCS) -> None:
        """Send at once, without waiting for answers."""
        for message in messages:
            self.vehicle.receive(Frame(*sender, message), self.now_s)

    def run(self, time_s: float) -> None:
        """Let time pass."""
        end_s = self.now_s + time_s
        while self.vehicle.deadline_s <= end_s + 1e-6:
            assert self.vehicle.deadline_s >= self.now_s - 1e-6
            self.now_s = max(self.now_s, self.vehicle.deadline_s)
            self.vehicle.handle_timer(self.now_s)
            self.heard += [(self.now_s, message) for message in self.vehicle.messages_to_send()]
        self.now_s = max(end_s, self.now_s)
        if self.config.autopilot is m.Autopilot.PX4:  # answers at once, not in its next turn
            self.heard += [(self.now_s, message) for message in self.vehicle.messages_to_send()]

    def run_until(self, done, limit_s: float) -> float:
        """Let time pass until something is so; return how long it took."""
        begin_s = self.now_s
        while not done():
            assert self.now_s - begin_s < limit_s, f"not so after {limit_s} s"
            self.run(0.1)
        return self.now_s - begin_s

    def ask(self, *messages: Message, sender: tuple[int, int] = GCS) -> list[Message]:
        """Send and give what comes within one tick, heartbeats left out."""
        begin = len(self.heard)
        self.send(*messages, sender=sender)
        self.run(TICK_S)
        return [message for _, message in self.heard[begin:] if not isinstance(message, m.Heartbeat)]

    def texts(self) -> list[str]:
        """Return all STATUSTEXTs heard so far."""
        return [message.text for _, message in self.heard if isinstance(message, m.Statustext)]

    def of(self, kind: type[Message]) -> list[Message]:
        """Return all messages of a kind heard so far."""
        return [message for _, message in self.heard if isinstance(message, kind)]

    def count(
        self, count: int, mission_type: int = MissionType.MISSION, sender: tuple[int, int] = GCS
    ) -> list[Message]:
        """Announce an upload."""
        return self.ask(m.MissionCount(1, 1, count, mission_type), sender=sender)

    def item(
        self, seq: int, item: MissionItem, mission_type: int = MissionType.MISSION, *, current: int = 0
    ) -> m.MissionItemInt:
        """Return an item as the message a client sends."""
        message = int_message((1, 1), seq, item, mission_type)
        fields = {one.name: getattr(message, one.name) for one in dataclasses.fields(message)}
        return m.MissionItemInt(**{**fields, "current": current})

    def upload(self, items, mission_type: int = MissionType.MISSION) -> tuple[MissionResult, list[str]]:
        """Upload a list, one item at a time; return the result and what the vehicle said about it."""
        before = len(self.texts())
        answers = self.count(len(items), mission_type)
        for seq, item in enumerate(items):
            if any(isinstance(answer, m.MissionAck) for answer in answers):
                break
            assert [a.seq for a in answers if isinstance(a, m.MissionRequest | m.MissionRequestInt)] == [seq]
            answers = self.ask(self.item(seq, item, mission_type))
        acks = [answer for answer in answers if isinstance(answer, m.MissionAck)]
        assert len(acks) == 1
        assert acks[0].mission_type == mission_type
        assert (acks[0].target_system, acks[0].target_component) == GCS
        return MissionResult(acks[0].type), self.texts()[before:]

    def upload_mission(self, items) -> tuple[MissionResult, list[str]]:
        """Upload a mission with a home item before it."""
        return self.upload([placed(Command.NAV_WAYPOINT, HOME), *items])

    def download(self, mission_type: int = MissionType.MISSION) -> list[m.MissionItemInt]:
        """Download a list, one item at a time."""
        (count,) = self.ask(m.MissionRequestList(1, 1, mission_type))
        assert isinstance(count, m.MissionCount)
        items = []
        for seq in range(count.count):
            (item,) = self.ask(m.MissionRequestInt(1, 1, seq, mission_type))
            assert isinstance(item, m.MissionItemInt)
            assert item.seq == seq
            items.append(item)
        return items

    def command(self, command: int, *params: float, as_int: bool = False, **places) -> int:
        """Send a command; return its MAV_RESULT."""
        kind = m.CommandInt if as_int else m.CommandLong
        numbered = {f"param{index}": value for index, value in enumerate(params, start=1)}
        extra = {"frame": CoordinateFrame.GLOBAL, **places} if as_int else places
        answers = self.ask(kind(target_system=1, target_component=1, command=command, **extra, **numbered))
        (ack,) = [answer for answer in answers if isinstance(answer, m.CommandAck)]
        assert ack.command == command
        assert (ack.target_system, ack.target_component) == GCS
        return ack.result

    def start_auto(self) -> None:
        """Set AUTO and arm."""
        assert self.command(Command.DO_SET_MODE, 1, 10) == 0
        assert self.command(Command.COMPONENT_ARM_DISARM, 1) == 0
