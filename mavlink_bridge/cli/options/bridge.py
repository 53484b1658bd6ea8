"""The options of ``pbpp bridge``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    AcceptLessOption,
    DescriptionOptions,
    RequiredConnectOption,
    VehicleLinkOptions,
    flag,
    metres,
    option,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeOptions(DescriptionOptions, VehicleLinkOptions):
    """Run alongside the autopilot: read fence, state and targets from the link, plan, upload and verify missions, watch the drive.

    Type targets as `LAT,LON`; `yes` confirms a plan. Without `--upload` it only reports.

    For example:

    `pbpp bridge --connect udpin:0.0.0.0:14550`

    `pbpp bridge --connect /dev/ttyAMA0,921600 --upload --drive --log run.tlog --json`
    """

    connect: RequiredConnectOption
    target: Annotated[list[str], option("The first target; more can be typed or clicked.", "LAT,LON")] = (
        field(default_factory=list)
    )
    target_from: Annotated[
        list[str],
        option(
            "Where targets may come from: typed, reposition, position-target, guided-item, mission, rally, echo; repeatable.",
            "SOURCE",
        ),
    ] = field(default_factory=list)
    clearance: Annotated[
        str | None, option("Clearance to keep while driving. Default: from FENCE_MARGIN.", "M|max")
    ] = None
    accept_less: AcceptLessOption = False
    corner_allowance: Annotated[str, option("Extra room for cut corners.", "M|auto")] = "auto"
    snap: Annotated[float, metres("Move a blocked target to the nearest free place within M metres.")] = 0.0
    upload: Annotated[bool, flag("--upload", "Write missions to the vehicle.")] = False
    drive: Annotated[
        bool,
        flag(
            "--drive",
            "With --upload: switch modes (HOLD before a new route and after arrival, AUTO for a verified route).",
        ),
    ] = False
    arm: Annotated[bool, flag("--arm", "With --drive: arm before AUTO.")] = False
    confirm: Annotated[bool, flag("--confirm", "Upload a plan only after you type yes.")] = False
    once: Annotated[bool, flag("--once", "Exit after the first target.")] = False
    log: Annotated[
        Path | None,
        option(
            "Record both directions, with a journal next to it; a restart continues in run.2.tlog, run.3.tlog …",
            "FILE.tlog",
        ),
    ] = None
    source_system: Annotated[
        int | None, option("System id that pbpp uses. Default: the vehicle's own.", "N", min=1, max=255)
    ] = None
    source_component: Annotated[int, option("Component id that pbpp uses.", "N", min=1, max=255)] = 195
