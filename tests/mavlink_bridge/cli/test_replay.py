"""``pbpp replay``: side by side, against expectations, paced, and played to a live client."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli import replay as replay_command
from mavlink_bridge.cli.app import app
from mavlink_bridge.logbook.playback import vehicle_frames
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import GlobalPositionInt, Heartbeat
from mavlink_bridge.replay.expectations import differences, read_expectation, to_expect
from mavlink_bridge.tlog import TlogReader, TlogWriter

NAMES = ["mission-yard", "no-fence", "island-unreachable"]


def run(*arguments: str):
    return CliRunner().invoke(app, ["replay", *arguments])


@pytest.fixture
def copies(logs, tmp_path):
    for name in NAMES:
        (tmp_path / f"{name}.tlog").write_bytes((logs / f"{name}.tlog").read_bytes())
    return [str(tmp_path / f"{name}.tlog") for name in NAMES]


def test_recorded_then_expected(copies, tmp_path):
    recorded = run(*copies, "--record", "--jobs", "1")
    assert recorded.exit_code == 0
    files = sorted(path.name for path in tmp_path.glob("*.events.jsonl"))
    assert files == sorted(f"{name}.events.jsonl" for name in NAMES)
    assert all(f"Wrote {tmp_path / name}" in recorded.stdout for name in files)
    same = run(*copies, "--expect", str(tmp_path), "--jobs", "1")
    count = sum(len(file.read_text().splitlines()) for file in tmp_path.glob("*.events.jsonl"))
    assert (same.exit_code, same.stdout.splitlines()[-1]) == (0, f"As expected: all {count} events came")
    quiet = run(*copies, "--expect", str(tmp_path), "-qq", "--jobs", "1")
    assert (quiet.exit_code, quiet.stdout) == (0, "")
    assert "As expected" not in run(*copies, "--expect", str(tmp_path), "--json", "--jobs", "1").stdout
    path = tmp_path / "no-fence.events.jsonl"
    path.write_text(path.read_text().replace("FenceMissingError", "FenceError"))
    different = run(*copies, "--expect", str(tmp_path), "-qq", "--jobs", "1")
    assert different.exit_code == 8
    assert different.stdout == ""
    assert "~ no-fence.tlog" in different.stderr
    assert 'expected "FenceError", got "FenceMissingError"' in different.stderr


def test_quiet_leaves_warnings_and_quieter_only_errors(copies):
    everything = [json.loads(line) for line in run(*copies, "--json", "--jobs", "1").stdout.splitlines()]
    grave = {"warning", "error", "critical"}
    assert {event["severity"] for event in everything} & grave == {"warning"}
    warnings = [event for event in everything if event["severity"] in grave]
    quiet = run(*copies, "--json", "-q", "--jobs", "1")
    assert [json.loads(line) for line in quiet.stdout.splitlines()] == warnings
    told = run(*copies, "-q", "--jobs", "1").stdout.splitlines()
    loud = run(*copies, "--jobs", "1").stdout.splitlines()
    assert len(told) == len(warnings)
    assert set(told) < set(loud)  # the same seconds since the log's begin, too
    for quieter in (["-qq"], ["-qq", "--json"]):
        assert run(*copies, *quieter, "--jobs", "1").stdout == ""


def test_side_by_side_gives_the_same_in_the_same_order(copies):
    one = run(*copies, "--json", "--jobs", "1")
    command = [sys.executable, "-m", "mavlink_bridge.cli", "replay", *copies, "--json", "--jobs", "2"]
    two = subprocess.run(command, capture_output=True, text=True, check=True)
    assert two.stdout == one.stdout
    logs = [json.loads(line)["log"] for line in two.stdout.splitlines()]
    assert list(dict.fromkeys(logs)) == [f"{name}.tlog" for name in NAMES]


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_an_unusable_log_stops_no_other(copies, tmp_path, jobs):
    (tmp_path / "none.tlog").write_text("nothing\n")
    result = run(str(tmp_path / "none.tlog"), copies[1], "--json", "--jobs", jobs, "--record")
    assert result.exit_code == 3
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert lines[0]["error"] == "LogError"
    assert lines[-1]["event"] == "no_plan"
    assert (tmp_path / "no-fence.events.jsonl").exists()
    assert not (tmp_path / "none.events.jsonl").exists()
    (tmp_path / "none.events.jsonl").write_text('{"event": "target"}\n')
    missing = run(str(tmp_path / "none.tlog"), copies[1], "--expect", str(tmp_path), "--jobs", "1")
    assert missing.exit_code == 8


def test_what_a_log_does_not_hold_is_not_learnt(logs):
    told = run(str(logs / "no-fence.tlog")).stdout
    assert "learnt: no fence seen, no mission seen" in told
    assert "learnt: fence of 4 zones, no mission seen" in run(str(logs / "mission-yard.tlog")).stdout
    assert "of 0" not in told


@pytest.mark.parametrize("zeros", [b"", bytes(5000), b"\xff" * 65536])
def test_a_log_with_times_of_1970_and_nothing_in_it_is_read(tmp_path, zeros):
    """As ground stations write them before the clock is right, into files that are longer than what was written."""
    codec = Codec(1, 1)
    with TlogWriter(tmp_path / "odd.tlog") as log:
        for second in range(60):
            time_s = second if second < 20 else 1_790_000_000 + second
            log.write(time_s, codec.encode(Heartbeat(10, 3, 81, 4)))
            log.write(
                time_s, codec.encode(GlobalPositionInt(second * 1000, 481005000, 115005000 + second * 100))
            )
    path = tmp_path / "odd.tlog"
    path.write_bytes(path.read_bytes() + zeros)
    told = run(str(path))
    assert told.exit_code == 0
    assert "learnt: no fence seen, no mission seen" in told.stdout
    summary = CliRunner().invoke(app, ["log", str(path)])
    assert summary.exit_code == 0
    assert (
        summary.stdout.splitlines()[-1]
        == "Verdict on vehicle 1: no fence in the log, so no clearance was measured"
    )


def test_all_together_against_one_file(copies, tmp_path):
    told = run(*copies, "--json", "--jobs", "1").stdout
    (tmp_path / "all.jsonl").write_text(told)
    assert run(*copies, "--expect", str(tmp_path / "all.jsonl"), "--quiet", "--jobs", "1").exit_code == 0
    (tmp_path / "all.jsonl").write_text("".join(told.splitlines(keepends=True)[1:]))
    extra = run(*copies, "--expect", str(tmp_path / "all.jsonl"), "--quiet", "--jobs", "1")
    assert extra.exit_code == 8
    assert extra.stderr.splitlines()[0].startswith("+ mission-yard.tlog")


def test_in_the_logs_own_time(logs, tmp_path, monkeypatch):
    path = tmp_path / "short.tlog"
    codec = Codec(1, 1)
    with TlogWriter(path) as writer:
        for second in (0.0, 1.0, 2.0, 3.0):
            writer.write(1.7e9 + second, codec.encode(Heartbeat(10, 3)))
    clock = Clock()
    monkeypatch.setattr(replay_command, "time", clock)
    assert run(str(path), "--speed", "10", "--quiet").exit_code == 0
    assert clock.now_s == pytest.approx(0.3)


class Clock:
    """Time that passes only while somebody sleeps."""

    now_s = 0.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, for_s: float) -> None:
        self.now_s += for_s


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["no-fence.tlog", "--speed", "0"], 2),
        (["no-fence.tlog", "--speed", "inf"], 2),
        (["no-fence.tlog", "--jobs", "0"], 2),
        (["a.tlog", "b.tlog", "--send", "udpout:127.0.0.1:9"], 2),
        (["a.tlog", "--record", "--send", "udpout:127.0.0.1:9"], 2),
        (["missing.tlog", "--send", "udpout:127.0.0.1:9"], 3),
        (["missing.tlog", "--send", "nonsense"], 5),
        (["missing.tlog", "--expect", "missing.jsonl"], 3),
    ],
)
def test_wrong_input_is_one_clear_error(arguments, code):
    result = run(*arguments)
    assert result.exit_code == code
    assert "Traceback" not in result.output


def test_the_vehicles_side_is_sent_byte_by_byte(logs):
    path = logs / "mission-yard.tlog"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.bind(("127.0.0.1", 0))
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        client.settimeout(5.0)
        heard: list[bytes] = []
        listener = threading.Thread(target=_listen, args=(client, heard))
        listener.start()
        port = client.getsockname()[1]
        result = run(str(path), "--send", f"udpout:127.0.0.1:{port}", "--speed", "400")
        client.sendto(b"", ("127.0.0.1", port))
        listener.join()
    sent = [data for _, data in vehicle_frames(path)]
    assert result.exit_code == 0
    assert f"Sent {len(sent)} messages" in result.stdout
    assert heard == sent[: len(heard)]
    assert len(heard) > 0.9 * len(sent)  # datagrams may be lost
    codec = Codec(245, 190)
    positions = [
        frame.message
        for data in sent
        for frame in codec.decode(data)
        if isinstance(frame.message, GlobalPositionInt)
    ]
    reader = TlogReader(path, {GlobalPositionInt})
    assert positions == [entry.frame.message for entry in reader]


def _listen(client: socket.socket, heard: list[bytes]) -> None:
    while data := client.recv(65536):
        heard.append(data)


def test_a_client_that_calls_is_waited_for(logs):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [
        sys.executable, "-m", "mavlink_bridge.cli", "replay", str(logs / "no-fence.tlog"),
        "--send", f"udpin:127.0.0.1:{port}", "--speed", "1000",
    ]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(0.2)
        heard = b""
        until_s = time.monotonic() + 60
        while not heard and time.monotonic() < until_s:
            client.sendto(b"\xfd", ("127.0.0.1", port))  # not MAVLink: nobody to play to
            client.sendto(Codec(255, 190).encode(Heartbeat(6, 8)), ("127.0.0.1", port))
            try:
                heard = client.recv(65536)
            except (TimeoutError, ConnectionError):
                continue
        assert heard[:1] == b"\xfd"
    output, _ = process.communicate(timeout=60)
    assert "Sent" in output
    assert process.returncode == 0


def test_which_vehicle_is_played(tmp_path):
    path = tmp_path / "two.tlog"
    with TlogWriter(path) as writer:
        for sender in ((1, 1), (2, 1), (1, 195), (255, 190)):
            kind = (10, 3) if sender[1] == 1 else (18, 8)
            writer.write(1.7e9, Codec(*sender).encode(Heartbeat(*kind)))
    result = run(str(path), "--send", "udpout:127.0.0.1:9")
    assert result.exit_code == 3
    frames = [data for _, data in vehicle_frames(path, 1)]
    assert [data[5:7] for data in frames] == [b"\x01\x01"]


TOLD = [
    {"log": "a.tlog", "time_s": 1.0, "event": "target", "position": [40.0, -105.0], "text": "words"},
    {"log": "a.tlog", "time_s": 2.0, "event": "planned", "length_m": 100.0, "waypoints": 3, "path": [[1, 2]]},
]


@pytest.mark.parametrize(
    ("expected", "found"),
    [
        ([{"event": "target"}, {"event": "planned"}], 0),
        ([{"event": "target", "time_s": 1.001}, {"event": "planned", "length_m": 104.0}], 0),
        ([{"event": "target", "time_s": 1.01}, {"event": "planned", "length_m": 106.0}], 2),
        ([{"event": "target", "position": [40.0000001, -105.0]}, {"event": "planned"}], 0),
        ([{"event": "target", "position": [40.000001, -105.0]}, {"event": "planned"}], 1),
        ([{"event": "target", "position": [40.0]}, {"event": "planned"}], 1),
        ([{"event": "target", "position": None}, {"event": "planned", "waypoints": 4}], 2),
        ([{"event": "target", "source": "typed"}, {"event": "planned", "waypoints": 3.0}], 1),
        ([{"event": "target"}], 1),
        ([{"event": "target"}, {"event": "planned"}, {"event": "arrived"}], 1),
        ([{"event": "target"}, {"event": "no_plan"}], 2),
        ([{"event": "target", "log": "b.tlog"}, {"event": "planned", "log": "a.tlog"}], 2),
        ([{"event": "target", "text": {"a": 1}}, {"event": "planned"}], 1),
        ([], 2),
    ],
)
def test_differences(expected, found):
    assert len(differences(expected, TOLD)) == found


def test_nested_objects_are_compared_too():
    one = [{"event": "no_plan", "details": {"clearance_m": 1.0, "fences": ["a"]}}]
    near = [{"event": "no_plan", "details": {"clearance_m": 1.01, "fences": ["a"]}}]
    far = [{"event": "no_plan", "details": {"clearance_m": 1.1, "fences": ["a"]}}]
    assert differences(one, near) == []
    assert len(differences(one, far)) == 1
    assert len(differences(one, [{"event": "no_plan", "details": {}}])) == 1


def test_what_is_recorded_leaves_wording_out(tmp_path):
    path = tmp_path / "a.events.jsonl"
    path.write_text(to_expect(TOLD))
    assert read_expectation(path) == [
        {"time_s": 1.0, "event": "target", "position": [40.0, -105.0]},
        {"time_s": 2.0, "event": "planned", "length_m": 100.0},
    ]


@pytest.mark.parametrize("content", [b"{", b"[1]\n", b"\xff\xfe\n"])
def test_what_is_no_expectation_is_one_clear_error(tmp_path, logs, content):
    path = tmp_path / "wrong.jsonl"
    path.write_bytes(content)
    result = run(str(logs / "no-fence.tlog"), "--expect", str(path))
    assert result.exit_code == 3
    assert "wrong.jsonl" in result.stderr
