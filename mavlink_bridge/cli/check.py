"""``pbpp check``: every leg of a mission against a fence, from files, a log or a live vehicle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import (
    OUTPUT_PANEL,
    AnyVehicleOption,
    ConnectOption,
    ExitCode,
    JsonOption,
    QuietOption,
    SourceComponentOption,
    SourceSystemOption,
    SystemOption,
    TimeoutOption,
    print_json,
    progress_bar,
    warn,
)
from mavlink_bridge.cli.field_files import (
    IgnorePointsOption,
    MapOptions,
    OutermostOption,
    RoleOption,
    read_fence_file,
    read_file,
    read_vehicle_file,
    with_mission_home,
)
from mavlink_bridge.cli.terminal import cell, console, echo
from mavlink_bridge.cli.upload import SigningKeyOption
from mavlink_bridge.cli.values import MOST_M, position_from, within
from mavlink_bridge.cli.vehicle_options import PANEL as VEHICLE_PANEL
from mavlink_bridge.cli.vehicle_options import (
    GpsOption,
    HomeOption,
    LengthOption,
    PositionErrorOption,
    ReserveOption,
    WidthOption,
    with_home_option,
    with_vehicle,
)
from mavlink_bridge.errors import LogError, UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.cli.session import Contact
    from mavlink_bridge.mavlink.messages import Frame
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.items import MissionItem
    from missions.situation import Situation

_TELEMETRY_PATIENCE_S = 5.0
"""A vehicle that reports its position does so at least once a second."""


def check(
    mission: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mission file: .plan, .waypoints, …")
    ] = None,
    fence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Fence file; not needed where --mission holds one.")
    ] = None,
    log: Annotated[
        Path | None, typer.Option(metavar="FILE.tlog", help="Recorded log, for what no file is given for.")
    ] = None,
    connect: ConnectOption = None,
    start: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Default: the vehicle's position; of files and logs home."),
    ] = None,
    home: HomeOption = None,
    vehicle: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parm",
            help="Parameters that the log or link does not have.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="To be kept by each leg while driving. Default: from FENCE_MARGIN.",
        ),
    ] = None,
    plot: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Draw it: .png, .svg, .pdf, .html; - in the terminal.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = None,
    role: RoleOption = None,
    outermost: OutermostOption = None,
    ignore_points: IgnorePointsOption = False,
    reserve: ReserveOption = 0.0,
    position_error: PositionErrorOption = None,
    length: LengthOption = 0.0,
    width: WidthOption = 0.0,
    gps: GpsOption = "0,0",
    system: SystemOption = None,
    any_vehicle: AnyVehicleOption = False,
    source_system: SourceSystemOption = 245,
    source_component: SourceComponentOption = 190,
    signing_key: SigningKeyOption = None,
    timeout: TimeoutOption = 30.0,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Check every leg of a mission, whoever wrote it: what it keeps to the fence drawn and driven. Exit 8 if one breaks the promise.

    For example:

    `pbpp check --mission mission.waypoints --fence fence.waypoints --clearance 2`

    `pbpp check --mission field.plan --vehicle rover.parm --plot check.png`

    `pbpp check --log field.tlog`
    """
    plots = plot or []
    _check_options(mission, log, connect, home, plots)
    if json_output and Path("-") in plots:
        raise UsageError("--plot - and --json both want the standard output; give a file to --plot")
    from missions.checking.check import check_mission  # noqa: PLC0415
    from missions.request import GoTo  # noqa: PLC0415

    request = with_vehicle(
        GoTo(clearance_m=clearance),
        reserve=reserve,
        position_error=position_error,
        size=(length, width, gps),
    )
    begin = position_from("--start", start) if start is not None else None
    situation: Situation | None = None
    unknown: list[str] = []
    if log is not None:
        from mavlink_bridge.logbook.log_situation import situation_from_log  # noqa: PLC0415 - pymavlink only where needed
        from mavlink_bridge.mavlink.vehicles import not_ardupilot  # noqa: PLC0415

        situation = situation_from_log(log, system, any_vehicle=any_vehicle)
        if situation.ardupilot is False:  # how another autopilot drives its items was not measured
            raise LogError(f"{log}: {not_ardupilot(situation.system, None)}", file=str(log))
    elif connect is not None:
        from mavlink_bridge.cli.session import Contact  # noqa: PLC0415 - only with a link

        contact = Contact(
            connect, (source_system, source_component), system, any_vehicle, timeout, signing_key
        )
        situation, unknown = _live_situation(contact, quiet=quiet or json_output)
    maps = MapOptions(role, outermost, ignore_points)
    situation = with_home_option(_with_files(situation, mission, fence, vehicle, maps), home)
    if situation.mission is None:
        raise UsageError(f"{log or connect} tells of no mission; give one (--mission FILE)")
    if begin is None and log is not None and situation.home is not None:
        begin = situation.home.value  # at a log's end the vehicle may stand anywhere on its way
    checked = check_mission(situation.mission.value, situation, replace(request, start=begin))
    warnings = [
        *situation.remarks,
        *unknown,
        *checked.warnings,
        *_storage_warnings(checked.mission.items, situation),
    ]
    warn(warnings)
    _draw(checked, situation, plots)
    if json_output:
        print_json(_document(checked, warnings, situation.system, plots))
    elif not quiet:
        _report(checked, plots)
    if not checked.holds:
        raise typer.Exit(ExitCode.CHECK)


def _check_options(
    mission: Path | None, log: Path | None, connect: str | None, home: str | None, plots: list[Path]
) -> None:
    """Find what cannot work before any work is done."""
    if mission is None and log is None and connect is None:
        raise UsageError("give a mission: --mission FILE, --log FILE.tlog or --connect CONNECTION")
    if log is not None and connect is not None:
        raise UsageError("give one of --log and --connect")
    if home is not None and connect is not None:
        raise UsageError("--home goes with files and logs: a live vehicle tells its own home")
    if plots:
        from missions.picture import check_picture_format  # noqa: PLC0415 - quick help

        for path in plots:
            check_picture_format(path)


def _storage_warnings(items: Sequence[MissionItem], situation: Situation) -> list[str]:
    """Warn of a mission (its items without home) that the vehicle cannot hold."""
    from missions.vehicle.item_limit import most_items  # noqa: PLC0415 - quick help

    most = most_items(situation.parameters)
    count = len(items) + 1
    return [f"{count} mission items with home; the vehicle holds {most}"] if count > most else []


def _with_files(
    source: Situation | None,
    mission: Path | None,
    fence: Path | None,
    vehicle: Path | None,
    maps: MapOptions,
) -> Situation:
    """Put what files hold in the place of what the log or the link reported; of parameters the vehicle's own count more."""
    from missions.formats import mission_of  # noqa: PLC0415 - quick help
    from missions.situation import Situation  # noqa: PLC0415

    found = source or Situation()
    if fence is not None:
        told = read_fence_file(fence, maps)
        found = replace(
            found,
            fence=told.fence,
            fence_trouble=None,
            transfers={},
            home=found.home or told.home,
            remarks=told.remarks,
        )
    if mission is not None:
        told = read_file(mission, maps if fence is None else maps.of_another_file())
        drawn = mission_of(told, mission)
        found = replace(
            found,
            mission=told.mission,
            fence=told.fence if fence is None and told.fence else found.fence,
            rally=found.rally or told.rally,
            remarks=(*found.remarks, *told.remarks),
        )
        if source is None:
            found = with_mission_home(found, drawn, str(mission))
    if vehicle is not None:
        found = replace(found, parameters={**read_vehicle_file(vehicle), **found.parameters})
    return found


def _live_situation(contact: Contact, *, quiet: bool) -> tuple[Situation, list[str]]:
    """Read mission, fence, rally points and parameters from the vehicle; nothing is written to it. Return also what it did not report.

    Raises
    ------
    BridgeError
        The vehicle is not there, or does not give them.
    """
    from mavlink_bridge.cli.session import open_session  # noqa: PLC0415 - only with a link
    from mavlink_bridge.director.learning import Learning  # noqa: PLC0415
    from mavlink_bridge.fold import fold  # noqa: PLC0415
    from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead  # noqa: PLC0415
    from missions.situation import ListKind, Situation  # noqa: PLC0415

    with progress_bar(quiet=quiet) as show, open_session(contact, show) as session:
        peer, link = session.vehicle, session.link
        heard = Situation(system=peer.system, component=peer.component)

        def listen(frames: list[Frame]) -> None:
            nonlocal heard
            for frame in frames:
                heard = fold(heard, frame, link.now_s())

        session.listeners.append(listen)
        learning = Learning(
            peer, _TELEMETRY_PATIENCE_S, tuple(ListKind), UndisturbedRead, needs_position=False
        )
        session.run(learning, "reading parameters, mission, fence and rally points")
        if learning.trouble is not None:
            raise learning.trouble
        found = learning.merged(heard, link.now_s())
    unknown = [
        f"the vehicle gives positions as 32-bit floats: the {kind} is known to about 1 m only"
        for kind in learning.coarse
    ]
    if found.pose is None:
        unknown.append("the vehicle did not tell its position: it is taken to stand at its home")
    has_fence = found.fence is not None and found.fence.value.zones
    return found if has_fence else replace(found, fence=None), unknown


def _draw(checked: MissionCheck, situation: Situation, plots: list[Path]) -> None:
    if not plots:
        return
    from mavlink_bridge.cli.plan_results import draw  # noqa: PLC0415 - quick help
    from missions.checking.check import plan_of  # noqa: PLC0415

    broken = len(checked.broken)
    title = (
        f"{checked.length_m:.1f} m, about {checked.duration_s:.0f} s: "
        + (f"{broken} of {len(checked.legs)} legs break" if broken else f"{len(checked.legs)} legs keep")
        + f" {checked.clearance_m:g} m"
    )
    draw(plan_of(checked, situation), plots, title=title)


def _report(checked: MissionCheck, plots: list[Path]) -> None:
    from rich.table import Table  # noqa: PLC0415 - quick help

    table = Table(box=None, pad_edge=False)
    for name in ("leg", "length", "time", "drawn", "driven", "nearest fence", "where"):
        right = name in {"length", "time", "drawn", "driven"}
        table.add_column(name, justify="right" if right else "left", no_wrap=name != "nearest fence")
    for leg in checked.legs:
        table.add_row(*map(cell, _row(leg)), style="red" if leg.breaks else None)
    console().print(table)
    echo(
        f"{len(checked.legs)} legs, {checked.length_m:.1f} m, about {checked.duration_s:.0f} s"
        f"{' for one time round' if checked.course.is_endless else ''}; {len(checked.mission.items) + 1} mission items with home"
    )
    for path in plots:
        if str(path) != "-":
            echo(f"Wrote {path}")
    for trouble in checked.troubles:
        echo(f"not understood: {trouble}", typer.colors.RED)
    for danger in checked.dangers:
        echo(f"DANGER: {danger}", typer.colors.RED)
    for leg in checked.broken:
        echo(f"BREAKS: {_sentence(leg)}", typer.colors.RED)
    if checked.holds:
        echo(f"Every leg keeps {checked.clearance_m:g} m while driving")


def _row(leg: CheckedLeg) -> tuple[str, ...]:
    return (
        leg.name,
        f"{leg.length_m:.1f} m",
        f"{leg.time_s:.0f} s",
        "crosses" if leg.crosses else _metres(leg.drawn_clearance_m),
        "crosses" if leg.crosses else _metres(leg.driven_clearance_m),
        ", ".join(leg.crosses) or leg.fence or "none",
        str(leg.at or ""),
    )


def _metres(value_m: float) -> str:
    return "far" if value_m == float("inf") else f"{value_m:.2f} m"


def _sentence(leg: CheckedLeg) -> str:
    from missions.words import metres  # noqa: PLC0415 - quick help

    if leg.stops_at_seam:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}: the vehicle stops at {leg.at}"
    if leg.crosses:
        return f"leg {leg.name} crosses {', '.join(leg.crosses)}, first at {leg.at}"
    return (
        f"leg {leg.name} comes within {leg.driven_clearance_m:.2f} m of {leg.fence} while driving "
        f"({metres(leg.drawn_clearance_m)} drawn, at {leg.at}); {metres(leg.asked_m)} is required"
    )


def _document(
    checked: MissionCheck, warnings: list[str], system: int | None, plots: list[Path]
) -> dict[str, object]:
    return {
        "status": "ok" if checked.holds else "failed",
        "command": "check",
        "exit_code": int(ExitCode.DONE if checked.holds else ExitCode.CHECK),
        "system": system,
        "clearance_m": checked.clearance_m,
        "length_m": round(checked.length_m, 3),
        "duration_s": round(checked.duration_s, 1),
        "drawn_clearance_m": _finite(checked.drawn_clearance_m),
        "driven_clearance_m": _finite(checked.driven_clearance_m),
        "mission_items": len(checked.mission.items) + 1,
        "endless": checked.course.is_endless,
        "broken": len(checked.broken),
        "legs": [_leg_document(leg) for leg in checked.legs],
        "not_understood": list(checked.troubles),
        "dangers": list(checked.dangers),
        "outputs": [str(path) for path in plots],
        "warnings": warnings,
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
