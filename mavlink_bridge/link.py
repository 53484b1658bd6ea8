"""Live links: sockets and serial ports, the codec at their end, and the loop that runs a machine."""

from __future__ import annotations

import contextlib
import re
import select
import socket
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

from mavlink_bridge.errors import LinkError
from mavlink_bridge.mavlink.callers import FORGOTTEN_AFTER_S, Callers
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Autopilot, Heartbeat, MavType
from mavlink_bridge.protocol.open_transfer import OpenTransfer

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence
    from types import TracebackType

    from mavlink_bridge.mavlink.echoes import SentFrames
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.mavlink.signing import Signing
    from mavlink_bridge.protocol.machine import Machine

ONE_SHOT_IDENTITY = (245, 190)
"""System and component id of one-shot commands: nobody else's by custom."""

DEFAULT_BAUD = 57600  # of SiK telemetry radios, and ArduPilot's SERIAL1_BAUD
_HEARTBEAT_EVERY_S = 1.0  # as MAVLink's heartbeat protocol wants it
_DATAGRAM_BYTES = 65536  # the largest that UDP carries
_STREAM_BYTES = 16384
"""What is taken of a stream at once: a third of a second of the quickest serial port, and little enough to be soon done with."""

_MOST_DATAGRAMS, _MOST_DATAGRAM_BYTES = 256, 65536
"""What is taken of datagrams at once: about as many small ones as Linux keeps by default (208 KiB), or a few huge ones; the worst garbage takes
a third of a second to look through, so that no flood keeps timers from running."""

_LINK_SENT = 3  # the link number under which our own messages stand in a recorded log
_SERIAL_WAIT_S = 0.01  # for bytes, at a time; chosen, so that timers run on time
_SERIAL_SEND_S = 30.0
"""As patient as TCP by default: a radio that takes nothing for so long is broken, and the bridge opens it again."""


_EPOCH_S = time.time() - time.monotonic()


def now_s() -> float:
    """Return the time that machines on links run by: seconds since 1970, but only ever forward."""
    return _EPOCH_S + time.monotonic()


@dataclass(frozen=True, slots=True)
class Address:
    """A parsed connection string: ``kind`` is udpin, udpout, tcp, tcpin or serial."""

    kind: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host},{self.port}" if self.kind == "serial" else f"{self.kind}:{self.host}:{self.port}"


def parse_connection(text: str) -> Address:
    """Read a connection string in pymavlink's forms.

    ``udpin:HOST:PORT``, ``udpout:HOST:PORT``, ``tcp:HOST:PORT``, ``tcpin:HOST:PORT``, ``udp:…`` and a bare ``HOST:PORT`` (as udpin), and serial
    devices with MAVProxy's ``,BAUD``.

    Raises
    ------
    LinkError
        The string has none of these forms.
    """
    kind, _, rest = text.partition(":")
    if kind in ("udpin", "udpout", "udp", "tcp", "tcpin"):
        place = _HOST_PORT.fullmatch(rest)
        if place is None or int(place[2]) > 65535:
            raise LinkError(f"connection {text!r}: expected {kind}:HOST:PORT")
        return Address("udpin" if kind == "udp" else kind, place[1].strip("[]"), int(place[2]))
    device = _DEVICE.fullmatch(text)
    if device is not None:
        return Address("serial", device[1], int(device[2] or DEFAULT_BAUD))
    if text.startswith("/dev/"):
        raise LinkError(f"connection {text!r}: expected DEVICE,BAUD")
    place = _HOST_PORT.fullmatch(text)
    if place is not None and int(place[2]) <= 65535:
        return Address("udpin", place[1].strip("[]"), int(place[2]))
    raise LinkError(
        f"connection {text!r}: expected udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT or a serial device"
    )


_HOST_PORT = re.compile(r"(.+):([0-9]{1,5})")
_DEVICE = re.compile(r"(/dev/[^,]+|COM[0-9]+)(?:,([1-9][0-9]{0,7}))?", re.IGNORECASE)


class Transport(Protocol):
    """Bytes out and in."""

    is_stream: bool
    """Whether several frames may be sent as one piece (datagrams hold one each)."""

    def send(self, data: bytes) -> None:
        """Send, or do nothing while nobody is there to send to."""
        ...

    def receive(self, timeout_s: float) -> Sequence[tuple[Hashable, bytes]]:
        """Wait for bytes, at most so long, and return them, each piece with where it came from; not all at once under a flood."""
        ...

    def heard(self, source: Hashable) -> None:
        """Note that MAVLink came from there, and is to be believed: whoever is answered on an open port is answered there."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class Recorder(Protocol):
    """Takes what goes over a link, as `TlogWriter` does."""

    def write(self, time_s: float, data: bytes, link: int = 0) -> None:
        """Take what was received or sent at a time."""
        ...


class Link:
    """One MAVLink link: frames in, messages out, our own heartbeat, and a record of both directions.

    Parameters
    ----------
    transport : Transport
        The open device.
    identity : tuple of int
        System and component id to speak as.
    recorder : Recorder, optional
        Everything that comes and goes is written there.
    signing : Signing, optional
        Sends signed frames and believes no others.
    clock : callable, optional
        Returns the time by which everything on the link runs, in seconds; `now_s` if not given. A simulated vehicle may bring its own.
    sent : SentFrames, optional
        What was sent on the link before this one, where that is opened again: its echoes are left out too.

    Attributes
    ----------
    transfer : OpenTransfer
        Which transfer of a list was begun on it and not ended.

    Raises
    ------
    LinkError
        From `receive` and `send`: the other end is gone.
    """

    def __init__(
        self,
        transport: Transport,
        identity: tuple[int, int] = ONE_SHOT_IDENTITY,
        recorder: Recorder | None = None,
        signing: Signing | None = None,
        clock: Callable[[], float] = now_s,
        sent: SentFrames | None = None,
    ) -> None:
        self.now_s = clock
        self._transport = transport
        self._codec = Codec(*identity, signing, sent)
        self._recorder = recorder
        self._heartbeat_due_s = 0.0
        self.transfer = OpenTransfer()

    @property
    def identity(self) -> tuple[int, int]:
        """The ids we speak as."""
        return self._codec.identity

    @property
    def untrusted_frames(self) -> int:
        """How many frames were left out because they were not signed with our key."""
        return self._codec.untrusted_frames

    @property
    def echoes(self) -> int:
        """How many frames were left out because they were ours, come back byte for byte."""
        return self._codec.echoes

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the device; one that is gone already is closed."""
        with contextlib.suppress(OSError):
            self._transport.close()

    def speak_as(self, identity: tuple[int, int]) -> None:
        """Speak with other ids from now on."""
        self._codec.identity = identity

    def send(self, message: Message) -> None:
        """Send one message."""
        self.transfer.note_sent(message)
        data = self._codec.encode(message)
        self._transport.send(data)
        if self._recorder:
            self._recorder.write(self.now_s(), data, _LINK_SENT)

    def send_all(self, messages: Sequence[Message]) -> None:
        """Send messages in order; on a stream as one piece, which is far quicker for long lists."""
        if not self._transport.is_stream:
            for message in messages:
                self.send(message)
            return
        for message in messages:
            self.transfer.note_sent(message)
        packets = [self._codec.encode(message) for message in messages]
        if packets:
            self._transport.send(b"".join(packets))
        if self._recorder:
            for packet in packets:
                self._recorder.write(self.now_s(), packet, _LINK_SENT)

    def receive(self, timeout_s: float) -> list[Frame]:
        """Return the frames that come within a time, as soon as there are any; our heartbeat goes out when it is due.

        Frames with our own ids that we did not send are handed out too: what they mean is decided where it is known what is under way.
        """
        return self.receive_at(timeout_s)[1]

    def receive_at(self, timeout_s: float) -> tuple[float, list[Frame]]:
        """As `receive`, with the time at which the frames came and under which they are recorded: up to then all was heard."""
        begun_s = self.now_s()
        if begun_s >= self._heartbeat_due_s:
            self._heartbeat_due_s = begun_s + _HEARTBEAT_EVERY_S
            self.send(Heartbeat(MavType.ONBOARD_CONTROLLER, Autopilot.INVALID))
        until_heartbeat_s = self._heartbeat_due_s - begun_s
        wait_s = max(0.0, min(timeout_s, until_heartbeat_s))
        received = self._transport.receive(wait_s)
        came_s = self.now_s()
        if (
            not received
        ):  # so far nothing came; if our own computer paused since, what came then is still unread
            return min(came_s, begun_s + wait_s), []
        decoded = [one for source, data in received for one in self._decode(source, data)]
        if self._recorder:
            for frame_bytes, _ in decoded:
                self._recorder.write(came_s, frame_bytes)
        frames = [frame for _, frame in decoded if frame is not None]
        for frame in frames:
            self.transfer.note_heard(frame.message, self.identity)
        return came_s, frames

    def _decode(self, source: Hashable, data: bytes) -> list[tuple[bytes, Frame | None]]:
        decoded = self._codec.decode_with_bytes(data, source)
        if any(frame is None or not self.is_ours(frame) for _, frame in decoded):
            self._transport.heard(source)
        return decoded

    def is_ours(self, frame: Frame) -> bool:
        """Return whether a frame has our own ids; a received one that has is somebody else's."""
        return (frame.system, frame.component) == self.identity

    def run(
        self,
        machine: Machine,
        *,
        timeout_s: float | None = None,
        on_frames: Callable[[list[Frame]], None] | None = None,
        on_step: Callable[[], None] | None = None,
        on_sent: Callable[[], None] | None = None,
        until: Callable[[], bool] = lambda: False,
        longest_wait_s: Callable[[], float] = lambda: 0.5,
    ) -> None:
        """Run a machine to its outcome.

        Parameters
        ----------
        machine : Machine
            Not yet started.
        timeout_s : float, optional
            The longest it may take.
        on_frames : callable, optional
            Sees every batch of frames before the machine does.
        on_step : callable, optional
            Called before each step's messages are sent, for progress bars and for what the machine hands out.
        on_sent : callable, optional
            Called after they are sent, for what takes time.
        until : callable, optional
            Ends the run early when it gives True; nothing more is sent then.
        longest_wait_s : callable, optional
            Returns the longest time between two steps.

        Raises
        ------
        LinkError
            The time is over, or the link is gone.
        """
        begun_s = self.now_s()
        machine.start(begun_s)
        while not until():
            if on_step:
                on_step()
            self.send_all(machine.messages_to_send())
            if on_sent:
                on_sent()
            if machine.is_done:
                return
            if timeout_s is not None and self.now_s() - begun_s > timeout_s:
                raise LinkError(f"no result within {timeout_s:g} s")
            deadline_s = machine.deadline_s
            wait_s = longest_wait_s()
            if deadline_s is not None:
                wait_s = min(wait_s, max(0.0, deadline_s - self.now_s()))
            came_s, frames = self.receive_at(wait_s)
            if frames and on_frames:
                on_frames(frames)
            for frame in frames:
                machine.receive(frame, came_s)
            machine.handle_timer(came_s)  # not a later time: what came while we were busy is still unread

    def listen(
        self,
        for_s: float,
        *,
        on_frames: Callable[[list[Frame]], None],
        until: Callable[[], bool] = lambda: False,
    ) -> None:
        """Listen for a while, or until it is enough."""
        self.run(_Listen(for_s), on_frames=on_frames, until=until)


class _Listen:
    """A machine that sends nothing and ends after a while."""

    progress = (0, 0)

    def __init__(self, for_s: float) -> None:
        self.bound_s = for_s
        self.deadline_s: float | None = None
        self.is_done = False

    def start(self, now_s: float) -> None:
        self.deadline_s = now_s + self.bound_s

    def receive(self, frame: Frame, now_s: float) -> None:
        pass

    def handle_timer(self, now_s: float) -> None:
        self.is_done = self.deadline_s is not None and now_s >= self.deadline_s

    def messages_to_send(self) -> list[Message]:
        return []


_NETWORK_ADVICE = "check the address and port; is the other side running (tcp)? Is another program using this port (udpin, tcpin)?"


def open_link(
    connection: str,
    identity: tuple[int, int] = ONE_SHOT_IDENTITY,
    *,
    recorder: Recorder | None = None,
    signing: Signing | None = None,
    timeout_s: float = 10.0,
    sent: SentFrames | None = None,
) -> Link:
    """Open a link by its connection string.

    Raises
    ------
    LinkError
        The string has no known form, or the device cannot be opened; the message says why.
    """
    return Link(open_transport(connection, timeout_s=timeout_s), identity, recorder, signing, sent=sent)


def open_transport(connection: str, *, timeout_s: float = 10.0) -> Transport:
    """Open the device of a connection string, for bytes as they are.

    Raises
    ------
    LinkError
        The string has no known form, or the device cannot be opened; the message says why.
    """
    address = parse_connection(connection)
    try:
        return _OPENERS[address.kind](address, timeout_s)
    except (OSError, UnicodeError) as error:  # a host's name may be invalid
        reason = getattr(error, "strerror", None) or error
        advice = {} if address.kind == "serial" else {"advice": _NETWORK_ADVICE}
        raise LinkError(f"{address} cannot be opened: {reason}", connection=str(address), **advice) from None


class _Udp:
    """UDP: ``udpout`` speaks to one address, and first; ``udpin`` answers whoever speaks MAVLink (`Callers`)."""

    is_stream = False

    def __init__(self, address: Address, _timeout_s: float) -> None:
        family, _, _, _, target = socket.getaddrinfo(address.host, address.port, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._target = None if address.kind == "udpin" else target
        self._callers: Callers[Any] = Callers()
        if self._target is None:
            try:
                self._socket.bind(target)
            except OSError:
                self._socket.close()
                raise
        self._socket.setblocking(False)

    def send(self, data: bytes) -> None:
        to = self._callers.answered(time.monotonic()) if self._target is None else (self._target,)
        for place in to:
            with contextlib.suppress(
                OSError
            ):  # a peer that is not there yet refuses; datagrams may be lost anyway
                self._socket.sendto(data, place)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return []
        received: list[tuple[Hashable, bytes]] = []
        try:
            left = _MOST_DATAGRAM_BYTES
            while left > 0 and len(received) < _MOST_DATAGRAMS:
                data, source = self._socket.recvfrom(_DATAGRAM_BYTES)
                received.append((source, data))
                left -= len(data)
        except (
            BlockingIOError,
            ConnectionError,
        ):  # all is read; Windows reports "reset" for a port that refused
            pass
        except OSError as error:
            if not received:
                raise LinkError(f"the link failed: {error.strerror or error}") from None
        return received

    def heard(self, source: Hashable) -> None:
        self._callers.heard(source, time.monotonic())

    def close(self) -> None:
        self._socket.close()


class _Tcp:
    """One TCP connection."""

    is_stream = True

    def __init__(self, connection: socket.socket, timeout_s: float) -> None:
        self._socket = connection
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(timeout_s)

    @classmethod
    def connect(cls, address: Address, timeout_s: float) -> Self:
        return cls(socket.create_connection((address.host, address.port), timeout_s), timeout_s)

    def fileno(self) -> int:
        return self._socket.fileno()

    def send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise LinkError(f"the link failed while sending: {error.strerror or error}") from None

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return []
        try:
            data = self._socket.recv(_STREAM_BYTES)
        except OSError as error:
            raise LinkError(f"the link failed: {error.strerror or error}") from None
        if not data:
            raise LinkError("the other end closed the link")
        return [(None, data)]

    def heard(self, source: Hashable) -> None:
        """Do nothing: there is one other end."""

    def close(self) -> None:
        self._socket.close()


class _TcpServer:
    """``tcpin``: waits for one to connect; others are turned away as long as that one speaks MAVLink now and then."""

    is_stream = True

    def __init__(self, address: Address, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._server = socket.create_server((address.host, address.port))
        try:
            self._server.settimeout(timeout_s)
            self._client = _Tcp(self._server.accept()[0], timeout_s)
        except OSError:
            self._server.close()
            raise
        self._server.setblocking(False)
        self._heard_s = time.monotonic()

    def send(self, data: bytes) -> None:
        self._client.send(data)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        ends = [self._server.fileno(), self._client.fileno()]
        ready = select.select(ends, [], [], timeout_s)[0]
        if self._server.fileno() in ready:
            self._meet()
        return self._client.receive(0.0) if ready else []

    def _meet(self) -> None:
        """Let somebody in who connects after the one before has been silent; turn him away otherwise."""
        with contextlib.suppress(OSError):  # he is gone again
            connection = self._server.accept()[0]
            if time.monotonic() - self._heard_s <= FORGOTTEN_AFTER_S:
                connection.close()
                return
            self._client.close()
            self._client = _Tcp(connection, self._timeout_s)
            self._heard_s = time.monotonic()

    def heard(self, source: Hashable) -> None:  # noqa: ARG002 - there is one at a time
        self._heard_s = time.monotonic()

    def close(self) -> None:
        self._client.close()
        self._server.close()


class _Serial:
    """A serial port, by pyserial."""

    is_stream = True

    def __init__(self, address: Address, _timeout_s: float) -> None:
        import serial  # noqa: PLC0415 - only where there is a serial port

        # Set once: some drivers set up the whole port anew with every other time-out.
        self._port = serial.Serial(
            address.host, address.port, timeout=_SERIAL_WAIT_S, write_timeout=_SERIAL_SEND_S
        )

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError as error:
            raise LinkError(f"the serial port failed: {error}") from None

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        try:
            until_s = time.monotonic() + timeout_s
            while not (first := self._port.read(1)):
                if time.monotonic() >= until_s:
                    return []
            return [(None, bytes(first + self._port.read(min(self._port.in_waiting, _STREAM_BYTES))))]
        except OSError as error:
            raise LinkError(f"the serial port failed: {error}") from None

    def heard(self, source: Hashable) -> None:
        """Do nothing: there is one other end."""

    def close(self) -> None:
        self._port.close()


_OPENERS: dict[str, Callable[[Address, float], Transport]] = {
    "udpin": _Udp,
    "udpout": _Udp,
    "tcp": _Tcp.connect,
    "tcpin": _TcpServer,
    "serial": _Serial,
}
