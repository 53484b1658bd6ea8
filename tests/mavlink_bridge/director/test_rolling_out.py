"""While the vehicle rolls out after HOLD its next mission is planned and uploaded; it drives only once it stands, and from where the mission holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from director.test_bridge_director import FAR, FENCE, HOME, NEAR, conductor, driving, upload
from director.test_takeover import MANUAL, left_alone, unheard, wait

from mavlink_bridge.director import EventName, State, route_desk
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.standstill import AwaitStandstill
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.errors import NoRouteError
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import LatLon, distance_m
from missions.items import Command
from missions.planning.plan import plan

if TYPE_CHECKING:
    from director.conducting import Conductor


def rover(speed_mps: float = 2.0) -> SimulatedVehicle:
    parameters = {"FENCE_ENABLE": 1.0, "WP_SPEED": speed_mps}
    return SimulatedVehicle(SimulatorConfig(home=HOME, fence=fence_to_items(FENCE), parameters=parameters))


def rolling(until: State | None = None, *, speed_mps: float = 2.0, planning_s: float = 0.0) -> Conductor:
    """Return one that rolls out because of another target, in a state."""
    run = driving(conductor(vehicle=rover(speed_mps)), FAR)
    wait(run, 8)
    run.planning_s = planning_s
    run.director.take_target(NEAR, run.now_s)
    if until is not None:
        run.run_until(lambda: run.director.state is until, 10)
        assert body(run).speed_mps > 0.4
    return run


def body(run: Conductor):
    return run.vehicles[0].rover.body


def autos(run: Conductor) -> int:
    commands = (one for one in run.sent if isinstance(one, m.CommandLong))
    return sum(one.command == Command.DO_SET_MODE and one.param2 == Mode.AUTO for one in commands)


def test_it_is_planned_and_verified_while_it_rolls_and_driven_only_once_it_stands():
    run = rolling(State.STARTING)
    assert run.happened(EventName.VERIFIED)()
    before, speeds = autos(run), []
    expected = run.director.plan.start

    def note(run: Conductor) -> None:
        if run.director.state is State.STARTING:
            speeds.append((autos(run), body(run).speed_mps, run.vehicles[0].position))

    run.meddle = note
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    sent = [(speed_mps, place) for count, speed_mps, place in speeds if count > before]
    assert sent[0][0] <= 0.3
    assert distance_m(run.director.plan.start, sent[0][1]) < 0.2, "its own place, not the expected one"
    assert distance_m(run.director.plan.start, expected) < 0.3
    run.run_until(lambda: run.director.state is State.ARRIVED, 100)
    assert distance_m(run.vehicles[0].position, NEAR) < 2.5
    assert run.vehicles[0].breaches == 0


@pytest.mark.parametrize("state", [State.PLANNING, State.UPLOADING, State.STARTING])
@pytest.mark.parametrize("mode", [MANUAL, Mode.GUIDED])
@pytest.mark.parametrize("is_heard", [False, True])
def test_an_operator_who_takes_it_while_it_rolls_wins(state, mode, is_heard):
    run = rolling(state, planning_s=0.3)
    command = m.SetMode(1, 1, mode)
    run.ground_station(command) if is_heard else unheard(run, command)
    assert left_alone(run, mode, 12)
    assert run.director.state is State.LET_GO


def test_hold_pressed_while_it_rolls_wins():
    run = rolling(State.STARTING)
    run.ground_station(m.SetMode(1, 1, Mode.HOLD))
    assert left_alone(run, Mode.HOLD, 12)


def test_disarmed_while_it_rolls_it_is_not_driven():
    run = rolling(State.STARTING)
    before = autos(run)
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM))
    wait(run, 12)
    assert autos(run) == before


def brake(run: Conductor) -> LatLon:
    """Let it stand at once; return where."""
    body(run).speed_mps = 0.0
    return run.vehicles[0].position


def test_one_that_stops_elsewhere_is_driven_from_there():
    run = rolling(State.STARTING, speed_mps=3.0)
    expected, here = run.director.plan.start, brake(run)
    assert distance_m(here, expected) > 1.0
    run.run_until(lambda: run.director.state is State.DRIVING, 15)
    assert distance_m(run.director.plan.start, here) < 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED, 100)
    assert run.vehicles[0].breaches == 0


def test_where_the_mission_does_not_hold_from_there_it_is_planned_anew(monkeypatch):
    monkeypatch.setattr(route_desk, "from_here", lambda *_facts: None)
    run = rolling(State.STARTING, speed_mps=3.0)
    before, driven = len(run.events), autos(run)
    here = brake(run)
    run.run_until(run.happened(EventName.PLANNED, before), 15)
    assert autos(run) == driven
    assert "from where it was expected to: planning from there" in run.last(EventName.HOLDING).text
    run.run_until(lambda: run.director.state is State.DRIVING, 15)
    assert distance_m(run.director.plan.start, here) < 0.1
    assert len([event for event in run.events[before:] if event.name is EventName.PLANNED]) == 1


@pytest.mark.parametrize("refused_mps", [0.8, 0.4])
def test_where_no_plan_can_be_made_from_there_it_is_asked_for_later_and_at_last_from_where_it_stands(
    refused_mps,
):
    run = rolling(speed_mps=3.0)
    refused = []

    def planner(situation, request, **more):
        if body(run).speed_mps > refused_mps:
            refused.append(situation.pose.value)
            raise NoRouteError("not from there")
        return plan(situation, request, **more)

    run.planner = planner
    run.run_until(run.happened(EventName.PLANNED, len(run.events)), 10)
    assert 2 <= len(refused) <= 8
    is_rolling = body(run).speed_mps > 0.4
    assert is_rolling is (refused_mps == 0.8)
    run.run_until(lambda: run.director.state is State.DRIVING, 15)
    assert not run.happened(EventName.NO_PLAN)()


def test_a_refusal_that_takes_long_is_not_asked_for_again_while_it_rolls():
    run = rolling(speed_mps=3.0, planning_s=1.5)
    asked = []

    def planner(situation, request, **more):
        asked.append(body(run).speed_mps)
        if len(asked) == 1:
            raise NoRouteError("not from there")
        return plan(situation, request, **more)

    run.planner = planner
    run.run_until(lambda: len(asked) == 2, 20)
    assert asked[0] > 0.4
    assert asked[1] <= 0.3


def test_without_orders_to_drive_it_is_not_foreseen():
    run = conductor(vehicle=rover(), drive=False, hold=True)
    run.run_until(lambda: run.director.state is State.READY, 60)
    assert not run.director._parts.desk.is_foreseen
    assert run.director._parts.halter.expected is None


def test_a_fence_that_changes_while_it_rolls_is_planned_round():
    run = rolling(State.STARTING, speed_mps=3.0)
    way = run.director.plan
    half = LatLon(*((a + b) / 2 for a, b in zip(way.path[0], way.path[1], strict=True)))
    wall = Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, half, 1.0)))
    upload(run, m.MissionType.FENCE, fence_to_items(wall))
    run.run_until(lambda: run.director.state is State.ARRIVED, 120)
    assert run.vehicles[0].breaches == 0
    assert len(run.director.plan.fence.zones) == len(wall.zones)


# The wait for standing still


def position(speed_mps: float) -> m.Frame:
    return m.Frame(
        1, 1, m.GlobalPositionInt(0, 400000000, -1050000000, 0, 0, 0, round(100 * speed_mps), 0, 65535)
    )


def test_the_wait_ends_with_the_first_position_that_stands_and_asks_only_shortly_before():
    machine = AwaitStandstill(Peer(1, 1, 255, 190), 0.3, 8.0)
    machine.start(0.0)
    assert machine.deadline_s == 8.0
    for speed_mps in (2.0, 1.0, 0.7):
        machine.receive(position(speed_mps), 1.0)
        machine.handle_timer(1.0)
    assert machine.messages_to_send() == []
    machine.receive(position(0.5), 2.0)
    assert machine.deadline_s == 2.0
    machine.handle_timer(2.0)
    assert [one.param1 for one in machine.messages_to_send()] == [33.0]
    assert machine.deadline_s == pytest.approx(2.1)
    machine.receive(m.Frame(2, 1, position(0.0).message), 2.05)
    assert not machine.is_done
    machine.receive(position(0.3), 2.1)
    assert (machine.is_done, machine.deadline_s, machine.progress) == (True, None, (1, 1))


def test_the_wait_asks_so_often_and_no_more_and_takes_what_drifts_for_standing():
    machine = AwaitStandstill(Peer(1, 1, 255, 190), 0.3, 8.0)
    machine.start(0.0)
    machine.receive(position(0.4), 0.0)
    now_s, asked = 0.0, 0
    while not machine.is_done:
        now_s = max(now_s, machine.deadline_s)
        machine.handle_timer(now_s)
        machine.receive(position(0.4), now_s)
        asked += len(machine.messages_to_send())
    assert (now_s, asked) == (8.0, 25)
