"""The embedded rover: a simulated ArduRover behind a MAVLink 2 link."""

from mavlink_bridge.simulator.config import Battery, MovingDisc, Receiver, SimulatorConfig
from mavlink_bridge.simulator.shell import Simulator
from mavlink_bridge.simulator.stepped import SteppedRover
from mavlink_bridge.simulator.vehicle import SimulatedVehicle

__all__ = [
    "Battery",
    "MovingDisc",
    "Receiver",
    "SimulatedVehicle",
    "Simulator",
    "SimulatorConfig",
    "SteppedRover",
]
