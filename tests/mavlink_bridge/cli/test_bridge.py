"""``pbpp bridge`` and ``pbpp replay`` over real sockets and files."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace

import processes
import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.link import open_link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import MovingDisc, Simulator, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, distance_m

HOME = LatLon(40.071374, -105.229930)
FAR = "40.0720926,-105.2286152"


@pytest.fixture
def config(fields):
    fence = fence_to_items(read_fence(fields / "yard-fence.waypoints"))
    return SimulatorConfig(home=HOME, fence=fence, parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 4.0})


pytestmark = pytest.mark.usefixtures("state_folder")


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def start_bridge(connection: str, *arguments: str) -> subprocess.Popen:
    command = [
        sys.executable,
        "-m",
        "mavlink_bridge.cli",
        "bridge",
        "--connect",
        connection,
        "--json",
        *arguments,
    ]
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **processes.APART,
    )


def wait_for(process: subprocess.Popen, name: str, within_s: float = 120.0) -> dict:
    """Return the first event of a name from the bridge's JSON lines."""
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        line = process.stdout.readline()
        if not line:
            raise AssertionError(process.stderr.read())
        event = json.loads(line)
        if event["event"] == name:
            return event
    raise AssertionError(name)


def test_one_job_with_a_log_that_replays_to_the_same_decisions(config, tmp_path):
    log = tmp_path / "run.tlog"
    with Simulator(config, "tcpin:127.0.0.1:0", speedup=10) as simulator:
        process = start_bridge(
            simulator.connection, "--target", FAR, "--upload", "--drive", "--arm", "--once", "--log", str(log)
        )
        output, errors = process.communicate("", timeout=120)
        assert process.returncode == 0, errors
        assert distance_m(simulator.vehicle.position, LatLon(40.0720926, -105.2286152)) < 4.0
        assert simulator.vehicle.breaches == 0
    told = [json.loads(line) for line in output.splitlines()]
    assert told[-1]["event"] == "arrived"
    again = run("replay", str(log), "--json")
    retold = [json.loads(line) for line in again.stdout.splitlines()]
    # A log holds microseconds, so that a time may be rounded to the next millisecond.
    assert [event.pop("time_s") for event in told] == pytest.approx(
        [event.pop("time_s") for event in retold], abs=0.002
    )
    assert [{**event, "log": "run.tlog"} for event in told] == retold
    expected = tmp_path / "expected.jsonl"
    expected.write_text(again.stdout)
    assert run("replay", str(log), "--expect", str(expected), "--quiet").exit_code == 0
    expected.write_text(again.stdout.replace('"arrived"', '"lost"', 1))
    different = run("replay", str(log), "--expect", str(expected), "--quiet")
    assert different.exit_code == 8
    assert "lost" in different.stderr


def test_a_bridge_killed_while_it_drives_adopts_its_drive_and_replays_so(config, tmp_path, state_folder):
    log = tmp_path / "run.tlog"
    options = ("--target", FAR, "--upload", "--drive", "--arm", "--log", str(log))
    notes = []
    with Simulator(replace(config, uid=b"rover one"), "tcpin:127.0.0.1:0", speedup=3) as simulator:
        for name in ("driving", "arrived"):
            process = start_bridge(simulator.connection, *options)
            try:
                if name == "arrived":
                    assert wait_for(process, "adopted")["mission_items"] == len(simulator.vehicle.mission)
                wait_for(process, name)
                notes.append(list(state_folder.rglob("drive-under-way-*.json")))
            finally:
                process.kill()
                process.communicate()
        assert distance_m(simulator.vehicle.position, LatLon(40.0720926, -105.2286152)) < 4.0
    assert len(notes[0]) == 1
    again = run("replay", str(tmp_path / "run.2.tlog"), "--json")
    names = [json.loads(line)["event"] for line in again.stdout.splitlines()]
    assert [name for name in names if name in ("learnt", "adopted", "driving", "arrived")] == [
        "learnt",
        "adopted",
        "driving",
        "arrived",
    ]


def test_rtl_is_answered_by_a_way_home_and_replays_so(config, tmp_path):
    log = tmp_path / "run.tlog"
    options = ("--target", FAR, "--upload", "--drive", "--arm", "--rtl-by-route", "--log", str(log))
    with Simulator(config, "tcpin:127.0.0.1:0", speedup=3) as simulator:
        process = start_bridge(simulator.connection, *options)
        try:
            told = [wait_for(process, "way_home")["place"]]
            wait_for(process, "progress")
            with open_link(simulator.connection, (255, 190)) as station:
                wait_for(process, "progress")
                station.send(m.SetMode(1, 1, Mode.RTL))
            told += [wait_for(process, name)["event"] for name in ("called_home", "going_home", "driving")]
        finally:
            process.terminate()
            _, errors = process.communicate(timeout=60)
    assert told == ["home", "called_home", "going_home", "driving"]
    assert "the first RTL is answered with HOLD and a verified way home" in errors
    again = run("replay", str(log), "--json")
    names = [json.loads(line)["event"] for line in again.stdout.splitlines()]
    assert [name for name in names if name in ("way_home", "called_home", "going_home")] == [
        "way_home",
        "called_home",
        "going_home",
    ]


def test_a_typed_target_and_a_typed_yes(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        process = start_bridge(simulator.connection, "--upload", "--confirm")
        try:
            wait_for(process, "learnt")
            process.stdin.write(f"nonsense\n{FAR}\n")
            process.stdin.flush()
            wait_for(process, "planned")
            assert len(simulator.vehicle.mission) <= 1
            process.stdin.write("yes\n")
            process.stdin.flush()
            wait_for(process, "verified")
            assert simulator.vehicle.mission[-1].position == LatLon(40.0720926, -105.2286152)
        finally:
            process.terminate()
            _, errors = process.communicate(timeout=60)
    assert "nonsense" in errors


def test_obstacles_typed_and_seen_are_held_for_and_replay_so(config, tmp_path):
    log = tmp_path / "run.tlog"
    beside = MovingDisc(LatLon(40.07150, -105.22960), 0.8)
    seen = replace(config, sensor_m=15.0, discs=(beside,), parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 2.0})
    with Simulator(seen, "tcpin:127.0.0.1:0", speedup=2) as simulator:
        options = ("--target", FAR, "--upload", "--drive", "--arm", "--log", str(log))
        process = start_bridge(
            simulator.connection, *options, "--obstacles-from", "OBSTACLE_DISTANCE,keyboard"
        )
        try:
            wait_for(process, "driving")
            process.stdin.write("blocked here 1.5\n")
            process.stdin.flush()
            across = wait_for(process, "obstacle_across")
            assert "keyboard" in across["obstacle"]
            wait_for(process, "holding")
            process.stdin.write("clear\n")
            process.stdin.flush()
            wait_for(process, "driving")
        finally:
            process.terminate()
            _, errors = process.communicate(timeout=60)
    assert "this protects no person" in errors
    again = run("replay", str(log), "--json")
    names = [json.loads(line)["event"] for line in again.stdout.splitlines()]
    assert names.index("obstacle_across") < names.index("holding")
    assert names.count("driving") == 2


def test_a_link_that_breaks_is_opened_again(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        port = simulator.connection.rpartition(":")[2]
        process = start_bridge(simulator.connection)
        wait_for(process, "learnt")
    try:
        wait_for(process, "link_lost")
        with Simulator(config, f"tcpin:127.0.0.1:{port}"):
            wait_for(process, "learnt")
    finally:
        process.terminate()
        process.communicate(timeout=60)


def test_no_vehicle_for_a_single_job():
    result = run("bridge", "--connect", "udpin:127.0.0.1:0", "--once", "--timeout", "0.5", "--json")
    assert result.exit_code == 5
    assert json.loads(result.stdout.splitlines()[-1])["event"] == "trouble"


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["bridge", "--connect", "nonsense"], 5),
        (["bridge", "--connect", "tcp:127.0.0.1:9", "--target-from", "dreams"], 2),
        (["bridge", "--connect", "tcp:127.0.0.1:9", "--clearance", "-1"], 2),
        (["bridge", "--connect", "tcp:127.0.0.1:9", "--obstacles-from", "keyboard,dreams"], 2),
        (["bridge", "--connect", "tcp:127.0.0.1:9", "--obstacle-growth", "-1"], 2),
        (["bridge"], 2),
        (["replay"], 2),
        (["replay", "missing.tlog"], 3),
    ],
)
def test_wrong_input_is_one_clear_error(arguments, code):
    result = run(*arguments)
    assert result.exit_code == code
    assert "Traceback" not in result.output


def test_options_from_a_file(config, tmp_path):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        options = tmp_path / "bridge.toml"
        options.write_text(
            f'[bridge]\nconnect = "{simulator.connection}"\ntarget = ["{FAR}"]\nupload = true\nonce = true\nclearance = "2"\n'
        )
        result = run("bridge", "--config", str(options), "--json")
        assert result.exit_code == 0
        assert json.loads(result.stdout.splitlines()[-1])["event"] == "verified"
    options.write_text("[bridge]\nspeed = 3\n")
    assert run("bridge", "--config", str(options)).exit_code == 2
    options.write_text("[bridge\n")
    assert run("bridge", "--config", str(options)).exit_code == 2
    assert run("bridge", "--config", str(tmp_path / "none.toml")).exit_code == 2


def test_ends_cleanly_when_asked(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        process = start_bridge(simulator.connection)
        wait_for(process, "learnt")
        processes.end(process)
        output, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert json.loads(output.splitlines()[-1])["error"] == "Interrupted"


def test_replay_of_a_recording_for_people(logs):
    result = run("replay", str(logs / "mission-yard.tlog"))
    assert result.exit_code == 0
    assert "from mission" in result.stdout


def test_replay_against_what_is_no_expectation(logs, tmp_path):
    (tmp_path / "wrong.jsonl").write_text("{")
    wrong = run("replay", str(logs / "mission-yard.tlog"), "--expect", str(tmp_path / "wrong.jsonl"))
    assert wrong.exit_code == 3
    assert run("replay", str(logs / "mission-yard.tlog"), "--expect", str(tmp_path / "none")).exit_code == 3
