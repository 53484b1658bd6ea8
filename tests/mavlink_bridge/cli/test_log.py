"""``pbpp log``: tables, documents and pictures of logs."""

from __future__ import annotations

import json

import pytest
from logbook.making import BEGIN_S, FIELD, Log
from rich.console import Console
from rich.text import Text
from typer.testing import CliRunner

from mavlink_bridge.cli import log as log_module
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.options.log import LogOptions
from missions.errors import MissionFormatError
from missions.fence import Fence
from missions.geo import LatLon
from missions.picture import draw_scene
from missions.picture.drives import drive_scene
from missions.picture.page import scene_drawing


def run(*arguments: str):
    return CliRunner(env={"COLUMNS": "160"}).invoke(app, ["log", *arguments])


def test_tells_people_what_happened(logs):
    result = run(str(logs / "mission-yard.tlog"))
    assert result.exit_code == 0
    for text in (
        "57.7 s from 2026-11-22 02:17:42 UTC, 6120 messages",
        "Vehicle 1: 38.1 m driven\n",
        "Breach 1: left the fence at 55.5 s, 40.0715683,-105.2297445; 5.41 m inside exclusion polygon 1",
        "Drive 1 from 43.4 s: items 1 to 2",
        "least clearance: 0.32 m; predicted to leave the fence",
        "1 of 2 waypoints reached",
        "predicted",
        "within the predicted corridor",
        "read-back",
        "16 of 16",
        "255/230",
        "INITIALISING",
        "WP_RADIUS",
    ):
        assert text in result.stdout
    assert "nearest" not in result.stdout
    last = result.stdout.splitlines()[-1]
    assert last == "Verdict on vehicle 1: left the fence once: 5.41 m inside exclusion polygon 1"


def test_a_vehicle_that_never_drove_is_told(logs):
    told = run(str(logs / "union-rally.tlog")).stdout.splitlines()[-1]
    assert told == "Verdict on vehicle 1: never drove while armed: the track was not compared with the fence"


def test_a_terminal_of_80_columns_breaks_no_word(logs, monkeypatch, capsys):
    wide = run(str(logs / "mission-yard.tlog")).stdout
    assert max(map(len, wide.splitlines())) > 80
    monkeypatch.setattr(log_module, "console", lambda: Console(force_terminal=True, width=80))
    log_module.log(LogOptions(files=[logs / "mission-yard.tlog"]))
    told = Text.from_ansi(capsys.readouterr().out).plain
    assert max(map(len, told.splitlines())) <= 80
    assert set(told.split()) == set(wide.split())


def test_the_messages_are_told_on_request(logs):
    yard = str(logs / "mission-yard.tlog")
    assert "GLOBAL_POSITION_INT" not in run(yard).stdout
    assert "GLOBAL_POSITION_INT" in run(yard, "--messages").stdout
    assert run(yard, "--json").stdout == run(yard, "--json", "--messages").stdout


def test_a_drive_within_the_fence_ends_with_its_least_clearance(logs):
    told = run(str(logs / "guided-maze.tlog")).stdout
    assert "Least clearance: 5.13 m at 70.5 s" in told
    assert told.splitlines()[-1] == (
        "Verdict on vehicle 1: stayed inside the fence; least clearance 5.13 m, from inclusion polygon 1"
    )
    assert (
        run(str(logs / "no-fence.tlog"))
        .stdout.splitlines()[-1]
        .endswith("no fence in the log, so no clearance was measured")
    )


@pytest.fixture
def two_drives(tmp_path):
    """Two drives of a mission, the second off its lines; between them one by hand out of the fence."""
    log = Log()
    log.heartbeat()
    log.parameters()
    log.fence()
    log.mission([(0, 40), (30, 40), (30, 0), (-20, -30)])
    log.drive([(0, 0), (0, 40), (30, 40), (30, 0), (-20, -30)])
    log.drive([(-20, -30), (-60, -30), (-20, 0)], mode=0)
    log.drive([(-20, 0), (0, 40), (15, 15), (30, 0), (-20, -30)])
    log.heartbeat(4, armed=True)
    return log.write(tmp_path / "two.tlog")


def test_the_side_of_the_fence_and_the_tolerance_are_named(two_drives):
    told = run(str(two_drives)).stdout
    assert "10.00 m outside inclusion polygon 1" in told
    assert "5.00 m inside exclusion polygon 1" in told
    assert (
        "within the predicted corridor and the 0.25 m allowed for position error (0.23 m outside it)" in told
    )
    assert "m outside the predicted corridor (0.25 m is allowed for position error)" in told
    assert told.splitlines()[-1] == (
        "Verdict on vehicle 1: left the fence 2 times, at most 10.00 m outside inclusion polygon 1; "
        "drive 2 left the predicted corridor"
    )


def test_a_picture_tells_drives_apart_and_names_start_and_breaches(two_drives, tmp_path):
    path = tmp_path / "two.svg"
    assert run(str(two_drives), "--plot", str(path)).exit_code == 0
    text = path.read_text()
    for words in (
        "drive 1 (AUTO)",
        "MANUAL",
        "drive 2 (AUTO)",
        "breach 1",
        "breach 2",
        "left the fence",
        "start",
    ):
        assert f">{words}</text>" in text
    sketch = run(str(two_drives), "--plot", "-").stdout
    assert sketch.count("✗") == 3  # two breaches, and the legend
    assert "S start" in sketch
    assert run(str(two_drives), "--plot", "-", "--json").exit_code == 2


def test_a_mission_has_as_many_items_everywhere(logs, tmp_path, monkeypatch):
    """With home, as on the vehicle: in the log, its transfers, a check of it, a replay."""
    yard = str(logs / "mission-yard.tlog")
    (vehicle,) = json.loads(run(yard, "--json").stdout)["logs"][0]["vehicles"]
    counts = {vehicle["mission_items"], *(t["seen"] for t in vehicle["transfers"] if t["kind"] == "mission")}
    checked = CliRunner().invoke(app, ["check", "--log", yard, "--json"])
    counts.add(json.loads(checked.stdout)["mission_items"])
    assert counts == {3}


def test_one_document_with_everything(logs):
    result = run(str(logs / "mission-yard.tlog"), str(logs / "no-fence.tlog"), "--json")
    document = json.loads(result.stdout)
    assert (result.exit_code, document["status"], document["command"]) == (0, "ok", "log")
    yard, bare = document["logs"]
    assert yard["log"] == "mission-yard.tlog"
    assert {(row["system"], row["component"]) for row in yard["messages"]} == {(1, 1), (1, 190), (255, 230)}
    (vehicle,) = yard["vehicles"]
    assert vehicle["fences"][0]["exclusion_polygons"] == 2
    assert vehicle["mission_items"] == 3
    assert vehicle["home"] == [40.071374, -105.22993]
    assert [transfer["kind"] for transfer in vehicle["transfers"]] == ["fence", "fence", "mission", "mission"]
    assert vehicle["nearest"]["clearance_m"] == 0.0
    assert vehicle["intrusions"][0]["zone"] == "exclusion polygon 1"
    assert vehicle["intrusions"][0]["begun_at"] == [40.0715683, -105.2297445]
    (drive,) = vehicle["drives"]
    assert drive["is_as_foreseen"] is True
    assert drive["took_s"] == 6.5
    assert drive["foreseen"]["took_s"] > 6
    assert bare["vehicles"][0]["nearest"] is None
    assert bare["vehicles"][0]["targets"][0]["position"] == [40.0717, -105.2295]


def test_a_log_among_several_that_is_none(logs, tmp_path):
    (tmp_path / "none.tlog").write_text("no log at all\n" * 10)
    arguments = (str(tmp_path / "none.tlog"), str(logs / "no-fence.tlog"))
    result = run(*arguments, "--json")
    document = json.loads(result.stdout)
    assert (result.exit_code, document["status"], document["exit_code"]) == (3, "error", 3)
    assert document["logs"][0]["error"] == "LogError"
    assert document["logs"][1]["vehicles"]
    people = run(*arguments)
    assert people.exit_code == 3
    assert "none.tlog" in people.stderr
    assert "no-fence.tlog" in people.stdout
    assert run(*arguments[:1]).exit_code == 3


def test_wrong_usage(logs):
    yard = str(logs / "mission-yard.tlog")
    assert run(yard, yard, "--plot", "a.png").exit_code == 2
    assert run(yard, "--plot", "a.bmp").exit_code == 3
    assert run(yard, "--system", "9").exit_code == 3
    assert run("missing.tlog").exit_code == 3
    assert run().exit_code == 2


def test_many_rows_are_cut_and_said(tmp_path):
    log = Log()
    log.parameters()
    for count in range(120):
        log.heartbeat(count % 2, armed=bool(count % 3))
    log.now_s += 8000
    log.heartbeat()
    result = run(str(log.write(tmp_path / "busy.tlog")))
    assert "the last 40 of 121" in result.stdout
    assert "2 h 13 min 21 s" in result.stdout
    assert "the log contains no fence" in result.stdout


def test_strange_names_and_clocks_are_told_plainly(tmp_path):
    log = Log()
    log.heartbeat()
    log.now_s += 200 * 86_400
    log.heartbeat()
    path = log.write(tmp_path / "[bold]odd.tlog")
    path.write_bytes(path.read_bytes() + b"\xfe\xfe\xfe")
    result = run(str(path))
    assert "[bold]odd.tlog" in result.stdout
    assert "clock was set 1 time " in result.stdout
    assert "Damage skipped" in result.stdout


def test_a_clock_that_stands_still_is_told(tmp_path):
    log = Log()
    for _ in range(12):
        log.heartbeat()
    log.rows = [(0.0, sender, message) for _, sender, message in log.rows]
    path = log.write(tmp_path / "still.tlog")
    told = "the log's clock does not advance: 12 heartbeats of one vehicle"
    assert told in run(str(path)).stdout.replace("\n", " ")
    document = json.loads(run(str(path), "--json").stdout)
    assert document["logs"][0]["clock_trouble"].startswith(told)


@pytest.mark.parametrize(
    ("begins_s", "told"), [(3.3e10, "3015-09-24 10:40:00 UTC"), (2.6e11, "2.6e+11 s after 1970")]
)
def test_a_clock_that_was_far_off_is_told_too(tmp_path, begins_s, told):
    """Some systems know no dates after the year 3000, Python none after 9999."""
    log = Log(now_s=begins_s - BEGIN_S)
    log.heartbeat()
    result = run(str(log.write(tmp_path / "odd.tlog")))
    assert result.exit_code == 0
    assert told in result.stdout


@pytest.mark.parametrize("suffix", [".png", ".svg", ".html"])
def test_pictures(logs, tmp_path, suffix):
    path = tmp_path / f"drive{suffix}"
    result = run(str(logs / "mission-yard.tlog"), "--plot", str(path))
    assert result.exit_code == 0
    assert f"Wrote {path}" in result.stdout
    content = path.read_bytes()
    assert len(content) > 5000
    if suffix == ".svg":
        text = content.decode()
        assert all(name in text for name in ("AUTO", "HOLD", "inclusion", "exclusion", "mission"))


def test_a_picture_of_nothing_or_of_several_is_refused(tmp_path, logs):
    log = Log()
    log.row((255, 230), log_heartbeat())
    nothing = str(log.write(tmp_path / "station.tlog"))
    assert run(nothing, "--plot", str(tmp_path / "a.png")).exit_code == 3
    log.heartbeat()
    silent = str(log.write(tmp_path / "silent.tlog"))
    assert run(silent, "--plot", str(tmp_path / "a.png")).exit_code == 3
    log.row((2, 1), log_heartbeat(mav_type=10, autopilot=3))
    several = str(log.write(tmp_path / "several.tlog"))
    assert run(several, "--plot", str(tmp_path / "a.png")).exit_code == 2
    yard = str(logs / "mission-yard.tlog")
    assert run(yard, "--plot", str(tmp_path / "nowhere" / "a.png")).exit_code == 3


def log_heartbeat(mav_type=6, autopilot=8):
    from mavlink_bridge.mavlink.messages import Heartbeat

    return Heartbeat(mav_type, autopilot)


def test_the_picture_shows_each_mode_once_and_the_track_in_place(tmp_path):
    places = [LatLon(40.0, -105.0), LatLon(40.0001, -105.0), LatLon(40.0002, -105.0)]
    parts = [("AUTO", places[:2]), ("HOLD", places[1:]), ("AUTO", places[1:])]
    scene = drive_scene(("A drive",), Fence(FIELD.zones), parts, targets=(places[2],))
    drawing = scene_drawing(scene)
    assert [part.text for part in drawing.around if part.name == "legend"][-4:] == [
        "AUTO",
        "HOLD",
        "start",
        "target",
    ]
    auto, hold, again = (part for part in drawing.inside if part.name == "track")
    assert auto.look == again.look != hold.look
    left, top, _right, bottom = drawing.frame
    m_per_pt = (scene.bounds_m[3] - scene.bounds_m[1]) / (bottom - top)
    (begin, end) = auto.lines[0]
    assert (begin - end)[1] * m_per_pt == pytest.approx(11.1, abs=0.05)
    start = (
        (begin[0] - left) * m_per_pt + scene.bounds_m[0],
        (bottom - begin[1]) * m_per_pt + scene.bounds_m[1],
    )
    assert scene.start == pytest.approx(start, abs=0.01)
    west, south, east, north = scene.bounds_m
    assert (east - west, north - south) == pytest.approx((112.0, 112.0), abs=1.0)
    with pytest.raises(MissionFormatError, match="nothing to draw"):
        drive_scene((), None, ())
    with pytest.raises(MissionFormatError, match=r"drive\.bmp: '\.bmp' is not a supported picture format"):
        draw_scene(scene, tmp_path / "drive.bmp")


def test_more_drives_than_can_be_told_apart_share_a_name():
    places = [LatLon(40.0, -105.0), LatLon(40.0001, -105.0)]
    for count, names in ((24, 24), (25, 24), (40, 24)):
        scene = drive_scene((), None, [(f"drive {number}", places) for number in range(count)])
        found = [track.name for track in scene.tracks]
        assert len(set(found)) == names
        assert found.count("other drives") == (count - 23 if count > 24 else 0)
