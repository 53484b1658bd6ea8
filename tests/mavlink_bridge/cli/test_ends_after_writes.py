"""However an upload ends after its first write, it says what may be on the vehicle and where the old list lies: exit 7, an interrupt 130.

The whole command runs, on a link to a hostile vehicle on which waiting takes no time.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from protocol.adversary import (
    Adversary,
    BreaksAtMessage,
    BreaksAtSet,
    CancelsAtThree,
    DeniesReadsAfterwards,
    DeniesWrites,
    DrivesMidway,
    GoneMidway,
    RebootsMidway,
    SilentMidway,
    SpoofedMidway,
    SteppedLink,
    TcpVehicle,
    mission,
    places,
)
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore, read_backup
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.cli.app import app
from mavlink_bridge.errors import BackupError
from mavlink_bridge.link import Link
from mavlink_bridge.protocol.outcomes import end_of_upload
from missions.formats.waypoints import format_items

OLD, NEW = mission(3, 900), mission(6, 500)
MIXED = "part of both"


pytestmark = pytest.mark.usefixtures("state_folder")


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "new.waypoints"
    path.write_text(format_items(NEW))
    return path


@pytest.fixture
def stepped(monkeypatch):
    """Let the commands open links to a vehicle on stepped time."""

    def run(vehicle, *arguments):
        transport = SteppedLink(vehicle)

        def opened(_connection, identity, **_options):
            return Link(transport, identity, clock=transport.now_s)

        monkeypatch.setattr("mavlink_bridge.cli.session.open_link", opened)
        monkeypatch.setattr("mavlink_bridge.cli.live.open_link", opened)
        monkeypatch.setattr("mavlink_bridge.cli.uploading.now_s", transport.now_s)
        return result_of(*arguments, "--connect", "tcp:127.0.0.1:5760", "--json")

    return run


def result_of(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, json.loads(result.stdout), result.stderr


def assert_said(document, code, wanted=7):
    """The end is told: what may be on the vehicle, and a backup that holds what was there."""
    assert code == wanted, document
    [path] = [word.rstrip(",;") for word in document["message"].split() if word.endswith(("json", "json,"))][
        :1
    ]
    assert places(read_backup(Path(path)).items) == places(OLD)
    assert "read it back before driving" in document["message"] or "do not drive" in document["message"]
    if wanted == 7:
        assert document["details"]["backup"] == path
        assert document["details"]["list"] == "mission"
    [note] = BackupStore().notes()
    assert str(note.backup.path) == path


@pytest.mark.parametrize("kind", [RebootsMidway, SilentMidway, GoneMidway, DeniesReadsAfterwards])
def test_ends_that_leave_open_what_is_there_name_the_backup(stepped, mission_file, kind):
    vehicle = kind(OLD)
    code, document, _ = stepped(vehicle, "upload", mission_file)
    assert_said(document, code)
    assert vehicle.counts > 0


def test_somebody_with_our_ids_in_mid_upload(stepped, mission_file):
    vehicle = SpoofedMidway(OLD)
    code, document, _ = stepped(vehicle, "upload", mission_file)
    if code == 0:  # the clash is survived
        assert places(vehicle.held) == places(NEW)
    else:
        assert_said(document, code)


@pytest.mark.parametrize("kind", [DrivesMidway, CancelsAtThree])
def test_ends_that_are_known_are_told_as_they_are(stepped, mission_file, kind):
    vehicle = kind(OLD)
    code, document, _ = stepped(vehicle, "upload", mission_file)
    held = places(vehicle.held)
    if code == 0:
        assert held == places(NEW)
    elif document["details"]["held"] == "old":
        assert held == places(OLD)
        assert BackupStore().notes() == []
    else:
        assert_said(document, code)


def test_a_list_that_was_kept_busy_was_not_written(stepped, mission_file):
    vehicle = DeniesWrites(OLD)
    code, document, _ = stepped(vehicle, "upload", mission_file)
    assert (code, document["error"]) == (6, "RefusedError")
    assert places(vehicle.held) == places(OLD)
    assert BackupStore().notes() == []


@pytest.mark.parametrize("count", range(45))
def test_a_link_that_breaks_at_any_message(stepped, mission_file, count):
    """5 where nothing was written and nothing is said of it; 7 with the backup from the first MISSION_COUNT on; never silent."""
    vehicle = BreaksAtMessage(count, held=OLD)
    code, document, _ = stepped(vehicle, "upload", mission_file)
    if code == 0:
        assert places(vehicle.held) == places(NEW)
    elif code == 5:
        assert vehicle.counts == 0
        assert places(vehicle.held) == places(OLD)
        assert BackupStore().notes() == []
    else:
        assert_said(document, code)


@pytest.mark.parametrize(
    ("cause", "code", "error"),
    [
        (OSError(5, "Input/output error"), 7, "OutcomeError"),
        (ValueError("a defect"), 7, "DefectError"),
        (KeyboardInterrupt(), 130, "Interrupted"),
    ],
)
@pytest.mark.parametrize("command", ["upload", "plan"])
def test_whatever_breaks_off_after_the_first_write(
    stepped, mission_file, monkeypatch, fields, cause, code, error, command
):
    class Breaking(Adversary):
        def store(self, message, kind):
            super().store(message, kind)
            if self.stored == 2:
                raise cause

    vehicle = Breaking(OLD)
    arguments = (mission_file,) if command == "upload" else _plan(vehicle, fields)
    found, document, stderr = stepped(vehicle, command, *arguments)
    assert document["error"] == error
    assert_said(document, found, code)
    assert ("a bug in pbpp" in document["message"]) is (error == "DefectError")
    assert ("please report" in stderr) is (error == "DefectError")


def _plan(vehicle, fields):
    from mavlink_bridge.mavlink.messages import MissionType
    from missions.fence import fence_to_items
    from missions.formats import read_fence

    vehicle.lists[MissionType.FENCE] = list(fence_to_items(read_fence(fields / "yard-fence.waypoints")))
    return "--target", "40.0720926,-105.2286152", "--upload"


@pytest.mark.parametrize("kind", [RebootsMidway, SilentMidway])
def test_plan_names_the_backup_of_an_upload_that_broke_off(stepped, fields, kind):
    vehicle = kind(OLD)
    code, document, _ = stepped(vehicle, "plan", *_plan(vehicle, fields))
    assert_said(document, code)


def test_plan_names_its_backup(stepped, fields):
    vehicle = Adversary(OLD)
    code, document, _ = stepped(vehicle, "plan", *_plan(vehicle, fields))
    assert (code, document["verified"]) == (0, True)
    assert places(read_backup(Path(document["backup"])).items) == places(OLD)
    again = stepped(vehicle, "plan", *_plan(vehicle, fields))[1]
    assert (again["verified"], again["backup"]) == (True, None)


def test_a_file_that_cannot_be_written_ends_a_plan_before_anything_is_written_to_the_vehicle(
    stepped, fields, tmp_path
):
    (tmp_path / "m.plan").mkdir()
    vehicle = Adversary(OLD)
    code, _, stderr = stepped(vehicle, "plan", *_plan(vehicle, fields), "-o", tmp_path / "m.plan")
    assert code == 3
    assert "m.plan cannot be written" in stderr
    assert (vehicle.counts, places(vehicle.held)) == (0, places(OLD))


def test_parameters_that_were_set_before_the_link_broke_are_named(stepped, tmp_path):
    path = tmp_path / "some.parm"
    path.write_text("WP_SPEED 3\nWP_RADIUS 4\nFENCE_MARGIN 5\n")
    vehicle = BreaksAtSet(OLD)
    code, document, _ = stepped(vehicle, "upload", path)
    assert code == 7
    assert (document["details"]["changed"], document["details"]["parameter"]) == (["WP_SPEED"], "WP_RADIUS")
    assert "WP_RADIUS may be set or not" in document["message"]
    assert "set before it: WP_SPEED" in document["message"]


def test_a_list_that_was_verified_before_is_named(stepped, tmp_path, fields):
    """The fence of a plan file is on the vehicle, its mission is not: that is not what was wanted."""
    from dataclasses import replace

    from missions.formats import read_situation, write_mission

    fence = read_situation(fields / "yard-fence.waypoints")
    own = tmp_path / "new.waypoints"
    own.write_text(format_items(NEW))
    path = tmp_path / "both.plan"
    write_mission(replace(fence, mission=read_situation(own).mission), path)

    class BreaksAtMission(Adversary):
        def on_mission_request_list(self, message):
            if message.mission_type == 0:
                self.is_gone = True
            super().on_mission_request_list(message)

    vehicle = BreaksAtMission(OLD)
    code, document, _ = stepped(vehicle, "upload", path)
    assert code == 7
    assert "the mission was not written" in document["message"]
    assert "written and verified before: fence" in document["message"]
    assert places(vehicle.held) == places(OLD)


def test_after_a_verified_list_nobody_says_that_nothing_was_written():
    cause = BackupError("the backup cannot be written: no space; nothing was written to the vehicle")
    assert str(end_of_upload(cause, None, ["fence"])) == (
        "the backup cannot be written: no space; nothing more was written to the vehicle; written and verified before: fence"
    )
    assert end_of_upload(cause, None) is cause


@pytest.mark.parametrize("command", ["upload", "plan", "bridge"])
@pytest.mark.skipif(os.name == "nt", reason="SIGTERM ends a program there at once")
def test_a_program_that_is_ended_in_mid_upload_says_so(mission_file, fields, command):
    vehicle = SilentMidway(OLD)
    arguments = [mission_file] if command == "upload" else list(_plan(vehicle, fields))
    with TcpVehicle(vehicle) as link:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "mavlink_bridge.cli",
                command,
                *map(str, arguments),
                "--connect",
                link.connection,
            ],
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
        )
        until_s = time.monotonic() + 60
        while vehicle.stored < 3 and time.monotonic() < until_s:
            time.sleep(0.02)
        lock = VehicleLock(VehicleMark(1, connection=link.connection, autopilot=3))
        assert lock.take().process == process.pid
        process.send_signal(signal.SIGTERM)
        said = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert MIXED in said
    [note] = BackupStore().notes()
    assert str(note.backup.path) in said


def test_a_link_that_breaks_under_the_bridge(fields):
    vehicle = RebootsMidway(OLD)
    with TcpVehicle(vehicle) as link:
        result = CliRunner().invoke(
            app, ["bridge", "--connect", link.connection, "--once", *_plan(vehicle, fields)]
        )
    assert result.exit_code == 7
    assert MIXED in result.output
    [note] = BackupStore().notes()
    assert str(note.backup.path) in result.output
