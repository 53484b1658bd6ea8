"""The director and simulated vehicles on one link, in stepped time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.messages import Frame
from mavlink_bridge.simulator.faults import Faults, FaultyLink

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.director import Director, State
    from mavlink_bridge.simulator import SimulatedVehicle


@dataclass
class Conductor:
    """What the live shell does: stores backups, carries frames, collects events."""

    director: Director
    vehicles: list[SimulatedVehicle]
    faults: Faults = field(default_factory=Faults)
    now_s: float = 0.0
    backups: list = field(default_factory=list)
    sent: list = field(default_factory=list)
    events: list = field(default_factory=list)
    meddle: Callable[[Conductor], None] | None = None

    def __post_init__(self) -> None:
        self.up = FaultyLink(self.faults, 1)
        self.down = FaultyLink(self.faults, 2)

    def run(self, until_s: float = 400.0) -> State:
        self.director.start(self.now_s)
        while not self.director.is_done and self.now_s < until_s:
            self._shell()
            for message in self.director.messages_to_send():
                self.sent.append(message)
                self.up.push(Frame(*self.director.identity, message), self.now_s)
            for frame in self.up.due(self.now_s):
                for vehicle in self.vehicles:
                    vehicle.receive(frame, self.now_s)
            for vehicle in self.vehicles:
                vehicle.handle_timer(self.now_s)
                for message in vehicle.messages_to_send():
                    self.down.push(
                        Frame(vehicle.config.system, vehicle.config.component, message), self.now_s
                    )
            for frame in self.down.due(self.now_s):
                self.director.receive(frame, self.now_s)
            self.director.handle_timer(self.now_s)
            self.events += self.director.take_events()
            if self.meddle:
                self.meddle(self)
            self.now_s += 0.02
        return self.director.state

    def _shell(self) -> None:
        if (old := self.director.pending_backup) is not None:
            self.backups.append(old)
            self.director.backup_stored(self.now_s)
