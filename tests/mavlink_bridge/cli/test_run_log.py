"""A log or an output that cannot be written while the bridge drives: told once, and the drive goes on."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import processes
import pytest
from cli.test_bridge import FAR, config  # noqa: F401 - a fixture

from mavlink_bridge.cli.run_log import RunLog, SafeTeller
from mavlink_bridge.director import Event, EventName, Orders
from mavlink_bridge.errors import LogError
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Heartbeat
from mavlink_bridge.replay.journal import Call, JournalWriter
from mavlink_bridge.simulator import Simulator
from mavlink_bridge.tlog import TlogReader, TlogWriter
from missions.geo import LatLon, distance_m
from missions.situation import Situation

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
FRAME = Codec(1, 1).encode(Heartbeat(10, 3))
EVENT = Event.of(1.0, EventName.LINK_BACK, "heard again", ())


pytestmark = pytest.mark.usefixtures("state_folder")


class FullDisk:
    """A file on a disk that takes no more after so many writes; the last one may be taken in part."""

    name = "run.file"

    def __init__(self, file, writes: int, taken: int | None = None) -> None:
        self._file = file
        self._left = writes
        self._taken = taken
        self.is_closed = False

    def write(self, data):
        if self._left <= 0:
            if self._taken is None:
                raise FULL
            return self._file.write(data[: self._taken])
        self._left -= 1
        return self._file.write(data)

    def flush(self) -> None:
        self._file.flush()

    def close(self) -> None:
        self.is_closed = True
        self._file.close()
        raise FULL


@pytest.fixture
def writers(tmp_path):
    with TlogWriter(tmp_path / "run.tlog") as recorder, (tmp_path / "run.jsonl").open("w") as file:
        yield recorder, JournalWriter(file, Orders(), Situation())


@pytest.mark.parametrize("taken", [None, 0, 10])
def test_a_log_that_cannot_be_written_is_told_once_and_ends_with_its_journal(writers, tmp_path, taken):
    recorder, journal = writers
    told = []
    log = RunLog(recorder, journal, told.append)
    recorder._file = disk = FullDisk(recorder._file, 2, taken)
    for number in range(5):
        log.write(float(number), FRAME)
        log.call(Call(number, float(number), "timer"))
        log.event(EVENT)
    recorder._file = disk._file
    assert len(told) == 1
    assert told[0].startswith(f"{tmp_path / 'run.tlog'}: ")
    assert told[0].endswith("; recording stopped; the bridge continues")
    assert disk.is_closed
    assert len(list(TlogReader(tmp_path / "run.tlog"))) == 2
    lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert [line.get("call") for line in lines[1:]] == ["timer", None, "timer", None]


def test_a_journal_that_cannot_be_written_ends_the_log_too(writers, tmp_path):
    recorder, journal = writers
    told = []
    log = RunLog(recorder, journal, told.append)
    journal._file = disk = FullDisk(journal._file, 1)
    for number in range(4):
        log.write(float(number), FRAME)
        log.call(Call(number, float(number), "timer"))
    assert told == [f"run.file: {FULL.strerror}; recording stopped; the bridge continues"]
    assert disk.is_closed
    assert len(list(TlogReader(tmp_path / "run.tlog"))) == 2


def test_writers_say_which_file_cannot_be_written(writers):
    recorder, journal = writers
    kept, recorder._file = recorder._file, FullDisk(recorder._file, 0, 7)
    with pytest.raises(
        LogError, match=rf"only 7 of {len(FRAME) + 8} bytes could be written; is the disk full\?"
    ):
        recorder.write(1.0, FRAME)
    recorder._file = kept
    journal._file = FullDisk(journal._file, 0)
    with pytest.raises(LogError, match=r"^run\.file: "):
        journal.event(EVENT)


def test_an_output_that_cannot_be_written_is_told_once(monkeypatch, capsys):
    dropped = []
    monkeypatch.setattr("mavlink_bridge.cli.run_log.drop_stdout", lambda: dropped.append(1))
    heard = []

    def tell(event: Event) -> None:
        if dropped:
            heard.append(event)
        else:
            raise FULL

    teller = SafeTeller(tell, may_end=lambda: True)
    teller(EVENT)
    teller(EVENT)
    assert (len(dropped), len(heard)) == (1, 1)
    assert (
        f"events can no longer be written ({FULL.strerror}); the bridge continues" in capsys.readouterr().err
    )


def test_a_reader_who_is_gone_ends_a_bridge_only_where_nothing_is_under_way(monkeypatch):
    monkeypatch.setattr("mavlink_bridge.cli.run_log.drop_stdout", lambda: 141)

    def tell(_event: Event) -> None:
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    SafeTeller(tell, may_end=lambda: False)(EVENT)
    with pytest.raises(BrokenPipeError):
        SafeTeller(tell, may_end=lambda: True)(EVENT)


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full, and the shell's limit of file sizes")
def test_a_drive_goes_on_where_log_and_output_are_full(config, tmp_path):  # noqa: F811 - the fixture
    log = tmp_path / "run.tlog"
    arguments = ["--target", FAR, "--upload", "--drive", "--arm", "--once", "--log", str(log), "--json"]
    with (
        Simulator(config, "tcpin:127.0.0.1:0", speedup=10) as simulator,
        Path("/dev/full").open("wb") as full,
    ):
        bridge = [sys.executable, "-m", "mavlink_bridge.cli", "bridge", "--connect", simulator.connection]
        process = subprocess.Popen(
            ["sh", "-c", 'ulimit -f 20 && exec "$0" "$@"', *bridge, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            **processes.APART,
        )
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
        assert distance_m(simulator.vehicle.position, LatLon(40.0720926, -105.2286152)) < 4.0
    assert errors.count("recording stopped; the bridge continues") == 1
    assert errors.count("events can no longer be written (No space left on device)") == 1
    assert "Traceback" not in errors
    assert log.stat().st_size <= 20 * 1024
