"""``pbpp plan`` on logs and files: what it promises to people and scripts."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pyproj import Proj
from shapely import LineString, Point, Polygon
from typer.testing import CliRunner

from mavlink_bridge.cli import plan as plan_command
from mavlink_bridge.cli import planning_progress
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.failing import exit_code_of
from mavlink_bridge.cli.timed_plan import timed_plan
from missions.errors import FenceError, PlanCheckError
from missions.fence import CircleZone, Fence, ZoneKind
from missions.formats import read_fence, read_mission, read_situation
from missions.geo import LatLon, distance_m

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan

START, TARGET = "40.071374,-105.229930", "40.0720926,-105.2286152"
KEYS = {
    "status", "command", "source", "system", "method", "start", "targets", "path", "length_m", "straight_line_m", "duration_s",
    "clearance_m", "drawn_clearance_m", "driven_clearance_m", "fence", "blocks", "planning_s", "mission_items", "outputs",
    "uploaded", "verified", "warnings",
}  # fmt: skip


def run(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["plan", *map(str, arguments)])


def document(*arguments: object) -> dict[str, Any]:
    """Run with --json; the one document on stdout."""
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def failure(*arguments: object) -> dict[str, Any]:
    """Run with --json to an error; its document, which says the same as stderr and the exit code."""
    result = run(*arguments, "--json")
    found = json.loads(result.stdout)
    assert found["status"] == "error"
    assert found["command"] == "plan"
    assert found["exit_code"] == result.exit_code
    lines = result.stderr.splitlines()
    if found["advice"]:
        assert lines.pop() == f"advice: {found['advice']}"
    *before, last = lines
    assert last == f"error: {found['message']}"
    assert all(line.startswith("warning: ") for line in before)
    assert isinstance(found["details"], dict)
    return found


def clearance_of_file(mission: Path, fence: Fence, start: list[float]) -> float:
    """Measure the written waypoints against the fence in a map of the test's own (fields of a few hundred metres)."""
    chart = Proj(proj="tmerc", lat_0=start[0], lon_0=start[1], k=1, ellps="WGS84")

    def points(places) -> list[tuple[float, float]]:
        return [chart(lon_deg, lat_deg) for lat_deg, lon_deg in places]

    line = LineString(points([start, *(item.position for item in read_mission(mission).items)]))
    found_m = []
    for zone in fence.zones:
        if isinstance(zone, CircleZone):
            found_m.append(Point(points([zone.centre])[0]).distance(line) - zone.radius_m)
            continue
        area = Polygon(points(zone.vertices))
        assert area.contains(line) if zone.kind is ZoneKind.INCLUSION else not area.intersects(line)
        found_m.append(area.exterior.distance(line))
    return min(found_m)


@pytest.fixture(scope="module")
def drawn() -> tuple[str, ...]:
    return ("--corner-allowance", "0")


class TestRecordedLogs:
    """The acceptance of the main job."""

    @pytest.mark.parametrize(
        ("clearance_m", "shortest_m", "longest_m"), [(2, 153.0, 154.6), (3, 209.5, 211.5)]
    )
    def test_the_maze(
        self,
        logs: Path,
        tmp_path: Path,
        drawn: tuple,
        clearance_m: float,
        shortest_m: float,
        longest_m: float,
    ) -> None:
        mission, picture = tmp_path / "m.waypoints", tmp_path / "m.png"
        found = document(
            "--log",
            logs / "guided-maze.tlog",
            "--clearance",
            clearance_m,
            *drawn,
            "-o",
            mission,
            "--plot",
            picture,
        )
        assert set(found) >= KEYS
        assert (found["status"], found["command"], found["source"], found["system"]) == (
            "ok",
            "plan",
            "guided-maze.tlog",
            1,
        )
        assert found["start"] == [40.0714396, -105.2297785]
        assert found["targets"] == [[40.0726316, -105.2290497]]
        assert shortest_m <= found["length_m"] <= longest_m
        assert found["drawn_clearance_m"] >= clearance_m
        assert found["clearance_m"] is None
        assert found["fence"] == {
            "inclusion_polygons": 1, "exclusion_polygons": 6, "inclusion_circles": 0, "exclusion_circles": 2, "vertices": 37, "union": False
        }  # fmt: skip
        assert (found["uploaded"], found["verified"]) == (False, False)
        assert found["outputs"] == [str(mission), str(picture)]
        assert picture.read_bytes().startswith(b"\x89PNG")
        items = read_mission(mission).items
        assert found["mission_items"] == len(items) + 1 == len(found["path"])
        assert [list(item.position) for item in items] == found["path"][1:]
        fence = read_fence(Path(__file__).parents[2] / "fields" / "maze-fence.waypoints")
        # the log's fence is the file's with degE7 cut, not rounded
        assert clearance_of_file(mission, fence, found["start"]) >= clearance_m - 0.012
        assert found["length_m"] == pytest.approx(
            sum(
                distance_m(LatLon(*a), LatLon(*b))
                for a, b in zip(found["path"], found["path"][1:], strict=False)
            ),
            abs=1e-3,
        )

    def test_position_targets_in_the_yard(self, logs: Path, drawn: tuple) -> None:
        found = document("--log", logs / "position-target-yard.tlog", "--clearance", 2, *drawn)
        assert 131.0 <= found["length_m"] <= 132.4
        assert found["drawn_clearance_m"] >= 2

    def test_a_rover_nearer_than_the_clearance_leads_away(self, logs: Path, drawn: tuple) -> None:
        found = document("--log", logs / "position-target-yard.tlog", "--clearance", 3, *drawn)
        assert 2.68 <= found["drawn_clearance_m"] <= 2.71
        assert any("while leaving it, the rover keeps" in warning for warning in found["warnings"])

    def test_the_changed_fence_counts(self, logs: Path, drawn: tuple) -> None:
        ends = ("--start", "40.0715,-105.2286", "--target", TARGET)
        found = document("--log", logs / "fence-change-yard.tlog", "--clearance", 2, *drawn, *ends)
        assert (found["fence"]["exclusion_polygons"], found["fence"]["exclusion_circles"]) == (3, 2)
        assert found["length_m"] == pytest.approx(84.7, abs=0.2)
        assert found["straight_line_m"] == pytest.approx(65.8, abs=0.1)

    def test_a_rover_that_stands_in_a_barn(self, logs: Path, drawn: tuple) -> None:
        found = failure("--log", logs / "mission-yard.tlog", "--clearance", 2, *drawn)
        assert (found["exit_code"], found["error"]) == (4, "StartBlockedError")
        assert "exclusion polygon 1" in found["message"]
        assert "4.96 m" in found["message"]
        assert "bearing 0°" in found["message"]
        assert found["details"]["distance_m"] == pytest.approx(4.96, abs=0.02)

    def test_the_target_of_a_mission(self, logs: Path, drawn: tuple) -> None:
        found = document("--log", logs / "mission-yard.tlog", "--clearance", 2, *drawn, "--start", START)
        assert found["targets"] == [[40.0720926, -105.2286152]]
        assert any("FENCE_ENABLE is 0" in warning for warning in found["warnings"])

    def test_across_the_seam_of_a_union_no_route_leads_while_the_vehicle_avoids_fences(
        self, logs: Path, drawn: tuple
    ) -> None:
        found = failure("--log", logs / "union-rally.tlog", "--clearance", 2, *drawn)
        assert (found["exit_code"], found["error"]) == (4, "NoRouteError")
        assert found["message"] == (
            "no route at any clearance: the start is enclosed by inclusion polygon 1 and the inner edge of inclusion polygon 2: "
            "with AVOID_ENABLE 3 (bit 0) the vehicle stops FENCE_MARGIN 2 m before the edge of its inclusion and does not resume, although "
            "FENCE_OPTIONS bit 1 joins it to others"
        )
        assert found["advice"] == (
            "merge the inclusions into one polygon (`pbpp fence merge FILE -o merged.plan`, then `pbpp upload merged.plan`), or set AVOID_ENABLE 2 "
            "(without bit 0) (then nothing brakes it before the fence: in tests it drove 4 m beyond at 2 m/s, 10 to 15 m at 5 m/s)"
        )

    def test_a_union(self, logs: Path, fields: Path, tmp_path: Path, drawn: tuple) -> None:
        vehicle = tmp_path / "rover.parm"
        vehicle.write_text(
            "FENCE_ENABLE 1\nFENCE_TYPE 4\nFENCE_OPTIONS 2\nAVOID_ENABLE 2\n", encoding="utf-8"
        )
        field = ("--fence", fields / "union-fence.waypoints", "--vehicle", vehicle, "--clearance", 2, *drawn)
        found = document(*field, "--start", START, "--target", "40.0721374,-105.2284626")
        assert found["fence"]["union"] is True
        assert found["length_m"] < 160

    def test_no_fence(self, logs: Path) -> None:
        found = failure("--log", logs / "no-fence.tlog")
        assert (found["exit_code"], found["error"]) == (3, "FenceMissingError")
        assert "no fence was uploaded or downloaded" in found["message"]
        assert "--fence" in found["message"]

    def test_an_island(self, logs: Path) -> None:
        found = failure("--log", logs / "island-unreachable.tlog", "--clearance", 1)
        assert (found["exit_code"], found["error"]) == (4, "NoRouteError")
        assert "enclosed by exclusion polygon" in found["message"]

    @pytest.mark.parametrize("name", ["guided-maze", "position-target-yard", "fence-change-yard"])
    def test_the_defaults_promise_something(self, logs: Path, name: str) -> None:
        found = document("--log", logs / f"{name}.tlog")
        leads_away = any("while leaving it, the rover keeps" in warning for warning in found["warnings"])
        at_start_m = found["start_clearance_m"]
        assert 2.5 <= found["clearance_m"] <= 3.0  # or more, where that is quicker
        assert at_start_m is None or (leads_away and 1.2 < at_start_m < 2.5)
        assert found["drawn_clearance_m"] >= 2.5
        assert found["driven_clearance_m"] >= (at_start_m or 2.5)

    def test_the_widest_way(self, logs: Path, drawn: tuple) -> None:
        found = document("--log", logs / "guided-maze.tlog", "--clearance", "max", *drawn)
        with_it = document(
            "--log", logs / "guided-maze.tlog", "--clearance", found["drawn_clearance_m"] - 0.02, *drawn
        )
        assert with_it["length_m"] <= found["length_m"] + 0.5
        assert found["drawn_clearance_m"] > 3


class TestFiles:
    """Fences from files, missions to files."""

    def test_people_read_a_report(self, fields: Path, tmp_path: Path) -> None:
        mission = tmp_path / "m.plan"
        result = run(
            "--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET, "-o", mission
        )
        assert result.exit_code == 0
        lines = result.stdout.splitlines()
        assert lines[0].startswith("Route: ")
        assert "m in a straight line" in lines[0]
        assert "at least 2.5 m while driving" in lines[1]
        assert lines[2] == f"Wrote {mission}"
        assert "HOLD" not in result.stderr  # it is told to those who are about to drive
        assert all(line.startswith(("warning: ", "info: ")) for line in result.stderr.splitlines())
        quiet = run("--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET, "-q")
        assert (quiet.exit_code, quiet.stdout) == (0, "")

    def test_what_is_taken_from_a_log_is_told_with_its_time(self, logs: Path, tmp_path: Path) -> None:
        """Which start, target and fence it took, a plan from a log did not say."""
        maze, yard = logs / "guided-maze.tlog", logs / "mission-yard.tlog"
        start = "start 40.0714396,-105.2297785 (GLOBAL_POSITION_INT at 70.5 s)"
        target = "target 40.0726316,-105.2290497 (DO_REPOSITION at 58.2 s)"
        fence = "fence of 9 zones (fence read-back at 12.2 s)"
        first = "info: taken from guided-maze.tlog: "
        assert f"{first}{start}, {target}, {fence}\n" in run("--log", maze).stderr
        given = run("--log", maze, "--target", "40.0726316,-105.2290497")
        assert f"{first}{start}, {fence}\n" in given.stderr
        assert "taken from" not in run("--log", maze, "-q").stderr
        end = "target 40.0720926,-105.2286152, the end of the mission (mission read-back at 17.5 s)"
        assert end in run("--log", yard, "--escape").stderr
        told = document("--log", yard, "--escape")["info"]
        assert end in told[0]
        own = run("--log", yard, "--via-mission", "own", "--start", START)
        assert "3 mission items with home (mission read-back at 17.5 s)" in own.stderr
        assert "target" not in own.stderr.splitlines()[0]

    def test_quiet_leaves_warnings_and_quieter_only_errors(self, fields: Path) -> None:
        words = ("--fence", fields / "yard-fence.waypoints", "--start", START, "--target")
        assert "warning: " in run(*words, TARGET, "-q").stderr
        for quieter in (["-qq"], ["-q", "--quiet"]):
            result = run(*words, TARGET, *quieter)
            assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
        refused = run(*words, "41,-105", "-qq")
        assert refused.exit_code != 0
        assert refused.stderr.startswith("error: ")
        assert json.loads(run(*words, TARGET, "--json", "-q").stdout)["warnings"]
        assert not json.loads(run(*words, TARGET, "--json", "-qq").stdout)["warnings"]

    def test_what_was_asked_for_is_no_warning(self, fields: Path, drawn: tuple) -> None:
        in_the_barn = ("--target", "40.0715987,-105.2296779", "--snap", 10)
        words = ("--fence", fields / "yard-fence.waypoints", "--start", START, "--clearance", 1, *drawn)
        found = document(*words, *in_the_barn)
        moved = next(text for text in found["info"] if "moved" in text)
        assert "is blocked by a fence: moved" in moved
        assert moved not in found["warnings"]
        told = run(*words, *in_the_barn).stderr.splitlines()
        assert f"info: {moved}" in told
        quiet = run(*words, *in_the_barn, "-q")
        assert not any("moved" in line for line in quiet.stderr.splitlines())
        assert document(*words, *in_the_barn, "-q")["info"] == []

    def test_a_plan_file_holds_mission_and_fence_and_plans_again(
        self, fields: Path, tmp_path: Path, drawn: tuple
    ) -> None:
        first, second = tmp_path / "a.plan", tmp_path / "b.waypoints"
        source = ("--fence", fields / "maze-fence.waypoints")
        found = document(
            *source,
            "--start",
            "40.0714396,-105.2297785",
            "--target",
            "40.0726316,-105.2290497",
            "--clearance",
            2,
            *drawn,
            "-o",
            first,
            "-o",
            second,
        )
        again = read_situation(first)
        assert again.fence is not None
        assert again.fence.value.zones[0] == read_fence(fields / "maze-fence.waypoints").zones[0]
        assert again.mission is not None
        assert [item.position for item in again.mission.value.items] == [
            item.position for item in read_mission(second).items
        ]
        assert again.home is not None  # without a known home the start stands there
        assert list(again.home.value) == found["start"]
        from_file = document(
            "--fence", first, "--clearance", 2, *drawn
        )  # start: its home; target: its mission's end
        assert from_file["path"] == found["path"]
        assert from_file["system"] is None
        assert from_file["source"] == "a.plan"

    def test_parameters_from_a_file(self, fields: Path, tmp_path: Path) -> None:
        parameters = tmp_path / "rover.parm"
        parameters.write_text("# Version: 4.6.3\nFENCE_MARGIN 0.5\nWP_RADIUS 0.7\n")
        source = ("--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET)
        found = document(*source, "--vehicle", parameters)
        assert found["clearance_m"] == 1.0
        assert found["drawn_clearance_m"] >= 1.0
        assert not any(
            "not known" in warning for warning in found["warnings"] if "FENCE_ENABLE" not in warning
        )

    def test_an_extrapolated_plan_promises_nothing(self, fields: Path, tmp_path: Path) -> None:
        parameters = tmp_path / "rover.parm"
        parameters.write_text("WP_SPEED 2\nOA_TYPE 2\n")
        source = ("--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET)
        asked = (*source, "--vehicle", parameters, "--firmware", "4.6")
        found = document(*asked)
        assert found["clearance_m"] is None
        assert [text.split(":")[0] for text in found["extrapolated"]] == ["OA_TYPE 2"]
        trusted = document(*asked, "--trust-model")
        assert (trusted["clearance_m"], trusted["extrapolated"]) == (2.5, found["extrapolated"])
        said = run(*asked).stdout
        assert "nothing promised while driving, extrapolated beyond what was measured" in said

    def test_several_targets_and_snapping(self, fields: Path, drawn: tuple) -> None:
        source = ("--fence", fields / "yard-fence.waypoints", "--start", START, "--clearance", 1, *drawn)
        found = document(*source, "--target", TARGET, "--target", START)
        assert found["targets"] == [[40.0720926, -105.2286152], [40.071374, -105.22993]]
        in_the_barn = ("--target", "40.0715987,-105.2296779")
        blocked = failure(*source, *in_the_barn)
        assert blocked["error"] == "TargetBlockedError"
        assert blocked["exit_code"] == 4
        moved = document(*source, *in_the_barn, "--snap", 10)
        assert any("is blocked by a fence: moved" in text for text in moved["info"])

    def test_a_source_is_not_overwritten_with_a_mission(self, fields: Path, tmp_path: Path) -> None:
        fence = tmp_path / "fence.waypoints"
        fence.write_bytes((fields / "yard-fence.waypoints").read_bytes())
        found = failure("--fence", fence, "--start", START, "--target", TARGET, "-o", fence)
        assert found["exit_code"] == 2
        assert "would overwrite" in found["message"]
        assert fence.read_bytes() == (fields / "yard-fence.waypoints").read_bytes()


HEADER = "QGC WPL 110"
TRIANGLE = "\n".join(
    f"{i}\t0\t0\t5001\t3\t0\t0\t0\t{lat}\t{lon}\t0\t1"
    for i, (lat, lon) in enumerate([(40.07, -105.23), (40.07, -105.22), (40.08, -105.22)])
)
ENDS = ("--start", "40.0705,-105.2210", "--target", "40.0750,-105.2205")


def wpl(body: str) -> str:
    return f"{HEADER}\n{body}\n"


def qgc(fence: object) -> str:
    return json.dumps({"fileType": "Plan", "geoFence": fence})


def circle(lat: object, radius: object) -> dict[str, object]:
    return {
        "version": 2,
        "polygons": [],
        "circles": [{"circle": {"center": [lat, -105.2], "radius": radius}, "inclusion": True}],
    }


def polygon(vertices: object, inclusion: object = True) -> dict[str, object]:
    return {"version": 2, "circles": [], "polygons": [{"polygon": vertices, "inclusion": inclusion}]}


WRONG_FENCES: list[tuple[str, str | bytes, str]] = [
    ("missing.waypoints", b"", "line 1: expected 'QGC WPL 110'"),
    ("empty.plan", "", "line 1: not JSON"),
    ("random.waypoints", random.Random(5).randbytes(3000), "is not a text file"),
    ("random.plan", random.Random(6).randbytes(3000), "is not a text file"),
    ("two.waypoints", wpl("\n".join(TRIANGLE.splitlines()[:2])), "line 2: fence item 0: inclusion polygon with 3 vertices, but only 2 are given"),
    ("two2.waypoints", wpl("\n".join(TRIANGLE.replace("\t3\t", "\t2\t").splitlines()[:2])), "inclusion polygon with 2 vertices; at least 3 are needed"),
    ("two.plan", qgc(polygon([[40, -105], [41, -105]])), "geoFence.polygons[0].polygon: 2 vertices"),
    ("nan.waypoints", wpl(TRIANGLE.replace("40.08", "nan")), "line 4: position nan,-105.22 is not"),
    ("nan.plan", qgc(circle(float("nan"), 30)), "geoFence.circles[0].circle.center: position nan"),
    ("91.waypoints", wpl(TRIANGLE.replace("40.08", "91")), "line 4: latitude 91° is beyond"),
    ("91.plan", qgc(circle(91, 30)), "latitude 91° is beyond"),
    ("181.waypoints", wpl(TRIANGLE.replace("-105.23", "-181")), "line 2: longitude -181° is beyond"),
    ("inf.plan", qgc(circle(40, float("inf"))), "circle.radius: inf"),
    ("zero.plan", qgc(circle(40, 0)), "circle.radius: 0; a circle's radius must be positive"),
    ("string.plan", qgc(circle("40", 30)), "center[0]: expected a number"),
    ("kind.plan", qgc(polygon([[40, -105]] * 3, "yes")), "inclusion: expected true or false"),
    ("area.plan", qgc(polygon([[40, -105]] * 3)), "inclusion polygon 1 has no area"),
    ("version.plan", qgc({"version": 1, "polygon": []}), "contains no fence"),
    ("list.plan", "[]", "expected a QGroundControl plan"),
    ("deep.plan", "[" * 1_000_000, "nested too deeply"),
    ("cut.plan", qgc(circle(40, 30))[:-5], "not JSON"),
    ("none.plan", '{"fileType": "Plan"}', "contains no fence"),
    ("mission.waypoints", wpl("0\t1\t0\t16\t0\t0\t0\t0\t40.07\t-105.22\t0\t1"), "contains no fence"),
    ("columns.waypoints", wpl(TRIANGLE + "\t9"), "line 4: 13 columns; expected 12"),
    ("words.waypoints", wpl(TRIANGLE.replace("5001", "inclusion")), "line 2: "),
    ("mixed.waypoints", wpl(TRIANGLE + "\n3\t0\t0\t16\t0\t0\t0\t0\t40.07\t-105.2\t0\t1"), "line 5: fence item 3: command 16 is not a fence item"),
    ("pole.waypoints", wpl(TRIANGLE.replace("40.0", "86.0")), "is beyond ±85°"),
    ("apart.plan", qgc({"version": 2, "polygons": [], "circles": [circle(40, 30)["circles"][0], circle(40.5, 30)["circles"][0]]}), "have no area in common"),
    ("suffix.tlog", "x", "is a telemetry log; supported: .plan"),
    ("suffix", "x", "cannot read files with extension ''"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "problem"), WRONG_FENCES, ids=[row[0] for row in WRONG_FENCES])
def test_a_fence_file_that_cannot_be_used(
    tmp_path: Path, name: str, content: str | bytes, problem: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    found = failure("--fence", path, *ENDS)
    assert found["exit_code"] == 3
    assert problem in found["message"]
    assert "\n" not in found["message"]
    if found["error"] == "MissionFormatError":
        assert str(path) in found["message"]


def cut_log(logs: Path) -> bytes:
    """A log whose last bytes, with the fence, are gone."""
    return (logs / "guided-maze.tlog").read_bytes()[:20_000]


WRONG_LOGS: dict[str, Any] = {
    "empty": lambda _logs: b"",
    "random": lambda _logs: random.Random(7).randbytes(100_000),
    "truncated": cut_log,
    "one-byte": lambda _logs: b"\x00",
    "zeros": lambda _logs: bytes(10_000),
    "text": lambda _logs: b"no telemetry in here\n" * 500,
    "fence-file": lambda logs: (logs.parent / "tests" / "fields" / "maze-fence.waypoints").read_bytes(),
    "only-a-timestamp": lambda logs: (logs / "no-fence.tlog").read_bytes()[:8],
    "first-frame-cut": lambda logs: (logs / "no-fence.tlog").read_bytes()[:15],
}


@pytest.mark.parametrize("name", WRONG_LOGS)
def test_a_log_that_cannot_be_used(logs: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.tlog"
    path.write_bytes(WRONG_LOGS[name](logs))
    found = failure("--log", path)
    assert found["exit_code"] == 3
    assert found["error"] in ("LogError", "FenceMissingError", "SituationError")
    assert "\n" not in found["message"]


WRONG_OPTIONS: list[tuple[tuple[str, ...], int, str]] = [
    ((), 2, "give one SOURCE"),
    (("--fence", "F", "--log", "L"), 2, "give one SOURCE"),
    (("--fence", "F", "--connect", "udpin:127.0.0.1:0"), 2, "give one SOURCE"),
    (("--fence", "F", *ENDS, "--upload"), 2, "needs a live link"),
    (("--log", "L", "--upload", "--drive"), 2, "needs a live link"),
    (("--fence", "F", *ENDS, "--clearance", "wide"), 2, "--clearance 'wide': expected metres"),
    (("--fence", "F", *ENDS, "--clearance", "-1"), 2, "--clearance '-1': expected metres"),
    (("--fence", "F", *ENDS, "--clearance", "nan"), 2, "--clearance 'nan': expected metres"),
    (("--fence", "F", *ENDS, "--clearance", "inf"), 2, "--clearance 'inf': expected metres"),
    (("--fence", "F", *ENDS, "--corner-allowance", "some"), 2, "--corner-allowance 'some': expected metres"),
    (("--fence", "F", *ENDS, "--corner-allowance", "nan"), 2, "--corner-allowance 'nan': expected metres"),
    (("--fence", "F", *ENDS, "--corner-allowance", "-0.5"), 2, "--corner-allowance '-0.5': expected metres"),
    (("--fence", "F", *ENDS, "--snap", "inf"), 2, "--snap"),
    (("--fence", "F", *ENDS, "--method", "best"), 2, "--method 'best': expected one of"),
    (("--fence", "F", *ENDS, "-o", "x.docx"), 3, "cannot write files with extension '.docx'"),
    (("--fence", "F", *ENDS, "-o", "x.tlog"), 3, "cannot write files with extension '.tlog'"),
    (("--fence", "F", *ENDS, "--plot", "x.txt"), 3, "'.txt' is not a supported picture format"),
    (("--fence", "F", *ENDS, "-o", "no/where/x.plan"), 3, "cannot be written"),
    (("--fence", "F", *ENDS, "--plot", "no/where/x.png"), 3, "cannot be written"),
    (("--fence", "F", "--start", "here", "--target", "40,5"), 2, "'here' is not a position"),
    (("--fence", "F", "--start", "", "--target", "40,5"), 2, "'' is not a position"),
    (("--fence", "F", "--start", "40,-105", "--target", "nan,5"), 2, "is not a position"),
    (("--fence", "F", "--start", "91,-105", "--target", "40,5"), 2, "latitude 91° is beyond"),
    (("--fence", "F", "--start", "40,-105", "--target", "40,181"), 2, "longitude 181° is beyond"),
    (("--fence", "F", "--target", "40.0750,-105.2205"), 3, "start unknown"),
    (("--fence", "F", "--start", "40.0705,-105.2210"), 3, "target unknown"),
    (("--fence", "F", "--start", "40.0705,-105.2210", "--target", "43,-105"), 4, "from the fence's centre"),
    (("--fence", "none.plan", *ENDS), 3, "cannot be read: No such file"),
    (("--fence", ".", *ENDS), 3, "cannot read files with extension"),
    (("--log", "none.tlog"), 3, "none.tlog"),
    (("--log", "L", "--system", "9"), 3, "system 9 was not heard, only system 1"),
    (("--fence", "F", *ENDS, "--vehicle", "none.parm"), 3, "none.parm cannot be read"),
    (("--fence", "F", *ENDS, "--vehicle", "P"), 3, "line 1: expected a parameter's name and a number"),
    (("--fence", "F", *ENDS, "--vehicle", "N"), 3, "FENCE_MARGIN is -1; allowed: 0 to 1000"),
    (("--fence", "F", "--start", "40.0705,-105.2210", "--target", "40.0790,-105.2299"), 4, "the target is outside"),
    (("--fence", "F", "--start", "40.0790,-105.2299", "--target", "40.0705,-105.2210"), 4, "the start is outside"),
    (("--fence", "F", *ENDS, "--clearance", "1e6"), 4, "no place in the field keeps"),
    (("--fence", "F", *ENDS, "--clearance", "1e300"), 2, "expected metres (0 to 1000000) or max"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "code", "problem"),
    WRONG_OPTIONS,
    ids=[" ".join(row[0]) or "nothing" for row in WRONG_OPTIONS],
)
def test_what_is_asked_wrongly(
    logs: Path, tmp_path: Path, monkeypatch, options: tuple[str, ...], code: int, problem: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.waypoints").write_text(wpl(TRIANGLE))
    (tmp_path / "p.parm").write_text("not a parameter file\n")
    (tmp_path / "n.parm").write_text("FENCE_MARGIN -1\n")
    files = {"F": "f.waypoints", "L": str(logs / "guided-maze.tlog"), "P": "p.parm", "N": "n.parm"}
    found = failure(*(files.get(option, option) for option in options))
    assert found["exit_code"] == code
    assert problem in found["message"]
    assert "\n" not in found["message"]


@pytest.mark.parametrize(
    "options", [("--nonsense",), ("--clearance",), ("--system", "0"), ("--system", "256"), ("--system", "x"), ("--snap", "-1"), ("--snap", "nan"), ("--snap", "far"), ("an-argument",)]
)  # fmt: skip
def test_usage_that_cannot_be_read(options: tuple[str, ...]) -> None:
    result = run(*options)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 2


def test_not_a_number_in_a_log_is_still_one_document(tmp_path: Path) -> None:
    """A vehicle may send a parameter that is no number; the error's details go into JSON all the same."""
    from mavlink_bridge.mavlink import messages as m
    from mavlink_bridge.mavlink.codec import Codec
    from mavlink_bridge.tlog import TlogWriter

    codec, station = Codec(1, 1), Codec(255, 190)
    told = [
        codec.encode(m.Heartbeat(10, 3)),
        codec.encode(m.ParamValue("FENCE_MARGIN", float("nan"), 9, 1, 0)),
        codec.encode(m.GlobalPositionInt(0, 400713740, -1052299300)),
        codec.encode(m.MissionCount(255, 190, 1, 1)),
        codec.encode(
            m.MissionItemInt(255, 190, 0, 0, 5003, 0, 1, 300, 0, 0, 0, 400713740, -1052299300, 0, 1)
        ),
        station.encode(m.CommandInt(1, 1, 0, 192, x=400715000, y=-1052299300)),
    ]
    path = tmp_path / "nan.tlog"
    with TlogWriter(path) as log:
        for number, data in enumerate(told):
            log.write(1.7e9 + number, data)
    found = failure("--log", path)
    assert (found["exit_code"], found["error"]) == (3, "VehicleError")
    assert "FENCE_MARGIN is nan" in found["message"]


@pytest.mark.parametrize("json_output", [False, True])
def test_a_defect_says_how_to_report_it(fields: Path, monkeypatch, json_output: bool) -> None:
    def break_down(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(plan_command, "timed_plan", break_down)
    arguments = ["--fence", fields / "yard-fence.waypoints", *(["--json"] if json_output else [])]
    result = run(*arguments)
    assert result.exit_code == 1
    assert "internal error" in result.stderr
    assert "ZeroDivisionError" in result.stderr
    assert "report" in result.stderr
    if json_output:
        found = json.loads(result.stdout)
        assert (found["error"], found["exit_code"]) == ("InternalError", 1)
    else:
        assert result.stdout == ""


def test_an_interrupt(fields: Path, monkeypatch) -> None:
    def interrupt(*_: object, should_stop: Callable[[], bool]) -> None:
        assert not should_stop()
        raise KeyboardInterrupt

    monkeypatch.setattr(plan_command, "timed_plan", interrupt)
    found = failure("--fence", fields / "yard-fence.waypoints")
    assert (found["exit_code"], found["error"]) == (130, "Interrupted")
    assert found["message"] == "interrupted while planning; nothing was written"


def test_a_plan_that_takes_long_shows_so(fields: Path, monkeypatch) -> None:
    def take_long(*given: object, should_stop: Callable[[], bool]) -> tuple[Plan, float]:
        monkeypatch.setattr(planning_progress, "_AFTER_S", 0.0)
        return timed_plan(*given, should_stop=should_stop)

    monkeypatch.setattr(plan_command, "timed_plan", take_long)
    words = (
        "--fence",
        fields / "yard-fence.waypoints",
        "--start",
        START,
        "--target",
        TARGET,
        "--clearance",
        "max",
    )
    assert "planning the widest route" in run(*words, "-v").stderr
    assert "planning the widest route" not in run(*words, "-v", "-q").stderr
    assert "planning" not in run(*words).stderr


def test_every_error_has_its_exit_code() -> None:
    assert exit_code_of(PlanCheckError("x")) == 1
    assert exit_code_of(FenceError("x")) == 3


class TestAsAProcess:
    """The command itself, as scripts call it."""

    @staticmethod
    def call(*arguments: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", "from mavlink_bridge.cli import main; main()", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    def test_a_plan(self, logs: Path, tmp_path: Path) -> None:
        mission = tmp_path / "m.waypoints"
        done = self.call(
            "plan",
            "--log",
            logs / "guided-maze.tlog",
            "--clearance",
            2,
            "--corner-allowance",
            0,
            "--json",
            "-o",
            mission,
        )
        assert done.returncode == 0
        assert json.loads(done.stdout)["length_m"] <= 154.6
        assert len(done.stdout.splitlines()) == 1
        assert mission.read_text().startswith(HEADER)

    def test_an_error_and_what_to_do_are_a_line_each(self, logs: Path) -> None:
        done = self.call("plan", "--log", logs / "no-fence.tlog")
        assert done.returncode == 3
        assert done.stdout == ""
        assert done.stderr.startswith("error: no fence to plan around: no fence was uploaded or downloaded")
        assert done.stderr.splitlines()[1].startswith("advice: ")
        assert len(done.stderr.splitlines()) == 2

    def test_a_fence_file_needs_no_mavlink(self, fields: Path) -> None:
        code = (
            "import sys; from mavlink_bridge.cli.app import app\n"
            "try: app(sys.argv[1:])\n"
            "except SystemExit as end: assert not end.code, end.code\n"
            "assert 'pymavlink' not in sys.modules"
        )
        command = [
            sys.executable,
            "-c",
            code,
            "plan",
            "--fence",
            str(fields / "yard-fence.waypoints"),
            "--start",
            START,
            "--target",
            TARGET,
        ]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr


def test_home_can_be_given_where_the_file_tells_none(tmp_path, fields):
    fence, rover = fields / "yard-fence.waypoints", tmp_path / "rover.parm"
    rover.write_text("FENCE_ENABLE 1\nFENCE_TYPE 6\nFENCE_RADIUS 200\nAVOID_ENABLE 0\n")
    plain = ("--fence", fence, "--vehicle", rover, "--target", TARGET, "--clearance", "2")
    refused = failure(*plain, "--start", START)
    assert refused["exit_code"] == 3
    assert "--home LAT,LON" in refused["message"]
    home = [40.071374, -105.22993]
    planned = document(*plain, "--home", START, "--end", "rtl", "--return")
    assert planned["start"] == planned["path"][0] == planned["path"][-1] == home
    (tmp_path / "options.toml").write_text(f'[plan]\nhome = "{START}"\n')
    assert document(*plain, "--config", tmp_path / "options.toml")["start"] == home
    assert failure(*plain, "--home", "40.071374")["exit_code"] == 2
    assert failure("--connect", "udpin:127.0.0.1:0", "--home", START)["exit_code"] == 2


def test_home_can_be_given_to_check_too(fields):
    files = ("--mission", fields / "yard-mission.waypoints", "--fence", fields / "yard-fence.waypoints")
    result = CliRunner().invoke(app, ["check", *map(str, files), "--home", "40.0713,-105.2300", "--json"])
    assert json.loads(result.stdout)["legs"][0]["start"] == [40.0713, -105.23]
    live = CliRunner().invoke(app, ["check", "--connect", "udpin:127.0.0.1:0", "--home", START])
    assert live.exit_code == 2


def test_an_obstacle_beside_the_fence_is_planned_round_and_named(fields, tmp_path):
    fence = fields / "yard-fence.waypoints"
    place, radius_m = "40.071801,-105.229460", 3.0
    asked = ("--fence", fence, "--start", START, "--target", TARGET, "--clearance", 2.5)
    plain = document(*asked)
    out = tmp_path / "round.plan"
    found = document(
        *asked, "--obstacle", f"{place},{radius_m}", "-o", out, "--plot", tmp_path / "round.html"
    )
    assert plain["obstacles"] == []
    assert found["obstacles"] == [
        {
            "name": "obstacle from --obstacle (radius 3.0 m)",
            "position": [40.071801, -105.22946],
            "radius_m": 3.0,
            "taken_for_m": 3.0,
        }
    ]
    assert any("protects no person" in text for text in found["info"])
    chart = Proj(proj="tmerc", lat_0=40.0718, lon_0=-105.2295, k=1, ellps="WGS84")
    lines = [LineString([chart(lon, lat) for lat, lon in one["path"]]) for one in (plain, found)]
    middle = Point(chart(-105.22946, 40.071801))
    assert lines[0].distance(middle) < radius_m + 2.5 <= lines[1].distance(middle)
    assert "obstacle from --obstacle" in (tmp_path / "round.html").read_text()
    assert read_situation(out).fence.value.zones == read_situation(fence).fence.value.zones


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--obstacle", "40.07"], "LAT,LON,RADIUS"),
        (["--obstacle", "40.07,-105.2,0"], "metres"),
        (["--obstacle", "91,0,1"], "latitude"),
        (["--obstacle", "40.07,1"], "such as 40.0718,-105.2295,2.5"),
    ],
)
def test_what_is_no_obstacle_is_wrong_usage(fields, options, said):
    found = run("--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET, *options)
    assert found.exit_code == 2
    assert said in found.output


def test_obstacles_go_with_files_not_with_a_link():
    found = run("--connect", "tcp:127.0.0.1:9", "--target", TARGET, "--obstacle", "40.07,-105.2,1")
    assert found.exit_code == 2
    assert "--obstacles-from" in found.output.replace("\n", " ")
