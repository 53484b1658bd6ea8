"""The options of ``pbpp replay``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    AnyVehicleOption,
    CommonOptions,
    ManyOptions,
    SystemOption,
    flag,
    option,
)
from mavlink_bridge.cli.values import within

MOST_SPEED = 1e6
"""A day of a log in a tenth of a second: faster than any computer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayOptions(ManyOptions, CommonOptions):
    """Replay recorded logs through the bridge, in their own time: what it saw, what it would have planned.

    A log that `pbpp bridge --log` recorded is replayed with its journal: the same decisions come again. Over other logs the director only listens.

    For example:

    `pbpp replay sitl_logs/guided-maze.tlog`

    `pbpp replay field.tlog --record; pbpp replay field.tlog --expect field.events.jsonl`

    `pbpp replay field.tlog --send udpout:127.0.0.1:14550`
    """

    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="Recorded telemetry logs (.tlog).")]
    expect: Annotated[
        Path | None,
        option(
            "Expected events (JSON lines), or a folder with each log's .events.jsonl; exit 8 if they differ.",
            "FILE",
        ),
    ] = None
    record: Annotated[bool, flag("--record", "Write the events next to each log, as its .events.jsonl.")] = (
        False
    )
    send: Annotated[
        str | None, option("Play the vehicle's side of one log to a live client.", "CONNECTION")
    ] = None
    speed: Annotated[
        float | None,
        option(
            "Replay speed as a multiple of the log's own. Default: as fast as possible; 1 with --send.",
            "X",
            parser=within(0.0, MOST_SPEED, above=True),
        ),
    ] = None
    clearance: Annotated[str | None, option("As in pbpp plan.", "M|max")] = None
    corner_allowance: Annotated[str, option("As in pbpp plan.", "M|auto")] = "auto"
    system: SystemOption = None
    any_vehicle: AnyVehicleOption = False
