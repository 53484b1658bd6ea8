"""Listening for vehicles: who is there, and which one is meant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.messages import Heartbeat
from mavlink_bridge.vehicles import Vehicle, choose_vehicle, is_vehicle

if TYPE_CHECKING:
    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.messages import Frame


@dataclass(frozen=True, slots=True)
class Heard:
    """A vehicle, its newest heartbeat and when that came."""

    vehicle: Vehicle
    heartbeat: Frame
    time_s: float


class Listener:
    """Collects heartbeats until it is clear who is meant.

    Parameters
    ----------
    orders : Orders
        Whom to look for, how long to wait, and how long to listen for further vehicles.
    """

    def __init__(self, orders: Orders) -> None:
        self.until_s = math.inf
        self._orders = orders
        self._heard: dict[int, Heard] = {}

    def start(self, now_s: float) -> None:
        """Begin; a single job does not wait for ever."""
        if self._orders.once:
            self.until_s = now_s + self._orders.patience_s

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        heartbeat = frame.message
        if not isinstance(heartbeat, Heartbeat) or not is_vehicle(heartbeat):
            return
        if not self._heard:
            self.until_s = now_s + self._orders.listen_s
        self._heard[frame.system] = Heard(
            Vehicle(frame.system, frame.component, heartbeat.type), frame, now_s
        )
        if frame.system == self._orders.system:
            self.until_s = now_s

    def choose(self) -> Heard:
        """Give the vehicle that is meant.

        Raises
        ------
        VehicleNotFoundError
            Nobody fits, or several do and no system id was given.
        """
        orders = self._orders
        vehicles = [heard.vehicle for heard in self._heard.values()]
        vehicle = choose_vehicle(vehicles, orders.system, any_vehicle=orders.any_vehicle)
        return self._heard[vehicle.system]
