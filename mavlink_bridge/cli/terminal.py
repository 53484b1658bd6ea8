"""The one way to the standard output and standard error: whatever comes from outside arrives there harmless.

A line is put out as one line, with every character seen (`missions.words`), so that neither a vehicle's text nor a file's name
moves the cursor, names the window or passes for a line of ours. What has several lines is put out line by line. Nothing else in the command line
prints (a test looks).
"""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import TextIO

import typer

from missions.words import harmless


def says_no_colour() -> bool:
    """Return whether the user wants no colour (https://no-color.org), or the terminal has none."""
    return bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"


def echo(line: str, colour: str | None = None) -> None:
    """Put a line on stdout, in colour if that is a terminal."""
    _put(line, colour, is_error=False)


def say(line: str, colour: str | None = None, *, nl: bool = True) -> None:
    """Put a line on stderr, in colour if that is a terminal; without its end where an answer is to stand behind it.

    Where it cannot be written (a full disk, nobody who reads it) the line is lost, and the command goes on.
    """
    with suppress(OSError):
        _put(line, colour, is_error=True, nl=nl)


def echo_lines(lines: Iterable[str]) -> None:
    """Put several lines on stdout."""
    for line in lines:
        echo(line)


def echo_labelled(label: str, colour: str, line: str) -> None:
    """Put a line on stdout that begins with a label in colour."""
    shown = f"{typer.style(harmless(label), fg=colour)}  {harmless(line)}"
    typer.echo(shown, color=_colour_wanted())


def echo_help(text: str) -> None:
    """Put a help text on stdout: it is all ours, with its colours."""
    typer.echo(text)


def print_json(document: Mapping[str, object]) -> None:
    """Put a JSON document on stdout, as `json_line` makes it."""
    sys.stdout.write(json_line(document) + "\n")


def json_line(document: Mapping[str, object]) -> str:
    """Return a JSON document in one line, in ASCII; numbers that JSON has not become null."""
    text = json.dumps(_plain(document), allow_nan=False)  # which lets one control character through: DEL
    return text.replace("\x7f", "\\u007f")


def print_json_list(
    head: Mapping[str, object],
    name: str,
    members: Iterable[Mapping[str, object]],
    tail: Callable[[], Mapping[str, object]],
) -> None:
    """Put one JSON document on stdout that has a list of any length: each member is written as it comes, the tail once all have come."""
    sys.stdout.write(f"{json_line(head)[:-1]}, {json.dumps(name)}: [")
    for number, member in enumerate(members):
        sys.stdout.write(f"{', ' if number else ''}{json_line(member)}")
    sys.stdout.write(f"], {json_line(tail())[1:]}\n")


def print_text(pieces: Iterable[str]) -> None:
    """Put a document of another format on stdout, piece by piece, a line each; whoever makes it has made it harmless."""
    for piece in pieces:
        sys.stdout.write(f"{piece}\n")


def _put(line: str, colour: str | None, *, is_error: bool, nl: bool = True) -> None:
    shown = _fitted(harmless(line), sys.stderr if is_error else sys.stdout)
    typer.secho(shown, err=is_error, nl=nl, fg=colour, color=_colour_wanted())


def _fitted(line: str, stream: TextIO) -> str:
    """Return a line broken between words where a terminal is narrower; what follows is indented, so that it passes for no line of its own."""
    if not stream.isatty() or len(line) <= (columns := shutil.get_terminal_size().columns):
        return line
    shown = textwrap.fill(
        line,
        columns,
        subsequent_indent="  ",
        replace_whitespace=False,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return shown + line[len(line.rstrip()) :]  # a question ends with a blank before its answer


def _colour_wanted() -> bool | None:
    return False if says_no_colour() else None


def _plain(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if isinstance(value, (str, int, float)) or value is None:
        return value
    return str(value)
