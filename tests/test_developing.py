"""The trips that docs/developing.md describes are taken, and every function that it names is called on the way."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
import threading
import time
from functools import cached_property
from pathlib import Path
from typing import Self

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.live import BackupKeeper, PlanMaker
from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.link import Link
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import CommandInt, Frame
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig, SteppedRover
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, to_e7
from missions.items import Command
from missions.request import Request

PAGE = (Path(__file__).parents[1] / "docs" / "developing.md").read_text(encoding="utf-8")
NAMES = re.findall(r"`((?:pbpp|missions|mavlink_bridge)(?:\.\w+)+)`", PAGE)
HOME = LatLon(40.071374, -105.229930)
US, GROUND_STATION, ROVER = (245, 190), (255, 190), (1, 1)
FAR = LatLon(40.0720926, -105.2286152)


def named(name: str) -> object:
    """Return what a dotted name stands for: a module, or what is in one."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            found = inspect.getattr_static(found, part) if isinstance(found, type) else getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


def codes(thing: object) -> set:
    """Return the code of a function, or of all of a class's functions."""
    if isinstance(thing, type):
        return set().union(*(codes(value) for value in vars(thing).values() if not isinstance(value, type)))
    if isinstance(thing, property):
        return codes(thing.fget)
    if isinstance(thing, cached_property):
        return codes(thing.func)
    function = inspect.unwrap(getattr(thing, "__func__", thing)) if callable(thing) else None
    return {function.__code__} if inspect.isfunction(function) else set()


class Trip:
    """Notes what is called while it lasts, in all threads that are begun meanwhile."""

    def __init__(self) -> None:
        self.called: set = set()

    def __enter__(self) -> Self:
        threading.setprofile(self._note)
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)
        threading.setprofile(None)

    def _note(self, frame, event, _argument) -> None:
        if event == "call":
            self.called.add(frame.f_code)

    def missed(self, heading: str) -> list[str]:
        """Return the functions of a section that were not called."""
        section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
        functions = {name: codes(named(name)) for name in NAMES if f"`{name}`" in section}
        assert sum(map(bool, functions.values())) > 15
        return [name for name, own in functions.items() if own and not own & self.called]


@pytest.mark.parametrize("name", sorted(set(NAMES)))
def test_what_is_named_is_there(name):
    assert named(name) is not None


def test_a_recorded_log_becomes_a_mission(logs, tmp_path):
    mission = tmp_path / "mission.plan"
    with Trip() as trip:
        result = CliRunner().invoke(
            app, ["plan", "--log", str(logs / "guided-maze.tlog"), "-o", str(mission)]
        )
    assert result.exit_code == 0, result.output
    assert mission.exists()
    assert trip.missed("A recorded log becomes a mission") == []


class Clicked(SteppedRover):
    """A rover on a link that a ground station shares, which clicks when it is told to."""

    clicks = False

    def receive(self, timeout_s):
        came = super().receive(timeout_s)
        if not self.clicks:
            return came
        self.clicks = False
        lat_e7, lon_e7 = to_e7(FAR)
        click = CommandInt(*ROVER, 0, Command.DO_REPOSITION, param1=-1.0, param2=1.0, x=lat_e7, y=lon_e7)
        self.vehicle.receive(Frame(*GROUND_STATION, click), self._vehicle_s)
        return [*came, (None, Codec(*GROUND_STATION).encode(click))]


def test_a_click_becomes_auto(fields, state_folder):
    fence = fence_to_items(read_fence(fields / "yard-fence.waypoints"))
    rover = Clicked(
        SimulatedVehicle(SimulatorConfig(home=HOME, fence=fence, parameters={"FENCE_ENABLE": 1.0})), 1e4
    )
    director = Director(
        Orders(identity=US, request=Request(clearance_m=2.5), upload=True, drive=True, arm=True)
    )
    plans, backups = PlanMaker(director), BackupKeeper(director, "")
    has_clicked = False

    def step() -> None:
        nonlocal has_clicked
        backups.step(link.now_s())
        while (made := plans.take()) is None and director.pending_plan is not None:
            time.sleep(0.01)
        if made is not None:
            director.plan_made(*made, link.now_s())
        if director.state is State.READY and not has_clicked:
            has_clicked = rover.clicks = True

    with Trip() as trip, Link(rover, US, clock=rover.now_s) as link:
        link.run(director, timeout_s=300, on_step=step, until=lambda: director.state is State.DRIVING)
    assert list(state_folder.rglob("*")), "no backup"
    assert trip.missed("A click in the ground station becomes AUTO") == []
