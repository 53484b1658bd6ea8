"""``pbpp check``: every leg of a mission against a fence, from files, a log or a live vehicle."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from mavlink_bridge.cli.checked_mission import checked_of, document_of, items_text
from mavlink_bridge.cli.common import inform, warn
from mavlink_bridge.cli.drawing import cell, console
from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.home_parts import with_parts
from mavlink_bridge.cli.mission_source import check_source, source_kind
from mavlink_bridge.cli.pictures import check_plots, draw, stills
from mavlink_bridge.cli.terminal import echo, print_json
from missions.checking.findings import leg_sentence, not_confirmed_text
from missions.picture.plans import plan_scene
from missions.words import counted

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.cli.checked_mission import CheckedMission
    from mavlink_bridge.cli.options.check import CheckOptions
    from mavlink_bridge.console.one_file import StillPage
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.picture.scene import PictureScene


def check(options: CheckOptions) -> None:
    """Check each leg, and report, draw or print as JSON what was found."""
    if options.missions or options.format is not None or options.cluster is not None:
        import_module("mavlink_bridge.cli.check_many").check_many(options)  # one mission needs it not
        return
    check_source(options)
    check_plots(options.plot, json_output=options.json_output)
    found = checked_of(options)
    inform(found.checked.info)
    warn(found.warnings)
    draw(partial(_scene, found), partial(_page, options, found), options.plot)
    if options.json_output:
        print_json({**document_of(found), "outputs": [str(path) for path in options.plot]})
    else:
        _report(found.checked, options.plot, is_quiet=options.quiet > 0)
    if not found.checked.is_promised:
        raise typer.Exit(ExitCode.CHECK)


def _scene(found: CheckedMission) -> PictureScene:
    checked, planned, ways = found.checked, found.planned, found.ways
    count, broken = len(checked.legs), len(checked.broken)
    verdict = (
        f"FAIL: {broken} of {counted(count, 'leg')} {'does' if broken == 1 else 'do'} not keep"
        if broken
        else f"all {count} legs keep"
        if count > 1
        else "the leg keeps"
    )
    extrapolated = ", extrapolated" if checked.extrapolated else ""
    title = f"{checked.length_m:.1f} m, about {checked.duration_s:.0f} s\n{verdict} {checked.clearance_m:g} m while driving{extrapolated}"
    unsafe = {number: leg.at for number, leg in enumerate(checked.legs) if leg.breaks}
    scene = with_parts(plan_scene(planned, title=title, unsafe=unsafe), planned.items)
    return ways.drawn(scene) if ways is not None else scene


def _page(options: CheckOptions, found: CheckedMission, scene: PictureScene) -> StillPage:
    where = source_kind(options)
    page: StillPage = stills().check_still(
        scene, found.checked, found.planned, found.situation, found.request, where, found.warnings
    )
    return page


def _report(checked: MissionCheck, plots: list[Path], *, is_quiet: bool) -> None:
    if not is_quiet:
        _report_legs(checked, plots)
    for trouble in checked.troubles:
        echo(f"not understood: {trouble}", typer.colors.RED)
    for danger in checked.dangers:
        echo(f"DANGER: {danger}", typer.colors.RED)
    for leg in checked.broken:
        echo(f"FAIL: {leg_sentence(leg)}", typer.colors.RED)
    for way in checked.home_ways:
        if way.trouble:
            echo(f"FAIL: {way}: {way.trouble}", typer.colors.RED)
    kept = f"{checked.clearance_m:g} m while driving"
    if checked.holds and not checked.is_promised:
        echo(f"NOT CONFIRMED: {not_confirmed_text(checked)}", typer.colors.RED)
    if not checked.is_promised or is_quiet:
        return
    trusted = "; the drive model is trusted beyond what was measured" if checked.extrapolated else ""
    every = "every leg and way home" if checked.home_ways else "every leg"
    echo(f"PASS: {every} keeps {kept}{trusted}")


def _report_legs(checked: MissionCheck, plots: list[Path]) -> None:
    table = Table(box=None, pad_edge=False, collapse_padding=True)
    wrapped = {"leg", "nearest fence"}
    for name in ("leg", "length", "time", "drawn", "driven", "nearest fence", "where"):
        right = name in {"length", "time", "drawn", "driven"}
        table.add_column(name, justify="right" if right else "left", no_wrap=name not in wrapped)
    for leg in checked.legs:
        table.add_row(*map(cell, _row(leg)), style="red" if leg.breaks else None)
    console().print(table)
    echo(
        f"{counted(len(checked.legs), 'leg')}, {checked.length_m:.1f} m, about {checked.duration_s:.0f} s"
        f"{' for each round' if checked.course.is_endless else ''}; {items_text(checked)}"
    )
    for way in checked.home_ways:
        echo(
            f"{way}: {way.length_m:.1f} m from its end, about {way.time_s:.0f} s, {_metres(way.driven_clearance_m)} from any fence while driving"
        )
    for path in plots:
        if str(path) != "-":
            echo(f"Wrote {path}")


def _row(leg: CheckedLeg) -> tuple[str, ...]:
    return (
        leg.name,
        f"{leg.length_m:.1f} m",
        f"{leg.time_s:.0f} s",
        "crosses" if leg.crosses else _metres(leg.drawn_clearance_m),
        "crosses" if leg.crosses else _metres(leg.driven_clearance_m),
        ", ".join(map(_short, leg.crosses)) or _short(leg.fence or "none"),
        str(leg.at or ""),
    )


def _short(fence: str) -> str:
    """Return a zone's name so that the table fits 80 columns."""
    return fence.replace("exclusion", "excl.").replace("inclusion", "incl.")


def _metres(value_m: float) -> str:
    return "far" if value_m == float("inf") else f"{value_m:.2f} m"
