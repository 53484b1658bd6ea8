"""What people read of a log's times: seconds since it begins, and when that was; JSON keeps the log's own."""

from __future__ import annotations

import json
import re

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.log_times import LogBegin, date_text, log_begin
from mavlink_bridge.errors import LogError
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Heartbeat
from mavlink_bridge.tlog import TlogWriter

BEGIN_S = 1_795_313_862.5


def run(*arguments: str):
    return CliRunner().invoke(app, ["replay", *arguments])


@pytest.fixture
def short(tmp_path):
    """A log of a vehicle that is there, found after a second and a bit."""
    path = tmp_path / "short.tlog"
    codec = Codec(1, 1)
    with TlogWriter(path) as writer:
        for second in range(4):
            writer.write(BEGIN_S + second, codec.encode(Heartbeat(10, 3)))
    return path


def test_lines_for_people_count_from_the_logs_begin(short):
    told = run(str(short)).stdout.splitlines()
    events = [json.loads(line) for line in run(str(short), "--json").stdout.splitlines()]
    assert told[0] == "short.tlog: from 2026-11-22 02:17:42 UTC"
    assert len(told) == len(events) + 1
    assert events[0]["event"] == "vehicle_found"
    for line, event in zip(told[1:], events, strict=True):
        seconds, name = re.fullmatch(r" *(\d+\.\d\d) s  (\w+): .*", line).groups()
        assert float(seconds) == pytest.approx(event["time_s"] - BEGIN_S, abs=0.006)
        assert name == event["event"]
        assert float(seconds) < 4.0


def test_each_of_several_logs_counts_from_its_own_begin(short, tmp_path):
    later = tmp_path / "later.tlog"
    with TlogWriter(later) as writer:
        for second in range(4):
            writer.write(BEGIN_S + 86_400 + second, Codec(1, 1).encode(Heartbeat(10, 3)))
    for jobs in ("1", "2"):
        told = run(str(short), str(later), "--jobs", jobs).stdout.splitlines()
        found = [line for line in told if "vehicle_found" in line]
        assert "later.tlog: from 2026-11-23 02:17:42 UTC" in told
        assert found[0].replace("short", "later") == found[1]


def test_quiet_tells_no_begin(short):
    assert run(str(short), "--quiet").stdout == ""


def test_when_a_log_begins(short, tmp_path):
    assert log_begin(short) == LogBegin(BEGIN_S, is_dated=True)
    raw = tmp_path / "short.raw"
    raw.write_bytes(b"".join(Codec(1, 1).encode(Heartbeat(10, 3)) for _ in range(3)))
    assert str(log_begin(raw)) == "raw (no timestamps)"
    empty = tmp_path / "empty.tlog"
    empty.touch()
    with pytest.raises(LogError, match=r"empty\.tlog: the file is empty"):
        log_begin(empty)


def test_a_clock_that_was_wrong_has_no_date():
    assert date_text(0.0) == "1970-01-01 00:00:00 UTC"
    assert date_text(1e13) == "1e+13 s after 1970 (the clock was not set)"
