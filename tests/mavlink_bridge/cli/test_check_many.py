"""``pbpp check`` of many missions: each by itself, in order, as text, JSON, SARIF and JUnit."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree as ET

import jsonschema
import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.check_many import AskedCheck, check_task
from mavlink_bridge.cli.options.check import CheckOptions
from mavlink_bridge.cli.task_files import as_asked, files_of
from mavlink_bridge.many import Task

YARD = Path(__file__).parents[3] / "examples" / "yard"
SCHEMA = Path(__file__).parents[2] / "missions" / "checking" / "data" / "sarif-2.1.0-rtm.5.json"
HOME = "40.071374,-105.229930"
GOOD = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t40.071374\t-105.229930\t0\t1\n1\t0\t3\t16\t0\t0\t0\t0\t40.071464\t-105.22996\t0\t1\n"


@pytest.fixture
def missions(tmp_path, monkeypatch):
    """A folder with a mission that passes, one that fails on its line 4, and one that is none."""
    monkeypatch.chdir(tmp_path)
    for name in ("fence.waypoints", "rover.parm"):
        shutil.copy(YARD / name, tmp_path)
    shutil.copy(YARD / "drawn.waypoints", tmp_path / "bad.waypoints")
    Path("good.waypoints").write_text(GOOD)
    Path("broken.waypoints").write_text("QGC WPL 110\n0\t1\n")
    return ["good.waypoints", "bad.waypoints", "broken.waypoints", "missing.plan"]


def run(*arguments: str):
    given = ("--fence", "fence.waypoints", "--vehicle", "rover.parm", "--jobs", "1")
    return CliRunner().invoke(app, ["check", *arguments, *given])


def test_each_is_told_with_its_line(missions):
    result = run(*missions)
    assert result.exit_code == 8
    lines = result.stdout.splitlines()
    assert lines[0] == "good.waypoints: PASS: every leg keeps 2.5 m while driving"
    assert lines[1].startswith("bad.waypoints:4: FAIL: leg 1 → 2 crosses exclusion polygon 1")
    assert lines[2].startswith("broken.waypoints:2: error: ")
    assert lines[3].startswith("missing.plan:1: error: missing.plan cannot be read")
    assert lines[4] == "4 missions: 1 passed, 1 failed, 2 could not be checked"
    assert "bad.waypoints:1: warning: " in result.stderr
    quiet = run(*missions, "-qq")
    assert (quiet.stdout.splitlines(), quiet.stderr) == (lines[1:4], "")


@pytest.mark.parametrize(
    ("names", "code"), [(["good"], 0), (["broken", "good"], 3), (["good", "bad", "broken"], 8)]
)
def test_how_it_ends(missions, names, code):
    files = [f"{name}.waypoints" for name in names]
    assert run(*files, "-q").exit_code == code
    document = json.loads(run(*files, "--json").stdout)
    assert document["exit_code"] == code
    assert document["passed"] == 1
    assert [one["mission"] for one in document["missions"]] == files


def test_a_missions_document_is_the_one_that_it_has_alone(missions):
    many = json.loads(run(*missions[:2], "--json").stdout)["missions"]
    for name, told in zip(missions[:2], many, strict=True):
        alone = CliRunner().invoke(
            app,
            ["check", "--mission", name, "--fence", "fence.waypoints", "--vehicle", "rover.parm", "--json"],
        )
        assert {**json.loads(alone.stdout), "mission": name} == {**told, "outputs": []}


def test_with_processes_the_same(missions):
    arguments = ["check", *missions, "--fence", "fence.waypoints", "--vehicle", "rover.parm", "--json"]
    assert CliRunner().invoke(app, [*arguments, "--jobs", "2"]).stdout == run(*missions, "--json").stdout


def test_sarif_is_valid_and_on_the_items_line(missions):
    result = run(*missions, "--format", "sarif")
    assert result.exit_code == 8
    log = json.loads(result.stdout)
    jsonschema.Draft4Validator(json.loads(SCHEMA.read_text(encoding="utf-8"))).validate(log)
    places = [
        (one["ruleId"], one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"],
         one["locations"][0]["physicalLocation"]["region"]["startLine"])
        for one in log["runs"][0]["results"] if one["level"] == "error"
    ]  # fmt: skip
    assert places == [
        ("leg-crosses-fence", "bad.waypoints", 4),
        ("unusable", "broken.waypoints", 2),
        ("unusable", "missing.plan", 1),
    ]
    assert run("good.waypoints", "--format", "sarif").exit_code == 0


def test_junit_has_a_suite_for_each_and_a_case_for_each_leg(missions):
    root = ET.fromstring(run(*missions[:2], "--mission", "broken.waypoints", "--format", "junit").stdout)
    counts = [(one.get("name"), one.get("tests"), one.get("failures"), one.get("errors")) for one in root]
    assert counts == [
        ("broken.waypoints", "1", "0", "1"), ("good.waypoints", "2", "0", "0"), ("bad.waypoints", "3", "1", "0"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "arguments",
    [
        ["--format", "html", "good.waypoints"],
        ["--format", "sarif", "--json", "good.waypoints"],
        ["--format", "sarif"],
        ["good.waypoints", "--plot", "a.png"],
        ["good.waypoints", "--start", HOME],
        ["good.waypoints", "--gps", "x"],
        ["good.waypoints", "--place", "x"],
        ["good.waypoints", "--cluster", "scheduler"],
    ],
)
def test_wrong_usage_is_said_before_any_is_checked(missions, arguments):
    result = run(*arguments)
    assert result.exit_code == 2
    assert "PASS" not in result.stdout


def test_results_name_files_as_they_were_asked_for(missions, tmp_path):
    """On a worker that does not see them they are copies, which nobody else knows."""
    copies = tmp_path / "copies"
    copies.mkdir()
    Path("fence.waypoints").write_text(
        Path("fence.waypoints").read_text() + "9\t0\t3\t5004\t4\t0\t0\t0\t41.0\t-105.23\t0\t1\n"
    )
    files = files_of(Path("good.waypoints"), Path("fence.waypoints"), Path("rover.parm"))
    for file in files:
        shutil.copy(file, copies)
    asked = CheckOptions(mission=files[0], fence=files[1], vehicle=files[2], json_output=True)
    here = check_task(Task(AskedCheck(asked, files), files))
    there = check_task(Task(AskedCheck(asked, files), tuple(copies / file.name for file in files)))
    assert here == there
    assert any(one.message.startswith("fence.waypoints: ") for one in here.report.findings)
    assert as_asked(3, {Path("a"): Path("b")}) == 3


def test_a_shapefile_goes_with_its_parts(tmp_path):
    for name in ("a.shp", "a.dbf", "a.prj", "b.dbf"):
        (tmp_path / name).touch()
    assert [file.name for file in files_of(tmp_path / "a.shp", None)] == ["a.shp", "a.dbf", "a.prj"]


def test_what_is_extrapolated_is_not_confirmed(missions):
    Path("rover.parm").write_text(Path("rover.parm").read_text() + "\nTURN_RADIUS,7.5\n")
    told = run("good.waypoints", "-q")
    assert told.exit_code == 8
    assert told.stdout.startswith(
        "good.waypoints:1: NOT CONFIRMED: every leg is predicted to keep 2.5 m while driving"
    )
    log = json.loads(run("good.waypoints", "--format", "sarif").stdout)
    assert "not-confirmed" in {one["ruleId"] for one in log["runs"][0]["results"]}
