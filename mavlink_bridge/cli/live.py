"""Planning on a live link: the shell around the director, with its progress bars, backups and plans."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mavlink_bridge.backup import BackupStore
from mavlink_bridge.cli.common import progress_bar
from mavlink_bridge.cli.plan import timed_plan
from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import ONE_SHOT_IDENTITY, now_s, open_link
from mavlink_bridge.messages import MissionType
from mavlink_bridge.protocol.verified_upload import Held
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
    State.READY: "ready",
    State.HOLDING: "stopping",
    State.PLANNING: "planning",
    State.PROPOSED: "planned",
    State.UPLOADING: "uploading and reading back",
    State.VERIFIED: "verified",
    State.STARTING: "switching to AUTO",
    State.DRIVING: "driving",
    State.ARRIVED: "arrived",
    State.LET_GO: "let go",
    State.LOST: "no heartbeat",
    State.DONE: "done",
    State.FAILED: "failed",
}


@dataclass(frozen=True, eq=False)
class LiveResult:
    """What came of a live run."""

    plan: Plan
    planning_s: float
    situation: Situation
    verified: bool


def plan_live(connection: str, orders: Orders, *, vehicle_file: Path | None, quiet: bool) -> LiveResult:
    """Open a link and take one mission as far as the orders go.

    Raises
    ------
    BridgeError, MissionError
        What went wrong, on the link or in planning.
    """
    parameters = read_parameters(vehicle_file) if vehicle_file else {}
    with open_link(connection, orders.identity or ONE_SHOT_IDENTITY) as link:
        return conduct(link, orders, Situation(parameters=parameters), quiet=quiet)


def conduct(
    link: Link,
    orders: Orders,
    situation: Situation | None = None,
    *,
    quiet: bool,
    on_frames: Callable[[list[Frame]], None] | None = None,
) -> LiveResult:
    """Run a director on a link until its single job is done, and keep backups for it.

    Raises
    ------
    BridgeError, MissionError
        The director's trouble.
    """
    planning_s: list[float] = []

    def timed(situation: Situation, request: Request) -> Plan:
        planned, seconds = timed_plan(situation, request)
        planning_s.append(seconds)
        return planned

    director = Director(replace(orders, once=True), situation, timed)
    store = BackupStore()
    with progress_bar(quiet=quiet) as show:

        def step() -> None:
            show(_STATE_TEXTS[director.state], *director.progress)
            keep_backup(director, store, now_s())

        link.run(director, on_frames=on_frames, on_step=step)
    if director.trouble is not None or director.plan is None:
        raise director.trouble or LinkError("the director ended without a plan")
    outcome = director.upload_outcome
    return LiveResult(
        director.plan,
        planning_s[-1],
        director.situation,
        verified=outcome is not None and outcome.is_verified,
    )


def keep_backup(director: Director, store: BackupStore, now_s: float) -> None:
    """Store the vehicle's old mission when the director wants it stored; take the note away when the outcome is known."""
    peer = director.peer
    if peer is None:
        return
    if (old := director.pending_backup) is not None:
        store.begin(peer.system, MissionType.MISSION, old)
        director.backup_stored(now_s)
    elif director.upload_outcome is not None and director.upload_outcome.held in (Held.WANTED, Held.OLD):
        store.end(peer.system, MissionType.MISSION)
