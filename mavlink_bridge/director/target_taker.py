"""The part of the director that takes targets, wherever they come from, answers who asks, and keeps those that come at an inconvenient time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.answers import Answers, is_command_to
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.keeper import Keeper
from mavlink_bridge.director.orders import Orders, TargetSource
from mavlink_bridge.director.states import State
from mavlink_bridge.director.targets import Target, TargetWatch
from mavlink_bridge.errors import RefusedError
from mavlink_bridge.mavlink import messages as m
from missions.checking.recheck import straight_line
from missions.geo import distance_m
from missions.items import Command, last_place

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from missions.geo import LatLon
    from missions.situation import Situation

_NOT_NOW = frozenset(
    {State.LISTENING, State.LEARNING, State.LOST, State.UPLOADING, State.WITHDRAWING, State.CLASHING}
)
"""States that have to end before another target is gone into."""

_SAME_M = 0.2


class TargetTaker(Keeper):
    """Hears targets.

    Parameters
    ----------
    orders : Orders
        Which are heeded.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self._targets = TargetWatch(orders.target_sources)
        self._answers = Answers(self._send)
        self._target: Target | None = None
        self._waiting_target: Target | None = None
        self._listed: dict[TargetSource, LatLon | None] = {}

    def take_target(self, position: LatLon, now_s: float) -> None:
        """Take a target that was typed."""
        self._targets.take(position, now_s)
        self._take_target(Target(position, TargetSource.TYPED), now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        super().receive(self._as_to_vehicle(frame), now_s)

    def _as_to_vehicle(self, frame: Frame) -> Frame:
        """Take a command to our own system for one to the vehicle's, whose place it asks for."""
        peer, message = self._peer, frame.message
        if peer is None or peer.own_system == peer.system or self.identity is None:
            return frame
        if not is_command_to(frame, self.identity, peer.own_system):
            return frame
        assert isinstance(message, m.CommandInt | m.CommandLong)
        return replace(frame, message=replace(message, target_system=peer.system))

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        super()._take_any_frame(frame, before, now_s)
        if self.identity is None:
            return
        target = self._targets.look(frame, before, self.situation, now_s, self.identity)
        is_to_us = is_command_to(frame, self.identity, self.situation.system)
        if target is None:
            if is_to_us:
                self._refuse_command(frame, now_s)
        elif not target.is_again:
            self._take_target(target, now_s)
        elif is_to_us:
            self._answers.repeat(frame)
        else:
            self._take_again(target, now_s)

    def _refuse_command(self, frame: Frame, now_s: float) -> None:
        """Answer a command to our own component that asks for no place we could take the vehicle to."""
        message = frame.message
        assert isinstance(message, m.CommandInt | m.CommandLong)
        if message.command != Command.DO_REPOSITION:
            self._answers.refuse(frame, m.MavResult.UNSUPPORTED)
            return
        self._answers.refuse(frame, m.MavResult.DENIED)
        is_heeded = TargetSource.REPOSITION in self.orders.target_sources
        why = "it names no place" if is_heeded else "targets by reposition are not heeded"
        self._voice.error(now_s, EventName.TROUBLE, RefusedError(f"DO_REPOSITION denied: {why}"), {})

    def _take_target(self, target: Target, now_s: float) -> None:
        if self.state in _NOT_NOW:
            self._waiting_target = target
            self._stop_at_once(target, now_s)
            return
        self._target = target
        self._voice.tell(
            now_s,
            EventName.TARGET,
            f"target {target.position} by {target.source}",
            list(target.position),
            str(target.source),
        )
        self._answers.begin(target)
        if not self.orders.drive:
            self._warn_of_straight_line(target, now_s)
        self._cue_target(now_s)

    def _take_waiting_target(self, now_s: float) -> bool:
        """Go into a target that came at an inconvenient time, if one did."""
        target, self._waiting_target = self._waiting_target, None
        if target is not None:
            self._take_target(target, now_s)
        return target is not None

    def _warn_of_straight_line(self, target: Target, now_s: float) -> None:
        """Warn at once: a go-to click makes the vehicle drive straight, before any plan exists."""
        if not self.situation.armed or not self._sets_it_going(target):
            return
        found = straight_line(self.situation, self.orders.request, target.position)
        if found is not None and not found.holds:
            self._voice.rechecked(
                now_s, EventName.STRAIGHT_LINE_UNSAFE, "the straight line to the target", found
            )

    def _take_listed_target(self, place: LatLon | None, source: TargetSource, now_s: float) -> None:
        """Take the last place of a list on the vehicle for a target, where that is asked for and it is a new one."""
        if source not in self.orders.target_sources or not self._note_listed(place, source):
            return
        if place is not None and not _is_same(place, self._target.position if self._target else None):
            self._take_target(Target(place, source), now_s)

    def _note_listed(self, place: LatLon | None, source: TargetSource) -> bool:
        """Remember the last place of a list; tell whether it is another one than before."""
        before, self._listed[source] = self._listed.get(source), place
        return not _is_same(place, before)

    def _note_lists(self) -> None:
        """Take the lists on the vehicle for known: nothing in them is a new target."""
        self._note_listed(self._mission_place, TargetSource.MISSION)
        self._note_listed(self._rally_place, TargetSource.RALLY)

    @property
    def _mission_place(self) -> LatLon | None:
        mission = self.situation.mission
        return last_place(mission.value.items) if mission else None

    @property
    def _rally_place(self) -> LatLon | None:
        rally = self.situation.rally
        return rally.value[-1] if rally and rally.value else None

    def _take_mission_target(self, now_s: float) -> None:
        self._take_listed_target(self._mission_place, TargetSource.MISSION, now_s)

    def _rally_read(self, now_s: float) -> None:
        self._take_listed_target(self._rally_place, TargetSource.RALLY, now_s)

    def _mission_heard(self, now_s: float) -> None:
        self._take_mission_target(now_s)

    # Hooks: what a target leads to is decided above

    def _sets_it_going(self, target: Target) -> bool:
        """Tell whether a target has made the vehicle drive straight to it."""
        raise NotImplementedError

    def _stop_at_once(self, target: Target, now_s: float) -> None:
        """Stop a vehicle that a target has set going, though the target itself has to wait."""
        raise NotImplementedError

    def _take_again(self, target: Target, now_s: float) -> None:
        """Act on a target that was said again."""
        raise NotImplementedError

    def _cue_target(self, now_s: float) -> None:
        """Make a route to the target that was taken."""
        raise NotImplementedError


def _is_same(a: LatLon | None, b: LatLon | None) -> bool:
    """Tell whether two places are one, but for the rounding of the wire."""
    return a is b or (a is not None and b is not None and distance_m(a, b) < _SAME_M)
