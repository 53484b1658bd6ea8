"""``pbpp check``: every leg of a mission against a fence, from files, a log or a live vehicle."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table

from mavlink_bridge.cli.common import inform, remarks_document, warn
from mavlink_bridge.cli.drawing import cell, console
from mavlink_bridge.cli.failing import ExitCode
from mavlink_bridge.cli.field_files import read_fence_file, read_file, with_mission_home
from mavlink_bridge.cli.pictures import check_plots, draw
from mavlink_bridge.cli.plan_results import hold_document
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.values import given_places, position_from
from mavlink_bridge.cli.vehicle_options import (
    described_vehicle,
    with_description,
    with_home_option,
    with_vehicle,
)
from mavlink_bridge.cli.way_home import RouteWays
from mavlink_bridge.errors import UsageError
from missions.checking.check import check_mission, plan_of
from missions.formats import mission_of
from missions.picture.plans import plan_scene
from missions.request import GoTo
from missions.situation import Situation
from missions.vehicle.item_limit import most_items
from missions.words import counted, metres, mission_items

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.cli.options.check import CheckOptions
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.items import MissionItem
    from missions.picture.scene import PictureScene
    from missions.planned import Plan


def check(options: CheckOptions) -> None:
    """Check each leg, and report, draw or print as JSON what was found."""
    _check_options(options)
    places = given_places(options.place)
    request = with_vehicle(GoTo(clearance_m=options.clearance, trusts_model=options.trust_model), options)
    begin = position_from("--start", options.start) if options.start is not None else None
    situation, unknown = _situation(options)
    if situation.mission is None:
        raise UsageError(f"{options.log or options.connect} contains no mission; give one (--mission FILE)")
    if begin is None and options.log is not None and situation.home is not None:
        begin = situation.home.value  # at a log's end the vehicle may stand anywhere on its way
    checked = check_mission(situation.mission.value, situation, replace(request, start=begin))
    planned = plan_of(checked, situation)
    ways = RouteWays.of(planned, situation, places)
    warnings = [
        *situation.remarks,
        *unknown,
        *checked.warnings,
        *(ways.warnings if ways is not None else ()),
        *_storage_warnings(checked.mission.items, situation),
    ]
    inform(checked.info)
    warn(warnings)
    draw(partial(_scene, checked, planned, ways), options.plot)
    if options.json_output:
        document = _document(checked, warnings, situation.system, options.plot)
        print_json({**document, "ways_home": ways.document() if ways is not None else None})
    else:
        _report(checked, options.plot, is_quiet=options.quiet > 0)
    if not checked.is_promised:
        raise typer.Exit(ExitCode.CHECK)


def _situation(options: CheckOptions) -> tuple[Situation, list[str]]:
    """Return what is known from files, a log or a link, and what the vehicle did not report."""
    situation: Situation | None = None
    unknown: list[str] = []
    if options.log is not None:
        from mavlink_bridge.cli.log_source import situation_of  # noqa: PLC0415 - pymavlink only for logs

        situation = situation_of(options.log, options, drives_its_items=True)
    elif options.connect is not None:
        from mavlink_bridge.cli.check_on_link import live_situation  # noqa: PLC0415 - and for links

        situation, unknown = live_situation(options)
    situation = _with_files(situation, options)
    situation = with_description(situation, described_vehicle(options))
    return with_home_option(situation, options.home), unknown


def _check_options(options: CheckOptions) -> None:
    """Find what cannot work before any work is done."""
    if options.mission is None and options.log is None and options.connect is None:
        raise UsageError("give a mission: --mission FILE, --log FILE.tlog or --connect CONNECTION")
    if options.log is not None and options.connect is not None:
        raise UsageError("give one of --log and --connect")
    if options.home is not None and options.connect is not None:
        raise UsageError("--home goes with files and logs: a live vehicle reports its own home")
    check_plots(options.plot, json_output=options.json_output)


def _storage_warnings(items: Sequence[MissionItem], situation: Situation) -> list[str]:
    """Warn of a mission (its items without home) that the vehicle cannot hold."""
    most = most_items(situation.parameters)
    count = len(items) + 1
    return [f"{mission_items(count)}; the vehicle holds {most}"] if count > most else []


def _with_files(source: Situation | None, options: CheckOptions) -> Situation:
    """Put what files hold in the place of what the log or the link reported."""
    found = source or Situation()
    if options.fence is not None:
        told = read_fence_file(options.fence, options)
        found = replace(
            found,
            fence=told.fence,
            home=found.home or told.home,
            reading=replace(found.reading, fence_trouble=None, transfers={}, remarks=told.remarks),
        )
    if options.mission is not None:
        told = read_file(options.mission, options, by_name=options.fence is None)
        drawn = mission_of(told, options.mission)
        found = replace(
            found,
            mission=told.mission,
            fence=told.fence if options.fence is None and told.fence else found.fence,
            rally=found.rally or told.rally,
            reading=replace(found.reading, remarks=(*found.remarks, *told.remarks)),
        )
        if source is None:
            found = with_mission_home(found, drawn, str(options.mission))
    return found


def _scene(checked: MissionCheck, planned: Plan, ways: RouteWays | None) -> PictureScene:
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
    scene = plan_scene(planned, title=title, unsafe=unsafe)
    return ways.drawn(scene) if ways is not None else scene


def _report(checked: MissionCheck, plots: list[Path], *, is_quiet: bool) -> None:
    if not is_quiet:
        _report_legs(checked, plots)
    for trouble in checked.troubles:
        echo(f"not understood: {trouble}", typer.colors.RED)
    for danger in checked.dangers:
        echo(f"DANGER: {danger}", typer.colors.RED)
    for leg in checked.broken:
        echo(f"FAIL: {_sentence(leg)}", typer.colors.RED)
    kept = f"{checked.clearance_m:g} m while driving"
    if checked.holds and not checked.is_promised:
        echo(
            f"NOT CONFIRMED: every leg is predicted to keep {kept}, but the drive is extrapolated beyond what was measured "
            "(--trust-model takes the prediction)",
            typer.colors.RED,
        )
    if not checked.is_promised or is_quiet:
        return
    trusted = "; the drive model is trusted beyond what was measured" if checked.extrapolated else ""
    echo(f"PASS: every leg keeps {kept}{trusted}")


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
        f"{' for each round' if checked.course.is_endless else ''}; {mission_items(len(checked.mission.items) + 1)}"
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


def _sentence(leg: CheckedLeg) -> str:
    if leg.stops_at_seam:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}: the vehicle stops at {leg.at}"
    if leg.crosses:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}, first at {leg.at}"
    return (
        f"leg {leg.name} comes within {leg.driven_clearance_m:.2f} m of {leg.fence} while driving "
        f"({metres(leg.drawn_clearance_m)} along the straight leg, at {leg.at}); {metres(leg.asked_m)} is required"
    )


def _document(
    checked: MissionCheck, warnings: list[str], system: int | None, plots: list[Path]
) -> dict[str, object]:
    return {
        "status": "ok" if checked.is_promised else "failed",
        "command": "check",
        "exit_code": int(ExitCode.DONE if checked.is_promised else ExitCode.CHECK),
        "system": system,
        "clearance_m": checked.clearance_m,
        "length_m": round(checked.length_m, 3),
        "duration_s": round(checked.duration_s, 1),
        "drawn_clearance_m": _finite(checked.drawn_clearance_m),
        "driven_clearance_m": _finite(checked.driven_clearance_m),
        "mission_items": len(checked.mission.items) + 1,
        "endless": checked.course.is_endless,
        "broken": len(checked.broken),
        "stopping": hold_document(checked.hold),
        "legs": [_leg_document(leg) for leg in checked.legs],
        "not_understood": list(checked.troubles),
        "dangers": list(checked.dangers),
        "extrapolated": list(checked.extrapolated),
        "outputs": [str(path) for path in plots],
        **remarks_document(checked.info, warnings),
    }


def _leg_document(leg: CheckedLeg) -> dict[str, object]:
    course = leg.leg
    return {
        "from_item": course.first_item,
        "to_item": course.last_item,
        "jump_item": course.jump_item,
        "rtl": course.is_return,
        "start": list(course.start),
        "end": list(course.end),
        "length_m": round(leg.length_m, 3),
        "time_s": round(leg.time_s, 1),
        "speed_mps": course.speed_mps,
        "stop_s": course.stop_s,
        "drawn_clearance_m": _finite(leg.drawn_clearance_m),
        "driven_clearance_m": _finite(leg.driven_clearance_m),
        "asked_m": round(leg.asked_m, 4),
        "fence": leg.fence,
        "at": list(leg.at) if leg.at else None,
        "crosses": list(leg.crosses),
        "breaks": leg.breaks,
    }


def _finite(value_m: float) -> float | None:
    return None if value_m == float("inf") else round(value_m, 4)
