"""The director: from the first heartbeat to arrival, as one state machine without sockets and clocks.

It listens for the vehicle, learns its parameters, fence, mission, home and position, waits for a plan, uploads it verified, and, where it
is told to drive, switches to AUTO and watches until arrival. What it wants from its shell stands in `state`: in READY a plan
(`take_plan`), with `pending_backup` set the old mission stored (`backup_stored`). How it ended stands in `state` and `trouble`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum, auto
from typing import TYPE_CHECKING, Any

from mavlink_bridge import messages as m
from mavlink_bridge.errors import BridgeError, LinkError, OutcomeError, RefusedError, VehicleNotFoundError
from mavlink_bridge.fold import fold, with_list
from mavlink_bridge.outcomes import upload_trouble
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.parameters import ReadParameters
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
from mavlink_bridge.rover import AUTO_MODE, MODE_NAMES
from mavlink_bridge.vehicles import Vehicle, choose_vehicle, is_vehicle
from missions.items import Command, with_home
from missions.situation import ListKind, Situation
from missions.vehicle import PARAMETER_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.messages import Frame, Message
    from mavlink_bridge.protocol.machine import Machine
    from missions.items import MissionItem
    from missions.plan import Plan

_POSITION_STREAM, _STATUS_STREAM = 6, 2
_STREAM_HZ = 4
_ASK_STREAMS_EVERY_S = 3.0
_FRESH_S = 1.5
"""How old a heartbeat may be to tell whether the vehicle drives its mission now."""


class State(StrEnum):
    """Where the director is."""

    LISTENING = auto()  # no heartbeat of the vehicle yet
    LEARNING = auto()  # parameters, fence, mission, home, position
    READY = auto()  # everything is known: a plan is wanted
    UPLOADING = auto()
    VERIFIED = auto()  # the mission is on the vehicle
    STARTING = auto()  # arming where asked, switching to AUTO, to the first item
    DRIVING = auto()
    ARRIVED = auto()
    FAILED = auto()


class Event(StrEnum):
    """What moves the director."""

    FOUND = auto()
    LEARNT = auto()
    PLANNED = auto()
    UPLOAD_VERIFIED = auto()
    DRIVE = auto()
    STARTED = auto()
    REACHED = auto()
    TROUBLE = auto()


TRANSITIONS = {
    State.LISTENING: {Event.FOUND: State.LEARNING, Event.TROUBLE: State.FAILED},
    State.LEARNING: {Event.LEARNT: State.READY, Event.TROUBLE: State.FAILED},
    State.READY: {Event.PLANNED: State.UPLOADING},
    State.UPLOADING: {Event.UPLOAD_VERIFIED: State.VERIFIED, Event.TROUBLE: State.FAILED},
    State.VERIFIED: {Event.DRIVE: State.STARTING},
    State.STARTING: {Event.STARTED: State.DRIVING, Event.TROUBLE: State.FAILED},
    State.DRIVING: {Event.REACHED: State.ARRIVED, Event.TROUBLE: State.FAILED},
    State.ARRIVED: {},
    State.FAILED: {},
}
"""Every transition; the state diagram in the documentation is drawn from it."""


@dataclass(frozen=True, slots=True)
class Orders:
    """What the director may do and whom it looks for.

    Parameters
    ----------
    identity : tuple of int
        Our system and component id.
    system : int, optional
        The vehicle's system id; needed where several vehicles are heard.
    any_vehicle : bool
        Take vehicles that are neither rover nor boat.
    drive : bool
        Switch to AUTO once the mission is verified.
    arm : bool
        Arm before that.
    patience_s : float
        How long to wait for the first heartbeat and for the position.
    listen_s : float
        How long to listen for further vehicles before one is chosen.
    """

    identity: tuple[int, int]
    system: int | None = None
    any_vehicle: bool = False
    drive: bool = False
    arm: bool = False
    patience_s: float = 30.0
    listen_s: float = 1.2


class Director(TableMachine[State, Event]):
    """Takes one mission from the first heartbeat to verification or arrival.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(TRANSITIONS, State.LISTENING)
        self.situation = situation or Situation()
        self.trouble: BridgeError | None = None
        self.upload_outcome: VerifiedUploadOutcome | None = None
        self.current_item = 0
        self._orders = orders
        self._heard: dict[int, tuple[Vehicle, Frame]] = {}
        self._heartbeat_s = -math.inf
        self._peer: Peer | None = None
        self._steps: list[tuple[Machine, Callable[[Any, float], None]]] = []
        self._step_until_s = 0.0
        self._streams_due_s = 0.0
        self._plan: Plan | None = None
        self._auto_seen = False
        self._driving_since_s = 0.0

    @property
    def is_done(self) -> bool:
        """Whether it wants no more calls: failed, arrived, or verified with no order to drive."""
        return super().is_done or (self.state is State.VERIFIED and not self._orders.drive)

    @property
    def progress(self) -> tuple[int, int]:
        """Progress of the transfer under way, or of the drive by items."""
        if self.state is State.DRIVING and self._plan:
            return self.current_item, len(self._plan.items)
        return self._steps[0][0].progress if self._steps else (0, 0)

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The vehicle's old mission, while it waits to be stored."""
        upload = self._upload
        return upload.pending_backup if upload else None

    @property
    def peer(self) -> Peer | None:
        """The vehicle, once it was found."""
        return self._peer

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self._step_until_s] if self.state in (State.LISTENING, State.LEARNING) else []
        if self.state is State.LEARNING:
            times.append(self._streams_due_s)
        if self._steps and (deadline_s := self._steps[0][0].deadline_s) is not None:
            times.append(deadline_s)
        return min(times, default=None)

    def start(self, now_s: float) -> None:
        """Begin to listen."""
        self._step_until_s = now_s + self._orders.patience_s

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        if self.state is State.LISTENING:
            self._listen(frame, now_s)
        if self.situation.system is not None:
            self.situation = fold(self.situation, frame, now_s)
            if isinstance(frame.message, m.Heartbeat) and self._is_from_vehicle(frame):
                self._heartbeat_s = now_s
        if self._steps:
            self._steps[0][0].receive(frame, now_s)
            self._advance(now_s)
        if self.state is State.DRIVING:
            self._watch(frame, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        if self._steps:
            self._steps[0][0].handle_timer(now_s)
            self._advance(now_s)
        if self.state is State.LISTENING and now_s >= self._step_until_s:
            self._choose(now_s)
        elif self.state is State.LEARNING:
            self._await_position(now_s)

    def messages_to_send(self) -> list[Message]:
        """Give and forget what is to be sent now."""
        own = super().messages_to_send()
        return own + (self._steps[0][0].messages_to_send() if self._steps else [])

    def take_plan(self, plan: Plan, now_s: float) -> None:
        """Upload a plan; wanted in READY."""
        if self._peer is None or not self._move(Event.PLANNED):
            return
        self._plan = plan
        is_active = bool(self.situation.armed) and self.situation.mode == AUTO_MODE
        is_fresh = now_s - self._heartbeat_s <= _FRESH_S
        upload = VerifiedUpload(
            self._peer,
            m.MissionType.MISSION,
            with_home(plan.items, plan.home or plan.start),
            is_active=is_active if is_fresh else None,
        )
        self._run([(upload, self._uploaded)], now_s)

    def backup_stored(self, now_s: float) -> None:
        """Take notice that the old mission is safe."""
        if upload := self._upload:
            upload.backup_stored(now_s)

    # Listening

    def _listen(self, frame: Frame, now_s: float) -> None:
        heartbeat = frame.message
        if not isinstance(heartbeat, m.Heartbeat) or not is_vehicle(heartbeat) or frame.system in self._heard:
            return
        if not self._heard:
            self._step_until_s = now_s + self._orders.listen_s
        self._heard[frame.system] = Vehicle(frame.system, frame.component, heartbeat.type), frame
        if frame.system == self._orders.system:
            self._choose(now_s)

    def _choose(self, now_s: float) -> None:
        orders = self._orders
        try:
            vehicle = choose_vehicle(
                [vehicle for vehicle, _ in self._heard.values()],
                orders.system,
                any_vehicle=orders.any_vehicle,
            )
        except VehicleNotFoundError as error:
            self._fail(error)
            return
        self._peer = Peer(vehicle.system, vehicle.component, *orders.identity)
        self.situation = replace(
            self.situation, system=vehicle.system, component=vehicle.component, vehicle_type=vehicle.type
        )
        self.situation = fold(self.situation, self._heard[vehicle.system][1], now_s)
        self._move(Event.FOUND)
        self._streams_due_s = now_s
        self._ask_streams(now_s)
        home = m.CommandLong(vehicle.system, vehicle.component, Command.GET_HOME_POSITION)
        self._run(
            [
                (ReadParameters(self._peer, PARAMETER_NAMES), self._parameters_read),
                (Download(self._peer, m.MissionType.FENCE), self._fence_read),
                (Download(self._peer, m.MissionType.MISSION), self._mission_read),
                (SendCommand(self._peer, home), self._home_asked),
            ],
            now_s,
        )

    # Learning

    def _ask_streams(self, now_s: float) -> None:
        assert self._peer is not None
        if now_s >= self._streams_due_s:
            self._streams_due_s = now_s + _ASK_STREAMS_EVERY_S
            for stream in (_POSITION_STREAM, _STATUS_STREAM):
                self._send(
                    m.RequestDataStream(self._peer.system, self._peer.component, stream, _STREAM_HZ, 1)
                )

    def _parameters_read(self, machine: ReadParameters, _now_s: float) -> None:
        outcome = machine.outcome
        if outcome is None or outcome.is_silent:
            self._fail(LinkError("the vehicle does not answer when asked for its parameters"))
            return
        parameters = {**self.situation.parameters, **outcome.values}
        self.situation = replace(self.situation, parameters=parameters)

    def _fence_read(self, machine: Download, now_s: float) -> None:
        self._list_read(machine, ListKind.FENCE, now_s)

    def _mission_read(self, machine: Download, now_s: float) -> None:
        self._list_read(machine, ListKind.MISSION, now_s)

    def _list_read(self, machine: Download, kind: ListKind, now_s: float) -> None:
        outcome = machine.outcome
        if outcome is not None and outcome.is_complete:
            self.situation = with_list(
                self.situation, kind, outcome.items, now_s, f"{kind} read from the vehicle"
            )
        elif outcome is not None and outcome.result is not None:
            self._fail(RefusedError(f"the vehicle refused to give its {kind}: {outcome.result.name}"))
        else:
            self._fail(
                LinkError(
                    f"the vehicle's {kind} could not be read: {outcome.state if outcome else 'silence'}"
                )
            )

    def _home_asked(self, _machine: SendCommand, now_s: float) -> None:
        self._step_until_s = now_s + self._orders.patience_s
        self._await_position(now_s)

    def _await_position(self, now_s: float) -> None:
        if self._steps or self.state is not State.LEARNING:
            return
        if self.situation.pose is not None:
            self._move(Event.LEARNT)
        elif now_s >= self._step_until_s:
            self._fail(
                LinkError(f"the vehicle told no position within {self._orders.patience_s:g} s (no GPS fix?)")
            )
        else:
            self._ask_streams(now_s)

    # Uploading

    @property
    def _upload(self) -> VerifiedUpload | None:
        machine = self._steps[0][0] if self._steps else None
        return machine if isinstance(machine, VerifiedUpload) else None

    def _uploaded(self, machine: VerifiedUpload, now_s: float) -> None:
        self.upload_outcome = machine.outcome
        assert self.upload_outcome is not None
        if trouble := upload_trouble(self.upload_outcome):
            self._fail(trouble)
            return
        self._move(Event.UPLOAD_VERIFIED)
        if self._orders.drive and self._move(Event.DRIVE):
            self._start_driving(now_s)

    # Driving

    def _start_driving(self, now_s: float) -> None:
        assert self._peer is not None
        peer = self._peer

        def command(number: Command, param1: float, param2: float = 0.0) -> tuple[SendCommand, Any]:
            message = m.CommandLong(peer.system, peer.component, number, param1=param1, param2=param2)
            return SendCommand(peer, message), self._commanded

        steps = [command(Command.COMPONENT_ARM_DISARM, 1.0)] if self._orders.arm else []
        steps.append(command(Command.DO_SET_MODE, m.ModeFlag.CUSTOM_MODE_ENABLED, AUTO_MODE))
        # Only after the mode change: before it, in HOLD, ArduPilot reports internal errors.
        steps.append(command(Command.DO_SET_MISSION_CURRENT, 1.0, 1.0))
        self._run(steps, now_s)

    def _commanded(self, machine: SendCommand, now_s: float) -> None:
        outcome = machine.outcome
        assert outcome is not None
        if outcome.is_accepted:
            if not self._steps:
                self._driving_since_s = now_s
                self._move(Event.STARTED)
            return
        name = Command(outcome.command).name
        if outcome.result is None:
            self._fail(OutcomeError(f"the mission is on the vehicle, but {name} was not answered"))
        else:
            texts = "".join(f"; {text}" for text in outcome.texts)
            self._fail(
                RefusedError(
                    f"the mission is on the vehicle, but it refused {name}: {outcome.result.name}{texts}"
                )
            )

    def _watch(self, frame: Frame, now_s: float) -> None:
        """Follow the drive by what the vehicle says of it."""
        assert self._plan is not None
        if not self._is_from_vehicle(frame):
            return
        message = frame.message
        if isinstance(message, m.MissionCurrent):
            self.current_item = message.seq
        elif isinstance(message, m.MissionItemReached):
            self.current_item = message.seq
            if message.seq >= len(self._plan.items):
                self._move(Event.REACHED)
        elif isinstance(message, m.Heartbeat):
            self._watch_mode(message, now_s)

    def _watch_mode(self, heartbeat: m.Heartbeat, now_s: float) -> None:
        self._auto_seen = self._auto_seen or heartbeat.custom_mode == AUTO_MODE
        # A heartbeat from before the mode change may still be under way.
        is_settled = self._auto_seen or now_s - self._driving_since_s > _FRESH_S
        if heartbeat.custom_mode != AUTO_MODE:
            if not is_settled:
                return
            name = MODE_NAMES.get(heartbeat.custom_mode, str(heartbeat.custom_mode))
            self._fail(OutcomeError(f"the vehicle left AUTO for {name} before it arrived", mode=name))
        elif not heartbeat.base_mode & m.ModeFlag.SAFETY_ARMED:
            self._fail(
                OutcomeError("the mission is on the vehicle in AUTO, but it is not armed and does not drive")
            )

    def _is_from_vehicle(self, frame: Frame) -> bool:
        return self._peer is not None and (frame.system, frame.component) == (
            self._peer.system,
            self._peer.component,
        )

    # Steps, one machine after the other

    def _run(self, steps: list[tuple[Any, Callable[[Any, float], None]]], now_s: float) -> None:
        self._steps = steps
        self._steps[0][0].start(now_s)
        self._advance(now_s)

    def _advance(self, now_s: float) -> None:
        while self._steps and self._steps[0][0].is_done:
            machine, take_outcome = self._steps.pop(0)
            for message in machine.messages_to_send():
                self._send(message)
            following = self._steps[0] if self._steps else None
            take_outcome(machine, now_s)
            if following is not None and self._steps and self._steps[0] is following:
                following[0].start(now_s)

    def _fail(self, trouble: BridgeError) -> None:
        self._steps = []
        self.trouble = trouble
        self._move(Event.TROUBLE)
