"""``pbpp plan --batch``: a plan for each row of a table, whatever its format; rows that have none stop no other."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import duckdb
import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.batch_rows import COLUMNS, read_rows
from mavlink_bridge.cli.plan_batch import _results_file
from mavlink_bridge.errors import UsageError
from missions.formats import read_mission

YARD = Path(__file__).parents[3] / "examples" / "yard"
HOME, TARGET = "40.071374,-105.229930", "40.07228,-105.22907"
ROWS = [
    {"name": "first", "start": HOME, "target": TARGET, "output": "first.waypoints"},
    {"name": "close", "start": HOME, "target": TARGET, "clearance": "0.5"},
    {"name": "outside", "start": HOME, "target": "40.0726,-105.2290"},
    {"name": "odd", "start": "here", "target": TARGET},
    {"name": "two", "start": HOME, "target": f"40.0720,-105.2299;{TARGET}"},
    {"name": "none", "fence": "missing.waypoints", "start": HOME, "target": TARGET},
    {"name": "fast", "start": HOME, "target": TARGET, "speed": "999"},
]


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("field").mkdir()
    for name in ("fence.waypoints", "rover.parm"):
        shutil.copy(YARD / name, "field")
    rows = [{"fence": "fence.waypoints", "vehicle": "rover.parm", **row} for row in ROWS]
    with Path("field/plans.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    return Path("field/plans.csv")


def run(*arguments: str | Path):
    return CliRunner().invoke(app, ["plan", "--batch", *map(str, arguments), "--home", HOME])


def told(text: str) -> list[dict]:
    rows = [json.loads(line) for line in text.splitlines()]
    return [{key: value for key, value in row.items() if key != "planning_s"} for row in rows]


def test_each_row_has_its_plan_or_its_error(table):
    result = run(table, "--jobs", "1")
    rows = told(result.stdout)
    assert [(row["row"], row["name"], row["status"], row["exit_code"]) for row in rows] == [
        (1, "first", "ok", 0), (2, "close", "ok", 0), (3, "outside", "error", 4), (4, "odd", "error", 2),
        (5, "two", "ok", 0), (6, "none", "error", 3), (7, "fast", "error", 2),
    ]  # fmt: skip
    assert result.exit_code == 2
    assert "7 rows: 3 plans, 4 without one" in result.stderr
    assert [row["clearance_m"] for row in rows[:2]] == [2.5, 0.5]
    assert len(rows[4]["targets"]) == 2
    assert rows[0]["outputs"] == ["field/first.waypoints"]
    assert "field/missing.waypoints cannot be read" in rows[5]["message"]
    assert rows[6]["message"].startswith("speed '999'")
    alone = CliRunner().invoke(
        app, ["plan", "--fence", "field/fence.waypoints", "--vehicle", "field/rover.parm", "--start", HOME, "--target", TARGET,
              "--home", HOME, "--json", "-o", "alone.waypoints"],
    )  # fmt: skip
    plan = json.loads(alone.stdout)
    assert all(
        rows[0][key] == plan[key]
        for key in ("path", "length_m", "clearance_m", "driven_clearance_m", "warnings")
    )
    assert read_mission("field/first.waypoints").items == read_mission("alone.waypoints").items
    quiet = run(table, "--jobs", "2", "-q")
    assert (told(quiet.stdout), quiet.stderr) == (rows, "")


def test_json_lines_and_parquet_say_the_same(table):
    rows = told(run(table, "--jobs", "1", "-q").stdout)
    lines = [{"name": row.get("name"), "fence": "fence.waypoints", **row} for row in map(dict, ROWS)]
    for row in lines:
        row["target"] = [[float(part) for part in one.split(",")] for one in row["target"].split(";")]
        row["clearance"] = float(row.pop("clearance", 2.5))
    Path("field/plans.jsonl").write_text("\n\n".join(map(json.dumps, lines)))
    duckdb.sql(
        "COPY (SELECT * FROM read_json('field/plans.jsonl')) TO 'field/plans.parquet' (FORMAT parquet)"
    )
    for kind in ("jsonl", "parquet"):
        result = run(
            f"field/plans.{kind}",
            "--vehicle",
            "field/rover.parm",
            "--jobs",
            "1",
            "-o",
            "out.jsonl",
            "-o",
            "out.parquet",
        )
        assert result.exit_code == 2
        assert result.stdout.splitlines() == [
            "7 rows: 3 plans, 4 without one",
            "Wrote out.jsonl",
            "Wrote out.parquet",
        ]
        found = told(Path("out.jsonl").read_text())
        assert [row.get("path") for row in found] == [row.get("path") for row in rows]
        table = duckdb.sql("SELECT row, status, path, exit_code FROM 'out.parquet' ORDER BY row").fetchall()
        assert table == [(row["row"], row["status"], row.get("path"), row["exit_code"]) for row in found]
    assert sorted(path.name for path in Path().iterdir()) == ["field", "out.jsonl", "out.parquet"]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "fence,clearence\nx,2\n", "unknown column 'clearence'"),
        ("a.csv", "fence,start, start\nx,2,3\n", "column 'start' appears twice"),
        ("a.csv", b"fence\n\xff\n", "a.csv is not a text file; expected UTF-8"),
        ("a.csv", "fence\n".encode("utf-16-le"), "unknown column"),
        ("a.csv", "", "a.csv is empty; the first line names the columns"),
        ("a.csv", "\ufeff", "a.csv is empty; the first line names the columns"),
        ("a.csv", 'fence\n"x\n', "a.csv: line"),
        ("a.parquet", "no parquet", "a.parquet"),
        ("a.txt", "", "expected a table"),
    ],
)
def test_a_table_that_cannot_be_read_is_one_clear_error(tmp_path, monkeypatch, name, text, message):
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
    result = run(name, "--jobs", "1", "-o", "out.jsonl")
    assert result.exit_code in (2, 3)
    assert message in result.stderr
    assert [path.name for path in Path().iterdir()] == [name]


@pytest.mark.parametrize(
    ("name", "lines", "code", "message"),
    [
        ("a.jsonl", ["{GOOD}", '{"start": ', "{GOOD}"], 3, "a.jsonl: line 2: not JSON"),
        ("a.jsonl", ["{GOOD}", "", "[1]", "{GOOD}"], 3, "a.jsonl: line 3: expected an object"),
        ("a.jsonl", ["{GOOD}", '{"start": "1,2", "start": "3,4"}', "{GOOD}"], 3, "a key appears twice"),
        ("a.jsonl", ["{GOOD}", "\udcff", "{GOOD}"], 3, "line 2: not JSON"),
        ("a.jsonl", ["{GOOD}", "[" * 100_000, "{GOOD}"], 3, "line 2: not JSON"),
        ("a.jsonl", ["{GOOD}", '{"clearence": 2}', "{GOOD}"], 2, "row 2: unknown column 'clearence'"),
        (
            "a.csv",
            ["start,target", "{CELLS}", "1,2,3", "{CELLS}"],
            3,
            "a.csv: line 3: more cells than the 2 columns",
        ),
    ],
)
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_row_that_cannot_be_read_is_its_own_error_and_the_rest_is_planned(
    table, name, lines, code, message, jobs
):
    good = json.dumps({"start": HOME, "target": TARGET})
    text = "\n".join(lines).replace("{GOOD}", good).replace("{CELLS}", f'"{HOME}","{TARGET}"')
    Path(name).write_bytes(text.encode(errors="surrogateescape"))
    files = ("--fence", "field/fence.waypoints", "--vehicle", "field/rover.parm")
    result = run(name, "--jobs", jobs, *files)
    assert result.exit_code == code
    rows = told(result.stdout)
    assert [(row["row"], row["status"], row["exit_code"]) for row in rows] == [
        (1, "ok", 0),
        (2, "error", code),
        (3, "ok", 0),
    ]
    assert message in rows[1]["message"]
    assert rows[1]["name"] is None
    assert rows[0]["path"] == rows[2]["path"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["--json"],
        ["-o", "a.plan"],
        ["-o", "none/a.jsonl"],
        ["--plot", "a.png"],
        ["--upload"],
        ["--clearance", "x"],
        ["--place", "A=1,2"],
    ],
)
def test_wrong_usage_is_said_before_any_plan(table, arguments):
    result = run(table, *arguments)
    assert result.exit_code in (2, 3)
    assert "Traceback" not in result.output


def test_jobs_are_for_tables():
    assert CliRunner().invoke(app, ["plan", "--fence", "a.plan", "--jobs", "2"]).exit_code == 2


def test_without_duckdb_what_to_install(table, monkeypatch):
    monkeypatch.setitem(sys.modules, "duckdb", None)
    result = run(table, "-o", "a.parquet")
    assert result.exit_code == 2
    assert "pbpp-rover[data]" in result.stderr


@pytest.mark.parametrize("cell", [True, {"a": 1}, [1, 2, 3]])
def test_cells_that_are_no_text_are_refused(table, cell):
    Path("field/odd.jsonl").write_text(json.dumps({"fence": "fence.waypoints", "start": cell}))
    (row,) = told(run("field/odd.jsonl", "--jobs", "1").stdout)
    assert (row["exit_code"], row["error"]) == (2, "UsageError")
    Path("field/odd.jsonl").write_text(json.dumps({"start": HOME}))
    (row,) = told(run("field/odd.jsonl", "--jobs", "1").stdout)
    assert row["message"].startswith("no fence")


def test_rows_are_read_as_they_are_needed(tmp_path):
    """A table that never ends has a first row."""
    path = tmp_path / "a.csv"
    path.write_text("name\n" + "x\n" * 100_000)
    assert next(iter(read_rows(path))) == {"name": "x"}


def test_a_run_that_ends_early_leaves_what_was_there(tmp_path):
    path = tmp_path / "a.jsonl"
    path.write_text("before")
    results = _results_file(path)
    results.__enter__()({"row": 1})
    assert not results.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name != "posix", reason="SIGTERM")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_ended_by_a_signal_leaves_nothing(table, number):
    with Path("field/plans.csv").open("a", encoding="utf-8") as file:
        file.writelines(f'{name},fence.waypoints,"{HOME}","{TARGET}"\n' for name in range(1000))
    words = [
        "plan",
        "--batch",
        str(table),
        "--home",
        HOME,
        "--jobs",
        "2",
        "-o",
        "out.jsonl",
        "-o",
        "out.parquet",
    ]
    before = sorted(Path().rglob("*"))
    with subprocess.Popen(
        [sys.executable, "-m", "mavlink_bridge.cli", *words], stderr=subprocess.PIPE
    ) as process:
        while not any(path.stat().st_size for path in Path().glob(".pbpp-*/results.jsonl")):
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"error: interrupted" in told
    assert [path for path in sorted(Path().rglob("*")) if path.name != "first.waypoints"] == before


def test_no_plan_takes_anothers_place(tmp_path):
    table = tmp_path / "a.csv"
    for spelt in (
        "one.waypoints",
        "./one.waypoints",
        "sub/../one.waypoints",
        " one.waypoints",
        str(tmp_path / "one.waypoints"),
    ):
        table.write_text(f"fence,output\na,one.waypoints\nb,\nc,\nd,{spelt}\ne,\n")
        *before, refused, after = read_rows(table)
        assert [row["fence"] for row in (*before, after)] == ["a", "b", "c", "e"]
        assert isinstance(refused, UsageError)
        assert str(refused).startswith(f"{table}: row 4: output ")
        assert "is that of row 1 too" in str(refused)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_tables_as_spreadsheets_write_them(tmp_path, between, encoding):
    path = tmp_path / "a.csv"
    with path.open("w", newline="", encoding=encoding) as file:
        writer = csv.writer(file, delimiter=between)
        writer.writerows([["name", "fence", "start"], ["Bär", "a.plan", HOME], ["q", 'a"b', "1;2"]])
    assert list(read_rows(path)) == [
        {"name": "Bär", "fence": "a.plan", "start": HOME},
        {"name": "q", "fence": 'a"b', "start": "1;2"},
    ]


def test_a_parquet_file_is_read_by_its_own_name(tmp_path):
    """To DuckDB brackets, stars and question marks are a pattern: it would read other files."""
    for name in ("g[1].parquet", "g1.parquet", "h?.parquet", "hh.parquet", "*.parquet"):
        duckdb.sql(
            f"COPY (SELECT '{name}' AS name, 1.5 AS clearance) TO '{tmp_path}/{name}' (FORMAT parquet)"
        )
    for path in tmp_path.iterdir():
        assert [row["name"] for row in read_rows(path)] == [path.name]


def test_decimal_numbers_of_a_database_are_numbers(table):
    duckdb.sql(
        "COPY (SELECT 'fence.waypoints' AS fence, 'rover.parm' AS vehicle, [40.071374, -105.229930] AS start, "
        "[[40.07228, -105.22907]] AS target, 0.5 AS clearance) TO 'field/a.parquet' (FORMAT parquet)"
    )
    (row,) = told(run("field/a.parquet", "--jobs", "1").stdout)
    assert (row["status"], row["clearance_m"]) == ("ok", 0.5)
