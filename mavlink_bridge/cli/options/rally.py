"""The options of ``pbpp rally``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    OUTPUT_PANEL,
    ClearanceOptions,
    ConnectOption,
    DescriptionOptions,
    HomeOption,
    LinkOptions,
    MapOptions,
    flag,
    metres,
    option,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RallyOptions(DescriptionOptions, MapOptions, ClearanceOptions, LinkOptions):
    """Choose rally points so that RTL's straight line is free from every point of a mission, in case the companion computer fails.

    For example:

    `pbpp rally --mission mission.waypoints --fence fence.waypoints -o rally.plan --plot rally.png`

    `pbpp rally --connect udpin:0.0.0.0:14550 --upload`
    """

    mission: Annotated[Path | None, option("Mission file: .plan, .waypoints, …", "FILE")] = None
    fence: Annotated[
        Path | None, option("Fence file; not needed if the --mission file holds one.", "FILE")
    ] = None
    log: Annotated[Path | None, option("Recorded log, for what is not given as a file.", "FILE.tlog")] = None
    connect: ConnectOption = None
    output: Annotated[
        list[Path],
        option(
            "Write the rally points: .plan, .waypoints, .geojson, .kml; or the parameters that go with them: .param.",
            "FILE",
            "-o",
            "--output",
        ),
    ] = field(default_factory=list)
    upload: Annotated[
        bool,
        flag(
            "--upload",
            "Upload the rally points, set RALLY_INCL_HOME 0 and RALLY_LIMIT_KM 0, and verify; needs --connect.",
        ),
    ] = False
    most: Annotated[int, option("Use at most N rally points.", "N", min=1, max=50)] = 10
    clearance: Annotated[
        float | None, metres("Fence clearance that RTL's lines must keep. Default: from FENCE_MARGIN.")
    ] = None
    accept_less: Annotated[
        bool,
        flag("--accept-less", "If no set of rally points keeps the clearance, take one that keeps less."),
    ] = False
    start: Annotated[
        str | None,
        option("Start position. Default: the vehicle's position; for files and logs, home.", "LAT,LON"),
    ] = None
    home: HomeOption = None
    plot: Annotated[
        list[Path],
        option("Draw them: .png, .svg, .pdf, .html; - in the terminal.", "FILE", panel=OUTPUT_PANEL),
    ] = field(default_factory=list)
