"""Links on which somebody means harm: echoes, forged senders, garbage, floods."""

from __future__ import annotations

import errno
import random
import socket
import threading
import time
from contextlib import ExitStack, closing

import pytest

from mavlink_bridge import link as links
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import Link, open_link, open_transport
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.echoes import SentFrames
from mavlink_bridge.mavlink.messages import Frame, Heartbeat, MissionCount, Statustext
from mavlink_bridge.mavlink.signing import Signing, SigningKey
from mavlink_bridge.tlog import TlogReader, TlogWriter

VEHICLE = Heartbeat(10, 3)
NOW_S = 1_800_000_000.0


def signing(secret: bytes = bytes(32), now_s: float = NOW_S) -> Signing:
    return Signing(SigningKey(secret), lambda: now_s)


class Wire:
    """A transport in memory."""

    def __init__(self, *, is_stream: bool = True) -> None:
        self.is_stream = is_stream
        self.sent: list[bytes] = []
        self.waiting: list[tuple[object, bytes]] = []
        self.speakers: list[object] = []

    def send(self, data: bytes) -> None:
        self.sent.append(data)

    def receive(self, _timeout_s: float) -> list[tuple[object, bytes]]:
        waiting, self.waiting = self.waiting, []
        return waiting

    def heard(self, source: object) -> None:
        self.speakers.append(source)

    def close(self) -> None:
        """Nothing to close."""


# Echoes


@pytest.mark.parametrize("is_stream", [True, False])
@pytest.mark.parametrize("is_signed", [True, False])
def test_what_comes_back_as_we_sent_it_is_left_out_and_not_recorded(is_stream, is_signed, tmp_path):
    wire = Wire(is_stream=is_stream)
    with TlogWriter(tmp_path / "x.tlog") as recorder:
        link = Link(wire, (1, 195), recorder, signing() if is_signed else None)
        link.send_all([MissionCount(1, 1, number) for number in range(300)])
        wire.waiting = [("a", data) for data in wire.sent * 3]
        assert link.receive(0.0) == []
    assert link.echoes == 900
    assert wire.speakers == []
    assert [entry.link for entry in TlogReader(tmp_path / "x.tlog")] == [3] * 301  # and a heartbeat
    assert link.untrusted_frames == 0


@pytest.mark.parametrize("is_signed", [True, False])
def test_a_frame_with_our_ids_that_we_did_not_send_is_handed_out(is_signed):
    wire = Wire()
    link = Link(wire, (1, 195), signing=signing() if is_signed else None)
    other = Codec(1, 195, signing(now_s=NOW_S + 1) if is_signed else None)
    link.send(MissionCount(1, 1, 3))
    wire.waiting = [(None, other.encode(MissionCount(1, 1, 4)))]
    assert link.receive(0.0) == [Frame(1, 195, MissionCount(1, 1, 4))]
    assert link.echoes == 0


def test_without_the_key_nobody_has_our_ids():
    wire = Wire()
    link = Link(wire, (1, 195), signing=signing())
    for forger in (Codec(1, 195), Codec(1, 195, signing(b"x" * 32, NOW_S + 100))):
        wire.waiting.append((None, forger.encode(Heartbeat(6, 8))))
    assert link.receive(0.0) == []
    assert (link.untrusted_frames, link.echoes) == (2, 0)
    assert wire.speakers == []


def test_an_old_signed_frame_of_ours_is_no_news_however_late_it_comes_back():
    ours = Codec(1, 195, signing(), SentFrames(most=10))
    old = [ours.encode(MissionCount(1, 1, number)) for number in range(50)]
    assert ours.decode(b"".join(old)) == []
    assert (ours.untrusted_frames, ours.echoes) == (40, 10)


def test_a_reflected_frame_does_not_advance_our_signatures():
    ours, other = Codec(1, 195, signing()), Codec(1, 1, signing())
    ours.decode(ours.encode(VEHICLE))
    assert len(ours.decode(other.encode(VEHICLE))) == 1


def test_the_memory_of_what_was_sent_is_bounded_and_forgets_the_oldest():
    sent = SentFrames(most=3)
    for frame in (b"a", b"b", b"c", b"a", b"d"):
        sent.remember(frame)
    assert len(sent) == 3
    assert [frame in sent for frame in (b"a", b"b", b"c", b"d")] == [True, False, True, True]


def test_an_echo_from_before_the_link_broke_is_known():
    sent = SentFrames()
    before = Wire()
    Link(before, (1, 195), sent=sent).send(MissionCount(1, 1, 9))
    wire = Wire()
    link = Link(wire, (1, 195), sent=sent)
    wire.waiting = [(None, before.sent[-1])]
    assert link.receive(0.0) == []
    assert link.echoes == 1


# Who is answered


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def received(peer: socket.socket) -> list[bytes]:
    got = []
    peer.setblocking(False)
    while True:
        try:
            got.append(peer.recv(65536))
        except BlockingIOError:
            return got


def test_only_who_speaks_mavlink_is_answered():
    port = free_port()
    with ExitStack() as stack:
        link = stack.enter_context(open_link(f"udpin:127.0.0.1:{port}", (245, 190)))
        peers = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(40)]
        told = Codec(1, 1).encode(VEHICLE)
        noise = random.Random(1)
        says = [
            b"",
            b"\xfd",
            noise.randbytes(300),
            told[:-1],
            told[:-1] + b"x",
            Codec(245, 190).encode(VEHICLE),
        ]
        for number, peer in enumerate(peers[:-1]):
            peer.sendto(says[number % len(says)], ("127.0.0.1", port))
        peers[-1].sendto(told, ("127.0.0.1", port))
        until_s = time.monotonic() + 20
        while not any(frame.system == 1 for frame in link.receive(0.1)):
            assert time.monotonic() < until_s
        for peer in peers:
            received(peer)
        link.send(Statustext(6, "hello"))
        answered = [bool(received(peer)) for peer in peers]
    assert answered == [False] * 39 + [True]


def test_where_links_are_signed_only_who_has_the_key_is_answered():
    wire = Wire()
    link = Link(wire, (245, 190), signing=signing())
    wire.waiting = [
        ("unsigned", Codec(1, 1).encode(VEHICLE)),
        ("another key", Codec(1, 1, signing(b"x" * 32)).encode(VEHICLE)),
        ("vehicle", Codec(1, 1, signing()).encode(VEHICLE)),
    ]
    assert len(link.receive(0.0)) == 1
    assert wire.speakers == ["vehicle"]


def test_udpout_speaks_to_its_address_only():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as target,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        target.bind(("127.0.0.1", 0))
        with open_link(f"udpout:127.0.0.1:{target.getsockname()[1]}", (245, 190)) as link:
            link.send(Statustext(6, "one"))
            target.settimeout(10)
            _, ours = target.recvfrom(1000)
            stranger.sendto(Codec(9, 9).encode(VEHICLE), ("127.0.0.1", ours[1]))
            while not link.receive(0.5):
                pass
            link.send(Statustext(6, "two"))
            assert received(stranger) == []


# Garbage and floods


def test_garbage_of_one_sender_spoils_no_frame_of_another():
    codec, vehicle = Codec(245, 190), Codec(1, 1)
    for number in range(200):
        assert codec.decode_with_bytes(b"\xfd\xff\x00", ("forger", number % 3)) == []
        assert len(codec.decode_with_bytes(vehicle.encode(VEHICLE), "vehicle")) == 1


def test_garbage_of_the_same_sender_spoils_no_whole_datagram():
    codec, vehicle = Codec(245, 190), Codec(1, 1)
    for _ in range(20):
        assert codec.decode_with_bytes(b"\xfd", "vehicle") == []
        assert len(codec.decode_with_bytes(vehicle.encode(VEHICLE), "vehicle")) == 1
    assert codec.bad_bytes == 20


def test_a_frame_in_two_datagrams_of_one_sender_is_heard():
    codec, told = Codec(245, 190), Codec(1, 1).encode(VEHICLE)
    assert codec.decode_with_bytes(told[:7], "vehicle") == []
    assert codec.decode_with_bytes(b"\xfd\xff", "forger") == []
    assert [frame for _, frame in codec.decode_with_bytes(told[7:], "vehicle")] == [Frame(1, 1, VEHICLE)]


def test_receive_buffers_do_not_grow():
    codec, vehicle = Codec(245, 190), Codec(1, 1)
    for number in range(3000):
        codec.decode_with_bytes(b"\xfd", ("forger", number))
    assert len(codec._parsers) == 64
    told = vehicle.encode(VEHICLE)
    rest = b""
    for _ in range(3000):  # never a whole number of frames
        codec.decode(rest + told + told[:5])
        rest = told[5:]
    assert len(codec._parsers[None].buf) < 300


@pytest.mark.parametrize(("size", "count"), [(0, 256), (1, 256), (280, 235), (60_000, 2)])
def test_a_call_ends_under_a_flood(size, count):
    with closing(open_transport(f"udpin:127.0.0.1:{free_port()}")) as transport:

        class Flood:
            def recvfrom(self, _size: int) -> tuple[bytes, tuple[str, int]]:
                return b"x" * size, ("10.0.0.1", 1)

            def fileno(self) -> int:
                return ready.fileno()

            def close(self) -> None:
                """It never ends."""

        ready, filling = socket.socketpair()
        with ready, filling:
            filling.send(b"x")
            kept, transport._socket = transport._socket, Flood()
            assert len(transport.receive(0.0)) == count
            transport._socket = kept


def test_a_datagram_socket_that_fails_is_a_broken_link_but_what_came_before_is_handed_out():
    with closing(open_transport(f"udpin:127.0.0.1:{free_port()}")) as transport:
        ready, filling = socket.socketpair()

        class Failing:
            pieces = (b"x",)

            def recvfrom(self, _size: int) -> tuple[bytes, tuple[str, int]]:
                if self.pieces:
                    data, *self.pieces = self.pieces
                    return data, ("10.0.0.1", 1)
                raise OSError(errno.ENETDOWN, "Network is down")

            def fileno(self) -> int:
                return ready.fileno()

        with ready, filling:
            filling.send(b"x")
            kept, transport._socket = transport._socket, Failing()
            assert transport.receive(0.0) == [(("10.0.0.1", 1), b"x")]
            with pytest.raises(LinkError, match="the link failed: Network is down"):
                transport.receive(0.0)
            transport._socket = kept


def test_a_device_that_cannot_be_closed_is_closed_all_the_same():
    wire = Wire()

    def close() -> None:
        raise OSError(errno.EIO, "gone")

    wire.close = close
    with Link(wire, (1, 195)) as link:
        assert link.receive(0.0) == []


# TCP servers


@pytest.fixture
def opened():
    """A server, the one that connected to it, and how to connect to it."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    held: list[Link] = []
    server = threading.Thread(
        target=lambda: held.append(open_link(f"tcpin:127.0.0.1:{port}", (245, 190), timeout_s=60))
    )
    server.start()

    def connect() -> socket.socket:
        until_s = time.monotonic() + 60
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), 60)
            except ConnectionError:
                assert time.monotonic() < until_s

    with connect() as first:
        server.join(60)
        with held[0] as link:
            yield link, first, connect


def test_a_second_client_is_turned_away_as_long_as_the_first_speaks(opened):
    link, vehicle, connect = opened
    vehicle.sendall(Codec(1, 1).encode(VEHICLE))
    while not link.receive(1.0):
        pass
    with connect() as stranger:
        assert link.receive(1.0) == []
        assert stranger.recv(100) == b""
    vehicle.sendall(Codec(1, 1).encode(VEHICLE))
    while not link.receive(1.0):
        pass


def test_a_client_that_never_speaks_makes_room_for_one_that_does(opened, monkeypatch):
    link, scanner, connect = opened
    later_s = time.monotonic() + 11
    monkeypatch.setattr(links.time, "monotonic", lambda: later_s)
    with connect() as vehicle:
        vehicle.sendall(Codec(1, 1).encode(VEHICLE))
        while not (heard := link.receive(1.0)):
            pass
        assert heard == [Frame(1, 1, VEHICLE)]
        link.send(Statustext(6, "hello"))
        assert vehicle.recv(100) != b""
    assert scanner.recv(100)[:1] in (b"", b"\xfd")
