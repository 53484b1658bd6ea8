"""What every command shares: exit codes, errors for people and scripts, options of links."""

from __future__ import annotations

import functools
import json
import math
import sys
import tomllib
import traceback
from collections.abc import Mapping
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mavlink_bridge import errors as bridge_errors
from missions import errors as mission_errors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


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


_EXIT_CODES: tuple[tuple[type[Exception], ExitCode], ...] = (
    (mission_errors.PlanCheckError, ExitCode.INTERNAL),
    (mission_errors.RouteError, ExitCode.NO_ROUTE),
    (mission_errors.MissionError, ExitCode.INPUT),
    (bridge_errors.UsageError, ExitCode.USAGE),
    (bridge_errors.LogError, ExitCode.INPUT),
    (bridge_errors.LinkError, ExitCode.LINK),
    (bridge_errors.RefusedError, ExitCode.REFUSED),
    (bridge_errors.OutcomeError, ExitCode.OUTCOME),
    (bridge_errors.BridgeError, ExitCode.INTERNAL),
)

ConnectOption = Annotated[
    str | None,
    typer.Option(
        "--connect",
        metavar="CONNECTION",
        help="A live link: udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD].",
    ),
]
SystemOption = Annotated[
    int | None,
    typer.Option("--system", metavar="N", min=1, max=255, help="Which vehicle, when several are heard."),
]
SourceSystemOption = Annotated[int, typer.Option(min=1, max=255, help="The system id we speak as.")]
SourceComponentOption = Annotated[int, typer.Option(min=1, max=255, help="The component id we speak as.")]
TimeoutOption = Annotated[float, typer.Option(metavar="S", min=0.1, help="How long to wait for the vehicle.")]
AnyVehicleOption = Annotated[
    bool, typer.Option("--any-vehicle", help="Take vehicles that are neither rover nor boat too.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no report.")]


def _take_config(context: typer.Context, path: Path | None) -> Path | None:
    """Make a file's options the defaults of the command that runs."""
    if path is None:
        return None
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise typer.BadParameter(f"{path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise typer.BadParameter(f"{path}: not TOML: {error}") from None
    options = document.get(context.info_name or "", {})
    known = {parameter.name for parameter in context.command.params}
    defaults = {name.replace("-", "_"): value for name, value in options.items()}
    if unknown := sorted(set(defaults) - known):
        raise typer.BadParameter(f"{path}: unknown option {unknown[0]!r} in [{context.info_name}]")
    context.default_map = {**(context.default_map or {}), **defaults}
    return path


ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE.toml",
        is_eager=True,
        callback=_take_config,
        help="Options from a file, under the command's name; those given here count more.",
    ),
]


def exit_code_of(error: Exception) -> ExitCode:
    """Give the exit code of an error."""
    return next(code for kind, code in _EXIT_CODES if isinstance(error, kind))


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Wrap a command so that its errors end in one clear line (with ``--json`` one document) and the right exit code."""

    @functools.wraps(command)
    def run(**options: Any) -> None:  # noqa: ANN401 - any command's options
        wants_json = bool(options.get("json_output"))
        try:
            command(**options)
        except (mission_errors.MissionError, bridge_errors.BridgeError) as error:
            code = exit_code_of(error)
            _report(
                command.__name__, type(error).__name__, str(error), code, error.details, wants_json=wants_json
            )
            raise typer.Exit(code) from None
        except KeyboardInterrupt as interrupt:
            message = str(interrupt) or "interrupted; the vehicle was left as it was"
            _report(command.__name__, "Interrupted", message, ExitCode.INTERRUPTED, {}, wants_json=wants_json)
            raise typer.Exit(ExitCode.INTERRUPTED) from None
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except Exception as error:
            _report(
                command.__name__,
                "InternalError",
                _defect(error),
                ExitCode.INTERNAL,
                {},
                wants_json=wants_json,
            )
            raise typer.Exit(ExitCode.INTERNAL) from error

    return run


def print_json(document: Mapping[str, object]) -> None:
    """Put a JSON document on stdout; numbers that JSON has not become null."""
    sys.stdout.write(json.dumps(_plain(document), allow_nan=False) + "\n")


def _plain(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return value


def _defect(error: Exception) -> str:
    """Say in one line what broke and where, so that it can be reported."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(place.filename).name}:{place.lineno}"
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"internal error, a bug in pbpp: {what} (at {where}); please report this line with the command and its input files"


def warn(texts: Iterable[str]) -> None:
    """Put warnings on stderr, one a line."""
    for text in texts:
        typer.secho(f"warning: {text}", err=True, fg=typer.colors.YELLOW)


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Callable[[str, int, int], None]]:
    """Show a progress bar on stderr; give the function that moves it: text, steps done, steps in all."""
    if quiet or not sys.stderr.isatty():
        yield lambda _text, _done, _total: None
        return
    from rich.console import Console  # noqa: PLC0415 - quick help
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415

    columns = (TextColumn("{task.description:<38}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("", total=None)

        def show(text: str, done: int, total: int) -> None:
            progress.update(task, description=text, completed=done, total=total or None)

        yield show


def _report(
    command: str, name: str, message: str, code: ExitCode, details: Mapping[str, object], *, wants_json: bool
) -> None:
    if wants_json:
        print_json(
            {
                "status": "error",
                "command": command,
                "error": name,
                "message": message,
                "exit_code": int(code),
                "details": dict(details),
            }
        )
    typer.secho(f"error: {message}", err=True, fg=typer.colors.RED)
