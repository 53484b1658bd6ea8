"""The part of the director that watches the vehicle drive our mission, until it has arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.drive_watch import DriveWatch
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import Cue, Notice, Signal, State
from mavlink_bridge.director.targets import Target
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.vehicle_watch import MISSION_COMPLETE
from missions.checking.from_here import on_way_home
from missions.checking.home_part import home_parts
from missions.errors import MissionError
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.takeover import Takeover
    from mavlink_bridge.mavlink.messages import Frame
    from missions.checking.home_part import HomePart
    from missions.planned import Plan

_ARMING_SHOWS_S = 1.5
"""So long after the start a heartbeat from before the arming may still come."""

_ENDLESS = (Command.NAV_LOITER_UNLIM, Command.NAV_RETURN_TO_LAUNCH)


class DriveSupervisor(Part):
    """Knows how the drive goes.

    Attributes
    ----------
    drive : DriveWatch or None
        The drive on our mission.
    holds_after_arrival : bool
        Whether it has arrived and our HOLD is under way.
    """

    def __init__(self, core: Core, halter: Halter) -> None:
        super().__init__(core)
        self._halter = halter
        self.drive: DriveWatch | None = None
        self.holds_after_arrival = False
        self._item_now = 1
        self._is_our_start = False  # the drive was begun by us, not by somebody else
        self._route: Plan | None = None  # what was planned, while a way home inside its mission is driven
        self._part: HomePart | None = None  # that way
        self._resumed_text = ""

    @property
    def deadline_s(self) -> float | None:
        """When progress is to be told."""
        return self.drive.progress_due_s if self.drive is not None else None

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Watch the drive."""
        message = frame.message
        if not self.core.is_from_vehicle(frame):
            return []
        if isinstance(message, m.MissionCurrent):
            self._note_item(message)
        if self.core.state is not State.DRIVING or self.drive is None:
            return []
        if isinstance(message, m.MissionCurrent) and self.drive.has_skipped(message, now_s):
            return self._stop_elsewhere(now_s)
        signals = self._follow_choice(now_s) if isinstance(message, m.MissionCurrent) else []
        self.drive.receive(frame, now_s)
        return [*signals, Cue.REACHED] if self.drive.has_arrived else signals

    def _follow_choice(self, now_s: float) -> list[Signal]:
        """Watch the way home inside the mission that was chosen, or the route again; it is the operator's choice, and told."""
        core = self.core
        assert core.plan is not None
        parts = home_parts(core.plan.items)
        part = next((one for one in parts if self._item_now in one.numbers), None)
        is_same = self._part is not None and self._item_now in self._part.numbers
        if is_same or part is self._part:
            return []
        route, self._part = self._route or core.plan, part
        self._route, core.plan = (route, route) if part is not None else (None, route)
        if part is not None:
            try:
                core.plan = on_way_home(route, part, core.situation, core.orders.request)
            except MissionError as error:
                core.voice.error(now_s, EventName.TROUBLE, error, dict(error.details))
            if core.plan is not route:
                core.voice.going_home(now_s, "chosen in the mission", f"item {part.item}", core.plan)
        core.target = Target(core.plan.targets[-1], TargetSource.TYPED)
        if self.drive is not None:
            self.drive.follow(core.plan, self._item_now)
        return [Notice.WAY_CHOSEN]

    def _stop_elsewhere(self, now_s: float) -> list[Signal]:
        """Return that a new route is wanted: the vehicle does not begin at the first item, and drives off the route."""
        core = self.core
        if not (self._is_our_start and core.orders.drive):
            return []
        trouble = OutcomeError(
            f"the mission was not begun at its first item, but at item {self._item_now}: HOLD, then a new route",
            item=self._item_now,
        )
        core.voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        return [Notice.ROUTE_WANTED]

    def has_ended(self, taken: Takeover, now_s: float) -> bool:
        """Return whether a change of mode is the end of our drive: some autopilots hold by themselves where their mission ends."""
        core = self.core
        may_be = core.state is State.DRIVING and taken.asker is None and not taken.shows_failsafe
        ends_so = core.autopilot.driving.ends_in_hold and taken.mode == core.modes.hold
        return may_be and ends_so and self.drive is not None and self.drive.is_at_end(now_s)

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Report how far the drive is."""
        if self.drive is not None and now_s >= self.drive.progress_due_s:
            self.drive.tell_progress(now_s)
        return []

    @property
    def item(self) -> int:
        """The mission item that the vehicle is on its way to."""
        if self.drive is not None:
            return self.drive.item
        return self._item_now if self.core.is_driving_ours else 1

    @property
    def is_our_drive(self) -> bool:
        """Whether the drive was begun by us."""
        return self.drive is not None and self._is_our_start

    def is_unarmed(self, now_s: float) -> bool:
        """Return whether our drive runs on a vehicle that never showed itself armed."""
        is_late = self.drive is not None and now_s > self.drive.begun_s + _ARMING_SHOWS_S
        return self.core.state is State.DRIVING and is_late and not self.core.situation.armed

    # Beginnings

    def begin(self, now_s: float) -> None:
        """Watch a drive that we have started."""
        self._is_our_start = True
        self._route = self._part = None
        self._watch(self._mode, now_s)

    def resume(self, text: str) -> Sequence[Signal]:
        """Return that our mission is being driven, though we did not start it just now, where there is a plan to watch it by."""
        self._resumed_text = text
        return [Cue.RESUMED] if self.core.plan is not None else []

    def resumed(self, now_s: float) -> None:
        """Watch a drive that we did not start just now."""
        self.core.operator.expect(self.core.modes.mission, set(), is_armed=True)
        self._is_our_start = False
        self._watch(self._resumed_text, now_s).item = self._item_now

    def adopt(self, now_s: float, *, is_ours: bool) -> None:
        """Watch a drive that an earlier run has begun; ours where it may be held at its end."""
        self._is_our_start = is_ours
        self._route = self._part = None
        self._watch(f"{self._mode}, as before the restart", now_s).join(self._item_now)
        self._follow_choice(now_s)  # made while no bridge ran

    def _note_item(self, message: m.MissionCurrent) -> None:
        """Remember the item that the vehicle drives to; once its mission is complete, the last one (ArduPilot tells 0 then)."""
        core = self.core
        if number := core.number_of(message.seq):
            self._item_now = number
        elif message.mission_state == MISSION_COMPLETE and core.ours is not None:
            self._item_now = len(core.ours) - 1

    @property
    def _mode(self) -> str:
        """The name of the mode that drives missions."""
        return self.core.modes.named(self.core.modes.mission)

    def _watch(self, text: str, now_s: float) -> DriveWatch:
        core = self.core
        assert core.plan is not None
        self.drive = DriveWatch(core.plan, core.voice, now_s, core.autopilot)
        count = len(core.plan.items) + int(core.autopilot.lists.form.has_home_item)
        core.voice.tell(now_s, EventName.DRIVING, text, count)
        return self.drive

    # Ends

    def arrived(self, now_s: float) -> Sequence[Signal]:
        """Report the arrival, and hold the vehicle where we have started it and it is not to go on."""
        assert self.drive is not None
        self.drive.tell_progress(now_s)
        holds_itself = self.core.autopilot.driving.ends_in_hold
        self.holds_after_arrival = self._is_our_start and not (self._goes_on_after_arrival or holds_itself)
        self.drive.tell_arrival(now_s, holds=self.holds_after_arrival)
        self.drive = None
        if not self.holds_after_arrival:
            return [Notice.DRIVE_ENDED]
        self._halter.command_hold(now_s)
        return []

    def held_after_arrival(self) -> Sequence[Signal]:
        """Return the end of a drive after its arrival, once HOLD was taken or was not."""
        if self._halter.is_hold_granted:
            return [Notice.DRIVE_ENDED]
        trouble = OutcomeError("arrived, but the vehicle did not switch to HOLD: it is still in AUTO")
        return [*self.core.give_up(trouble), Notice.DRIVE_ENDED]

    def stand_by(self) -> None:
        """Watch no drive while a route is made, and remember how the vehicle stands."""
        core = self.core
        self.drive = None
        if core.orders.drive:
            core.operator.expect(core.situation.mode, set(), is_armed=bool(core.situation.armed))

    @property
    def _goes_on_after_arrival(self) -> bool:
        """Whether the mission's end is something to do: to loiter, to return, or what MIS_DONE_BEHAVE says."""
        core = self.core
        assert core.plan is not None
        ends = any(item.command in _ENDLESS for item in core.plan.items)
        return ends or core.situation.parameters.get("MIS_DONE_BEHAVE", 0) != 0
