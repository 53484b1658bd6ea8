"""The options of ``pbpp convert``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import CommonOptions, MapOptions, option


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertOptions(MapOptions, CommonOptions):
    """Convert a file with a fence, a mission, rally points or parameters; the file extensions choose the formats.

    For example:

    `pbpp convert field.kml field.plan`

    `pbpp convert field.plan fence.waypoints --only fence`

    `pbpp convert mission.waypoints route.gpx`

    `pbpp convert farm.kml field.plan --outermost inclusion --ignore-points`
    """

    source: Annotated[
        Path, typer.Argument(metavar="IN", help="What to read: .plan, .waypoints, .fen, .poly, .geojson, …")
    ]
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="What to write: .plan, .waypoints, .geojson, .kml, .gpx, …")
    ]
    only: Annotated[
        str | None, option("Write only this part, if IN holds more than OUT can.", "mission|fence|rally")
    ] = None
    return_point: Annotated[
        str | None, option("The fence's return point, which .fen files must have.", "LAT,LON")
    ] = None
