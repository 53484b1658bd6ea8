"""``pbpp check``, and ``pbpp plan`` with several targets and missions to repair."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import pairwise

import pytest
from shapely import LineString, Polygon
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.live import conduct
from mavlink_bridge.director import Orders
from mavlink_bridge.link import open_link
from mavlink_bridge.mavlink.messages import CommandLong
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.errors import SituationError
from missions.fence import Fence, PolygonZone, ZoneKind, fence_to_items
from missions.formats import read_fence, read_mission, read_situation, write_situation
from missions.geo import LatLon, distance_m
from missions.items import Command, CoordinateFrame, MissionItem, waypoint, with_home
from missions.request import Request
from missions.situation import Known, Mission, Situation

HOME = LatLon(40.071374, -105.229930)
TARGETS = ("40.07209265,-105.22861524", "40.0713,-105.2286", "40.0717,-105.2301")


pytestmark = pytest.mark.usefixtures("state_folder")


@pytest.fixture
def yard(fields):
    return {"mission": str(fields / "yard-mission.waypoints"), "fence": str(fields / "yard-fence.waypoints")}


def run(*arguments: str):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def document_of(*arguments: str, code: int = 0) -> dict:
    result = run(*arguments, "--json")
    assert result.exit_code == code, result.output
    return json.loads(result.stdout)


def check_yard(yard, *more: str, code: int = 8) -> dict:
    return document_of("check", "--mission", yard["mission"], "--fence", yard["fence"], *more, code=code)


def test_the_leg_through_the_barn_is_found(yard):
    document = check_yard(yard, "--clearance", "2")
    assert (document["status"], document["exit_code"], document["broken"]) == ("failed", 8, 1)
    first, second = document["legs"]
    assert (first["breaks"], second["breaks"]) == (False, True)
    assert second["crosses"] == ["exclusion polygon 1", "exclusion polygon 2"]
    assert (second["from_item"], second["to_item"]) == (1, 2)
    barn = read_fence(yard_path(yard)).zones[1]
    line = LineString([second["start"], second["end"]])
    entry = line.intersection(Polygon(barn.vertices)).coords[0]
    assert second["at"] == pytest.approx(entry, abs=1e-6)
    assert document["mission_items"] == 3
    assert any("RTL" in warning for warning in document["warnings"])


def yard_path(yard):
    from pathlib import Path

    return Path(yard["fence"])


def test_a_person_sees_a_table(yard):
    result = run("check", "--mission", yard["mission"], "--fence", yard["fence"], "--clearance", "2")
    assert result.exit_code == 8
    assert re.search(r"start → 1 +10\.3 m", result.stdout)
    assert re.search(r"1 → 2 +134\.3 m +\d+ s +crosses +crosses", result.stdout)
    assert (
        "FAIL: leg 1 → 2 crosses exclusion polygon 1, exclusion polygon 2, first at 40.07156" in result.stdout
    )
    fails = [line for line in result.stdout.splitlines() if line.startswith("FAIL: ")]
    for quiet in ("-q", "-qq"):  # what fails is an error
        words = ("--mission", yard["mission"], "--fence", yard["fence"], "--clearance", "2", quiet)
        assert run("check", *words).stdout.splitlines() == fails


def test_the_table_fits_80_columns(yard, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    files = ("--mission", yard["mission"], "--fence", yard["fence"])
    told = run("check", *files).stdout.splitlines()
    heads = next(number for number, line in enumerate(told) if line.startswith("leg "))
    ends = next(number for number, line in enumerate(told) if re.match(r"\d+ legs, ", line))
    table = told[heads:ends]
    rows = [line for line in table if re.search(r" 40\.\d{7},-105\.\d{7} *$", line)]
    assert len(rows) == len(document_of("check", *files, code=8)["legs"])
    assert max(map(len, table)) <= 80


def test_a_leg_that_is_only_near_says_how_near(tmp_path, yard):
    made = tmp_path / "made.plan"
    options = ("--start", f"{HOME}", "--target", TARGETS[0], "--clearance", "2")
    planned = document_of("plan", "--fence", yard["fence"], *options, "-o", made)
    result = run("check", "--mission", made, "--clearance", "3")
    assert result.exit_code == 8
    said = re.search(
        r"FAIL: leg . → . comes within (\d\.\d\d) m of exclusion polygon \d while driving", result.stdout
    )
    assert 2 <= float(said[1]) < 3
    worst = min(float(near) for near in re.findall(r"comes within (\d\.\d\d) m of", result.stdout))
    assert worst == pytest.approx(planned["driven_clearance_m"], abs=0.01)


def test_what_was_planned_passes(tmp_path, yard):
    made = tmp_path / "made.plan"
    options = ("--start", f"{HOME}", "--target", TARGETS[0], "--clearance", "2")
    planned = document_of("plan", "--fence", yard["fence"], *options, "-o", made)
    document = document_of("check", "--mission", made, "--clearance", "2")
    assert document["broken"] == 0
    assert document["driven_clearance_m"] == pytest.approx(planned["driven_clearance_m"], abs=0.01)
    assert document["length_m"] == pytest.approx(planned["length_m"], abs=0.01)
    assert (
        "PASS: every leg keeps 2 m while driving"
        in run("check", "--mission", made, "--clearance", "2").stdout
    )


def test_ways_home_and_what_has_none(tmp_path, fields, yard):
    shed, far = "shed=40.0720,-105.2290", "far=40.0800,-105.2299"
    more = ("--clearance", "0.5", "--place", shed, "--place", far, "--plot", str(tmp_path / "ways.svg"))
    document = check_yard(yard, *more)
    ways = document["ways_home"]
    assert [place["name"] for place in ways["places"]] == ["home", "shed", "far"]
    assert [way["to"] for way in ways["from"]] == ["home", "home", "shed"]
    assert [way["item"] for way in ways["from"]] == [0, 1, 2]
    for way in ways["from"]:
        whole_m = sum(distance_m(LatLon(*a), LatLon(*b)) for a, b in pairwise(way["path"]))
        assert whole_m == pytest.approx(way["length_m"], abs=0.01)
    assert ways["without_m"] == 0
    reason = "it is outside inclusion polygon 1"
    assert ways["places"][2]["blocked"] == reason
    assert f"no way home leads to far: {reason}" in document["warnings"]
    assert "way home" in (tmp_path / "ways.svg").read_text()
    options = ("--fence", str(fields / "yard-fence.waypoints"), "--start", TARGETS[0], "--target", TARGETS[1])
    asked = (*options, "--home", "40.0800,-105.2299")
    planned = document_of("plan", *asked, "--clearance", "0.5")["ways_home"]
    assert {way["to"] for way in planned["from"]} == {None}
    assert planned["without_m"] > 50
    told = run("plan", *asked, "--clearance", "0.5", "--place", shed).stdout
    assert re.search(r"Way home from the target: [\d.]+ m to shed, about \d+ s", told)
    assert document_of("plan", *options, "--clearance", "0.5")["ways_home"] is None


@pytest.mark.parametrize("place", ["shed", "=40,-105", "home=40,-105", "Rally point 1=40,-105", "shed=40"])
def test_places_are_named_once_and_well(yard, place):
    assert "--place" in check_yard(yard, "--place", place, code=2)["message"]


def test_the_recorded_log_tells_it_all(logs):
    document = document_of("check", "--log", logs / "mission-yard.tlog", code=8)
    assert document["system"] == 1
    assert [leg["breaks"] for leg in document["legs"]] == [False, True]
    assert not any("not known of the vehicle" in warning for warning in document["warnings"])


def test_files_come_before_the_log(logs, fields, yard):
    log = logs / "mission-yard.tlog"
    other = document_of("check", "--log", log, "--fence", fields / "maze-fence.waypoints", code=8)
    assert other["legs"] != document_of("check", "--log", log, code=8)["legs"]
    start = document_of(
        "check", "--log", log, "--mission", yard["mission"], "--start", "40.0713,-105.2300", code=8
    )
    assert start["legs"][0]["start"] == [40.0713, -105.23]


@pytest.mark.parametrize("streams", [True, False])
def test_a_live_vehicle_is_asked(fields, yard, streams):
    mission = read_mission(fields / "yard-mission.waypoints")
    config = SimulatorConfig(
        home=HOME,
        fence=fence_to_items(read_fence(fields / "yard-fence.waypoints")),
        mission=with_home(mission.items, HOME),
        parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0},
        streams=streams,
    )
    away = LatLon(40.0713, -105.2301)
    with Simulator(replace(config, home=away), "tcpin:127.0.0.1:0") as simulator:
        held = simulator.vehicle.mission
        document = document_of("check", "--connect", simulator.connection, "--clearance", "2", code=8)
        assert simulator.vehicle.mission == held
        assert document["legs"][-1]["crosses"] == ["exclusion polygon 1", "exclusion polygon 2"]
        # The fix is good to 0.3 m: kept on top of what is promised, it is more than FENCE_MARGIN and its reserve ask for.
        assert document["clearance_m"] == 2
        assert document["legs"][-1]["asked_m"] == pytest.approx(2.3)
        assert any("added 0.3 m for GPS error" in text for text in document["info"])
        assert document["system"] == 1
        assert document["legs"][0]["start"] == pytest.approx(away, abs=1e-5)
        assert not any("no position from the vehicle" in text for text in document["warnings"])


def test_what_a_live_vehicle_does_not_tell_is_said(fields, yard, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.cli.check_on_link._TELEMETRY_PATIENCE_S", 0.5)
    config = SimulatorConfig(
        home=HOME,
        fence=fence_to_items(read_fence(fields / "yard-fence.waypoints")),
        mission=with_home(read_mission(fields / "yard-mission.waypoints").items, HOME),
        parameters={"FENCE_ENABLE": 1.0},
        streams=False,
    )
    monkeypatch.setattr("mavlink_bridge.director.learning.stream_requests", lambda _peer: [])
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        document = document_of("check", "--connect", simulator.connection, "--clearance", "2", code=8)
        assert "no position from the vehicle; assuming it stands at home" in document["warnings"]
        assert any("GPS accuracy unknown" in text for text in document["warnings"])
        assert document["clearance_m"] == pytest.approx(2.1)  # FENCE_MARGIN and a reserve
        monkeypatch.setattr("mavlink_bridge.protocol.parameters.PATIENCE_S", 0.5)
        monkeypatch.setattr(
            "mavlink_bridge.protocol.parameters.ReadParameters.receive", lambda *_arguments: None
        )
        silent = document_of("check", "--connect", simulator.connection, code=5)
        assert "did not answer the parameter request" in silent["message"]


def test_pictures(tmp_path, yard):
    picture = tmp_path / "check.svg"
    document = check_yard(yard, "--plot", str(picture))
    assert document["outputs"] == [str(picture)]
    assert "1 of 2 legs does not keep" in picture.read_text()
    sketch = run("check", "--mission", yard["mission"], "--fence", yard["fence"], "--plot", "-")
    assert len(sketch.stdout.splitlines()) > 20


def test_the_vehicle_file_counts(tmp_path, yard):
    slow, fast = tmp_path / "slow.parm", tmp_path / "fast.parm"
    slow.write_text("WP_SPEED 1\nWP_RADIUS 1\n")
    fast.write_text("WP_SPEED 5\nWP_RADIUS 3\n")
    times_s = [check_yard(yard, "--vehicle", str(file))["duration_s"] for file in (slow, fast)]
    assert times_s[0] > 3 * times_s[1]


def test_missions_of_others(tmp_path, yard):
    # Mission Planner's home line has command 0; the commands of others are kept or named.
    rows = [
        "QGC WPL 110",
        "0\t1\t0\t0\t0\t0\t0\t0\t40.071374\t-105.229930\t1600\t1",
        "1\t0\t3\t16\t0\t0\t0\t0\t40.0714\t-105.2300\t0\t1",
        "2\t0\t3\t82\t0\t0\t0\t0\t40.0714\t-105.2301\t0\t1",
        "3\t0\t3\t178\t1\t1.5\t0\t0\t0\t0\t0\t1",
        "4\t0\t3\t177\t1\t2\t0\t0\t0\t0\t0\t1",
    ]
    file = tmp_path / "other.waypoints"
    file.write_text("\n".join(rows) + "\n")
    document = document_of("check", "--mission", file, "--fence", yard["fence"], code=8)
    assert document["broken"] == 0
    assert "item 2 is command 82" in document["not_understood"][0]
    assert "not understood: item 2" in run("check", "--mission", file, "--fence", yard["fence"]).stdout


def test_wrong_usage(tmp_path, yard, logs):
    log = str(logs / "mission-yard.tlog")
    assert run("check").exit_code == 2
    assert run("check", "--log", log, "--connect", "udpin:127.0.0.1:1").exit_code == 2
    assert run("check", "--mission", yard["mission"], "--plot", "-", "--json").exit_code == 2
    assert run("check", "--mission", yard["mission"], "--plot", "picture.doc").exit_code == 3
    assert run("check", "--mission", yard["mission"]).exit_code == 3  # no fence
    assert run("check", "--mission", yard["fence"], "--fence", yard["fence"]).exit_code == 3
    assert run("check", "--mission", yard["mission"], "--fence", yard["mission"]).exit_code == 3
    assert run("check", "--log", str(logs / "no-fence.tlog")).exit_code in (2, 3)


def test_too_many_items_are_said(tmp_path, yard):
    mission = read_mission(yard_path({"fence": yard["mission"]}))
    file = tmp_path / "long.plan"
    write_situation(Situation(mission=Known(Mission(mission.items[:1] * 700, HOME), None, "test")), file)
    document = document_of("check", "--mission", file, "--fence", yard["fence"])
    assert "701 mission items with home; the vehicle holds 655" in document["warnings"]


def test_the_best_order_and_the_way_home(tmp_path, yard):
    targets = [option for target in TARGETS for option in ("--target", target)]
    given = document_of("plan", "--fence", yard["fence"], "--start", f"{HOME}", *targets, "--clearance", "2")
    made = tmp_path / "tour.waypoints"
    options = ("--order", "best", "--return", "-o", made)
    best = document_of(
        "plan", "--fence", yard["fence"], "--start", f"{HOME}", *targets, "--clearance", "2", *options
    )
    assert sorted(best["targets"][:3]) == sorted(given["targets"])
    assert best["targets"][3] == best["path"][-1] == [HOME.lat_deg, HOME.lon_deg]
    assert best["info"][0].startswith("targets reordered: ")
    assert (
        document_of("check", "--mission", made, "--fence", yard["fence"], "--clearance", "2")["broken"] == 0
    )


@pytest.mark.parametrize(
    ("end", "command"), [("loiter", Command.NAV_LOITER_UNLIM), ("hold", Command.NAV_WAYPOINT)]
)
def test_ends(tmp_path, yard, end, command):
    made = tmp_path / "made.plan"
    options = ("--start", f"{HOME}", "--target", TARGETS[0], "--clearance", "2", "--end", end)
    document_of("plan", "--fence", yard["fence"], *options, "-o", made)
    assert read_mission(made).items[-1].command == command


def test_rtl_needs_a_free_line_home(tmp_path, fields, yard):
    file = tmp_path / "yard.plan"
    fence = read_situation(fields / "yard-fence.waypoints").fence
    write_situation(Situation(fence=fence, mission=Known(Mission((), HOME), None, "test")), file)
    options = ("--target", TARGETS[0], "--clearance", "2", "--end", "rtl")
    refused = document_of("plan", "--fence", file, *options, code=4)
    assert refused["error"] == "NoRouteError"
    assert "--return" in refused["message"]
    made = tmp_path / "made.waypoints"
    document_of("plan", "--fence", file, *options, "--return", "-o", made)
    assert read_mission(made).items[-1].command == Command.NAV_RETURN_TO_LAUNCH
    assert document_of("check", "--mission", made, "--fence", file, "--clearance", "2")["broken"] == 0


def test_a_mission_is_repaired(tmp_path, yard):
    made = tmp_path / "repaired.waypoints"
    document = document_of(
        "plan", "--fence", yard["fence"], "--via-mission", yard["mission"], "--clearance", "2", "-o", made
    )
    assert document["info"][0].startswith("leg 1 → 2: replaced by a route")
    old, new = read_mission(yard_path({"fence": yard["mission"]})), read_mission(made)
    assert (new.items[0].position, new.items[-1].position) == (old.items[0].position, old.items[-1].position)
    assert new.home == old.home
    assert document["mission_items"] == len(new.items) + 1
    assert (
        document_of("check", "--mission", made, "--fence", yard["fence"], "--clearance", "2")["broken"] == 0
    )


def test_a_mission_is_repaired_on_the_vehicle(fields, yard):
    config = SimulatorConfig(home=HOME, fence=fence_to_items(read_fence(fields / "yard-fence.waypoints")))
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        via = ("--via-mission", yard["mission"], "--clearance", "2.2", "--upload")
        document = document_of("plan", "--connect", simulator.connection, *via)
        assert (document["uploaded"], document["verified"]) == (True, True)
        assert len(simulator.vehicle.mission) == document["mission_items"]
        checked = document_of("check", "--connect", simulator.connection, "--clearance", "2.2")
        assert checked["broken"] == 0
        assert checked["mission_items"] == document["mission_items"]


def armed(simulator: Simulator) -> None:
    with open_link(simulator.connection, (255, 190)) as link:
        arm = SendCommand(Peer(1, 1, 255, 190), CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
        link.run(arm, timeout_s=10)
        assert arm.outcome.is_accepted


def held_by(fields, *items) -> SimulatorConfig:
    return SimulatorConfig(
        home=HOME,
        fence=fence_to_items(read_fence(fields / "yard-fence.waypoints")),
        mission=items,
        parameters={"FENCE_ENABLE": 1.0},
    )


def test_a_repaired_mission_is_driven_only_by_a_vehicle_that_is_armed(fields):
    first, last = read_mission(fields / "yard-mission.waypoints").items
    with Simulator(held_by(fields, first, last), "tcpin:127.0.0.1:0") as simulator:
        options = ("--via-mission", "own", "--clearance", "2", "--upload", "--drive")
        document = document_of("plan", "--connect", simulator.connection, *options, code=7)
        assert "not armed" in document["message"]
        assert len(simulator.vehicle.mission) > 3


def test_a_fence_that_changes_on_the_way_stops_a_repaired_mission(tmp_path, fields):
    first, last = read_mission(fields / "yard-mission.waypoints").items
    fence = read_fence(fields / "yard-fence.waypoints")
    wall = (
        LatLon(40.0719, -105.2292),
        LatLon(40.0719, -105.2284),
        LatLon(40.0718, -105.2284),
        LatLon(40.0718, -105.2292),
    )
    changed = replace(fence, zones=(*fence.zones, PolygonZone(ZoneKind.EXCLUSION, wall)))
    file = tmp_path / "changed.plan"
    write_situation(Situation(fence=Known(changed, None, "test")), file)
    is_changed = False

    def meddle(frames) -> None:
        nonlocal is_changed
        is_on_its_way = any(getattr(frame.message, "seq", 0) == 2 for frame in frames)
        if is_on_its_way and not is_changed and simulator.vehicle.mode == Mode.AUTO:
            is_changed = True
            told = run(
                "upload",
                file,
                "--connect",
                simulator.connection,
                "--replace-active",
                "--source-system",
                "255",
            )
            assert told.exit_code == 0, told.output

    with Simulator(held_by(fields, first, last), "tcpin:127.0.0.1:0") as simulator:
        armed(simulator)
        request = Request(clearance_m=2.0, via_own=True)
        orders = Orders(
            identity=(245, 190), request=request, upload=True, drive=True, target_sources=frozenset()
        )
        with (
            open_link(simulator.connection) as link,
            pytest.raises(SituationError, match="not restarted"),
        ):
            conduct(link, orders, quiet=True, on_frames=meddle)
        assert is_changed
        assert simulator.vehicle.mode == Mode.HOLD


@pytest.mark.parametrize(
    ("item", "word"),
    [
        (MissionItem(Command.DO_JUMP, CoordinateFrame.MISSION, (1.0, -1.0, 0.0, 0.0)), "repeats forever"),
        (MissionItem(Command.DO_SET_REVERSE, CoordinateFrame.MISSION, (1.0, 0.0, 0.0, 0.0)), "in reverse"),
    ],
)
def test_what_cannot_be_watched_is_not_driven(fields, item, word):
    first, last = read_mission(fields / "yard-mission.waypoints").items
    with Simulator(held_by(fields, first, last, item), "tcpin:127.0.0.1:0") as simulator:
        held = simulator.vehicle.mission
        options = ("--via-mission", "own", "--clearance", "2", "--upload", "--drive")
        document = document_of("plan", "--connect", simulator.connection, *options, code=3)
        assert word in document["message"]
        assert "nothing was written" in document["message"]
        assert simulator.vehicle.mission == held


def test_wrong_usage_of_tours(yard):
    base = ("plan", "--fence", yard["fence"], "--start", f"{HOME}")
    via = ("--via-mission", yard["mission"])
    assert run(*base, "--target", TARGETS[0], "--order", "random").exit_code == 2
    assert run(*base, "--target", TARGETS[0], "--end", "land").exit_code == 2
    assert run(*base, *via, "--target", TARGETS[0]).exit_code == 2
    assert run(*base, *via, "--return").exit_code == 2
    assert run(*base, *via, "--end", "rtl").exit_code == 2
    assert run(*base, *via, "--clearance", "max").exit_code == 2
    for more in (("--speed", "1"), ("--corner-allowance", "0"), ("--escape",)):
        assert run(*base, *via, *more).exit_code == 2
    assert run(*base, "--via-mission", "own").exit_code == 3  # the fence's file holds none
    assert run(*base, "--via-mission", "none.plan").exit_code == 3


UNION = "FENCE_ENABLE 1\nFENCE_TYPE 4\nFENCE_OPTIONS 2\nFENCE_MARGIN 2\nAVOID_ENABLE 3\n"


def test_a_seam_before_which_the_vehicle_stops_is_named_with_its_place(tmp_path):
    fence, mission, vehicle = (tmp_path / name for name in ("f.waypoints", "m.waypoints", "rover.parm"))
    lons = ((-105.2310, -105.2295), (-105.2297, -105.2280))
    zones = [
        PolygonZone(
            ZoneKind.INCLUSION,
            tuple(LatLon(*corner) for corner in ((40.07, a), (40.073, a), (40.073, b), (40.07, b))),
        )
        for a, b in lons
    ]
    write_situation(Situation(fence=Known(Fence(tuple(zones)), None, "test")), fence)
    items = (MissionItem(16, 3, lat_e7=400_713_740, lon_e7=-1_052_285_000),)
    write_situation(Situation(mission=Known(Mission(items, HOME), None, "test")), mission)
    vehicle.write_text(UNION, encoding="utf-8")
    asked = ("check", "--mission", mission, "--fence", fence, "--vehicle", vehicle)
    result = run(*asked)
    assert result.exit_code == 8
    assert re.search(
        r"FAIL: leg start → 1 crosses the inner edge of inclusion polygon 2: the vehicle stops at 40\.07137\d+,-105\.22970\d+",
        result.output,
    )
    assert "`pbpp fence merge FILE -o merged.plan`" in result.output
    assert "or set AVOID_ENABLE 2 (without bit 0)" in result.output
    document = document_of(*asked, code=8)
    assert document["legs"][0]["crosses"][0].startswith("the inner edge of inclusion polygon")
    vehicle.write_text(UNION.replace("AVOID_ENABLE 3", "AVOID_ENABLE 2"), encoding="utf-8")
    assert document_of(*asked)["broken"] == 0


def test_a_start_from_which_rovers_back_into_the_fence_is_a_danger(tmp_path):
    fence, mission, vehicle = (tmp_path / name for name in ("f.waypoints", "m.waypoints", "rover.parm"))
    corners = ((40.0713, -105.2305), (40.0733, -105.2305), (40.0733, -105.228), (40.0713, -105.228))
    zone = PolygonZone(ZoneKind.INCLUSION, tuple(LatLon(*corner) for corner in corners))
    write_situation(Situation(fence=Known(Fence((zone,)), None, "test")), fence)
    home = LatLon(40.07131, -105.2295)  # 1.1 m inside the southern edge
    items = (MissionItem(16, 3, lat_e7=400_722_000, lon_e7=-1_052_295_000),)
    write_situation(Situation(mission=Known(Mission(items, home), None, "test")), mission)
    vehicle.write_text("FENCE_ENABLE 1\nFENCE_TYPE 4\nFENCE_MARGIN 2\nAVOID_ENABLE 3\n", encoding="utf-8")
    asked = ("check", "--mission", mission, "--fence", fence, "--vehicle", vehicle)
    result = run(*asked)
    assert result.exit_code == 8
    assert (
        "DANGER: the start is 1.11 m from inclusion polygon 1, where fence avoidance acts (within FENCE_MARGIN 2 m plus 0.05 m)"
        in result.output
    )
    document = document_of(*asked, code=8)
    assert (document["status"], document["broken"], len(document["dangers"])) == ("failed", 0, 1)
    vehicle.write_text(
        "FENCE_ENABLE 1\nFENCE_TYPE 4\nFENCE_MARGIN 2\nAVOID_ENABLE 3\nAVOID_BACKUP_SPD 0\n", encoding="utf-8"
    )
    assert document_of(*asked)["dangers"] == []


def test_a_slow_mission_and_old_firmware_are_said(tmp_path, yard):
    vehicle = tmp_path / "rover.parm"
    vehicle.write_text("WP_SPEED 0.5\nFENCE_MARGIN 0\nFENCE_ENABLE 1\nFENCE_TYPE 4\n", encoding="utf-8")
    warnings = check_yard(yard, "--vehicle", str(vehicle))["warnings"]
    assert any(
        "steered rovers below 1 m/s were not measured, and this one drives 0.5 m/s" in one for one in warnings
    )
    assert any("FENCE_MARGIN 0 m does not switch avoidance off" in one for one in warnings)


def test_an_extrapolated_mission_passes_only_where_the_model_is_trusted(tmp_path, yard):
    vehicle = tmp_path / "rover.parm"
    vehicle.write_text("WP_SPEED 2\nOA_TYPE 2\n", encoding="utf-8")
    corner = (LatLon(40.071374, -105.229930), LatLon(40.0714396, -105.2299785))
    mission = tmp_path / "short.waypoints"
    items = tuple(map(waypoint, corner))
    write_situation(Situation(mission=Known(Mission(items, corner[0]), None, "test")), mission)
    asked = ("check", "--mission", mission, "--fence", yard["fence"], "--clearance", "0.5")
    options = (*asked, "--vehicle", vehicle, "--firmware", "4.6")
    usual, untrusted, trusted = run(*asked), run(*options), run(*options, "--trust-model")
    assert [result.exit_code for result in (usual, untrusted, trusted)] == [0, 8, 0]
    assert "NOT CONFIRMED: every leg is predicted to keep 0.5 m while driving" in untrusted.output
    assert "PASS: every leg keeps 0.5 m while driving; the drive model is trusted" in trusted.output
    document = json.loads(run(*options, "--json").stdout)
    assert (document["status"], document["exit_code"], document["broken"]) == ("failed", 8, 0)


def test_the_firmware_is_taken_from_the_option_else_from_the_file(tmp_path, yard):
    vehicle = tmp_path / "rover.parm"
    vehicle.write_text("# Version: 4.5.7\nWP_SPEED 2\nFENCE_NTF_FREQ 1\n", encoding="utf-8")
    assert check_yard(yard, "--vehicle", str(vehicle))["extrapolated"] == []
    vehicle.write_text("# Version: 4.5.7\nWP_SPEED 2\nTURN_RADIUS 0.6\n", encoding="utf-8")
    picture = tmp_path / "check.html"
    (old,) = check_yard(yard, "--vehicle", str(vehicle), "--plot", str(picture))["extrapolated"]
    assert "TURN_RADIUS 0.6 m was not measured before ArduPilot 4.6" in old
    assert "while driving, extrapolated" in picture.read_text(encoding="utf-8")
    assert check_yard(yard, "--vehicle", str(vehicle), "--firmware", "4.6")["extrapolated"] == []
