"""Called home among reported obstacles: calls and the operator's word while an obstacle is waited for, and obstacles on the way home."""

from __future__ import annotations

from dataclasses import replace

import pytest
from director.conducting import Conductor
from director.test_bridge_director import FAR
from director.test_coming_home import BY_ROUTE, LOW, RTL, conductor, heading_home, home, on_the_way
from director.test_obstacles import block, on_route
from director.test_takeover import MANUAL, left_alone, unheard, wait

from mavlink_bridge.director import Director, EventName, State
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from missions.geo import distance_m

OBSTACLES = {"obstacle_sources": frozenset(ObstacleSource)}


def waiting(*, goes_home=False, homing=BY_ROUTE, **orders):
    """Return a bridge whose rover waits for obstacles to go, on its way there or home."""
    run = on_the_way(conductor(homing=homing, **OBSTACLES, **orders), seconds=25 if goes_home else 12)
    if goes_home:
        heading_home(run)
        wait(run, 1)
    block(run)
    run.run_until(run.happened(EventName.WAITING), 60)
    wait(run, 1)
    return run


def test_a_way_home_that_waits_for_an_obstacle_is_sought_every_three_seconds():
    run = waiting(goes_home=True)
    before, tasks, make_plan = len(run.events), [], run.make_plan

    def counted():
        task = run.director.pending_plan
        if task is not None and (not tasks or tasks[-1] is not task):
            tasks.append(task)
        make_plan()

    run.make_plan = counted
    wait(run, 20)
    assert len(tasks) <= 2 * 20 / 3 + 2  # with the obstacles, and without
    assert [event for event in run.events[before:] if event.name is EventName.WAITING] == []
    run.director.clear_obstacles(run.now_s)
    assert home(run)
    assert run.vehicles[0].breaches == 0


def test_a_low_battery_calls_one_that_waits_for_an_obstacle():
    run = waiting(homing=replace(BY_ROUTE, battery_percent=20))
    run.vehicles[0].rover.battery = LOW
    run.run_until(run.happened(EventName.CALLED_HOME), 20)
    assert home(run)


def test_rtl_while_an_obstacle_is_waited_for_is_a_call_and_the_second_one_is_the_operators():
    run = waiting()
    unheard(run, RTL)
    run.run_until(run.happened(EventName.GOING_HOME), 20)
    wait(run, 5)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 10)


@pytest.mark.parametrize("goes_home", [False, True])
@pytest.mark.parametrize("is_heard", [False, True])
@pytest.mark.parametrize(
    "message", [m.SetMode(1, 1, MANUAL), m.SetMode(1, 1, Mode.LOITER), m.CommandLong(1, 1, 400)]
)
def test_who_takes_it_while_an_obstacle_is_waited_for_keeps_it(message, is_heard, goes_home):
    run = waiting(goes_home=goes_home)
    (run.ground_station if is_heard else lambda message: unheard(run, message))(message)
    run.run_until(lambda: run.director.state is State.LET_GO, 5)
    wait(run, 0.5)
    mode, is_armed = run.vehicles[0].mode, run.vehicles[0].is_armed
    run.director.clear_obstacles(run.now_s)
    assert left_alone(run, mode, 12)
    assert run.vehicles[0].is_armed is is_armed


def test_the_second_rtl_of_one_that_waits_on_its_way_home_is_the_operators():
    run = waiting(goes_home=True)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 10)
    assert run.director.state is State.LET_GO


def test_an_obstacle_on_the_way_home_is_driven_round():
    run = heading_home(on_the_way(conductor(**OBSTACLES), seconds=25))
    wait(run, 1)
    place = on_route(run, 0.6)
    run.director.take_obstacle(place, 1.0, run.now_s)
    nearest_m = []
    run.meddle = lambda run: nearest_m.append(distance_m(run.vehicles[0].position, place) - 1.0)
    run.run_until(run.happened(EventName.OBSTACLE_ACROSS), 5)
    assert home(run)
    assert min(nearest_m) > 2.5


def test_a_link_that_was_lost_while_an_obstacle_was_waited_for_drives_nothing():
    run = waiting(goes_home=True)
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 15)
    run.is_cut = False
    run.run_until(lambda: run.director.state is State.READY, 30)
    run.director.clear_obstacles(run.now_s)
    assert left_alone(run, Mode.HOLD, 20)


def test_a_clash_of_identities_while_an_obstacle_is_waited_for_ends_that():
    run = waiting(goes_home=True)
    run.director.receive(m.Frame(1, 195, m.Heartbeat(6, 8)), run.now_s)
    run.run_until(lambda: run.director.state is State.CLASHED, 5)
    run.director.clear_obstacles(run.now_s)
    assert left_alone(run, Mode.HOLD, 10)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 30)


def test_an_obstacle_that_comes_while_the_way_home_is_uploaded_is_not_driven_into():
    run = on_the_way(conductor(**OBSTACLES), seconds=25)
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.UPLOADING, 20)
    run.director.take_obstacle(on_route(run, 0.5), 1.0, run.now_s)
    place = run.director.situation.obstacles.known[0].position
    nearest_m = []
    run.meddle = lambda run: nearest_m.append(distance_m(run.vehicles[0].position, place) - 1.0)
    assert home(run)
    assert min(nearest_m) > 2.5


@pytest.mark.parametrize("goes_home", [False, True])
def test_a_bridge_that_is_started_again_while_an_obstacle_was_waited_for_drives_nothing(goes_home):
    run = waiting(goes_home=goes_home)
    again = Conductor(Director(run.director.orders, notes=(run.note,) if run.note else ()), run.vehicles)
    again.now_s = run.now_s
    again.run_until(lambda: again.director.state is State.READY, 30)
    assert left_alone(again, Mode.HOLD, 20)
    unheard(again, RTL)
    again.run_until(again.happened(EventName.GOING_HOME), 20)
    assert home(again)
