"""Whose rover it is: each autopilot's own vehicle behind the same calls, so that one link serves them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from mavlink_bridge.mavlink.messages import Autopilot
from mavlink_bridge.simulator.px4.vehicle import Px4Vehicle
from mavlink_bridge.simulator.vehicle import SimulatedVehicle

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.simulator.config import SimulatorConfig


AUTOPILOTS = {"ardupilot": Autopilot.ARDUPILOTMEGA, "px4": Autopilot.PX4}
"""Whose rover may be simulated, by the name that a person gives."""


class AnyVehicle(Protocol):
    """What a link needs of a simulated vehicle."""

    config: SimulatorConfig

    @property
    def deadline_s(self) -> float:
        """When `handle_timer` wants to be called."""
        ...

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        ...

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        ...

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent, and forget it."""
        ...


def vehicle_of(config: SimulatorConfig) -> SimulatedVehicle | Px4Vehicle:
    """Return the vehicle of a configuration."""
    return Px4Vehicle(config) if config.autopilot is Autopilot.PX4 else SimulatedVehicle(config)
