"""Connection strings, and links over real sockets on loopback."""

from __future__ import annotations

import socket
import threading
import time
from typing import TYPE_CHECKING

import pytest

from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import DEFAULT_BAUD, Address, Link, open_link, parse_connection
from mavlink_bridge.mavlink.messages import Frame, Heartbeat, ParamRequestList, Statustext
from mavlink_bridge.tlog import TlogReader, TlogWriter

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("udpin:0.0.0.0:14550", ("udpin", "0.0.0.0", 14550)),
        ("udp:127.0.0.1:14550", ("udpin", "127.0.0.1", 14550)),
        ("udpout:rover.local:14550", ("udpout", "rover.local", 14550)),
        ("tcp:127.0.0.1:5760", ("tcp", "127.0.0.1", 5760)),
        ("tcpin:0.0.0.0:0", ("tcpin", "0.0.0.0", 0)),
        ("udpin:[::1]:14550", ("udpin", "::1", 14550)),
        ("127.0.0.1:14550", ("udpin", "127.0.0.1", 14550)),
        ("[::1]:14550", ("udpin", "::1", 14550)),
        ("computer:14550", ("udpin", "computer", 14550)),
        ("/dev/ttyACM0", ("serial", "/dev/ttyACM0", DEFAULT_BAUD)),
        ("/dev/serial/by-id/usb-X-if00,115200", ("serial", "/dev/serial/by-id/usb-X-if00", 115200)),
        ("COM3", ("serial", "COM3", DEFAULT_BAUD)),
        ("com12,921600", ("serial", "com12", 921600)),
    ],
)
def test_connection_strings(text: str, address: tuple[str, str, int]) -> None:
    assert parse_connection(text) == Address(*address)


@pytest.mark.parametrize(
    "text",
    ["", "udpin", "udpin:", "udpin:14550", "udpin::14550", "tcp:host:port", "tcp:host:70000", "tcp:host:-1", "tcp:host:²", "host:70000", "host:²", "host", ":5760", "/dev/ttyACM0,fast", "/dev/ttyACM0,²", "/dev/ttyACM0,0", "ftp:x:y", "COMX"],
)  # fmt: skip
def test_text_that_is_no_connection(text: str) -> None:
    with pytest.raises(LinkError, match=r"^connection '.*': expected"):
        parse_connection(text)


def test_addresses_read_as_they_are_written() -> None:
    for text in ("udpin:0.0.0.0:14550", "tcp:host:1", "/dev/ttyACM0,115200"):
        assert str(parse_connection(text)) == text


@pytest.mark.parametrize(
    "connection",
    ["/dev/nothing-there", "udpin:nowhere.invalid:14550", "tcp:127.0.0.1:1", "tcpin:127.0.0.1:0", "udpout:" + "x" * 70 + ".y:1", "udpin:192.0.2.1:14550"],
)  # fmt: skip
def test_what_cannot_be_opened_says_so(connection: str) -> None:
    with pytest.raises(LinkError, match="cannot be opened: ") as caught:
        open_link(connection, timeout_s=0.2)
    assert caught.value.details["connection"] == str(parse_connection(connection))


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def heard(link: Link, wanted: type, within_s: float = 60.0) -> Frame:
    """Receive until a message of a type comes."""
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        for frame in link.receive(0.1):
            if isinstance(frame.message, wanted):
                return frame
    pytest.fail(f"no {wanted.__name__} within {within_s} s")


def test_udp_both_ways(tmp_path: Path) -> None:
    port = free_port(socket.SOCK_DGRAM)
    with (
        TlogWriter(tmp_path / "x.tlog") as recorder,
        open_link(f"udpin:127.0.0.1:{port}", (1, 1)) as rover,
        open_link(f"udpout:127.0.0.1:{port}", (245, 190), recorder=recorder) as station,
    ):
        rover.send(Statustext(6, "nobody hears this"))
        station.send(ParamRequestList(1, 1))
        assert heard(rover, ParamRequestList) == Frame(245, 190, ParamRequestList(1, 1))
        rover.send(Statustext(4, "hello"))
        assert heard(station, Statustext) == Frame(1, 1, Statustext(4, "hello"))
    entries = list(TlogReader(tmp_path / "x.tlog"))
    assert {(entry.frame.system, entry.link == 3) for entry in entries} == {(245, True), (1, False)}
    found = [(entry.frame.system, entry.frame.message) for entry in entries]
    assert (1, Statustext(4, "hello")) in found
    assert (245, Heartbeat(18, 8)) in found  # our own, unasked


def test_a_peer_that_is_not_there_yet_is_no_error() -> None:
    with open_link(f"udpout:127.0.0.1:{free_port(socket.SOCK_DGRAM)}") as link:
        for _ in range(3):
            link.send(Statustext(6, "x"))
            assert link.receive(0.02) == []


def test_tcp_both_ways_and_its_end() -> None:
    port = free_port(socket.SOCK_STREAM)
    opened: list[Link] = []
    server = threading.Thread(
        target=lambda: opened.append(open_link(f"tcpin:127.0.0.1:{port}", (1, 1), timeout_s=60))
    )
    server.start()
    until_s = time.monotonic() + 60
    while True:
        try:
            station = open_link(f"tcp:127.0.0.1:{port}", (245, 190), timeout_s=60)
            break
        except LinkError:
            assert time.monotonic() < until_s
    server.join(60)
    with station, opened[0] as rover:
        station.send(ParamRequestList(1, 1))
        assert heard(rover, ParamRequestList).system == 245
        rover.send(Statustext(4, "hello"))
        assert heard(station, Statustext).message == Statustext(4, "hello")
        rover.close()
        with pytest.raises(LinkError, match=r"the other end closed the link|the link failed"):
            talk_on(station)


def talk_on(link: Link) -> None:
    for _ in range(50):
        link.send(Statustext(6, "still there?"))
        link.receive(0.05)


def test_somebody_with_our_own_ids_is_heard_as_anybody() -> None:
    port = free_port(socket.SOCK_DGRAM)
    with (
        open_link(f"udpin:127.0.0.1:{port}", (245, 190)) as one,
        open_link(f"udpout:127.0.0.1:{port}", (245, 190)) as other,
    ):
        other.send(Statustext(6, "it is I"))
        frame = heard(one, Statustext)
        assert frame == Frame(245, 190, Statustext(6, "it is I"))
        assert one.is_ours(frame)
        assert not one.is_ours(Frame(245, 191, Statustext(6, "")))


class OneAnswer:
    """A machine that asks once and is done with the first answer."""

    def __init__(self) -> None:
        self.is_done = False
        self.deadline_s: float | None = None
        self._outbox: list = []

    def start(self, now_s: float) -> None:
        self._outbox.append(ParamRequestList(1, 1))
        self.deadline_s = now_s + 0.05

    def receive(self, frame: Frame, _now_s: float) -> None:
        self.is_done = isinstance(frame.message, Statustext)

    def handle_timer(self, now_s: float) -> None:
        if self.deadline_s is not None and now_s >= self.deadline_s and not self.is_done:
            self._outbox.append(ParamRequestList(1, 1))
            self.deadline_s = now_s + 0.05

    def messages_to_send(self) -> list:
        outbox, self._outbox = self._outbox, []
        return outbox


def test_a_machine_runs_to_its_end() -> None:
    port = free_port(socket.SOCK_DGRAM)
    with (
        open_link(f"udpin:127.0.0.1:{port}", (1, 1)) as rover,
        open_link(f"udpout:127.0.0.1:{port}") as station,
    ):
        asked: list[Frame] = []

        def answer() -> None:
            asked.append(heard(rover, ParamRequestList))
            rover.send(Statustext(6, "done"))

        thread = threading.Thread(target=answer)
        thread.start()
        seen: list[Frame] = []
        steps: list[int] = []
        station.run(OneAnswer(), timeout_s=60, on_frames=seen.extend, on_step=lambda: steps.append(1))
        thread.join(60)
        assert [frame.system for frame in asked] == [245]
        assert Statustext(6, "done") in [frame.message for frame in seen]
        assert steps


def test_a_machine_that_comes_to_no_end() -> None:
    with open_link(f"udpout:127.0.0.1:{free_port(socket.SOCK_DGRAM)}") as link:
        with pytest.raises(LinkError, match=r"no result within 0\.2 s"):
            link.run(OneAnswer(), timeout_s=0.2)
        link.run(OneAnswer(), until=lambda: True)
