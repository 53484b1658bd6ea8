"""Pictures of plans: images (matplotlib), interactive HTML (plotly), a sketch for the terminal; the suffix chooses.

Images and HTML need the extra ``plot``.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.files import write_file
from missions.picture.scene import Scene
from missions.picture.sketch import sketch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.formats.files import Writer
    from missions.geo import LatLon
    from missions.planned import Plan

__all__ = ["PICTURE_SUFFIXES", "TERMINAL", "check_picture_format", "draw_plan", "sketch_plan"]

_LIBRARIES = {".png": "matplotlib", ".svg": "matplotlib", ".pdf": "matplotlib", ".html": "plotly"}

PICTURE_SUFFIXES = tuple(_LIBRARIES)
"""The suffixes that a picture's file may have."""

TERMINAL = "-"
"""In place of a file: a sketch for the terminal."""


def check_picture_format(path: Path | str) -> None:
    """Check, before any work is done, that a picture can be drawn to a path.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, or the library that draws it is not installed.
    """
    if str(path) == TERMINAL:
        return
    path = Path(path)
    library = _LIBRARIES.get(path.suffix.lower())
    if library is None:
        raise MissionFormatError(
            f"{path}: no picture format for the suffix {path.suffix!r}; known are {', '.join(PICTURE_SUFFIXES)}, "
            f"and {TERMINAL} for a sketch in the terminal",
            file=str(path),
            advice="choose one of these",
        )
    if find_spec(library) is None:
        raise MissionFormatError(
            f"{path.suffix} pictures need {library}: pip install 'pbpp-rover[plot]'",
            file=str(path),
            advice="install it, or use - for a sketch in the terminal",
        )


def draw_plan(
    plan: Plan,
    path: Path | str,
    *,
    track: Sequence[LatLon] = (),
    title: str | None = None,
    blocks: bool = False,
    write: Writer = write_file,
) -> None:
    """Draw a plan to a file.

    Parameters
    ----------
    plan : Plan
        What was planned.
    path : Path or str
        The suffix chooses the format.
    track : sequence of LatLon
        Where the vehicle drove, if it did.
    title : str, optional
        Default: length, time and clearance.
    blocks : bool
        Whether to draw the blocks of the free space's partition too.
    write : callable
        What puts the bytes into the file.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, a library is not installed, or the file cannot be written.
    """
    path = Path(path)
    check_picture_format(path)
    scene = Scene(plan, track)
    if path.suffix.lower() == ".html":
        from missions.picture.html import html_page  # noqa: PLC0415 - slow to come, an extra

        write(path, html_page(scene, title=title, blocks=blocks))
    else:
        from missions.picture.figure import figure_image  # noqa: PLC0415 - slow to come, an extra

        write(path, figure_image(scene, path.suffix, title=title, blocks=blocks))


def sketch_plan(
    plan: Plan, *, track: Sequence[LatLon] = (), columns: int = 80, encoding: str = "utf-8"
) -> str:
    """Return a sketch of a plan for the terminal: plain text, no colours.

    Parameters
    ----------
    plan : Plan
        What was planned.
    track : sequence of LatLon
        Where the vehicle drove, if it did.
    columns : int
        The terminal's width.
    encoding : str
        What the terminal understands; where it has no block and braille characters, plain ones are used.

    Returns
    -------
    str
        Lines of at most that width.
    """
    return sketch(Scene(plan, track), columns=columns, encoding=encoding)
