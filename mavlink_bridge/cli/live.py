"""Planning on a live link: the shell around the director, with its progress bars, backups and plans."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass, replace
from threading import Thread
from typing import TYPE_CHECKING

from mavlink_bridge.backup import BackupStore
from mavlink_bridge.cli.common import progress_bar, warn
from mavlink_bridge.cli.interrupting import AtHand, interruptible, terminable
from mavlink_bridge.cli.plan import timed_plan
from mavlink_bridge.cli.session import signing_of
from mavlink_bridge.cli.upload import interrupted_warnings, with_backup
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.errors import BridgeError, LinkError
from mavlink_bridge.link import ONE_SHOT_IDENTITY, open_link
from mavlink_bridge.messages import MissionType
from mavlink_bridge.outcomes import held_text
from mavlink_bridge.protocol.vehicle_watch import Doing
from mavlink_bridge.protocol.verified_upload import Held, OutcomeKind
from missions.course import follow_mission
from missions.errors import SituationError
from missions.formats import read_parameters
from missions.items import Command
from missions.plan import Plan
from missions.plan import plan as make_plan
from missions.situation import Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mavlink_bridge.director.plan_task import PlanTask
    from mavlink_bridge.link import Link
    from mavlink_bridge.messages import Frame
    from missions.errors import MissionError
    from missions.request import Request

_IDLE_S, _BUSY_S = 0.25, 0.02

_STATE_TEXTS = {
    State.LISTENING: "listening for the vehicle",
    State.LEARNING: "reading parameters, fence and mission",
    State.READY: "ready",
    State.HOLDING: "stopping",
    State.PLANNING: "planning",
    State.PROPOSED: "planned",
    State.UPLOADING: "uploading and reading back",
    State.WITHDRAWING: "taken over; ending the upload",
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
    """What came of a live run; ``arrival`` holds the data of the director's event, None where nothing was driven."""

    plan: Plan
    planning_s: float
    situation: Situation
    verified: bool
    arrival: Mapping[str, object] | None = None
    doing: Doing | None = None


PlanTaker = Callable[[Plan, float, Situation], None]
"""Takes a plan, how long it took, and the situation that it was made in."""


def _take_none(_plan: Plan, _planning_s: float, _situation: Situation) -> None:
    """Do nothing with a plan."""


def plan_live(
    connection: str,
    orders: Orders,
    *,
    vehicle_file: Path | None,
    key_file: Path | None,
    quiet: bool,
    on_plan: PlanTaker = _take_none,
) -> LiveResult:
    """Open a link and take one mission as far as the orders go; each plan is given to ``on_plan`` before it is acted upon.

    Raises
    ------
    BridgeError, MissionError
        What went wrong, on the link or in planning.
    """
    parameters = read_parameters(vehicle_file) if vehicle_file else {}
    identity = orders.identity or ONE_SHOT_IDENTITY
    with terminable(), open_link(connection, identity, signing=signing_of(key_file)) as link:
        return conduct(link, orders, Situation(parameters=parameters), quiet=quiet, on_plan=on_plan)


def conduct(
    link: Link,
    orders: Orders,
    situation: Situation | None = None,
    *,
    quiet: bool,
    on_frames: Callable[[list[Frame]], None] | None = None,
    on_plan: PlanTaker = _take_none,
    is_real: bool = True,
) -> LiveResult:
    """Run a director on a link until its single job is done, and keep backups for it.

    Where the vehicle is real, an interrupt ends with what it does, and may ask whether to stop it.

    Raises
    ------
    BridgeError, MissionError
        The director's trouble.
    """
    planning_s: list[float] = []
    has_driven = False
    director = Director(replace(orders, once=True), situation)
    plans = PlanMaker(director, _timed_planner(orders, lambda: has_driven, planning_s))
    backups = BackupKeeper(director)
    taken: Plan | None = None
    arrival: Mapping[str, object] | None = None
    with progress_bar(quiet=quiet) as show:

        def step() -> None:
            nonlocal has_driven, taken, arrival
            has_driven = has_driven or director.state is State.DRIVING
            show(_STATE_TEXTS[director.state], *director.progress)
            warn(backups.step(link.now_s()))
            if (made := plans.take()) is not None:
                director.plan_made(*made, link.now_s())
            if director.plan is not None and director.plan is not taken:
                taken = director.plan
                with show.aside():  # before anything of it is sent
                    on_plan(taken, planning_s[-1], director.situation)
            for event in director.take_events():
                arrival = event.data if event.name is EventName.ARRIVED else arrival

        at_hand = replace(director_at_hand(director, backups, link), aside=show.aside)
        with interruptible(at_hand) if is_real else nullcontext():
            link.run(director, on_frames=on_frames, on_step=step, longest_wait_s=plans.longest_wait_s)
    if director.trouble is not None or director.plan is None:
        raise _with_hint(
            backups.explained(director.trouble or LinkError("the director ended without a plan"))
        )
    outcome = director.upload_outcome
    return LiveResult(
        director.plan,
        planning_s[-1],
        director.situation,
        verified=outcome is not None and outcome.is_verified,
        arrival=arrival,
        doing=director.watch.doing(link.now_s()),
    )


def _timed_planner(
    orders: Orders, has_driven: Callable[[], bool], planning_s: list[float]
) -> Callable[[Situation, Request], Plan]:
    """Return what makes a live run's plans, and notes how long each took; a mission that is driven in part is not begun anew."""

    def timed(situation: Situation, request: Request) -> Plan:
        if request.repairs and has_driven():
            raise SituationError(
                "the rest of the mission would no longer keep its clearance, and the vehicle was switched to HOLD: part of the mission "
                "is driven already, so that it is not begun anew"
            )
        planned, seconds = timed_plan(situation, request)
        if request.repairs and orders.drive:
            _check_drivable(planned)
        planning_s.append(seconds)
        return planned

    return timed


def _with_hint(trouble: BridgeError | MissionError) -> BridgeError | MissionError:
    """Return a director's trouble with the option that would help."""
    if trouble.details.get("outcome") == OutcomeKind.ACTIVE:
        trouble.details["advice"] = "--hold switches it to HOLD first"
    return trouble


def director_at_hand(director: Director, backups: BackupKeeper, link: Link | None) -> AtHand:
    """Return the vehicle of a director, as an interrupt finds it."""
    return AtHand(
        link=link,
        peer=lambda: director.peer,
        watch=lambda: director.watch,
        drives=lambda: director.drives_by_us,
        on_it=lambda: _mission_on_it(director, backups),
        changed=lambda: _has_changed(director),
    )


def _has_changed(director: Director) -> bool:
    """Return whether anything on the vehicle was changed, or may have been."""
    has_written = director.upload_outcome is not None or _is_writing(director)
    return has_written or director.drives_by_us or director.state is State.HOLDING


def _is_writing(director: Director) -> bool:
    upload = director.upload_under_way
    return upload is not None and upload.backup is not None and upload.pending_backup is None


def _mission_on_it(director: Director, backups: BackupKeeper) -> str:
    """Return which mission is on the vehicle, for people."""
    if _is_writing(director):
        return (
            "the vehicle may hold part of the old and part of the new mission: do not drive it. "
            f"The old one is kept in {backups.path}, `pbpp upload --restore` puts it back"
        )
    outcome = director.upload_outcome
    if outcome is None:
        return ""
    if outcome.is_verified and director.plan is not None:
        return f"the mission on it is the planned one ({len(outcome.found or outcome.backup or ())} items, verified)"
    return f"its mission: {held_text(outcome.held)}"


def _check_drivable(planned: Plan) -> None:
    """Refuse to drive what cannot be watched to its end, or what the drive model says nothing of.

    Raises
    ------
    SituationError
        The mission goes round without end, or in reverse.
    """
    course = follow_mission(Mission(planned.items), planned.start, home=planned.home)
    if course.is_endless:
        raise SituationError(
            "the mission goes round without end, so that --drive would never see it arrive; nothing was written: "
            "upload it (--upload), and start it yourself"
        )
    for seq, item in enumerate(planned.items, 1):
        if item.command == Command.DO_SET_REVERSE and item.params[0] == 1:
            raise SituationError(
                f"item {seq} has the vehicle drive in reverse, of which the drive model says nothing; nothing was written: "
                "upload it (--upload), and start it yourself",
                item=seq,
            )


class PlanMaker:
    """Makes the plans a director waits for, beside the link, so that messages go on meanwhile.

    Parameters
    ----------
    director : Director
        Who waits for them.
    planner : callable, optional
        Makes one; `missions.plan.plan` if not given.
    """

    def __init__(self, director: Director, planner: Callable[[Situation, Request], Plan] = make_plan) -> None:
        self._director = director
        self._planner = planner
        self._task: PlanTask | None = None  # in the making, also when nobody waits for it any more
        self._made: Future[Plan | MissionError] = Future()

    def longest_wait_s(self) -> float:
        """Give how long the shell may wait for messages before it looks here again."""
        return _IDLE_S if self._task is None else _BUSY_S

    def take(self) -> tuple[PlanTask, Plan | MissionError] | None:
        """Give what was made for the director and was not given yet; begin what it waits for."""
        task = self._task
        if task is not None and self._made.done():
            self._task = None
            made = self._made.result()  # also raises what nobody expected
            if task is self._director.pending_plan:
                return task, made
        if self._task is None:
            self._begin(self._director.pending_plan)
        return None

    def _begin(self, task: PlanTask | None) -> None:
        if task is None:
            return
        self._task, self._made = task, Future()
        # No executor: its threads are waited for when the program is interrupted.
        Thread(target=self._make, args=(task, self._made), name="planner", daemon=True).start()

    def _make(self, task: PlanTask, future: Future[Plan | MissionError]) -> None:
        try:
            future.set_result(task.made(self._planner))
        except BaseException as error:  # noqa: BLE001 - raised again where the result is taken
            future.set_exception(error)


class BackupKeeper:
    """Keeps a director's backups: stores the old mission before anything is written, and the note of an upload under way.

    Parameters
    ----------
    director : Director
        Whose missions.
    store : BackupStore, optional
        Where; the user's state folder if not given.

    Attributes
    ----------
    path : Path, optional
        Where the newest backup lies.
    """

    def __init__(self, director: Director, store: BackupStore | None = None) -> None:
        self._director = director
        self._store = store or BackupStore()
        self.path: Path | None = None
        self._was_interrupted: bool | None = None
        self._settled: object = None

    def step(self, now_s: float) -> list[str]:
        """Do what the director waits for; give warnings of earlier uploads that were interrupted, once."""
        director, peer = self._director, self._director.peer
        if peer is None:
            return []
        warnings = []
        if self._was_interrupted is None:
            warnings = interrupted_warnings(self._store, peer.system)
            self._was_interrupted = self._store.interrupted(peer.system, MissionType.MISSION) is not None
        if (old := director.pending_backup) is not None:
            self.path = self._store.begin(peer.system, MissionType.MISSION, old)
            director.backup_stored(now_s)
        outcome = director.upload_outcome
        if outcome is not None and outcome is not self._settled:
            self._settled = outcome
            is_settled = outcome.held in (Held.OLD, Held.FOREIGN) and not self._was_interrupted
            if outcome.held is Held.WANTED or is_settled:
                self._store.end(peer.system, MissionType.MISSION)
                self._was_interrupted = False
        return warnings

    def explained(self, trouble: BridgeError | MissionError) -> BridgeError | MissionError:
        """Give the director's trouble, after an upload with where the old mission lies."""
        outcome = self._director.upload_outcome
        if outcome is None or outcome.is_verified or not isinstance(trouble, BridgeError):
            return trouble
        return with_backup(trouble, "mission", self.path, is_old_there=outcome.held is Held.OLD)
