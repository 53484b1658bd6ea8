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
from mavlink_bridge.cli.home_parts import ways_document, with_parts
from mavlink_bridge.cli.mission_source import check_source, mission_situation, start_of
from mavlink_bridge.cli.pictures import check_plots, draw
from mavlink_bridge.cli.plan_results import hold_document
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.values import given_places
from mavlink_bridge.cli.vehicle_options import with_vehicle
from mavlink_bridge.cli.way_home import RouteWays
from missions.checking.check import check_mission, plan_of
from missions.picture.plans import plan_scene
from missions.request import GoTo
from missions.vehicle.item_limit import most_own_items
from missions.words import counted, metres, mission_items

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.check import CheckOptions
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.picture.scene import PictureScene
    from missions.planned import Plan
    from missions.situation import Situation


def check(options: CheckOptions) -> None:
    """Check each leg, and report, draw or print as JSON what was found."""
    check_source(options)
    check_plots(options.plot, json_output=options.json_output)
    places = given_places(options.place)
    request = with_vehicle(GoTo(clearance_m=options.clearance, trusts_model=options.trust_model), options)
    situation, unknown = mission_situation(options)
    assert situation.mission is not None
    request = replace(request, start=start_of(options, situation))
    checked = check_mission(situation.mission.value, situation, request)
    planned = plan_of(checked, situation)
    ways = RouteWays.of(planned, situation, places)
    warnings = [
        *situation.remarks,
        *unknown,
        *checked.warnings,
        *(ways.warnings if ways is not None else ()),
        *_storage_warnings(checked, situation),
    ]
    inform(checked.info)
    warn(warnings)
    draw(partial(_scene, checked, planned, ways), options.plot)
    if options.json_output:
        document = _document(checked, warnings, situation.system, options.plot)
        home = ways.document() if ways is not None else None
        inside = ways_document(checked.home_ways)
        print_json({**document, "ways_home": home, "way_home_inside": inside})
    else:
        _report(checked, options.plot, is_quiet=options.quiet > 0)
    if not checked.is_promised:
        raise typer.Exit(ExitCode.CHECK)


def _storage_warnings(checked: MissionCheck, situation: Situation) -> list[str]:
    """Warn of a mission that the vehicle cannot hold."""
    home, most = checked.vehicle.home_items, most_own_items(situation)
    by_board = "" if home else " (or 1000, by its board: no parameter says which)"
    told = f"{_items(checked)}; the vehicle holds {most + home}{by_board}"
    return [told] if len(checked.mission.items) > most else []


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
    scene = with_parts(plan_scene(planned, title=title, unsafe=unsafe), planned.items)
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
    for way in checked.home_ways:
        if way.trouble:
            echo(f"FAIL: {way}: {way.trouble}", typer.colors.RED)
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
    every = "every leg and way home" if checked.home_ways else "every leg"
    echo(f"PASS: {every} keeps {kept}{trusted}")


def _items(checked: MissionCheck) -> str:
    home = checked.vehicle.home_items
    return mission_items(len(checked.mission.items) + home, has_home=bool(home))


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
        f"{' for each round' if checked.course.is_endless else ''}; {_items(checked)}"
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
        "mission_items": len(checked.mission.items) + checked.vehicle.home_items,
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
