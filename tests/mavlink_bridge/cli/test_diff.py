"""``pbpp diff``: words, JSON, a picture and the exit code."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app

YARD = Path(__file__).parents[3] / "examples" / "yard"


@pytest.fixture(autouse=True)
def _files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path in YARD.iterdir():
        shutil.copy(path, tmp_path)
    Path("a.waypoints").write_text(Path("drawn.waypoints").read_text())
    Path("b.waypoints").write_text(Path("drawn.waypoints").read_text().replace("40.07209265", "40.07219265"))


def run(*arguments: str):
    return CliRunner().invoke(app, ["diff", *arguments])


def test_the_same_is_0_and_a_difference_8():
    same = run("a.waypoints", "drawn.waypoints")
    assert (same.exit_code, same.stdout.splitlines()[-1]) == (0, "The same")
    other = run("a.waypoints", "b.waypoints", "--plot", "a.svg")
    assert other.exit_code == 8
    lines = other.stdout.splitlines()
    assert lines[0].startswith("mission: 2 items, ")
    assert lines[1].startswith("~ item 2 (WAYPOINT): moved 11.10 m, bearing 0°")
    assert lines[2:] == ["1 difference", "Wrote a.svg"]
    assert "~ 2" in Path("a.svg").read_text(encoding="utf-8") or Path("a.svg").stat().st_size > 1000
    assert run("a.waypoints", "b.waypoints", "-q").stdout == ""


def test_the_document_says_the_same():
    result = run("a.waypoints", "b.waypoints", "--json")
    document = json.loads(result.stdout)
    assert (result.exit_code, document["exit_code"], document["status"]) == (8, 8, "different")
    (one,) = document["differences"]
    assert (one["part"], one["change"], one["name_a"], one["name_b"]) == ("mission", "other", "2", "2")
    assert one["moved_m"] == pytest.approx(11.10, abs=0.01)
    same = run("field.plan", "field.plan", "--json")
    assert (same.exit_code, json.loads(same.stdout)["differences"]) == (0, [])


def test_a_fence_in_two_formats_is_the_same():
    assert CliRunner().invoke(app, ["convert", "fence.waypoints", "fence.plan"]).exit_code == 0
    result = run("fence.waypoints", "fence.plan", "--only", "fence")
    assert (result.exit_code, result.stdout.splitlines()[-1]) == (0, "The same")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["a.waypoints", "fence.waypoints"], 2, "nothing to compare"),
        (["a.waypoints", "b.waypoints", "--only", "rally"], 2, "holds a rally"),
        (["a.waypoints", "b.waypoints", "--only", "home"], 2, "expected one of"),
        (["a.waypoints", "missing.plan"], 3, "missing.plan cannot be read"),
        (["rover.parm", "rover.parm"], 2, "neither"),
        (["a.waypoints", "b.waypoints", "--plot", "-", "--json"], 2, "standard output"),
    ],
)
def test_what_cannot_be_compared_is_one_clear_error(arguments, code, message):
    result = run(*arguments)
    assert result.exit_code == code
    assert message in result.stderr
