"""Pictures of plans, checks and drives: images and a sketch for the terminal; the suffix chooses. PNG and PDF need the extra ``plot``.

Pages (``.html``) are the console's, and made by what knows it: `mavlink_bridge.console.stills.plan_page`, and the commands' ``--plot``.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.files import write_file
from missions.picture.page import scene_drawing
from missions.picture.plans import plan_scene
from missions.picture.sketch import Sketch, sketch
from missions.picture.svg import svg_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from missions.formats.files import Writer
    from missions.geo import LatLon
    from missions.picture.scene import PictureScene
    from missions.planned import Plan

__all__ = [
    "PICTURE_SUFFIXES",
    "TERMINAL",
    "Sketch",
    "check_picture_format",
    "draw_plan",
    "draw_scene",
    "sketch_of",
    "sketch_plan",
]

PICTURE_SUFFIXES = (".png", ".svg", ".pdf")
"""The suffixes that a picture's file may have."""

TERMINAL = "-"
"""In place of a file: a sketch for the terminal."""


def check_picture_format(path: Path | str, *, beside: Sequence[str] = ()) -> None:
    """Check, before any work is done, that a picture can be drawn to a path.

    Parameters
    ----------
    path : Path or str
        The suffix chooses the format.
    beside : sequence of str
        Suffixes that the caller writes itself.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, or the library that draws it is not installed.
    """
    if str(path) == TERMINAL:
        return
    path = Path(path)
    if path.suffix.lower() in beside:
        return
    if path.suffix.lower() not in PICTURE_SUFFIXES:
        is_page = path.suffix.lower() == ".html"
        raise MissionFormatError(
            f"{path}: {path.suffix!r} is not a supported picture format; supported: {', '.join((*PICTURE_SUFFIXES, *beside))}, "
            f"and {TERMINAL} for a sketch in the terminal",
            file=str(path),
            advice="pages are the console's: pbpp plan --plot, or mavlink_bridge.console.stills.plan_page"
            if is_page
            else "choose another file extension",
        )
    if path.suffix.lower() != ".svg" and find_spec("matplotlib") is None:
        raise MissionFormatError(
            f"{path.suffix} pictures need matplotlib: pip install 'pbpp-rover[plot]'",
            file=str(path),
            advice="install it, or use .svg, or - for a sketch in the terminal",
        )


def draw_plan(
    plan: Plan,
    path: Path | str,
    *,
    track: Sequence[LatLon] = (),
    title: str | None = None,
    unsafe: Mapping[int, LatLon | None] | None = None,
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
    unsafe : mapping of int to LatLon or None, optional
        The legs that a check found unsafe, counted from 0, each with the place. Default: the legs that cross the fence.
    blocks : bool
        Whether to draw the blocks of the free space's partition too.
    write : callable
        What puts the bytes into the file.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, a library is not installed, or the file cannot be written.
    """
    check_picture_format(path)
    draw_scene(plan_scene(plan, track=track, title=title, unsafe=unsafe, blocks=blocks), path, write=write)


def draw_scene(scene: PictureScene, path: Path | str, *, write: Writer = write_file) -> None:
    """Draw a scene to a file.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, a library is not installed, or the file cannot be written.
    """
    path = Path(path)
    check_picture_format(path)
    drawing = scene_drawing(scene)
    if path.suffix.lower() == ".svg":
        write(path, svg_bytes(drawing))
        return
    from missions.picture.figure import image_bytes  # noqa: PLC0415 - slow to come, an extra

    write(path, image_bytes(drawing, path.suffix))


def sketch_plan(
    plan: Plan,
    *,
    track: Sequence[LatLon] = (),
    unsafe: Mapping[int, LatLon | None] | None = None,
    columns: int = 80,
    encoding: str = "utf-8",
) -> str:
    """Return a sketch of a plan for the terminal: plain text, no colours.

    Parameters
    ----------
    plan : Plan
        What was planned.
    track : sequence of LatLon
        Where the vehicle drove, if it did.
    unsafe : mapping of int to LatLon or None, optional
        As for `draw_plan`.
    columns : int
        The terminal's width.
    encoding : str
        What the terminal understands; where it has no block and braille characters, plain ones are used.

    Returns
    -------
    str
        Lines of at most that width.
    """
    return sketch(plan_scene(plan, track=track, unsafe=unsafe), columns=columns, encoding=encoding)


def sketch_of(plan: Plan, *, columns: int, lines: int, encoding: str = "utf-8") -> Sketch:
    """Return the sketch of a plan into which a vehicle is drawn as it moves.

    Parameters
    ----------
    plan : Plan
        What was planned.
    columns, lines : int
        How wide and high it may be; at least 40 and 8.
    encoding : str
        What the terminal understands.
    """
    return Sketch(plan_scene(plan), columns=columns, lines=lines, encoding=encoding)
