"""The lower half of the director: finds the vehicle, learns it, and keeps what is known of it true.

It notices when lists change, when the vehicle falls silent or was switched off and on. What follows from that is decided above, in
`director`, by the hooks that stand at the end.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge import messages as m
from mavlink_bridge.director.changes import ChangeWatch
from mavlink_bridge.director.events import Event, EventName
from mavlink_bridge.director.learning import MISSION_TYPES, Learning, list_of
from mavlink_bridge.director.orders import PATH_PLANNER_COMPONENT, Orders
from mavlink_bridge.director.states import TRANSITIONS, Cue, State
from mavlink_bridge.director.steps import Step, Steps
from mavlink_bridge.director.voice import Voice
from mavlink_bridge.errors import BridgeError, LinkError, VehicleNotFoundError
from mavlink_bridge.fold import fold, with_list
from mavlink_bridge.messages import Frame
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.find import FindVehicle
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.table_machine import TableMachine
from missions.situation import Known, ListKind, Situation

if TYPE_CHECKING:
    from mavlink_bridge.messages import Message
    from missions.errors import MissionError
    from missions.fence import Fence
    from missions.items import MissionItem

FRESH_S = 1.5
"""How old a heartbeat may be to tell what the vehicle does now."""

_SILENCE_S = 5.0
_AT_REST = frozenset(
    {State.READY, State.PROPOSED, State.VERIFIED, State.DRIVING, State.ARRIVED, State.LET_GO}
)
_MAY_FALL_SILENT = frozenset(
    set(State) - {State.LISTENING, State.UPLOADING, State.LOST, State.DONE, State.FAILED}
)


class Keeper(TableMachine[State, Cue]):
    """Knows a vehicle.

    Parameters
    ----------
    orders : Orders
        Whom to look for, and as whom to speak.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(TRANSITIONS, State.LISTENING)
        self.orders = orders
        self.situation = situation or Situation()
        self.trouble: BridgeError | MissionError | None = None
        patience_s = orders.patience_s if orders.once else math.inf
        self._find = FindVehicle(orders.system, any_vehicle=orders.any_vehicle, patience_s=patience_s)
        self._peer: Peer | None = None
        self._steps = Steps()
        self._voice = Voice(announce=orders.announce)
        self._changes: ChangeWatch | None = None
        self._fence_known: Known[Fence] | None = None
        self._heartbeat_s = -math.inf

    @property
    def identity(self) -> tuple[int, int] | None:
        """The ids we speak with; None until they are known."""
        return (self._peer.own_system, self._peer.own_component) if self._peer else self.orders.identity

    @property
    def peer(self) -> Peer | None:
        """The vehicle, once it was found."""
        return self._peer

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self._steps.deadline_s, self._voice.deadline_s, *self._own_deadlines_s()]
        if self.state is State.LISTENING:
            times.append(self._find.deadline_s)
        if self.state in _MAY_FALL_SILENT:
            times.append(self._heartbeat_s + _SILENCE_S)
        if self._may_reread and self._changes is not None:
            times.append(self._changes.deadline_s(is_driving=self.state is State.DRIVING))
        return min((time_s for time_s in times if time_s is not None and time_s < math.inf), default=None)

    def start(self, now_s: float) -> None:
        """Begin to listen."""
        self._find.start(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        if self.state is State.LISTENING:
            self._find.receive(frame, now_s)
            self._found(now_s)
            return
        before = self.situation
        self.situation = fold(before, frame, now_s)
        if self._is_from_vehicle(frame):
            self._take_vehicle_frame(frame, now_s)
        if self.orders.passive:
            self._learn_by_listening(before, now_s)
        self._notice_fence(now_s)
        self._take_any_frame(frame, before, now_s)
        self._steps.receive(frame, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        self._outgoing += self._voice.due(now_s)
        self._steps.handle_timer(now_s)
        if self.state is State.LISTENING:
            self._find.handle_timer(now_s)
            self._found(now_s)
        self._handle_own_timer(now_s)
        if self.state in _MAY_FALL_SILENT and now_s >= self._heartbeat_s + _SILENCE_S:
            self._fall_silent(now_s)
        if self._may_reread:
            self._reread(now_s)

    def messages_to_send(self) -> list[Message]:
        """Give and forget what is to be sent now."""
        return super().messages_to_send() + self._steps.messages_to_send()

    def take_events(self) -> list[Event]:
        """Give and forget what happened."""
        return self._voice.take_events()

    # Finding and learning

    def _found(self, now_s: float) -> None:
        """Go on from listening, once it is clear who is meant."""
        find = self._find
        if find.trouble is not None:
            self._voice.error(now_s, EventName.TROUBLE, find.trouble, dict(find.trouble.details))
            self.trouble = find.trouble
            self._move(Cue.GIVE_UP)
        if find.vehicle is None or find.heartbeat is None:
            return
        if find.heartbeat.autopilot != m.Autopilot.ARDUPILOTMEGA and not self.orders.passive:
            self._refuse_autopilot(find.vehicle.system, find.heartbeat.autopilot, now_s)
            return
        vehicle = find.vehicle
        identity = self.orders.identity or (vehicle.system, PATH_PLANNER_COMPONENT)
        self._peer = Peer(vehicle.system, vehicle.component, *identity)
        self._changes = ChangeWatch(identity)
        self._move(Cue.FOUND)
        self._voice.tell(now_s, EventName.VEHICLE_FOUND, f"vehicle found: system {vehicle.system}", *vehicle)
        known = replace(
            self.situation, system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type
        )
        heartbeat = Frame(vehicle.system, vehicle.component, find.heartbeat)
        self.situation = fold(known, heartbeat, find.heard_s)
        self._heartbeat_s = find.heard_s
        self._learn(now_s)

    def _refuse_autopilot(self, system: int, autopilot: int, now_s: float) -> None:
        """Say that missions are made for ArduPilot only: where home stands and what modes are called is its own."""
        name = "PX4" if autopilot == m.Autopilot.PX4 else f"MAV_AUTOPILOT {autopilot}"
        error = VehicleNotFoundError(
            f"system {system} is no ArduPilot ({name}): for now only ArduPilot is served"
        )
        self._voice.error(now_s, EventName.TROUBLE, error, dict(error.details))
        self.trouble = error
        self._move(Cue.GIVE_UP)

    def _learn(self, now_s: float) -> None:
        assert self._peer is not None
        self._steps.clear()
        if not self.orders.passive:
            self._steps.run([(Learning(self._peer, self.orders.patience_s), self._take_learnt)], now_s)

    def _take_learnt(self, machine: Learning, now_s: float) -> None:
        if machine.trouble is not None:
            self._voice.error(now_s, EventName.TROUBLE, machine.trouble, dict(machine.trouble.details))
            self._give_up(machine.trouble)
            if not self.orders.once:
                self._learn(now_s)
            return
        self.situation = machine.merged(self.situation, now_s)
        self._all_learnt(now_s)

    def _learn_by_listening(self, before: Situation, now_s: float) -> None:
        """Know enough once the place is known; the fence may come later."""
        if self.state is State.LEARNING and self.situation.pose is not None:
            self._all_learnt(now_s)
        elif self.situation.mission is not before.mission:
            self._mission_heard(now_s)

    def _all_learnt(self, now_s: float) -> None:
        if self._changes is not None:
            self._changes.settle(now_s)
        self._move(Cue.LEARNT)
        self._fence_known = self.situation.fence
        self._voice.learnt(now_s, self.situation)
        self._learnt(now_s)

    # Keeping what is known true

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        assert self._changes is not None
        if isinstance(frame.message, m.Heartbeat):
            self._take_heartbeat(now_s)
        if self._changes.is_reboot(frame) and self._move(Cue.REBOOTED):
            self._voice.tell(
                now_s, EventName.REBOOTED, "the vehicle was switched off and on; all is read anew"
            )
            self._vehicle_gone(has_forgotten=True)
            self._learn(now_s)
        self._changes.look(frame)
        if self.state is State.UPLOADING:
            self._changes.suspects.discard(ListKind.MISSION)

    def _take_heartbeat(self, now_s: float) -> None:
        self._heartbeat_s = now_s
        if self.state is State.LOST and self._move(Cue.HEARD):
            self._voice.tell(now_s, EventName.LINK_BACK, "the vehicle is heard again; all is read anew")
            self._learn(now_s)

    def _fall_silent(self, now_s: float) -> None:
        if self._move(Cue.SILENCE):
            self._steps.clear()
            self._vehicle_gone(has_forgotten=False)
            self._voice.tell(now_s, EventName.LINK_LOST, f"no heartbeat for {_SILENCE_S:g} s", _SILENCE_S)
            self._give_up(LinkError(f"the vehicle fell silent: no heartbeat for {_SILENCE_S:g} s"))

    @property
    def _may_reread(self) -> bool:
        is_settled = self.state in _AT_REST and not self._steps
        return is_settled and not self.orders.once and not self.orders.passive

    def _reread(self, now_s: float) -> None:
        """Read again what somebody may have changed."""
        assert self._changes is not None
        assert self._peer is not None
        suspects = self._changes.due(now_s, is_driving=self.state is State.DRIVING)
        takers = {ListKind.FENCE: self._fence_reread, ListKind.MISSION: self._mission_reread}
        steps: list[Step] = [
            (Download(self._peer, MISSION_TYPES[kind]), taker)
            for kind, taker in takers.items()
            if kind in suspects
        ]
        self._steps.run(steps, now_s)

    def _fence_reread(self, machine: Download, now_s: float) -> None:
        if self._take_list(machine, ListKind.FENCE, now_s) is not None:
            self._notice_fence(now_s)

    def _mission_reread(self, machine: Download, now_s: float) -> None:
        items = self._take_list(machine, ListKind.MISSION, now_s)
        if items is not None:
            self._mission_read(items, now_s)

    def _take_list(self, machine: Download, kind: ListKind, now_s: float) -> tuple[MissionItem, ...] | None:
        """Take what a download brought; where it failed, the next poll asks again."""
        items = list_of(machine, kind)
        if isinstance(items, BridgeError):
            return None
        self.situation = with_list(self.situation, kind, items, now_s, f"{kind} read from the vehicle")
        return items

    def _notice_fence(self, now_s: float) -> None:
        """Compare the fence with the one that was last acted upon."""
        fence, known = self.situation.fence, self._fence_known
        if fence is known or self.state is State.LEARNING:
            return
        self._fence_known = fence
        if fence is None and self._changes is not None:  # somebody wrote one that we saw only in part
            self._changes.suspects.add(ListKind.FENCE)
        if fence is None or (known is not None and fence.value == known.value):
            return
        zones, vertices = len(fence.value.zones), fence.value.vertex_count
        self._voice.tell(now_s, EventName.FENCE_CHANGED, f"the fence changed: {zones} zones", zones, vertices)
        self._fence_changed(now_s)

    def _is_from_vehicle(self, frame: Frame) -> bool:
        peer = self._peer
        return peer is not None and (frame.system, frame.component) == (peer.system, peer.component)

    # Ends of a single job

    def _end(self) -> None:
        if self.orders.once:
            self._move(Cue.END)

    def _give_up(self, trouble: BridgeError | MissionError) -> None:
        """End a single job with its trouble; the bridge goes on."""
        self.trouble = trouble
        if self.orders.once:
            self._steps.clear()
            self.state = State.FAILED

    # Hooks: what follows is decided above

    def _own_deadlines_s(self) -> list[float | None]:
        """Give further times at which a timer is wanted."""
        raise NotImplementedError

    def _handle_own_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        raise NotImplementedError

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        """Take a frame of anybody; the situation before it is given, the one after it stands."""
        raise NotImplementedError

    def _learnt(self, now_s: float) -> None:
        """Act on all that is known now."""
        raise NotImplementedError

    def _fence_changed(self, now_s: float) -> None:
        """Act on a fence that is another one than before."""
        raise NotImplementedError

    def _mission_read(self, items: tuple[MissionItem, ...], now_s: float) -> None:
        """Act on the vehicle's mission as it was read again."""
        raise NotImplementedError

    def _mission_heard(self, now_s: float) -> None:
        """Act on a mission that others transferred, while we only listen."""
        raise NotImplementedError

    def _vehicle_gone(self, *, has_forgotten: bool) -> None:
        """Act on a vehicle that is silent, or was switched off and on."""
        raise NotImplementedError
