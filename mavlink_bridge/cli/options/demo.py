"""The options of ``pbpp demo``, and its help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from mavlink_bridge.cli.options.shared import (
    CommonOptions,
    SimulatedAutopilotOption,
    SimulatedFirmwareOption,
    option,
)
from mavlink_bridge.cli.values import within


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoOptions(CommonOptions):
    """Run a demonstration: simulated rover, fence, target, plan, upload, verify, drive, picture, report."""

    out: Annotated[Path, option("Folder for the picture, the mission and the log.", "DIR")] = Path("demo-out")
    speedup: Annotated[
        float,
        option(
            "How many times faster than real time, if the computer keeps up.", "X", parser=within(1.0, 20.0)
        ),
    ] = 4.0
    autopilot: SimulatedAutopilotOption = "ardupilot"
    firmware: SimulatedFirmwareOption = None
