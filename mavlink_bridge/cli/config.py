"""``pbpp config``: where options may be kept, and what is set by what."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import ConfigOption, JsonOption, QuietOption, print_json
from mavlink_bridge.cli.options_file import DARING, FOR_ALL, is_there, options_for, read_tables, user_file
from mavlink_bridge.cli.terminal import echo, echo_lines

if TYPE_CHECKING:
    from pathlib import Path

_VARIABLES = {
    "NO_COLOR": "no colour",
    "PBPP_TRACEBACK": "internal errors with their traceback",
    "XDG_CONFIG_HOME": "folder above the options file",
    "XDG_STATE_HOME": "folder above the backups",
}


@dataclass(frozen=True, slots=True)
class Setting:
    """One option that is not at its default."""

    command: str
    option: str
    value: object
    source: str


def config(
    template: Annotated[
        bool, typer.Option("--template", help="Print an example file, to be saved where yours belongs.")
    ] = False,
    config: ConfigOption = None,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Show where the file of your options lies, what it sets, and which environment variables count.

    The command line counts most, then `--config FILE`, then your own file, then the defaults in `--help`.

    For example:

    `pbpp config`

    `pbpp config --config bridge.toml --json`

    `pbpp config --template`
    """
    if template:
        echo_lines(_TEMPLATE.splitlines())
        return
    from mavlink_bridge.backup.store import BackupStore  # noqa: PLC0415 - quick help

    own = user_file()
    settings = settings_of(own, is_asked_for=False) if is_there(own) else []
    if config is not None:
        given = settings_of(config, is_asked_for=True)
        covered = {(setting.command, setting.option) for setting in given}
        settings = [one for one in settings if (one.command, one.option) not in covered] + given
    variables = {name: os.environ[name] for name in _VARIABLES if os.environ.get(name)}
    backups = BackupStore().folder
    if json_output:
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
    if quiet:
        return
    echo(f"Your options: {own}{'' if is_there(own) else ' (not there; `pbpp config --template` shows one)'}")
    echo(f"Backups of what was on vehicles: {backups}")
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
    from mavlink_bridge.cli.app import COMMANDS, load  # noqa: PLC0415 - which loads this module

    tables = read_tables(path)
    if unknown := sorted(set(tables) - {FOR_ALL, *COMMANDS}):
        raise typer.BadParameter(f"{path}: [{unknown[0]}] is no command; there are {', '.join(COMMANDS)}")
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
# Options for pbpp. A table has a command's name and holds its options by their long names.
# What changes a vehicle ({", ".join(DARING).replace("_", "-")}) does not belong here: it is refused.

[{FOR_ALL}]
# connect = "udpin:0.0.0.0:14550"
# signing-key = "/home/me/rover.key"

[plan]
# clearance = 2.5
# plot = ["plan.png"]

[bridge]
# target-from = ["typed", "echo"]
"""
