"""The options of ``pbpp sim``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import (
    CommonOptions,
    IgnorePointsOption,
    OutermostOption,
    RoleOption,
    firmware_option,
)
from mavlink_bridge.cli.values import MOST_S, within
from missions.firmware import Firmware

MOST_SEED = 2**63 - 1
"""What fits everywhere a seed is kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimOptions(CommonOptions):
    """Run a simulated rover until Ctrl-C.

    It answers MAVLink 2 as ArduPilot Rover does: missions, fences, rally points, parameters, modes, arming; it drives AUTO and GUIDED.
    Prints the connection string to open as soon as it listens.

    For example:

    `pbpp sim --fence field.plan --home 40.0713,-105.2299`

    `pbpp sim --listen udpout:127.0.0.1:14550 --loss 0.1 --latency 0.2`
    """

    listen: Annotated[
        str,
        typer.Option(
            metavar="CONNECTION", help="tcpin:, udpin: or udpout:HOST:PORT; port 0 is any free one."
        ),
    ] = "tcpin:127.0.0.1:5760"
    home: Annotated[
        str, typer.Option(metavar="LAT,LON[,HEADING]", help="Position and heading at the start.")
    ] = "40.071374,-105.229930,0"
    fence: Annotated[Path | None, typer.Option(help="Fence file stored in the rover.")] = None
    mission: Annotated[
        Path | None,
        typer.Option(help="Mission file stored in the rover; its home, if it has one, is not used."),
    ] = None
    firmware: Annotated[
        Firmware | None,
        typer.Option(
            metavar="VERSION",
            parser=firmware_option,
            help="Firmware version (4.5, 4.6.3) that it reports, and drives like. Default: 4.7.0-dev of October 2025.",
        ),
    ] = None
    param: Annotated[list[str], typer.Option(metavar="NAME=VALUE", help="Set a parameter; repeatable.")] = (
        field(default_factory=list)
    )
    speedup: Annotated[
        float,
        typer.Option(metavar="X", parser=within(0.01, 1000.0), help="How many times faster than real time."),
    ] = 1.0
    loss: Annotated[
        float, typer.Option(metavar="P", parser=within(0.0, 1.0), help="Share of frames lost, each way.")
    ] = 0.0
    duplicate: Annotated[
        float,
        typer.Option(metavar="P", parser=within(0.0, 1.0), help="Share of frames duplicated, each way."),
    ] = 0.0
    latency: Annotated[
        float,
        typer.Option(
            metavar="S",
            parser=within(0.0, MOST_S, "seconds"),
            help="Delay of each frame in seconds, each way.",
        ),
    ] = 0.0
    jitter: Annotated[
        float,
        typer.Option(
            metavar="S",
            parser=within(0.0, MOST_S, "seconds"),
            help="Random extra delay, up to so many seconds.",
        ),
    ] = 0.0
    seed: Annotated[
        int, typer.Option(min=-MOST_SEED, max=MOST_SEED, help="Random seed of the link's faults.")
    ] = 0
    system: Annotated[int, typer.Option(min=1, max=255, help="MAVLink system id.")] = 1
    role: RoleOption = field(default_factory=list)
    outermost: OutermostOption = None
    ignore_points: IgnorePointsOption = False
