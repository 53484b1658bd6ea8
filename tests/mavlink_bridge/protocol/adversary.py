"""A vehicle that lies, breaks off or falls silent when told to, without sockets or clocks; and two links to it, stepped and TCP.

`Adversary` is honest; each kind of harm is a subclass that changes one answer. `SteppedLink` is a transport for `Link` on whose clock waiting takes
no time; `TcpVehicle` is the same vehicle on a real socket, for programs that run as processes of their own.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
import time

from mavlink_bridge.errors import LinkError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import ARDUPILOT
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Frame, MissionResult, MissionType
from mavlink_bridge.protocol.wire import item_from_message, item_to_message
from missions.geo import LatLon, to_e7
from missions.items import Command, waypoint, with_home

HOME = LatLon(40.071374, -105.22993)
OURS = (245, 190)
PARAMETERS = {
    "ARMING_CHECK": 1.0,
    "WP_SPEED": 2.0,
    "WP_RADIUS": 2.0,
    "FENCE_ENABLE": 0.0,
    "FENCE_TYPE": 6.0,
    "FENCE_MARGIN": 2.0,
    "TURN_RADIUS": 0.9,
    "FENCE_RADIUS": 300.0,
    "BRD_SD_MISSION": 0.0,
}
_REAL32 = 9
_CUSTOM_MODE, _ARMED = 1, 128
_HEARTBEAT_EVERY_S, _POSITION_EVERY_S = 1.0, 0.25
HOLD, AUTO = 4, 10


def mission(count, step_e7=500):
    """Return a mission of so many items, home at 0, whose places depend on the step."""
    lat_e7, lon_e7 = to_e7(HOME)
    places = [
        LatLon((lat_e7 + seq * step_e7) / 1e7, (lon_e7 + seq * step_e7) / 1e7) for seq in range(1, count)
    ]
    return with_home([waypoint(place) for place in places], HOME)


def places(items):
    """Return what of a mission must be equal: home is the vehicle's own."""
    return [(int(item.command), item.lat_e7, item.lon_e7) for item in items[1:]]


class Adversary:
    """An honest rover that writes each item as it comes; cut at MISSION_COUNT, as ArduPilot does."""

    system, component = 1, 1

    def __init__(self, held, uid=b""):
        self.lists = {MissionType.MISSION: list(held), MissionType.FENCE: [], MissionType.RALLY: []}
        self.parameters = dict(PARAMETERS)
        self.uid = uid
        self.mode, self.is_armed = HOLD, False
        self.is_gone = False  # it has closed the link
        self.counts = 0  # MISSION_COUNTs that it took
        self.stored = 0  # items that it took
        self.sets = 0  # PARAM_SETs that it took
        self.now_s = 0.0
        self._client = OURS
        self._upload = None  # list, how many, which is next
        self._outgoing = []
        self._heartbeat_s = self._position_s = 0.0

    # What a shell calls

    @property
    def deadline_s(self):
        return min(self._heartbeat_s, self._position_s)

    @property
    def held(self):
        return self.lists[MissionType.MISSION]

    def receive(self, frame, now_s):
        self.now_s = now_s
        message = frame.message
        if getattr(message, "target_system", self.system) not in (0, self.system):
            return
        handle = getattr(self, "on_" + m.wire_name(type(message)).lower(), None)
        if handle is not None:
            self._client = (frame.system, frame.component)
            handle(message)

    def handle_timer(self, now_s):
        self.now_s = now_s
        if now_s >= self._heartbeat_s:
            self._heartbeat_s = now_s + _HEARTBEAT_EVERY_S
            self.tell_heartbeat()
        if now_s >= self._position_s:
            self._position_s = now_s + _POSITION_EVERY_S
            self.tell_position()

    def frames_to_send(self):
        frames, self._outgoing = self._outgoing, []
        return frames

    # What it says

    def say(self, message, identity=None):
        self._outgoing.append(Frame(*(identity or (self.system, self.component)), message))

    def tell_heartbeat(self):
        base_mode = _CUSTOM_MODE | (_ARMED if self.is_armed else 0)
        self.say(m.Heartbeat(m.MavType.GROUND_ROVER, m.Autopilot.ARDUPILOTMEGA, base_mode, self.mode, 4))

    def tell_position(self):
        lat_e7, lon_e7 = to_e7(HOME)
        self.say(m.GlobalPositionInt(int(self.now_s * 1000) % 2**32, lat_e7, lon_e7, 0, 0, 0, 0, 0, 0))
        self.say(m.GpsRawInt(0, fix_type=3, lat=lat_e7, lon=lon_e7, alt=0, h_acc=500))
        self.say(m.HomePosition(lat_e7, lon_e7))

    def acknowledge(self, result, mission_type):
        self.say(m.MissionAck(*self._client, int(result), int(mission_type)))

    def request(self, seq, mission_type):
        self.say(m.MissionRequest(*self._client, seq, int(mission_type)))

    # Lists

    def on_mission_request_list(self, message):
        self.say(m.MissionCount(*self._client, len(self.lists[message.mission_type]), message.mission_type))

    def on_mission_request_int(self, message):
        items = self.lists[message.mission_type]
        if message.seq >= len(items):
            self.acknowledge(MissionResult.INVALID_SEQUENCE, message.mission_type)
        else:
            self.send_item(items[message.seq], message.seq, message.mission_type)

    def send_item(self, item, seq, mission_type):
        sent = item_to_message(item, seq, _Client(*self._client), MissionType(mission_type))
        self.say(sent)

    def on_mission_count(self, message):
        self.counts += 1
        kind = message.mission_type
        self.lists[kind] = self.lists[kind][: message.count]
        self._upload = [kind, message.count, 0] if message.count else None
        if message.count:
            self.request(0, kind)
        else:
            self.acknowledge(MissionResult.ACCEPTED, kind)

    def on_mission_item_int(self, message):
        if self._upload is None:
            self.acknowledge(MissionResult.ERROR, message.mission_type)
            return
        kind, count, wanted = self._upload
        if message.seq != wanted:
            self.acknowledge(MissionResult.INVALID_SEQUENCE, kind)
            return
        self._upload[2] += 1
        self.store(message, kind)
        if self.is_gone or self._upload is None:
            return
        if wanted + 1 == count:
            self._upload = None
            self.finish(kind)
        else:
            self.request(wanted + 1, kind)

    def store(self, message, kind):
        self.stored += 1
        items, item = self.lists[kind], item_from_message(message)
        if message.seq < len(items):
            items[message.seq] = item
        else:
            items.append(item)

    def finish(self, kind):
        self.acknowledge(MissionResult.ACCEPTED, kind)

    # Parameters and commands

    def tell_parameter(self, name):
        names = list(self.parameters)
        self.say(m.ParamValue(name, self.parameters[name], _REAL32, len(names), names.index(name)))

    def on_param_request_list(self, _message):
        for name in self.parameters:
            self.tell_parameter(name)

    def on_param_request_read(self, message):
        names = list(self.parameters)
        if message.param_id in self.parameters:
            self.tell_parameter(message.param_id)
        elif 0 <= message.param_index < len(names):
            self.tell_parameter(names[message.param_index])

    def on_param_set(self, message):
        self.sets += 1
        if message.param_id in self.parameters:
            self.parameters[message.param_id] = message.param_value
            self.tell_parameter(message.param_id)

    def on_command_long(self, message):
        if message.command == Command.DO_SET_MODE:
            self.mode = int(message.param2)
        asks_version = message.command == Command.REQUEST_AUTOPILOT_CAPABILITIES or (
            message.command == Command.REQUEST_MESSAGE and message.param1 == 148
        )
        self.say(m.CommandAck(message.command, m.MavResult.ACCEPTED))
        if asks_version and self.uid:
            self.say(m.AutopilotVersion(0, uid2=tuple(self.uid.ljust(18, b"\0"))))


class _Client:
    autopilot = ARDUPILOT

    def __init__(self, system, component):
        self.system, self.component = system, component


class RebootsMidway(Adversary):
    """Closes the link after three items."""

    breaks_at = 3

    def store(self, message, kind):
        super().store(message, kind)
        if self.stored == self.breaks_at:
            self._upload = None
            self.is_gone = True


class SilentMidway(Adversary):
    """Hears nothing after three items; its heartbeats go on."""

    def receive(self, frame, now_s):
        if self.stored < 3:
            super().receive(frame, now_s)


class GoneMidway(SilentMidway):
    """Is not heard at all after three items."""

    def tell_heartbeat(self):
        if self.stored < 3:
            super().tell_heartbeat()

    def tell_position(self):
        if self.stored < 3:
            super().tell_position()


class SpoofedMidway(Adversary):
    """Somebody with our ids is heard after three items."""

    def store(self, message, kind):
        super().store(message, kind)
        if self.stored == 3:
            self.say(m.Heartbeat(m.MavType.GCS, m.Autopilot.INVALID), OURS)


class DrivesMidway(Adversary):
    """Is armed and put into AUTO after three items."""

    def store(self, message, kind):
        super().store(message, kind)
        if self.stored == 3:
            self.is_armed, self.mode = True, AUTO
            self.tell_heartbeat()


class CancelsAtThree(Adversary):
    """Return up whenever item 3 has come."""

    def store(self, message, kind):
        super().store(message, kind)
        if message.seq == 3:
            self._upload = None
            self.acknowledge(MissionResult.OPERATION_CANCELLED, kind)


class DeniesWrites(Adversary):
    """Another station writes for ever."""

    def on_mission_count(self, message):
        self.acknowledge(MissionResult.DENIED, message.mission_type)


class DeniesReadsAfterwards(Adversary):
    """Takes the list, and lets nobody read it."""

    is_written = False

    def finish(self, kind):
        super().finish(kind)
        self.is_written = True

    def on_mission_request_list(self, message):
        if self.is_written:
            self.acknowledge(MissionResult.DENIED, message.mission_type)
        else:
            super().on_mission_request_list(message)


class BreaksAtMessage(Adversary):
    """Closes the link at the n-th message that it hears."""

    def __init__(self, count, **kind):
        super().__init__(**kind)
        self._left = count

    def receive(self, frame, now_s):
        self._left -= not isinstance(frame.message, m.Heartbeat)
        if self._left < 0:
            self.is_gone = True
        else:
            super().receive(frame, now_s)


class BreaksAtSet(Adversary):
    """Closes the link at the second parameter that is set."""

    def on_param_set(self, message):
        if self.sets == 1:
            self.is_gone = True
        super().on_param_set(message)


class SteppedLink:
    """A transport with a vehicle behind it, on a clock that waiting moves at once."""

    is_stream = True

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self._codec = Codec(vehicle.system, vehicle.component)
        self._codecs = {}
        self._now_s = max(
            time.time(), vehicle.now_s
        )  # its clock only goes forward, from one command to the next

    def now_s(self):
        return self._now_s

    def send(self, data):
        self._check()
        for frame in self._codec.decode(data):
            self.vehicle.receive(frame, self._now_s)

    def receive(self, timeout_s):
        self._check()
        until_s = self._now_s + timeout_s
        while True:
            if frames := self.vehicle.frames_to_send():
                return [("vehicle", b"".join(encoded(self._codecs, frame) for frame in frames))]
            if self._now_s >= until_s:
                return []
            self._now_s = min(until_s, max(self._now_s, self.vehicle.deadline_s))
            self.vehicle.handle_timer(self._now_s)

    def heard(self, source):
        pass

    def close(self):
        pass

    def _check(self):
        if self.vehicle.is_gone:
            raise LinkError("the other end closed the link")


def encoded(codecs, frame):
    """Return a frame's bytes, counted by its sender."""
    codec = codecs.setdefault((frame.system, frame.component), Codec(frame.system, frame.component))
    return codec.encode(frame.message)


class TcpVehicle:
    """A vehicle on a TCP port of the loopback, in a thread; several programs may connect."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self._server = socket.create_server(("127.0.0.1", 0))
        self.connection = f"tcp:127.0.0.1:{self._server.getsockname()[1]}"
        self._clients = {}
        self._codecs = {}
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ends.set()
        self._thread.join(5.0)

    def _run(self):
        with selectors.DefaultSelector() as selector, self._server:
            selector.register(self._server, selectors.EVENT_READ)
            while not self._ends.is_set():
                for key, _ in selector.select(0.02):
                    self._hear(selector, key.fileobj)
                self.vehicle.handle_timer(time.time())
                data = b"".join(encoded(self._codecs, frame) for frame in self.vehicle.frames_to_send())
                for client in list(self._clients):
                    if self.vehicle.is_gone:
                        self._drop(selector, client)
                    elif data:
                        with contextlib.suppress(OSError):
                            client.sendall(data)
                self.vehicle.is_gone = False
            for client in list(self._clients):
                self._drop(selector, client)

    def _hear(self, selector, end):
        if end is self._server:
            client, _ = end.accept()
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients[client] = Codec(0, 0)
            selector.register(client, selectors.EVENT_READ)
            return
        data = b""
        with contextlib.suppress(OSError):
            data = end.recv(65536)
        if not data:
            self._drop(selector, end)
            return
        for frame in self._clients[end].decode(data):
            self.vehicle.receive(frame, time.time())
            if self.vehicle.is_gone:
                return

    def _drop(self, selector, client):
        selector.unregister(client)
        del self._clients[client]
        client.close()
