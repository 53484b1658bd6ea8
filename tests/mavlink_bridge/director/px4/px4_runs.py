"""The director and a simulated PX4 rover on one link, in stepped time; every message it sends is read for the modes in it (`conducting`)."""

from __future__ import annotations

from pathlib import Path

import pytest
from director.conducting import Conductor
from director.test_bridge_director import FAR, HOME, NEAR, arm, ready, upload

from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import PX4_1_17
from mavlink_bridge.simulator import SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from mavlink_bridge.simulator.px4.vehicle import Px4Vehicle
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.firmware import Firmware
from missions.formats import read_fence
from missions.geo import LatLon
from missions.items import Command
from missions.request import Request

FENCE = read_fence(Path(__file__).parents[3] / "fields" / "yard-fence.waypoints")
V1_17, V1_18 = Firmware(1, 17, 0), Firmware(1, 18, 0, 0)
MODES = PX4_1_17.modes
MANUAL = 1 << 16
VERSIONS = pytest.mark.parametrize("firmware", [V1_17, V1_18], ids=str)
PX4_HOLD, PX4_MISSION = (4.0, 3.0), (4.0, 4.0)
WALL = Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0720000, -105.2289500), 6.0)))
"""The yard's fence with a circle on the way to the far target."""


def sent_items(fence: Fence) -> tuple:
    """A fence as PX4 wants it: circles last."""
    return PX4_1_17.lists.form.prepared(fence_to_items(fence), m.MissionType.FENCE)


def rover(firmware: Firmware = V1_18, fence: Fence = FENCE, **config: object) -> Px4Vehicle:
    given = {"parameters": {"RO_SPEED_LIM": 2.0}, **config}
    return Px4Vehicle(
        SimulatorConfig(
            home=HOME, fence=sent_items(fence), autopilot=m.Autopilot.PX4, firmware=firmware, **given
        )
    )


def conductor(vehicle: Px4Vehicle | None = None, faults: Faults | None = None, **orders: object) -> Conductor:
    given = {
        "request": Request(clearance_m=1.5),
        "upload": True,
        "drive": True,
        "arm": True,
        "announce": True,
        **orders,
    }
    return Conductor(Director(Orders(**given)), [vehicle or rover()], faults or Faults())


def driving(run: Conductor, target: LatLon = FAR) -> Conductor:
    ready(run)
    run.director.take_target(target, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 60)
    return run


__all__ = [
    "FAR",
    "FENCE",
    "HOME",
    "MANUAL",
    "MODES",
    "NEAR",
    "V1_17",
    "V1_18",
    "WALL",
    "arm",
    "conductor",
    "driving",
    "ready",
    "rover",
    "sent_items",
    "upload",
]


def unheard(run, message) -> None:
    """Let somebody act on the vehicle whom the bridge does not hear."""
    run.vehicles[0].receive(m.Frame(255, 190, message), run.now_s)


def mode_command(mode: int) -> m.CommandLong:
    return m.CommandLong(1, 1, Command.DO_SET_MODE, 0, *MODES.command_params(mode))


def wait(run, seconds: float) -> None:
    until_s = run.now_s + seconds
    while run.now_s < until_s:
        run.step()


def names(run) -> list[EventName]:
    return [event.name for event in run.events if event.name is not EventName.PROGRESS]
