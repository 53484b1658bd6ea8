"""The options of ``pbpp upload``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    IgnorePointsOption,
    LinkOptions,
    OutermostOption,
    RequiredConnectOption,
    RoleOption,
)

LISTS = ("fence", "rally", "mission")  # a fence before the mission that it governs


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadOptions(LinkOptions):
    """Upload FILE to the vehicle: back up the old list, send the new one, read it back and compare.

    For example:

    `pbpp upload mission.waypoints --connect udpin:0.0.0.0:14550`

    `pbpp upload field.plan --connect /dev/ttyACM0 --only fence`

    `pbpp upload --restore --connect udpin:0.0.0.0:14550`
    """

    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE", help="A mission, fence, plan or parameter file; with --restore a backup."
        ),
    ] = None
    connect: RequiredConnectOption = ""
    only: Annotated[
        list[str],
        typer.Option(metavar="|".join(LISTS), help="Upload only these lists of the file."),
    ] = field(default_factory=list)
    restore: Annotated[
        bool,
        typer.Option("--restore", help="Restore what an interrupted upload replaced, or the backup FILE."),
    ] = False
    hold: Annotated[
        bool, typer.Option("--hold", help="A vehicle that drives in AUTO is switched to HOLD first.")
    ] = False
    replace_active: Annotated[
        bool, typer.Option("--replace-active", help="Write even while the vehicle is armed in AUTO.")
    ] = False
    drive: Annotated[
        bool, typer.Option("--drive", help="Switch to AUTO once everything is verified; arms nothing.")
    ] = False
    other_vehicle: Annotated[
        bool,
        typer.Option("--other-vehicle", help="With --restore FILE: accept a backup of another vehicle."),
    ] = False
    forget: Annotated[
        bool,
        typer.Option("--forget", help="Dismiss the notes of interrupted uploads; backups stay."),
    ] = False
    role: RoleOption = field(default_factory=list)
    outermost: OutermostOption = None
    ignore_points: IgnorePointsOption = False
