"""``pbpp sim``."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest
from pymavlink import mavutil
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.options.sim import SimOptions
from mavlink_bridge.cli.sim import _config
from mavlink_bridge.simulator.any_vehicle import vehicle_of
from mavlink_bridge.simulator.px4.vehicle import Px4Vehicle
from missions.firmware import read_firmware

FIRST_LINE_S = 20.0


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_it_runs_until_told_to_stop(stop, fields):
    command = [
        sys.executable,
        "-c",
        "from mavlink_bridge.cli import main; main()",
        "sim",
        "--listen=tcpin:127.0.0.1:0",
        "--home=40.0715,-105.2299,90",
        f"--fence={fields / 'maze-fence.waypoints'}",
        f"--mission={fields / 'yard-mission.waypoints'}",
        "--param=WP_SPEED=2",
        "--disc=40.0715,-105.22985,1,0.5,90",
        "--disc=40.0715,-105.2295,1",
        "--param=fence_enable=1",
        "--system=7",
    ]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ, text=True
    ) as run:
        try:
            connection = run.stdout.readline().strip()
            assert connection.startswith("tcp:127.0.0.1:")
            link = mavutil.mavlink_connection(connection, source_system=255, autoreconnect=False)
            beat = link.recv_match(type="HEARTBEAT", blocking=True, timeout=FIRST_LINE_S)
            assert beat.get_srcSystem() == 7
            counts = []
            for kind in (0, 1):
                link.mav.mission_request_list_send(7, 1, kind)
                counts.append(
                    link.recv_match(type="MISSION_COUNT", blocking=True, timeout=FIRST_LINE_S).count
                )
            assert counts == [3, 39]
            link.mav.param_request_read_send(7, 1, b"WP_SPEED", -1)
            assert link.recv_match(type="PARAM_VALUE", blocking=True, timeout=FIRST_LINE_S).param_value == 2.0
            position = link.recv_match(type="GLOBAL_POSITION_INT", blocking=True, timeout=FIRST_LINE_S)
            assert (position.lat, position.lon, position.hdg) == (400715000, -1052299000, 9000)
            seen = link.recv_match(type="OBSTACLE_DISTANCE", blocking=True, timeout=FIRST_LINE_S)
            assert (seen.frame, seen.increment, seen.max_distance) == (12, 5, 1500)
            assert min(seen.distances) < 1500
            link.close()
        finally:
            run.send_signal(stop)
            out, err = run.communicate(timeout=FIRST_LINE_S)
    assert (run.returncode, out, err) == (0, "", "")


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--home=91,0"], 2, "latitude"),
        (["--home=nowhere"], 2, "LAT,LON"),
        (["--home=40,-105,north"], 2, "heading"),
        (["--home=40,-105,999"], 2, "heading"),
        (["--param=WP_SPEED"], 2, "NAME=VALUE"),
        (["--param=WP_SPEED=fast"], 2, "NAME=VALUE"),
        (["--param=NO_SUCH=1"], 2, "NO_SUCH"),
        (["--listen=nonsense"], 2, "nonsense"),
        (["--fence=/nowhere.waypoints"], 3, "nowhere"),
        (["--loss=1.5"], 2, "loss"),
        (["--speedup=0"], 2, "speedup"),
        (["--system=0"], 2, "system"),
        (["--disc=40,-105"], 2, "LAT,LON,RADIUS"),
        (["--disc=91,-105,1"], 2, "latitude"),
        (["--disc=40,-105,1,2"], 2, "LAT,LON,RADIUS"),
        (["--disc=40,-105,0"], 2, "metres"),
        (["--disc=40,-105,1,2,north"], 2, "degrees"),
    ],
)
def test_wrong_options_are_told(options, code, said):
    result = CliRunner().invoke(app, ["sim", *options], env={"COLUMNS": "200", "NO_COLOR": "1"})
    assert result.exit_code == code
    assert said in result.output


def test_whose_rover_it_is(fields):
    options = SimOptions(
        autopilot="px4",
        firmware=read_firmware("1.17"),
        fence=fields / "maze-fence.waypoints",
        mission=fields / "yard-mission.waypoints",
        param=["gf_action=3"],
    )
    vehicle = vehicle_of(_config(options))
    assert isinstance(vehicle, Px4Vehicle)
    assert (vehicle.is_1_18, vehicle.parameters["GF_ACTION"]) == (False, 3.0)
    commands = [item.command for item in vehicle.fence]
    assert commands == sorted(commands)  # polygons before circles, whatever the file has
    assert {item.frame for item in vehicle.mission} <= {2, 5, 6}


def test_an_autopilot_that_is_not_simulated():
    result = CliRunner().invoke(app, ["sim", "--autopilot", "ardupilots"])
    assert result.exit_code == 2
    assert "expected one of ardupilot, px4" in " ".join(result.output.split())
