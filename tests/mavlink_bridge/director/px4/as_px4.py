"""Scenarios that were written for ArduPilot's rover, run with PX4's: what differs in how a scenario is told is put in its place here.

The scenarios themselves stand as they are in their own modules; `Personality` replaces names in them for the time of a test.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from director import conducting

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import PX4_1_17, autopilot_of
from mavlink_bridge.mavlink.modes import px4_mode
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.simulator import SimulatorConfig
from mavlink_bridge.simulator.px4.vehicle import Px4Vehicle
from missions.fence import Fence, fence_to_items
from missions.items import Command, MissionItem

if TYPE_CHECKING:
    from types import ModuleType

    import pytest

    from mavlink_bridge.simulator.px4.rover import Px4Rover
    from missions.firmware import Firmware
    from missions.geo import LatLon

MODES = PX4_1_17.modes
MANUAL = px4_mode(1)
_OWN = {
    int(Mode.MANUAL): MANUAL,
    int(Mode.HOLD): MODES.hold,
    int(Mode.AUTO): MODES.mission,
    int(Mode.RTL): MODES.rtl,
    int(Mode.SMART_RTL): MODES.rtl,
}
"""PX4's modes by ArduPilot's numbers, as scenarios name them; GUIDED and the others are none."""


def own_mode(number: int) -> int:
    """Return PX4's mode of a number that a scenario names."""
    return _OWN.get(int(number), int(number))


class AnyMode(int):
    """A mode of PX4's that is the same by either number."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, int) and own_mode(other) == int(self)

    def __hash__(self) -> int:
        return int.__hash__(self)


class Px4Modes:
    """Stands for `Mode`."""

    MANUAL, HOLD, AUTO, RTL, SMART_RTL = (
        AnyMode(one) for one in (MANUAL, MODES.hold, MODES.mission, MODES.rtl, MODES.rtl)
    )
    GUIDED = AnyMode(MODES.hold)  # where a click drives it
    LOITER = AnyMode(MODES.hold)


def told(message: m.Message) -> m.Message:
    """Return what somebody asks for as PX4 takes it."""
    if isinstance(message, m.SetMode):
        mode = own_mode(message.custom_mode)
        params = MODES.command_params(mode)
        return m.CommandLong(message.target_system, 1, Command.DO_SET_MODE, 0, *params)
    return message


class _MissionNumber:
    """Stands for what ArduPilot's rover knows of its mission."""

    def __init__(self, rover: Px4Rover) -> None:
        self._rover = rover

    @property
    def seq(self) -> int:
        """The item that it drives to, home counted as 0."""
        return self._rover.progress.seq + 1


class Px4Stand(Px4Vehicle):
    """A PX4 rover behind the names that scenarios use."""

    def __init__(self, config: SimulatorConfig) -> None:
        super().__init__(config)
        self.rover.mission_run = _MissionNumber(self.rover)

    @property
    def mode(self) -> AnyMode:
        """HEARTBEAT.custom_mode."""
        return AnyMode(super().mode)

    @property
    def breaches(self) -> int:
        """How often it has left allowed ground."""
        return self.rover.breaches

    def receive(self, frame: m.Frame, now_s: float) -> None:
        """Take a frame; MANUAL is there with a remote control, which nobody simulates."""
        message = told(frame.message)
        is_mode = isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
        if is_mode and message.param2 == 1.0:
            self.rover._enter((1, 0))
            return
        super().receive(replace(frame, message=message), now_s)


def px4_config(firmware: Firmware, **given: object) -> SimulatorConfig:
    """Return a configuration of ArduPilot's rover as one of PX4's."""
    parameters = given.pop("parameters", {})
    speed_mps = parameters.get("WP_SPEED", 2.0)
    known = {name: value for name, value in parameters.items() if name.startswith(("GF_", "RO_"))}
    return SimulatorConfig(
        parameters={"RO_SPEED_LIM": min(3.0, speed_mps), **known},
        autopilot=m.Autopilot.PX4,
        firmware=firmware,
        **given,
    )


def px4_fence(fence: Fence) -> tuple[MissionItem, ...]:
    """Return a fence as PX4 wants it."""
    return PX4_1_17.lists.form.prepared(fence_to_items(fence), m.MissionType.FENCE)


def px4_mission(items: tuple[MissionItem, ...], _home: LatLon) -> tuple[MissionItem, ...]:
    """Return a mission as PX4 wants it: without home, its first item the current one."""
    return (replace(items[0], current=True), *items[1:])


def modes_sent(run, since: int = 0) -> list[AnyMode]:
    """Return the modes that the bridge asked for."""
    return [
        AnyMode(MODES.asked_for(message.param2, message.param3))
        for message in run.sent[since:]
        if isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
    ]


def put_in_place(monkeypatch: pytest.MonkeyPatch, modules: list[ModuleType], firmware: Firmware) -> None:
    """Have scenarios run with a PX4 rover for the time of a test."""

    table = autopilot_of(ardupilot=False, firmware=firmware)
    names = {
        "Peer": partial(Peer, autopilot=table),
        "Mode": Px4Modes,
        "MANUAL": MANUAL,
        "RTL": m.SetMode(1, 1, MODES.rtl),
        "SimulatedVehicle": Px4Stand,
        "SimulatorConfig": lambda **given: px4_config(firmware, **given),
        "fence_to_items": px4_fence,
        "with_home": px4_mission,
        "modes_sent": modes_sent,
    }
    for module in modules:
        for name, value in names.items():
            if hasattr(module, name):
                monkeypatch.setattr(module, name, value)
    ground_station = conducting.Conductor.ground_station
    monkeypatch.setattr(
        conducting.Conductor, "ground_station", lambda run, message: ground_station(run, told(message))
    )
