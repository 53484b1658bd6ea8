"""The director and simulated vehicles on one link, in stepped time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Autopilot, CommandInt, CommandLong, Frame, SetMode
from mavlink_bridge.simulator.faults import Faults, FaultyLink
from missions.items import Command
from missions.planning.plan import plan as make_plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.director import Director, Event, EventName, State
    from mavlink_bridge.director.plan_task import PlanTask
    from mavlink_bridge.mavlink.messages import Message
    from mavlink_bridge.simulator import SimulatedVehicle
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


@dataclass
class Conductor:
    """What the live shell does: stores backups, carries frames, collects events."""

    director: Director
    vehicles: list[SimulatedVehicle]
    faults: Faults = field(default_factory=Faults)
    now_s: float = 0.0
    backups: list = field(default_factory=list)
    sent: list = field(default_factory=list)
    modes_sent: list = field(default_factory=list)
    events: list = field(default_factory=list)
    is_cut: bool = False
    is_started: bool = False
    meddle: Callable[[Conductor], None] | None = None
    planner: Callable[[Situation, Request], Plan] = make_plan
    planning_s: float = 0.0
    note: DriveNote | None = None
    _task: tuple[float, PlanTask] = (0.0, None)

    def __post_init__(self) -> None:
        self.up = FaultyLink(self.faults, 1)
        self.down = FaultyLink(self.faults, 2)

    def run(self, until_s: float = 400.0) -> State:
        """Run a single job to its end."""
        self.run_until(lambda: self.director.is_done, until_s)
        return self.director.state

    def run_until(self, condition: Callable[[], bool], within_s: float = 200.0) -> float:
        """Run until something is so, and tell when; fails if it never is."""
        if not self.is_started:
            self.is_started = True
            self.director.start(self.now_s)
        limit_s = self.now_s + within_s
        while not condition():
            if self.now_s > limit_s or (self.director.is_done and self.now_s > limit_s - within_s + 1):
                names = [str(event.name) for event in self.events]
                raise AssertionError(f"not within {within_s} s; state {self.director.state}, events {names}")
            self.step()
        return self.now_s

    def step(self) -> None:
        """Let 20 ms pass."""
        if (old := self.director.pending_backup) is not None:
            self.backups.append(old)
            self.director.backup_stored(self.now_s)
        if self.director.drive_note is not self.note:
            self.note = self.director.drive_note
            self.director.note_stored()
        self.make_plan()
        for message in self.director.messages_to_send():
            self.sent.append(message)
            self._check_modes(message)
            self.up.push(Frame(*(self.director.identity or (245, 190)), message), self.now_s)
        for frame in self.up.due(self.now_s):
            for vehicle in self.vehicles:
                vehicle.receive(frame, self.now_s)
        for vehicle in self.vehicles:
            vehicle.handle_timer(self.now_s)
            for message in vehicle.messages_to_send():
                self.down.push(Frame(vehicle.config.system, vehicle.config.component, message), self.now_s)
        for frame in self.down.due(self.now_s):
            if not self.is_cut:  # what comes meanwhile is lost
                self.director.receive(frame, self.now_s)
        deadline_s = self.director.deadline_s
        if deadline_s is not None and deadline_s <= self.now_s:
            self.director.handle_timer(self.now_s)
        self.events += self.director.take_events()
        if self.meddle:
            self.meddle(self)
        self.now_s += 0.02

    def _check_modes(self, message: Message) -> None:
        """Read every message that is sent: no mode of one autopilot may go to another, where ArduPilot's HOLD makes a PX4 rover drive its mission."""
        for vehicle in self.vehicles:
            is_px4 = vehicle.config.autopilot is Autopilot.PX4
            if isinstance(message, SetMode):
                raise AssertionError("the bridge sends no SET_MODE")  # noqa: TRY004 - it is what is tested
            if isinstance(message, CommandInt | CommandLong) and message.command == Command.DO_SET_MODE:
                params = message.param1, message.param2, message.param3
                known = {(1.0, 4.0, 3.0), (1.0, 4.0, 4.0)} if is_px4 else {(1.0, 4.0, 0.0), (1.0, 10.0, 0.0)}
                assert params in known, f"mode {params} to {vehicle.config.autopilot.name}"
                self.modes_sent.append(params[1:])

    def make_plan(self) -> None:
        """Make the plan that is waited for, once the time has passed that planning takes."""
        task = self.director.pending_plan
        if task is not self._task[1]:
            self._task = (self.now_s + self.planning_s, task)
        if task is not None and self.now_s >= self._task[0]:
            self.director.plan_made(task, task.made(self.planner), self.now_s)
        if (ways := self.director.pending_ways) is not None:
            self.director.ways_made(ways, ways.made(), self.now_s)

    def ground_station(self, message: Message) -> None:
        """Let a ground station send to the vehicles; the director hears it too, as on a shared radio."""
        frame = Frame(255, 190, message)
        for vehicle in self.vehicles:
            vehicle.receive(frame, self.now_s)
        self.down.push(frame, self.now_s)

    def happened(self, name: EventName, after: int = 0) -> Callable[[], bool]:
        """Return a condition: an event came, after the first so many events."""
        return lambda: any(event.name is name for event in self.events[after:])

    def last(self, name: EventName) -> Event:
        """Return the newest event of a name."""
        return next(event for event in reversed(self.events) if event.name is name)
