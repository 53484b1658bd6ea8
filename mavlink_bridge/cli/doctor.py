"""``pbpp doctor``: whether this installation can do its work."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from importlib import metadata
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.config import settings_of
from mavlink_bridge.cli.failing import ExitCode, Level, telling
from mavlink_bridge.cli.field_files import read_vehicle_file
from mavlink_bridge.cli.options_file import is_there, user_file
from mavlink_bridge.cli.terminal import echo, echo_labelled, print_json
from mavlink_bridge.errors import UsageError
from mavlink_bridge.mavlink.signing import SigningKey
from missions.drive_model import beyond_measured
from missions.errors import MissionError
from missions.formats import read_situation
from missions.geo import LatLon
from missions.request import GoTo
from missions.vehicle import vehicle_from_parameters
from missions.vehicle.calibration import calibrated, calibration_info
from missions.vehicle.parameter_remarks import assumed_remarks, range_remarks

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mavlink_bridge.cli.options.doctor import DoctorOptions
    from missions.firmware import Firmware

_NEEDED = (
    "numpy",
    "shapely",
    "geographiclib",
    "pyproj",
    "pymavlink",
    "pyserial",
    "typer",
    "rich",
    "platformdirs",
)
_WANTED = {"matplotlib": "pictures (.png, .pdf) and charts"}
_START, _TARGET = (40.071374, -105.229930), (40.0726316, -105.2290497)
_CLEARANCE_M = 2.5  # of the test plan, for which `SHORTEST_M` holds
SHORTEST_M = 163.1
"""No route of the test plan can be shorter: by a visibility graph around the same fence (a test of this project)."""


class _Verdict(StrEnum):
    """How a look turned out."""

    OK = "ok"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"

    @property
    def level(self) -> Level:
        """How grave it is, as other messages are."""
        return Level.INFO if self is _Verdict.OK else Level[self.name]


@dataclass(frozen=True, slots=True)
class _Finding:
    """What was found, and what to do about it."""

    verdict: _Verdict
    what: str
    found: str
    advice: str | None = None


def doctor(options: DoctorOptions) -> None:
    """Look at everything, and report each finding."""
    looks: list[Callable[[], Iterator[_Finding]]] = [
        _python, _packages, _ports, _options, lambda: _key(options.signing_key), _backups, _test_plan,
        lambda: _vehicle(options.vehicle, options.firmware),
    ]  # fmt: skip
    findings = [finding for look in looks for finding in look()]
    is_well = all(finding.verdict is not _Verdict.ERROR for finding in findings)
    if options.json_output:
        status = {"status": "ok"} if is_well else {"status": "error", "exit_code": int(ExitCode.CHECK)}
        print_json({**status, "command": "doctor", "findings": [asdict(finding) for finding in findings]})
    else:
        for finding in findings:
            if telling().prints(finding.verdict.level):
                _tell(finding)
    if not is_well:
        raise typer.Exit(ExitCode.CHECK)


def _tell(finding: _Finding) -> None:
    colour = {
        _Verdict.OK: typer.colors.GREEN,
        _Verdict.INFO: typer.colors.BRIGHT_BLACK,
        _Verdict.WARNING: typer.colors.YELLOW,
        _Verdict.ERROR: typer.colors.RED,
    }
    echo_labelled(f"{finding.verdict:<7}", colour[finding.verdict], f"{finding.what}: {finding.found}")
    if finding.advice:
        echo(f"         advice: {finding.advice}")


def _python() -> Iterator[_Finding]:
    version = platform.python_version()
    found = f"{version} ({sys.executable}) on {platform.system()} {platform.machine()}"
    yield _Finding(_Verdict.OK, "Python", found)


def _packages() -> Iterator[_Finding]:
    yield _Finding(_Verdict.OK, "pbpp-rover", metadata.version("pbpp-rover"))
    for name in _NEEDED:
        try:
            yield _Finding(_Verdict.OK, name, metadata.version(name))
        except metadata.PackageNotFoundError:
            yield _Finding(_Verdict.ERROR, name, "not installed", f"python -m pip install {name}")
    for name, use in _WANTED.items():
        try:
            yield _Finding(_Verdict.OK, name, metadata.version(name))
        except metadata.PackageNotFoundError:
            advice = "python -m pip install 'pbpp-rover[plot]'"
            yield _Finding(_Verdict.INFO, name, f"not installed: no {use}", advice)


def _ports() -> Iterator[_Finding]:
    from serial.tools.list_ports import comports  # noqa: PLC0415 - a library that does not load is no reason not to look on

    ports = sorted(comports(), key=lambda port: port.device)
    if not ports:
        yield _Finding(_Verdict.INFO, "serial ports", "none found (radios and autopilots on USB appear here)")
    for port in ports:
        told = f"{port.description}" if port.description not in (None, "n/a", port.device) else "present"
        if os.name == "posix" and not os.access(port.device, os.R_OK | os.W_OK):
            # Something on USB was plugged in to be used; a computer's own ports are often wired to nothing.
            verdict = _Verdict.INFO if port.vid is None else _Verdict.ERROR
            advice = _permission_advice(Path(port.device))
            yield _Finding(
                verdict, f"serial port {port.device}", f"{told}, but you have no permission to use it", advice
            )
        else:
            yield _Finding(_Verdict.OK, f"serial port {port.device}", told)


def _permission_advice(device: Path) -> str:
    if sys.platform.startswith("linux"):  # elsewhere there is no such command, or no such group
        with suppress(KeyError, OSError):
            group = device.group()
            if group != "root":  # nobody should be in that one for the sake of a port
                return f"sudo usermod -aG {group} $USER, then log in again"
    return f"ask the administrator for access to {device}"


def _options() -> Iterator[_Finding]:
    path = user_file()
    if not is_there(path):
        yield _Finding(_Verdict.OK, "options file", f"none ({path})")
        return
    try:
        count = len(settings_of(path, is_asked_for=False))
    except typer.BadParameter as error:
        yield _Finding(
            _Verdict.ERROR,
            "options file",
            error.message,
            "fix it; `pbpp config --template` prints an example",
        )
    else:
        yield _Finding(_Verdict.OK, "options file", f"{path} ({count} options set)")


def _key(path: Path | None) -> Iterator[_Finding]:
    if path is None:
        return
    try:
        SigningKey.read(path)
    except UsageError as error:
        yield _Finding(_Verdict.ERROR, "signing key", str(error))
    else:
        yield _Finding(
            _Verdict.OK,
            "signing key",
            f"{path} is a signing key; only you can read it"
            if os.name == "posix"
            else f"{path} is a signing key",
        )


def _backups() -> Iterator[_Finding]:
    folder = BackupStore().folder
    above = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        with tempfile.TemporaryFile(dir=above):
            pass
    except OSError as error:
        advice = "uploads need this folder: make it writable, or set XDG_STATE_HOME"
        yield _Finding(_Verdict.ERROR, "backups", f"{above} cannot be written: {error.strerror}", advice)
        return
    kept = len(list(folder.glob("system-*Z.json"))) if folder.is_dir() else 0
    yield _Finding(_Verdict.OK, "backups", f"{folder} ({kept} kept)")


def _test_plan() -> Iterator[_Finding]:
    """Plan through the demo's maze; the answer is known, and its clearance is measured again."""
    request = GoTo(
        start=LatLon(*_START), target=LatLon(*_TARGET), clearance_m=_CLEARANCE_M, corner_allowance_m=0.0
    )
    try:
        from shapely import LineString  # noqa: PLC0415 - a library that does not load is a finding too

        from missions.planning.plan import plan  # noqa: PLC0415 - as above

        with as_file(files("mavlink_bridge.cli") / "data" / "maze-fence.waypoints") as path:
            situation = replace(read_situation(path), home=None)
        planned = plan(situation, request)
        line = LineString(planned.ground.frame.to_local_array(planned.path))
        clearance_m = planned.ground.clearance_m(line)
    except Exception as error:  # noqa: BLE001 - whatever is broken here is what is looked for
        yield _Finding(
            _Verdict.ERROR, "test plan", f"{type(error).__name__}: {error}", "reinstall, or report this"
        )
        return
    found = f"{planned.length_m:.2f} m, {clearance_m:.3f} m from every fence"
    is_right = SHORTEST_M <= planned.length_m <= 1.01 * SHORTEST_M and clearance_m >= _CLEARANCE_M
    if is_right:
        yield _Finding(_Verdict.OK, "test plan", found)
    else:
        wanted = f"expected {SHORTEST_M} m (at most 1 % more) and {_CLEARANCE_M} m"
        yield _Finding(
            _Verdict.ERROR,
            "test plan",
            f"{found}; {wanted}",
            "do not drive plans of this installation; install it again",
        )


def _vehicle(file: Path | None, firmware: Firmware | None) -> Iterator[_Finding]:
    """Look at a parameter file: what of it is assumed, and what lies outside the drive model's measurements."""
    if file is None:
        return

    try:
        described = read_vehicle_file(file)
        firmware = firmware or described.firmware
        vehicle = vehicle_from_parameters(
            described.parameters, firmware=firmware, ardupilot=described.ardupilot
        )
        vehicle = calibrated(vehicle, described)
    except MissionError as error:
        yield _Finding(_Verdict.ERROR, "vehicle", str(error))
        return
    version = firmware or "of an unknown version (--firmware)"
    verdict = _Verdict.WARNING if vehicle.has_measured_corners is None else _Verdict.OK
    yield _Finding(verdict, "vehicle", f"{vehicle.autopilot} {version}, {vehicle.steering} steering")
    for told in calibration_info(vehicle):
        yield _Finding(_Verdict.OK, "vehicle", told)
    for remark in (
        *range_remarks(described.parameters, ardupilot=described.ardupilot),
        *assumed_remarks(vehicle),
    ):
        yield _Finding(_Verdict.WARNING, "vehicle", remark)
    for reason in beyond_measured(vehicle):
        yield _Finding(
            _Verdict.WARNING,
            "vehicle",
            reason,
            "plans promise no clearance for it, unless --trust-model is given",
        )
