"""``pbpp diff``: two missions or fences told apart, in words, as JSON, and on a picture."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import typer

from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.field_files import read_file
from mavlink_bridge.cli.pictures import check_plots, draw, stills
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.errors import UsageError
from missions.checking.differences import ChangeKind, differences, summary
from missions.formats import Part, parts_of
from missions.picture.differences import differences_scene
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.cli.options.diff import DiffOptions
    from mavlink_bridge.console.one_file import StillPage
    from missions.checking.differences import FileDifference
    from missions.geo import LatLon
    from missions.picture.scene import PictureScene
    from missions.situation import Situation

_PARTS = (Part.MISSION, Part.FENCE, Part.RALLY)
_COLOURS = {
    ChangeKind.ONLY_A: typer.colors.RED,
    ChangeKind.ONLY_B: typer.colors.GREEN,
    ChangeKind.OTHER: typer.colors.YELLOW,
}


def diff(options: DiffOptions) -> None:
    """Report the differences; end with 8 if there are any."""
    check_plots(options.plot, json_output=options.json_output)
    if options.only is not None and options.only not in _PARTS:
        raise UsageError(f"--only {options.only!r}: expected one of {', '.join(_PARTS)}")
    a, b = (read_file(path, options) for path in (options.a, options.b))
    parts = _compared(options, a, b)
    found = differences(a, b, parts)
    code = ExitCode.CHECK if found else ExitCode.DONE
    drawn = draw(partial(_scene, options, a, b, found), partial(_page, b, found), options.plot)
    if options.json_output:
        print_json(
            {
                "status": "different" if found else "ok",
                "command": "diff",
                "exit_code": int(code),
                "a": str(options.a),
                "b": str(options.b),
                "parts": [str(part) for part in parts],
                "differences": list(map(_document, found)),
                "outputs": [str(path) for path in drawn],
            }
        )
    else:
        _report(options, a, b, parts, found)
        for path in drawn if not options.quiet else ():
            echo(f"Wrote {path}")
    if found:
        raise typer.Exit(code)


def _compared(options: DiffOptions, a: Situation, b: Situation) -> list[Part]:
    """Return the parts to compare: the one that is asked for, else all that either file holds.

    Raises
    ------
    UsageError
        Neither file holds any, or each holds something else, so that there is nothing to compare.
    """
    held = [[part for part in _PARTS if part in parts_of(one)] for one in (a, b)]
    if options.only is not None:
        held = [[part for part in parts if part == options.only] for parts in held]
    if not held[0] and not held[1]:
        what = options.only or "mission, fence or rally points"
        raise UsageError(f"neither {options.a} nor {options.b} holds a {what}")
    if options.only is None and not set(held[0]) & set(held[1]):
        told = [
            f"{path} holds {' and '.join(parts) or 'no mission, fence or rally points'}"
            for path, parts in zip((options.a, options.b), held, strict=True)
        ]
        raise UsageError(f"nothing to compare: {'; '.join(told)}")
    return [part for part in _PARTS if part in (*held[0], *held[1])]


def _report(
    options: DiffOptions, a: Situation, b: Situation, parts: Sequence[Part], found: Sequence[FileDifference]
) -> None:
    if options.quiet:
        return
    for part in parts:
        echo(
            f"{part}: {summary(a, part)} in {options.a.name} (A); {summary(b, part)} in {options.b.name} (B)"
        )
        for one in found:
            if one.part is part:
                echo(f"{one.change} {one.text}", _COLOURS[one.change])
    echo(f"{counted(len(found), 'difference')}" if found else "The same")


def _document(one: FileDifference) -> dict[str, object]:
    return {
        "part": one.part,
        "change": {ChangeKind.ONLY_A: "only in A", ChangeKind.ONLY_B: "only in B", ChangeKind.OTHER: "other"}[
            one.change
        ],
        "text": one.text,
        "name_a": one.name_a,
        "name_b": one.name_b,
        "a": [list(place) for place in one.a],
        "b": [list(place) for place in one.b],
        "moved_m": None if one.moved_m is None else round(one.moved_m, 3),
    }


def _scene(options: DiffOptions, a: Situation, b: Situation, found: Sequence[FileDifference]) -> PictureScene:
    marks: list[tuple[LatLon, str]] = []
    for one in found:
        places = one.b or one.a
        if places:
            name = one.name_b or one.name_a or ""
            marks.append((places[0], f"{one.change} {name}".strip()))
    title = [
        f"A: {options.a.name}   B: {options.b.name}",
        counted(len(found), "difference") if found else "the same",
    ]
    return differences_scene(a, b, title, marks)


def _page(b: Situation, found: Sequence[FileDifference], scene: PictureScene) -> StillPage:
    page: StillPage = stills().files_still(scene, b, [f"{one.change} {one.text}" for one in found])
    return page
