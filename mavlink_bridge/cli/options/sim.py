"""The options of ``pbpp sim``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    CommonOptions,
    MapOptions,
    SimulatedAutopilotOption,
    SimulatedFirmwareOption,
    option,
)
from mavlink_bridge.cli.values import MOST_S, within

MOST_SEED = 2**31 - 1
"""Chosen, not measured: more seeds than anybody tries, and short in the help."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimOptions(MapOptions, CommonOptions):
    """Run a simulated rover until Ctrl-C.

    It answers MAVLink 2 as ArduPilot Rover does: missions, fences, rally points, parameters, modes, arming; it drives AUTO and GUIDED.
    With --autopilot px4 it answers as PX4 1.17 or 1.18 does, and drives as its rover with steered wheels.
    Prints the connection string to open as soon as it listens.

    For example:

    `pbpp sim --fence field.plan --home 40.0713,-105.2299`

    `pbpp sim --listen udpout:127.0.0.1:14550 --loss 0.1 --latency 0.2`
    """

    listen: Annotated[
        str, option("tcpin:, udpin: or udpout:HOST:PORT; port 0 is any free one.", "CONNECTION")
    ] = "tcpin:127.0.0.1:5760"
    home: Annotated[str, option("Position and heading at the start.", "LAT,LON[,HEADING]")] = (
        "40.071374,-105.229930,0"
    )
    fence: Annotated[Path | None, option("Fence file stored in the rover.", "FILE")] = None
    mission: Annotated[
        Path | None, option("Mission file stored in the rover; its home, if it has one, is not used.", "FILE")
    ] = None
    disc: Annotated[
        list[str],
        option(
            "A round object of radius R that the rover's distance sensor sees, up to 15 m away; it may move. Repeatable.",
            "LAT,LON,R[,SPEED,HEADING]",
        ),
    ] = field(default_factory=list)
    autopilot: SimulatedAutopilotOption = "ardupilot"
    firmware: SimulatedFirmwareOption = None
    param: Annotated[list[str], option("Set a parameter; repeatable.", "NAME=VALUE")] = field(
        default_factory=list
    )
    speedup: Annotated[
        float, option("How many times faster than real time.", "X", parser=within(0.01, 1000.0))
    ] = 1.0
    loss: Annotated[float, option("Share of frames lost, each way.", "P", parser=within(0.0, 1.0))] = 0.0
    duplicate: Annotated[
        float, option("Share of frames duplicated, each way.", "P", parser=within(0.0, 1.0))
    ] = 0.0
    latency: Annotated[
        float, option("Delay of each frame in seconds, each way.", "S", parser=within(0.0, MOST_S, "seconds"))
    ] = 0.0
    jitter: Annotated[
        float,
        option("Random extra delay, up to so many seconds.", "S", parser=within(0.0, MOST_S, "seconds")),
    ] = 0.0
    seed: Annotated[int, option("Random seed of the link's faults.", "N", min=0, max=MOST_SEED)] = 0
    system: Annotated[int, option("MAVLink system id.", "N", min=1, max=255)] = 1
