"""The bridge's live view, drawn to a text."""

from __future__ import annotations

import io

import pytest
from director.test_bridge_director import FAR, driving
from rich.console import Console

from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.director import Event, EventName
from mavlink_bridge.director.orders import Homing
from missions.geo import LatLon


def test_shows_state_vehicle_route_and_map():
    run = driving_for(20)
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=100, height=60)
    with LiveView(run.director, console) as view:
        view.tell(Event.of(0.0, EventName.TARGET, f"target {FAR}", (list(FAR), "typed")))
        view.tell(Event.of(0.0, EventName.LINK_BACK, "heard again", ()))
        view.show(run.now_s)
        view.show(run.now_s)
        run.step()
        view.show(run.now_s + 20.0)
    shown = text.getvalue()
    for part in (
        "driving",
        "system 1, AUTO, armed",
        "m, the least so far",
        "target 40.07",
        "heard again",
        "▓",
    ):
        assert part in shown


@pytest.mark.parametrize(("places", "shown"), [({}, "home, "), ({"shed": LatLon(50.0, 10.0)}, "none: ")])
def test_shows_the_way_home(places, shown):
    run = driving_for(5, homing=Homing(is_kept=True, places=places))
    if places:
        run.vehicles[0].rover.home = run.vehicles[0]._home = places["shed"]
        run.run_until(lambda: run.director.no_way_home, 30)
    text = io.StringIO()
    with LiveView(run.director, Console(file=text, force_terminal=True, width=150, height=60)) as view:
        view.show(run.now_s)
    (line,) = {line for line in text.getvalue().splitlines() if "way home" in line}
    assert shown in line


def driving_for(metres, **orders):
    run = driving(conductor_of(**orders))
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > metres)
    return run


def conductor_of(**orders):
    from director.test_bridge_director import conductor

    return conductor(**orders)
