"""Planning on a live link: the shell around the director, with its progress bars, backups and plans."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, Generic, TypeVar

from mavlink_bridge.backup.drive_note import DriveNotes
from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.backup.upload_note import UploadNote
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.drawing import progress_bar
from mavlink_bridge.cli.interrupting import AtHand, interruptible
from mavlink_bridge.cli.link_notes import tell_echoes
from mavlink_bridge.cli.restoring import interrupted_warnings
from mavlink_bridge.cli.session import signing_of
from mavlink_bridge.cli.timed_plan import timed_plan
from mavlink_bridge.console.view.drives import STATE_TEXTS
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.plan_task import HomeWays, PlanTask, WaysTask
from mavlink_bridge.errors import BackupError, BridgeError, LinkError, VehicleInUseError
from mavlink_bridge.link import ONE_SHOT_IDENTITY, open_link, parse_connection
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.outcomes import Writing, ends_in_words, held_text
from mavlink_bridge.protocol.vehicle_watch import Doing
from mavlink_bridge.protocol.verified_upload import Held
from missions.checking.execution import follow_mission
from missions.errors import MissionError, SituationError
from missions.items import Command
from missions.planned import Plan
from missions.planning.plan import plan as make_plan
from missions.situation import Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.cli.drawing import Shown
    from mavlink_bridge.link import Link
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload
    from missions.items import MissionItem
    from missions.request import Request

TaskT = TypeVar("TaskT")
MadeT = TypeVar("MadeT")

# Between two looks at the display, and at a plan in the making; chosen, not measured.
_IDLE_S, _BUSY_S = 0.25, 0.02
_NOT_KNOWN_YET = frozenset({State.LISTENING, State.LEARNING, State.LOST})
"""States in which it is not yet known which vehicle it is."""


@dataclass(frozen=True, eq=False)
class LiveResult:
    """What came of a live run.

    ``arrival`` holds the data of the director's event, None where nothing was driven; the backup is None where nothing was written.
    """

    plan: Plan
    planning_s: float
    situation: Situation
    verified: bool
    backup: Path | None
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
    described: Situation,
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
    identity = orders.identity or ONE_SHOT_IDENTITY
    with open_link(connection, identity, signing=signing_of(key_file)) as link:
        return conduct(
            link,
            orders,
            described,
            connection=str(parse_connection(connection)),
            quiet=quiet,
            on_plan=on_plan,
        )


def conduct(
    link: Link,
    orders: Orders,
    situation: Situation | None = None,
    *,
    quiet: bool,
    connection: str = "",
    on_frames: Callable[[list[Frame]], None] | None = None,
    on_plan: PlanTaker = _take_none,
    is_real: bool = True,
) -> LiveResult:
    """Run a director on a link until its single job is done, and keep backups for it.

    Where the vehicle is real, an interrupt ends with what it does, and may ask whether to stop it.

    Raises
    ------
    BridgeError, MissionError
        The director's trouble; or what ended the run, with what may be on the vehicle.
    """
    run = _Run(Director(replace(orders, once=True), situation), link, connection, on_plan)
    director, backups = run.director, run.backups
    with progress_bar(quiet=quiet) as show:
        at_hand = replace(director_at_hand(director, link), aside=show.aside)
        with (
            interruptible(at_hand) if is_real else nullcontext(),
            ends_in_words(lambda: backups.writing, last_words=backups.release),
        ):
            link.run(
                director,
                on_frames=on_frames,
                on_step=partial(run.step, show),
                longest_wait_s=run.plans.longest_wait_s,
            )
    if director.trouble is not None or director.plan is None:
        raise director.trouble or LinkError("no plan was made")
    outcome = director.upload_outcome
    return LiveResult(
        director.plan,
        run.planning_s,
        director.situation,
        verified=outcome is not None and outcome.is_verified,
        backup=backups.path,
        arrival=run.arrival,
        doing=director.watch.doing(link.now_s()),
    )


class _Run:
    """What the shell does around the director of a single job."""

    def __init__(self, director: Director, link: Link, connection: str, on_plan: PlanTaker) -> None:
        self.director = director
        self.plans = PlanMaker(director, self._plan)
        self.backups = BackupKeeper(director, connection)
        self.planning_s = 0.0
        self.arrival: Mapping[str, object] | None = None
        self._link = link
        self._on_plan = on_plan
        self._taken: Plan | None = None
        self._has_driven = False

    def step(self, show: Shown) -> None:
        """Do what the director waits for, and report what it did."""
        director, link = self.director, self._link
        self._has_driven = self._has_driven or director.state is State.DRIVING
        show(STATE_TEXTS[director.state], *director.progress)
        warn(self.backups.step(link.now_s()))
        if (made := self.plans.take()) is not None:
            director.plan_made(*made, link.now_s())
        if director.plan is not None and director.plan is not self._taken:
            self._taken = director.plan
            with show.aside():  # before anything of it is sent
                self._on_plan(self._taken, self.planning_s, director.situation)
        for event in director.take_events():
            self.arrival = event.data if event.name is EventName.ARRIVED else self.arrival
            if event.name is EventName.IDENTITY_CLASH:
                warn([event.text])
        tell_echoes(link)

    def _plan(self, situation: Situation, request: Request, *, should_stop: Callable[[], bool]) -> Plan:
        """Make a plan, and note how long it took; a mission that is driven in part is not begun anew."""
        if request.repairs and self._has_driven:
            raise SituationError(
                "the rest of the mission would no longer keep its clearance, so the vehicle was switched to HOLD; "
                "a partly driven mission is not restarted"
            )
        planned, self.planning_s = timed_plan(situation, request, should_stop=should_stop)
        if request.repairs and self.director.orders.drive:
            _check_drivable(planned)
        return planned


def director_at_hand(director: Director, link: Link | None) -> AtHand:
    """Return the vehicle of a director, as an interrupt finds it."""
    return AtHand(
        link=link,
        peer=lambda: director.peer,
        watch=lambda: director.watch,
        drives=lambda: director.drives_by_us,
        on_it=lambda: _mission_on_it(director),
        changed=lambda: _has_changed(director),
    )


def _has_changed(director: Director) -> bool:
    """Return whether anything on the vehicle was changed, or may have been."""
    has_written = director.upload is not None and director.upload.has_written
    return has_written or director.drives_by_us or director.state is State.HOLDING


def _mission_on_it(director: Director) -> str:
    """Return which mission is on the vehicle, for people; empty while one is uploaded, as `ends_in_words` reports what that left."""
    outcome = director.upload_outcome
    if outcome is None or director.is_uploading:
        return ""
    if outcome.is_verified and director.plan is not None:
        return f"the mission on it is the planned one ({len(outcome.found or outcome.backup or ())} items, verified)"
    return f"its mission: {held_text(outcome.held)}"


def _check_drivable(planned: Plan) -> None:
    """Refuse to drive what cannot be watched to its end, or what the drive model does not cover.

    Raises
    ------
    SituationError
        The mission goes round without end, or in reverse.
    """
    course = follow_mission(Mission(planned.items), planned.start, home=planned.home)
    if course.is_endless:
        raise SituationError(
            "the mission repeats forever, so --drive would never see it arrive; nothing was written: "
            "upload it without --drive, and start it yourself"
        )
    for seq, item in enumerate(planned.items, 1):
        if item.command == Command.DO_SET_REVERSE and item.params[0] == 1:
            raise SituationError(
                f"item {seq} makes the vehicle drive in reverse, which the drive model does not cover; nothing was written: "
                "upload it without --drive, and start it yourself",
                item=seq,
            )


class _Beside(Generic[TaskT, MadeT]):
    """Does the tasks that a director waits for, one at a time, in a thread beside the link, so that messages go on meanwhile.

    Parameters
    ----------
    waiting : callable
        Returns the task that is waited for, None where none is.
    make : callable
        Does one.
    """

    def __init__(self, waiting: Callable[[], TaskT | None], make: Callable[[TaskT], MadeT]) -> None:
        self._waiting = waiting
        self._make = make
        self._task: TaskT | None = None  # under way, also when nobody waits for it any more
        self._made: Future[MadeT] = Future()

    def longest_wait_s(self) -> float:
        """Return how long the shell may wait for messages before it calls again."""
        return _IDLE_S if self._task is None else _BUSY_S

    def take(self) -> tuple[TaskT, MadeT] | None:
        """Return what was made for the director since the last call; begin what it waits for."""
        task = self._task
        if task is not None and self._made.done():
            self._task = None
            made = self._made.result()  # also raises what nobody expected
            if task is self._waiting():
                return task, made
        if self._task is None:
            self._begin(self._waiting())
        return None

    def _begin(self, task: TaskT | None) -> None:
        if task is None:
            return
        self._task, self._made = task, Future()
        # No executor: its threads are waited for when the program is interrupted.
        Thread(target=self._run, args=(task, self._made), name="planner", daemon=True).start()

    def _run(self, task: TaskT, future: Future[MadeT]) -> None:
        try:
            future.set_result(self._make(task))
        except BaseException as error:  # noqa: BLE001 - raised again where the result is taken
            future.set_exception(error)


class PlanMaker(_Beside[PlanTask, Plan | MissionError]):
    """Makes the plans a director waits for.

    Parameters
    ----------
    director : Director
        Who waits for them.
    planner : callable, optional
        Makes one; `missions.planning.plan.plan` if not given.
    """

    def __init__(self, director: Director, planner: Callable[..., Plan] = make_plan) -> None:
        super().__init__(lambda: director.pending_plan, lambda task: task.made(planner))


class WaysMaker(_Beside[WaysTask, HomeWays | MissionError]):
    """Makes the ways home that a director keeps; no plan waits for them."""

    def __init__(self, director: Director) -> None:
        super().__init__(lambda: director.pending_ways, lambda task: task.made())


class BackupKeeper:
    """Keeps a director's backups: stores the old mission before anything is written, and the note of an upload under way.

    While an upload runs the vehicle is locked against other processes of this computer.

    Parameters
    ----------
    director : Director
        Whose missions.
    connection : str
        How the vehicle is connected.
    store : BackupStore, optional
        Where; the user's state folder if not given.
    journal : callable, optional
        Told of each call of the director before it is made: its name, time and text.
    """

    def __init__(
        self,
        director: Director,
        connection: str = "",
        store: BackupStore | None = None,
        journal: Callable[[str, float, str], None] = lambda _name, _now_s, _text: None,
    ) -> None:
        self._director = director
        self._connection = connection
        self._store = store or BackupStore()
        self._journal = journal
        self._has_warned = False
        self._guarded: VerifiedUpload | None = None
        self._lock: VehicleLock | None = None
        self._hindrance: BridgeError | None = None
        self._note: UploadNote | None = None
        self._settled: object = None
        self._notes = DriveNotes(self._store.folder)
        self._noted: DriveNote | None = None
        self._is_note_known = False  # of what an earlier run has left

    @property
    def path(self) -> Path | None:
        """The backup that the newest upload has made; None where it has made none."""
        return self._note.backup if self._note is not None else None

    @property
    def writing(self) -> Writing | None:
        """The newest upload; None before the first."""
        upload = self._director.upload
        return Writing("mission", upload, self.path) if upload is not None else None

    def step(self, now_s: float) -> list[str]:
        """Do what the director waits for; return warnings of earlier uploads that were interrupted, once."""
        director, vehicle = self._director, self.vehicle()
        if vehicle is None:
            return []
        if director.is_uploading and director.upload is not self._guarded:
            self._guard(vehicle)
        if (old := director.pending_backup) is not None:
            self._keep(old, now_s)
        outcome = director.upload_outcome
        if outcome is not None and outcome is not self._settled:
            self._settled = outcome
            if self._note is not None:
                self._note.settle(outcome.held)
        if not director.is_uploading:
            self.release()
        if director.state in _NOT_KNOWN_YET:
            return []
        self._note_drive(vehicle, now_s)
        if self._has_warned:
            return []
        self._has_warned = True
        return interrupted_warnings(self._store, vehicle)

    def release(self) -> None:
        """Let other processes write to the vehicle; a note of an upload that has written nothing goes with it."""
        if self._lock is None:
            return
        if self._note is not None and self._guarded is not None and not self._guarded.has_written:
            self._note.settle(Held.OLD)
        self._lock.free()
        self._lock = None

    def _note_drive(self, vehicle: VehicleMark, now_s: float) -> None:
        """Have on disk the note of the drive that the director has begun, and no other; who may not drive leaves it alone."""
        director = self._director
        note = director.drive_note
        if not director.orders.drive or (self._is_note_known and note is self._noted):
            return
        self._is_note_known, self._noted = True, note
        if note is None:
            self._notes.end(vehicle)
            return
        try:
            self._notes.keep(replace(note, vehicle=vehicle))
        except BackupError as error:
            self._journal("note_failed", now_s, str(error))
            director.note_failed(error, now_s)
        else:
            self._journal("note_stored", now_s, "")
            director.note_stored()

    def vehicle(self) -> VehicleMark | None:
        """Return which vehicle it is; None before it was found."""
        peer = self._director.peer
        if peer is None:
            return None
        return VehicleMark(
            peer.system, self._director.vehicle_uid, self._connection, int(peer.autopilot.autopilot)
        )

    def _guard(self, vehicle: VehicleMark) -> None:
        """Lock the vehicle before its old mission is read: a mission that somebody else was writing meanwhile is no backup."""
        self.release()
        self._guarded, self._hindrance, self._note = self._director.upload, None, None
        self._lock = VehicleLock(vehicle)
        try:
            if holder := self._lock.take():
                self._hindrance = holder.error(vehicle)
            else:
                self._note = UploadNote(self._store, vehicle, MissionType.MISSION)
        except BackupError as error:
            self._hindrance = error

    def _keep(self, old: tuple[MissionItem, ...], now_s: float) -> None:
        try:
            if self._hindrance is not None:
                raise self._hindrance
            assert self._note is not None
            self._note.begin(old)
        except BridgeError as error:
            name = "in_use" if isinstance(error, VehicleInUseError) else "backup_failed"
            self._journal(name, now_s, str(error))
            self._director.backup_failed(error, now_s)
        else:
            self._journal("backup_stored", now_s, str(self.path))
            self._director.backup_stored(now_s, self.path)
