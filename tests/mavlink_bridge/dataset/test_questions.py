"""Questions to a dataset: ready ones, and SQL."""

from __future__ import annotations

import csv
import json
import shutil
import statistics

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.dataset.questions import QUESTIONS


def pbpp(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, list(map(str, words)))
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module")
def fleet(tmp_path_factory, logs):
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "logs").mkdir()
    for name in ("mission-yard.tlog", "px4/upload-and-square.tlog"):
        shutil.copy(logs / name, folder / "logs")
    code, out, _ = pbpp("logs", "build", folder / "logs", "-o", folder / "dataset", "--jobs", "1")
    assert (code, "2 files, 2 read now, 0 known before, 0 unusable" in out) == (0, True)
    return folder / "dataset"


def rows_of(fleet, *words) -> list[dict]:
    code, out, _ = pbpp("logs", "ask", fleet, *words, "--json")
    assert code == 0
    return json.loads(out)["rows"]


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_question_has_an_answer_a_table_and_a_picture(fleet, name, tmp_path):
    rows = rows_of(fleet, name)
    assert rows
    code, out, _ = pbpp(
        "logs", "ask", fleet, name, "--plot", tmp_path / "one.png", "--csv", tmp_path / "one.csv"
    )
    assert (code, QUESTIONS[name].about.split()[0] in out) == (0, True)
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "one.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    pbpp("logs", "ask", fleet, name, "-q", "--plot", tmp_path / "a.svg")
    pbpp("logs", "ask", fleet, name, "-q", "--plot", tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_a_promise_is_kept_or_not(fleet):
    least = {
        one["drive"]: one["least_clearance_m"] for one in rows_of(fleet, "clearance") if one["vehicle"] == 1
    }
    kept = [one for one in rows_of(fleet, "promise", "--promise", "0.5") if one["vehicle"] == 1]
    for one in kept:
        assert one["kept"] == (least[one["drive"]] >= 0.5)
        assert one["promised_m"] == 0.5


def test_corners_are_those_of_the_legs(fleet):
    legs = rows_of(
        fleet, "--sql", "SELECT * FROM legs WHERE turn_deg IS NOT NULL AND is_whole AND NOT stands"
    )
    classes = rows_of(fleet, "corners")
    assert sum(one["corners"] for one in classes) == len(legs)
    for one in classes:
        mine = [
            leg["inside_cut_m"]
            for leg in legs
            if one["angle_from_deg"] <= abs(leg["turn_deg"]) < one["angle_from_deg"] + 15
            and one["speed_from_mps"] <= leg["speed_mps"] < one["speed_from_mps"] + 0.5
        ]
        assert one["cut_median_m"] == pytest.approx(statistics.median(mine), abs=0.0051)
        assert one["cut_most_m"] == pytest.approx(max(mine), abs=0.0051)


def test_views_are_there(fleet):
    (one,) = rows_of(fleet, "--sql", "SELECT count(*) AS n, count(begun_utc) AS dated FROM drive_grades")
    assert one["n"] == one["dated"] == 2
    (track,) = rows_of(
        fleet, "--sql", "SELECT count(*) AS n, min(lat_deg) AS south FROM track WHERE time_utc IS NOT NULL"
    )
    assert track["n"] > 100
    assert abs(track["south"]) > 1


@pytest.mark.parametrize(
    "sql",
    [
        "COPY legs TO 'stolen.csv'",
        "SELECT * FROM read_csv('/etc/passwd')",
        "SELECT nonsense FROM legs",
        "SET memory_limit = '8GB'",
    ],
)
def test_sql_reads_the_dataset_and_nothing_else(fleet, sql, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = pbpp("logs", "ask", fleet, "--sql", sql)
    assert (code, "error: the SQL is refused" in err) == (3, True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("ask", "fleet"), "ask one question"),
        (("ask", "fleet", "why"), "'why' is not a question"),
        (("ask", "fleet", "modes", "--promise", "1"), "--promise belongs to the question"),
        (
            ("ask", "fleet", "--sql", "SELECT 1", "--plot", "a.png"),
            "--plot draws the answer to a ready question",
        ),
        (("ask", "fleet", "modes", "-o", "x"), "-o is for"),
        (("ask", "fleet", "modes", "--system", "3"), "--system is for `pbpp logs calibrate`"),
        (("build", "fleet"), "needs -o DATASET"),
        (("calibrate", "a", "b", "-o", "x.toml"), "calibrate takes one DATASET"),
        (("melt", "fleet"), "'melt' is not an action"),
    ],
)
def test_what_does_not_fit_together_is_wrong_usage(words, said):
    code, _, err = pbpp("logs", *words)
    assert (code, said in err) == (2, True), err


def test_a_chart_has_a_suffix_that_can_be_drawn(fleet):
    code, _, err = pbpp("logs", "ask", fleet, "modes", "--plot", "a.html")
    assert (code, "is not a supported format of charts" in err) == (3, True)


@pytest.mark.parametrize(
    "sql",
    [
        "COPY (SELECT 1) TO '{}/pbpp-dataset.json'",
        "COPY (SELECT 1) TO '{}/more.parquet'",
        "SELECT 1; COPY (SELECT 1) TO '{}/more.parquet'",
        "EXPLAIN ANALYZE COPY (SELECT 1) TO '{}/more.parquet'",
        "DROP VIEW logs",
        "",
    ],
)
def test_sql_writes_nothing_into_the_dataset(fleet, sql):
    before = {path: path.stat().st_mtime_ns for path in fleet.rglob("*")}
    code, _, err = pbpp("logs", "ask", fleet, "--sql", sql.format(fleet))
    assert code != 0
    assert "the SQL is refused" in err
    assert {path: path.stat().st_mtime_ns for path in fleet.rglob("*")} == before
