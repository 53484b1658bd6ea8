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
from mavlink_bridge.cli.values import MOST_MPS, MOST_S, within

_OBSTACLES = "Obstacles: this protects no person"


@dataclass(frozen=True, kw_only=True)
class ObstacleOptions:
    """Where obstacles may be reported from, and what is taken of them."""

    obstacles_from: Annotated[
        list[str],
        option(
            "Plan around reported obstacles, and with --drive hold for them: OBSTACLE_DISTANCE (a sensor's messages), keyboard (type blocked, clear); "
            "repeatable, or with commas. This protects no person.",
            "SOURCE",
            panel=_OBSTACLES,
        ),
    ] = field(default_factory=list)
    obstacle_growth: Annotated[
        float,
        option(
            "Assumed speed of an obstacle until it has been watched for 1.5 s.",
            "MPS",
            panel=_OBSTACLES,
            parser=within(0.0, MOST_MPS, "metres a second"),
        ),
    ] = 1.0
    obstacle_keep: Annotated[
        float,
        option(
            "How long an obstacle is kept after a sensor last saw it.",
            "S",
            panel=_OBSTACLES,
            parser=within(0.5, MOST_S, "seconds"),
        ),
    ] = 10.0


@dataclass(frozen=True, kw_only=True)
class HomingOptions:
    """When the vehicle is brought home, and where home may be."""

    rtl_by_route: Annotated[
        bool,
        flag(
            "--rtl-by-route",
            "With --drive: answer RTL with HOLD and a verified way home round the fences, to the nearest of home, rally points and --place. "
            "RTL again, or any other mode, is yours.",
        ),
    ] = False
    battery_percent: Annotated[
        float | None,
        option(
            "With --rtl-by-route: also bring it home when the battery is at or below P percent.",
            "P",
            parser=within(1.0, 99.0, "percent"),
        ),
    ] = None
    battery_volts: Annotated[
        float | None,
        option(
            "With --rtl-by-route: also bring it home when the battery is at or below V volts.",
            "V",
            parser=within(0.1, 1000.0, "volts"),
        ),
    ] = None
    gcs_timeout: Annotated[
        float | None,
        option(
            "With --rtl-by-route: also bring it home when no ground station was heard for S seconds, after one had been heard.",
            "S",
            parser=within(2.0, MOST_S, "seconds"),
        ),
    ] = None
    place: Annotated[
        list[str],
        option("A place to go home to, besides home and the rally points; repeatable.", "NAME=LAT,LON"),
    ] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class BridgeOptions(ObstacleOptions, HomingOptions, DescriptionOptions, VehicleLinkOptions):
    """Run alongside the autopilot: read fence, state and targets from the link, plan, upload and verify missions, watch the drive.

    Type targets as `LAT,LON`; `yes` confirms a plan; `blocked` reports an obstacle. Without `--upload` it only reports.

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
    confirm: Annotated[
        bool,
        flag(
            "--confirm",
            "Upload a plan only after you type yes. Ways home (--rtl-by-route) are uploaded at once.",
        ),
    ] = False
    escape: Annotated[
        bool,
        flag("--escape", "Let a vehicle that stands inside an exclusion or outside the fence drive out."),
    ] = False
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
