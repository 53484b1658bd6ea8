"""A live bridge behind the page: deeds go from the server's loop to the bridge's, what is shown goes back; neither waits for the other."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mavlink_bridge.console.deeds import Hold, Refusal, not_now
from mavlink_bridge.console.drawer import Drawer
from mavlink_bridge.console.view.driven import DriveLog, after_view
from mavlink_bridge.console.view.drives import DriveShown
from mavlink_bridge.console.view.events import event_view, text_view
from mavlink_bridge.console.view.fields import asked_view, fence_view, mission_view
from mavlink_bridge.console.view.instruments import Instruments
from mavlink_bridge.console.view.places import place, places
from mavlink_bridge.console.view.plans import no_route_view, plan_id, plan_view
from mavlink_bridge.console.view.sections import EventView, PlanView, TransferView
from mavlink_bridge.console.view.track import Track
from mavlink_bridge.director import EventName, State
from missions.errors import MissionError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mavlink_bridge.console.deeds import Deed
    from mavlink_bridge.console.hub import Hub
    from mavlink_bridge.console.list_writer import ListWriter
    from mavlink_bridge.console.live_desk import LiveDesk
    from mavlink_bridge.console.view.sections import AfterView
    from mavlink_bridge.console.wire import BackupView
    from mavlink_bridge.director import Director, Event
    from mavlink_bridge.mavlink.messages import Frame
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

SHOW_EVERY_S = 0.1
"""Ten times a second: quicker than positions come."""

_ANSWER_S = 5.0  # of a bridge that is well within 0.3 s; chosen, not measured


@dataclass(eq=False, slots=True)
class _Asked:
    """A deed on its way to the bridge, and who waits for its answer."""

    deed: Deed
    page: str
    answer: asyncio.Future[str]
    loop: asyncio.AbstractEventLoop


class LiveBackend:
    """What the server's loop speaks to.

    Parameters
    ----------
    director : Director
        Read only, and only what is whole at any moment; all deeds go through the bridge's own loop.
    """

    def __init__(self, director: Director) -> None:
        self._director = director
        self._asked: deque[_Asked] = deque()
        self.desk: LiveDesk | None = None
        self.log = DriveLog()

    def situation(self) -> Situation:
        """Return what is known now."""
        return self._director.situation

    def request(self) -> Request:
        """Return what is asked of plans."""
        return self._director.orders.request

    async def do(self, deed: Deed, page: str) -> str:
        """Have a deed done by the bridge's loop.

        Raises
        ------
        Refusal
            It is not done.
        """
        loop = asyncio.get_running_loop()
        asked = _Asked(deed, page, loop.create_future(), loop)
        self._asked.append(asked)
        try:
            return await asyncio.wait_for(asked.answer, _ANSWER_S)
        except TimeoutError:
            raise not_now(
                "the bridge does not answer: it is not known whether that was done",
                "use the transmitter, or the e-stop",
            ) from None

    def take_asked(self, now_s: float) -> None:
        """Do what pages asked for since the last call; for the bridge's loop."""
        batch = [self._asked.popleft() for _ in range(len(self._asked))]
        holds = [index for index, asked in enumerate(batch) if isinstance(asked.deed, Hold)]
        for index, asked in enumerate(batch):
            only_stops = asked.deed.only_stops
            if asked.answer.cancelled() and not only_stops:
                continue
            if self.desk is None:
                _tell(
                    asked,
                    asked.answer.set_exception,
                    not_now("pbpp has only just started: nothing was sent", "ask again"),
                )
                continue
            if not only_stops and holds and index < holds[-1]:
                _tell(
                    asked, asked.answer.set_exception, not_now("HOLD was pressed after it: nothing was sent")
                )
                continue
            try:
                text = self.desk.do(asked.deed, asked.page, now_s)
            except Refusal as refusal:
                _tell(asked, asked.answer.set_exception, refusal)
            except Exception as error:  # noqa: BLE001 - whatever it is, the vehicle must not lose its bridge by it
                _tell(asked, asked.answer.set_exception, not_now(_defect(error)))
            else:
                _tell(asked, asked.answer.set_result, text)

    def backups(self) -> Sequence[BackupView]:
        """Return the backups that may be put back."""
        return self.desk.backups() if self.desk is not None else ()

    def after(self) -> AfterView | None:
        """Return the newest drive against what was promised."""
        return after_view(self.log.so_far())

    def at(self, time_s: float) -> dict[str, Any] | None:  # noqa: ARG002 - as the others
        """Return None: this is not a replay."""
        return None


def _tell(asked: _Asked, put: Callable[[Any], None], value: Any) -> None:  # noqa: ANN401 - a text or a refusal
    def settle() -> None:
        if not asked.answer.done():
            put(value)

    with contextlib.suppress(RuntimeError):  # the server has ended
        asked.loop.call_soon_threadsafe(settle)


class LiveConsole:
    """What the bridge's loop shows and hears.

    Parameters
    ----------
    director : Director
    writer : ListWriter
        Writes lists beside it.
    backend : LiveBackend
        The other side.
    request : Request
        What the command line asks of plans: the vehicle's size among it.
    """

    # Many attributes: what was shown last, of each thing that is made only when it changes.

    def __init__(
        self, director: Director, writer: ListWriter, backend: LiveBackend, request: Request
    ) -> None:
        self._director = director
        self._writer = writer
        self._backend = backend
        self._own = request
        self._drawer = Drawer(self._tell_defect)
        self._instruments = Instruments()
        self._drive = DriveShown()
        self._track = Track()
        self._log = backend.log
        self._hub: Hub | None = None
        self._due_s = 0.0
        self._rows: list[Any] = []
        self._generation = 0
        self._events: list[EventView] = []
        self._grounds: object = None
        self._planned: object = None
        self._mission: object = None
        self._failed: object = None
        self._upload: TransferView | None = None
        self._listed: TransferView | None = None
        self._outcome = director.upload_outcome
        self._texts: list[tuple[str, str]] = []
        self.link_trouble = "not opened yet"

    def serve(self, hub: Hub, desk: LiveDesk) -> None:
        """Be shown on a hub's pages from now on."""
        self._hub, self._backend.desk = hub, desk

    def close(self) -> None:
        """Show nothing more."""
        self._drawer.close()

    # From the bridge

    def hear(self, frames: list[Frame], now_s: float) -> None:
        """Take frames, those of the vehicle."""
        peer = self._director.peer
        if peer is None:
            return
        for frame in frames:
            if (frame.system, frame.component) == (peer.system, peer.component):
                self._instruments.receive(frame, now_s)

    def step(self, now_s: float) -> None:
        """Do what pages asked for, and go on with what had to wait."""
        self._backend.take_asked(now_s)
        if self._backend.desk is None:
            return
        try:
            self._backend.desk.handle_timer(now_s)
        except Exception as error:  # noqa: BLE001 - as above
            self._backend.desk.forget_wishes()
            self._tell_defect(error)

    def tell(self, event: Event) -> None:
        """Take an event of the director."""
        if event.name is not EventName.PROGRESS:
            self._events.append(event_view(event))

    def note(self, text: str, severity: str) -> None:
        """Take what is no event of the director, with its severity."""
        self._texts.append((text, severity))

    def _tell_defect(self, error: Exception) -> None:
        self.note(_defect(error), "error")

    def link_opened(self) -> None:
        """Take notice that the link is open."""
        self.link_trouble = ""
        if self._backend.desk is not None:
            self._backend.desk.link_opened()

    def link_closed(self, why: str) -> None:
        """Take notice that the link is closed, and why."""
        self.link_trouble = why
        if self._backend.desk is not None:
            self._backend.desk.link_closed()

    def show(self, now_s: float) -> None:
        """Bring the pages up to date, ten times a second at most."""
        if now_s < self._due_s or self._hub is None:
            return
        self._due_s = now_s + SHOW_EVERY_S
        self._follow()
        self._draw_field()
        self._draw_plan()
        sections = self._sections(now_s)
        texts = [text_view(one, now_s) for one in self._instruments.take_texts()]
        notes = [
            EventView(id=0, time_s=now_s, name="console", severity=severity, text=text)
            for text, severity in self._texts
        ]
        events, self._events, self._texts = [*self._events, *texts, *notes], [], []
        rows, self._rows = self._rows, []
        anew = self._track.rows[:] if self._track.generation != self._generation else None
        self._generation = self._track.generation
        self._hub.post(sections, events, rows, anew)

    # What is shown

    def _sections(self, now_s: float) -> dict[str, Any]:
        """Return what is cheap to make: it is made each time."""
        director, desk = self._director, self._backend.desk
        situation = director.situation
        stands = plan_id(director.plan) if director.plan is not None else ""
        rally = situation.rally
        found = {
            "link": self._instruments.link(
                director.heard_s,
                now_s,
                is_lost=director.state is State.LOST,
                trouble=self.link_trouble,
            ),
            "vehicle": self._instruments.vehicle(situation, self._own.footprint),
            "drive": self._drive.view(
                director, stands, now_s, can_resume=desk is not None and desk.can_resume
            ),
            "rally": places(point.position for point in rally.value) if rally else (),
            "home": place(situation.home.value) if situation.home else None,
            "request": asked_view(director.orders.request),
            "upload": self._upload_view(now_s),
        }
        if desk is not None:
            found["hold"] = desk.hold_shown.view(director, now_s)
        key = (situation.mission, director.has_our_mission, self._instruments.current_seq)
        if key != self._mission:
            self._mission = key
            found["mission"] = mission_view(
                situation,
                matches_plan=director.has_our_mission,
                current_seq=self._instruments.current_seq,
            )
        return found

    def _upload_view(self, now_s: float) -> TransferView | None:
        """Return the newest transfer: the director's mission, or a list beside it; also one that began and ended between two looks."""
        director, listed, outcome = self._director, self._writer.view(), self._director.upload_outcome
        if listed is not None and listed is not self._listed:
            self._upload = self._listed = listed
        elif director.is_uploading:
            done, count = director.progress
            self._upload = TransferView(
                what="mission", state="running", done=done, count=count, text="uploading the mission"
            )
        elif outcome is not self._outcome or (self._upload is not None and self._upload.state == "running"):
            self._upload = self._ended_view(now_s)
        if not director.is_uploading:
            self._outcome = outcome
        return self._upload

    def _ended_view(self, now_s: float) -> TransferView:
        """Return how the director's upload ended; one that ended before anything was read has no outcome of its own."""
        outcome = self._director.upload_outcome
        if outcome is not None and outcome is not self._outcome and outcome.is_verified:
            count = len(outcome.found or outcome.backup or ())
            text = f"mission of {count} items verified on the vehicle"
            return TransferView(
                what="mission", state="verified", done=count, count=count, text=text, time_s=now_s
            )
        trouble = self._director.trouble
        text = str(trouble) if trouble is not None else "the upload failed"
        return TransferView(what="mission", state="failed", text=text, time_s=now_s)

    def _follow(self) -> None:
        """Follow the vehicle's way."""
        situation = self._director.situation
        pose = situation.pose
        if pose is None or pose.time_s is None:
            return
        row = self._track.add(pose.time_s, pose.value.position, pose.value.speed_mps, situation.mode)
        if row is not None:
            self._rows.append(row)
        self._log.follow(self._director, pose)

    def _draw_field(self) -> None:
        """Have the fence drawn where it, or what it comes to, has changed."""
        situation, request = self._director.situation, self._director.orders.request
        key = (situation.fence, situation.parameters, situation.home, situation.obstacles.known, request)
        if self._grounds is not None and key == self._grounds:
            return
        self._grounds = key
        where = "vehicle" if situation.fence is not None else "none"

        def make() -> None:
            self._post(fence=fence_view(situation, request, where))  # type: ignore[arg-type] # one of its words

        self._drawer.want("fence", make)

    def _draw_plan(self) -> None:
        """Have the director's plan drawn where it is another one, or why there is none."""
        director = self._director
        plan, situation, request = director.plan, director.situation, director.orders.request
        if director.state is State.PLANNING:
            if self._planned != "planning":
                self._planned = "planning"
                self._drawer.want("plan", lambda: self._post(plan=_planning(request)))
            return
        if plan is not None:
            if plan is not self._planned:
                self._planned = plan
                self._drawer.want("plan", lambda: self._make_plan(plan, situation, request))
            return
        trouble = director.trouble
        if isinstance(trouble, MissionError) and trouble is not self._failed:
            self._failed = self._planned = trouble
            self._drawer.want("plan", lambda: self._make_no_route(trouble, situation, request))
        elif self._planned not in (None, trouble):
            self._planned = None
            self._drawer.want("plan", lambda: self._post(plan=None))

    def _make_plan(self, plan: Plan, situation: Situation, request: Request) -> None:
        self._post(plan=replace(plan_view(plan, situation, request), by="director"))

    def _make_no_route(self, trouble: MissionError, situation: Situation, request: Request) -> None:
        self._post(plan=replace(no_route_view(trouble, situation, request), by="director"))

    def _post(self, **sections: Any) -> None:  # noqa: ANN401 - whichever
        if self._hub is not None:
            self._hub.post(sections)


def _defect(error: Exception) -> str:
    return f"{type(error).__name__}: {error}. This is a bug in pbpp"


def _planning(request: Request) -> PlanView:
    return PlanView(id="planning", state="planning", by="director", request=asked_view(request))
