"""``pbpp rally``, and ways home inside a mission on the command line."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.checking.home_part import drive_end
from missions.fence import fence_to_items
from missions.formats import (
    read_fence,
    read_mission,
    read_parameters,
    read_situation,
    write_situation,
)
from missions.geo import LatLon, distance_m
from missions.items import waypoint

HOME = LatLon(40.071374, -105.229930)
TARGET = "40.07209265,-105.22861524"
KNOWN = ("--firmware", "4.6")
ROUND_THE_BARN = ("--start", f"{HOME}", "--home", f"{HOME}", "--target", TARGET, "--clearance", "2", *KNOWN)

pytestmark = pytest.mark.usefixtures("state_folder")


def run(*arguments, code=0):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def planned(fields, tmp_path_factory):
    """What `mission` is a copy of."""
    path = tmp_path_factory.mktemp("planned") / "mission.plan"
    run("plan", "--fence", fields / "yard-fence.waypoints", *ROUND_THE_BARN, "-o", path)
    return path


@pytest.fixture
def mission(planned, tmp_path):
    """A mission round the barn, with its fence."""
    return Path(shutil.copy(planned, tmp_path / "mission.plan"))


def test_points_are_chosen_written_drawn_and_told(mission, tmp_path):
    plan, list_file, parameters, picture = (
        tmp_path / name for name in ("r.plan", "r.waypoints", "r.param", "r.png")
    )
    outputs = ("-o", plan, "-o", list_file, "-o", parameters, "--plot", picture)
    result = run("rally", "--mission", mission, "--clearance", "2", *outputs, *KNOWN)
    assert "RTL's straight lines from the whole route keep 2.00 m while driving" in result.output
    assert "The rally points are valid only with RALLY_INCL_HOME 0, RALLY_LIMIT_KM 0" in result.output
    assert "FS_ACTION 1: RTL on a failsafe" in result.output
    together = read_situation(plan)
    assert together.mission is not None
    assert together.fence is not None
    points = [point.position for point in together.rally.value]
    assert points
    assert [point.position for point in read_situation(list_file).rally.value] == points
    assert read_parameters(parameters) == {"RALLY_INCL_HOME": 0.0, "RALLY_LIMIT_KM": 0.0}
    assert picture.stat().st_size > 10_000
    # With these RTL crosses nothing; before, it does.
    checked = [
        run("check", "--mission", plan, "--vehicle", parameters, "--clearance", "2", *KNOWN).output,
        run("check", "--mission", mission, "--clearance", "2", *KNOWN).output,
    ]
    assert ["RTL drives straight" in text for text in checked] == [False, True]


def test_the_document_says_what_holds(mission, tmp_path):
    vehicle = tmp_path / "v.parm"
    vehicle.write_text("RTL_SPEED 5\nOA_TYPE 1\nFS_ACTION 2\nFS_GCS_ENABLE 1\n")
    found = json.loads(
        run("rally", "--mission", mission, "--clearance", "2", "--vehicle", vehicle, "--json", *KNOWN).stdout
    )
    assert (found["status"], found["command"], found["uploaded"], found["verified"]) == (
        "ok",
        "rally",
        False,
        False,
    )
    assert found["clearance_m"] == found["asked_m"] == 2.0
    assert found["line_keeps_m"] > 2.0
    assert found["left_out_m"] == 0.0
    assert found["parameters"] == {"RALLY_INCL_HOME": 0.0, "RALLY_LIMIT_KM": 0.0}
    failsafes = {one["parameter"]: (one["advised"], one["now"]) for one in found["failsafes"]}
    assert failsafes["FS_ACTION"] == (1.0, 2.0)
    assert failsafes["BATT_FS_LOW_ACT"] == (1.0, None)
    assert failsafes["OA_TYPE"] == (0.0, 1.0)
    assert any("RTL_SPEED 5 is faster than the 2 m/s" in text for text in found["warnings"])
    assert any("OA_TYPE 1" in text for text in found["warnings"])
    told = run("rally", "--mission", mission, "--clearance", "2", "--vehicle", vehicle, *KNOWN).output
    assert "FS_ACTION 1 (now 2): RTL" in told
    assert "FS_GCS_ENABLE 1 (as it is)" in told


def test_where_nothing_is_found_it_ends_so(mission, fields, tmp_path):
    # 9 m is more than the route keeps anywhere near the barn, but each line keeps what the route itself keeps: only the walls' far side is lost.
    drawn = fields / "yard-mission.waypoints"
    result = run(
        "rally",
        "--mission",
        drawn,
        "--fence",
        fields / "yard-fence.waypoints",
        "--clearance",
        "2",
        "--start",
        f"{HOME}",
        *KNOWN,
    )
    assert "m of the route lie outside the allowed area" in result.output
    assert "the mission itself does not pass the check" in result.output
    narrow = tmp_path / "narrow.fen"
    narrow.write_text("40.07130 -105.22993\n" + "".join(f"{lat} {lon}\n" for lat, lon in (
        (40.07128, -105.2301), (40.07128, -105.2280), (40.07132, -105.2280), (40.07132, -105.2301), (40.07128, -105.2301)
    )))  # fmt: skip
    lane = tmp_path / "lane.waypoints"
    run(
        "plan",
        "--fence",
        narrow,
        "--start",
        "40.0713,-105.22995",
        "--home",
        "40.0713,-105.22995",
        "--target",
        "40.0713,-105.2282",
        "--clearance",
        "1",
        "-o",
        lane,
        *KNOWN,
    )
    options = ("--mission", lane, "--fence", narrow, "--clearance", "2", *KNOWN)
    document = json.loads(run("rally", *options, "--json", code=4).stdout)
    assert document["error"] == "NoRouteError"
    assert "no set of at most 10 rally points" in document["message"]
    less = run("rally", *options, "--accept-less")
    assert "no set of rally points was found with which the lines keep 2.00 m; these keep" in less.output


def test_wrong_usage(mission, tmp_path):
    assert "give a mission" in run("rally", code=2).output
    assert "--upload needs a live link" in run("rally", "--mission", mission, "--upload", code=2).output
    assert "contains no rally" in run("rally", "--mission", mission, "-o", tmp_path / "x.gpx", code=3).output
    assert (
        "--end loiter"
        in run("plan", "--fence", mission, "--way-home-inside", "--end", "loiter", code=2).output
    )
    assert (
        "--way-home-inside"
        in run("plan", "--fence", mission, "--via-mission", "own", "--way-home-inside", code=2).output
    )


def test_points_and_parameters_are_uploaded_and_verified(mission, fields):
    held = read_mission(mission)
    config = SimulatorConfig(
        home=HOME,
        mission=held.items,
        fence=tuple(fence_to_items(read_fence(fields / "yard-fence.waypoints"))),
    )
    with Simulator(config, "tcpin:127.0.0.1:0", speedup=5.0) as rover:
        command = (
            "rally",
            "--connect",
            rover.connection,
            "--system",
            "1",
            "--timeout",
            "10",
            "--clearance",
            "2.5",
            "--upload",
            "--json",
        )
        document = json.loads(run(*command).stdout)
        points = [LatLon(*place) for place in document["points"]]
        assert document["verified"] is True
        assert all(
            distance_m(item.position, place) < 0.02
            for item, place in zip(rover.vehicle.rally, points, strict=True)
        )
        assert [rover.vehicle.parameters[name] for name in ("RALLY_INCL_HOME", "RALLY_LIMIT_KM")] == [
            0.0,
            0.0,
        ]


def test_ways_home_inside_are_written_told_and_checked(fields, tmp_path):
    path, picture = tmp_path / "inside.plan", tmp_path / "inside.png"
    fence = fields / "yard-fence.waypoints"
    asked = (
        "--fence",
        fence,
        *ROUND_THE_BARN,
    )
    document = json.loads(
        run(
            "plan",
            *asked,
            "--way-home-inside",
            "--place",
            "gate=40.0713,-105.2286",
            "-o",
            path,
            "--plot",
            picture,
            "--json",
        ).stdout
    )
    told = run("plan", *asked, "--way-home-inside", "-o", tmp_path / "told.plan")
    items = read_mission(tmp_path / "told.plan").items
    driven = sum(item.is_placed for item in items[: drive_end(items)])
    assert f", {driven} waypoints (" in told.output  # not those of the ways home
    (*_, last) = document["way_home_inside"]
    assert last["from_item"] < last["item"]
    assert distance_m(LatLon(*last["to"]), LatLon(40.0713, -105.2286)) < 0.02
    checked = run("check", "--mission", path, "--clearance", "2", *KNOWN)
    assert f"(choose item {last['item']})" in checked.output
    assert "PASS: every leg and way home keeps 2 m while driving" in checked.output
    found = json.loads(run("check", "--mission", path, "--clearance", "2", "--json", *KNOWN).stdout)
    assert [way["trouble"] for way in found["way_home_inside"]] == [None] * len(document["way_home_inside"])
    spoilt = read_situation(path)
    items = list(spoilt.mission.value.items)
    for index in range(last["item"] - 1, len(items)):
        items[index] = waypoint(HOME) if items[index].is_placed else items[index]
    known = replace(spoilt.mission, value=replace(spoilt.mission.value, items=tuple(items)))
    write_situation(replace(spoilt, mission=known), tmp_path / "spoilt.plan")
    broken = run("check", "--mission", tmp_path / "spoilt.plan", "--clearance", "2", *KNOWN, code=8)
    assert "FAIL: the way home from the leg to item" in broken.output
    plain = json.loads(run("plan", *asked, "--json").stdout)
    assert plain["way_home_inside"] is None
