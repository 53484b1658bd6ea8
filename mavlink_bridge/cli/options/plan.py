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
    TrustOption,
    WidthOption,
)
from mavlink_bridge.cli.values import LEAST_MPS, MOST_M, MOST_MPS, within
from missions.request import End, Method, Order

METHODS, ORDERS, ENDS = tuple(Method), tuple(Order), tuple(End)
_TOURS = "Several targets, and missions to repair"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanOptions(LinkOptions):
    """Plan a mission around the fences of a SOURCE: `--fence FILE`, `--log FILE.tlog` or `--connect CONNECTION`.

    For example:

    `pbpp plan --log field.tlog -o mission.waypoints --plot mission.png`

    `pbpp plan --fence field.plan --start 40.0713,-105.2299 --target 40.0726,-105.2290 -o mission.plan`

    `pbpp plan --connect udpin:0.0.0.0:14550 --target 40.0726,-105.2290 --upload`
    """

    fence: Annotated[Path | None, typer.Option(metavar="FILE", help="Fence file: .waypoints, .plan, …")] = (
        None
    )
    log: Annotated[Path | None, typer.Option(metavar="FILE.tlog", help="Recorded telemetry log.")] = None
    connect: ConnectOption = None
    start: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Default: the vehicle's position; for a file its home."),
    ] = None
    target: Annotated[
        list[str],
        typer.Option(
            metavar="LAT,LON", help="Several are visited in order. Default: the newest in the stream."
        ),
    ] = field(default_factory=list)
    clearance: Annotated[
        str | None,
        typer.Option(
            metavar="M|max", help="Promised while driving; max: the widest route. Default: from FENCE_MARGIN."
        ),
    ] = None
    corner_allowance: Annotated[
        str, typer.Option(metavar="M|auto", help="Room for cut corners on top; 0 plans the drawn lines only.")
    ] = "auto"
    home: HomeOption = None
    vehicle: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parm",
            help="Parameters that the source does not have.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None
    snap: Annotated[
        float,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="Move a blocked target to free ground within M metres.",
        ),
    ] = 0.0
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
    trust_model: TrustOption = False
    reserve: ReserveOption = 0.0
    position_error: PositionErrorOption = None
    length: LengthOption = 0.0
    width: WidthOption = 0.0
    gps: GpsOption = "0,0"
    escape: Annotated[
        bool,
        typer.Option(
            "--escape",
            help="Let a vehicle that stands on forbidden ground drive out.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = False
    order: Annotated[
        str,
        typer.Option(
            metavar="|".join(ORDERS), help="best: the targets in the shortest order.", rich_help_panel=_TOURS
        ),
    ] = "given"
    come_back: Annotated[
        bool,
        typer.Option(
            "--return",
            help="Come home after the last target (home not known: to the start).",
            rich_help_panel=_TOURS,
        ),
    ] = False
    end: Annotated[
        str,
        typer.Option(
            metavar="|".join(ENDS),
            help="At the end; rtl only where its straight line is free.",
            rich_help_panel=_TOURS,
        ),
    ] = "hold"
    via_mission: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|own",
            help="Repair this mission: replace the legs that break the clearance; own: the one in the SOURCE.",
            rich_help_panel=_TOURS,
        ),
    ] = None
    role: RoleOption = field(default_factory=list)
    outermost: OutermostOption = None
    ignore_points: IgnorePointsOption = False
    method: Annotated[str, typer.Option(metavar="|".join(METHODS), help="How to search.")] = "optimal"
    output: Annotated[
        list[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the mission: .waypoints, .plan, .geojson, .kml, .gpx.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = field(default_factory=list)
    plot: Annotated[
        list[Path],
        typer.Option(
            metavar="FILE",
            help="Draw the plan: .png, .svg, .pdf, .html; - in the terminal.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = field(default_factory=list)
    blocks: Annotated[
        bool,
        typer.Option("--blocks", help="Draw the blocks of the free space too.", rich_help_panel=OUTPUT_PANEL),
    ] = False
    upload: Annotated[bool, typer.Option("--upload", help="Upload to the vehicle and verify.")] = False
    hold: Annotated[
        bool,
        typer.Option(
            "--hold", help="With --upload: a vehicle that drives in AUTO is switched to HOLD first."
        ),
    ] = False
    drive: Annotated[
        bool,
        typer.Option(
            "--drive", help="With --upload: then switch to AUTO, after arrival to HOLD; arms nothing."
        ),
    ] = False
