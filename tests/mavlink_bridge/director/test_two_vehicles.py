"""Two rovers on one link and a bridge for each: in stepped time, and over sockets."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from pathlib import Path

import pytest

from mavlink_bridge.cli.live import PlanMaker
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.link import Link, open_link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator import SimulatedVehicle, Simulator, SimulatorConfig
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, to_e7
from missions.items import Command
from missions.request import Request

YARD = read_fence(Path(__file__).parents[2] / "fields" / "yard-fence.waypoints")
FENCES = {
    1: YARD,
    2: Fence((*YARD.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0721500, -105.2301000), 4.0))),
}
HOMES = {1: LatLon(40.071374, -105.229930), 2: LatLon(40.0712500, -105.2294000)}
TARGETS = {1: LatLon(40.0720926, -105.2286152), 2: LatLon(40.0719500, -105.2300500)}


def config(system: int) -> SimulatorConfig:
    fence = fence_to_items(FENCES[system])
    return SimulatorConfig(system=system, home=HOMES[system], fence=fence, parameters={"FENCE_ENABLE": 1.0})


def director(system: int, **orders: bool) -> Director:
    return Director(
        Orders(system=system, request=Request(clearance_m=2.0), upload=True, announce=True, **orders)
    )


class Ether:
    """One link that everybody hears: two vehicles, two bridges, a ground station."""

    def __init__(self, **orders: bool) -> None:
        self.vehicles = {system: SimulatedVehicle(config(system)) for system in (1, 2)}
        self.directors = {system: director(system, **orders) for system in (1, 2)}
        self.events: dict[int, list] = {1: [], 2: []}
        self.sent: list[m.Frame] = []
        self.now_s = 0.0
        for one in self.directors.values():
            one.start(0.0)

    def send(self, frame: m.Frame) -> None:
        self.sent.append(frame)
        for vehicle in self.vehicles.values():
            if (frame.system, frame.component) != (vehicle.config.system, 1):
                vehicle.receive(frame, self.now_s)
        for one in self.directors.values():
            if (frame.system, frame.component) != one.identity:
                one.receive(frame, self.now_s)

    def step(self) -> None:
        for system, one in self.directors.items():
            if one.pending_backup is not None:
                one.backup_stored(self.now_s)
            one.note_stored()
            if (task := one.pending_plan) is not None:
                one.plan_made(task, task.made(), self.now_s)
            for message in one.messages_to_send():
                assert one.identity == (system, 195)
                self.send(m.Frame(system, 195, message))
            if (deadline_s := one.deadline_s) is not None and deadline_s <= self.now_s:
                one.handle_timer(self.now_s)
            self.events[system] += one.take_events()
        for system, vehicle in self.vehicles.items():
            vehicle.handle_timer(self.now_s)
            for message in vehicle.messages_to_send():
                self.send(m.Frame(system, 1, message))
        self.now_s += 0.02

    def run_until(self, condition, within_s: float = 60.0) -> None:
        limit_s = self.now_s + within_s
        while not condition():
            assert self.now_s < limit_s, [one.state for one in self.directors.values()]
            self.step()

    def happened(self, system: int, name: EventName) -> bool:
        return any(event.name is name for event in self.events[system])


def test_each_bridge_learns_its_own_vehicle_only():
    ether = Ether()
    ether.run_until(lambda: all(one.state is State.READY for one in ether.directors.values()))
    for system, one in ether.directors.items():
        assert one.situation.system == system
        assert one.situation.fence.value == FENCES[system]


def test_a_click_for_one_vehicle_is_none_for_the_other():
    ether = Ether(drive=True, arm=True)
    ether.run_until(lambda: all(one.state is State.READY for one in ether.directors.values()))
    lat_e7, lon_e7 = to_e7(TARGETS[2])
    click = m.CommandInt(2, 1, 0, Command.DO_REPOSITION, param1=-1.0, param2=1.0, x=lat_e7, y=lon_e7)
    ether.send(m.Frame(255, 190, click))
    ether.run_until(lambda: ether.directors[2].state is State.ARRIVED, 200)
    assert ether.directors[1].state is State.READY
    assert not ether.happened(1, EventName.TARGET)
    assert len(ether.vehicles[1].mission) <= 1
    assert not ether.vehicles[1].is_armed


def test_both_upload_at_once_and_neither_hears_the_others_fence_change():
    ether = Ether()
    ether.run_until(lambda: all(one.state is State.READY for one in ether.directors.values()))
    for system, one in ether.directors.items():
        one.take_target(TARGETS[system], ether.now_s)
    ether.run_until(lambda: all(one.state is State.VERIFIED for one in ether.directors.values()), 10)
    for system, vehicle in ether.vehicles.items():
        assert vehicle.mission[-1].position == TARGETS[system]
    changed = fence_to_items(FENCES[2])
    ether.send(m.Frame(255, 190, m.MissionCount(1, 1, len(changed), m.MissionType.FENCE)))
    for seq, item in enumerate(changed):
        ether.step()
        ether.step()
        values = (*item.params, item.lat_e7, item.lon_e7, 0.0, m.MissionType.FENCE)
        ether.send(m.Frame(255, 190, m.MissionItemInt(1, 1, seq, 3, item.command, 0, 1, *values)))
    ether.run_until(lambda: ether.happened(1, EventName.FENCE_CHANGED), 20)
    for _ in range(200):
        ether.step()
    assert not ether.happened(2, EventName.FENCE_CHANGED)
    assert {frame.system for frame in ether.sent if frame.component == 195} == {1, 2}


class Hub:
    """What mavlink-router does: each datagram goes to everybody else."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.connection = f"udpout:127.0.0.1:{self._socket.getsockname()[1]}"
        self._ends: dict[tuple[str, int], None] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.is_set():
            with contextlib.suppress(OSError):  # nobody spoke, or somebody is gone
                data, end = self._socket.recvfrom(65536)
                self._ends.setdefault(end)
                for other in self._ends:
                    if other != end:
                        self._socket.sendto(data, other)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._socket.close()


@pytest.fixture
def hub():
    hub = Hub()
    yield hub
    hub.close()


def serve(link: Link, one: Director, stop: threading.Event) -> None:
    """Do what the shell of `pbpp bridge` does."""
    plans = PlanMaker(one)

    def step() -> None:
        if one.pending_backup is not None:
            one.backup_stored(time.time())
        one.note_stored()
        if (made := plans.take()) is not None:
            one.plan_made(*made, time.time())

    link.run(one, on_step=step, until=stop.is_set, longest_wait_s=plans.longest_wait_s)


def test_two_bridges_over_sockets(hub):
    stop = threading.Event()
    directors = {system: director(system) for system in (1, 2)}
    with contextlib.ExitStack() as stack:
        simulators = {
            system: stack.enter_context(Simulator(config(system), hub.connection)) for system in (1, 2)
        }
        threads = []
        for one in directors.values():
            link = stack.enter_context(open_link(hub.connection, one.identity))
            threads.append(threading.Thread(target=serve, args=(link, one, stop)))
            threads[-1].start()
        try:
            wait_for(lambda: all(one.state is State.READY for one in directors.values()))
            for system, one in directors.items():
                one.take_target(TARGETS[system], time.time())
            wait_for(lambda: all(one.state is State.VERIFIED for one in directors.values()))
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        for system, simulator in simulators.items():
            assert simulator.vehicle.mission[-1].position == TARGETS[system]
            assert directors[system].situation.fence.value == FENCES[system]


def wait_for(condition, within_s: float = 120.0) -> None:
    until_s = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < until_s
        time.sleep(0.05)
