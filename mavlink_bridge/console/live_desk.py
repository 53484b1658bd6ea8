"""The deeds of pages done on a director: what is refused now, what follows later, and what is shown of it. Clock-free, without threads.

The director plans by itself, from where the vehicle is. What a page wants uploaded is so made again; it is confirmed unseen only where it is the
route that the page showed (`is_same_route`). So nothing that nobody has looked at is written, and everything written is promised.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from mavlink_bridge.backup.vehicle_mark import Kinship
from mavlink_bridge.console import deeds
from mavlink_bridge.console.answers import field_of
from mavlink_bridge.console.deeds import Refusal, not_now
from mavlink_bridge.console.view.drives import NO_LINK, HoldShown
from mavlink_bridge.console.view.plans import is_same_route, plan_id
from mavlink_bridge.console.wire import BackupView, Problem
from mavlink_bridge.director import AT_WORK, ON_VEHICLE, State
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.replay.journal import request_to_text
from missions.errors import MissionError
from missions.fence import fence_to_items

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.backup.store import BackupStore
    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from mavlink_bridge.console.answers import Looked
    from mavlink_bridge.console.deeds import Deed
    from mavlink_bridge.console.list_writer import ListWriter
    from mavlink_bridge.director import Director
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request, Tour

_LIST_PATIENCE_S = 15.0
"""So long a list waits for the director to have asked what it asks the vehicle just now; chosen, not measured."""

_GO_ON_S = 60.0
"""So long after "Go on" the vehicle may still begin to drive: whoever pressed it may look elsewhere by then; chosen, not measured."""

_MAKING = frozenset({State.HOLDING, State.PLANNING, State.LISTENING, State.LEARNING})
"""States in which the plan that is wanted may still come."""


class CallNoter(Protocol):
    """Notes a call of the director before it is made."""

    def __call__(self, name: str, now_s: float, target: object = None, text: str = "") -> None:
        """Take the call's name, time, target and text."""
        ...


@dataclass(slots=True)
class _Wanted:
    """What a page wants done with the director's next plan."""

    like: Plan | None  # confirmed where it is this route; None whatever it is
    until_s: float | None  # drives at once, until then; None: it is uploaded only
    page: str

    @property
    def drives(self) -> bool:
        """Whether it is driven as well."""
        return self.until_s is not None


@dataclass(slots=True)
class _List:
    """A list that waits to be written."""

    kind: MissionType
    items: tuple[MissionItem, ...]
    until_s: float
    page: str
    restored: Any = None


class LiveDesk:
    """Does deeds.

    Parameters
    ----------
    director : Director
        On which.
    writer : ListWriter
        Writes lists beside it.
    store : BackupStore
        What was on vehicles before.
    vehicle : callable
        Returns which vehicle it is; None before it was found.
    journal : CallNoter
        Notes calls.
    tell : callable
        Tells all pages something: a text and its severity.
    """

    def __init__(
        self,
        director: Director,
        writer: ListWriter,
        store: BackupStore,
        vehicle: Callable[[], VehicleMark | None],
        journal: CallNoter,
        tell: Callable[[str, str], None],
    ) -> None:
        self._director = director
        self._writer = writer
        self._store = store
        self._vehicle = vehicle
        self._journal = journal
        self._tell = tell
        self._wanted: _Wanted | None = None
        self._list: _List | None = None
        self._word_of = ""  # the page that has given the word to drive last
        self._driven: Request | None = None
        self._is_linked = True
        self.hold_shown = HoldShown()
        self._deeds: dict[type[Deed], Callable[[Any, str, float], str]] = {
            deeds.Hold: self._hold,
            deeds.TakeTargets: self._take_targets,
            deeds.UploadPlan: self._upload_plan,
            deeds.UploadFence: self._upload_fence,
            deeds.Restore: self._restore,
            deeds.Start: self._start,
            deeds.Resume: self._resume,
            deeds.Blocked: self._blocked,
            deeds.ClearBlocked: self._clear_blocked,
            deeds.TakeControl: self._take_control,
            deeds.GiveControl: self._give_control,
        }

    @property
    def can_resume(self) -> bool:
        """Whether there is a target to go on to."""
        return self._driven == self._director.orders.request and self._director.state not in AT_WORK

    def do(self, deed: Deed, page: str, now_s: float) -> str:
        """Do a permitted deed for a page; return what was done, for people.

        Raises
        ------
        Refusal
            Not as things are.
        """
        if deed.needs_control:
            self._drop_wishes(lambda one: one != page, f"{page} has control now", now_s)
        return self._deeds[type(deed)](deed, page, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Go on with what had to wait: for the director's plan, or for room on the link."""
        self._note_drive()
        self._go_on_with_plan(now_s)
        self._go_on_with_list(now_s)

    def link_opened(self) -> None:
        """Take notice that the link is open."""
        self._is_linked = True

    def link_closed(self) -> None:
        """Take notice that the link is gone: nothing that was wanted on it is done later."""
        self._is_linked = False
        self.forget_wishes()
        self._writer.drop()

    def forget_wishes(self) -> None:
        """Do nothing any more that waits."""
        self._wanted = self._list = None

    # Control

    def _take_control(self, _deed: deeds.TakeControl, _page: str, _now_s: float) -> str:
        return ""

    def _give_control(self, _deed: deeds.GiveControl, page: str, now_s: float) -> str:
        self._drop_wishes(lambda one: one == page, f"{page} has given up control", now_s)
        return ""

    def _drop_wishes(self, is_meant: Callable[[str], bool], why: str, now_s: float) -> None:
        """Do nothing any more that pages wait for which have control no more. An upload or a drive that has begun goes on."""
        if self._wanted is not None and is_meant(self._wanted.page):
            what = "drive on" if self._wanted.drives else "upload"
            self._tell(f"{why}: the {what} that {self._wanted.page} waited for is cancelled", "warning")
            self._wanted = None
        if self._list is not None and is_meant(self._list.page):
            self._tell(f"{why}: the upload that {self._list.page} waited for is cancelled", "warning")
            self._list = None
        if self._word_of and is_meant(self._word_of):
            if self._director.awaits_start:
                self._tell(f"{why}: the start that {self._word_of} waited for is cancelled", "warning")
            self._journal("withhold", now_s)
            self._director.withhold_drive(now_s)
            self._word_of = ""

    # Driving

    def _hold(self, _deed: deeds.Hold, page: str, now_s: float) -> str:
        if self._director.peer is None:
            raise not_now("no vehicle was heard yet: HOLD was not sent")
        self.forget_wishes()
        self.hold_shown.ask(page, now_s, is_linked=self._is_linked)
        reason = f"asked for by {page} of the console"
        self._journal("hold", now_s, text=reason)
        self._director.hold(reason, now_s)
        return "HOLD is being sent" if self._is_linked else NO_LINK

    def _take_targets(self, deed: deeds.TakeTargets, _page: str, now_s: float) -> str:
        if not deed.request.targets:
            raise Refusal(Problem(kind="invalid", message="expected at least one target"), 422)
        self._check_free()
        self._wanted = None
        self._request(deed.request, now_s)
        return "the bridge plans"

    def _request(self, request: Tour, now_s: float) -> None:
        self._journal("request", now_s, text=request_to_text(request))
        self._director.take_request(request, now_s)

    def _start(self, deed: deeds.Start, page: str, now_s: float) -> str:
        director = self._director
        if director.state not in ON_VEHICLE or director.plan is None:
            raise not_now(f"nothing to start: {director.state.replace('_', ' ')}", "upload a plan first")
        if plan_id(director.plan) != deed.plan_id:
            raise not_now(
                "the plan on the vehicle is not the one that you see", "look at it, and start again"
            )
        self._check_free()
        self._tell(f"{page} starts the drive", "notice")
        self._start_drive(page, now_s)
        return "starting"

    def _start_drive(self, page: str, now_s: float) -> None:
        self._word_of = page
        self._journal("drive", now_s)
        self._director.start_drive(now_s)

    def _resume(self, _deed: deeds.Resume, page: str, now_s: float) -> str:
        request = self._driven
        if request is None:
            raise not_now(
                "there is no target to continue to", "choose a target, upload its plan and start it"
            )
        if request != self._director.orders.request:
            raise not_now(
                "another target was requested since the drive", "look at its plan, upload and start it"
            )
        if self._director.state in AT_WORK:
            raise not_now(f"the bridge is busy: {self._director.state}")
        self._check_free()
        self._wanted = _Wanted(None, now_s + _GO_ON_S, page)
        self._tell(f"{page} continues to the last target", "notice")
        self._request(request, now_s)  # type: ignore[arg-type] # a Tour: it has targets
        return "planning the way from here"

    def _note_drive(self) -> None:
        """Remember what is driven to, so that a person can go on to it after a HOLD: nothing else that was only asked for."""
        own = self._director.orders.request
        if self._director.state is State.DRIVING and own.targets:
            self._driven = own
        elif self._director.state is State.ARRIVED:
            self._driven = None

    # Writing

    def _upload_plan(self, deed: deeds.UploadPlan, page: str, now_s: float) -> str:
        self._check_free()
        director = self._director
        stands = plan_id(director.plan) if director.plan is not None else ""
        if director.awaits_confirmation and stands == deed.plan_id:
            self._journal("confirm", now_s)
            director.confirm(now_s)
            return "uploading"
        looked = deed.looked
        if looked is None or looked.plan is None:
            raise Refusal(
                Problem(kind="not_found", message="that plan no longer exists", advice="plan again"), 404
            )
        if looked.request is None:
            return self._upload_mission(looked, page, now_s)
        self._wanted = _Wanted(looked.plan, None, page)
        self._request(looked.request, now_s)
        return "planning again from where the rover is now, then uploading"

    def _upload_mission(self, looked: Looked, page: str, now_s: float) -> str:
        """Write a mission that was checked or repaired: a file's, or waypoints of the page."""
        peer = self._director.peer
        assert looked.plan is not None
        if peer is None:
            raise not_now("the vehicle is not known yet")
        if not looked.view.is_promised:
            raise not_now("this mission does not keep its clearance: it is not written", "repair it first")
        if looked.field != field_of(self._director.situation):
            raise not_now(
                "this mission was checked against another fence, home or parameters than the vehicle's now: it is not written",
                "upload the drawn fence first, or check it again",
            )
        home = looked.plan.home or looked.plan.start
        return self._queue(
            MissionType.MISSION, peer.autopilot.lists.form.mission_of(looked.items, home), page, now_s
        )

    def _upload_fence(self, deed: deeds.UploadFence, page: str, now_s: float) -> str:
        return self._queue(MissionType.FENCE, fence_to_items(deed.fence), page, now_s)

    def _restore(self, deed: deeds.Restore, page: str, now_s: float) -> str:
        vehicle = self._vehicle()
        try:
            backup = self._store.named(deed.name)
        except BridgeError as error:
            raise Refusal(Problem(kind="not_found", message=str(error)), 404) from None
        if vehicle is None or vehicle.kinship(backup.vehicle) is not Kinship.SAME:
            raise not_now(
                f"that backup is of {backup.vehicle}, which may not be this vehicle",
                f"on the command line: pbpp upload --restore {backup.path} --other-vehicle",
            )
        return self._queue(backup.mission_type, backup.items, page, now_s, backup.path)

    def _queue(
        self,
        kind: MissionType,
        items: tuple[MissionItem, ...],
        page: str,
        now_s: float,
        restored: Any = None,  # noqa: ANN401 - a path or None
    ) -> str:
        self._check_free()
        director = self._director
        if self._vehicle() is None or director.state in (State.LISTENING, State.LEARNING, State.LOST):
            raise not_now("the vehicle is not known yet")
        if director.state in AT_WORK or director.state is State.PLANNING:
            raise not_now(f"the bridge is busy: {director.state}", "HOLD first, or wait")
        self._list = _List(kind, items, now_s + _LIST_PATIENCE_S, page, restored)
        self._go_on_with_list(now_s)
        return f"uploading the {kind.name.lower()}"

    def _check_free(self) -> None:
        """Refuse while a list is being written: one after the other."""
        if self._writer.is_busy or self._list is not None:
            raise not_now("an upload is under way", "wait for it to end")

    def _go_on_with_list(self, now_s: float) -> None:
        """Begin to write a list once the director asks the vehicle nothing; have everything read again once one was written."""
        waiting = self._list
        if waiting is not None and not self._director.is_transferring:
            self._list = None
            vehicle = self._vehicle()
            if vehicle is None:
                return
            try:
                self._writer.begin(waiting.kind, waiting.items, vehicle, now_s, waiting.restored)
            except (BridgeError, MissionError) as error:
                self._tell(f"not uploaded: {error}", "error")
        elif waiting is not None and now_s > waiting.until_s:
            self._list = None
            self._tell("not uploaded: the link is busy with something else", "error")
        if (ended := self._writer.take_ended()) is not None:
            self._tell(ended.text, "info" if ended.state == "verified" else "error")
            self._journal("suspect", now_s)
            self._director.suspect_lists()

    def _go_on_with_plan(self, now_s: float) -> None:
        """Confirm the director's plan where it is what a page wants."""
        wanted, director = self._wanted, self._director
        if wanted is None:
            return
        if wanted.until_s is not None and now_s > wanted.until_s:
            self._wanted = None
            self._tell(
                "planning took too long to continue without asking: look at the plan, upload and start it",
                "warning",
            )
            return
        if not director.awaits_confirmation:
            if director.state not in _MAKING:
                self._wanted = None
            return
        self._wanted = None
        plan = director.plan
        assert plan is not None
        if wanted.like is not None and not is_same_route(wanted.like, plan):
            self._tell(
                "the plan has changed (the vehicle or its fence has moved): nothing was uploaded; look at it, and upload it",
                "warning",
            )
            return
        self._journal("confirm", now_s)
        director.confirm(now_s)
        if wanted.drives:
            self._start_drive(wanted.page, now_s)

    # Obstacles

    def _blocked(self, deed: deeds.Blocked, page: str, now_s: float) -> str:
        if deed.position is None and self._director.situation.pose is None:
            raise not_now("the vehicle's position is unknown")
        self._tell(f"{page} reports an obstacle; this protects no person", "notice")
        self._journal("obstacle", now_s, deed.position, str(deed.radius_m))
        self._director.take_obstacle(deed.position, deed.radius_m, now_s)
        return "planning around it"

    def _clear_blocked(self, _deed: deeds.ClearBlocked, _page: str, now_s: float) -> str:
        self._journal("clear", now_s)
        self._director.clear_obstacles(now_s)
        return "obstacles forgotten"

    # Backups

    def backups(self) -> tuple[BackupView, ...]:
        """Return what was on this vehicle, and others of its system id, before."""
        vehicle = self._vehicle()
        if vehicle is None:
            return ()
        return tuple(
            BackupView(
                name=one.path.name,
                what=one.mission_type.name.lower(),
                items=len(one.items),
                time_s=one.time.timestamp(),
                vehicle=str(one.vehicle),
                is_this_vehicle=vehicle.kinship(one.vehicle) is Kinship.SAME,
            )
            for one in self._store.kept(vehicle.system)
        )
