"""The lowest part of the director: finds the vehicle, learns it, and notices when it falls silent or was switched off and on.

What follows is decided above, by the hooks that stand at the end.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.changes import RebootWatch
from mavlink_bridge.director.events import Event, EventName
from mavlink_bridge.director.learning import Learning
from mavlink_bridge.director.orders import Orders, TargetSource
from mavlink_bridge.director.states import TRANSITIONS, Cue, State
from mavlink_bridge.director.steps import Steps
from mavlink_bridge.director.voice import Voice
from mavlink_bridge.errors import BridgeError, LinkError
from mavlink_bridge.fold import fold
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import Frame
from mavlink_bridge.mavlink.vehicles import not_ardupilot
from mavlink_bridge.protocol.find import FindVehicle
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch
from missions.situation import ListKind, Situation

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Message
    from missions.errors import MissionError

_SILENCE_S = 5.0
_MAY_FALL_SILENT = frozenset(
    set(State)
    - {State.LISTENING, State.UPLOADING, State.WITHDRAWING, State.CLASHING, State.CLASHED}
    - {State.LOST, State.DONE, State.FAILED}
)
"""An upload has patience of its own, and leaves no half mission behind where it can help it; after a clash of identities all is read anew anyway."""


class Acquaintance(TableMachine[State, Cue]):
    """Has found a vehicle and learnt it.

    Parameters
    ----------
    orders : Orders
        Whom to look for, and as whom to speak.
    situation : Situation, optional
        What is known beforehand (parameters of a file).

    Attributes
    ----------
    watch : VehicleWatch
        What the vehicle does, as last told.
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(TRANSITIONS, State.LISTENING)
        self.orders = orders
        self.situation = situation or Situation()
        self.trouble: BridgeError | MissionError | None = None
        patience_s = orders.patience_s if orders.once else math.inf
        self.vehicle_uid = ""
        self._peer: Peer | None = None
        self._find = FindVehicle(
            orders.system,
            any_vehicle=orders.any_vehicle,
            patience_s=patience_s,
            identity=None if orders.passive else self.identity,
            own_component=None if orders.passive else orders.own_component,
        )
        self.watch = VehicleWatch()
        self._steps = Steps()
        self._voice = Voice(announce=orders.announce)
        self._reboots = RebootWatch()
        self._heartbeat_s = -math.inf
        self._learns_later = False

    @property
    def identity(self) -> tuple[int, int] | None:
        """The ids we speak with; None until they are known."""
        if self._peer is not None:
            return self._peer.own_system, self._peer.own_component
        orders = self.orders
        if orders.identity is not None or orders.system is None:
            return orders.identity
        return orders.system, orders.own_component

    @property
    def peer(self) -> Peer | None:
        """The vehicle, once it was found."""
        return self._peer

    @property
    def heard_s(self) -> float | None:
        """When the vehicle's newest heartbeat was heard; None before the first."""
        return self._heartbeat_s if math.isfinite(self._heartbeat_s) else None

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self._steps.deadline_s, self._voice.deadline_s, *self._own_deadlines_s()]
        if self.state is State.LISTENING:
            times.append(self._find.deadline_s)
        if self.state in _MAY_FALL_SILENT:
            times.append(self._heartbeat_s + _SILENCE_S)
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

    def messages_to_send(self) -> list[Message]:
        """Give and forget what is to be sent now."""
        return super().messages_to_send() + self._steps.messages_to_send()

    def take_events(self) -> list[Event]:
        """Give and forget what happened."""
        return self._voice.take_events()

    # Finding

    def _found(self, now_s: float) -> None:
        """Go on from listening, once it is clear who is meant."""
        find = self._find
        if find.trouble is not None:
            self._refuse(find.trouble, now_s)
        if find.vehicle is None or find.heartbeat is None:
            return
        vehicle = find.vehicle
        if not self.orders.passive and (other := not_ardupilot(vehicle.system, find.heartbeat.autopilot)):
            self._refuse(other, now_s)
            return
        identity = self.orders.identity or (vehicle.system, self.orders.own_component)
        self._peer = Peer(vehicle.system, vehicle.component, *identity)
        self._move(Cue.FOUND)
        self._voice.tell(now_s, EventName.VEHICLE_FOUND, f"vehicle found: system {vehicle.system}", *vehicle)
        known = replace(
            self.situation, system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type
        )
        heartbeat = Frame(vehicle.system, vehicle.component, find.heartbeat)
        self.situation = fold(known, heartbeat, find.heard_s)
        self._heartbeat_s = find.heard_s
        self.watch.receive(find.heartbeat, find.heard_s)
        self._learn(now_s)

    def _refuse(self, error: LinkError, now_s: float) -> None:
        """End before anything was done, whatever the orders."""
        self._voice.error(now_s, EventName.TROUBLE, error, dict(error.details))
        self.trouble = error
        self._move(Cue.GIVE_UP)

    # Learning

    def _learn(self, now_s: float) -> None:
        assert self._peer is not None
        self._drop_steps()
        if not self.orders.passive:
            rally = (ListKind.RALLY,) if TargetSource.RALLY in self.orders.target_sources else ()
            learning = Learning(
                self._peer, self.orders.patience_s, (ListKind.FENCE, ListKind.MISSION, *rally)
            )
            self._steps.run([(learning, self._take_learnt)], now_s)

    def _take_learnt(self, machine: Learning, now_s: float) -> None:
        if machine.trouble is not None:
            self._voice.error(now_s, EventName.TROUBLE, machine.trouble, dict(machine.trouble.details))
            self._give_up(machine.trouble)
            if not self.orders.once:
                self._learn(now_s)
            return
        self.vehicle_uid = machine.uid
        self.situation = machine.merged(self.situation, now_s)
        self._all_learnt(now_s)

    def _learn_by_listening(self, before: Situation, now_s: float) -> None:
        """Know enough once the place is known; the fence may come later."""
        if self.state is State.LEARNING and self.situation.pose is not None:
            self._all_learnt(now_s)
        else:
            self._lists_heard(before, now_s)

    def _all_learnt(self, now_s: float) -> None:
        self._move(Cue.LEARNT)
        self._voice.learnt(now_s, self.situation)
        self._learnt(now_s)

    # Silence and reboots

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        self.watch.receive(frame.message, now_s)
        if isinstance(frame.message, m.Heartbeat):
            self._heartbeat_s = now_s
            if self.state is State.LOST and self._move(Cue.HEARD):
                self._voice.tell(now_s, EventName.LINK_BACK, "the vehicle is heard again; all is read anew")
                self._learn(now_s)
        if self._reboots.is_reboot(frame.message):
            self._rebooted(now_s)

    def _rebooted(self, now_s: float) -> None:
        if not self._move(Cue.REBOOTED):
            return
        self._voice.tell(now_s, EventName.REBOOTED, "the vehicle was switched off and on; all is read anew")
        self._vehicle_gone(has_forgotten=True)
        self._learns_later = self.state is State.WITHDRAWING
        if not self._learns_later:
            self._learn(now_s)

    def _learn_now(self, now_s: float) -> bool:
        """Learn a vehicle that was switched off and on in the middle of an upload, after that has ended."""
        was_due, self._learns_later = self._learns_later, False
        if was_due and self._move(Cue.REBOOTED):
            self._learn(now_s)
        return was_due

    def _fall_silent(self, now_s: float) -> None:
        if self._move(Cue.SILENCE):
            self._drop_steps()
            self._vehicle_gone(has_forgotten=False)
            text = f"link lost: no heartbeat for {_SILENCE_S:g} s"
            self._voice.tell(now_s, EventName.LINK_LOST, text, _SILENCE_S)
            self._give_up(LinkError(f"the vehicle fell silent: no heartbeat for {_SILENCE_S:g} s"))

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
            self._drop_steps()
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

    def _lists_heard(self, before: Situation, now_s: float) -> None:
        """Act on lists that others transferred, while we only listen."""
        raise NotImplementedError

    def _drop_steps(self) -> None:
        """Leave what is under way."""
        raise NotImplementedError

    def _vehicle_gone(self, *, has_forgotten: bool) -> None:
        """Act on a vehicle that is silent, or was switched off and on."""
        raise NotImplementedError
