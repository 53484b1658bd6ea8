"""The options of ``pbpp upload``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import LinkOptions, MapOptions, RequiredConnectOption, flag, option

LISTS = ("fence", "rally", "mission")  # a fence before the mission that it governs


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadOptions(MapOptions, LinkOptions):
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
    only: Annotated[list[str], option("Upload only these lists of the file.", "|".join(LISTS))] = field(
        default_factory=list
    )
    restore: Annotated[
        bool, flag("--restore", "Restore what an interrupted upload replaced, or the backup FILE.")
    ] = False
    hold: Annotated[bool, flag("--hold", "A vehicle that drives in AUTO is switched to HOLD first.")] = False
    replace_active: Annotated[
        bool, flag("--replace-active", "Write even while the vehicle is armed in AUTO.")
    ] = False
    drive: Annotated[bool, flag("--drive", "Switch to AUTO once everything is verified; arms nothing.")] = (
        False
    )
    other_vehicle: Annotated[
        bool, flag("--other-vehicle", "With --restore FILE: accept a backup of another vehicle.")
    ] = False
    forget: Annotated[bool, flag("--forget", "Dismiss the notes of interrupted uploads; backups stay.")] = (
        False
    )
