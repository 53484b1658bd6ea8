"""Files that pbpp wrote are replaced; any other file, and any part of a .plan that a command did not read, is first kept as NAME.bak."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli import kept_files
from mavlink_bridge.cli.app import app
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.shell import Simulator
from missions.errors import MissionFormatError
from missions.fence import fence_to_items
from missions.formats import Part, read_fence, read_situation, write_situation
from missions.geo import LatLon
from missions.items import MissionItem
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Situation

FIELDS = Path(__file__).parents[2] / "fields"
MAZE = FIELDS / "maze-fence.waypoints"
WHERE = ("--start", "40.071374,-105.229930", "--target", "40.0726316,-105.2290497", "--corner-allowance", "0")
HAND_MADE = Situation(
    fence=Known(read_fence(MAZE), None, "a test"),
    mission=Known(
        Mission(
            tuple(MissionItem(16, 3, (0.0, 0.0, 0.0, 0.0), 400720000 + i, -1052290000) for i in range(3)),
            LatLon(40.07, -105.23),
        ),
        None,
        "a test",
    ),
    rally=Known((RallyPoint(40.0721, -105.2291),), None, "a test"),
)


@pytest.fixture(autouse=True)
def own_state_folder(tmp_path_factory, monkeypatch):
    folder = tmp_path_factory.mktemp("state")
    monkeypatch.setenv("XDG_STATE_HOME", str(folder))
    return folder


@pytest.fixture
def hand_made(tmp_path):
    """A plan that somebody drew."""
    path = tmp_path / "mine.plan"
    write_situation(HAND_MADE, path)
    path.write_text(path.read_text().replace("PBPP Rover", "QGroundControl"))
    return path


def run(*arguments):
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert result.exit_code == 0, result.output
    return result


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_mission_drawn_by_hand_is_kept_once(hand_made, tmp_path):
    drawn = hand_made.read_bytes()
    planning = ("plan", "--fence", hand_made, *WHERE, "-o", hand_made)
    result = run(*planning)
    assert (
        f"warning: {hand_made} was not written by pbpp, or was changed since; the old file is kept as {hand_made}.bak\n"
        in result.stderr
    )
    assert (tmp_path / "mine.plan.bak").read_bytes() == drawn
    written = read_situation(hand_made)
    assert written.mission.value != HAND_MADE.mission.value
    assert (written.fence.value, written.rally.value) == (HAND_MADE.fence.value, HAND_MADE.rally.value)
    again = run(*planning)
    assert "kept as" not in again.stderr
    assert names(tmp_path) == ["mine.plan", "mine.plan.bak"]


def test_what_pbpp_wrote_and_somebody_changed_is_somebody_elses_again(hand_made, tmp_path):
    output = tmp_path / "out.plan"
    planning = ("plan", "--fence", hand_made, *WHERE, "-o", output)
    run(*planning)
    for number, (old, new) in enumerate((("PBPP Rover", "QGroundControl"), ('"frame": 3', '"frame": 0'))):
        changed = output.read_text().replace(old, new)
        output.write_text(changed)
        assert "kept as" in run(*planning).stderr
        assert (tmp_path / f"out.plan.bak{number + 1 if number else ''}").read_text() == changed
    assert "kept as" not in run(*planning).stderr


def test_json_stays_one_document(hand_made):
    result = run("plan", "--fence", hand_made, *WHERE, "-o", hand_made, "--json")
    assert json.loads(result.stdout)["outputs"] == [str(hand_made)]
    assert "kept as" in result.stderr


@pytest.mark.parametrize("suffix", [".waypoints", ".geojson", ".kml", ".gpx", ".plan"])
def test_every_format_of_plan_and_convert(tmp_path, suffix):
    output = tmp_path / f"out{suffix}"
    output.write_text("somebody's")
    planning = ("plan", "--fence", MAZE, *WHERE, "-o", output)
    assert f"kept as {output}.bak\n" in run(*planning).stderr
    assert (tmp_path / f"out{suffix}.bak").read_text() == "somebody's"
    assert "kept as" not in run(*planning).stderr
    output.write_text("somebody's again")
    source = tmp_path / "yard.waypoints"
    shutil.copy(FIELDS / "yard-mission.waypoints", source)
    converting = ("convert", source, output)
    assert f"kept as {output}.bak2\n" in run(*converting).stderr
    assert "kept as" not in run(*converting).stderr
    assert (tmp_path / f"out{suffix}.bak2").read_text() == "somebody's again"


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".html"])
def test_pictures(tmp_path, suffix):
    picture = tmp_path / f"field{suffix}"
    picture.write_text("a photo of the field")
    planning = ("plan", "--fence", MAZE, *WHERE, "--plot", picture)
    assert f"kept as {picture}.bak\n" in run(*planning).stderr
    assert (tmp_path / f"field{suffix}.bak").read_text() == "a photo of the field"
    assert "kept as" not in run(*planning).stderr
    assert len(names(tmp_path)) == 2


def test_pictures_of_checks_and_logs(tmp_path, logs, hand_made):
    for arguments in (("check", "--mission", hand_made), ("log", logs / "guided-maze.tlog")):
        picture = tmp_path / f"{arguments[0]}.svg"
        picture.write_text("a photo")
        result = CliRunner().invoke(app, [*map(str, arguments), "--plot", str(picture)])
        assert f"kept as {picture}.bak" in result.stderr, result.output
        assert "<svg" in picture.read_text()


def test_recorded_expectations(tmp_path, logs):
    shutil.copy(logs / "no-fence.tlog", tmp_path)
    expected = tmp_path / "no-fence.events.jsonl"
    expected.write_text('{"event": "written by hand"}\n')
    assert f"kept as {expected}.bak" in run("replay", tmp_path / "no-fence.tlog", "--record").stderr
    assert (tmp_path / "no-fence.events.jsonl.bak").read_text() == '{"event": "written by hand"}\n'
    assert "kept as" not in run("replay", tmp_path / "no-fence.tlog", "--record").stderr


class TestDownloads:
    @pytest.fixture
    def rover(self):
        config = SimulatorConfig(
            mission=HAND_MADE.mission.value.items, fence=tuple(fence_to_items(HAND_MADE.fence.value))
        )
        with Simulator(config, "tcpin:127.0.0.1:0", speedup=20.0) as simulator:
            yield simulator

    @pytest.mark.parametrize(
        ("what", "name"),
        [
            ("mission", "field.waypoints"),
            ("fence", "field.txt"),
            ("mission", "field.plan"),
            ("parameters", "r.parm"),
        ],
    )
    def test_somebodys_file_is_kept(self, tmp_path, rover, what, name):
        path = tmp_path / name
        path.write_text("somebody's")
        loading = ("download", what, "--connect", rover.connection, "--timeout", 10, "-o", path)
        assert f"kept as {path}.bak" in run(*loading).stderr
        assert (tmp_path / f"{name}.bak").read_text() == "somebody's"
        assert "kept as" not in run(*loading).stderr
        assert len(names(tmp_path)) == 2

    def test_a_part_that_would_be_lost_is_kept(self, tmp_path, rover):
        path = tmp_path / "field.plan"
        for what in ("mission", "fence"):
            result = run("download", what, "--connect", rover.connection, "--timeout", 10, "-o", path)
        assert (
            f"warning: {path} no longer contains its mission; the old file is kept as {path}.bak\n"
            in result.stderr
        )
        kept = tmp_path / "mission.plan"
        shutil.copy(tmp_path / "field.plan.bak", kept)
        assert read_situation(kept).mission.value.items == HAND_MADE.mission.value.items


def test_a_mission_that_was_only_converted_is_kept_from_a_planned_one(tmp_path):
    write_situation(HAND_MADE, tmp_path / "mine.kml")
    output = tmp_path / "mine.plan"
    converting = ("convert", tmp_path / "mine.kml", output)
    run(*converting)
    assert "kept as" not in run(*converting).stderr
    planning = ("plan", "--fence", output, *WHERE, "-o", output)
    assert (
        f"{output} no longer contains its mission; the old file is kept as {output}.bak"
        in run(*planning).stderr
    )
    assert "kept as" not in run(*planning).stderr


def test_a_converted_fence_goes_into_the_plan_that_is_made_of_it(tmp_path):
    run("convert", MAZE, tmp_path / "field.plan")
    planning = ("plan", "--fence", tmp_path / "field.plan", *WHERE, "-o", tmp_path / "field.plan")
    assert "kept as" not in run(*planning).stderr
    assert names(tmp_path) == ["field.plan"]


def test_rally_points_of_a_plan_of_ours_are_kept_from_one_without(tmp_path, hand_made):
    output = tmp_path / "out.plan"
    run("plan", "--fence", hand_made, *WHERE, "-o", output)
    result = run("plan", "--fence", MAZE, *WHERE, "-o", output)
    assert (
        f"{output} no longer contains its rally points; the old file is kept as {output}.bak" in result.stderr
    )


def test_an_empty_file_is_nobodys(tmp_path):
    (tmp_path / "out.waypoints").touch()
    assert "kept as" not in run("plan", "--fence", MAZE, *WHERE, "-o", tmp_path / "out.waypoints").stderr
    assert names(tmp_path) == ["out.waypoints"]


def test_the_same_content_stays_whoevers_it_is(tmp_path):
    output = tmp_path / "fence.waypoints"
    write_situation(HAND_MADE, output, Part.FENCE)
    mine = output.read_bytes()
    write_situation(HAND_MADE, tmp_path / "fence.plan", Part.FENCE)
    run("convert", tmp_path / "fence.plan", output)
    assert names(tmp_path) == ["fence.plan", "fence.waypoints"]
    run("plan", "--fence", MAZE, *WHERE, "-o", output)
    assert (tmp_path / "fence.waypoints.bak").read_bytes() == mine


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
def test_links_are_kept_and_what_they_lead_to_is_left_alone(tmp_path):
    precious = tmp_path / "precious.waypoints"
    precious.write_text("precious")
    output = tmp_path / "out.waypoints"
    output.symlink_to(precious)
    result = run("plan", "--fence", MAZE, *WHERE, "-o", output)
    assert (
        f"{output} was a link to {precious} (left unchanged); the link is kept as {output}.bak"
        in result.stderr
    )
    assert precious.read_text() == "precious"
    assert not output.is_symlink()
    assert (tmp_path / "out.waypoints.bak").readlink() == precious


def test_a_list_that_cannot_be_read_or_written_makes_everything_somebody_elses(tmp_path, own_state_folder):
    (own_state_folder / "pbpp-rover").write_text("a file where the folder should be")
    planning = ("plan", "--fence", MAZE, *WHERE, "-o", tmp_path / "out.waypoints")
    run(*planning)
    changed = (*planning[:-3], "0.5", *planning[-2:])  # another allowance, so that the file differs
    assert "kept as" in run(*changed).stderr


def test_the_list_forgets_its_older_half(tmp_path, own_state_folder, monkeypatch):
    monkeypatch.setattr(kept_files, "_MOST_BYTES", 1000)
    for number in range(30):
        kept_files.write_kept(tmp_path / "a.txt", f"{number}".encode())
    lines = (own_state_folder / "pbpp-rover" / "written-files.txt").read_text().splitlines()
    assert 5 < len(lines) < 20
    assert names(tmp_path) == ["a.txt"]


def test_files_that_grow_begin_anew_and_keep_what_was_there(tmp_path):
    path = tmp_path / "run.journal.jsonl"
    path.write_text("another run")
    kept_files.make_room(path)
    path.write_text("this run")
    assert (tmp_path / "run.journal.jsonl.bak").read_text() == "another run"
    kept_files.remember(path)
    kept_files.make_room(path)
    assert not path.exists()
    path.write_text("the next")
    assert names(tmp_path) == ["run.journal.jsonl", "run.journal.jsonl.bak"]


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
def test_a_file_that_grows_follows_no_link(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("precious")
    path = tmp_path / "run.journal.jsonl"
    path.symlink_to(precious)
    kept_files.make_room(path)
    path.write_text("this run")
    assert precious.read_text() == "precious"
    assert path.read_text() == "this run"


@pytest.mark.skipif(os.name != "posix", reason="pipes in folders are POSIX's")
def test_a_file_that_grows_takes_no_pipe_away(tmp_path):
    os.mkfifo(tmp_path / "demo.tlog")
    with pytest.raises(MissionFormatError, match="it is not a regular file"):
        kept_files.make_room(tmp_path / "demo.tlog")
    assert (tmp_path / "demo.tlog").is_fifo()
