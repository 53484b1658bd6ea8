"""The options of ``pbpp plan``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    OUTPUT_PANEL,
    VEHICLE_PANEL,
    ConnectOption,
    FirmwareOption,
    GpsOption,
    HomeOption,
    IgnorePointsOption,
    LengthOption,
    LinkOptions,
    OutermostOption,
    PositionErrorOption,
    ReserveOption,
    RoleOption,
    StoppingOption,
    TrustOption,
    WidthOption,
)
from mavlink_bridge.cli.values import LEAST_MPS, MOST_M, MOST_MPS, within
from missions.request import End, Method, Order

METHODS, ORDERS, ENDS = tuple(Method), tuple(Order), tuple(End)
_DRIVE, _ROUTE = "Upload and drive", "Route"
_TOURS = "Several targets, and missions to repair"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions(LinkOptions):
    """Plan a mission around the fences of a SOURCE: `--fence FILE`, `--log FILE.tlog` or `--connect CONNECTION`.

    For example:

    `pbpp plan --log field.tlog -o mission.waypoints --plot mission.png`

    `pbpp plan --fence field.plan --start 40.0713,-105.2299 --target 40.0726,-105.2290 -o mission.plan`

    `pbpp plan --connect udpin:0.0.0.0:14550 --target 40.0726,-105.2290 --upload`
    """

    fence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Fence file: .waypoints, .plan, .kml, …")
    ] = None
    log: Annotated[Path | None, typer.Option(metavar="FILE.tlog", help="Recorded telemetry log.")] = None
    connect: ConnectOption = None
    start: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON", help="Start position. Default: the vehicle's position; for a file, its home."
        ),
    ] = None
    target: Annotated[
        list[str],
        typer.Option(
            metavar="LAT,LON",
            help="Target position; several are visited in order. Default: the newest target in the log or on the link.",
        ),
    ] = field(default_factory=list)
    clearance: Annotated[
        str | None,
        typer.Option(
            metavar="M|max",
            help="Fence clearance to keep while driving; max: the widest route. Default: from FENCE_MARGIN.",
        ),
    ] = None
    output: Annotated[
        list[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the mission: .waypoints, .plan, .geojson, .kml, .gpx.",
        ),
    ] = field(default_factory=list)
    plot: Annotated[
        list[Path],
        typer.Option(metavar="FILE", help="Draw the plan: .png, .svg, .pdf, .html; - in the terminal."),
    ] = field(default_factory=list)
    upload: Annotated[bool, typer.Option("--upload", help="Upload to the vehicle and verify.")] = False
    home: HomeOption = None
    hold: Annotated[
        bool,
        typer.Option(
            "--hold",
            help="With --upload: switch a vehicle that drives in AUTO to HOLD first.",
            rich_help_panel=_DRIVE,
        ),
    ] = False
    drive: Annotated[
        bool,
        typer.Option(
            "--drive",
            help="With --upload: then switch to AUTO, and to HOLD after arrival; does not arm.",
            rich_help_panel=_DRIVE,
        ),
    ] = False
    snap: Annotated[
        float,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="Move a blocked target to the nearest free place within M metres.",
            rich_help_panel=_ROUTE,
        ),
    ] = 0.0
    corner_allowance: Annotated[
        str,
        typer.Option(
            metavar="M|auto",
            help="Extra room for cut corners; 0 plans straight legs only, without a promise for the driven track.",
            rich_help_panel=_ROUTE,
        ),
    ] = "auto"
    method: Annotated[
        str,
        typer.Option(
            metavar="|".join(METHODS), help="Path search: optimal is the shortest.", rich_help_panel=_ROUTE
        ),
    ] = "optimal"
    escape: Annotated[
        bool,
        typer.Option(
            "--escape",
            help="Let a vehicle that stands inside an exclusion or outside the fence drive out.",
            rich_help_panel=_ROUTE,
        ),
    ] = False
    vehicle: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parm",
            help="Parameter file, for what the source does not report.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="M/S",
            parser=within(LEAST_MPS, MOST_MPS, "metres a second"),
            help="Drive at this speed. Default: the vehicle's own.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None
    firmware: FirmwareOption = None
    stopping: StoppingOption = field(default_factory=list)
    trust_model: TrustOption = False
    reserve: ReserveOption = 0.0
    position_error: PositionErrorOption = None
    length: LengthOption = 0.0
    width: WidthOption = 0.0
    gps: GpsOption = "0,0"
    order: Annotated[
        str,
        typer.Option(
            metavar="|".join(ORDERS),
            help="given: as listed; best: in the shortest order.",
            rich_help_panel=_TOURS,
        ),
    ] = "given"
    come_back: Annotated[
        bool,
        typer.Option(
            "--return",
            help="Return home after the last target (to the start if home is unknown).",
            rich_help_panel=_TOURS,
        ),
    ] = False
    end: Annotated[
        str,
        typer.Option(
            metavar="|".join(ENDS),
            help="What to do at the end; rtl only if its straight line is free.",
            rich_help_panel=_TOURS,
        ),
    ] = "hold"
    via_mission: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|own",
            help="Repair this mission: replace the legs that do not keep the clearance; own: the mission in the SOURCE.",
            rich_help_panel=_TOURS,
        ),
    ] = None
    role: RoleOption = field(default_factory=list)
    outermost: OutermostOption = None
    ignore_points: IgnorePointsOption = False
    blocks: Annotated[
        bool,
        typer.Option(
            "--blocks", help="Also draw the blocks of the free space.", rich_help_panel=OUTPUT_PANEL
        ),
    ] = False
