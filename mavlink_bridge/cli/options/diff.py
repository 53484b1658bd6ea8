"""The options of ``pbpp diff``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import OUTPUT_PANEL, CommonOptions, MapOptions, option


@dataclass(frozen=True, slots=True, kw_only=True)
class DiffOptions(MapOptions, CommonOptions):
    """Compare two missions or fences: which items, zones and rally points only one of them has, and how the others differ. Exit 8 if they differ.

    The files may be of different formats. Positions within 2 cm of each other are the same.

    For example:

    `pbpp diff yesterday.plan today.plan`

    `pbpp diff field.plan mission.waypoints --only mission --plot changes.png`
    """

    a: Annotated[Path, typer.Argument(metavar="A", help="A file with a mission, a fence or rally points.")]
    b: Annotated[Path, typer.Argument(metavar="B", help="Another one.")]
    only: Annotated[str | None, option("Compare only this part.", "mission|fence|rally")] = None
    plot: Annotated[
        list[Path],
        option(
            "Draw B, and where A differs: .png, .svg, .pdf, .html; - in the terminal.",
            "FILE",
            panel=OUTPUT_PANEL,
        ),
    ] = field(default_factory=list)
