"""The application: its commands, each loaded when it is called, and the one place where errors end."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from copy import copy
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from mavlink_bridge.cli.common import command_of
from mavlink_bridge.cli.failing import (
    ExitCode,
    drop_stdout,
    is_reader_gone,
    report,
    report_defect,
    report_full_stdout,
)
from mavlink_bridge.cli.terminal import echo, echo_help, says_no_colour

COMMANDS = {
    "plan": "Plan a mission around fences; write it, draw it, upload it.",
    "check": "Check every leg of a mission against a fence.",
    "diff": "Compare two missions or fences, in words and in a picture.",
    "rally": "Choose rally points that RTL reaches in a straight line.",
    "fence": "Make a fence fit for the vehicle: merge overlapping inclusions.",
    "convert": "Convert a file from one format to another.",
    "upload": "Upload a file to the vehicle and verify it, or restore a backup.",
    "download": "Download a mission, fence, rally points or parameters.",
    "bridge": "Run alongside the autopilot: plan to each target, upload verified missions.",
    "serve": "Serve the console: fence, plan and rover on a page.",
    "log": "Summarise telemetry logs.",
    "logs": "Make tables of many logs, query them, calibrate a rover.",
    "replay": "Replay recorded logs through the bridge.",
    "sim": "Run a simulated rover.",
    "demo": "Plan, upload and drive on a simulated rover, as a demonstration.",
    "doctor": "Check this installation: versions, ports, keys, a test plan.",
    "config": "Show where options can be saved, and which are set.",
}
"""Every command and its line in help, in the order of use; the module of the same name holds it."""


def _without_types(params: list[Any]) -> list[Any]:
    """Return parameters that show no type and no range in help beside what is written for people: ``<bool>``, ``<path>``, ``1<=x<=255``."""
    for param in params:
        if getattr(param, "is_flag", False) and param.metavar is None:
            param.metavar = ""
        if isinstance(param, TyperArgument):
            param.type = copy(param.type)  # some are shared
            param.type.get_metavar = lambda param, ctx: ""  # type: ignore[method-assign] # noqa: ARG005
        param._get_number_range_help_str = lambda: None  # noqa: SLF001
    return params


class SingleCommand(TyperCommand):
    """A command whose help shows no types but those written for people."""

    def get_params(self, ctx: Any) -> list[Any]:  # noqa: ANN401 - the parser library is typer's own affair
        """Return the options, with ``--help``."""
        return _without_types(super().get_params(ctx))


class Commands(TyperGroup):
    """A group that imports a command's module when the command is called: help and usage errors need none of them."""

    def get_params(self, ctx: Any) -> list[Any]:  # noqa: ANN401 - as above
        """Return the options, with ``--help``."""
        return _without_types(super().get_params(ctx))

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401, ARG002 - the parser library is typer's own affair
        """Return the names, in the order of help."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401 - as above
        """Return a command that was called before, or what help needs to know of it."""
        known = super().get_command(ctx, cmd_name)
        if known is None and cmd_name in COMMANDS:
            return TyperCommand(cmd_name, help=COMMANDS[cmd_name])
        return known

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 - as above
        """Load the command that is called, or suggest one of a similar name."""
        if args[0] in COMMANDS:
            self.commands[args[0]] = load(args[0])
        elif not args[0].startswith("-"):
            similar = get_close_matches(args[0], COMMANDS)
            hint = (
                f"did you mean {' or '.join(similar)}?" if similar else f"commands are {', '.join(COMMANDS)}"
            )
            ctx.fail(f"unknown command {args[0]!r}; {hint}")
        return super().resolve_command(ctx, args)

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:  # noqa: ANN401 - as above
        """Run, and end with the right exit code whatever happens."""
        if not options.get("standalone_mode", True):
            return super().main(args, *rest, **options)
        words = list(sys.argv[1:] if args is None else args)
        code = _exit_code(
            lambda: super(Commands, self).main(args, *rest, **{**options, "standalone_mode": False}), words
        )
        if code == ExitCode.USAGE and len(words) == 1 and words[0] in COMMANDS:
            load(words[0]).main(["--help"], prog_name=f"pbpp {words[0]}", standalone_mode=False)
        sys.exit(code)


@cache  # programs and tests call many commands in one process
def load(name: str) -> Any:  # noqa: ANN401 - a command of the parser library that typer uses
    """Return a command, with its options."""
    single = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)
    single.command(name, cls=SingleCommand)(command_of(name))
    return typer.main.get_command(single)


def _exit_code(run: Any, words: list[str]) -> int:  # noqa: ANN401 - a function without arguments
    wants_json = "--json" in words
    command = next((word for word in words if word in COMMANDS), "")
    try:
        code = int(run() or 0)
        sys.stdout.flush()
    except typer.Abort:
        report(command, "Interrupted", "aborted", ExitCode.INTERRUPTED, wants_json=wants_json)
        return ExitCode.INTERRUPTED
    except Exception as error:  # noqa: BLE001 - the last place where one can be reported
        if is_reader_gone(error):
            return drop_stdout()
        if (full := report_full_stdout(command, error)) is not None:
            return full
        if getattr(error, "exit_code", None) == ExitCode.USAGE and hasattr(error, "format_message"):
            _report_usage(error, command, wants_json=wants_json)
            return ExitCode.USAGE
        verbose = "-v" in words or "--verbose" in words
        return report_defect(command, error, wants_json=wants_json, verbose=verbose)
    return code


def _report_usage(error: Any, command: str, *, wants_json: bool) -> None:  # noqa: ANN401 - a click usage error, typer's own copy or click's
    path = f"pbpp {command}".strip()
    message = " ".join(error.format_message().split())
    option = getattr(error, "option_name", None) or getattr(getattr(error, "param", None), "name", None)
    details = {"option": option} if option else {}
    advice = f"see `{path} --help`"
    report(
        command, "UsageError", message, ExitCode.USAGE, {**details, "advice": advice}, wants_json=wants_json
    )


app = typer.Typer(
    name="pbpp",
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:  # noqa: FBT001 - typer's way
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415 - 9 ms that help need not wait for

        echo(f"pbpp {version('pbpp-rover')}")
        raise typer.Exit


@app.callback()
def _app(
    context: typer.Context,
    version: Annotated[  # noqa: ARG001 - its callback does it
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Safe missions for MAVLink ground rovers: routes around fences, verified on the vehicle.

    Nothing is written to a vehicle without `--upload`; nothing drives without `--drive`.
    """
    if says_no_colour():
        context.color = False
    if context.invoked_subcommand is None:
        echo_help(context.get_help())
        raise typer.Exit(ExitCode.USAGE)


def main() -> None:
    """Run the command line."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who called (>&-)
            nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - for as long as the program runs
            setattr(sys, name, nowhere)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a console that has no × shows a ? for it
            stream.reconfigure(errors="replace")
    app()
