"""What all parts of the director need, and what a part is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.operator_watch import OperatorWatch
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import TRANSITIONS, Cue, Signal, State
from mavlink_bridge.director.steps import Steps
from mavlink_bridge.director.voice import Voice
from mavlink_bridge.mavlink.autopilots import ARDUPILOT
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.director.plan_task import PlanTask
    from mavlink_bridge.director.targets import Target
    from mavlink_bridge.errors import BridgeError
    from mavlink_bridge.mavlink.autopilots import AutopilotTable
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.mavlink.modes import Modes
    from mavlink_bridge.protocol.peer import Peer
    from missions.errors import MissionError
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.situation import Situation


class Core(TableMachine[State, Cue]):
    """The state, what is known of the vehicle, what is wanted of it, and the means to speak.

    Parameters
    ----------
    orders : Orders
        What the director may do.
    situation : Situation
        What is known beforehand.
    heed : callable
        Takes what the end of a machine signals.

    Attributes
    ----------
    situation, before : Situation
        What is known, and what was before the newest frame.
    plan_task : PlanTask or None
        The plan that is to be made; it is waited for in one stay in a state, and dropped with it.
    peer : Peer or None
        The vehicle and our identity, once it was found.
    watch : VehicleWatch
        What the vehicle does, as last told.
    operator : OperatorWatch
        In which mode the vehicle is by our doing.
    target : Target or None
        Where the vehicle is wanted.
    plan : Plan or None
        The plan that stands.
    ours : tuple of MissionItem or None
        The list that is on the vehicle by us, as it goes over the wire.
    """

    def __init__(
        self, orders: Orders, situation: Situation, heed: Callable[[Iterable[Signal], float], None]
    ) -> None:
        super().__init__(TRANSITIONS, State.LISTENING)
        self.plan_task: PlanTask | None = None
        self.orders = orders
        self.situation = self.before = situation
        self.trouble: BridgeError | MissionError | None = None
        self.vehicle_uid = ""
        self.peer: Peer | None = None
        self.heartbeat_s = -math.inf
        self.watch = VehicleWatch()
        self.operator = OperatorWatch()
        self.operator.clicks_are_targets = TargetSource.REPOSITION in orders.target_sources
        self.steps = Steps(heed)
        self.voice = Voice(announce=orders.announce)
        self.target: Target | None = None
        self.plan: Plan | None = None
        self.ours: tuple[MissionItem, ...] | None = None

    @property
    def identity(self) -> tuple[int, int] | None:
        """The ids we speak with; None until they are known."""
        if self.peer is not None:
            return self.peer.own_system, self.peer.own_component
        orders = self.orders
        if orders.identity is not None or orders.system is None:
            return orders.identity
        return orders.system, orders.own_component

    # The vehicle's autopilot

    @property
    def autopilot(self) -> AutopilotTable:
        """How the vehicle's autopilot speaks; ArduPilot before it is known."""
        return self.peer.autopilot if self.peer is not None else ARDUPILOT

    @property
    def modes(self) -> Modes:
        """The modes of the vehicle's autopilot."""
        return self.autopilot.modes

    def meet(self, peer: Peer) -> None:
        """Take notice which vehicle it is, and of which version."""
        self.peer = peer
        self.operator.modes = peer.autopilot.modes

    def number_of(self, seq: int) -> int:
        """Return which of a plan's items the vehicle means: they are counted from 1 on, as on a vehicle whose item 0 is its home."""
        return seq + int(not self.autopilot.lists.form.has_home_item)

    def has_items(self, items: Sequence[MissionItem]) -> bool:
        """Return whether a mission, its home left out, is ours; which of its items is the current one does not matter."""
        return self.ours is not None and _plain(items) == _plain(
            self.autopilot.lists.form.own_items(self.ours)
        )

    @property
    def has_our_mission(self) -> bool:
        """Whether the vehicle's mission is ours."""
        mission = self.situation.mission
        return mission is not None and self.has_items(mission.value.items)

    @property
    def is_in_mission(self) -> bool:
        """Whether the vehicle drives a mission."""
        return bool(self.situation.armed) and self.situation.mode == self.modes.mission

    @property
    def is_driving_ours(self) -> bool:
        """Whether the vehicle drives our mission, whoever started it."""
        return self.is_in_mission and self.has_our_mission

    def is_from_vehicle(self, frame: Frame) -> bool:
        """Return whether a frame comes from the vehicle's autopilot."""
        peer = self.peer
        return peer is not None and (frame.system, frame.component) == (peer.system, peer.component)

    # The state

    def heeds(self, cue: Cue) -> bool:
        """Return whether a cue leads anywhere from here."""
        return cue in self._table[self.state]

    def move(self, cue: Cue) -> bool:
        """Go where the table says; False where the state does not list the cue."""
        has_moved = self._move(cue)
        if has_moved:
            self.drop_plan_task()
        return has_moved

    def drop_plan_task(self) -> None:
        """Wait for no plan any more; one in the making is broken off."""
        if self.plan_task is not None:
            self.plan_task.is_dropped = True
            self.plan_task = None

    # Speaking

    def send(self, *messages: Message) -> None:
        """Send messages, before those of the machine that runs."""
        self._outgoing += messages

    # What parts signal at the end of something

    def end(self) -> Sequence[Signal]:
        """Return the end of a single job; the bridge goes on."""
        return [Cue.END] if self.orders.once else []

    def give_up(self, trouble: BridgeError | MissionError) -> Sequence[Signal]:
        """Return the end of a single job with its trouble; the bridge goes on."""
        self.trouble = trouble
        return [Cue.GIVE_UP] if self.orders.once else []

    def fail_step(self, trouble: BridgeError | MissionError) -> Sequence[Signal]:
        """Return that what is under way came to a bad end."""
        return [Cue.TROUBLE, *self.give_up(trouble)]


def _plain(items: Iterable[MissionItem]) -> list[MissionItem]:
    return [replace(item, current=False) if item.current else item for item in items]


class Part:
    """A part of the director, which holds it; by itself it does nothing.

    A part may use `core` and the parts it was made with, which know nothing of it. What others must act upon it returns as signals, which the
    director looks up in its table before anything else happens.
    """

    def __init__(self, core: Core) -> None:
        self.core = core

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called; None for never."""
        return None

    def receive(self, frame: Frame, now_s: float) -> Iterable[Signal]:  # noqa: ARG002 - for those that hear
        """Take a frame of anybody, which the situation holds already; return what follows, each acted upon before the next is taken."""
        return ()

    def handle_timer(self, now_s: float) -> Iterable[Signal]:  # noqa: ARG002 - for those that have timers
        """Take notice that time has passed; return what follows."""
        return ()
