"""The options of ``pbpp download``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import LinkOptions, RequiredConnectOption, option

KINDS = ("mission", "fence", "rally", "parameters")


@dataclass(frozen=True, slots=True, kw_only=True)
class DownloadOptions(LinkOptions):
    """Download a mission, fence, rally points or all parameters; nothing is written to the vehicle.

    For example:

    `pbpp download fence --connect udpin:0.0.0.0:14550 -o field.waypoints`

    `pbpp download parameters --connect /dev/ttyACM0 -o rover.parm`
    """

    what: Annotated[str, typer.Argument(metavar="|".join(KINDS), help="What to download.")]
    connect: RequiredConnectOption = ""
    output: Annotated[
        list[Path],
        option(
            "File to write: .waypoints, .plan; parameters: .params (QGroundControl), .parm, .param. Default: list on the terminal.",
            "FILE",
            "-o",
            "--output",
        ),
    ] = field(default_factory=list)
