"""Logs become tables: the rows of ``pbpp log --json``, once each, whatever happens on the way."""

from __future__ import annotations

import gzip
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dataset.every_row import every_row
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.dataset.build import build, log_files
from mavlink_bridge.dataset.questions import ask_sql
from mavlink_bridge.dataset.schema import TABLES, VIEWS
from mavlink_bridge.dataset.store import Dataset
from mavlink_bridge.errors import DatasetError
from mavlink_bridge.many import open_workers
from mavlink_bridge.mavlink.messages import GlobalPositionInt
from mavlink_bridge.tlog import read_columns

NAMES = ("mission-yard.tlog", "guided-maze.tlog", "px4/upload-and-square.tlog", "px4/fence-breach.tlog")


def pbpp(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(map(str, words)))
    return result.exit_code, result.stdout


def built(dataset: Path, *places: Path, jobs: int = 1) -> object:
    with open_workers(jobs) as workers:
        return build(Dataset(dataset), log_files(places), workers)


@pytest.fixture(scope="module")
def place(tmp_path_factory, logs) -> Path:
    """A folder of four logs, and the dataset of them."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "logs").mkdir()
    for name in NAMES:
        shutil.copy(logs / name, folder / "logs" / Path(name).name)
    progress = built(folder / "dataset", folder / "logs")
    assert (progress.files, progress.read, progress.bad) == (4, 4, [])
    return folder


def rows_as_objects(dataset: Path, sql: str) -> list[dict[str, object]]:
    database = Dataset(dataset).open()
    found = database.execute(sql)
    names = [one[0] for one in found.description]
    rows = [dict(zip(names, row, strict=True)) for row in found.fetchall()]
    database.close()
    return rows


def nearly(found: object, told: object) -> bool:
    if isinstance(told, float) and isinstance(found, float):
        return found == pytest.approx(told, abs=1e-5)
    return found == told


@pytest.mark.parametrize("name", NAMES)
def test_rows_are_those_of_pbpp_log(place, name):
    path = place / "logs" / Path(name).name
    code, out = pbpp("log", path, "--json")
    assert code == 0
    (document,) = json.loads(out)["logs"]
    dataset = place / "dataset"
    (log,) = rows_as_objects(dataset, f"SELECT * FROM logs WHERE name = '{path.name}'")
    assert (log["duration_s"], log["frames"], log["problem"]) == (
        document["duration_s"],
        document["damage"]["frames"],
        None,
    )
    for vehicle in document["vehicles"]:
        where = f"WHERE log = '{log['log']}' AND vehicle = {vehicle['system']}"
        (known,) = rows_as_objects(dataset, f"SELECT * FROM vehicles {where}")
        assert [known[key] for key in ("driven_m", "positions", "positions_without_fix")] == [
            vehicle[key] for key in ("driven_m", "positions", "positions_without_fix")
        ]
        for table, key, order in (
            ("transfers", "transfers", "begun_s"),
            ("targets", "targets", "time_s"),
            ("modes", "modes", "begun_s"),
            ("drives", "drives", "drive"),
        ):
            found = rows_as_objects(dataset, f"SELECT * FROM {table} {where} ORDER BY {order}")
            assert len(found) == len(vehicle[key]), table
            if table != "targets":  # rows of one time may stand in any order
                told = sorted(vehicle[key], key=lambda row: row["begun_s"])
                for one, other in zip(found, told, strict=True):
                    shared = set(one) & set(other) - ({"item"} if table == "drives" else set())
                    assert len(shared) >= 5
                    if table != "transfers":
                        assert all(nearly(one[part], other[part]) for part in shared), table
        grades = rows_as_objects(dataset, f"SELECT * FROM grades {where} ORDER BY drive")
        assert [one["outside_m"] for one in grades] == [one["outside_m"] for one in vehicle["drives"]]
        legs = rows_as_objects(dataset, f"SELECT * FROM legs {where} ORDER BY drive, leg")
        told = [leg for drive in vehicle["drives"] for leg in drive["legs"]]
        assert [[one[part] for part in ("item", "turn_deg", "inside_cut_m")] for one in legs] == [
            [one[part] for part in ("item", "turn_deg", "inside_cut_m")] for one in told
        ]
        parameters = rows_as_objects(dataset, f"SELECT name, value FROM parameters {where}")
        assert {one["name"]: one["value"] for one in parameters} == vehicle["parameters"]
        breaches = rows_as_objects(dataset, f"SELECT * FROM breaches {where} AND source = 'track'")
        assert len(breaches) == len(vehicle["intrusions"])


def test_positions_are_those_on_the_wire_and_zeros_are_null(place, logs):
    columns = read_columns(logs / "guided-maze.tlog", GlobalPositionInt)
    found = rows_as_objects(
        place / "dataset",
        "SELECT p.* FROM positions p JOIN logs l USING (log) WHERE l.name = 'guided-maze.tlog' ORDER BY boot_s",
    )
    assert len(found) == len(columns["lat"])
    for one, lat, lon, boot_ms in zip(
        found, columns["lat"], columns["lon"], columns["time_boot_ms"], strict=True
    ):
        expected = (None, None) if (lat, lon) == (0, 0) else (lat / 1e7, lon / 1e7)
        assert (one["lat_deg"], one["lon_deg"]) == expected
        assert one["boot_s"] == boot_ms / 1000
    assert sum(one["lat_deg"] is None for one in found) > 5


def test_built_again_nothing_is_read_and_nothing_changes(place):
    before = every_row(place / "dataset")
    progress = built(place / "dataset", place / "logs")
    assert (progress.known, progress.read) == (4, 0)
    assert every_row(place / "dataset") == before


def test_folders_are_those_of_month_and_vehicle(place):
    parts = sorted(
        path.parent.relative_to(place / "dataset").as_posix()
        for path in (place / "dataset" / "drives").rglob("*.parquet")
    )
    assert parts == ["drives/month=2026-08/vehicle=3", "drives/month=2026-11/vehicle=1"] or all(
        "month=" in part and "vehicle=" in part for part in parts
    )
    assert {path.name for path in (place / "dataset").iterdir()} == {".lock", "pbpp-dataset.json", *TABLES}


def test_processes_make_the_same(place, tmp_path):
    built(tmp_path / "other", place / "logs", jobs=2)
    assert every_row(tmp_path / "other") == every_row(place / "dataset")


def test_a_copy_and_a_packed_log_are_known_by_their_content(place, tmp_path):
    folder = tmp_path / "logs"
    shutil.copytree(place / "logs", folder)
    dataset = tmp_path / "dataset"
    built(dataset, folder)
    before = every_row(dataset)
    shutil.copy(folder / "mission-yard.tlog", folder / "the same.tlog")
    progress = built(dataset, folder)
    assert (progress.known, progress.read) == (5, 0)
    after = every_row(dataset)
    assert {name for name in TABLES if after[name] != before[name]} == {"files"}
    (folder / "packed.tlog.gz").write_bytes(gzip.compress((folder / "mission-yard.tlog").read_bytes()))
    assert built(dataset, folder).read == 1


def test_a_file_that_holds_another_log_now_loses_the_old_rows(place, tmp_path):
    folder = tmp_path / "logs"
    shutil.copytree(place / "logs", folder)
    dataset = tmp_path / "dataset"
    built(dataset, folder)
    shutil.copy(folder / "upload-and-square.tlog", folder / "mission-yard.tlog")
    os.utime(folder / "mission-yard.tlog", ns=(1, 1))
    built(dataset, folder)
    names = [one["name"] for one in rows_as_objects(dataset, "SELECT name FROM logs ORDER BY name")]
    assert names == ["fence-breach.tlog", "guided-maze.tlog", "upload-and-square.tlog"]
    assert len(rows_as_objects(dataset, "SELECT DISTINCT log FROM drives")) == 2
    built(tmp_path / "anew", folder)
    after, anew = every_row(dataset), every_row(tmp_path / "anew")
    assert {name for name in TABLES if after[name] != anew[name]} <= {"files", "logs"}


def test_two_files_that_change_places_keep_their_rows(place, tmp_path):
    folder = tmp_path / "logs"
    shutil.copytree(place / "logs", folder)
    dataset = tmp_path / "dataset"
    built(dataset, folder)
    before = every_row(dataset)
    one, other = folder / "fence-breach.tlog", folder / "upload-and-square.tlog"
    aside = one.rename(tmp_path / "aside")
    other.rename(one)
    aside.rename(other)
    assert built(dataset, folder).read == 0
    after = every_row(dataset)
    assert {name for name in TABLES if after[name] != before[name]} == {"files"}


def test_bad_logs_are_listed_and_stop_nothing(place, tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    shutil.copy(place / "logs" / "fence-breach.tlog", folder)
    (folder / "empty.tlog").touch()
    (folder / "noise.tlog").write_bytes(random.Random(1).randbytes(5000))
    (folder / "a.ulg.gz").write_bytes(gzip.compress(b"ULog\x01\x12\x35" + bytes(100)))
    code, out = pbpp("logs", "build", folder, "-o", tmp_path / "dataset", "--json", "--jobs", "1")
    document = json.loads(out)
    assert (code, document["read"]) == (0, 4)
    reasons = {Path(one["file"]).name: one["reason"] for one in document["bad"]}
    assert set(reasons) == {"empty.tlog", "noise.tlog", "a.ulg.gz"}
    assert "the file is empty" in reasons["empty.tlog"]
    rows = rows_as_objects(
        tmp_path / "dataset", "SELECT name, problem FROM logs WHERE problem IS NOT NULL ORDER BY name"
    )
    assert {one["name"] for one in rows} == set(reasons)
    code, out = pbpp("logs", "build", folder, "-o", tmp_path / "dataset", "--json")
    assert (json.loads(out)["known"], len(json.loads(out)["bad"])) == (4, 3)


def test_a_raw_log_has_no_date(place, tmp_path, logs):
    data = (logs / "px4" / "fence-breach.tlog").read_bytes()
    frames, at = [], 0
    while at < len(data):
        end = at + 20 + data[at + 9]
        frames.append(data[at + 8 : end])
        at = end
    (tmp_path / "flight.raw").write_bytes(b"".join(frames))
    built(tmp_path / "dataset", tmp_path / "flight.raw")
    (row,) = rows_as_objects(tmp_path / "dataset", "SELECT month, begins_utc FROM vehicles")
    assert row == {"month": "undated", "begins_utc": None}


def test_many_parts_become_few(place, tmp_path, monkeypatch):
    folder = tmp_path / "logs"
    folder.mkdir()
    dataset = tmp_path / "dataset"
    for number in range(10):
        data = bytearray((place / "logs" / "fence-breach.tlog").read_bytes())
        (folder / f"{number}.tlog").write_bytes(data[: len(data) - 40 * number])
        built(dataset, folder)
    parts = list((dataset / "modes").rglob("*.parquet"))
    assert len(parts) <= 8
    whole = tmp_path / "whole"
    built(whole, folder)
    assert every_row(whole) == every_row(dataset)


@pytest.fixture(scope="module")
def seven(place, tmp_path_factory):
    """A folder of seven small logs, with the dataset of them beside it."""
    folder = tmp_path_factory.mktemp("killed") / "logs"
    folder.mkdir()
    data = (place / "logs" / "upload-and-square.tlog").read_bytes()
    for number in range(7):
        (folder / f"{number}.tlog").write_bytes(data[: len(data) - 3000 * number])
    built(folder.parent / "whole", folder)
    return folder


class TestKilled:
    """kill -9 of `pbpp logs build` at any place: built again, it is the same dataset."""

    SCRIPT = """
import sys, os
from pathlib import Path
import mavlink_bridge.dataset.build as b
from mavlink_bridge.cli.app import app
b._A_TASK, b._A_BATCH, b._A_LOAD = 1, 2, 4
left = int(sys.argv[3])
def dying(kind):
    def hook(self, *args, **kw):
        global left
        left -= 1
        if left < 0:
            os.kill(os.getpid(), 9)
        return kind(self, *args, **kw)
    return hook
for name in ("rename", "replace", "unlink", "mkdir"):
    setattr(Path, name, dying(getattr(Path, name)))
app(["logs", "build", sys.argv[2], "-o", sys.argv[1], "--jobs", "1", "-q"], standalone_mode=False)
print(left)
"""
    EVER = 10_000  # steps, more than any build has

    def run(self, dataset, folder, steps):
        """Build until so many changes of the folder's files are done; return how many were left, None where it was killed."""
        done = subprocess.run(
            [sys.executable, "-c", self.SCRIPT, str(dataset), str(folder), str(steps)],
            check=False,
            capture_output=True,
            text=True,
        )
        assert done.returncode in (0, -signal.SIGKILL), done.stderr
        return int(done.stdout.split()[-1]) if done.returncode == 0 else None

    @pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.campaign)])
    def test_at_places_drawn_at_random(self, seven, tmp_path, seed):
        rng = random.Random(seed)
        dataset = tmp_path / "dataset"
        kills = 0
        for _ in range(3):
            kills += self.run(dataset, seven, rng.randrange(60)) is None
        assert kills
        self.assert_whole(dataset, seven)

    @pytest.mark.campaign
    def test_ten_builds_each_at_another_place(self, seven, tmp_path):
        steps = self.EVER - self.run(tmp_path / "undisturbed", seven, self.EVER)
        assert steps > 60
        for place in random.Random(2).sample(range(steps), 10):
            dataset = tmp_path / f"killed at {place}"
            assert self.run(dataset, seven, place) is None
            self.assert_whole(dataset, seven)

    def assert_whole(self, dataset, seven):
        """Build again; then every row is there once, and no file is left over."""
        code, _ = pbpp("logs", "build", seven, "-o", dataset, "--jobs", "1", "-q")
        assert code == 0
        assert every_row(dataset) == every_row(seven.parent / "whole")
        listed = json.loads((dataset / "pbpp-dataset.json").read_text())["files"]
        there = {path.relative_to(dataset).as_posix() for path in dataset.rglob("*.parquet")}
        assert there == {name for names in listed.values() for name in names}


def test_what_is_no_dataset_is_refused(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(DatasetError, match="is not a dataset: it holds other files"):
        Dataset(tmp_path)
    with pytest.raises(DatasetError, match="there is no dataset"):
        Dataset(tmp_path / "none").open()
    for other in (1, 3, 99):
        (tmp_path / "pbpp-dataset.json").write_text(f'{{"schema": {other}, "files": {{}}, "published": []}}')
        with pytest.raises(DatasetError, match=f"schema {other}; this program reads and writes schema 2"):
            Dataset(tmp_path)
    (tmp_path / "pbpp-dataset.json").write_text("[]")
    with pytest.raises(DatasetError, match="cannot be read"):
        Dataset(tmp_path)
    with pytest.raises(DatasetError, match="no such folder or file"):
        log_files([tmp_path / "nowhere"])


@pytest.fixture
def copied(place, tmp_path):
    """A copy of the dataset."""
    return Path(shutil.copytree(place / "dataset", tmp_path / "copy"))


@pytest.mark.parametrize("table", ["positions", "files", "legs"])
def test_a_dataset_that_was_copied_in_part_is_refused(place, copied, table):
    """Else rows that are gone would be missed by nobody."""
    shutil.rmtree(copied / table)
    for words in (
        ["ask", copied, "--sql", "SELECT 1 AS one"],
        ["ask", copied, "modes"],
        ["build", place / "logs", "-o", copied, "--jobs", "1"],
        ["calibrate", copied, "-o", copied.parent / "rover.toml"],
    ):
        result = CliRunner().invoke(app, ["logs", *map(str, words)])
        assert result.exit_code == 3
        assert re.search(r"\d of its \d+ files are not there, such as " + table, result.stderr)
        assert "copy the whole folder again" in result.stderr


def test_files_that_were_cut_off_are_no_fault_of_the_program(place, copied):
    for path in copied.rglob("*.parquet"):
        path.write_bytes(path.read_bytes()[:-9])
    for words in (
        ["ask", copied, "--sql", "SELECT max(leg) FROM legs"],
        ["ask", copied, "clearance"],
        ["build", place / "logs", "-o", copied, "--jobs", "1"],
        ["calibrate", copied, "-o", copied.parent / "rover.toml"],
    ):
        result = CliRunner().invoke(app, ["logs", *map(str, words)])
        assert (result.exit_code, "internal error" in result.stderr) == (3, False)
        assert "copy the whole folder again" in result.stderr


def test_an_answer_without_an_end_is_refused(place):
    with pytest.raises(DatasetError, match="more than 1,000,000 rows") as caught:
        ask_sql(Dataset(place / "dataset"), "SELECT * FROM range(1000000000000)")
    assert "LIMIT" in caught.value.details["advice"]
    assert len(ask_sql(Dataset(place / "dataset"), "SELECT * FROM range(1000000)").rows) == 1_000_000


def test_without_duckdb_the_command_to_install_it_is_told(place, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.dataset.store.find_spec", lambda _: None)
    with pytest.raises(DatasetError, match="need the package duckdb") as caught:
        Dataset(place / "dataset").open()
    assert caught.value.details["advice"] == "install it with: pip install 'pbpp-rover[data]'"


def test_every_column_says_what_it_is():
    for table in TABLES.values():
        names = [column.name for column in table.every_column]
        assert len(set(names)) == len(names)
        assert all(column.meaning for column in table.columns)
    assert {view.name for view in VIEWS}.isdisjoint(TABLES)


def test_two_builds_at_once_do_not_mix(tmp_path, logs):
    first, second = Dataset(tmp_path / "dataset"), Dataset(tmp_path / "dataset")
    database = first.begin()
    with pytest.raises(DatasetError, match="another `pbpp logs build` adds to this dataset"):
        second.begin()
    database.close()
    first.end()
    first.close()
    with open_workers(1) as workers:
        build(first, log_files([logs / "mission-yard.tlog"]), workers)
        found = build(
            second, log_files([logs / "mission-yard.tlog"]), workers
        )  # knows of the rows added since it was opened
    assert (found.known, found.read) == (1, 0)


@pytest.mark.parametrize("name", ["vehicle=9", "month=2020-01"])
def test_a_folder_that_would_pass_for_a_column_is_refused(tmp_path, name):
    """DuckDB takes values from the names of all folders above a file: each row's vehicle would be 9."""
    with pytest.raises(DatasetError, match=f"reads a folder's name '{name}' for the rows' own"):
        Dataset(tmp_path / name / "fleet")


def test_a_dataset_is_read_by_its_own_name(place, tmp_path):
    """To DuckDB brackets are a pattern: beside a copy it would read that one."""
    odd = tmp_path / "fleet[1]"
    shutil.copytree(place / "dataset", odd)
    shutil.copytree(place / "dataset", tmp_path / "fleet1")
    for path in (tmp_path / "fleet1").rglob("*.parquet"):
        path.write_bytes(b"")
    assert every_row(odd) == every_row(place / "dataset")
