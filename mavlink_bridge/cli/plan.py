"""``pbpp plan``: plan a mission from a fence file, a log or a live vehicle; write it, draw it, upload it."""

from __future__ import annotations

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
    is_same_file,
    print_json,
    warn,
)
from mavlink_bridge.cli.field_files import (
    IgnorePointsOption,
    MapOptions,
    OutermostOption,
    RoleOption,
    read_fence_file,
    read_vehicle_file,
    with_mission_home,
)
from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.cli.plan_request import ENDS, METHODS, ORDERS, request_from_options, with_tour
from mavlink_bridge.cli.plan_results import Told, arrival_document, report_end
from mavlink_bridge.cli.timed_plan import timed_plan
from mavlink_bridge.cli.upload import SigningKeyOption
from mavlink_bridge.cli.values import MOST_M, within
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
from mavlink_bridge.errors import LogError, UsageError
from missions.request import RepairMission

if TYPE_CHECKING:
    from missions.situation import Situation

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
            help="Parameters that the source does not have.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None,
    snap: Annotated[
        float,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="Move a blocked target to free ground within M metres.",
        ),
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
            metavar="|".join(ORDERS), help="best: the targets in the shortest order.", rich_help_panel=_TOURS
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
            metavar="|".join(ENDS),
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
    role: RoleOption = None,
    outermost: OutermostOption = None,
    ignore_points: IgnorePointsOption = False,
    method: Annotated[str, typer.Option(metavar="|".join(METHODS), help="How to search.")] = "optimal",
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
    hold: Annotated[
        bool,
        typer.Option(
            "--hold", help="With --upload: a vehicle that drives in AUTO is switched to HOLD first."
        ),
    ] = False,
    drive: Annotated[
        bool,
        typer.Option(
            "--drive", help="With --upload: then switch to AUTO, after arrival to HOLD; arms nothing."
        ),
    ] = False,
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
    check_permissions(upload=upload, drive=drive, hold=hold)
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
    maps = MapOptions(role, outermost, ignore_points)
    request = with_tour(request, order, end, via_mission, maps, comes_back=come_back)
    _check_options(fence, log, connect, upload=upload, outputs=outputs, plots=plots)
    if home is not None and connect is not None:
        raise UsageError("--home goes with --fence and --log: a live vehicle tells its own home")
    if json_output and Path("-") in plots:
        raise UsageError("--plot - and --json both want the standard output; give a file to --plot")
    told = Told(outputs, plots, blocks=blocks, is_silent=json_output or quiet)
    if connect is not None:
        from mavlink_bridge.cli.live import plan_live  # noqa: PLC0415 - only with a link
        from mavlink_bridge.director import Orders  # noqa: PLC0415

        orders = Orders(
            identity=(source_system, source_component),
            system=system,
            any_vehicle=any_vehicle,
            request=request,
            upload=upload,
            drive=drive,
            hold=hold,
            patience_s=timeout,
        )
        if request.repairs:  # it goes where the mission goes, whatever is clicked meanwhile
            orders = replace(orders, target_sources=frozenset())
        result = plan_live(
            connect,
            orders,
            vehicle_file=vehicle,
            key_file=signing_key,
            quiet=quiet or json_output,
            on_plan=told.tell,
        )
        situation, verified, arrival = result.situation, result.verified, result.arrival
        backup = result.backup
    else:
        from mavlink_bridge.mavlink.vehicles import not_ardupilot  # noqa: PLC0415 - only where needed

        situation = _offline_situation(fence, log, system, maps, any_vehicle=any_vehicle)
        if isinstance(request, RepairMission) and request.mission is not None and log is None:
            situation = with_mission_home(situation, request.mission, str(via_mission))
        situation = with_home_option(with_parameter_file(situation, vehicle), home)
        if request.repairs and situation.ardupilot is False:
            raise LogError(f"{log}: {not_ardupilot(situation.system, None)}", file=str(log))
        told.tell(*timed_plan(situation, request), situation)
        verified, arrival, backup = False, None, None
    document = {
        **told.document(),
        "source": Path(str(fence or log)).name if connect is None else connect,
        "system": situation.system,
        "uploaded": verified,
        "verified": verified,
        "backup": str(backup) if backup else None,
        **arrival_document(arrival),
    }
    if json_output:
        print_json(document)
    elif not quiet:
        report_end(arrival, backup, verified=verified)


def with_parameter_file(situation: Situation, vehicle: Path | None) -> Situation:
    """Add the parameters of a file to those that the vehicle itself reported."""
    if vehicle is None:
        return situation
    return replace(situation, parameters={**read_vehicle_file(vehicle), **situation.parameters})


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
        raise UsageError("--upload needs a live link: --connect CONNECTION")
    for path in outputs:
        check_writable_format(path)
        if path.suffix.lower() != ".plan" and fence is not None and is_same_file(path, fence):
            raise UsageError(f"-o {path} would overwrite the fence with a mission")
    for path in (*outputs, *plots):
        if not path.parent.is_dir():
            raise MissionFormatError(
                f"{path} cannot be written: there is no folder {path.parent}",
                advice=f"make {path.parent} first, or choose another place",
            )
    if plots:
        from missions.picture import check_picture_format  # noqa: PLC0415 - quick help

        for path in plots:
            check_picture_format(path)


def _offline_situation(
    fence: Path | None, log: Path | None, system: int | None, maps: MapOptions, *, any_vehicle: bool
) -> Situation:
    if log is not None:
        from mavlink_bridge.logbook.log_situation import situation_from_log  # noqa: PLC0415 - pymavlink only where needed

        return situation_from_log(
            log, system, any_vehicle=any_vehicle, on_damage=lambda damage: warn([f"{log}: {damage}"])
        )
    assert fence is not None
    return read_fence_file(fence, maps)
