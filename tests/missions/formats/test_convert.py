"""``pbpp convert``, run as people run it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
import typer
from typer.testing import CliRunner

from mavlink_bridge.cli.common import command_of
from missions.formats import read_fence, read_mission, read_parameters, read_situation

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result

app = typer.Typer(pretty_exceptions_enable=False)
app.command()(command_of("convert"))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("suffix", [".plan", ".geojson", ".kml", ".txt"])
def test_a_fence_from_format_to_format(fields: Path, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    result = run(fields / "yard-fence.waypoints", path)
    assert (result.exit_code, result.stdout) == (0, f"Wrote {path}: 4 fence zones\n")
    assert read_fence(path) == read_fence(fields / "yard-fence.waypoints")


def test_json_and_quiet(fields: Path, tmp_path: Path) -> None:
    source, path = fields / "yard-mission.waypoints", tmp_path / "x.gpx"
    result = run(source, path, "--json")
    assert json.loads(result.stdout) == {
        "status": "ok",
        "command": "convert",
        "source": str(source),
        "outputs": [str(path)],
        "parts": ["mission"],
        "left_out": [],
        "info": [],
        "warnings": [],
    }
    assert run(source, path, "-q").stdout == ""


PLAN = {
    "fileType": "Plan",
    "version": 1,
    "mission": {
        "version": 2,
        "plannedHomePosition": [40.0, -105.0, 0],
        "items": [
            {
                "type": "SimpleItem",
                "command": 16,
                "frame": 3,
                "params": [0, 0, 0, None, 40.0005, -104.9995, 0],
            },
            {"type": "SimpleItem", "command": 178, "frame": 2, "params": [1, 2, 0, 0, 0, 0, 0]},
        ],
    },
    "geoFence": {
        "version": 2,
        "circles": [],
        "polygons": [
            {"inclusion": True, "version": 1, "polygon": [[40, -105], [40, -104.999], [40.001, -104.999]]}
        ],
    },
    "rallyPoints": {"version": 2, "points": [[40.0002, -104.9993, 0]]},
}


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "all.plan"
    path.write_text(json.dumps(PLAN))
    return path


def test_a_choice_is_asked_for_where_one_list_fits(plan: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.waypoints"
    result = run(plan, out)
    assert result.exit_code == 2
    assert (
        "holds mission and fence and rally, and a .waypoints file can hold only one of them" in result.stderr
    )
    assert "--only mission or --only fence or --only rally" in result.stderr
    assert not out.exists()
    assert run(plan, out, "--only", "fence").exit_code == 0
    assert read_fence(out).vertex_count == 3
    assert run(plan, out, "--only", "mission").exit_code == 0
    assert len(read_mission(out).items) == 2


def test_what_is_left_out_is_told(plan: Path, tmp_path: Path) -> None:
    result = run(plan, tmp_path / "x.gpx", "--json")
    document = json.loads(result.stdout)
    assert document["left_out"] == ["fence", "rally"]
    assert document["warnings"] == [
        "1 fence zone left out: a .gpx file holds no fence",
        "1 rally point left out: a .gpx file holds no rally",
        "1 mission item without a place left out: a .gpx file holds the route only",
    ]
    assert [f"warning: {text}" for text in document["warnings"]] == result.stderr.splitlines()


def test_return_points(plan: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.fen"
    result = run(plan, out)
    assert result.exit_code == 3
    assert "a .fen file needs a return point, but the fence has none" in result.stderr
    assert run(plan, out, "--return-point", "40.0003,-104.9992").exit_code == 0
    assert read_fence(out).return_point == (40.0003, -104.9992)
    result = run(out, tmp_path / "x.poly")
    assert result.exit_code == 0
    assert "the return point is left out: a .poly file holds none" in result.stderr


def test_parameters(tmp_path: Path) -> None:
    source, out = tmp_path / "x.param", tmp_path / "y.parm"
    source.write_text("WP_SPEED,2\n")
    assert run(source, out).stdout == f"Wrote {out}: 1 parameter\n"
    assert read_parameters(out) == {"WP_SPEED": 2}


@pytest.mark.parametrize(
    ("arguments", "code", "problem"),
    [
        (["all.plan", "all.plan"], 2, "is the same file as IN"),
        (["all.plan", "x.geojson", "--only", "fences"], 2, "--only 'fences': expected one of mission, fence, rally, parameters"),
        (["all.plan", "x.geojson", "--only", "parameters"], 3, "a .geojson file contains no parameters; it contains mission or fence or rally"),
        (["all.plan", "x.poly", "--only", "mission"], 3, "a .poly file contains no mission"),
        (["all.plan", "x.geojson", "--return-point", "north"], 2, "'north' is not a position"),
        (["x.parm", "y.parm", "--return-point", "1,2"], 2, "--return-point needs a fence, and IN has none"),
        (["none.plan", "x.geojson"], 3, "none.plan cannot be read: No such file"),
        (["none.plan", "all.plan"], 3, "none.plan cannot be read: No such file"),
        (["all.plan", "x.tlog"], 3, "cannot write files with extension '.tlog'"),
        (["all.plan", "x"], 3, "cannot write files with extension ''"),
        (["all.plan", "x.parm"], 3, "there is no parameters to write"),
        (["x.gpx", "x.plan"], 3, "x.gpx cannot be read: No such file"),
        (["all.plan", "none/x.plan"], 3, "cannot be written: No such file"),
    ],
)  # fmt: skip
def test_what_goes_wrong_is_one_clear_error(
    plan: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int, problem: str
) -> None:
    monkeypatch.chdir(plan.parent)
    (plan.parent / "x.parm").write_text("WP_SPEED 2\n")
    result = run(*arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert problem in result.stderr
    assert [line.split(":")[0] for line in result.stderr.splitlines()] in (["error"], ["error", "advice"])
    assert read_situation(plan).mission is not None
