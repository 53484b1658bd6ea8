"""The bridge's live view, drawn to a text."""

from __future__ import annotations

import io

from director.test_bridge_director import FAR, driving
from rich.console import Console

from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.director import Event, EventName


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


def driving_for(metres):
    run = driving(conductor_of())
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > metres)
    return run


def conductor_of():
    from director.test_bridge_director import conductor

    return conductor()
