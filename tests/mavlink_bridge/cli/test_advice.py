"""What people are told to do: what helps in their case, and nothing that does not."""

from __future__ import annotations

import json
import re
import socket
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from mavlink_bridge import errors as bridge_errors
from mavlink_bridge.cli.app import COMMANDS, app, load
from mavlink_bridge.cli.failing import advice_for, begin_telling
from mavlink_bridge.protocol.verified_outcome import OutcomeKind
from missions import errors as mission_errors

if TYPE_CHECKING:
    from pathlib import Path


def advice_of(*arguments: str) -> str:
    """Run a command that fails; return its advice, as JSON and as a line the same."""
    told = CliRunner().invoke(app, [arguments[0], "--json", *arguments[1:]])
    assert told.exit_code not in (0, 1), told.output
    document = json.loads(told.stdout)
    assert document["status"] == "error"
    lines = [line for line in told.stderr.splitlines() if line.startswith("advice: ")]
    assert lines == [f"advice: {document['advice']}"]
    return str(document["advice"])


def test_who_is_walled_in_is_not_told_to_ask_for_less(logs: Path) -> None:
    advice = advice_of("plan", "--log", str(logs / "island-unreachable.tlog"))
    assert (
        advice == "less clearance does not help: open a gap in exclusion polygon 1, or choose another target"
    )


def test_who_is_not_walled_in_is(logs: Path) -> None:
    advice = advice_of("plan", "--log", str(logs / "guided-maze.tlog"), "--clearance", "9")
    assert "--clearance max" in advice


def test_a_blocked_target_is_a_matter_of_the_target_even_for_the_widest_way(logs: Path) -> None:
    away = ("--clearance", "max", "--target", "40.07,-105.2")
    assert "another target" in advice_of("plan", "--log", str(logs / "guided-maze.tlog"), *away)


def test_a_silent_udp_port_is_no_matter_of_baud_rates_or_system_ids() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    advice = advice_of("plan", "--connect", f"udpin:127.0.0.1:{port}", "--timeout", "0.3")
    assert "this computer's address and port" in advice
    assert not {"baud", "serial", "--system"} & set(re.findall(r"--\w+|\w+", advice))


def test_a_server_that_is_not_there_is_no_matter_of_serial_ports() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    advice = advice_of("plan", "--connect", f"tcp:127.0.0.1:{port}", "--timeout", "0.3")
    assert "is the other side running" in advice
    assert "serial" not in advice


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            ("convert", "{fields}/yard-fence.waypoints", "{out}/fence.xyz"),
            "the file extension sets the format",
        ),
        (
            (
                "check",
                "--mission",
                "{fields}/yard-fence.waypoints",
                "--fence",
                "{fields}/yard-fence.waypoints",
            ),
            "use a file that contains a mission",
        ),
        (("plan", "--fence", "{fields}/nothing.plan", "--target", "40,-105"), "check the path"),
    ],
)
def test_files(fields: Path, tmp_path: Path, arguments: tuple[str, ...], expected: str) -> None:
    words = [word.format(fields=fields, out=tmp_path) for word in arguments]
    assert expected in advice_of(*words)


FILE = "fix the file, or export it again from the program that made it"
HELD = "check what the vehicle holds (`pbpp download`) before it drives"
ADVICE = {
    "MissionError": None,
    "InvalidPositionError": "write the latitude first: LAT,LON in decimal degrees, such as 40.0713,-105.2299",
    "FenceError": "correct the fence where it was drawn, and save or upload it again",
    "FenceMissingError": "upload a fence to the vehicle, or use a file that contains one",
    "MissionFormatError": FILE,
    "VehicleError": "correct the parameter on the vehicle or in the file",
    "RequestError": None,
    "SituationError": None,
    "PlanStoppedError": None,
    "ExtrapolatedError": "change what the message names, or add --trust-model to promise, and upload, all the same",
    "PlanCheckError": "nothing was written; please report this with the command and its input files",
    "RouteError": None,
    "StartBlockedError": "drive the vehicle into the allowed area by hand, or add --escape to plan the way out",
    "TargetBlockedError": "choose another target, or add --snap M to move it to the nearest free place within M metres",
    "NoRouteError": "ask for less with --clearance (--clearance max finds the widest route), or add --accept-less to take the widest route there is",
    "MissionTooLongError": "use fewer targets, or drive in parts, or give --vehicle FILE if the vehicle has more storage (BRD_SD_MISSION)",
    "BridgeError": None,
    "UsageError": "see `pbpp plan --help`",
    "LogError": None,
    "DatasetError": None,
    "ClusterError": None,
    "LostWorkerError": "give the machine more memory, or leave out the file or row at which the worker died",
    "LinkError": "is the vehicle on, and is another program using the port? `pbpp doctor` lists the serial ports",
    "IdentityTakenError": "use another component id: --source-component",
    "VehicleNotFoundError": "choose another vehicle with --system N",
    "RefusedError": "see the vehicle's own messages in the ground station",
    "VehicleInUseError": "wait for the other pbpp to finish, or stop it",
    "OutcomeError": HELD,
    "DefectError": HELD,
    "BackupError": "nothing was written; check the file that the message names",
    "OtherVehicleError": "give --other-vehicle if the backup belongs on this vehicle",
}
"""Every kind of error, and what it advises where the error itself says nothing better: a new kind must be added, with words for it or None."""


def kinds_of(root: type[Exception]) -> set[type[Exception]]:
    """Return an error and every kind of it that the project has."""
    own = {root} if root.__module__ in (mission_errors.__name__, bridge_errors.__name__) else set()
    return own.union(*(kinds_of(kind) for kind in root.__subclasses__()))


KINDS = kinds_of(mission_errors.MissionError) | kinds_of(bridge_errors.BridgeError)


def test_every_kind_of_error_has_its_advice() -> None:
    begin_telling("plan")
    assert {kind.__name__: advice_for("plan", kind("it failed")) for kind in KINDS} == ADVICE


def options_of(command: str, **given: object) -> SimpleNamespace:
    """Return a command's options as they stand when none but these are given."""
    module = __import__(f"mavlink_bridge.cli.options.{command}", fromlist=[command])
    kind = getattr(module, f"{command.capitalize()}Options")
    unset = {parameter.name: None for parameter in load(command).params if parameter.name}
    return SimpleNamespace(**{name: unset.get(name) for name in kind.__dataclass_fields__} | given)


@pytest.mark.parametrize("command", COMMANDS)
def test_advice_names_only_options_that_the_command_has(command: str) -> None:
    begin_telling(command, options=options_of(command))
    known = {option for parameter in load(command).params for option in parameter.opts} | {"--help"}
    for kind in KINDS:
        for error in (kind("it failed"), kind("it failed", outcome=OutcomeKind.ACTIVE)):
            assert set(re.findall(r"--[a-z-]+", advice_for(command, error) or "")) <= known


def test_what_was_asked_for_already_is_not_advised() -> None:
    begin_telling("plan", options=options_of("plan", escape=True))
    advice = advice_for("plan", mission_errors.StartBlockedError("no way out"))
    assert advice == "drive the vehicle into the allowed area by hand"


def test_a_vehicle_in_auto_is_a_matter_of_hold() -> None:
    error = bridge_errors.RefusedError("armed and driving", outcome=OutcomeKind.ACTIVE)
    begin_telling("plan", options=options_of("plan"))
    assert advice_for("plan", error) == "add --hold to switch it to HOLD first"
    begin_telling("upload", options=options_of("upload"))
    assert "--hold" in str(advice_for("upload", error))
    assert "--replace-active" in str(advice_for("upload", error))
    begin_telling("bridge", options=options_of("bridge"))
    assert advice_for("bridge", error) is None


@pytest.mark.parametrize(
    ("connect", "word"),
    [
        ("/dev/ttyUSB0,57600", "baud"),
        ("udpin:0.0.0.0:14550", "this computer's address"),
        ("0.0.0.0:14550", "this computer's address"),
        ("udpout:10.0.0.1:14550", "listen on this address"),
        ("tcp:10.0.0.1:5760", "send MAVLink on this port"),
        ("tcpin:0.0.0.0:5760", "connect to this address"),
    ],
)
def test_a_silent_link_is_looked_at_by_its_kind(connect: str, word: str) -> None:
    error = bridge_errors.VehicleNotFoundError("no HEARTBEAT", heard=[], advice="is it on?")
    begin_telling("plan", options=options_of("plan", connect=connect))
    advice = str(advice_for("plan", error))
    assert word in advice
    assert ("baud" in advice) == connect.startswith("/dev")


def test_a_start_in_an_exclusion_hears_of_escape(fields: Path) -> None:
    middle = "40.0714,-105.2296"
    standing = (
        "plan",
        "--fence",
        str(fields / "yard-fence.waypoints"),
        "--target",
        "40.0720926,-105.2286152",
    )
    advice = advice_of(*standing, "--start", middle)
    assert "--escape" in advice


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--plot", "{out}/x.jpg"), "choose another file extension"),
        (("-o", "{out}/x.fen"), "file extension|suffix"),
    ],
)
def test_what_cannot_be_written_is_no_matter_of_the_file_that_was_read(
    fields: Path, tmp_path: Path, arguments: tuple[str, ...], expected: str
) -> None:
    words = [word.format(out=tmp_path) for word in arguments]
    ends = ("--start", "40.071374,-105.229930", "--target", "40.0720926,-105.2286152")
    advice = advice_of("plan", "--fence", str(fields / "yard-fence.waypoints"), *ends, *words)
    assert re.search(expected, advice)


def test_a_fence_that_a_format_cannot_hold(fields: Path, tmp_path: Path) -> None:
    advice = advice_of(
        "convert",
        str(fields / "yard-fence.waypoints"),
        str(tmp_path / "two.fen"),
        "--return-point",
        "40.07,-105.22",
    )
    assert ".plan" in advice
