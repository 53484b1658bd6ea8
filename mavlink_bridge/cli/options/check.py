"""The options of ``pbpp check``, and its help."""

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
    WidthOption,
)
from mavlink_bridge.cli.values import MOST_M, within


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions(LinkOptions):
    """Check every leg of a mission against a fence: the clearance of its straight line and of the predicted track. Exit 8 if a leg fails.

    For example:

    `pbpp check --mission mission.waypoints --fence fence.waypoints --clearance 2`

    `pbpp check --mission field.plan --vehicle rover.parm --plot check.png`

    `pbpp check --log field.tlog`
    """

    mission: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mission file: .plan, .waypoints, …")
    ] = None
    fence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Fence file; not needed if the --mission file holds one."),
    ] = None
    log: Annotated[
        Path | None, typer.Option(metavar="FILE.tlog", help="Recorded log, for what is not given as a file.")
    ] = None
    connect: ConnectOption = None
    start: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON",
            help="Start position. Default: the vehicle's position; for files and logs, home.",
        ),
    ] = None
    home: HomeOption = None
    vehicle: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parm",
            help="Parameter file, for what the log or link does not report.",
            rich_help_panel=VEHICLE_PANEL,
        ),
    ] = None
    clearance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="Fence clearance each leg must keep while driving. Default: from FENCE_MARGIN.",
        ),
    ] = None
    plot: Annotated[
        list[Path],
        typer.Option(
            metavar="FILE",
            help="Draw the check: .png, .svg, .pdf, .html; - in the terminal.",
            rich_help_panel=OUTPUT_PANEL,
        ),
    ] = field(default_factory=list)
    role: RoleOption = field(default_factory=list)
    outermost: OutermostOption = None
    ignore_points: IgnorePointsOption = False
    firmware: FirmwareOption = None
    stopping: StoppingOption = field(default_factory=list)
    reserve: ReserveOption = 0.0
    position_error: PositionErrorOption = None
    length: LengthOption = 0.0
    width: WidthOption = 0.0
    gps: GpsOption = "0,0"
