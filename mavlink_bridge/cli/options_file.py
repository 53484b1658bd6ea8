"""Options from TOML files: the user's own, which every command reads, and those given with ``--config``.

A table has a command's name and holds its options by their long names; the table ``all`` is for every command that knows the option.
What is given on the command line counts most, then ``--config``, then the user's file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from mavlink_bridge.user_folders import config_folder

FILE_NAME = "pbpp.toml"
FOR_ALL = "all"
DARING = (
    "upload",
    "drive",
    "arm",
    "replace_active",
    "hold",
    "restore",
    "other_vehicle",
    "forget",
    "rtl_by_route",
)
"""Options that change a vehicle: never from a file that is read unasked."""


def user_file() -> Path:
    """Return the path of the user's options file, whether it exists or not."""
    return config_folder() / FILE_NAME


def is_there(path: Path) -> bool:
    """Return whether a file exists; one in a folder that we may not look into counts as missing."""
    try:
        return path.is_file()
    except OSError:
        return False


def read_tables(path: Path) -> dict[str, dict[str, Any]]:
    """Read a file of options: for each table the options by parameter name.

    Raises
    ------
    typer.BadParameter
        It cannot be read, is not TOML, or holds something else than tables.
    """
    import tomllib  # noqa: PLC0415 - quick start where there is no such file

    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise typer.BadParameter(f"{path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        is_escape = "'\\'" in str(error) or "hex" in str(error)
        hint = "; in TOML write a path with \\ in 'single quotes'" if is_escape else ""
        raise typer.BadParameter(f"{path}: not TOML: {error}{hint}") from None
    for name, table in document.items():
        if not isinstance(table, dict):
            raise typer.BadParameter(
                f"{path}: {name!r} is outside a table; write it under [{FOR_ALL}] or a command such as [plan]"
            )
    return {
        name: {option.replace("-", "_"): _as_typed(value) for option, value in table.items()}
        for name, table in document.items()
    }


def options_for(path: Path, command: str, known: set[str], *, is_asked_for: bool) -> dict[str, Any]:
    """Return the options that a file sets for a command.

    Parameters
    ----------
    path : Path
        The file.
    command : str
        The command's name.
    known : set of str
        The parameters that it has.
    is_asked_for : bool
        Whether the user named the file in this very call.

    Raises
    ------
    typer.BadParameter
        The file is not an options file, or sets what the command does not know or what only the command line may.
    """
    tables = read_tables(path)
    own = tables.get(command, {})
    if unknown := sorted(set(own) - known):
        raise typer.BadParameter(f"{path}: unknown option {unknown[0].replace('_', '-')!r} in [{command}]")
    options = {name: value for name, value in tables.get(FOR_ALL, {}).items() if name in known} | own
    if not is_asked_for and (daring := [name for name in DARING if name in options]):
        raise typer.BadParameter(
            f"{path}: {daring[0].replace('_', '-')!r} changes a vehicle: give it on the command line or in a file named with --config"
        )
    return options


def take_options(context: typer.Context, path: Path | None) -> Path | None:
    """Make the files' options the defaults of the command that runs (the callback of ``--config``)."""
    if context.resilient_parsing:
        return path
    command = context.info_name or ""
    known = {parameter.name for parameter in context.command.params if parameter.name} - {"config"}
    options: dict[str, Any] = {}
    own = user_file()
    if is_there(own):
        options |= options_for(own, command, known, is_asked_for=False)
    if path is not None:
        options |= options_for(path, command, known, is_asked_for=True)
    repeatable = {
        parameter.name for parameter in context.command.params if getattr(parameter, "multiple", False)
    }
    options = {
        name: [value] if name in repeatable and not isinstance(value, list) else value
        for name, value in options.items()
    }
    if options:
        context.default_map = {**(context.default_map or {}), **options}
    return path


def _as_typed(value: object) -> object:
    """Return a value as if it had been typed: the commands read numbers from text."""
    if isinstance(value, list):
        return [_as_typed(one) for one in value]
    return value if isinstance(value, bool) else str(value)
