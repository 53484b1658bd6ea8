"""The part of the director that finds the vehicle, learns it, and notices when it falls silent or was switched off and on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from mavlink_bridge.director.changes import RebootWatch
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.learning import Learning
from mavlink_bridge.director.states import Cue, Notice, Signal, State
from mavlink_bridge.director.steps import step
from mavlink_bridge.errors import LinkError
from mavlink_bridge.fold import fold
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import ARDUPILOT, autopilot_table
from mavlink_bridge.mavlink.messages import Frame
from mavlink_bridge.mavlink.vehicles import not_known
from mavlink_bridge.protocol.find import FindVehicle
from mavlink_bridge.protocol.peer import Peer
from missions.situation import ListKind

_SILENCE_S = 5.0
"""ArduPilot sends a heartbeat every second: five in a row are lost."""

_MAY_FALL_SILENT = frozenset(
    set(State)
    - {State.LISTENING, State.UPLOADING, State.WITHDRAWING, State.CLASHING, State.CLASHED}
    - {State.LOST, State.DONE, State.FAILED}
)
"""An upload has patience of its own, and leaves no half mission behind where it can help it; after a clash of identities all is read anew anyway."""


class Learner(Part):
    """Knows the vehicle.

    Attributes
    ----------
    is_first_time : bool
        Whether the vehicle was not learnt yet, nor taken from us.
    learns_later : bool
        Whether it was switched off and on in the middle of an upload, and is learnt when that has ended.
    """

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        orders = core.orders
        self._find = FindVehicle(
            orders.system,
            any_vehicle=orders.any_vehicle,
            patience_s=orders.patience_s if orders.once else math.inf,
            identity=None if orders.passive else core.identity,
            own_component=None if orders.passive else orders.own_component,
        )
        self._reboots = RebootWatch()
        self.is_first_time = True
        self.learns_later = False

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        state = self.core.state
        if state is State.LISTENING:
            return self._find.deadline_s
        return self.core.heartbeat_s + _SILENCE_S if state in _MAY_FALL_SILENT else None

    def start(self, now_s: float) -> None:
        """Begin to listen."""
        self._find.start(now_s)

    def receive(self, frame: Frame, now_s: float) -> Iterable[Signal]:
        """Take a frame."""
        core = self.core
        if core.is_from_vehicle(frame):
            core.watch.receive(frame.message, now_s)
            if isinstance(frame.message, m.Heartbeat):
                core.heartbeat_s = now_s
                yield Cue.HEARD
            if self._reboots.is_reboot(frame.message):
                yield Cue.REBOOTED
        if core.orders.passive:
            yield from self._listen()

    def handle_timer(self, now_s: float) -> Iterable[Signal]:
        """Take notice that time has passed."""
        core = self.core
        if core.state is State.LISTENING:
            self._find.handle_timer(now_s)
            yield from self._found(now_s)
        if core.state in _MAY_FALL_SILENT and now_s >= core.heartbeat_s + _SILENCE_S:
            yield Cue.SILENCE

    # Finding

    def look_for(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Take a frame while nobody was found yet."""
        self._find.receive(frame, now_s)
        return self._found(now_s)

    def _found(self, now_s: float) -> Sequence[Signal]:
        """Go on from listening, once it is clear who is meant."""
        core, find = self.core, self._find
        if find.trouble is not None:
            return self.refuse(find.trouble, now_s)
        if find.vehicle is None or find.heartbeat is None:
            return []
        vehicle = find.vehicle
        table = autopilot_table(find.heartbeat.autopilot)
        if table is None and not core.orders.passive:
            return self.refuse(not_known(vehicle.system, find.heartbeat.autopilot), now_s)
        identity = core.orders.identity or (vehicle.system, core.orders.own_component)
        core.meet(Peer(vehicle.system, vehicle.component, *identity, table or ARDUPILOT))
        core.voice.tell(now_s, EventName.VEHICLE_FOUND, f"vehicle found: system {vehicle.system}", *vehicle)
        known = replace(
            core.situation, system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type
        )
        heartbeat = Frame(vehicle.system, vehicle.component, find.heartbeat)
        core.situation = fold(known, heartbeat, find.heard_s)
        core.heartbeat_s = find.heard_s
        core.watch.receive(find.heartbeat, find.heard_s)
        return [Cue.FOUND]

    def refuse(self, error: LinkError, now_s: float) -> Sequence[Signal]:
        """Return the end before anything was done, whatever the orders."""
        self.core.voice.error(now_s, EventName.TROUBLE, error, dict(error.details))
        self.core.trouble = error
        return [Cue.GIVE_UP]

    # Learning

    def learn(self, now_s: float) -> None:
        """Leave what is under way, and ask for everything."""
        core = self.core
        core.steps.clear()
        if core.orders.passive:
            return
        assert core.peer is not None
        rally = (ListKind.RALLY,) if core.orders.reads_rally else ()
        kinds = (ListKind.FENCE, ListKind.MISSION, *rally)
        may_lack = frozenset() if core.orders.needs_rally else frozenset({ListKind.RALLY})
        learning = Learning(core.peer, core.orders.patience_s, kinds, may_lack=may_lack)
        core.steps.run([step(learning, self._take_learnt)], now_s)

    def _take_learnt(self, machine: Learning, now_s: float) -> Sequence[Signal]:
        core = self.core
        if machine.trouble is not None:
            core.voice.error(now_s, EventName.TROUBLE, machine.trouble, dict(machine.trouble.details))
            return [*core.give_up(machine.trouble), Notice.LEARNING_FAILED]
        core.vehicle_uid = machine.uid
        core.situation = machine.merged(core.situation, now_s)
        self._note_version(now_s)
        return [Cue.LEARNT]

    def _note_version(self, now_s: float) -> None:
        """Take notice of the version, which decides how the vehicle is spoken to where versions differ."""
        core, firmware = self.core, self.core.situation.firmware
        assert core.peer is not None
        table = autopilot_table(core.autopilot.autopilot, firmware) or core.autopilot
        core.meet(replace(core.peer, autopilot=table))
        if self.is_first_time and (remark := table.remark(firmware)):
            core.voice.tell(now_s, EventName.TROUBLE, remark, "VehicleError", {})

    def _listen(self) -> Iterable[Signal]:
        """Learn from what others transfer; it is enough once the place is known, the fence may come later."""
        core = self.core
        if core.state is State.LEARNING and core.situation.pose is not None:
            yield Cue.LEARNT
            return
        if core.situation.mission is not core.before.mission:
            yield Notice.MISSION_HEARD
        if core.situation.rally is not core.before.rally:
            yield Notice.RALLY_HEARD

    # Silence

    def fallen_silent(self, now_s: float) -> Sequence[Signal]:
        """Report that the vehicle is not heard any more."""
        self.core.voice.tell(
            now_s, EventName.LINK_LOST, f"link lost: no heartbeat for {_SILENCE_S:g} s", _SILENCE_S
        )
        return self.core.give_up(LinkError(f"the vehicle is not heard: no heartbeat for {_SILENCE_S:g} s"))
