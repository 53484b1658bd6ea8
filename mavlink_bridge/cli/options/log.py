"""The options of ``pbpp log``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import CommonOptions, SystemOption, flag, option


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOptions(CommonOptions):
    """Summarise telemetry logs: who speaks, fences and missions transferred, targets, modes, the drive and its clearance.

    Drives of a mission (AUTO) are graded: least clearance, deviation and time against the drive model's prediction. The verdict comes last.

    For example:

    `pbpp log flight.tlog --plot flight.png`

    `pbpp log *.tlog --json`
    """

    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Logs: .tlog, .raw, DataFlash .bin, also packed with gzip."),
    ]
    plot: Annotated[
        list[Path],
        option(
            "Draw fence, drives, mission and targets: .png, .svg, .pdf, .html; - in the terminal.", "FILE"
        ),
    ] = field(default_factory=list)
    messages: Annotated[bool, flag("--messages", "List the messages by type, with count and rate.")] = False
    system: SystemOption = None
