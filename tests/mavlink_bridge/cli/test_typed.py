"""Every typed line gets an answer; and the view says when the vehicle is not heard, and how old all is."""

from __future__ import annotations

import contextlib
import io
import re
import threading
from importlib import import_module

import pytest
from director.test_bridge_director import FAR, conductor, ready
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.cli.failing import begin_telling
from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.opening import Opening
from mavlink_bridge.cli.terminating import terminable
from mavlink_bridge.cli.typed import CONFIRM, TypedObstacle, understood
from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.errors import LinkError
from missions.geo import LatLon

bridge = import_module("mavlink_bridge.cli.bridge")


def proposed(**orders):
    run = ready(conductor(drive=False, confirm=True, **orders))
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.PROPOSED)
    return run


def test_a_yes_to_a_plan_that_waits_for_it():
    run = proposed()
    typed = understood("YES", run.director)
    assert (typed.confirms, typed.is_taken, typed.answer) == (True, True, "yes: uploading the plan")
    run.director.confirm(run.now_s)
    typed = understood("yes", run.director)
    assert not typed.is_taken
    assert typed.answer == "nothing to confirm: no plan is proposed"


@pytest.mark.parametrize(
    ("orders", "why"),
    [
        ({}, "without --upload plans are only reported"),
        ({"upload": True}, "plans are uploaded without a yes (--confirm waits for it)"),
        ({"upload": True, "confirm": True}, "no plan is proposed"),
    ],
)
def test_a_yes_to_nothing(orders, why):
    assert understood("y", Director(Orders(**orders))).answer == f"nothing to confirm: {why}"


def test_targets_are_taken_also_before_a_vehicle_is_heard():
    typed = understood("40.0720926, -105.2286152", Director(Orders()))
    assert typed.target == FAR
    assert typed.answer == f"target {FAR} accepted: planned as soon as a vehicle is heard"
    run = ready(conductor(drive=False))
    assert understood(str(FAR), run.director).answer == f"target {FAR} accepted"


@pytest.mark.parametrize("line", ["hold", "foo bar", "no", "?", "help", "\x1b[mJ", "x" * 500])
def test_other_words_are_told_what_can_be_typed(line):
    typed = understood(line, Director(Orders()))
    assert not typed.is_taken
    assert typed.answer.startswith("not understood: ")
    assert "type LAT,LON for a target, or yes to upload" in typed.answer
    assert typed.answer.isprintable()
    assert len(typed.answer) < 250


@pytest.mark.parametrize("line", ["91,0", "40.07", "40,200", "1e999,3", "1,2,3,4", "\x1b[2J"])
def test_what_is_no_position_is_said_why(line):
    typed = understood(line, Director(Orders()))
    assert not typed.is_taken
    assert typed.answer.startswith("not accepted: ")


@given(st.text())
def test_any_line_has_an_answer_of_one_harmless_line(line):
    typed = understood(line, Director(Orders()))
    assert typed.answer
    assert typed.answer.isprintable()


def shown(run, now_s: float, trouble: str | None = None) -> str:
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=140, height=60, color_system=None)
    with LiveView(run.director, console) as view:
        view.link_trouble = trouble
        view.show(now_s)
    return text.getvalue()


def test_the_view_asks_for_the_yes():
    run = proposed()
    assert CONFIRM in shown(run, run.now_s)
    assert "LINK LOST" not in shown(run, run.now_s)
    assert " old)" not in shown(run, run.now_s)


def test_the_view_says_that_the_link_is_gone_while_it_is_opened_again():
    run = proposed()
    run.is_cut = True
    heard_s = run.director.heard_s
    found = shown(run, heard_s + 4.0, "tcp:127.0.0.1:5760 cannot be opened: Connection refused")
    assert "LINK LOST: last heard 4 s ago (tcp:127.0.0.1:5760 cannot be opened: Connection refused)" in found
    assert re.search(r"disarmed, RTK fixed \(4 s old\)", found)
    position = re.escape(str(run.director.situation.pose.value.position))
    assert re.search(rf"{position}, heading \d+°, 0.0 m/s \(\d+ s old\)", found)


def test_the_view_says_that_the_vehicle_is_silent():
    run = proposed()
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 8)
    found = shown(run, run.now_s + 600.0)
    assert "LINK LOST: last heard 10 min ago" in found
    assert "no heartbeat, for 0 s" in found
    assert understood("yes", run.director).answer == "nothing to confirm: the vehicle is not heard"


def test_the_view_says_that_nothing_was_heard_yet():
    run = conductor()
    assert "LINK LOST: no vehicle heard yet (no route)" in shown(run, 0.0, "no route")


def test_an_answer_stays_in_the_view():
    run = proposed()
    text = io.StringIO()
    with LiveView(run.director, Console(file=text, force_terminal=True, width=140, height=60)) as view:
        view.answer("nothing to confirm: no plan is proposed", is_warning=True)
        text.truncate(0)
        view.show(run.now_s + 1)
    assert "nothing to confirm: no plan is proposed" in text.getvalue()


class Watcher:
    """A view that counts how often it is brought up to date, and ends the run when it was often enough."""

    def __init__(self, most: int) -> None:
        self.link_trouble: str | None = None
        self.keyboard = Keyboard()
        self.notes: list[str] = []
        self._left = most

    def note(self, text: str, *, is_warning: bool) -> None:
        assert is_warning
        self.notes.append(text)

    def aside(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()

    def show(self, _now_s: float) -> None:
        self._left -= self.link_trouble is not None
        if not self._left:
            raise KeyboardInterrupt


def test_the_view_goes_on_while_the_link_is_opened_again():
    watcher = Watcher(3)
    shell = bridge.BridgeShell(Director(Orders()), "tcp:127.0.0.1:1", lambda _event: None, watcher, None)
    with pytest.raises(KeyboardInterrupt), terminable():  # which puts back what SIGINT does
        shell.run(None, 30.0)
    assert "tcp:127.0.0.1:1 cannot be opened" in watcher.link_trouble
    assert watcher.notes[-1] == f"link: {watcher.link_trouble}"


@pytest.mark.parametrize(("quiet", "shown"), [(0, "nw"), (1, "w"), (2, "")])
def test_notes_beside_the_events_heed_quiet(quiet, shown, capsys):
    begin_telling("bridge", quiet=quiet)
    shell = bridge.BridgeShell(Director(Orders()), "tcp:127.0.0.1:1", lambda _event: None, None, None)
    shell._note("n", is_warning=False)
    shell._note("w", is_warning=True)
    assert capsys.readouterr().err.replace("\n", "") == shown


def test_time_goes_on_while_opening_takes_long():
    release = threading.Event()
    opening = Opening(release.wait)
    assert not opening.is_over
    release.set()
    assert opening.link() is True
    assert opening.is_over


def test_what_came_in_the_way_of_opening_is_raised():
    def fail():
        raise LinkError("no")

    with pytest.raises(LinkError, match="no"):
        Opening(fail).link()


def reporting(**orders):
    return Orders(obstacle_sources=frozenset(ObstacleSource), **orders)


@pytest.mark.parametrize(
    ("line", "radius_m"),
    [("blocked", 1.0), ("Blocked here", 1.0), ("blocked here 2.5", 2.5), ("blocked 3", 3.0)],
)
def test_blocked_is_an_obstacle_before_the_vehicle(line, radius_m):
    run = ready(conductor(drive=False))
    run.director.orders = reporting()
    typed = understood(line, run.director)
    assert typed.is_taken
    assert typed.obstacle == TypedObstacle(None, radius_m)
    assert "protects no person" in typed.answer


@pytest.mark.parametrize(
    "line", ["blocked 40.07,-105.23 2", "blocked at? 40.07,-105.23", "blocked 40.07, -105.23 2"]
)
def test_blocked_somewhere_is_an_obstacle_there(line):
    typed = understood(line, Director(reporting()))
    if "?" in line:
        assert typed.answer.startswith("not accepted: ")
    else:
        assert typed.obstacle == TypedObstacle(LatLon(40.07, -105.23), 2.0)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("blocked here 0", "metres"),
        ("blocked here 101", "metres"),
        ("blocked here wide", "metres"),
        ("blocked 91,0 1", "latitude"),
        ("blocked", "place or heading is not known"),
    ],
)
def test_what_is_no_obstacle_is_said_why(line, why):
    typed = understood(line, Director(reporting()))
    assert not typed.is_taken
    assert typed.answer.startswith("not accepted: ")
    assert why in typed.answer


@pytest.mark.parametrize("line", ["blocked", "clear"])
def test_obstacles_are_not_taken_where_the_keyboard_is_no_source(line):
    typed = understood(line, Director(Orders()))
    assert not typed.is_taken
    assert "--obstacles-from keyboard" in typed.answer


def test_clear_forgets_them():
    director = Director(reporting())
    director.take_obstacle(FAR, 1.0, 5.0)
    typed = understood("clear", director)
    assert (typed.clears, typed.is_taken) == (True, True)
    assert typed.answer.startswith("1 obstacle forgotten")
    director.clear_obstacles(6.0)
    assert director.situation.obstacles.known == ()
