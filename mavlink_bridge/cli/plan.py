"""``pbpp plan``: plan a mission from a fence file, a log or a live vehicle; write it, draw it, upload it."""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import (
    OUTPUT_PANEL,
    AnyVehicleOption,
    ConnectOption,
    JsonOption,
    QuietOption,
    SourceComponentOption,
    SourceSystemOption,
    SystemOption,
    TimeoutOption,
    print_json,
    warn,
)
from mavlink_bridge.cli.upload import SigningKeyOption
from mavlink_bridge.cli.vehicle_options import PANEL as VEHICLE_PANEL
from mavlink_bridge.cli.vehicle_options import (
    EscapeOption,
    GpsOption,
    HomeOption,
    LengthOption,
    PositionErrorOption,
    ReserveOption,
    SpeedOption,
    WidthOption,
    with_home_option,
    with_vehicle,
)
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from missions.plan import Plan
    from missions.request import Request
    from missions.situation import Situation

_METHODS = ("optimal", "pbpp-taut", "pbpp")
_ORDERS = ("given", "best")
_ENDS = ("hold", "loiter", "rtl")
_OWN = "own"
_TOURS = "Several targets, and missions to repair"


def plan(
    fence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Fence file: .waypoints, .plan, …")
    ] = None,
    log: Annotated[Path | None, typer.Option(metavar="FILE.tlog", help="Recorded telemetry log.")] = None,
    connect: ConnectOption = None,
    start: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Default: the vehicle's position; for a file its home."),
    ] = None,
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAT,LON", help="Several are visited in order. Default: the newest in the stream."
        ),
    ] = None,
    clearance: Annotated[
        str | None,
        typer.Option(
            metavar="M|max", help="Promised while driving; max: the widest route. Default: from FENCE_MARGIN."
        ),
    ] = None,
    corner_allowance: Annotated[
        str, typer.Option(metavar="M|auto", help="Room for cut corners on top; 0 plans the drawn lines only.")
    ] = "auto",
    home: HomeOption = None,
    vehicle: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parm",
            help="Parameters that the source does not tell.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None,
    snap: Annotated[
        float,
        typer.Option(metavar="M", min=0.0, help="Move a blocked target to free ground within M metres."),
    ] = 0.0,
    speed: SpeedOption = None,
    reserve: ReserveOption = 0.0,
    position_error: PositionErrorOption = None,
    length: LengthOption = 0.0,
    width: WidthOption = 0.0,
    gps: GpsOption = "0,0",
    escape: EscapeOption = False,
    order: Annotated[
        str,
        typer.Option(
            metavar="|".join(_ORDERS), help="best: the targets in the shortest order.", rich_help_panel=_TOURS
        ),
    ] = "given",
    come_back: Annotated[
        bool,
        typer.Option(
            "--return",
            help="Come home after the last target (home not known: to the start).",
            rich_help_panel=_TOURS,
        ),
    ] = False,
    end: Annotated[
        str,
        typer.Option(
            metavar="|".join(_ENDS),
            help="At the end; rtl only where its straight line is free.",
            rich_help_panel=_TOURS,
        ),
    ] = "hold",
    via_mission: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|own",
            help="Repair this mission: replace the legs that break the clearance; own: the one in the SOURCE.",
            rich_help_panel=_TOURS,
        ),
    ] = None,
    method: Annotated[str, typer.Option(metavar="|".join(_METHODS), help="How to search.")] = "optimal",
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the mission: .waypoints, .plan, .geojson, .kml, .gpx.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = None,
    plot: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Draw the plan: .png, .svg, .pdf, .html; - in the terminal.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = None,
    blocks: Annotated[
        bool,
        typer.Option("--blocks", help="Draw the blocks of the free space too.", rich_help_panel=OUTPUT_PANEL),
    ] = False,
    upload: Annotated[bool, typer.Option("--upload", help="Upload to the vehicle and verify.")] = False,
    drive: Annotated[bool, typer.Option("--drive", help="Then switch to AUTO; arms nothing.")] = False,
    system: SystemOption = None,
    any_vehicle: AnyVehicleOption = False,
    source_system: SourceSystemOption = 245,
    source_component: SourceComponentOption = 190,
    signing_key: SigningKeyOption = None,
    timeout: TimeoutOption = 30.0,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Plan a mission around the fences of a SOURCE: `--fence FILE`, `--log FILE.tlog` or `--connect CONNECTION`.

    For example:

    `pbpp plan --log field.tlog -o mission.waypoints --plot mission.png`

    `pbpp plan --fence field.plan --start 40.0713,-105.2299 --target 40.0726,-105.2290 -o mission.plan`

    `pbpp plan --connect udpin:0.0.0.0:14550 --target 40.0726,-105.2290 --upload`
    """
    outputs, plots = output or [], plot or []
    request = request_from_options(start, target or [], clearance, corner_allowance, snap, method)
    request = with_vehicle(
        request,
        speed=speed,
        reserve=reserve,
        position_error=position_error,
        size=(length, width, gps),
        escape=escape,
    )
    request = _with_tour(request, order, end, via_mission, comes_back=come_back)
    _check_options(fence, log, connect, upload=upload or drive, outputs=outputs, plots=plots)
    if home is not None and connect is not None:
        raise UsageError("--home goes with --fence and --log: a live vehicle tells its own home")
    if json_output and Path("-") in plots:
        raise UsageError("--plot - and --json both want the standard output; give a file to --plot")
    if connect is not None:
        from mavlink_bridge.cli.live import plan_live  # noqa: PLC0415 - only with a link
        from mavlink_bridge.director import Orders  # noqa: PLC0415

        orders = Orders(
            identity=(source_system, source_component),
            system=system,
            any_vehicle=any_vehicle,
            request=request,
            upload=upload or drive,
            drive=drive,
            patience_s=timeout,
        )
        if request.repairs:  # it goes where the mission goes, whatever is clicked meanwhile
            orders = replace(orders, target_sources=frozenset())
        result = plan_live(
            connect, orders, vehicle_file=vehicle, key_file=signing_key, quiet=quiet or json_output
        )
        planned, planning_s, situation = result.plan, result.planning_s, result.situation
        uploaded = verified = result.verified
    else:
        situation = _offline_situation(fence, log, system, any_vehicle=any_vehicle)
        situation = with_home_option(with_parameter_file(situation, vehicle), home)
        planned, planning_s = timed_plan(situation, request)
        uploaded = verified = False
    warnings = list(planned.warnings)
    warn(warnings)
    written = write_outputs(planned, situation, outputs, plots, blocks=blocks)
    document = {
        **plan_document(planned),
        "source": Path(str(fence or log)).name if connect is None else connect,
        "system": situation.system,
        "planning_s": round(planning_s, 6),
        "outputs": [str(path) for path in written],
        "warnings": warnings,
        "uploaded": uploaded,
        "verified": verified,
    }
    if json_output:
        print_json(document)
    elif not quiet:
        _report(planned, written, verified=verified)


def timed_plan(situation: Situation, request: Request) -> tuple[Plan, float]:
    """Plan, and tell how long it took."""
    from missions.tour import plan_tour  # noqa: PLC0415 - quick help

    begun_s = time.perf_counter()
    planned = plan_tour(situation, request)
    return planned, time.perf_counter() - begun_s


def with_parameter_file(situation: Situation, vehicle: Path | None) -> Situation:
    """Add the parameters of a file to those that the vehicle itself told."""
    if vehicle is None:
        return situation
    from missions.formats import read_parameters  # noqa: PLC0415 - quick help

    return replace(situation, parameters={**read_parameters(vehicle), **situation.parameters})


def write_outputs(
    planned: Plan, situation: Situation, outputs: list[Path], plots: list[Path], *, blocks: bool = False
) -> list[Path]:
    """Write the mission and draw the plan; give the files."""
    from missions.formats import write_mission  # noqa: PLC0415 - quick help
    from missions.situation import Known, Mission  # noqa: PLC0415

    mission = Mission(planned.items, planned.home or planned.start)
    to_write = replace(
        situation, mission=Known(mission, None, "pbpp plan"), fence=Known(planned.fence, None, "pbpp plan")
    )
    for path in outputs:
        write_mission(to_write, path)
    return [*outputs, *draw(planned, plots, blocks=blocks)]


def draw(planned: Plan, plots: list[Path], *, title: str | None = None, blocks: bool = False) -> list[Path]:
    """Draw the plan to files, and to the terminal where ``-`` is among them; give the files."""
    if not plots:
        return []
    from missions.picture import TERMINAL, draw_plan, sketch_plan  # noqa: PLC0415 - quick help

    for path in plots:
        if str(path) == TERMINAL:
            columns = min(80, shutil.get_terminal_size().columns)
            typer.echo(sketch_plan(planned, columns=columns, encoding=sys.stdout.encoding), nl=False)
        else:
            draw_plan(planned, path, title=title, blocks=blocks)
    return [path for path in plots if str(path) != TERMINAL]


def plan_document(planned: Plan) -> dict[str, object]:
    """Give what the JSON document tells of a plan."""
    from missions.fence import CircleZone, PolygonZone, ZoneKind  # noqa: PLC0415 - quick help

    fence = planned.fence
    return {
        "status": "ok",
        "command": "plan",
        "method": planned.method,
        "start": list(planned.start),
        "targets": [list(target) for target in planned.targets],
        "path": [list(position) for position in planned.path],
        "length_m": round(planned.length_m, 3),
        "straight_line_m": round(planned.straight_line_m, 3),
        "duration_s": round(planned.duration_s, 1),
        "clearance_m": planned.clearance_m,
        "drawn_clearance_m": _finite(planned.drawn_clearance_m),
        "driven_clearance_m": _finite(planned.driven_clearance_m),
        "fence": {
            "inclusion_polygons": fence.count(ZoneKind.INCLUSION, PolygonZone),
            "exclusion_polygons": fence.count(ZoneKind.EXCLUSION, PolygonZone),
            "inclusion_circles": fence.count(ZoneKind.INCLUSION, CircleZone),
            "exclusion_circles": fence.count(ZoneKind.EXCLUSION, CircleZone),
            "vertices": fence.vertex_count,
            "union": planned.ground.union,
        },
        "blocks": planned.blocks,
        "mission_items": len(planned.items) + 1,
        "warnings": list(planned.warnings),
    }


def _finite(value_m: float | None) -> float | None:
    return None if value_m is None or value_m == float("inf") else round(value_m, 4)


def request_from_options(
    start: str | None, targets: list[str], clearance: str | None, allowance: str, snap: float, method: str
) -> Request:
    """Read what is asked of plans from a command's options.

    Raises
    ------
    UsageError, InvalidPositionError
        An option is not what it has to be.
    """
    from missions.geo import parse_lat_lon  # noqa: PLC0415 - quick help
    from missions.request import Request  # noqa: PLC0415

    if method not in _METHODS:
        raise UsageError(f"--method {method!r}: expected one of {', '.join(_METHODS)}")
    return Request(
        start=parse_lat_lon(start) if start is not None else None,
        targets=tuple(parse_lat_lon(target) for target in targets),
        clearance_m=None if clearance == "max" else _metres("--clearance", clearance, "max"),
        widest=clearance == "max",
        corner_allowance_m=None if allowance == "auto" else _metres("--corner-allowance", allowance, "auto"),
        snap_m=_metres("--snap", str(snap), "leave it out") or 0.0,
        method=method,
    )


def _with_tour(request: Request, order: str, end: str, via: str | None, *, comes_back: bool) -> Request:
    """Add order, way home, end or a mission to repair.

    Raises
    ------
    UsageError
        An option is not what it has to be, or does not go with another.
    """
    for option, value, known in (("--order", order, _ORDERS), ("--end", end, _ENDS)):
        if value not in known:
            raise UsageError(f"{option} {value!r}: expected one of {', '.join(known)}")
    if via is None:
        return replace(request, order=order, comes_back=comes_back, end=end)
    if request.targets or comes_back or (order, end) != ("given", "hold"):
        raise UsageError(
            "--via-mission keeps the mission's own places, order and end; it does not go with --target, --order, --return, --end"
        )
    if request.widest:
        raise UsageError("--via-mission needs a clearance in metres, not max")
    if request.speed_mps is not None or request.corner_allowance_m is not None or request.escape:
        raise UsageError(
            "--via-mission keeps the mission's own speeds and goes by the drive model; it does not go with --speed, "
            "--corner-allowance, --escape"
        )
    if via == _OWN:
        return replace(request, via_own=True)
    from missions.formats import read_mission  # noqa: PLC0415 - quick help

    return replace(request, via=read_mission(Path(via)))


def _metres(option: str, text: str | None, word: str) -> float | None:
    """Read an option that is metres, 0 or more, or one word."""
    if text is None:
        return None
    try:
        value_m = float(text)
    except ValueError:
        value_m = -1.0
    if not 0 <= value_m < float("inf"):
        raise UsageError(f"{option} {text!r}: expected metres (0 or more) or {word}")
    return value_m


def _check_options(
    fence: Path | None,
    log: Path | None,
    connect: str | None,
    *,
    upload: bool,
    outputs: list[Path],
    plots: list[Path],
) -> None:
    """Find what cannot work before any work is done."""
    from missions.errors import MissionFormatError  # noqa: PLC0415 - quick help
    from missions.formats import check_writable_format  # noqa: PLC0415

    if [fence, log, connect].count(None) != 2:
        raise UsageError("give one SOURCE: --fence FILE, --log FILE.tlog or --connect CONNECTION")
    if upload and connect is None:
        raise UsageError("--upload and --drive need a live link: --connect CONNECTION")
    for path in outputs:
        check_writable_format(path)
        if path.suffix != ".plan" and fence is not None and path.resolve() == fence.resolve():
            raise UsageError(f"-o {path} would overwrite the fence with a mission")
    for path in (*outputs, *plots):
        if not path.parent.is_dir():
            raise MissionFormatError(f"{path} cannot be written: there is no folder {path.parent}")
    if plots:
        from missions.picture import check_picture_format  # noqa: PLC0415 - quick help

        for path in plots:
            check_picture_format(path)


def _offline_situation(
    fence: Path | None, log: Path | None, system: int | None, *, any_vehicle: bool
) -> Situation:
    if log is not None:
        from mavlink_bridge.recorded import situation_from_log  # noqa: PLC0415 - pymavlink only where needed

        return situation_from_log(
            log, system, any_vehicle=any_vehicle, on_damage=lambda damage: warn([f"{log}: {damage}"])
        )
    from missions.errors import FenceMissingError  # noqa: PLC0415 - quick help
    from missions.formats import read_situation  # noqa: PLC0415

    assert fence is not None
    situation = read_situation(fence)
    if situation.fence is None:
        raise FenceMissingError(f"{fence} holds no fence", file=str(fence))
    return situation


def _report(planned: Plan, written: list[Path], *, verified: bool) -> None:
    promise = (
        f"{planned.clearance_m:g} m promised while driving"
        if planned.clearance_m is not None
        else "nothing promised for the driven track"
    )
    waypoints = sum(item.is_placed for item in planned.items)
    turns = max(0, waypoints - len(planned.targets))
    typer.echo(
        f"Route: {planned.length_m:.1f} m ({planned.straight_line_m:.1f} m as the crow flies), "
        f"about {planned.duration_s:.0f} s, {waypoints} waypoints ({turns} turns)"
    )
    typer.echo(f"Clearance: {planned.drawn_clearance_m:.2f} m drawn, {promise}")
    for path in written:
        typer.echo(f"Wrote {path}")
    if verified:
        typer.echo("Uploaded and verified")
