"""A serial port, played by a pseudo-terminal."""

from __future__ import annotations

import os
import time

import pytest

from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import open_link, open_transport
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Frame, Heartbeat, Statustext

tty = pytest.importorskip("tty")


@pytest.fixture
def port():
    """The radio's end, and the name of ours."""
    radio, ours = os.openpty()
    tty.setraw(radio)
    tty.setraw(ours)
    yield radio, os.ttyname(ours)
    os.close(ours)
    os.close(radio)


def read(radio: int, at_least: int) -> bytes:
    data = b""
    while len(data) < at_least:
        data += os.read(radio, 4096)
    return data


def test_frames_go_both_ways(port):
    radio, name = port
    far = Codec(1, 1)
    with open_link(f"{name},921600", (245, 190)) as link:
        link.send(Statustext(6, "hello"))
        (frame,) = far.decode(read(radio, 18))
        assert (frame.system, frame.component, frame.message) == (245, 190, Statustext(6, "hello"))
        packets = [far.encode(Statustext(6, f"number {number}")) for number in range(40)]
        os.write(radio, b"".join(packets)[:-5])
        heard = []
        while len(heard) < 39:
            heard += [frame.message for frame in link.receive(5.0) if isinstance(frame.message, Statustext)]
        os.write(radio, packets[-1][-5:])
        while len(heard) < 40:
            heard += [frame.message for frame in link.receive(5.0) if isinstance(frame.message, Statustext)]
    assert [message.text for message in heard] == [f"number {number}" for number in range(40)]


def test_what_a_radio_echoes_is_nobody_else(port):
    radio, name = port
    with open_link(name, (245, 190)) as link:
        link.send(Heartbeat(18, 8))
        os.write(radio, read(radio, 17) + Codec(1, 1).encode(Heartbeat(10, 3)))
        heard = []
        while not heard:
            heard = link.receive(5.0)
        assert heard == [Frame(1, 1, Heartbeat(10, 3))]
        assert link.echoes == 1


@pytest.mark.parametrize("timeout_s", [0.0, 0.1])
def test_silence_is_waited_for_as_long_as_is_asked(port, timeout_s):
    _, name = port
    transport = open_transport(name)
    begun_s = time.monotonic()
    assert transport.receive(timeout_s) == []
    assert time.monotonic() - begun_s >= timeout_s
    transport.close()


def test_the_port_is_set_up_once(port, monkeypatch):
    """Drivers of Windows set the whole port up anew with every time-out that is changed."""
    _, name = port
    transport = open_transport(name)
    monkeypatch.setattr(transport._port, "_reconfigure_port", lambda: pytest.fail("set up again"))
    assert transport.receive(0.02) == transport.receive(0.0) == []
    monkeypatch.undo()
    transport.close()


def test_a_radio_that_is_pulled_out_is_a_broken_link():
    radio, ours = os.openpty()
    tty.setraw(ours)
    transport = open_transport(os.ttyname(ours))
    os.close(ours)
    os.close(radio)
    with pytest.raises(LinkError, match="the serial port failed"):
        transport.receive(1.0)
    with pytest.raises(LinkError, match="the serial port failed"):
        transport.send(b"x")
    transport.close()
