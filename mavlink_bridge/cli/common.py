"""What every command shares: exit codes, errors for people and scripts, options of links."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mavlink_bridge import errors as bridge_errors
from mavlink_bridge.cli.failing import (
    ExitCode,
    begin_telling,
    drop_stdout,
    exit_code_of,
    is_reader_gone,
    report,
    report_defect,
    report_error,
    telling,
)
from mavlink_bridge.cli.options_file import take_options
from mavlink_bridge.cli.terminal import console, print_json, say
from mavlink_bridge.cli.values import MOST_S, within
from missions import errors as mission_errors
from missions.harmless import harmless

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rich.progress import Progress

__all__ = [
    "AnyVehicleOption",
    "ConfigOption",
    "ConnectOption",
    "ExitCode",
    "JsonOption",
    "QuietOption",
    "SourceComponentOption",
    "SourceSystemOption",
    "SystemOption",
    "TimeoutOption",
    "exit_code_of",
    "guarded",
    "is_same_file",
    "print_json",
    "progress_bar",
    "warn",
]

LINK_PANEL, OUTPUT_PANEL = "Link", "Output"
"""How help groups what many commands have."""

ConnectOption = Annotated[
    str | None,
    typer.Option(
        "--connect",
        metavar="CONNECTION",
        help="A live link: udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
    ),
]
SystemOption = Annotated[
    int | None,
    typer.Option(
        "--system",
        metavar="N",
        min=1,
        max=255,
        help="Which vehicle, when several are heard.",
        rich_help_panel=LINK_PANEL,
    ),
]
SourceSystemOption = Annotated[
    int,
    typer.Option(metavar="N", min=1, max=255, help="The system id we speak as.", rich_help_panel=LINK_PANEL),
]
SourceComponentOption = Annotated[
    int,
    typer.Option(
        metavar="N", min=1, max=255, help="The component id we speak as.", rich_help_panel=LINK_PANEL
    ),
]
TimeoutOption = Annotated[
    float,
    typer.Option(
        metavar="S",
        parser=within(0.1, MOST_S, "seconds"),
        help="How long to wait for the vehicle.",
        rich_help_panel=LINK_PANEL,
    ),
]
AnyVehicleOption = Annotated[
    bool,
    typer.Option(
        "--any-vehicle", help="Take vehicles that are neither rover nor boat too.", rich_help_panel=LINK_PANEL
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="One JSON document on stdout.", rich_help_panel=OUTPUT_PANEL)
]
QuietOption = Annotated[
    bool, typer.Option("--quiet", "-q", help="No progress and no report.", rich_help_panel=OUTPUT_PANEL)
]


ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE.toml",
        is_eager=True,
        callback=take_options,
        help="Options from a file; options given here override it. See `pbpp config`.",
        rich_help_panel=OUTPUT_PANEL,
    ),
]


VerboseOption = Annotated[
    bool,
    typer.Option(
        "--verbose",
        "-v",
        help="Show more: details of errors, progress without a terminal.",
        rich_help_panel=OUTPUT_PANEL,
    ),
]

_FOR_EVERY_COMMAND: Mapping[str, tuple[Any, object]] = {
    "config": (ConfigOption, None),
    "verbose": (VerboseOption, False),
    "quiet": (QuietOption, False),
}


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Wrap a command so that its errors end in one clear line (with ``--json`` one document) and the right exit code.

    The options that every command has are added where it does not have them itself.
    """
    signature = inspect.signature(command, eval_str=True)
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, (annotation, default) in _FOR_EVERY_COMMAND.items()
        if name not in signature.parameters
    ]

    @functools.wraps(command)
    def run(**options: Any) -> None:  # noqa: ANN401 - any command's options
        wants_json = bool(options.get("json_output"))
        verbose = bool(options.get("verbose"))
        name = command.__name__
        begin_telling(name, verbose=verbose)
        telling().quiet = bool(options.get("quiet"))
        for parameter in added:
            options.pop(parameter.name, None)
        try:
            command(**options)
        except (mission_errors.MissionError, bridge_errors.BridgeError) as error:
            raise typer.Exit(report_error(name, error, wants_json=wants_json)) from None
        except KeyboardInterrupt as interrupt:
            message = str(interrupt) or "interrupted; the vehicle was left as it was"
            details = getattr(interrupt, "details", None)
            report(name, "Interrupted", message, ExitCode.INTERRUPTED, details, wants_json=wants_json)
            raise typer.Exit(ExitCode.INTERRUPTED) from None
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except Exception as error:
            if is_reader_gone(error):
                raise typer.Exit(drop_stdout()) from None
            if isinstance(error, OSError) and error.filename is not None:
                message = f"{error.filename}: {error.strerror or error}"
                report(name, "FileError", message, ExitCode.INPUT, wants_json=wants_json)
                raise typer.Exit(ExitCode.INPUT) from None
            raise typer.Exit(report_defect(name, error, wants_json=wants_json, verbose=verbose)) from error

    run.__signature__ = signature.replace(parameters=[*signature.parameters.values(), *added])  # type: ignore[attr-defined]
    return run


def warn(texts: Iterable[str]) -> None:
    """Put warnings on stderr, one a line and each once."""
    told = telling().warned
    for text in texts:
        if text not in told:
            told.add(text)
            say(f"warning: {text}", typer.colors.YELLOW)


def is_same_file(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one existing file, however they are written: Windows and macOS ignore capitals."""
    return one.exists() and other.exists() and one.samefile(other)


class Shown:
    """Shows how far a command is: text, steps done, steps in all. This one shows nothing."""

    def __call__(self, text: str, done: int, total: int) -> None:
        """Show it."""

    def aside(self) -> AbstractContextManager[None]:
        """Clear the terminal of what moves on it, for as long as the context lasts."""
        return nullcontext()


class _LineProgress(Shown):
    """Prints progress in lines, one for each new text."""

    def __init__(self) -> None:
        self._last = ""

    def __call__(self, text: str, _done: int, _total: int) -> None:
        if text != self._last:
            self._last = text
            say(text)


class _Bar(Shown):
    """A progress bar on stderr."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=None)

    def __call__(self, text: str, done: int, total: int) -> None:
        self._progress.update(self._task, description=harmless(text), completed=done, total=total or None)

    @contextmanager
    def aside(self) -> Iterator[None]:
        self._progress.stop()
        try:
            yield
        finally:
            self._progress.start()


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Shown]:
    """Show a progress bar on stderr where that is a terminal; yields what moves it."""
    if not sys.stderr.isatty() or quiet:
        yield _LineProgress() if telling().verbose and not quiet else Shown()
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415 - quick help

    told = TextColumn("{task.description:<38}", markup=False)
    columns = (told, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console(err=True), transient=True) as progress:
        yield _Bar(progress)
