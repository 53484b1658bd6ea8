"""``pbpp bridge --log`` again and again: each run in a part of its own, none written over."""

from __future__ import annotations

import contextlib
import json
import os
import threading

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.recording import open_recording
from mavlink_bridge.director import Orders
from mavlink_bridge.errors import LogError
from mavlink_bridge.replay.journal import read_journal
from missions.situation import Situation


def record(log, words: bytes = b""):
    with contextlib.ExitStack() as stack:
        part, _, _ = open_recording(stack, log, Orders(), Situation())
        part.write_bytes(words)
        return part


def test_a_run_goes_on_in_the_next_part(tmp_path):
    log = tmp_path / "run.tlog"
    parts = [record(log, str(number).encode()) for number in range(3)]
    assert [part.name for part in parts] == ["run.tlog", "run.2.tlog", "run.3.tlog"]
    assert [part.read_bytes() for part in parts] == [b"0", b"1", b"2"]
    for name in ("run", "run.2", "run.3"):
        assert read_journal(tmp_path / f"{name}.journal.jsonl").orders == Orders()


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("run", ["run", "run.2.tlog", "run.3.tlog"]),
        ("a.b.log", ["a.b.log", "a.b.2.log", "a.b.3.log"]),
        ("run.2.tlog", ["run.2.tlog", "run.2.2.tlog", "run.2.3.tlog"]),
    ],
)
def test_names_of_parts(tmp_path, name, parts):
    assert [record(tmp_path / name).name for _ in parts] == parts
    assert len(list(tmp_path.iterdir())) == 6


def test_a_journal_that_stands_alone_is_kept_too(tmp_path):
    (tmp_path / "run.journal.jsonl").write_text("mine")
    assert record(tmp_path / "run.tlog").name == "run.2.tlog"
    assert (tmp_path / "run.journal.jsonl").read_text() == "mine"
    assert not (tmp_path / "run.tlog").exists()


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_a_link_is_not_followed(tmp_path):
    (tmp_path / "run.tlog").symlink_to(tmp_path / "elsewhere")
    assert record(tmp_path / "run.tlog").name == "run.2.tlog"
    assert not (tmp_path / "elsewhere").exists()


def test_runs_that_begin_at_once_get_files_of_their_own(tmp_path):
    parts = []
    threads = [
        threading.Thread(target=lambda: parts.append(record(tmp_path / "run.tlog"))) for _ in range(16)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(parts)) == 16


def test_a_folder_that_is_not_there_is_unusable(tmp_path):
    with pytest.raises(LogError, match=r"no/run\.tlog: No such file"), contextlib.ExitStack() as stack:
        open_recording(stack, tmp_path / "no" / "run.tlog", Orders(), Situation())


def test_the_bridge_starts_again_with_the_same_name_and_says_where(tmp_path):
    log = tmp_path / "run.tlog"
    arguments = ["bridge", "--connect", "udpin:127.0.0.1:0", "--log", str(log), "--once", "--timeout", "0.2"]
    first = CliRunner().invoke(app, [*arguments, "--json"])
    assert first.exit_code == 5
    again = CliRunner().invoke(app, [*arguments, "--json"])
    assert again.exit_code == 5
    assert f"{log} exists; recording this run to {tmp_path / 'run.2.tlog'}" in again.output.replace("\n", "")
    head = (tmp_path / "run.2.journal.jsonl").read_text().splitlines()[0]
    assert json.loads(head)["journal"] == 2
