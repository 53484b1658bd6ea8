"""The options of ``pbpp check``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    OUTPUT_PANEL,
    ClearanceOptions,
    ConnectOption,
    DescriptionOptions,
    HomeOption,
    LinkOptions,
    ManyOptions,
    MapOptions,
    PlaceOption,
    metres,
    option,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions(DescriptionOptions, MapOptions, ClearanceOptions, ManyOptions, LinkOptions):
    """Check every leg of a mission against a fence: the clearance of its straight line and of the predicted track. Exit 8 if a leg fails.

    Several missions are checked at the same time, each against `--fence` or else the fence in its own file. A mission that cannot be read does not stop the others.

    For example:

    `pbpp check --mission mission.waypoints --fence fence.waypoints --clearance 2`

    `pbpp check --mission field.plan --vehicle rover.parm --plot check.png`

    `pbpp check --log field.tlog`

    `pbpp check missions/*.plan --vehicle rover.parm --format sarif`
    """

    missions: Annotated[
        list[Path], typer.Argument(metavar="[MISSION]...", help="Mission files, to check several at once.")
    ] = field(default_factory=list)
    mission: Annotated[Path | None, option("Mission file: .plan, .waypoints, …", "FILE")] = None
    fence: Annotated[
        Path | None, option("Fence file; not needed if the --mission file holds one.", "FILE")
    ] = None
    log: Annotated[Path | None, option("Recorded log, for what is not given as a file.", "FILE.tlog")] = None
    connect: ConnectOption = None
    start: Annotated[
        str | None,
        option("Start position. Default: the vehicle's position; for files and logs, home.", "LAT,LON"),
    ] = None
    home: HomeOption = None
    place: PlaceOption = field(default_factory=list)
    clearance: Annotated[
        float | None, metres("Fence clearance each leg must keep while driving. Default: from FENCE_MARGIN.")
    ] = None
    format: Annotated[
        str | None,
        option(
            "Write a report with the line of each finding to standard output: SARIF 2.1.0 for code hosts, JUnit's XML for build servers.",
            "sarif|junit",
            panel=OUTPUT_PANEL,
        ),
    ] = None
    plot: Annotated[
        list[Path],
        option("Draw the check: .png, .svg, .pdf, .html; - in the terminal.", "FILE", panel=OUTPUT_PANEL),
    ] = field(default_factory=list)
