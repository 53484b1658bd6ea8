"""`pbpp upload` and `pbpp download` over TCP on the loopback, against the simulated rover."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace

import pytest
from protocol.twin import plain_fence, plain_mission
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.app import app
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.formats import read_situation
from missions.formats.waypoints import format_items
from missions.items import MissionItem
from missions.rally import RallyPoint, rally_to_items

MISSION, FENCE = MissionType.MISSION, MissionType.FENCE
OLD = plain_mission(25, salt=1)
NEW = plain_mission(20)


@pytest.fixture(autouse=True)
def state_folder(tmp_path, monkeypatch):
    """Keep the tests out of the user's state folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path / "state"


def simulated(speedup, **parameters):
    config = SimulatorConfig(
        mission=tuple(OLD[1:]),
        fence=tuple(plain_fence(2, salt=9)),
        parameters=parameters,
    )
    return Simulator(config, "tcpin:127.0.0.1:0", speedup=speedup)


@pytest.fixture
def rover():
    with simulated(speedup=5.0) as simulator:
        yield simulator


@pytest.fixture
def hasty_rover():
    """One that gives an upload up after 0.4 s."""
    with simulated(speedup=20.0) as simulator:
        yield simulator


def run(rover, *arguments, timeout_s=10):
    """Run a command against the rover; return exit code, JSON document (None without --json) and stderr."""
    command = [
        *map(str, arguments),
        "--connect",
        rover.connection,
        "--system",
        "1",
        "--timeout",
        str(timeout_s),
    ]
    result = CliRunner().invoke(app, command)
    document = json.loads(result.stdout) if "--json" in arguments else None
    return result.exit_code, document, result.stderr if document else result.output


def mission_file(tmp_path, items=NEW, name="mission.waypoints"):
    path = tmp_path / name
    path.write_text(format_items(items))
    return path


def places(items):
    return [(item.lat_e7, item.lon_e7) for item in items]


def put(rover, mode):
    """Arm the rover and put it into a mode."""
    rover.vehicle.rover.is_armed = True
    rover.vehicle.rover.mode = type(rover.vehicle.mode)(mode)
    time.sleep(0.15)


def test_a_mission_goes_up_and_comes_down(rover, tmp_path):
    code, document, _ = run(rover, "upload", mission_file(tmp_path), "--json")
    assert code == 0
    assert document["verified"]
    [entry] = document["lists"]
    assert (entry["list"], entry["items"], entry["outcome"], entry["pushes"]) == (
        "mission",
        20,
        "verified",
        1,
    )
    assert places(rover.vehicle.mission[1:]) == places(NEW[1:])
    backup = BackupStore().newest(1, MISSION)
    assert str(backup.path) == entry["backup"]
    assert places(backup.items[1:]) == places(OLD[1:])
    down = tmp_path / "down.waypoints"
    code, document, _ = run(rover, "download", "mission", "-o", down, "-o", tmp_path / "down.plan", "--json")
    assert code == 0
    assert document["outputs"] == [str(down), str(tmp_path / "down.plan")]
    assert [item["lat"] for item in document["items"][1:]] == [item.lat_e7 / 1e7 for item in NEW[1:]]
    for again in (down, tmp_path / "down.plan"):
        code, document, _ = run(rover, "upload", again, "--json")
        assert code == 0
        assert document["lists"][0]["pushes"] == 0


def test_people_are_told_in_words(rover, tmp_path):
    code, _, output = run(rover, "upload", mission_file(tmp_path))
    assert code == 0
    assert "mission: 20 items, uploaded in" in output
    assert "the list before is kept in" in output
    assert "already on the vehicle" in run(rover, "upload", mission_file(tmp_path))[2]
    assert run(rover, "upload", mission_file(tmp_path), "--quiet")[2] == ""
    listed = run(rover, "download", "mission")[2].splitlines()
    assert listed[0] == "mission: 20 items"
    assert len(listed) == 21
    assert listed[2].split()[:3] == ["1", "NAV_WAYPOINT", str(NEW[1].position)]


@pytest.mark.parametrize(
    ("kind", "name"), [("fence", "yard-fence.waypoints"), ("rally", "union-rally.waypoints")]
)
def test_fences_and_rally_points(rover, tmp_path, fields, kind, name):
    assert run(rover, "upload", fields / name)[0] == 0
    for suffix in (".waypoints", ".plan"):
        down = tmp_path / f"down{suffix}"
        assert run(rover, "download", kind, "-o", down)[0] == 0
        code, document, _ = run(rover, "upload", down, "--only", kind, "--json")
        assert code == 0
        assert document["lists"][0]["pushes"] == 0


def test_a_fence_for_an_armed_vehicle_comes_with_a_warning(rover, tmp_path, fields):
    fence = fields / "yard-fence.waypoints"
    assert "takes effect at once" not in run(rover, "upload", fence)[2]
    rover.vehicle.rover.is_armed = True
    code, _, output = run(rover, "upload", fence)
    assert code == 0
    assert "warning: the vehicle is armed, and a new fence takes effect at once" in output
    assert "takes effect at once" not in run(rover, "upload", mission_file(tmp_path))[2]


def test_rally_points_keep_their_altitude(rover, tmp_path):
    points = (RallyPoint(40.0714, -105.2299, 12.0), RallyPoint(40.0715, -105.2298, -3.0))
    file = tmp_path / "rally.waypoints"
    file.write_text(format_items(rally_to_items(points)))
    assert run(rover, "upload", file)[0] == 0
    for suffix in (".waypoints", ".plan"):
        down = tmp_path / f"back{suffix}"
        assert run(rover, "download", "rally", "-o", down)[0] == 0
        assert read_situation(down).rally.value == points
        assert run(rover, "upload", down, "--only", "rally", "--json")[1]["lists"][0]["pushes"] == 0


def test_parameters(rover, tmp_path):
    down = tmp_path / "all.parm"
    code, _, output = run(rover, "download", "parameters", "-o", down)
    assert code == 0
    assert "parameters; written to" in output
    assert "WP_SPEED 5\n" in down.read_text()
    assert "all parameters already have these values" in run(rover, "upload", down)[2]
    changed = tmp_path / "changed.param"
    changed.write_text("WP_SPEED,3.5\nWP_RADIUS,3\n")
    code, document, _ = run(rover, "upload", changed, "--json")
    assert code == 0
    assert document["parameters"] == {"WP_SPEED": {"before": 5.0, "now": 3.5}}
    assert rover.vehicle.parameters["WP_SPEED"] == 3.5
    assert "WP_SPEED" in run(rover, "download", "parameters", "--json")[1]["parameters"]
    changed.write_text("WP_SPEED 4.5\nNO_SUCH 1\n")
    code, _, output = run(rover, "upload", changed)
    assert code == 6
    assert "NO_SUCH" in output
    assert rover.vehicle.parameters["WP_SPEED"] == 3.5


def test_a_refusal_says_what_and_where(rover, tmp_path):
    bad = [*NEW[:7], MissionItem(31000), *NEW[8:]]
    code, document, _ = run(rover, "upload", mission_file(tmp_path, bad), "--json")
    assert code == 6
    assert document["details"]["result"] == "UNSUPPORTED"
    assert document["details"]["item"] == 7
    assert places(rover.vehicle.mission[1:]) == places(OLD[1:])
    assert BackupStore().notes() == []


def test_what_does_not_fit_is_said_before_anything_is_sent(rover, tmp_path):
    code, document, _ = run(rover, "upload", mission_file(tmp_path, plain_mission(700)), "--json")
    assert code == 6
    assert "700 mission items; the vehicle holds 655" in document["message"]
    assert places(rover.vehicle.mission[1:]) == places(OLD[1:])


@pytest.fixture
def slow_rover():
    """One that drives for as long as any test lasts."""
    with simulated(speedup=5.0, WP_SPEED=0.05) as simulator:
        yield simulator


def test_a_driving_vehicle_is_left_alone_unless_told(slow_rover, tmp_path):
    rover = slow_rover
    put(rover, Mode.AUTO)
    path, short = mission_file(tmp_path), mission_file(tmp_path, plain_mission(9, 3), "short.waypoints")
    code, _, output = run(rover, "upload", path)
    assert code == 6
    assert "--hold" in output
    code, _, output = run(rover, "upload", path, "--hold")
    assert code == 0, output
    assert rover.vehicle.mode == Mode.HOLD
    put(rover, Mode.AUTO)
    assert run(rover, "upload", short, "--hold", "--drive")[0] == 0
    assert rover.vehicle.mode == Mode.AUTO
    assert run(rover, "upload", path, "--replace-active")[0] == 0
    assert len(rover.vehicle.mission) == 20


def test_a_disarmed_vehicle_is_not_left_in_auto(rover, tmp_path):
    for mode in (Mode.HOLD, 0):
        put(rover, mode)
        rover.vehicle.rover.is_armed = False
        code, document, _ = run(rover, "upload", mission_file(tmp_path), "--drive", "--json")
        assert (code, document["error"]) == (7, "OutcomeError")
        assert "not armed and does not drive: its mode was not changed" in document["message"]
        assert rover.vehicle.mode == mode
    assert places(rover.vehicle.mission[1:]) == places(NEW[1:])


def test_disarmed_between_the_look_and_the_switch_it_is_put_back(rover, tmp_path, monkeypatch):
    put(rover, Mode.HOLD)
    set_mode = rover.vehicle.rover.set_mode

    def disarmed_meanwhile(number, now_s):
        if number == Mode.AUTO:
            rover.vehicle.rover.disarm()
        return set_mode(number, now_s)

    monkeypatch.setattr(rover.vehicle.rover, "set_mode", disarmed_meanwhile)
    code, document, _ = run(rover, "upload", mission_file(tmp_path), "--drive", "--json")
    assert code == 7
    assert "switched back to HOLD and does not drive" in document["message"]
    assert rover.vehicle.mode == Mode.HOLD


def test_a_mission_that_is_complete_is_replaced_and_begun_anew(rover, tmp_path):
    put(rover, Mode.AUTO)
    rover.vehicle.rover.mission_run.is_complete = True
    path = mission_file(tmp_path)
    assert run(rover, "upload", path)[0] == 0
    assert (rover.vehicle.mode, rover.vehicle.rover.mission_run.is_complete) == (Mode.AUTO, True)
    assert run(rover, "upload", path, "--drive")[0] == 0
    assert (rover.vehicle.mode, rover.vehicle.rover.mission_run.is_complete) == (Mode.AUTO, False)


def test_nobody_there(tmp_path):
    result = CliRunner().invoke(
        app, ["upload", str(mission_file(tmp_path)), "--connect", "udpin:127.0.0.1:0", "--timeout", "0.3"]
    )
    assert result.exit_code == 5


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["upload"], 2),
        (["upload", "--connect", "x"], 2),
        (["upload", "none.waypoints"], 2),
        (["upload", "none.waypoints", "--connect", "udpin:127.0.0.1:0"], 3),
        (["upload", "yard-fence.waypoints", "--only", "roads", "--connect", "x"], 2),
        (["upload", "yard-fence.waypoints", "--only", "rally", "--connect", "x"], 2),
        (["upload", "none.json", "--restore", "--connect", "x"], 7),
        (["download", "everything", "--connect", "x"], 2),
        (["download", "mission"], 2),
        (["download", "mission", "--connect", "x", "-o", "m.kmz"], 2),
        (["download", "parameters", "--connect", "x", "-o", "m.plan"], 2),
        (["download", "mission", "--connect", "nonsense"], 5),
        (["download", "mission", "--connect", "udpin:127.0.0.1:0", "--signing-key", "none"], 2),
    ],
)
def test_usage(arguments, code, fields):
    arguments = [str(fields / part) if part.startswith("yard") else part for part in arguments]
    assert CliRunner().invoke(app, arguments).exit_code == code


def test_a_file_that_cannot_be_written(rover, tmp_path):
    code, _, output = run(rover, "download", "mission", "-o", tmp_path / "no" / "m.waypoints")
    assert code == 3
    assert "cannot be written" in output


def test_nothing_to_restore(rover):
    code, _, output = run(rover, "upload", "--restore")
    assert code == 2
    assert "no upload to system 1 was interrupted" in output


def test_a_backup_is_restored_by_its_file(rover, tmp_path):
    run(rover, "upload", mission_file(tmp_path))
    backup = BackupStore().newest(1, MISSION)
    assert run(rover, "upload", "--restore", backup.path)[0] == 0
    assert places(rover.vehicle.mission[1:]) == places(OLD[1:])


# Between the first item and the last nothing is written to disk; the campaign breaks transfers after any message, in stepped time.
@pytest.mark.parametrize("killed_at", [0, 1, 7, 13, 19])
def test_kill_9_at_an_item(killed_at, hasty_rover, tmp_path):
    rover, vehicle = hasty_rover, hasty_rover.vehicle
    receive = vehicle.receive
    passed = []

    def receive_up_to_it(frame, now_s):
        if frame.system == 245 and passed:
            return  # deaf from then on, so that the upload cannot come to its outcome before the kill
        if getattr(frame.message, "x", None) is not None and frame.message.seq == killed_at:
            passed.append(frame)
        receive(frame, now_s)

    vehicle.receive = receive_up_to_it
    command = ["upload", mission_file(tmp_path), "--connect", rover.connection, "--system", "1", "-q"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mavlink_bridge.cli", *map(str, command)], env=dict(os.environ)
    )
    try:
        assert _soon(lambda: _is_written(vehicle, killed_at))
    finally:
        process.kill()
        process.wait()
    vehicle.receive = receive
    time.sleep(0.5)  # the vehicle gives the upload up
    assert places(vehicle.mission[1:]) != places(OLD[1:])
    before = places(vehicle.mission)
    code, _, said = run(rover, "download", "mission")
    assert code == 0
    assert "was interrupted" in said
    assert "--restore" in said
    assert places(vehicle.mission) == before  # nothing is restored unasked
    code, document, _ = run(rover, "upload", "--restore", "--json")
    assert code == 0
    assert document["lists"][0]["outcome"] == "verified"
    assert places(vehicle.mission[1:]) == places(OLD[1:])
    assert "interrupted" not in run(rover, "download", "mission")[2]


def _is_written(vehicle, seq):
    mission = vehicle.mission
    if len(mission) != len(NEW):  # MISSION_COUNT cuts it at once
        return False
    return seq == 0 or places(mission[seq : seq + 1]) == places(NEW[seq : seq + 1])


def _soon(condition, within_s=60.0):
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if condition():
            return True
        time.sleep(0.01)
    return False


def test_signed_links_need_the_key(rover, tmp_path):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(32)))
    key.chmod(0o600)
    code, _, output = run(rover, "download", "mission", "--signing-key", key, timeout_s=1)
    assert code == 5
    assert "not signed with this key" in output


@pytest.mark.parametrize(("patched", "left_behind"), [("begin", False), ("backup_stored", True)])
def test_an_interrupt_says_what_it_left_behind(rover, tmp_path, monkeypatch, patched, left_behind):
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload

    owner = BackupStore if patched == "begin" else VerifiedUpload
    original = getattr(owner, patched)

    def interrupted(*arguments):
        original(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(owner, patched, interrupted)
    code, document, _ = run(rover, "upload", mission_file(tmp_path), "--json")
    assert code == 130
    assert ("part of both" in document["message"]) is left_behind
    assert ("was left as it was" in document["message"]) is not left_behind


def test_a_parameter_the_vehicle_keeps_is_an_outcome(rover, tmp_path, monkeypatch):
    vehicle = rover.vehicle
    monkeypatch.setattr(
        vehicle,
        "_set_parameter",
        lambda message: vehicle._outbox.append(vehicle._parameter(message.param_id, 65535)),
    )
    path = tmp_path / "one.param"
    path.write_text("WP_SPEED 7\n")
    code, document, _ = run(rover, "upload", path, "--json")
    assert code == 7
    assert (document["details"]["wanted"], document["details"]["found"]) == (7.0, 5.0)


@pytest.mark.parametrize("what", ["mission", "parameters"])
def test_a_vehicle_that_falls_silent(rover, monkeypatch, what):
    monkeypatch.setattr("mavlink_bridge.protocol.download.PATIENCE_S", 0.4)
    monkeypatch.setattr("mavlink_bridge.protocol.parameters.PATIENCE_S", 0.4)
    monkeypatch.setattr(rover.vehicle, "receive", lambda frame, now_s: None)
    assert run(rover, "download", what)[0] == 5


def test_a_vehicle_that_refuses_or_is_busy(rover, monkeypatch):
    from mavlink_bridge.mavlink.messages import MissionAck, MissionRequestList

    vehicle, results = rover.vehicle, [3]
    receive = vehicle.receive

    def refuse(frame, now_s):
        if isinstance(frame.message, MissionRequestList):
            vehicle._outbox.append(
                MissionAck(frame.system, frame.component, results[0], frame.message.mission_type)
            )
        else:
            receive(frame, now_s)

    monkeypatch.setattr(vehicle, "receive", refuse)
    code, document, _ = run(rover, "download", "fence", "--json")
    assert (code, document["details"]["result"]) == (6, "UNSUPPORTED")
    results[0] = 14
    monkeypatch.setattr(
        "mavlink_bridge.protocol.undisturbed_read.UndisturbedRead.__init__.__kwdefaults__",
        {"rival_patience_s": 0.5, "round_trip": None, "most_s": 600.0, "float_form": True},
    )
    code, document, _ = run(rover, "download", "fence", "--json")
    assert (code, document["details"]["result"]) == (6, "DENIED")


@pytest.mark.parametrize(
    "command",
    [
        ("upload", "MISSION"),
        ("download", "mission"),
        ("download", "fence"),
        ("download", "parameters"),
        ("check",),
        ("plan", "--target", "40.0726,-105.2290"),
    ],
)
def test_an_autopilot_that_is_not_known_is_refused_by_every_command(rover, tmp_path, monkeypatch, command):
    code, document = with_autopilot(0, rover, tmp_path, monkeypatch, command)
    assert (code, document["error"]) == (5, "VehicleNotFoundError")
    assert document["message"] == (
        "the autopilot of system 1 is neither ArduPilot nor PX4 (MAV_AUTOPILOT 0): no other is supported for now"
    )
    assert document["details"]["autopilot"] == 0


def with_autopilot(autopilot, rover, tmp_path, monkeypatch, command):
    """Run a command on a rover that says it has another autopilot."""
    from mavlink_bridge.simulator import telemetry

    arguments = [str(mission_file(tmp_path)) if word == "MISSION" else word for word in command]
    own = telemetry._BUILDERS[telemetry.streams.HEARTBEAT]
    monkeypatch.setitem(
        telemetry._BUILDERS,
        telemetry.streams.HEARTBEAT,
        lambda state: replace(own(state), autopilot=autopilot),
    )
    code, document, _ = run(rover, *arguments, "--json")
    return code, document
