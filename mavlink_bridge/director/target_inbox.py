"""The part of the director that takes targets, wherever they come from, answers who asks, and keeps those that come at an inconvenient time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.addressed import is_command_to
from mavlink_bridge.director.answers import Answers
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import Cue, Notice, Signal, State
from mavlink_bridge.director.targets import Target, TargetWatch, is_same_place
from mavlink_bridge.errors import RefusedError
from mavlink_bridge.mavlink import messages as m
from missions.checking.recheck import straight_line
from missions.items import Command, last_place

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.messages import Frame
    from missions.geo import LatLon

_NOT_NOW = frozenset(
    {State.LISTENING, State.LEARNING, State.LOST, State.UPLOADING, State.WITHDRAWING, State.CLASHING}
)
"""States that have to end before another target is gone into."""


class TargetInbox(Part):
    """Holds the newest target that came, and one that waits.

    Attributes
    ----------
    waiting : Target or None
        What came at an inconvenient time.
    answers : Answers
        What is owed to who asked.
    """

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        self._heard = TargetWatch(core.orders.target_sources)
        self.answers = Answers(core.send)
        self._came: Target | None = None
        self.waiting: Target | None = None
        self._listed: dict[TargetSource, LatLon | None] = {}

    def take_typed(self, position: LatLon, now_s: float) -> Sequence[Signal]:
        """Take a target that was typed."""
        self._heard.take(position, now_s)
        return self.take(Target(position, TargetSource.TYPED))

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Take a frame; where identities clash, a click counts for nothing."""
        core = self.core
        if core.identity is None or core.state in clash.CLASHES:
            return []
        target = self._heard.look(frame, core.before, core.situation, now_s, core.identity, core.modes)
        is_to_us = is_command_to(frame, core.identity, core.situation.system)
        if target is None:
            if is_to_us:
                self._refuse_command(frame, now_s)
            return []
        if not target.is_again:
            return self.take(target)
        if is_to_us:
            self.answers.repeat(frame)
            return []
        self._came = target
        return [Notice.TARGET_AGAIN]

    def let_go(self) -> None:
        """Take notice that nothing is wanted any more."""
        self._heard.let_go()
        self.answers.settle(m.MavResult.CANCELLED)

    @property
    def came(self) -> Target:
        """The newest target that came."""
        assert self._came is not None
        return self._came

    def take(self, target: Target) -> Sequence[Signal]:
        """Return that a target came; after a clash of identities one that is typed ends that."""
        self._came = target
        return [Cue.TYPED, Notice.TARGET_CAME]

    def take_call(self, target: Target) -> Sequence[Signal]:
        """Return that the vehicle is called home; that ends no clash of identities."""
        self._came = target
        return [Notice.TARGET_CAME]

    def go_into(self, now_s: float) -> Sequence[Signal]:
        """Go into the target that came, or let it wait."""
        core, target = self.core, self.came
        if not target.is_home:  # nobody said that: whatever is overheard after it was meant so
            core.operator.take_target(now_s, is_click=target.is_click)
        if core.state in _NOT_NOW:
            self.waiting = target
            return [Notice.TARGET_WAITS]
        core.target, self.waiting = target, None
        if not target.is_home:
            core.voice.tell(
                now_s,
                EventName.TARGET,
                f"target {target.position} from {target.source}",
                list(target.position),
                str(target.source),
            )
        self.answers.begin(target)
        if not core.orders.drive:
            self._warn_of_straight_line(target, now_s)
        return [Notice.ROUTE_WANTED]

    def take_waiting(self) -> Sequence[Signal]:
        """Return that a target came that had to wait, if one did."""
        target, self.waiting = self.waiting, None
        return self.take(target) if target is not None else []

    def watch_while_waiting(self, *, is_wanted: bool = False) -> None:
        """Notice a takeover while a target has to wait: it revokes the target."""
        core = self.core
        has_target = is_wanted or self.waiting is not None
        if has_target and core.orders.drive and not core.orders.once and not core.operator.is_on:
            core.operator.expect(core.situation.mode, set(), is_armed=bool(core.situation.armed))

    def _refuse_command(self, frame: Frame, now_s: float) -> None:
        """Answer a command to our own component that asks for no place we could take the vehicle to."""
        message = frame.message
        assert isinstance(message, m.CommandInt | m.CommandLong)
        if message.command != Command.DO_REPOSITION:
            self.answers.refuse(frame, m.MavResult.UNSUPPORTED)
            return
        self.answers.refuse(frame, m.MavResult.DENIED)
        is_heeded = TargetSource.REPOSITION in self.core.orders.target_sources
        why = "it has no position" if is_heeded else "not in --target-from"
        error = RefusedError(f"DO_REPOSITION denied: {why}")
        self.core.voice.error(now_s, EventName.TROUBLE, error, {})

    def _warn_of_straight_line(self, target: Target, now_s: float) -> None:
        """Warn at once: a go-to click makes the vehicle drive straight, before any plan exists."""
        situation = self.core.situation
        if not situation.armed or not target.sets_going(situation.mode, self.core.modes):
            return
        found = straight_line(situation, self.core.orders.request, target.position)
        if found is not None and not found.holds:
            self.core.voice.rechecked(
                now_s, EventName.STRAIGHT_LINE_UNSAFE, "the straight line to the target", found
            )

    # Targets of lists

    def take_mission_target(self) -> Sequence[Signal]:
        """Take the last place of the vehicle's mission for a target, where that is asked for."""
        return self._take_listed(self._mission_place, TargetSource.MISSION)

    def take_rally_target(self) -> Sequence[Signal]:
        """Take the vehicle's last rally point for a target, where that is asked for."""
        return self._take_listed(self._rally_place, TargetSource.RALLY)

    def note_lists(self) -> None:
        """Take the lists on the vehicle for known: nothing in them is a new target."""
        self._note_listed(self._mission_place, TargetSource.MISSION)
        self._note_listed(self._rally_place, TargetSource.RALLY)

    def _take_listed(self, place: LatLon | None, source: TargetSource) -> Sequence[Signal]:
        core = self.core
        if source not in core.orders.target_sources or not self._note_listed(place, source):
            return []
        if place is None or is_same_place(place, core.target.position if core.target else None):
            return []
        return self.take(Target(place, source))

    def _note_listed(self, place: LatLon | None, source: TargetSource) -> bool:
        """Remember the last place of a list; return whether it is another one than before."""
        before, self._listed[source] = self._listed.get(source), place
        return not is_same_place(place, before)

    @property
    def _mission_place(self) -> LatLon | None:
        mission = self.core.situation.mission
        return last_place(mission.value.items) if mission else None

    @property
    def _rally_place(self) -> LatLon | None:
        rally = self.core.situation.rally
        return rally.value[-1].position if rally and rally.value else None
