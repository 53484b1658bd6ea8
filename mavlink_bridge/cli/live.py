"""Planning on a live link: the shell around the director, with its progress bars, backups and plans."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.backup import BackupStore
from mavlink_bridge.cli.common import progress_bar
from mavlink_bridge.cli.plan import timed_plan
from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.link import open_link
from mavlink_bridge.messages import MissionType
from missions.formats import read_parameters
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from mavlink_bridge.link import Link
    from mavlink_bridge.messages import Frame
    from missions.plan import Plan
    from missions.request import Request

_STATE_TEXTS = {
    State.LISTENING: "listening for the vehicle",
    State.LEARNING: "reading parameters, fence and mission",
    State.READY: "planning",
    State.UPLOADING: "uploading and reading back",
    State.VERIFIED: "verified",
    State.STARTING: "switching to AUTO",
    State.DRIVING: "driving",
    State.ARRIVED: "arrived",
    State.FAILED: "failed",
}


@dataclass(frozen=True, eq=False)
class LiveResult:
    """What came of a live run."""

    plan: Plan
    planning_s: float
    situation: Situation
    uploaded: bool
    verified: bool


def plan_live(
    connection: str,
    request: Request,
    *,
    orders: Orders,
    vehicle_file: Path | None,
    upload: bool,
    quiet: bool,
) -> LiveResult:
    """Open a link and take a mission as far as the orders go.

    Raises
    ------
    BridgeError, MissionError
        What went wrong, on the link or in planning.
    """
    parameters = read_parameters(vehicle_file) if vehicle_file else {}
    director = Director(orders, Situation(parameters=parameters))
    with open_link(connection, orders.identity) as link:
        return conduct(link, director, request, upload=upload, quiet=quiet)


def conduct(
    link: Link,
    director: Director,
    request: Request,
    *,
    upload: bool,
    quiet: bool,
    on_frames: Callable[[list[Frame]], None] | None = None,
) -> LiveResult:
    """Run the director on a link; plan and keep backups for it.

    Raises
    ------
    BridgeError, MissionError
        The director's trouble, or the plan's.
    """
    made: list[tuple[Plan, float]] = []

    with progress_bar(quiet=quiet) as show:

        def step() -> None:
            show(_STATE_TEXTS[director.state], *director.progress)
            if director.state is State.READY and not made:
                planned, planning_s = timed_plan(director.situation, request)
                made.append((planned, planning_s))
                if upload:
                    director.take_plan(planned, time.monotonic())
            if (old := director.pending_backup) is not None and director.peer is not None:
                BackupStore().keep(director.peer.system, MissionType.MISSION, old)
                director.backup_stored(time.monotonic())

        link.run(director, on_frames=on_frames, on_step=step, until=lambda: bool(made) and not upload)
    if director.trouble is not None:
        raise director.trouble
    planned, planning_s = made[0]
    return LiveResult(planned, planning_s, director.situation, upload, upload)
