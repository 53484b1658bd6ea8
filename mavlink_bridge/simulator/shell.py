"""The simulated rover on a real link: the only part of the simulator with sockets, a clock and a thread."""

from __future__ import annotations

import contextlib
import os
import secrets
import selectors
import socket
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Self

from mavlink_bridge.errors import LinkError
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.simulator.any_vehicle import AnyVehicle, vehicle_of
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.faults import Faults, FaultyLink
from mavlink_bridge.simulator.framing import FrameSplitter

if TYPE_CHECKING:
    from types import TracebackType

    from mavlink_bridge.mavlink.messages import Frame

DEFAULT_LISTEN = "tcpin:127.0.0.1:5760"
"""Where ArduPilot's own simulator listens."""

_READ_BYTES = 65_536  # the largest datagram
_UID_BYTES = 12
"""As long as the unique id of an STM32, which is what ArduPilot reports."""
_MAX_BACKLOG_BYTES = 4_000_000  # a client that reads nothing loses what comes after; chosen, bounds memory
_LONGEST_WAIT_S = 0.5  # chosen, not measured: the shell looks up at least so often
_MOST_AT_ONCE_S, _MOST_REAL_AT_ONCE_S = 1.0, 0.1  # of the rover's time in one turn, see `_advance`; chosen

SocketAddress = tuple[str, int]


class _Client:
    """Someone on the link: a codec and both directions of a link of its own."""

    def __init__(self, vehicle: AnyVehicle, faults: Faults, seed: int) -> None:
        self.codec = Codec(vehicle.config.system, vehicle.config.component)
        self.inbound: FaultyLink[bytes] = FaultyLink(faults, seed)
        self.outbound: FaultyLink[bytes] = FaultyLink(faults, seed + 1)
        self.splitter = FrameSplitter()
        self.backlog = b""


class Simulator:
    """A simulated rover that runs in a thread of its own.

    ::

        with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
            connect(simulator.connection)

    Parameters
    ----------
    config : SimulatorConfig, optional
        What the rover starts with.
    listen : str
        ``tcpin:HOST:PORT`` (several clients at once), ``udpin:HOST:PORT`` (answers everybody it has heard) or ``udpout:HOST:PORT``
        (speaks first). Port 0 means any free one.
    faults : Faults, optional
        How bad the link is, the same in both directions; times of latency and silence are real ones.
    speedup : float
        How many times faster than real the rover's time runs, where the computer keeps up.
    seed : int
        Seed of the faults.

    Raises
    ------
    LinkError
        The connection string is not understood, or the address cannot be used.
    """

    def __init__(
        self,
        config: SimulatorConfig | None = None,
        listen: str = DEFAULT_LISTEN,
        faults: Faults | None = None,
        speedup: float = 1.0,
        seed: int = 0,
    ) -> None:
        if not 0 < speedup < float("inf"):
            raise LinkError(f"speedup {speedup:g} is not a positive number")
        config = config or SimulatorConfig()
        if not config.uid:  # nothing that one run stores is there in the next: each is a vehicle of its own
            config = replace(config, uid=secrets.token_bytes(_UID_BYTES))
        self.vehicle = vehicle_of(config)
        self._faults = faults or Faults()
        self._seed = seed
        self._speedup = speedup
        self._kind, self._address = _parse(listen)
        self._clients: dict[object, _Client] = {}
        self._thread: threading.Thread | None = None
        self._stopping = False
        self._failure: BaseException | None = None
        self._start_s = 0.0
        self._turned_s = 0.0
        self._vehicle_s = 0.0

    @property
    def connection(self) -> str:
        """What a client opens to talk to the rover."""
        host, port = self._address
        host = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1"}.get(host, host)  # noqa: S104 - not bound here
        return f"{ {'tcpin': 'tcp', 'udpin': 'udpout', 'udpout': 'udpin'}[self._kind] }:{host}:{port}"

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Open the link and run the rover in the background.

        Raises
        ------
        LinkError
            The address cannot be used.
        """
        self._open()
        self._thread = threading.Thread(target=self._run, name="simulated rover", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the rover and close the link; raises what went wrong in the background, if anything did."""
        if self._thread is None:
            return
        self._stopping = True
        with contextlib.suppress(OSError):  # closed already if the rover failed
            self._waker.send(b"x")
        self._thread.join()
        self._thread = None
        if self._failure is not None:
            raise self._failure

    @property
    def is_running(self) -> bool:
        """Whether the rover runs; False after `stop` or after a failure, which `stop` raises."""
        return self._thread is not None and self._thread.is_alive()

    def _open(self) -> None:
        kind = socket.SOCK_STREAM if self._kind == "tcpin" else socket.SOCK_DGRAM
        self._socket = socket.socket(socket.AF_INET, kind)
        try:
            if self._kind == "udpout":
                self._peer(self._address)
            else:
                if self._kind == "tcpin" and os.name == "posix":  # Windows would share a port that is in use
                    self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                self._socket.bind(self._address)
                self._address = self._socket.getsockname()[:2]
            if self._kind == "tcpin":
                self._socket.listen()
        except OSError as error:
            self._socket.close()
            host, port = self._address
            raise LinkError(
                f"{self._kind}:{host}:{port} cannot be used: {error.strerror or error}", host=host, port=port
            ) from None
        self._socket.setblocking(False)
        self._waker, self._woken = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._stopping = False
        self._start_s = time.monotonic()
        self._turned_s = 0.0

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._turn()
        except Exception as error:  # noqa: BLE001 - raised again in the caller's thread by `stop`
            self._failure = error
        finally:
            self._close()

    def _turn(self) -> None:
        for key, events in self._selector.select(self._wait_s()):
            if key.fileobj is self._socket:
                self._listen()
            elif isinstance(key.fileobj, socket.socket) and key.fileobj is not self._woken:
                if events & selectors.EVENT_WRITE:
                    self._flush(key.fileobj)
                if events & selectors.EVENT_READ:
                    self._read_stream(key.fileobj)
        real_s = self._real_s()
        now_s = self._advance(real_s)
        for peer, client in list(self._clients.items()):
            for data in client.inbound.due(real_s):
                for frame_bytes, frame in client.codec.decode_with_bytes(data):
                    if frame is not None:
                        self.vehicle.receive(frame, now_s)
                        self._relay(frame, frame_bytes, peer, real_s)
        self.vehicle.handle_timer(now_s)
        messages = self.vehicle.messages_to_send()
        for peer, client in list(self._clients.items()):
            for message in messages:
                client.outbound.push(client.codec.encode(message), real_s)
            self._send(peer, client.outbound.due(real_s))

    def _wait_s(self) -> float:
        links = [link for client in self._clients.values() for link in (client.inbound, client.outbound)]
        deadlines_s = [link.deadline_s for link in links if link.deadline_s is not None]
        vehicle_due_s = self._turned_s + (self.vehicle.deadline_s - self._vehicle_s) / self._speedup
        next_s = min([vehicle_due_s, *deadlines_s])
        return max(0.0, min(next_s - self._real_s(), _LONGEST_WAIT_S))

    def _advance(self, real_s: float) -> float:
        """Advance the rover's time.

        Where the computer does not keep up, or stood still, the rover's time falls behind: made up for at once, more would pass with
        each turn than in the one before, and the rover would fall silent.
        """
        most_s = max(_MOST_AT_ONCE_S, _MOST_REAL_AT_ONCE_S * self._speedup)
        self._vehicle_s += min((real_s - self._turned_s) * self._speedup, most_s)
        self._turned_s = real_s
        return self._vehicle_s

    def _real_s(self) -> float:
        return time.monotonic() - self._start_s

    def _peer(self, key: object) -> _Client:
        client = self._clients.get(key)
        if client is None:
            client = _Client(self.vehicle, self._faults, self._seed + 2 * len(self._clients))
            self._clients[key] = client
        return client

    def _listen(self) -> None:
        if self._kind == "tcpin":
            connection, _ = self._socket.accept()
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._selector.register(connection, selectors.EVENT_READ)
            self._peer(connection)
            return
        with contextlib.suppress(BlockingIOError, ConnectionError):  # a peer that is gone shows here
            while True:
                data, address = self._socket.recvfrom(_READ_BYTES)
                self._take(self._peer(address), data)

    def _read_stream(self, connection: socket.socket) -> None:
        if connection not in self._clients:  # dropped a moment ago
            return
        try:
            data = connection.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._take(self._peer(connection), data)
        else:
            self._drop(connection)

    def _take(self, client: _Client, data: bytes) -> None:
        real_s = self._real_s()
        for frame in client.splitter.split(data):
            client.inbound.push(frame, real_s)

    def _relay(self, frame: Frame, frame_bytes: bytes, sender: object, real_s: float) -> None:
        """Pass on what is for everybody or for someone else, byte for byte, as ArduPilot does between its links."""
        if getattr(frame.message, "target_system", 0) == self.vehicle.config.system:
            return
        for key, client in self._clients.items():
            if key is not sender:
                client.outbound.push(frame_bytes, real_s)

    def _send(self, key: object, frames: list[bytes]) -> None:
        if isinstance(key, socket.socket):
            client = self._clients[key]
            if frames and len(client.backlog) < _MAX_BACKLOG_BYTES:
                client.backlog += b"".join(frames)
            self._flush(key)
            return
        assert isinstance(key, tuple)
        for data in frames:
            with contextlib.suppress(OSError):  # an unreachable peer of a datagram link is no failure
                self._socket.sendto(data, key)

    def _flush(self, connection: socket.socket) -> None:
        client = self._clients.get(connection)
        if client is None or not client.backlog:
            return
        try:
            sent = connection.send(client.backlog)
        except BlockingIOError:
            sent = 0
        except OSError:
            self._drop(connection)
            return
        client.backlog = client.backlog[sent:]
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.backlog else 0)
        self._selector.modify(connection, events)

    def _drop(self, connection: socket.socket) -> None:
        self._selector.unregister(connection)
        connection.close()
        del self._clients[connection]

    def _close(self) -> None:
        for key in self._clients:
            if isinstance(key, socket.socket):
                key.close()
        self._clients.clear()
        self._selector.close()
        for end in (self._socket, self._waker, self._woken):
            end.close()


def _parse(listen: str) -> tuple[str, SocketAddress]:
    kind, _, rest = listen.partition(":")
    host, _, port = rest.rpartition(":")
    kind = {"udp": "udpin"}.get(kind, kind)
    if kind not in ("tcpin", "udpin", "udpout") or not port.isdecimal() or int(port) > 65_535:
        raise LinkError(
            f"{listen!r} cannot be listened on: expected tcpin:HOST:PORT, udpin:HOST:PORT or udpout:HOST:PORT"
        )
    return kind, (host, int(port))
