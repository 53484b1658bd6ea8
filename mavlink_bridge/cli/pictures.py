"""Pictures that a command draws: to files, as images or as pages, and to the terminal."""

from __future__ import annotations

import shutil
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.terminal import echo_lines
from mavlink_bridge.errors import UsageError
from missions.picture import TERMINAL, check_picture_format, draw_scene
from missions.picture.sketch import sketch

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.console.one_file import StillPage
    from missions.picture.scene import PictureScene

_COLUMNS = 80  # of a sketch, at most
_PAGE_SUFFIX = ".html"


def check_plots(plots: list[Path], *, json_output: bool) -> None:
    """Check what `--plot` asks for, before any work is done.

    Raises
    ------
    UsageError
        A sketch and a JSON document both want the standard output.
    MissionFormatError
        A suffix is unknown, or what draws it is not installed.
    """
    if json_output and Path(TERMINAL) in plots:
        raise UsageError("--plot - and --json both write to standard output; give --plot a file")
    for path in plots:
        check_picture_format(path, beside=(_PAGE_SUFFIX,))


def stills() -> Any:  # noqa: ANN401 - a module
    """Return what makes pages: the console's, loaded for pages alone, so that no command starts slower for them."""
    return import_module("mavlink_bridge.console.stills")


def draw(
    make_scene: Callable[[], PictureScene],
    make_page: Callable[[PictureScene], StillPage],
    plots: list[Path],
) -> list[Path]:
    """Draw a scene, if that is asked for, to files and to the terminal where ``-`` is among them; return the files.

    ``make_page`` makes of the scene what a page shows, for files that are pages.
    """
    if not plots:
        return []
    scene = make_scene()
    for path in plots:
        if str(path) == TERMINAL:
            columns = min(_COLUMNS, shutil.get_terminal_size().columns)
            echo_lines(sketch(scene, columns=columns, encoding=sys.stdout.encoding).splitlines())
        elif path.suffix.lower() == _PAGE_SUFFIX:
            write_kept(path, stills().page_bytes(make_page(scene)))
        else:
            draw_scene(scene, path, write=write_kept)
    return [path for path in plots if str(path) != TERMINAL]
