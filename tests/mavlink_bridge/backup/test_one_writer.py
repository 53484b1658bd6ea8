"""One writer to a vehicle at a time, whatever it is: threads, processes, the bridge; and which backups go back on which vehicle."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import threading

import pytest
from protocol.adversary import Adversary, RebootsMidway, TcpVehicle, mission, places
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.cli import restoring
from mavlink_bridge.cli.app import app
from mavlink_bridge.errors import BackupError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.simulator.parameters import DEFAULTS
from missions.formats.waypoints import format_items

OLD, NEW = mission(3, 900), mission(6, 500)
THEIRS = mission(9, 100)
ONE = VehicleMark(1, uid="0a0b", connection="tcp:127.0.0.1:5760", autopilot=3)


pytestmark = pytest.mark.usefixtures("state_folder")


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "new.waypoints"
    path.write_text(format_items(NEW))
    return path


class Overwritten(Adversary):
    """Somebody else's list is there as soon as ours was taken."""

    def finish(self, kind):
        super().finish(kind)
        self.lists[kind] = list(THEIRS)


def run(link, *arguments, **options):
    command = [*map(str, arguments), "--connect", link.connection, "--timeout", "8"]
    result = CliRunner().invoke(app, command, **options)
    return result.exit_code, result.output


def started(link, *arguments):
    command = [sys.executable, "-m", "mavlink_bridge.cli", *map(str, arguments), "--connect", link.connection]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    )


def interrupted_on(vehicle, mission_file):
    """Break an upload off half-way; return the backup."""
    with TcpVehicle(vehicle) as link:
        assert run(link, "upload", mission_file)[0] == 7
    [note] = BackupStore().notes()
    return note.backup


# Locks


def test_a_lock_is_one_threads(tmp_path):
    one, other = VehicleLock(ONE, tmp_path), VehicleLock(ONE, tmp_path)
    assert one.take() is None
    assert one.take() is None
    holders = []
    thread = threading.Thread(target=lambda: holders.append(other.take()))
    thread.start()
    thread.join()
    assert holders[0].process == os.getpid()
    assert "process" in str(holders[0].error(ONE))
    one.free()
    assert other.take() is None
    other.free()
    other.free()


@pytest.mark.parametrize(
    ("vehicle", "is_free"),
    [
        (VehicleMark(1, uid="0a0b", connection="/dev/ttyACM0,57600", autopilot=3), False),  # the same board
        (
            VehicleMark(1, connection="tcp:127.0.0.1:5760", autopilot=3),
            False,
        ),  # the same way, its uid not told
        (VehicleMark(1, uid="0c0d", connection="/dev/ttyACM0,57600", autopilot=3), True),
        (VehicleMark(2, connection="tcp:127.0.0.1:5760", autopilot=3), True),
    ],
)
def test_whom_a_lock_keeps_out(tmp_path, vehicle, is_free):
    mine, theirs = VehicleLock(ONE, tmp_path), VehicleLock(vehicle, tmp_path)
    assert mine.take() is None
    assert (theirs.take() is None) is is_free
    assert theirs.is_held is is_free
    mine.free()
    theirs.free()


def test_a_lock_ends_with_its_process(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from mavlink_bridge.backup.vehicle_lock import VehicleLock;"
        "from mavlink_bridge.backup.vehicle_mark import VehicleMark;"
        "lock = VehicleLock(VehicleMark(1, '0a0b', 'tcp:127.0.0.1:5760', 3), Path(sys.argv[1]));"
        "print(lock.take(), flush=True); time.sleep(60)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "None\n"
        lock = VehicleLock(ONE, tmp_path)
        assert lock.take().process == process.pid
        process.kill()
        process.wait()
        assert lock.take() is None
    lock.free()


def test_no_lock_can_be_taken(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BackupError, match="nothing was written to the vehicle"):
        VehicleLock(ONE, tmp_path / "file").take()


def test_an_upload_beside_another_process_says_who_writes(mission_file, tmp_path, monkeypatch):
    parameters = tmp_path / "some.parm"
    parameters.write_text("WP_SPEED 3\n")
    with TcpVehicle(Adversary(OLD, uid=b"one")) as link:
        lock = VehicleLock(VehicleMark(1, b"one".hex(), link.connection, 3))
        assert lock.take() is None
        process = started(link, "upload", mission_file)
        output = "".join(process.communicate(timeout=60))
        assert process.returncode == 6
        assert f"process {os.getpid()}" in output
        assert "nothing was written" in output
        monkeypatch.setattr("mavlink_bridge.cli.uploading._LOCK_PATIENCE_S", 0.3)
        code, output = run(link, "upload", parameters)
        assert (code, f"process {os.getpid()}" in output) == (6, True)
        assert (link.vehicle.counts, link.vehicle.sets) == (0, 0)
        BackupStore().begin(lock.vehicle, MissionType.MISSION, OLD)
        code, output = run(link, "download", "mission")
        assert code == 0
        assert f"process {os.getpid()}" in output
        assert "is writing to system 1" in output
        lock.free()


def test_two_uploads_that_start_together(mission_file):
    """Whoever comes second waits; neither loses its backup or its note."""
    with TcpVehicle(Adversary(OLD, uid=b"one")) as link:
        both = [started(link, "upload", mission_file, "--json") for _ in range(2)]
        ends = [(process.communicate(timeout=120)[0], process.returncode) for process in both]
        assert places(link.vehicle.held) == places(NEW)
    codes = sorted(code for _, code in ends)
    assert codes in ([0, 0], [0, 5], [0, 6]), (
        ends
    )  # the two have the same ids: that clash may be refused at the start
    assert BackupStore().notes() == []


def test_the_bridge_holds_the_lock_and_keeps_to_it(fields, mission_file):
    from missions.fence import fence_to_items
    from missions.formats import read_fence

    vehicle = Adversary(OLD, uid=b"one")
    vehicle.lists[MissionType.FENCE] = list(fence_to_items(read_fence(fields / "yard-fence.waypoints")))
    with TcpVehicle(vehicle) as link:
        lock = VehicleLock(VehicleMark(1, b"one".hex(), link.connection, 3))
        assert lock.take() is None
        for command in ("plan", "bridge"):
            once = ("--once",) if command == "bridge" else ()
            code, output = run(link, command, "--target", "40.0720926,-105.2286152", "--upload", *once)
            assert (code, vehicle.counts) == (6, 0), output
            assert f"process {os.getpid()}" in output
        lock.free()
        code, output = run(link, "plan", "--target", "40.0720926,-105.2286152", "--upload")
        assert code == 0, output
    assert lock.take() is None
    lock.free()


def test_a_replay_tells_the_same_of_an_upload_that_was_not_begun_and_of_one_that_broke_off(fields, tmp_path):
    from mavlink_bridge.director import Orders
    from mavlink_bridge.replay.journal import journal_path
    from mavlink_bridge.replay.replay import replay_log
    from missions.fence import fence_to_items
    from missions.formats import read_fence

    fence = list(fence_to_items(read_fence(fields / "yard-fence.waypoints")))
    for name, vehicle, is_locked in (
        ("locked", Adversary(OLD, uid=b"one"), True),
        ("foreign", Overwritten(OLD, uid=b"two"), False),
    ):
        vehicle.lists[MissionType.FENCE] = fence
        # It has all that it is asked for: patience would run out at another time in the replay.
        vehicle.parameters = {**DEFAULTS, **vehicle.parameters}
        log = tmp_path / f"{name}.tlog"
        with TcpVehicle(vehicle) as link:
            lock = VehicleLock(VehicleMark(1, b"one".hex(), link.connection, 3))
            if is_locked:
                lock.take()
            arguments = ("--target", "40.0720926,-105.2286152", "--upload", "--once", "--log", log, "--json")
            code, output = run(link, "bridge", *arguments)
            lock.free()
        assert code == (6 if is_locked else 7), output
        lines = map(json.loads, journal_path(log).read_text(encoding="utf-8").splitlines())
        told = [line["told"] for line in lines if "told" in line]
        [failed] = [event for event in told if event["event"] == "upload_failed"]
        assert ("process" in failed["text"]) is is_locked
        assert ("the old list is kept in" in failed["text"]) is not is_locked
        replayed = json.loads(json.dumps([event.as_json() for event in replay_log(log, Orders())]))
        assert replayed == told


@pytest.mark.parametrize("command", ["upload", "plan"])
def test_a_backup_that_cannot_be_written_leaves_the_vehicle_alone(mission_file, fields, monkeypatch, command):
    from missions.fence import fence_to_items
    from missions.formats import read_fence

    def full(*_arguments, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mavlink_bridge.backup.store.os.fsync", full)
    vehicle = Adversary(OLD)
    vehicle.lists[MissionType.FENCE] = list(fence_to_items(read_fence(fields / "yard-fence.waypoints")))
    arguments = (
        (mission_file,) if command == "upload" else ("--target", "40.0720926,-105.2286152", "--upload")
    )
    with TcpVehicle(vehicle) as link:
        code, output = run(link, command, *arguments)
    assert (code, vehicle.counts) == (7, 0)
    assert "No space left on device; nothing was written to the vehicle" in output
    assert BackupStore().notes() == []
    assert not list(BackupStore().folder.glob("*.part"))


# Restoring


@pytest.mark.parametrize(
    ("a", "b"), [(b"a-board", b"b-board"), (b"", b""), (b"a-board", b""), (b"", b"b-board")]
)
def test_one_vehicles_mission_is_not_put_on_another(mission_file, a, b):
    backup = interrupted_on(RebootsMidway(OLD, uid=a), mission_file)
    with TcpVehicle(Adversary(THEIRS, uid=b)) as link:
        for arguments in (("--restore",), ("--restore", backup.path)):
            code, output = run(link, "upload", *arguments)
            assert code == 7, output
            assert "nothing was written to it" in output
            assert f"--restore {backup.path} --other-vehicle" in output
        assert places(link.vehicle.held) == places(THEIRS)
        assert link.vehicle.counts == 0
        assert ("interrupted" in run(link, "download", "mission")[1]) is (bool(a) != bool(b))
        assert run(link, "upload", "--restore", backup.path, "--other-vehicle")[0] == 0
        assert places(link.vehicle.held) == places(OLD)


def test_a_vehicle_gets_its_own_back_however_it_is_connected(mission_file):
    interrupted_on(RebootsMidway(OLD, uid=b"mine"), mission_file)
    with TcpVehicle(Adversary(NEW[:4], uid=b"mine")) as link:
        assert "interrupted" in run(link, "download", "mission")[1]
        assert run(link, "upload", "--restore")[0] == 0
        assert places(link.vehicle.held) == places(OLD)
    assert BackupStore().notes() == []


@pytest.mark.parametrize(("answer", "code"), [("y\n", 0), ("n\n", 7), ("\n", 7)])
def test_on_a_terminal_one_is_asked(mission_file, monkeypatch, answer, code):
    interrupted_on(RebootsMidway(OLD, uid=b"mine"), mission_file)

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    class System:
        stdin, stderr = Terminal(answer), Terminal()

    monkeypatch.setattr(restoring, "sys", System)
    with TcpVehicle(Adversary(NEW[:4])) as link:  # it does not tell its uid this time
        found, output = run(link, "upload", "--restore")
        assert found == code, output
        assert "cannot be shown to be this vehicle's" in output
        assert places(link.vehicle.held) == places(OLD if code == 0 else NEW[:4])
    assert len(BackupStore().notes()) == (0 if code == 0 else 1)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--restore", "--other-vehicle"),
        ("m.waypoints", "--other-vehicle"),
        ("--forget", "--restore"),
        ("--forget", "m.waypoints"),
    ],
)
def test_options_that_do_not_fit(arguments):
    assert CliRunner().invoke(app, ["upload", *arguments, "--connect", "tcp:127.0.0.1:9"]).exit_code == 2


# Notes


def test_a_note_that_cannot_be_used_blocks_nothing_and_is_put_aside(mission_file):
    backup = interrupted_on(RebootsMidway(OLD, uid=b"mine"), mission_file)
    [note] = BackupStore().notes()
    note.path.write_text("garbage")
    with TcpVehicle(Adversary(NEW[:4], uid=b"mine")) as link:
        code, output = run(link, "upload", "--restore")
        assert code == 7
        assert "`pbpp upload --forget`" in output
        code, output = run(link, "download", "mission")
        assert code == 0
        assert "`pbpp upload --forget`" in output
        assert run(link, "upload", mission_file)[0] == 0
        code, output = run(link, "upload", "--forget", "--json")
        assert code == 0
        assert [entry["backup"] for entry in json.loads(output)["forgotten"]] in ([], [None])
    assert BackupStore().notes() == []
    assert backup.path.exists()


def test_notes_are_put_aside_without_a_link(mission_file):
    backup = interrupted_on(RebootsMidway(OLD), mission_file)
    for system, count in ((2, 0), (1, 1), (1, 0)):
        result = CliRunner().invoke(app, ["upload", "--forget", "--system", str(system), "--json"])
        assert result.exit_code == 0
        assert [entry["backup"] for entry in json.loads(result.stdout)["forgotten"]] == [
            str(backup.path)
        ] * count
    assert "no interrupted uploads" in CliRunner().invoke(app, ["upload", "--forget"]).stdout
    assert backup.path.exists()


def test_with_a_link_only_this_vehicles_notes_are_put_aside(mission_file):
    interrupted_on(RebootsMidway(OLD, uid=b"theirs"), mission_file)
    with TcpVehicle(Adversary(OLD, uid=b"mine")) as link:
        assert "no interrupted uploads" in run(link, "upload", "--forget")[1]
    with TcpVehicle(Adversary(OLD, uid=b"theirs")) as link:
        assert "dismissed, kept as" in run(link, "upload", "--forget")[1]
    assert BackupStore().notes() == []
