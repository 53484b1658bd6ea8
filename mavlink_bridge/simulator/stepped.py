"""The simulated rover as the other end of a link in the same thread, by a clock that both ends share."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.codec import Codec

if TYPE_CHECKING:
    from collections.abc import Hashable

    from mavlink_bridge.simulator.any_vehicle import AnyVehicle

_CATCH_UP_S = 0.1  # what it is behind by more is not caught up; chosen, not measured


class SteppedRover:
    """A transport with a simulated rover behind it, whose time passes only while somebody waits for its messages.

    A computer that is slow or pauses makes the drive slow, never the link silent: nobody's patience runs while nothing runs.

    ::

        rover = SteppedRover(SimulatedVehicle(config), speedup=4.0)
        with Link(rover, clock=rover.now_s) as link: ...

    Parameters
    ----------
    vehicle : SimulatedVehicle or Px4Vehicle
    speedup : float
        How many times faster than real the time runs, at most.

    Attributes
    ----------
    vehicle : SimulatedVehicle or Px4Vehicle
    """

    is_stream = True

    def __init__(self, vehicle: AnyVehicle, speedup: float) -> None:
        self.vehicle = vehicle
        self._codec = Codec(vehicle.config.system, vehicle.config.component)
        self._speedup = speedup
        self._epoch_s = time.time()
        self._real_s = time.monotonic()
        self._vehicle_s = 0.0

    def now_s(self) -> float:
        """Return the time by which the rover and its link run: seconds since 1970."""
        return self._epoch_s + self._vehicle_s

    def send(self, data: bytes) -> None:
        """Deliver bytes to the rover."""
        for frame in self._codec.decode(data):
            self.vehicle.receive(frame, self._vehicle_s)

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Let time pass until the rover sends something, at most so long."""
        until_s = self._vehicle_s + timeout_s
        while True:
            self._pass_until(min(until_s, max(self._vehicle_s, self.vehicle.deadline_s)))
            self.vehicle.handle_timer(self._vehicle_s)
            messages = self.vehicle.messages_to_send()
            if messages or self._vehicle_s >= until_s:
                return [(None, b"".join(map(self._codec.encode, messages)))] if messages else []

    def heard(self, source: Hashable) -> None:
        """Do nothing: there is one other end."""

    def close(self) -> None:
        """Do nothing: there is no device."""

    def _pass_until(self, vehicle_s: float) -> None:
        """Wait as long as the speed-up asks; time that was lost is made up for only a little."""
        due_s = self._real_s + (vehicle_s - self._vehicle_s) / self._speedup
        time.sleep(max(0.0, due_s - time.monotonic()))
        self._real_s = max(due_s, time.monotonic() - _CATCH_UP_S)
        self._vehicle_s = vehicle_s
