"""What differs on Windows and macOS, as far as Linux can try it."""

from __future__ import annotations

import os
import signal
import time

import pytest

from mavlink_bridge.cli import bridge as bridge_command
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import parse_connection


def wait_for(lines, within_s: float = 5.0) -> str:
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if line := next(lines):
            return line
        time.sleep(0.01)
    raise AssertionError("nothing was typed")


def test_what_is_typed_comes_through_a_thread_where_consoles_cannot_be_waited_for(monkeypatch):
    ours, theirs = os.pipe()
    thread = bridge_command._keyboard_thread(ours)
    monkeypatch.setattr(bridge_command, "_keyboard_thread", lambda _descriptor: thread)
    monkeypatch.setattr(bridge_command.os, "name", "nt")
    lines = bridge_command._typed_lines()
    assert next(lines) == ""
    os.write(theirs, b"40.07,-105.2\r\nye")
    assert wait_for(lines) == "40.07,-105.2"
    assert next(lines) == ""
    os.write(theirs, b"s\r\n")
    assert wait_for(lines) == "yes"
    os.close(theirs)
    assert next(lines) == ""


@pytest.mark.parametrize(
    ("text", "device", "baud"),
    [
        ("COM7", "COM7", 57600),
        ("com12,115200", "com12", 115200),
        ("/dev/cu.usbmodem1,57600", "/dev/cu.usbmodem1", 57600),
        ("/dev/ttyACM0", "/dev/ttyACM0", 57600),
    ],
)
def test_serial_ports_by_their_names(text, device, baud):
    found = parse_connection(text)
    assert (found.kind, found.host, found.port) == ("serial", device, baud)


@pytest.mark.parametrize("text", ["COM", "COM7,fast", "COM7,0", "COMA"])
def test_names_that_are_no_port(text):
    with pytest.raises(LinkError):
        parse_connection(text)


def test_a_signal_that_windows_has_not_is_not_asked_for(monkeypatch):
    """Windows has no SIGHUP and the like; those used are asked for by name first."""
    handled = []
    monkeypatch.delattr(signal, "SIGTERM")
    monkeypatch.setattr(signal, "signal", lambda number, _handler: handled.append(number))
    with pytest.raises(LinkError):
        bridge_command.bridge(connect="nonsense")
    assert handled == []
