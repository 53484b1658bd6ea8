"""The options of ``pbpp bridge``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    AnyVehicleOption,
    CommonOptions,
    FirmwareOption,
    RequiredConnectOption,
    SigningKeyOption,
    StoppingOption,
    SystemOption,
    TimeoutOption,
    TrustOption,
)
from mavlink_bridge.cli.values import MOST_M, within


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeOptions(CommonOptions):
    """Run alongside the autopilot: read fence, state and targets from the link, plan, upload and verify missions, watch the drive.

    Type targets as `LAT,LON`; `yes` confirms a plan. Without `--upload` it only reports.

    For example:

    `pbpp bridge --connect udpin:0.0.0.0:14550`

    `pbpp bridge --connect /dev/ttyAMA0,921600 --upload --drive --log run.tlog --json`
    """

    connect: RequiredConnectOption
    target: Annotated[
        list[str],
        typer.Option(metavar="LAT,LON", help="The first target; more can be typed or clicked."),
    ] = field(default_factory=list)
    target_from: Annotated[
        list[str],
        typer.Option(
            metavar="SOURCE",
            help="typed, reposition, position-target, guided-item, mission, rally or echo; repeatable.",
        ),
    ] = field(default_factory=list)
    clearance: Annotated[
        str | None,
        typer.Option(metavar="M|max", help="Clearance to keep while driving. Default: from FENCE_MARGIN."),
    ] = None
    corner_allowance: Annotated[str, typer.Option(metavar="M|auto", help="Extra room for cut corners.")] = (
        "auto"
    )
    snap: Annotated[
        float,
        typer.Option(
            metavar="M",
            parser=within(0.0, MOST_M, "metres"),
            help="Move a blocked target to the nearest free place within M metres.",
        ),
    ] = 0.0
    vehicle: Annotated[
        Path | None, typer.Option(metavar="FILE.parm", help="Parameters that the vehicle does not report.")
    ] = None
    firmware: FirmwareOption = None
    stopping: StoppingOption = field(default_factory=list)
    trust_model: TrustOption = False
    upload: Annotated[bool, typer.Option("--upload", help="Write missions to the vehicle.")] = False
    drive: Annotated[
        bool,
        typer.Option(
            "--drive",
            help="With --upload: switch modes (HOLD before a new route and after arrival, AUTO for a verified route).",
        ),
    ] = False
    arm: Annotated[bool, typer.Option("--arm", help="With --drive: arm before AUTO.")] = False
    confirm: Annotated[bool, typer.Option("--confirm", help="Upload a plan only after you type yes.")] = False
    once: Annotated[bool, typer.Option("--once", help="Exit after one job.")] = False
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.tlog",
            help="Record both directions, with a journal next to it; a restart continues in run.2.tlog, run.3.tlog …",
        ),
    ] = None
    system: SystemOption = None
    any_vehicle: AnyVehicleOption = False
    source_system: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, max=255, help="System id that pbpp uses. Default: the vehicle's own."
        ),
    ] = None
    source_component: Annotated[
        int, typer.Option(metavar="N", min=1, max=255, help="Component id that pbpp uses.")
    ] = 195
    signing_key: SigningKeyOption = None
    timeout: TimeoutOption = 30.0
