"""Backups: whole or not there, checked, and a note of what was under way."""

from __future__ import annotations

import json
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from protocol.test_wire import ITEMS
from protocol.twin import plain_fence, plain_mission

from mavlink_bridge.backup import BackupStore, read_backup
from mavlink_bridge.errors import BackupError, OutcomeError
from mavlink_bridge.messages import MissionType
from missions.items import MissionItem

MISSION, FENCE = MissionType.MISSION, MissionType.FENCE


@given(st.lists(ITEMS, max_size=5), st.sampled_from([0, 1, 2]), st.integers(1, 255))
def test_a_list_comes_back_as_it_was(tmp_path_factory, items, kind, system):
    store = BackupStore(tmp_path_factory.mktemp("state"))
    path = store.keep(system, MissionType(kind), items)
    backup = read_backup(path)
    assert backup.items == tuple(items)
    assert (backup.system, backup.mission_type, backup.path) == (system, kind, path)
    assert abs((datetime.now(UTC) - backup.time).total_seconds()) < 60
    assert store.newest(system, MissionType(kind)) == backup


def test_numbers_json_does_not_know(tmp_path):
    item = MissionItem(16, 6, params=(float("nan"), float("inf"), float("-inf"), 0.0), alt_m=float("nan"))
    back = read_backup(BackupStore(tmp_path).keep(1, MISSION, [item])).items[0]
    assert repr(back) == repr(item)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text.replace("400714740", "400714741"),
        lambda text: text.replace('"system": 1', '"system": 2'),
        lambda text: text[: len(text) // 2],
        lambda _: "",
        lambda _: "[]",
        lambda _: '{"sha256": "x"}',
        lambda text: text.replace("mission", "something"),
    ],
)
def test_a_damaged_backup_is_noticed(tmp_path, damage):
    path = BackupStore(tmp_path).keep(1, MISSION, plain_mission(3))
    path.write_text(damage(path.read_text()))
    with pytest.raises(BackupError, match=path.name):
        read_backup(path)


def test_a_missing_backup_is_an_error(tmp_path):
    with pytest.raises(BackupError, match="cannot be read"):
        read_backup(tmp_path / "none.json")


def test_what_cannot_be_written_is_an_outcome(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutcomeError, match="cannot be written"):
        BackupStore(tmp_path / "file").keep(1, MISSION, [])


def test_backups_are_kept_apart_and_the_oldest_go(tmp_path, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.backup._KEPT_BACKUPS", 3)
    store = BackupStore(tmp_path)
    store.keep(11, MISSION, plain_mission(9))
    store.keep(1, FENCE, plain_fence(1))
    paths = [store.keep(1, MISSION, plain_mission(length)) for length in range(1, 6)]
    assert [path.exists() for path in paths] == [False, False, True, True, True]
    assert len(store.newest(1, MISSION).items) == 5
    assert len(store.newest(11, MISSION).items) == 9
    assert len(store.newest(1, FENCE).items) == 4
    assert store.newest(2, MISSION) is None
    assert BackupStore(tmp_path / "none").newest(1, MISSION) is None
    assert not list(tmp_path.glob("*.part"))


def test_a_note_tells_of_an_upload_under_way(tmp_path):
    store = BackupStore(tmp_path)
    assert store.interrupted(1, MISSION) is None
    path = store.begin(1, MISSION, plain_mission(4))
    assert store.interrupted(1, MISSION) == read_backup(path)
    assert store.interrupted(1, FENCE) is None
    assert store.interrupted(2, MISSION) is None
    store.end(1, MISSION)
    assert store.interrupted(1, MISSION) is None
    assert path.exists()
    store.end(1, MISSION)


def test_after_an_interruption_the_older_backup_counts(tmp_path):
    store = BackupStore(tmp_path)
    first = store.begin(1, MISSION, plain_mission(4))
    assert store.begin(1, MISSION, plain_mission(6)) == first
    assert len(store.interrupted(1, MISSION).items) == 4
    assert len(store.newest(1, MISSION).items) == 6


def test_two_backups_within_a_tick_of_the_clock_are_both_kept(tmp_path, monkeypatch):
    """Windows' clock ticks every 16 ms before Python 3.13."""

    class Coarse(datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 11, 22, 12, tzinfo=tz)

    monkeypatch.setattr("mavlink_bridge.backup.datetime", Coarse)
    store = BackupStore(tmp_path)
    kept = [store.keep(1, MISSION, plain_mission(count)) for count in (4, 5, 6)]
    assert [len(read_backup(path).items) for path in kept] == [4, 5, 6]
    assert store.newest(1, MISSION).path == kept[-1]


@pytest.mark.parametrize("note", ["", "[]", '{"time": 1}', '{"backup": 5}'])
def test_an_unreadable_note_is_said(tmp_path, note):
    store = BackupStore(tmp_path)
    store.begin(1, MISSION, [])
    next(tmp_path.glob("upload-under-way*")).write_text(note)
    with pytest.raises(BackupError, match="note of an interrupted upload"):
        store.interrupted(1, MISSION)


def test_a_note_cannot_lead_out_of_the_folder(tmp_path):
    store = BackupStore(tmp_path / "state")
    outside = BackupStore(tmp_path).keep(1, MISSION, [])
    store.begin(1, MISSION, [])
    note = next((tmp_path / "state").glob("upload-under-way*"))
    note.write_text(json.dumps({"backup": f"../{outside.name}"}))
    with pytest.raises(BackupError, match="cannot be read"):
        store.interrupted(1, MISSION)


def test_the_users_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    assert tmp_path in BackupStore().folder.parents
