"""``pbpp config``: where options may be kept, and what is set by what."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.app import COMMANDS, load
from mavlink_bridge.cli.options_file import DARING, FOR_ALL, is_there, options_for, read_tables, user_file
from mavlink_bridge.cli.terminal import echo, echo_lines, print_json

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.cli.options.config import ConfigOptions

_VARIABLES = {
    "NO_COLOR": "no colour",
    "PBPP_TRACEBACK": "show tracebacks of internal errors",
    "XDG_CONFIG_HOME": "base folder of the options file",
    "XDG_STATE_HOME": "base folder of the backups",
}


@dataclass(frozen=True, slots=True)
class Setting:
    """One option that is not at its default."""

    command: str
    option: str
    value: object
    source: str


def config(options: ConfigOptions) -> None:
    """Print where options come from and which are set, or an example file."""
    if options.template:
        echo_lines(_TEMPLATE.splitlines())
        return
    own = user_file()
    settings = settings_of(own, is_asked_for=False) if is_there(own) else []
    if options.config is not None:
        given = settings_of(options.config, is_asked_for=True)
        covered = {(setting.command, setting.option) for setting in given}
        settings = [one for one in settings if (one.command, one.option) not in covered] + given
    variables = {name: os.environ[name] for name in _VARIABLES if os.environ.get(name)}
    backups = BackupStore().folder
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "config",
                "file": str(own),
                "exists": is_there(own),
                "backups": str(backups),
                "settings": [asdict(setting) for setting in settings],
                "environment": variables,
            }
        )
        return
    if options.quiet:
        return
    echo(
        f"Your options: {own}{'' if is_there(own) else ' (does not exist; `pbpp config --template` prints an example)'}"
    )
    echo(f"Backups of vehicles' missions, fences and rally points: {backups}")
    for setting in settings:
        echo(f"pbpp {setting.command} {setting.option} {setting.value}   (by {setting.source})")
    for name, value in variables.items():
        echo(f"{name}={value}: {_VARIABLES[name]}")


def settings_of(path: Path, *, is_asked_for: bool) -> list[Setting]:
    """Return what a file sets, for each command that it touches.

    Raises
    ------
    typer.BadParameter
        The file is not an options file, or sets an option that does not exist.
    """
    tables = read_tables(path)
    if unknown := sorted(set(tables) - {FOR_ALL, *COMMANDS}):
        raise typer.BadParameter(
            f"{path}: [{unknown[0]}] is not a command; expected one of {', '.join(COMMANDS)}"
        )
    settings = []
    nobodys = set(tables.get(FOR_ALL, {}))
    for name in COMMANDS if FOR_ALL in tables else tables:
        options = {parameter.name: parameter for parameter in load(name).params if parameter.name}
        del options["config"]
        for option, value in options_for(path, name, set(options), is_asked_for=is_asked_for).items():
            settings.append(Setting(name, options[option].opts[-1], value, str(path)))
            nobodys.discard(option)
    if nobodys:
        raise typer.BadParameter(
            f"{path}: no command has the option {min(nobodys).replace('_', '-')!r} of [{FOR_ALL}]"
        )
    return settings


_TEMPLATE = f"""\
# Options for pbpp: one table per command, options by their long names.
# What changes a vehicle ({", ".join(DARING).replace("_", "-")}) is refused here: give it on the command line.

[{FOR_ALL}]
# connect = "udpin:0.0.0.0:14550"
# signing-key = "/home/me/rover.key"

[plan]
# clearance = 2.5
# plot = ["plan.png"]

[bridge]
# target-from = ["typed", "echo"]
"""
