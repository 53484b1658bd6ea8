"""Backups: whole or not there, checked, and a note of what was under way."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from protocol.test_wire import ITEMS
from protocol.twin import plain_fence, plain_mission

from mavlink_bridge.backup.store import BackupStore, read_backup
from mavlink_bridge.backup.upload_note import UploadNote
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.backup.vehicle_mark import Kinship, VehicleMark, uid_of
from mavlink_bridge.cli.live import BackupKeeper
from mavlink_bridge.director import State
from mavlink_bridge.errors import BackupError, BridgeError, OutcomeError, VehicleInUseError
from mavlink_bridge.mavlink.messages import AutopilotVersion, MissionType
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.verified_outcome import Held
from missions.items import MissionItem

MISSION, FENCE = MissionType.MISSION, MissionType.FENCE
ONE = VehicleMark(1, uid="0a0b", connection="tcp:127.0.0.1:5760", autopilot=3)
OTHER = VehicleMark(1, uid="0c0d", connection="tcp:127.0.0.1:5760", autopilot=3)
UNTOLD = VehicleMark(1, connection="tcp:127.0.0.1:5760", autopilot=3)
ELSEWHERE = VehicleMark(1, connection="/dev/ttyACM0,57600", autopilot=3)
BEFORE_MARKS = VehicleMark(1)
SAME, IS_OTHER, UNCERTAIN = Kinship.SAME, Kinship.OTHER, Kinship.UNCERTAIN


@given(st.lists(ITEMS, max_size=5), st.sampled_from([0, 1, 2]), st.integers(1, 255))
def test_a_list_comes_back_as_it_was(tmp_path_factory, items, kind, system):
    store = BackupStore(tmp_path_factory.mktemp("state"))
    vehicle = VehicleMark(system, "0a0b", "tcp:127.0.0.1:5760", 3)
    path = store.keep(vehicle, MissionType(kind), items)
    backup = read_backup(path)
    assert backup.items == tuple(items)
    assert (backup.vehicle, backup.mission_type, backup.path) == (vehicle, kind, path)
    assert abs((datetime.now(UTC) - backup.time).total_seconds()) < 60
    assert store.newest(system, MissionType(kind)) == backup


def test_numbers_json_does_not_know(tmp_path):
    item = MissionItem(16, 6, params=(float("nan"), float("inf"), float("-inf"), 0.0), alt_m=float("nan"))
    back = read_backup(BackupStore(tmp_path).keep(ONE, MISSION, [item])).items[0]
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
    path = BackupStore(tmp_path).keep(ONE, MISSION, plain_mission(3))
    path.write_text(damage(path.read_text()))
    with pytest.raises(BackupError, match=path.name):
        read_backup(path)


def test_a_missing_backup_is_an_error(tmp_path):
    with pytest.raises(BackupError, match="cannot be read"):
        read_backup(tmp_path / "none.json")


def test_what_cannot_be_written_is_an_outcome(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutcomeError, match=r"cannot be written .*; nothing was written to the vehicle"):
        BackupStore(tmp_path / "file").keep(ONE, MISSION, [])


def test_backups_are_kept_apart_and_the_oldest_go(tmp_path, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.backup.store._KEPT_BACKUPS", 3)
    store = BackupStore(tmp_path)
    store.keep(VehicleMark(11), MISSION, plain_mission(9))
    store.keep(ONE, FENCE, plain_fence(1))
    paths = [store.keep(ONE, MISSION, plain_mission(length)) for length in range(1, 6)]
    assert [path.exists() for path in paths] == [False, False, True, True, True]
    assert len(store.newest(1, MISSION).items) == 5
    assert len(store.newest(11, MISSION).items) == 9
    assert len(store.newest(1, FENCE).items) == 4
    assert store.newest(2, MISSION) is None
    assert BackupStore(tmp_path / "none").newest(1, MISSION) is None
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize(
    ("one", "other", "kinship"),
    [
        (ONE, ONE, SAME),
        (ONE, OTHER, IS_OTHER),
        (ONE, VehicleMark(7, uid="0a0b"), SAME),  # its system id was changed
        (UNTOLD, UNTOLD, SAME),
        (UNTOLD, ELSEWHERE, IS_OTHER),
        (UNTOLD, VehicleMark(1, connection="tcp:127.0.0.1:5760", autopilot=12), IS_OTHER),
        (UNTOLD, VehicleMark(2, connection="tcp:127.0.0.1:5760", autopilot=3), IS_OTHER),
        (ONE, UNTOLD, UNCERTAIN),
        (ONE, BEFORE_MARKS, UNCERTAIN),
        (UNTOLD, BEFORE_MARKS, UNCERTAIN),
        (BEFORE_MARKS, BEFORE_MARKS, UNCERTAIN),
        (ONE, VehicleMark(2), IS_OTHER),
    ],
)
def test_which_marks_are_of_one_vehicle(one, other, kinship):
    assert (one.kinship(other), other.kinship(one)) == (kinship, kinship)


def test_the_uid_is_the_boards_own():
    board = tuple(bytes(range(1, 13)).ljust(18, b"\0"))
    assert uid_of(AutopilotVersion(0, uid2=board)) == "0102030405060708090a0b0c"
    assert uid_of(AutopilotVersion(0, uid=0xAB)) == "00000000000000ab"
    assert uid_of(AutopilotVersion(0)) == uid_of(None) == ""


def test_a_note_tells_of_an_upload_under_way(tmp_path):
    store = BackupStore(tmp_path)
    assert store.interrupted(ONE, MISSION) == []
    path = store.begin(ONE, MISSION, plain_mission(4))
    [note] = store.interrupted(ONE, MISSION)
    assert (note.backup, note.vehicle, note.trouble) == (read_backup(path), ONE, None)
    assert store.interrupted(ONE, FENCE) == []
    assert store.interrupted(OTHER, MISSION) == []
    assert store.interrupted(VehicleMark(2), MISSION) == []
    store.end(ONE, MISSION)
    assert store.notes() == []
    assert path.exists()
    store.end(ONE, MISSION)


def test_a_note_of_what_may_be_this_vehicle_is_told_and_not_settled_unasked(tmp_path):
    store = BackupStore(tmp_path)
    path = store.begin(UNTOLD, MISSION, plain_mission(4))
    [note] = store.interrupted(ONE, MISSION)
    assert note.vehicle == UNTOLD
    own = store.begin(ONE, MISSION, plain_mission(6))
    assert own != path
    store.end(ONE, MISSION)
    assert [note.vehicle for note in store.notes()] == [UNTOLD]
    store.end(ONE, MISSION, restored=path)
    assert store.notes() == []


def test_another_vehicles_note_stays_whatever_is_done_here(tmp_path):
    store = BackupStore(tmp_path)
    theirs = store.begin(OTHER, MISSION, plain_mission(4))
    assert store.begin(ONE, MISSION, plain_mission(6)) != theirs
    store.end(ONE, MISSION, restored=theirs)
    assert [note.vehicle for note in store.notes()] == [OTHER]


def test_after_an_interruption_the_older_backup_counts(tmp_path):
    store = BackupStore(tmp_path)
    first = store.begin(ONE, MISSION, plain_mission(4))
    assert store.begin(ONE, MISSION, plain_mission(6)) == first
    assert [len(note.backup.items) for note in store.interrupted(ONE, MISSION)] == [4]
    assert len(store.newest(1, MISSION).items) == 6


def test_a_backup_that_is_still_to_be_restored_is_never_pruned(tmp_path, monkeypatch):
    monkeypatch.setattr("mavlink_bridge.backup.store._KEPT_BACKUPS", 2)
    store = BackupStore(tmp_path)
    first = store.begin(OTHER, MISSION, plain_mission(4))
    for length in range(5, 9):
        store.keep(ONE, MISSION, plain_mission(length))
    assert read_backup(first).vehicle == OTHER


def test_files_of_before_the_marks_are_still_read(tmp_path):
    store = BackupStore(tmp_path)
    path = store.begin(ONE, MISSION, plain_mission(4))
    content = json.loads(path.read_text())
    del content["vehicle"], content["sha256"]
    content["format"] = 1
    content["sha256"] = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    old = tmp_path / "system-1-mission-20260101T000000.000000Z.json"
    old.write_text(json.dumps(content))
    assert read_backup(old).vehicle == BEFORE_MARKS
    [note] = tmp_path.glob("upload-under-way*")
    note.unlink()
    (tmp_path / "upload-under-way-system-1-mission.json").write_text(json.dumps({"backup": old.name}))
    [read] = store.interrupted(ONE, MISSION)
    assert (read.vehicle, read.backup) == (BEFORE_MARKS, read_backup(old))


def test_many_backups_at_once_do_not_share_a_name(tmp_path):
    """Each has its own unfinished file: nobody's is taken away under another's hands."""
    store = BackupStore(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        paths = list(
            pool.map(lambda system: store.begin(VehicleMark(system), MISSION, plain_mission(9)), [1, 2] * 20)
        )
    assert all(len(read_backup(path).items) == 9 for path in paths)
    assert not list(tmp_path.glob("*.part"))


def test_two_backups_within_a_tick_of_the_clock_are_both_kept(tmp_path, monkeypatch):
    """Windows' clock ticks every 16 ms before Python 3.13."""

    class Coarse(datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 11, 22, 12, tzinfo=tz)

    monkeypatch.setattr("mavlink_bridge.backup.store.datetime", Coarse)
    store = BackupStore(tmp_path)
    kept = [store.keep(ONE, MISSION, plain_mission(count)) for count in (4, 5, 6)]
    assert [len(read_backup(path).items) for path in kept] == [4, 5, 6]
    assert store.newest(1, MISSION).path == kept[-1]


@pytest.mark.parametrize(
    "note",
    [
        "",
        "[]",
        '{"time": 1}',
        '{"backup": 5}',
        '{"backup": "x", "vehicle": 7}',
        '{"backup": "x", "vehicle": {"autopilot": 1e999}}',
        "[" * 9999,
    ],
)
def test_an_unreadable_note_is_told_and_can_be_put_aside(tmp_path, note):
    store = BackupStore(tmp_path)
    backup = store.begin(ONE, MISSION, [])
    [path] = tmp_path.glob("upload-under-way*")
    path.write_text(note)
    [read] = store.interrupted(ONE, MISSION)
    assert read.backup is None
    assert path.name in str(read.trouble)
    [put_aside] = store.forget([read])
    assert put_aside.read_text() == note
    assert store.notes() == []
    assert backup.exists()


@pytest.mark.parametrize("number", ["NaN", "1e999"])
def test_a_backup_with_a_number_that_json_has_not_is_none(tmp_path, number):
    path = BackupStore(tmp_path).keep(ONE, MISSION, [])
    path.write_text(path.read_text().replace('"items"', f'"more": {number}, "items"'))
    with pytest.raises(BackupError, match="is not a backup that pbpp wrote"):
        read_backup(path)


def test_a_note_whose_backup_is_gone_is_told(tmp_path):
    store = BackupStore(tmp_path)
    store.begin(ONE, MISSION, []).unlink()
    [note] = store.interrupted(ONE, MISSION)
    assert (note.backup, note.vehicle) == (None, ONE)
    assert "cannot be read" in str(note.trouble)
    again = store.begin(ONE, MISSION, plain_mission(3))  # it blocks nothing
    assert [note.backup.path for note in store.interrupted(ONE, MISSION)] == [again]


def test_a_note_cannot_lead_out_of_the_folder(tmp_path):
    store = BackupStore(tmp_path / "state")
    outside = BackupStore(tmp_path).keep(ONE, MISSION, [])
    store.begin(ONE, MISSION, [])
    path = next((tmp_path / "state").glob("upload-under-way*"))
    path.write_text(json.dumps({"backup": f"../{outside.name}"}))
    [note] = store.interrupted(VehicleMark(1), MISSION)
    assert note.backup is None
    assert "cannot be read" in str(note.trouble)


def test_the_users_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setenv("HOME", str(tmp_path))
    assert tmp_path in BackupStore().folder.parents


@pytest.mark.parametrize(
    ("held", "stays"), [(Held.OLD, True), (Held.FOREIGN, True), (Held.UNKNOWN, True), (Held.WANTED, False)]
)
@pytest.mark.parametrize("has_begun", [False, True])
def test_the_note_of_an_interrupted_upload_outlives_a_later_one_that_does_not_get_through(
    tmp_path, held, stays, has_begun
):
    store = BackupStore(tmp_path)
    original = store.begin(ONE, MISSION, plain_mission(3))
    note = UploadNote(store, ONE, MISSION)
    if has_begun:
        assert note.begin(plain_mission(2)) == original
    note.settle(held)
    assert [kept.backup.path for kept in store.notes()] == ([original] if stays else [])


@pytest.mark.parametrize("held", Held)
def test_an_own_note_goes_where_it_is_known_what_the_vehicle_holds(tmp_path, held):
    store = BackupStore(tmp_path)
    note = UploadNote(store, ONE, MISSION)
    note.begin(plain_mission(2))
    note.settle(held)
    assert bool(store.notes()) is (held in (Held.UNFINISHED, Held.UNKNOWN))


@pytest.mark.parametrize("is_in_use", [False, True])
def test_a_bridge_that_may_not_write_leaves_the_note_of_who_did(state_folder, is_in_use):
    """Before, an upload that was refused by the bridge's own check took the note of an earlier one away, or of another process."""
    store = BackupStore()
    upload = SimpleNamespace(has_written=False)
    director = SimpleNamespace(
        peer=Peer(1, 1, 1, 195),
        vehicle_uid=ONE.uid,
        upload=upload,
        is_uploading=True,
        pending_backup=None,
        upload_outcome=None,
        state=State.UPLOADING,
        drive_note=None,
        orders=SimpleNamespace(drive=False),
        backup_failed=lambda error, _now_s: failures.append(error),
    )
    failures: list[BridgeError] = []
    other = VehicleLock(ONE)
    assert not is_in_use or other.take() is None
    store.begin(ONE, MISSION, plain_mission(3))
    keeper = BackupKeeper(director, ONE.connection)
    keeper.step(0.0)
    director.pending_backup = plain_mission(2) if is_in_use else None
    keeper.step(0.1)
    assert [type(failure) for failure in failures] == ([VehicleInUseError] if is_in_use else [])
    director.pending_backup, director.is_uploading = None, False
    director.upload_outcome = SimpleNamespace(held=Held.OLD)
    keeper.step(0.2)
    assert len(store.notes()) == 1
    other.free()
