"""How a command ends: exit codes, and errors reported to people and scripts."""

from __future__ import annotations

import errno
import os
import re
import sys
import traceback
from collections.abc import Iterable, Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

import typer

from mavlink_bridge import errors as bridge_errors
from mavlink_bridge.cli.terminal import print_json, say
from missions import errors as mission_errors

_IS_WINDOWS = os.name == "nt"
_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG, errno.EIO)
"""Why what is open can be written no further."""


class ExitCode(IntEnum):
    """What the exit codes mean."""

    DONE = 0
    INTERNAL = 1
    USAGE = 2
    INPUT = 3
    NO_ROUTE = 4
    LINK = 5
    REFUSED = 6
    OUTCOME = 7
    CHECK = 8
    INTERRUPTED = 130


class Level(IntEnum):
    """How grave a message is; ``-q`` leaves out the lowest level, ``-qq`` the two lowest."""

    INFO = 0
    WARNING = 1
    ERROR = 2

    @classmethod
    def of_severity(cls, name: str) -> Level:
        """Return the level of an event by the name of its severity."""
        return {"critical": cls.ERROR, "error": cls.ERROR, "warning": cls.WARNING}.get(name, cls.INFO)


_EXIT_CODES: tuple[tuple[type[Exception], ExitCode], ...] = (
    (mission_errors.PlanCheckError, ExitCode.INTERNAL),
    (mission_errors.RouteError, ExitCode.NO_ROUTE),
    (mission_errors.MissionError, ExitCode.INPUT),
    (bridge_errors.UsageError, ExitCode.USAGE),
    (bridge_errors.LogError, ExitCode.INPUT),
    (bridge_errors.DatasetError, ExitCode.INPUT),
    (bridge_errors.LostWorkerError, ExitCode.INPUT),
    (bridge_errors.LinkError, ExitCode.LINK),
    (bridge_errors.ClusterError, ExitCode.LINK),
    (bridge_errors.RefusedError, ExitCode.REFUSED),
    (bridge_errors.OutcomeError, ExitCode.OUTCOME),
    (bridge_errors.BridgeError, ExitCode.INTERNAL),
)

_DEFECTS = (bridge_errors.DefectError, mission_errors.PlanCheckError)

_ADVICE: Mapping[type[Exception], tuple[str, ...]] = {
    mission_errors.InvalidPositionError: (
        "write the latitude first: LAT,LON in decimal degrees, such as 40.0713,-105.2299",
    ),
    mission_errors.FenceMissingError: ("upload a fence to the vehicle", "use a file that contains one"),
    mission_errors.FenceError: ("correct the fence where it was drawn, and save or upload it again",),
    mission_errors.MissionFormatError: ("fix the file, or export it again from the program that made it",),
    mission_errors.VehicleError: ("correct the parameter on the vehicle or in the file",),
    mission_errors.RequestError: (),
    mission_errors.SituationError: (),
    mission_errors.PlanStoppedError: (),
    mission_errors.RouteError: (),
    mission_errors.StartBlockedError: (
        "drive the vehicle into the allowed area by hand",
        "add --escape to plan the way out",
    ),
    mission_errors.TargetBlockedError: (
        "choose another target",
        "add --snap M to move it to the nearest free place within M metres",
    ),
    mission_errors.MissionTooLongError: (
        "use fewer targets, or drive in parts",
        "give --vehicle FILE if the vehicle has more storage (BRD_SD_MISSION)",
    ),
    mission_errors.ExtrapolatedError: (
        "change what the message names",
        "add --trust-model to promise, and upload, all the same",
    ),
    mission_errors.NoRouteError: (
        "ask for less with --clearance (--clearance max finds the widest route)",
        "add --accept-less to take the widest route there is",
    ),
    mission_errors.PlanCheckError: (
        "nothing was written; please report this with the command and its input files",
    ),
    mission_errors.MissionError: (),
    bridge_errors.LogError: (),
    bridge_errors.DatasetError: (),
    bridge_errors.IdentityTakenError: ("use another component id: --source-component",),
    bridge_errors.VehicleNotFoundError: ("choose another vehicle with --system N",),
    bridge_errors.LinkError: (
        "is the vehicle on, and is another program using the port? `pbpp doctor` lists the serial ports",
    ),
    bridge_errors.ClusterError: (),
    bridge_errors.LostWorkerError: (
        "give the machine more memory, or leave out the file or row at which the worker died",
    ),
    bridge_errors.RefusedError: ("see the vehicle's own messages in the ground station",),
    bridge_errors.VehicleInUseError: ("wait for the other pbpp to finish, or stop it",),
    bridge_errors.OutcomeError: ("check what the vehicle holds (`pbpp download`) before it drives",),
    bridge_errors.DefectError: ("check what the vehicle holds (`pbpp download`) before it drives",),
    bridge_errors.BackupError: ("nothing was written; check the file that the message names",),
    bridge_errors.OtherVehicleError: ("give --other-vehicle if the backup belongs on this vehicle",),
    bridge_errors.BridgeError: (),
}
"""What helps with each kind of error where the error does not say it itself; several are alternatives. A test looks that every kind is here."""

_ACTIVE_OUTCOME = "active"
"""`OutcomeKind.ACTIVE` as details have it: text, so that help need not load the protocols' own words."""

_ACTIVE_ADVICE = (
    "add --hold to switch it to HOLD first",
    "add --replace-active to write while it drives",
)
_SILENT_ADVICE: Mapping[str, str] = {
    "serial": "is the vehicle on, and is another program using the port? The baud rate must match the vehicle's SERIALn_BAUD "
    "(/dev/ttyUSB0,57600); `pbpp doctor` lists the serial ports",
    "udpin": "is the vehicle on, and is its telemetry sent to this computer's address and port? A firewall may block it, or "
    "another ground station may hold the same port",
    "udpout": "is the vehicle on, and does it (or its router) listen on this address and port?",
    "tcp": "is the vehicle on, and does the other end send MAVLink on this port?",
    "tcpin": "is the vehicle on, and does it (or its router) connect to this address and port?",
}
"""What to look at where nothing at all came over a link, by the link's kind."""

_OPTION = re.compile(r"--[a-z-]+")
_REPORT = (
    "please report this line with the command and its input files; PBPP_TRACEBACK=1 or -v shows the traceback"
)


@dataclass(slots=True)
class Telling:
    """Which command runs, how much it prints, and which info and warnings it has printed."""

    command: str = ""
    verbose: bool = False
    quiet: int = 0
    """How often ``-q`` was given."""
    told: set[str] = field(default_factory=set)
    options: object = None
    """The command's options, as they were given."""

    def prints(self, level: Level) -> bool:
        """Return whether messages of a level are printed, as text and in JSON."""
        return level >= min(self.quiet, Level.ERROR)


_telling: ContextVar[Telling | None] = ContextVar("telling", default=None)


def telling() -> Telling:
    """Return how much the running command prints."""
    return _telling.get() or begin_telling("")


def begin_telling(command: str, *, verbose: bool = False, quiet: int = 0, options: object = None) -> Telling:
    """Begin a command."""
    now = Telling(command, verbose, quiet, options=options)
    _telling.set(now)
    return now


def exit_code_of(error: Exception) -> ExitCode:
    """Return the exit code of an error."""
    return next((code for kind, code in _EXIT_CODES if isinstance(error, kind)), ExitCode.INTERNAL)


def is_ours(error: Exception) -> bool:
    """Return whether an error was expected to happen; another one is a bug."""
    return isinstance(error, (mission_errors.MissionError, bridge_errors.BridgeError))


def error_name(error: Exception) -> str:
    """Return the name by which documents call an error."""
    return type(error).__name__ if is_ours(error) else "InternalError"


def error_line(error: Exception) -> str:
    """Return what an error says, in one line; of a bug, of one of many tasks as well, what broke and where."""
    if is_ours(error):
        return str(error)
    return (
        _defect_line(error)
        if error.__traceback__ is not None
        else f"internal error, a bug in pbpp: {error!r}"
    )


def is_reader_gone(error: Exception) -> bool:
    """Return whether nobody reads the standard output any more; Windows calls that an invalid argument."""
    if isinstance(error, BrokenPipeError):
        return True
    if not _IS_WINDOWS or not isinstance(error, OSError) or error.errno != errno.EINVAL:
        return False
    try:
        sys.stdout.flush()  # what could not be written is still there
    except OSError:
        return True
    return False


def drop_stdout() -> int:
    """Let go of a standard output that nobody reads any more (``pbpp log … | head``); return the exit code, as a shell reports SIGPIPE."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 128 + 13


def report_full_stdout(command: str, error: Exception) -> ExitCode | None:
    """Report that the standard output cannot be written, as on a full disk; return the exit code, None where the error is another."""
    if not isinstance(error, OSError) or error.filename is not None or error.errno not in _FULL:
        return None
    drop_stdout()
    message = f"standard output cannot be written: {error.strerror}"
    report(
        command, "FileError", message, ExitCode.INPUT, {"advice": "free some space there"}, wants_json=False
    )
    return ExitCode.INPUT


def report_error(command: str, error: Exception, *, wants_json: bool) -> ExitCode:
    """Report an error of ours; return its exit code."""
    code = exit_code_of(error)
    details = dict(getattr(error, "details", {}))
    if advice := advice_for(command, error):
        details["advice"] = advice
    message = str(error)
    if isinstance(error, _DEFECTS) and error.__cause__ is not None:
        message += f"; {_defect_line(error.__cause__)}"
        details["advice"] = "; ".join(filter(None, (details.get("advice"), _REPORT)))
        details |= _trace_of(error.__cause__, wanted=telling().verbose)
    report(command, type(error).__name__, message, code, details, wants_json=wants_json)
    return code


def _defect_line(error: BaseException) -> str:
    place = traceback.extract_tb(error.__traceback__)[-1]
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"internal error, a bug in pbpp: {what} (at {Path(place.filename).name}:{place.lineno})"


def _trace_of(error: BaseException, *, wanted: bool) -> dict[str, str]:
    """Put a defect's traceback on stderr where it is wanted; return it for the document."""
    if not wanted and os.environ.get("PBPP_TRACEBACK", "") in ("", "0"):
        return {}
    trace = "".join(traceback.format_exception(error))
    for line in trace.split("\n"):
        say(line)
    return {"traceback": trace}


def report_defect(command: str, error: BaseException, *, wants_json: bool, verbose: bool = False) -> ExitCode:
    """Report what should never happen, in a line that says what broke and where; return its exit code."""
    details: dict[str, object] = {"advice": _REPORT, **_trace_of(error, wanted=verbose)}
    report(command, "InternalError", _defect_line(error), ExitCode.INTERNAL, details, wants_json=wants_json)
    return ExitCode.INTERNAL


def report(
    command: str,
    name: str,
    message: str,
    code: ExitCode,
    details: Mapping[str, object] | None = None,
    *,
    wants_json: bool,
) -> None:
    """Print an error: what and why in a line, what to do in another; with JSON wanted as one document too."""
    rest = dict(details or {})
    advice = rest.pop("advice", None)
    if wants_json:
        print_json(
            {
                "status": "error",
                "command": command,
                "error": name,
                "message": message,
                "advice": advice,
                "exit_code": int(code),
                "details": rest,
            }
        )
    say(f"error: {message}", typer.colors.RED)
    shown = ", ".join(f"{key} = {value}" for key, value in rest.items() if key != "traceback")
    if telling().verbose and shown:
        say(f"details: {shown}", typer.colors.BRIGHT_BLACK)
    if advice:
        say(f"advice: {advice}", typer.colors.CYAN)


def advice_for(command: str, error: Exception) -> str | None:
    """Return what would help, as far as the command that runs has the options for it; None where the message says all there is to say."""
    details = getattr(error, "details", {})
    if (silent := _silent_advice(details)) is not None:
        return silent
    if details.get("outcome") == _ACTIVE_OUTCOME:
        return _alternatives(_ACTIVE_ADVICE, str(error))
    if "advice" in details:
        return str(details["advice"]) if details["advice"] else None
    if isinstance(error, bridge_errors.UsageError):
        return f"see `pbpp {command} --help`"
    return _alternatives(
        next((_ADVICE[kind] for kind in type(error).__mro__ if kind in _ADVICE), ()), str(error)
    )


def _alternatives(advice: Iterable[str], message: str) -> str | None:
    """Return those that need no option, or one that the command has and that was neither switched on nor named in the message already."""
    helps = [one for one in advice if all(_is_of_use(option, message) for option in _OPTION.findall(one))]
    return ", or ".join(helps) or None


def _is_of_use(option: str, message: str) -> bool:
    if option in message:
        return False
    options = telling().options
    name = option.removeprefix("--").replace("-", "_")
    return options is None or getattr(options, name, True) is not True


def _silent_advice(details: Mapping[str, object]) -> str | None:
    """Return what to look at where nothing was heard on the link of the command that runs."""
    connect = getattr(telling().options, "connect", None)
    if details.get("heard") != [] or not connect:
        return None
    from mavlink_bridge.link import parse_connection  # noqa: PLC0415 - the link is there already, if it was silent

    return _SILENT_ADVICE[parse_connection(connect).kind]
