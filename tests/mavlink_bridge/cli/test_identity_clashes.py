"""Somebody with our own ids, and our own messages that come back, as the commands take them."""

from __future__ import annotations

import json
import os

import pytest
from cli.test_bridge import FAR, HOME, start_bridge, wait_for
from cli.test_bridge import run as run_bridge
from protocol.twin import plain_mission
from typer.testing import CliRunner

from mavlink_bridge import link as links
from mavlink_bridge.cli.app import app
from mavlink_bridge.link import open_link
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import (
    Heartbeat,
    MissionItemInt,
    MissionRequestInt,
    MissionRequestList,
)
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.formats.waypoints import format_items

OURS = (245, 190)
OLD, NEW = plain_mission(25, salt=1), plain_mission(20)
WARNING = "uses our ids"


pytestmark = pytest.mark.usefixtures("state_folder")


@pytest.fixture
def rover(fields):
    fence = fence_to_items(read_fence(fields / "yard-fence.waypoints"))
    config = SimulatorConfig(home=HOME, mission=tuple(OLD[1:]), fence=fence, parameters={"FENCE_ENABLE": 1.0})
    with Simulator(config, "tcpin:127.0.0.1:0", speedup=5.0) as simulator:
        yield simulator


@pytest.fixture
def forge(monkeypatch):
    """Let somebody speak on the link, with each piece that comes, once we have sent a message of a kind."""

    def begin(after=None, *, reflects=False):
        reader, forger = Codec(9, 9), Codec(*OURS)
        heard = []
        send, receive = links._Tcp.send, links._Tcp.receive

        def listen(self, data):
            send(self, data)
            frames = reader.decode(data)
            if heard or after is None or any(isinstance(frame.message, after) for frame in frames):
                heard.append(data)

        def speak(self, timeout_s):
            pieces = receive(self, timeout_s)
            if heard and pieces:
                pieces.append((None, heard[-1] if reflects else forger.encode(Heartbeat(6, 8))))
            return pieces

        monkeypatch.setattr(links._Tcp, "send", listen)
        monkeypatch.setattr(links._Tcp, "receive", speak)

    return begin


def run(rover, *arguments):
    return CliRunner().invoke(app, [*arguments, "--connect", rover.connection, "--timeout", "10", "--json"])


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "new.waypoints"
    path.write_text(format_items(NEW))
    return str(path)


def is_held(rover, items):
    return [item.position for item in rover.vehicle.mission[1:]] == [item.position for item in items[1:]]


@pytest.mark.parametrize("after", [None, MissionRequestList, MissionRequestInt])
def test_an_upload_is_refused_before_anything_is_written(rover, forge, mission_file, after, state_folder):
    forge(after)
    result = run(rover, "upload", mission_file)
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (5, "IdentityTakenError")
    assert "--source-component" in document["message"]
    assert is_held(rover, OLD)
    assert list(state_folder.rglob("*.json")) == []


def test_an_upload_that_has_begun_goes_on_to_its_verified_end_and_says_so_once(rover, forge, mission_file):
    forge(MissionItemInt)
    result = run(rover, "upload", mission_file)
    assert result.exit_code == 0
    assert json.loads(result.stdout)["verified"] is True
    assert is_held(rover, NEW)
    assert result.stderr.count(WARNING) == 1
    assert "warning: another program on the link uses our ids (system 245 component 190)" in result.stderr


def test_an_upload_is_not_driven_then(rover, forge, mission_file):
    rover.vehicle.rover.arm()
    forge(MissionItemInt)
    result = run(rover, "upload", mission_file, "--drive")
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (7, "OutcomeError")
    assert document["message"] == (
        "another program on the link uses our ids (system 245 component 190): the vehicle was not switched to AUTO; the upload is on it"
        "; written and verified before: mission"
    )
    assert is_held(rover, NEW)
    assert rover.vehicle.mode != Mode.AUTO


def test_a_download_goes_on(rover, forge, tmp_path):
    forge(MissionRequestInt)
    result = run(rover, "download", "mission", "-o", str(tmp_path / "old.waypoints"))
    assert result.exit_code == 0
    assert result.stderr.count(WARNING) == 1


@pytest.mark.parametrize("after", [None, MissionItemInt])
def test_what_comes_back_of_ours_is_noted_once(rover, forge, mission_file, after):
    forge(after, reflects=True)
    result = run(rover, "upload", mission_file)
    assert result.exit_code == 0
    assert is_held(rover, NEW)
    assert WARNING not in result.stderr
    assert result.stderr.count("info: this link echoes our own messages; they are ignored") == 1


def test_a_note_is_left_out_where_little_is_to_be_told(rover, forge, mission_file):
    forge(reflects=True)
    result = run(rover, "upload", mission_file, "-q")
    assert (result.exit_code, result.stderr) == (0, "")


@pytest.mark.parametrize(("after", "code"), [(MissionRequestList, 5), (MissionItemInt, 0)])
def test_a_plan_that_is_uploaded(rover, forge, after, code):
    forge(after)
    result = run(rover, "plan", "--target", FAR, "--upload")
    document = json.loads(result.stdout)
    assert result.exit_code == code
    assert result.stderr.count(WARNING) == (code == 0)
    assert document["verified" if code == 0 else "error"] == (True if code == 0 else "IdentityTakenError")
    assert is_held(rover, OLD) is (code != 0)


def test_a_bridge_lives_on_and_its_log_replays_to_the_same(rover, tmp_path):
    log = tmp_path / "run.tlog"
    process = start_bridge(rover.connection, "--upload", "--log", str(log))
    try:
        wait_for(process, "learnt")
        with open_link(rover.connection, (1, 195)) as impostor:
            impostor.send(Heartbeat(6, 8))
            clash = wait_for(process, "identity_clash")
        assert (clash["system"], clash["component"], clash["held"]) == (1, 195, False)
        process.stdin.write(f"{FAR}\n")
        process.stdin.flush()
        wait_for(process, "verified")
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=60)
    assert process.returncode == (130 if os.name == "posix" else process.returncode)
    assert "link:" not in errors
    replayed = [json.loads(line) for line in run_bridge("replay", str(log), "--json").stdout.splitlines()]
    names = [event["event"] for event in replayed]
    assert names.count("identity_clash") == 1
    assert names[-1] == "verified"


def test_an_impostor_at_the_start_ends_a_bridge(rover):
    with open_link(rover.connection, (1, 195)) as impostor:
        process = start_bridge(rover.connection, "--system", "1")
        while process.poll() is None:
            impostor.send(Heartbeat(6, 8))
            impostor.receive(0.1)
        output, errors = process.communicate(timeout=60)
    assert process.returncode == 5
    assert json.loads(output.splitlines()[-1])["error"] == "IdentityTakenError"
    assert "Traceback" not in errors
