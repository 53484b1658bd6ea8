"""What every command shares: how it is made from its options, how its errors end, and warnings."""

from __future__ import annotations

import dataclasses
import inspect
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import typer

from mavlink_bridge import errors as bridge_errors
from mavlink_bridge.cli.failing import (
    ExitCode,
    Level,
    begin_telling,
    drop_stdout,
    is_reader_gone,
    report,
    report_defect,
    report_error,
    report_full_stdout,
    telling,
)
from mavlink_bridge.cli.terminal import say
from mavlink_bridge.cli.terminating import terminable
from missions import errors as mission_errors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from mavlink_bridge.cli.options.shared import CommonOptions


def command_of(name: str) -> Callable[..., None]:
    """Return a command as typer reads it: its options are the fields of a class, its help is that class's docstring.

    What runs it is loaded when it runs; its errors end in one clear line (with ``--json`` one document) and the right exit code.
    """
    kind: type[CommonOptions] = getattr(
        import_module(f"mavlink_bridge.cli.options.{name}"), f"{name.capitalize()}Options"
    )

    def run(**given: Any) -> None:  # noqa: ANN401 - any command's options
        options = kind(**{option: value for option, value in given.items() if value is not None})
        begin_telling(name, verbose=options.verbose, quiet=options.quiet, options=options)
        try:
            with terminable():
                getattr(import_module(f"mavlink_bridge.cli.{name}"), name)(options)
        except (mission_errors.MissionError, bridge_errors.BridgeError) as error:
            raise typer.Exit(report_error(name, error, wants_json=options.json_output)) from None
        except KeyboardInterrupt as interrupt:
            left = "; the vehicle was left as it was" if getattr(options, "connect", None) else ""
            message = str(interrupt) or f"interrupted{left}"
            details = getattr(interrupt, "details", None)
            report(
                name, "Interrupted", message, ExitCode.INTERRUPTED, details, wants_json=options.json_output
            )
            raise typer.Exit(ExitCode.INTERRUPTED) from None
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except Exception as error:
            if is_reader_gone(error):
                raise typer.Exit(drop_stdout()) from None
            if (code := report_full_stdout(name, error)) is not None:
                raise typer.Exit(code) from None
            if isinstance(error, OSError) and error.filename is not None:
                message = f"{error.filename}: {error.strerror or error}"
                report(name, "FileError", message, ExitCode.INPUT, wants_json=options.json_output)
                raise typer.Exit(ExitCode.INPUT) from None
            raise typer.Exit(
                report_defect(name, error, wants_json=options.json_output, verbose=options.verbose)
            ) from error

    run.__doc__ = kind.__doc__
    run.__signature__ = inspect.Signature(_parameters(kind))  # type: ignore[attr-defined]
    return run


def _parameters(kind: type[CommonOptions]) -> list[inspect.Parameter]:
    """Return a parameter for each option: a command's own stand first in help, then those that it shares."""
    kinds = get_type_hints(kind, include_extras=True)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    names = dict.fromkeys(name for base in kind.__mro__ for name in inspect.get_annotations(base))
    return [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=_default(fields[name]), annotation=kinds[name]
        )
        for name in names
    ]


def _default(field: dataclasses.Field[Any]) -> object:
    if field.default_factory is not dataclasses.MISSING:
        return None
    return inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default


def warn(texts: Iterable[str]) -> None:
    """Put warnings on stderr, one a line and each once; none with ``-qq``."""
    _say_once(Level.WARNING, texts, typer.colors.YELLOW)


def inform(texts: Iterable[str]) -> None:
    """Put what is only good to know on stderr, one a line and each once; none with ``-q``."""
    _say_once(Level.INFO, texts, typer.colors.BRIGHT_BLACK)


def _say_once(level: Level, texts: Iterable[str], colour: str) -> None:
    told = telling().told
    for text in texts:
        if text not in told and telling().prints(level):
            told.add(text)
            say(f"{level.name.lower()}: {text}", colour)


def remarks_document(info: Iterable[str], warnings: Iterable[str]) -> dict[str, list[str]]:
    """Return for a JSON document what is told at each level."""
    return {
        "info": list(info) if telling().prints(Level.INFO) else [],
        "warnings": list(warnings) if telling().prints(Level.WARNING) else [],
    }


def is_same_file(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one existing file, however they are written: Windows and macOS ignore capitals."""
    return one.exists() and other.exists() and one.samefile(other)
