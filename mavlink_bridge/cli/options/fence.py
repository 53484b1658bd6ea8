"""The options of ``pbpp fence``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import CommonOptions, MapOptions, option

ACTIONS = ("merge",)


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceOptions(MapOptions, CommonOptions):
    """Make a fence fit for the vehicle. `merge`: one inclusion polygon in place of several that overlap.

    The autopilot allows only the intersection of all inclusions; an area drawn in several pieces is meant as their union.

    For example:

    `pbpp fence merge pieces.plan -o field.plan`
    """

    action: Annotated[
        str,
        typer.Argument(metavar="|".join(ACTIONS), help="merge: make one inclusion of several that overlap."),
    ]
    source: Annotated[Path, typer.Argument(metavar="FILE", help="A fence: .plan, .waypoints, .kml, …")]
    output: Annotated[Path, option("File to write: .plan, .waypoints, .geojson, …", "FILE", "-o", "--output")]
