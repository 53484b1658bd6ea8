"""Where a HOLD ends: breaches to come are announced, and the vehicle goes on first where that is better; in stepped time."""

from __future__ import annotations

import math

import pytest
from director.conducting import Conductor
from director.promises import Promises
from director.test_bridge_director import FAR, FENCE, HOME, NEAR, driving, reposition, upload

from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.hold_watch import HoldWatch
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.geo import LatLon, distance_m
from missions.items import Command
from missions.request import Request
from missions.situation import Situation
from missions.stops import Stop, Stops

ROLLS_FAR = Situation(stops=Stops(given=(Stop(3.0, 20.0),)))
"""An owner who says so; the simulated rover itself stops sooner."""


def conductor(known: Situation | None = None, **orders) -> Conductor:
    config = SimulatorConfig(
        home=HOME, fence=fence_to_items(FENCE), parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0}
    )
    given = {"request": Request(clearance_m=2.5), "upload": True, "drive": True, "announce": True, **orders}
    return Conductor(Director(Orders(**given), known), [SimulatedVehicle(config)])


def at_speed(run: Conductor) -> Conductor:
    rover = run.vehicles[0].rover
    run.run_until(lambda: rover.body.speed_mps > 2.9, 20)
    return run


def ahead(run: Conductor, metres: float) -> LatLon:
    """Return the place so far ahead of the vehicle."""
    rover = run.vehicles[0].rover
    north_m, east_m = (metres * part for part in (rover.body.direction.real, rover.body.direction.imag))
    lat_deg, lon_deg = rover.position
    return LatLon(
        lat_deg + north_m / 111_034.0,
        lon_deg + east_m / (111_320.0 * math.cos(math.radians(lat_deg))),
    )


def put_circle(run: Conductor, edge_ahead_m: float, radius_m: float = 3.0) -> None:
    """Let another station put an exclusion on the vehicle's way."""
    circle = CircleZone(ZoneKind.EXCLUSION, ahead(run, edge_ahead_m + radius_m), radius_m)
    upload(run, m.MissionType.FENCE, fence_to_items(Fence((*FENCE.zones, circle))))


def holds(run: Conductor) -> int:
    return sum(
        isinstance(message, m.CommandLong)
        and (message.command, message.param2) == (Command.DO_SET_MODE, Mode.HOLD)
        for message in run.sent
    )


def left_m(run: Conductor) -> float:
    return distance_m(run.vehicles[0].position, FAR)


def test_a_fence_put_inside_the_stopping_distance_is_announced_at_once_and_hold_follows():
    run = at_speed(driving(conductor()))
    put_circle(run, edge_ahead_m=4.0)
    put_s, before = run.now_s, holds(run)
    told_s = run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    assert told_s - put_s <= 0.2  # the fence is read again: a transfer of five zones
    assert holds(run) == before
    event = run.last(EventName.BREACH_AHEAD)
    data = event.data
    assert data["to_fence_m"] == pytest.approx(4.0, abs=0.6)  # at 3 m/s it goes on meanwhile
    # 6.2 m from 3 m/s by the rows; half a second until HOLD is taken, and up to a quarter for the position's age.
    assert 6.1 <= data["stopping_m"] - 0.5 * data["speed_mps"] <= 7.0
    assert (data["best"], data["fence"]) == ("hold", "exclusion circle 2")
    assert "HOLD at once" in event.text
    assert "from ArduPilot's simulation, not your rover" in event.text
    run.run_until(lambda: holds(run) > before, 0.1)
    names = [event.name for event in run.events]
    assert names.count(EventName.BREACH_AHEAD) == 1
    driving_at = names.index(EventName.DRIVING)
    assert names.index(EventName.BREACH_AHEAD) < names.index(EventName.HOLDING, driving_at)
    said = f"pbpp: breach ahead: fence {data['to_fence_m']:.1f} m, stops in "
    run.run_until(
        lambda: any(isinstance(one, m.Statustext) and one.text.startswith(said) for one in run.sent), 3
    )


def test_a_fence_beyond_the_stopping_distance_is_not():
    run = at_speed(driving(conductor()))
    put_circle(run, edge_ahead_m=12.0)
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 2)
    assert not run.happened(EventName.BREACH_AHEAD)()


def test_a_fence_that_the_route_keeps_off_is_no_breach_to_come():
    run = at_speed(driving(conductor(known=ROLLS_FAR)))
    aside = CircleZone(ZoneKind.EXCLUSION, LatLon(HOME.lat_deg + 0.0002, HOME.lon_deg - 0.0002), 2.0)
    upload(run, m.MissionType.FENCE, fence_to_items(Fence((*FENCE.zones, aside))))
    run.run_until(run.happened(EventName.FENCE_CHANGED), 2)
    assert not run.happened(EventName.BREACH_AHEAD)()
    assert run.director.state is State.DRIVING


def test_without_orders_to_drive_it_only_announces():
    run = conductor(drive=False)
    run.run_until(lambda: run.director.state is State.READY)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 20)
    run.ground_station(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=1.0))
    run.ground_station(m.SetMode(1, 1, Mode.AUTO))
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    at_speed(run)
    put_circle(run, edge_ahead_m=4.0)
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    data = run.last(EventName.BREACH_AHEAD).data
    assert (data["best"], data["go_on_m"]) == (None, None)
    run.run_until(run.happened(EventName.BREACH), 20)
    assert not [
        message
        for message in run.sent
        if isinstance(message, m.CommandLong) and message.command == Command.DO_SET_MODE
    ]


def test_the_vehicles_own_stops_are_measured_as_it_drives():
    run = at_speed(driving(conductor()))
    rover = run.vehicles[0].rover
    speed_mps, begun_at = rover.body.speed_mps, rover.body.position_m
    run.ground_station(m.SetMode(1, 1, Mode.HOLD))
    run.run_until(lambda: abs(rover.body.speed_mps) < 0.01, 20)
    rolled_m = abs(rover.body.position_m - begun_at)
    run.run_until(lambda: run.director.situation.stops.rolling is None, 2)
    [stop] = run.director.situation.stops.own
    assert stop.speed_mps == pytest.approx(speed_mps, abs=0.4)  # the first position after the heartbeat
    # What it has rolled before that position is no part of it.
    assert rolled_m - 0.3 * speed_mps <= stop.distance_m <= 1.06 * rolled_m
    run.director.take_target(FAR, run.now_s)
    run.run_until(run.happened(EventName.DRIVING, after=len(run.events)), 20)
    at_speed(run)
    put_circle(run, edge_ahead_m=2.0)
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    assert run.last(EventName.BREACH_AHEAD).data["source"] == "from its own stops"


def near_the_end(run: Conductor) -> Conductor:
    """Drive until a HOLD would roll on far beyond the target, and put a fence behind that."""
    at_speed(driving(run))
    run.run_until(lambda: left_m(run) < 15.0, 120)
    put_circle(run, edge_ahead_m=left_m(run) + 2.0)
    return run


def test_a_route_that_ends_before_the_fence_is_gone_on_with_until_a_hold_ends_before_it():
    run = near_the_end(conductor(known=ROLLS_FAR))
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    event = run.last(EventName.BREACH_AHEAD)
    assert event.data["best"] == "go_on"
    assert "along the route, then HOLD" in event.text
    assert 0.0 < event.data["go_on_m"] <= left_m(run) + 1.0
    assert run.director.state is State.DRIVING
    before = holds(run)
    run.run_until(lambda: holds(run) > before or run.director.state is State.ARRIVED, 20)
    rover = run.vehicles[0].rover
    # By the owner's word it rolls on 20/3 s times its speed now: that ends before the circle.
    to_circle_m = left_m(run) + 2.0
    assert 20.0 / 3.0 * rover.body.speed_mps < to_circle_m + 0.5
    assert rover.breaches == 0


def test_where_positions_fail_it_is_held_when_it_should_be_there():
    run = near_the_end(conductor(known=ROLLS_FAR))
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    data = run.last(EventName.BREACH_AHEAD).data
    push = run.down.push
    run.down.push = lambda frame, now_s: (
        None if isinstance(frame.message, m.GlobalPositionInt) else push(frame, now_s)
    )
    before, told_s = holds(run), run.now_s
    held_s = run.run_until(lambda: holds(run) > before, 20)
    assert held_s - told_s <= data["go_on_m"] / data["speed_mps"] + 0.3


def test_a_typed_target_waits_until_a_hold_ends_within_the_fence():
    run = near_the_end(conductor(known=ROLLS_FAR))
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    before = holds(run)
    run.director.take_target(NEAR, run.now_s)
    run.step()
    assert (holds(run), run.director.state) == (before, State.DRIVING)
    run.run_until(lambda: run.director.state is State.PLANNING, 20)
    events = len(run.events)
    run.run_until(lambda: run.director.state is State.DRIVING, 30)
    run.run_until(run.happened(EventName.ARRIVED, after=events), 120)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0
    assert run.vehicles[0].breaches == 0


def test_a_click_is_held_at_once_whatever_that_leads_to_and_that_is_announced():
    run = near_the_end(conductor(known=ROLLS_FAR))
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    before, events = holds(run), len(run.events)
    run.run_until(lambda: run.now_s > run.last(EventName.BREACH_AHEAD).time_s + 1.1)
    assert (holds(run), run.director.state) == (before, State.DRIVING)
    run.ground_station(reposition(NEAR))
    run.run_until(lambda: holds(run) > before, 0.3)
    assert run.happened(EventName.BREACH_AHEAD, after=events)()


def test_an_operators_word_ends_the_going_on():
    run = near_the_end(conductor(known=ROLLS_FAR))
    run.run_until(run.happened(EventName.BREACH_AHEAD), 2)
    run.ground_station(m.SetMode(1, 1, Mode.MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 2)
    before = holds(run)
    run.run_until(lambda: run.now_s > run.last(EventName.TAKEN_OVER).time_s + 15)
    assert (holds(run), run.director.state) == (before, State.LET_GO)


@pytest.mark.parametrize("is_announced", [True, False])
def test_the_soaks_promise_notices_a_breach_without_a_word(is_announced, monkeypatch):
    if not is_announced:
        monkeypatch.setattr(HoldWatch, "_tell", lambda *_: None)
    run = conductor()
    promises = Promises(run)
    at_speed(driving(run))
    put_circle(run, edge_ahead_m=1.5)
    run.run_until(lambda: run.vehicles[0].breaches > 0, 5)
    run.step()
    said = {text.partition(": ")[2] for text in promises.broken}
    assert bool(said) is not is_announced
    assert is_announced or "a breach by our HOLD that was not announced" in said
    assert is_announced or any("m/s was not announced" in text for text in said)
