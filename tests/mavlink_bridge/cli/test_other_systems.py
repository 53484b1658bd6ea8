"""What differs on Windows and macOS, as far as Linux can try it."""

from __future__ import annotations

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli import bridge as bridge_command
from mavlink_bridge.cli import failing
from mavlink_bridge.cli import keyboard as keyboard_module
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.options.bridge import BridgeOptions
from mavlink_bridge.cli.options_file import user_file
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import parse_connection

ENDS = ("--start", "40.071374,-105.229930", "--target", "40.0720926,-105.2286152")


def wait_for(keyboard: Keyboard, within_s: float = 60.0) -> str:
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if (line := keyboard.line()) is not None:
            return line
        time.sleep(0.01)
    raise AssertionError("nothing was typed")


def test_what_is_typed_comes_through_a_thread_where_consoles_cannot_be_waited_for(monkeypatch):
    ours, theirs = os.pipe()
    thread = keyboard_module.keyboard_thread(ours)
    monkeypatch.setattr(keyboard_module, "keyboard_thread", lambda _descriptor: thread)
    monkeypatch.setattr(keyboard_module.os, "name", "nt")
    keyboard = Keyboard()
    assert keyboard.line() is None
    os.write(theirs, b"40.07,-105.2\r\nye")
    assert wait_for(keyboard) == "40.07,-105.2"
    assert keyboard.line() is None
    os.write(theirs, b"s\r\n\r\n")
    assert wait_for(keyboard) == "yes"
    assert wait_for(keyboard) == ""
    os.close(theirs)
    until_s = time.monotonic() + 60
    while not keyboard.is_closed and time.monotonic() < until_s:
        assert keyboard.line() is None
    assert keyboard.is_closed


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
    with pytest.raises(LinkError, match=f"connection '{text}': expected udpin:"):
        parse_connection(text)


def test_a_signal_that_windows_has_not_is_not_asked_for(monkeypatch):
    """Windows has no SIGHUP and the like; those used are asked for by name first."""
    handled = []
    monkeypatch.delattr(signal, "SIGTERM")
    monkeypatch.delattr(signal, "SIGBREAK", raising=False)
    monkeypatch.setattr(signal, "signal", lambda number, _handler: handled.append(number))
    with pytest.raises(LinkError, match="connection 'nonsense': expected udpin:"):
        bridge_command.bridge(BridgeOptions(connect="nonsense"))
    assert handled == []


def test_the_users_folders_can_be_moved_on_every_system(tmp_path, monkeypatch):
    """Neither Windows nor older helpers on macOS heed these variables."""
    theirs = {"config": Path("/theirs/config"), "state": Path("/theirs/state")}
    for name, place in theirs.items():
        monkeypatch.setattr(f"platformdirs.user_{name}_path", lambda *_, place=place, **__: place)
        monkeypatch.setenv(f"XDG_{name.upper()}_HOME", str(tmp_path / name))
    assert user_file() == tmp_path / "config" / "pbpp-rover" / "pbpp.toml"
    assert BackupStore().folder == tmp_path / "state" / "pbpp-rover" / "backups"
    for nothing in ("", " ", "not/absolute"):
        for name in theirs:
            monkeypatch.setenv(f"XDG_{name.upper()}_HOME", nothing)
        assert user_file() == theirs["config"] / "pbpp.toml"
        assert BackupStore().folder == theirs["state"] / "backups"


class Stdout(io.StringIO):
    """A standard output whose reader is there or gone, as Windows tells of it."""

    def __init__(self, *, is_gone: bool) -> None:
        super().__init__()
        self._is_gone = is_gone

    def flush(self) -> None:
        if self._is_gone:
            raise OSError(errno.EINVAL, "Invalid argument")


@pytest.mark.parametrize(
    ("windows", "gone", "error", "is_gone"),
    [
        (True, True, OSError(errno.EINVAL, "Invalid argument"), True),
        (True, False, OSError(errno.EINVAL, "Invalid argument"), False),
        (True, True, OSError(errno.ENOSPC, "No space left"), False),
        (True, True, ValueError("no"), False),
        (False, True, OSError(errno.EINVAL, "Invalid argument"), False),
        (False, False, BrokenPipeError(errno.EPIPE, "Broken pipe"), True),
    ],
)
def test_a_reader_that_goes_away(monkeypatch, windows, gone, error, is_gone):
    monkeypatch.setattr(failing, "_IS_WINDOWS", windows)
    monkeypatch.setattr(sys, "stdout", Stdout(is_gone=gone))
    assert failing.is_reader_gone(error) is is_gone


@pytest.mark.parametrize("encoding", ["cp1252", "cp437"])
@pytest.mark.parametrize("command", ["plan", "check", "log", "help", "wrong"])
def test_consoles_that_know_few_signs(fields, logs, tmp_path, encoding, command):
    """What the console has no sign for is shown as another; nothing breaks."""
    yard, mission = str(fields / "yard-fence.waypoints"), str(fields / "yard-mission.waypoints")
    words, code = {
        "plan": (("plan", "--fence", yard, *ENDS, "--plot", "-"), 0),
        "check": (("check", "--mission", mission, "--fence", yard), 8),
        "log": (("log", str(logs / "mission-yard.tlog")), 0),
        "help": (("plan", "--help"), 0),
        "wrong": (("plan", "--fence", "Böschung—✓.plan", *ENDS), 3),
    }[command]
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    done = subprocess.run(
        [sys.executable, "-m", "mavlink_bridge.cli", *words],
        capture_output=True,
        env=environment,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == code, done.stderr
    assert b"Traceback" not in done.stderr
    assert len((done.stdout + done.stderr).decode(encoding).splitlines()) >= 2


def test_a_file_by_another_of_its_names_is_not_overwritten(fields, tmp_path):
    """As `-o YARD.WAYPOINTS` would be where capitals do not count; a link shows the same here."""
    fence, other = tmp_path / "yard.waypoints", tmp_path / "YARD-too.WAYPOINTS"
    fence.write_bytes((fields / "yard-fence.waypoints").read_bytes())
    os.link(fence, other)
    result = CliRunner().invoke(app, ["plan", "--fence", str(fence), *ENDS, "-o", str(other)])
    assert (result.exit_code, "would overwrite" in result.stderr) == (2, True)
    result = CliRunner().invoke(app, ["convert", str(fence), str(other)])
    assert (result.exit_code, "same file as IN" in result.stderr) == (2, True)
    assert other.read_bytes() == (fields / "yard-fence.waypoints").read_bytes()


@pytest.mark.parametrize("path", [r"C:\Users\me\rover.key", r"D:\keys\rover.key"])
def test_a_windows_path_in_the_options_says_how_to_write_it(tmp_path, path):
    options = tmp_path / "options.toml"
    options.write_text(f'[all]\nsigning-key = "{path}"\n', encoding="utf-8")
    result = CliRunner().invoke(app, ["config", "--config", str(options)])
    assert result.exit_code == 2
    assert "'single quotes'" in result.stderr
    options.write_text(f"[all]\nsigning-key = '{path}'\n", encoding="utf-8")
    told = CliRunner().invoke(app, ["config", "--config", str(options), "--json"])
    assert {one["value"] for one in json.loads(told.stdout)["settings"]} == {path}


def pbpp_in_shell(words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        f"{sys.executable} -m mavlink_bridge.cli {words}",
        shell=True,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is full by itself")
def test_where_results_cannot_be_told_that_is_the_error(tmp_path):
    (tmp_path / "a.waypoints").write_text(ONE)
    (tmp_path / "b.waypoints").write_text(ONE.replace("464", "465"))
    for words in ("", "--json"):
        full = pbpp_in_shell(f"diff a.waypoints b.waypoints {words} > /dev/full", tmp_path)
        assert (full.returncode, full.stderr.splitlines()) == (
            3,
            [
                "error: standard output cannot be written: No space left on device",
                "advice: free some space there",
            ],
        )
    silent = pbpp_in_shell("convert a.waypoints none/a.plan 2> /dev/full", tmp_path)
    assert silent.returncode == 3
    closed = pbpp_in_shell("diff a.waypoints b.waypoints >&- 2>&-", tmp_path)
    assert closed.returncode == 8


ONE = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t40.071374\t-105.229930\t0\t1\n"
    "1\t0\t3\t16\t0\t0\t0\t0\t40.071464\t-105.22996\t0\t1\n"
)


@pytest.mark.parametrize(
    ("words", "error", "advice"),
    [
        (("convert", "-", "a.plan"), "-: standard input is not read", "give a file, whose extension sets the format"),
        (("convert", "a.waypoints", "-"), "-: standard output is not written", "give a file, whose extension sets the format"),
        (("convert", "a.waypoints", "f.plan"), "f.plan cannot be written: Is a directory", "choose another name"),
        (
            ("convert", "a.waypoints", "none/a.plan"),
            "none/a.plan cannot be written: No such file or directory",
            "create the folder first, or choose another one",
        ),
    ],
)  # fmt: skip
@pytest.mark.skipif(os.name == "nt", reason="the system words it otherwise")
def test_what_cannot_be_read_or_written_gets_advice_that_fits(tmp_path, monkeypatch, words, error, advice):
    monkeypatch.chdir(tmp_path)
    Path("a.waypoints").write_text(ONE)
    Path("f.plan").mkdir()
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 3
    assert error in result.stderr
    assert f"advice: {advice}\n" in result.stderr
