"""``pbpp plan`` on a live link, ``pbpp sim`` and ``pbpp demo``, over real sockets on the loopback."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from dataclasses import replace

import processes
import pytest
from typer.testing import CliRunner

from mavlink_bridge import situation_from_log
from mavlink_bridge.cli.app import app
from mavlink_bridge.mavlink.messages import CommandLong
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence, read_situation
from missions.geo import LatLon, distance_m, parse_lat_lon
from missions.items import Command, waypoint

TARGET = "40.0720926,-105.2286152"
HOME = LatLon(40.071374, -105.229930)


@pytest.fixture
def config(fields):
    fence = fence_to_items(read_fence(fields / "yard-fence.waypoints"))
    mission = (waypoint(LatLon(40.0714, -105.2299)), waypoint(LatLon(40.0715, -105.2299)))
    return SimulatorConfig(home=HOME, fence=fence, mission=mission, parameters={"FENCE_ENABLE": 1.0})


pytestmark = pytest.mark.usefixtures("state_folder")


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_plans_without_writing(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        before = simulator.vehicle.mission
        result = run(
            "plan", "--connect", simulator.connection, "--target", TARGET, "--clearance", "2", "--json"
        )
        assert simulator.vehicle.mission == before
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (document["uploaded"], document["verified"]) == (False, False)
    assert document["fence"]["exclusion_polygons"] == 2
    assert document["system"] == 1


def test_an_extrapolated_plan_is_uploaded_only_where_the_model_is_trusted(config):
    config = replace(config, parameters={**config.parameters, "OA_TYPE": 2.0})
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        before = simulator.vehicle.mission
        plan = ("plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--json")
        refused = run(*plan)
        assert simulator.vehicle.mission == before
        trusted = run(*plan, "--trust-model")
        assert simulator.vehicle.mission != before
    document = json.loads(refused.stdout)
    assert refused.exit_code == document["exit_code"] == 4
    assert document["error"] == "ExtrapolatedError"
    assert document["message"].startswith("not uploaded: the drive is extrapolated beyond what was measured")
    assert "--trust-model" in document["advice"]
    assert trusted.exit_code == 0
    assert json.loads(trusted.stdout)["verified"]


def test_uploads_and_verifies(config, state_folder):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        old = simulator.vehicle.mission
        result = run("plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--json")
        held = simulator.vehicle.mission
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (document["uploaded"], document["verified"]) == (True, True)
    assert [list(item.position) for item in held[1:]] == document["path"][1:]
    assert len(held) == document["mission_items"]
    backups = list(state_folder.rglob("*mission*.json"))
    assert len(backups) == 1
    stored = json.loads(backups[0].read_text())["items"]
    assert len(stored) == len(old)


def test_a_vehicle_armed_in_auto_is_left_alone(config):
    far = replace(config, mission=tuple(waypoint(LatLon(40.0722, -105.2300 + 0.0002 * i)) for i in range(4)))
    with Simulator(far, "tcpin:127.0.0.1:0") as simulator:
        before = simulator.vehicle.mission
        _command(simulator, Command.COMPONENT_ARM_DISARM, 1.0)
        _command(simulator, Command.DO_SET_MODE, 1.0, Mode.AUTO)
        result = run("plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--json")
        assert simulator.vehicle.mission == before
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (6, "RefusedError")
    assert "AUTO" in document["message"]


def test_udp_both_ways_round(config):
    with Simulator(config, "udpin:127.0.0.1:0") as simulator:
        result = run("plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--json")
    assert json.loads(result.stdout)["verified"] is True


def test_an_identity_that_is_taken_is_refused(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        identity = ["--source-system", "1", "--source-component", "1"]
        result = run("plan", "--connect", simulator.connection, "--target", TARGET, *identity, "--json")
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (5, "IdentityTakenError")


def test_nobody_there():
    result = run("plan", "--connect", "tcp:127.0.0.1:9", "--target", TARGET, "--json")
    assert (result.exit_code, json.loads(result.stdout)["error"]) == (5, "LinkError")


def test_nobody_speaks():
    result = run("plan", "--connect", "udpin:127.0.0.1:0", "--target", TARGET, "--timeout", "0.3", "--json")
    assert (result.exit_code, json.loads(result.stdout)["error"]) == (5, "VehicleNotFoundError")


def test_drives_only_a_vehicle_that_is_armed(config):
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        result = run(
            "plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--drive", "--json"
        )
        assert simulator.vehicle.mode != Mode.AUTO
        assert not simulator.vehicle.is_armed
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (7, "OutcomeError")
    assert "not armed" in document["message"]


def driven(simulator: Simulator, *options: str):
    simulator.vehicle.rover.is_armed = True
    plan = ("plan", "--connect", simulator.connection, "--target", TARGET, "--clearance", "2")
    return run(*plan, "--upload", "--drive", *options)


def test_a_drive_ends_with_what_it_was_like(config, tmp_path):
    fast = replace(config, parameters={**config.parameters, "WP_SPEED": 4.0})
    with Simulator(fast, "tcpin:127.0.0.1:0", speedup=10) as simulator:
        result = driven(simulator, "--json", "-o", str(tmp_path / "m.plan"))
        vehicle = simulator.vehicle
        assert (vehicle.mode, vehicle.is_armed, vehicle.breaches) == (Mode.HOLD, True, 0)
        again = run("plan", "--connect", simulator.connection, "--target", "40.07125,-105.2292", "--upload", "--json")  # fmt: skip
    document = json.loads(result.stdout)
    assert result.exit_code == 0, result.output
    assert (document["arrived"], document["verified"]) == (True, True)
    drive = document["drive"]
    assert set(drive) == {"driven_m", "took_s", "least_clearance_m", "breaches"}
    assert drive["driven_m"] == pytest.approx(document["length_m"], rel=0.1)
    assert drive["least_clearance_m"] >= document["clearance_m"] - 0.1
    assert drive["breaches"] == 0
    assert "info: HOLD does not brake: from 4 m/s the vehicle rolls on" in result.stderr, "before it drives"
    assert json.loads(again.stdout)["verified"] is True, "it waits in HOLD for the next one"


def test_a_mission_with_its_ways_home_inside_is_uploaded_and_driven_to_its_end(config):
    fast = replace(config, parameters={**config.parameters, "WP_SPEED": 4.0})
    with Simulator(fast, "tcpin:127.0.0.1:0", speedup=10) as simulator:
        result = driven(simulator, "--way-home-inside", "--json")
        vehicle = simulator.vehicle
        assert (vehicle.mode, vehicle.breaches) == (Mode.HOLD, 0)
        assert distance_m(vehicle.position, parse_lat_lon(TARGET)) < 3
    document = json.loads(result.stdout)
    assert (document["arrived"], document["verified"]) == (True, True)
    assert all(way["from_item"] < way["item"] for way in document["way_home_inside"])


def test_people_see_the_plan_before_anything_is_written(config, tmp_path, monkeypatch):
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload

    shown = tmp_path / "m.plan"
    is_shown: list[bool] = []
    start = VerifiedUpload._start_pushing

    def noted(self, *arguments):
        is_shown.append(shown.exists())
        start(self, *arguments)

    monkeypatch.setattr(VerifiedUpload, "_start_pushing", noted)
    with Simulator(config, "tcpin:127.0.0.1:0", speedup=10) as simulator:
        result = driven(simulator, "-o", str(shown))
    assert result.exit_code == 0, result.output
    assert is_shown
    assert all(is_shown)
    lines = [line.split(" ")[0] for line in result.stdout.splitlines()]
    assert lines == ["Route:", "Fence", "Wrote", "Uploaded", "The", "Arrived"]
    assert re.search(r"Arrived after [0-9.]+ m in \d+ s; least clearance [0-9.]+ m while driving, fence breaches: 0", result.stdout)  # fmt: skip


def test_hold_stops_it_first(config):
    far = replace(config, mission=tuple(waypoint(LatLon(40.0722, -105.2300 + 0.0002 * i)) for i in range(4)))
    with Simulator(far, "tcpin:127.0.0.1:0") as simulator:
        _command(simulator, Command.COMPONENT_ARM_DISARM, 1.0)
        _command(simulator, Command.DO_SET_MODE, 1.0, Mode.AUTO)
        plan = ("plan", "--connect", simulator.connection, "--target", TARGET, "--upload", "--json")
        refused = json.loads(run(*plan).stdout)
        assert (refused["exit_code"], refused["advice"]) == (6, "add --hold to switch it to HOLD first")
        assert json.loads(run(*plan, "--hold").stdout)["verified"] is True
        assert (simulator.vehicle.mode, simulator.vehicle.is_armed) == (Mode.HOLD, True)


def test_sim_says_where_it_listens_and_ends_when_asked(fields):
    arguments = ["sim", "--listen", "tcpin:127.0.0.1:0", "--fence", str(fields / "maze-fence.waypoints")]
    with subprocess.Popen(
        [sys.executable, "-m", "mavlink_bridge.cli", *arguments],
        stdout=subprocess.PIPE,
        text=True,
        **processes.APART,
    ) as process:
        try:
            line = process.stdout.readline()
            assert re.fullmatch(r"tcp:127\.0\.0\.1:\d+\n", line)
            goal = "40.0726316,-105.2290497"
            result = run(
                "plan", "--connect", line.strip(), "--target", goal, "--clearance", "2", "--upload", "--json"
            )
            assert json.loads(result.stdout)["verified"] is True
        finally:
            processes.end(process)
        assert process.wait(60) == 0


def test_demo_arrives_without_a_breach_and_its_log_can_be_planned_from(tmp_path):
    begun_s = time.process_time()  # of this process: how busy the machine is does not count
    result = run("demo", "--out", str(tmp_path / "out"), "--speedup", "10", "--json", "--firmware", "4.5")
    assert time.process_time() - begun_s < 60
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (document["arrived"], document["verified"], document["breaches"]) == (True, True, 0)
    assert document["driven_clearance_m"] >= document["clearance_m"]
    assert document["time_s"] > 0
    names = {"plan.png", "mission.waypoints", "mission.plan", "demo.tlog"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    assert (tmp_path / "out" / "plan.png").read_bytes().startswith(b"\x89PNG")
    mission = read_situation(tmp_path / "out" / "mission.plan")
    assert mission.mission.value.items[-1].position == LatLon(40.0726316, -105.2290497)
    assert len(mission.fence.value.zones) == 9
    assert str(situation_from_log(tmp_path / "out" / "demo.tlog").firmware).startswith("4.5")
    start, log = f"{HOME.lat_deg},{HOME.lon_deg}", tmp_path / "out" / "demo.tlog"
    result = run("plan", "--log", str(log), "--start", start, "--clearance", "2", "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert document["fence"]["exclusion_circles"] == 2
    assert distance_m(LatLon(*document["targets"][0]), LatLon(40.0726316, -105.2290497)) < 0.01


def _command(simulator: Simulator, number: Command, *params: float) -> None:
    from mavlink_bridge.link import open_link
    from mavlink_bridge.protocol.command import SendCommand
    from mavlink_bridge.protocol.peer import Peer

    named = {f"param{index}": value for index, value in enumerate(params, start=1)}
    with open_link(simulator.connection, (255, 190)) as link:
        machine = SendCommand(Peer(1, 1, 255, 190), CommandLong(1, 1, number, **named))
        link.run(machine, timeout_s=10)
        assert machine.outcome.is_accepted
