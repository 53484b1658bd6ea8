"""The bridge's live view, drawn to a text."""

from __future__ import annotations

import io
import re

import pytest
from director.test_bridge_director import FAR, driving
from rich.console import Console

from mavlink_bridge.cli import bridge_view
from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.director import Event, EventName
from mavlink_bridge.director.orders import Homing
from mavlink_bridge.mavlink import messages as m
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


def shown_on(run, *, width=80, height=24, lines=(), typing="", heard=True) -> str:
    """Return what a terminal shows of a view at last."""
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=width, height=height, color_system=None)
    with LiveView(run.director, console) as view:
        view.keyboard._waiting, view.keyboard.is_shown_by_us = typing.encode(), True
        if heard:
            view.hear([m.Frame(1, 1, m.BatteryStatus(0, (12_300, *[65535] * 9), 87))], run.now_s)
        for line in lines:
            view.answer(line, is_warning=True)
        view.show(run.now_s)
        view.keyboard.is_shown_by_us = False
        shown = text.getvalue()
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.rpartition("\x1b[2K")[2])


@pytest.mark.parametrize(("width", "height"), [(80, 24), (60, 20), (132, 50), (40, 12)])
def test_it_fits_the_terminal_and_leaves_room_for_what_is_told(width, height):
    run = driving_for(15)
    shown = shown_on(run, width=width, height=height, typing="40.07, -105.2291", heard=True)
    lines = shown.splitlines()
    assert len(lines) <= height - (4 if width >= 60 else 1)  # rows are wrapped on a narrow one
    assert max(map(len, lines)) <= width
    assert any(line.startswith(">") and line.rstrip().endswith("40.07, -105.2291_") for line in lines)
    if height >= 24:
        assert any(sign in shown for sign in "↑↗→↘↓↙←↖")
        assert "rover" in shown
        assert "87 % 12.3 V" in shown
        assert "promised" in shown


def test_what_is_typed_is_answered_in_one_line_and_a_long_line_shows_its_end():
    run = driving_for(5)
    shown = shown_on(run, lines=["x" * 300], typing="a" * 300 + "b")
    (answer,) = [line for line in shown.splitlines() if line.startswith("answer")]
    assert len(answer.rstrip()) <= 80
    assert answer.rstrip().endswith("…")
    (typed,) = [line for line in shown.splitlines() if line.startswith(">")]
    assert typed.rstrip().endswith("ab_")


def test_a_map_that_cannot_be_drawn_ends_no_drive(monkeypatch):
    def broken(*_facts, **_more):
        raise ValueError("no map")

    monkeypatch.setattr(bridge_view, "sketch_of", broken)
    shown = shown_on(driving_for(5))
    assert "the map cannot be drawn: ValueError: no map" in shown
    assert "driving" in shown


def test_outside_its_corridor_is_said():
    run = driving_for(5)
    run.vehicles[0].rover.body.position_m += 3j * run.vehicles[0].rover.body.direction
    run.run_until(lambda: run.director.drive.is_outside, 5)
    assert "OUTSIDE the predicted corridor" in shown_on(run)


def driving_for(metres, **orders):
    run = driving(conductor_of(**orders))
    run.run_until(lambda: run.director.drive is not None and run.director.drive.driven_m > metres)
    return run


def conductor_of(**orders):
    from director.test_bridge_director import conductor

    return conductor(**orders)
