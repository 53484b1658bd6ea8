"""Called home: who calls, which RTL is answered, where it waits, and that whoever takes the vehicle keeps it."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from io import StringIO

import pytest
from director.adopting import Killed
from director.homing import CALLS, called_run
from director.test_bridge_director import FAR, FENCE, HOME, NEAR, arm, driving, ready, reposition, upload
from director.test_bridge_director import conductor as any_conductor
from director.test_takeover import MANUAL, left_alone, modes_sent, unheard, wait

from mavlink_bridge.backup.drive_note import note_from_json, note_to_json
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.battery_watch import BatteryWatch
from mavlink_bridge.director.fixes import fix_trouble, is_better
from mavlink_bridge.director.orders import Homing
from mavlink_bridge.director.plan_task import WaysTask
from mavlink_bridge.errors import BackupError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.replay.journal import JournalWriter, read_journal
from mavlink_bridge.simulator import Battery, Receiver, SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.telemetry import TelemetrySource, telemetry
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind, fence_to_items
from missions.geo import LatLon, distance_m
from missions.rally import RallyPoint, rally_to_items
from missions.request import Request
from missions.situation import Fix, Known, Situation

RTL = m.SetMode(1, 1, Mode.RTL)
BY_ROUTE = Homing(is_kept=True, by_route=True)
LOW = Battery(12, 11.0)
STATION = m.Frame(255, 190, m.Heartbeat(m.MavType.GCS, 8))
RING = PolygonZone(
    ZoneKind.INCLUSION,
    tuple(
        LatLon(HOME.lat_deg + dy * 1e-4, HOME.lon_deg + dx * 1e-4)
        for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ),
)


def rover(*, fence: Fence = FENCE, rally=(), **changes) -> SimulatedVehicle:
    parameters = {"FENCE_ENABLE": 1.0, "WP_SPEED": 2.0, **changes}
    items = rally_to_items(tuple(RallyPoint(*place) for place in rally))
    config = SimulatorConfig(
        home=HOME,
        fence=fence_to_items(fence),
        parameters=parameters,
        rally=items,
        uid=b"one",
        battery=Battery(),
    )
    return SimulatedVehicle(config)


def away() -> SimulatedVehicle:
    """Return one that stands far from home."""
    vehicle = rover()
    vehicle.rover.home = vehicle._home = FAR
    return vehicle


def conductor(vehicle: SimulatedVehicle | None = None, homing: Homing = BY_ROUTE, **orders):
    return any_conductor(vehicle=vehicle or rover(), homing=homing, **orders)


def on_the_way(run, target: LatLon = FAR, seconds: float = 12.0):
    """Let it drive for a while."""
    driving(run, target)
    wait(run, seconds)
    return run


def heading_home(run):
    """Press RTL, and wait until it drives home."""
    before = len(run.events)
    unheard(run, RTL)
    run.run_until(run.happened(EventName.GOING_HOME, before), 20)
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    return run


def home(run, place: LatLon = HOME) -> bool:
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    wait(run, 2)
    return distance_m(run.vehicles[0].position, place) < 4.0 and run.vehicles[0].mode == Mode.HOLD


def texts(run, name: EventName) -> list[str]:
    return [event.text for event in run.events if event.name is name]


# The campaign's runs


@pytest.mark.parametrize("seed", range(1, 1 + len(CALLS)))
def test_it_comes_home_to_the_nearest_place_whatever_calls(seed):
    seen = called_run(seed)
    assert seen.what.startswith(("home", "held", "at home", "skipped"))
    assert seen.bad == []


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(101, 108))  # `homing.py --seed 108` goes on
def test_more_vehicles_come_home(seed):
    assert called_run(seed).bad == []


# Which RTL is answered


def test_the_first_rtl_is_answered_and_the_second_is_the_operators():
    run = heading_home(on_the_way(conductor()))
    assert texts(run, EventName.CALLED_HOME) == ["called home (RTL): HOLD, then a route home"]
    wait(run, 3)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL)
    assert run.director.state is State.LET_GO
    assert len(texts(run, EventName.CALLED_HOME)) == 1
    assert texts(run, EventName.CALL_IGNORED) == ["second RTL is yours: drives straight home"]
    assert any(  # also to who reads on the transmitter or in the ground station
        isinstance(one, m.Statustext) and one.text.endswith("second RTL is yours: drives straight home")
        for one in run.sent
    )


def test_a_second_rtl_that_is_heard_and_seen_is_said_once():
    run = heading_home(on_the_way(conductor()))
    wait(run, 5)
    run.ground_station(RTL)
    run.ground_station(RTL)
    assert left_alone(run, Mode.RTL)
    assert len(texts(run, EventName.CALL_IGNORED)) == 1
    assert len(texts(run, EventName.TAKEN_OVER)) == 1


def test_without_the_option_rtl_is_a_takeover_as_ever():
    run = on_the_way(conductor(homing=Homing(is_kept=True)))
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 5)
    assert run.director.state is State.LET_GO


def test_after_an_arrival_and_after_another_target_rtl_is_a_first_one_again():
    run = heading_home(on_the_way(conductor()))
    assert home(run)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    wait(run, 8)
    before = len(run.events)
    heading_home(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.HOLDING, 5)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    wait(run, 5)
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.HOLDING, 3)
    assert sum(event.name is EventName.CALLED_HOME for event in run.events[before:]) == 2
    assert home(run)


@pytest.mark.parametrize("after_s", [0.1, 0.7, 2.0, 3.5])
@pytest.mark.parametrize("is_heard", [False, True])
def test_rtl_said_again_within_four_seconds_is_the_same_press(after_s, is_heard):
    run = on_the_way(conductor())
    say = run.ground_station if is_heard else lambda message: unheard(run, message)
    say(RTL)
    run.run_until(run.happened(EventName.CALLED_HOME), 2)
    wait(run, after_s)
    say(RTL)
    run.run_until(run.happened(EventName.GOING_HOME), 20)
    assert home(run)
    assert run.vehicles[0].breaches == 0


def test_a_transmitters_second_rtl_comes_through_another_mode():
    # So far out that the RTL below does not end at home.
    run = heading_home(on_the_way(conductor(), seconds=20.0))
    wait(run, 5)
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 3)
    wait(run, 1)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 10)
    assert len(texts(run, EventName.CALL_IGNORED)) == 1
    unheard(run, m.SetMode(1, 1, MANUAL))
    wait(run, 60)
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.HOLDING, 3)
    assert home(run)


def test_rtl_of_a_vehicle_that_somebody_drives_is_answered():
    run = ready(conductor(away()))
    arm(run)
    wait(run, 2)
    unheard(run, m.SetMode(1, 1, Mode.SMART_RTL))
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    assert texts(run, EventName.CALLED_HOME) == ["called home (RTL: SMART_RTL): HOLD, then a route home"]
    assert home(run, FAR)


def test_rtl_from_before_the_bridge_began_is_left_alone():
    run = conductor()
    arm(run)
    unheard(run, RTL)
    wait(run, 15)
    assert run.vehicles[0].mode == Mode.RTL
    assert modes_sent(run) == []


def test_rtl_while_everything_is_read_is_held_at_once_and_answered_after_that():
    run = conductor(away())
    arm(run)
    run.run_until(lambda: run.director.state is State.LEARNING, 5)
    wait(run, 0.1)
    unheard(run, RTL)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    run.run_until(run.happened(EventName.GOING_HOME), 30)
    assert home(run, FAR)


@pytest.mark.parametrize("state", [State.UPLOADING, State.STARTING])
def test_rtl_in_the_middle_of_something_is_held_at_once_and_answered_after_it(state):
    run = ready(conductor(away()))
    arm(run)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is state, 20)
    unheard(run, RTL)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 2)
    run.run_until(run.happened(EventName.GOING_HOME), 20)
    assert home(run, FAR)


def test_an_rtl_of_the_autopilots_own_failsafe_is_nobodys_second_one():
    run = heading_home(on_the_way(conductor()))
    wait(run, 5)
    run.vehicles[0].rover.texts.append((2, "Battery 1 is critical 9.80V used 4000 mAh"))
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.HOLDING, 3)
    assert home(run)


def test_nor_is_one_after_the_operator_has_taken_over():
    run = heading_home(on_the_way(conductor()))
    wait(run, 5)
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 3)
    run.vehicles[0].rover.texts.append((2, "Battery 1 is critical 9.80V used 4000 mAh"))
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.HOLDING, 3)
    assert home(run)


@pytest.mark.parametrize("is_heard", [False, True])
@pytest.mark.parametrize("first", [None, FAR])
def test_rtl_said_again_at_home_drives_nowhere_not_even_to_the_bridges_own_first_target(first, is_heard):
    request = Request(clearance_m=2.5)
    run = conductor(request=request.to(first) if first is not None else request)
    run.run_until(lambda: run.director.state is (State.VERIFIED if first else State.READY), 60)
    wait(run, 2)
    arm(run)
    wait(run, 2)
    say = run.ground_station if is_heard else lambda message: unheard(run, message)
    say(RTL)
    run.run_until(run.happened(EventName.AT_HOME), 20)
    before = len(run.events)
    say(RTL)
    wait(run, 15)
    assert (run.director.state, run.vehicles[0].mode) == (State.READY, Mode.HOLD)
    assert [event.name for event in run.events[before:]] == []


def test_a_battery_call_that_goes_on_first_is_held_for_at_once_where_the_autopilot_answers_with_rtl():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_percent=20)))
    hold_watch = run.director._parts.hold_watch
    hold_watch.goes_on_first = lambda now_s: run.director.state is State.DRIVING
    run.vehicles[0].rover.texts.append((2, "Battery 1 is low 10.20V used 4000 mAh"))
    run.run_until(run.happened(EventName.CALLED_HOME), 3)
    assert run.director.state is State.DRIVING
    unheard(run, RTL)
    run.run_until(run.happened(EventName.GOING_HOME), 20)
    assert home(run)
    assert [event.name for event in run.events].count(EventName.PLANNED) == 2  # there, and home


# Whoever takes it keeps it


def test_a_click_after_a_call_that_had_to_wait_is_the_newest_word():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_percent=20)))
    hold_watch = run.director._parts.hold_watch
    hold_watch.goes_on_first = lambda now_s: run.director.state is State.DRIVING
    run.vehicles[0].rover.battery = LOW
    run.run_until(run.happened(EventName.CALLED_HOME), 20)
    run.ground_station(reposition(NEAR))
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    wait(run, 2)
    assert distance_m(run.vehicles[0].position, NEAR) < 4.0
    assert not run.happened(EventName.GOING_HOME)()


@pytest.mark.parametrize("after_s", [0.06, 0.2, 0.4])
@pytest.mark.parametrize("mode", [Mode.HOLD, MANUAL])
def test_what_a_ground_station_asks_for_right_after_a_call_that_nobody_gave_counts(mode, after_s):
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_percent=20)))
    run.vehicles[0].rover.battery = LOW
    run.run_until(run.happened(EventName.CALLED_HOME), 30)
    wait(run, after_s)
    run.ground_station(m.SetMode(1, 1, mode))
    assert left_alone(run, mode, 15)
    assert run.director.state is State.LET_GO


@pytest.mark.parametrize(
    "state", [State.HOLDING, State.PLANNING, State.UPLOADING, State.STARTING, State.DRIVING]
)
@pytest.mark.parametrize("mode", [MANUAL, Mode.GUIDED, Mode.LOITER])
def test_another_mode_wins_at_any_moment_of_a_way_home(state, mode):
    run = on_the_way(conductor())
    run.planning_s = 0.5
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is state, 20)
    wait(run, 0.1)
    unheard(run, m.SetMode(1, 1, mode))
    assert left_alone(run, mode, 15)
    assert run.director.state is State.LET_GO


def test_hold_that_a_ground_station_asks_for_wins_too():
    run = on_the_way(conductor())
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.HOLDING, 3)
    wait(run, 1)
    run.ground_station(m.SetMode(1, 1, Mode.HOLD))
    assert left_alone(run, Mode.HOLD, 15)
    assert run.director.state is State.LET_GO


def test_no_yes_is_waited_for():
    run = ready(conductor(away(), confirm=True))
    arm(run)
    wait(run, 2)
    unheard(run, RTL)
    run.run_until(lambda: run.director.state is State.DRIVING, 20)


def test_a_clash_of_identities_is_not_ended_by_a_call():
    run = on_the_way(conductor())
    run.director.receive(m.Frame(1, 195, m.Heartbeat(6, 8)), run.now_s)
    run.run_until(lambda: run.director.state is State.CLASHED, 5)
    wait(run, 3)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 5)


def test_a_restart_on_the_way_home_counts_the_rtl_that_was_answered():
    one = Killed(1, FAR, is_clean=True)
    one.orders = replace(one.orders, homing=BY_ROUTE)
    one.drive_on(0.3)
    one.restart(one.note)
    run = one.run
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    run.events.clear()
    heading_home(run)
    note = note_from_json(json.loads(json.dumps(note_to_json(run.note))))
    assert note.call == "RTL"
    one.restart(note)
    run.run_until(run.happened(EventName.ADOPTED), 20)
    wait(run, 2)
    unheard(run, RTL)
    assert left_alone(run, Mode.RTL, 5)
    assert run.director.state is State.LET_GO


# What else calls


def test_a_low_battery_brings_it_home_and_only_once():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_percent=20)))
    run.vehicles[0].rover.battery = LOW
    lowered_s = run.now_s
    run.run_until(run.happened(EventName.CALLED_HOME), 30)
    assert 10.0 <= run.now_s - lowered_s <= 12.0
    assert texts(run, EventName.CALLED_HOME)[0].startswith(
        "called home (low battery: battery 1 at 12 %, 11.0 V)"
    )
    assert home(run)
    run.director.take_target(NEAR, run.now_s)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert len(texts(run, EventName.CALLED_HOME)) == 1


def test_one_that_stands_where_it_has_arrived_is_called_too_but_not_after_somebody_had_it():
    for touched in (False, True):
        run = driving(conductor(homing=replace(BY_ROUTE, gcs_timeout_s=5.0)))
        keep = run.meddle
        run.meddle = lambda run: run.director.receive(STATION, run.now_s)
        run.run_until(run.happened(EventName.ARRIVED), 200)
        wait(run, 3)
        if touched:
            unheard(run, m.SetMode(1, 1, MANUAL))
            wait(run, 2)
            unheard(run, m.SetMode(1, 1, Mode.HOLD))
            wait(run, 2)
        run.meddle = keep
        name = EventName.CALL_IGNORED if touched else EventName.CALLED_HOME
        run.run_until(run.happened(name), 10)
        assert not run.happened(EventName.CALLED_HOME if touched else EventName.CALL_IGNORED)()


def test_what_an_operator_drives_is_not_called_and_it_is_said():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_volts=11.5)))
    unheard(run, m.SetMode(1, 1, MANUAL))
    run.run_until(lambda: run.director.state is State.LET_GO, 3)
    run.vehicles[0].rover.battery = LOW
    run.run_until(run.happened(EventName.CALL_IGNORED), 30)
    assert left_alone(run, MANUAL, 10)
    assert "low battery" in texts(run, EventName.CALL_IGNORED)[0]


def test_silence_counts_only_once_a_ground_station_was_heard():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, gcs_timeout_s=5.0)))
    wait(run, 8)
    assert not run.happened(EventName.CALLED_HOME)()
    run.director.receive(STATION, run.now_s)
    run.director.receive(m.Frame(1, 196, m.Heartbeat(m.MavType.ONBOARD_CONTROLLER, 8)), run.now_s)
    heard_s = run.now_s
    run.run_until(run.happened(EventName.CALLED_HOME), 10)
    assert run.now_s - heard_s == pytest.approx(5.0, abs=0.05)
    assert home(run)


def test_a_vehicle_that_turns_round_far_from_the_fence_goes_on_before_its_hold_only_where_that_is_better():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, gcs_timeout_s=5.0)))
    run.director.receive(STATION, run.now_s)
    run.run_until(lambda: run.director.state is State.HOLDING, 6)
    assert run.last(EventName.HOLDING).text == "HOLD: stopping for the way home"


def test_one_that_was_held_and_has_no_route_is_called_too():
    run = on_the_way(conductor(homing=replace(BY_ROUTE, battery_percent=20)))
    run.director.take_target(FENCE.zones[0].vertices[0], run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 60)
    run.vehicles[0].rover.battery = LOW
    run.run_until(run.happened(EventName.CALLED_HOME), 20)
    assert home(run)


@pytest.mark.parametrize("is_denied", [False, True])
def test_hold_that_is_not_taken_is_asked_for_again(is_denied):
    run = on_the_way(conductor())
    vehicle, receive, deaf_until_s = run.vehicles[0], run.vehicles[0].receive, run.now_s + 14.0

    def be_deaf(frame, now_s):
        message = frame.message
        is_hold = isinstance(message, m.CommandLong) and (message.command, message.param2) == (176, Mode.HOLD)
        if not is_hold or now_s > deaf_until_s:
            receive(frame, now_s)
        elif is_denied:
            ack = m.CommandAck(176, 4, target_system=frame.system, target_component=frame.component)
            run.down.push(m.Frame(1, 1, ack), now_s)

    vehicle.receive = be_deaf
    unheard(run, RTL)
    run.run_until(lambda: vehicle.mode == Mode.HOLD, 17)
    assert home(run)


def test_an_upload_that_fails_is_tried_again_now_and_then_and_said():
    run = on_the_way(conductor())
    vehicle = run.vehicles[0]
    receive, is_full = vehicle.receive, True

    def refuse(frame, now_s):
        message = frame.message
        if is_full and isinstance(message, m.MissionCount) and message.mission_type == m.MissionType.MISSION:
            run.down.push(m.Frame(1, 1, m.MissionAck(frame.system, frame.component, 4, 0)), now_s)
        else:
            receive(frame, now_s)

    vehicle.receive = refuse
    unheard(run, RTL)
    wait(run, 30)
    failed = len(texts(run, EventName.UPLOAD_FAILED))
    assert 3 <= failed <= 6
    assert len(texts(run, EventName.HOME_WAITS)) == failed
    assert "the upload failed" in texts(run, EventName.HOME_WAITS)[0]
    assert vehicle.mode == Mode.HOLD
    is_full = False
    assert home(run)


# Breaches


def breached(parameters=(), **orders):
    """Put a fence over the vehicle: it is in an exclusion."""
    run = on_the_way(conductor(rover(FENCE_ACTION=0.0, **dict(parameters)), **orders))
    circle = CircleZone(ZoneKind.EXCLUSION, run.vehicles[0].position, 4.0)
    upload(run, m.MissionType.FENCE, fence_to_items(Fence((*FENCE.zones, circle))))
    run.run_until(lambda: run.vehicles[0].breaches > 0, 5)
    return run


def test_a_breach_is_held_and_left_by_nothing():
    run = breached()
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    run.run_until(run.happened(EventName.NO_PLAN), 20)
    wait(run, 20)
    assert run.vehicles[0].mode == Mode.HOLD


def test_without_escape_rtl_in_an_exclusion_is_held():
    run = breached()
    run.run_until(run.happened(EventName.NO_PLAN), 20)
    unheard(run, m.SetMode(1, 1, MANUAL))
    wait(run, 65)
    unheard(run, RTL)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    run.run_until(run.happened(EventName.HOME_WAITS), 20)
    wait(run, 10)
    assert run.vehicles[0].mode == Mode.HOLD
    assert any("in exclusion" in text or "inside exclusion" in text for text in texts(run, EventName.NO_PLAN))


def test_with_escape_it_drives_out_and_home():
    # Without the autopilot's own avoidance: planning out of a fence with it takes seconds of each run.
    run = breached({"AVOID_ENABLE": 0.0}, request=Request(clearance_m=2.5, escape=True))
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 3)
    assert home(run)


# Nowhere to go


def test_one_that_stands_at_home_is_held_there():
    run = ready(conductor())
    arm(run)
    wait(run, 2)
    unheard(run, RTL)
    run.run_until(run.happened(EventName.AT_HOME), 20)
    assert texts(run, EventName.AT_HOME) == ["at home already: there is nothing to drive; HOLD"]
    wait(run, 10)
    assert (run.director.state, run.vehicles[0].mode) == (State.READY, Mode.HOLD)


def test_where_no_place_can_be_reached_it_holds_until_one_can():
    walled = Fence((*FENCE.zones, CircleZone(ZoneKind.EXCLUSION, HOME, 3.0)))
    run = on_the_way(conductor())
    upload(run, m.MissionType.FENCE, fence_to_items(walled))
    run.run_until(run.happened(EventName.NO_WAY_HOME), 10)
    assert "home" in run.director.no_way_home
    assert run.director.way_home is None
    unheard(run, RTL)
    run.run_until(run.happened(EventName.HOME_WAITS), 20)
    wait(run, 20)
    assert run.vehicles[0].mode == Mode.HOLD
    assert not run.happened(EventName.GOING_HOME)()
    upload(run, m.MissionType.RALLY, rally_to_items((RallyPoint(*NEAR),)))
    run.run_until(run.happened(EventName.GOING_HOME), 90)
    assert "rally point 1" in texts(run, EventName.GOING_HOME)[0]
    assert home(run, NEAR)


def test_the_nearest_is_chosen_from_where_it_stands():
    run = on_the_way(
        conductor(rover(rally=(NEAR, FAR)), replace(BY_ROUTE, places={"shed": HOME})), seconds=50
    )
    way = run.director.way_home
    heading_home(run)
    place = run.director.plan.targets[-1]
    assert place == min((NEAR, FAR, HOME), key=lambda one: distance_m(one, run.vehicles[0].position))
    assert way.place.position == place


# The fix


def test_without_a_fix_the_way_home_waits_for_one():
    run = on_the_way(conductor())
    run.vehicles[0].rover.receiver = Receiver(1)
    wait(run, 1)
    unheard(run, RTL)
    run.run_until(run.happened(EventName.HOME_WAITS), 10)
    assert "no 3D GPS fix" in texts(run, EventName.HOME_WAITS)[0]
    wait(run, 10)
    assert (run.director.state, run.vehicles[0].mode) == (State.PLANNING, Mode.HOLD)
    assert len(texts(run, EventName.HOME_WAITS)) == 1
    run.vehicles[0].rover.receiver = None
    assert home(run)


@pytest.mark.parametrize("receiver", [Receiver(2), Receiver(3, 40.0)])
def test_a_fix_that_gets_too_bad_on_the_way_home_is_held(receiver):
    run = heading_home(on_the_way(conductor(), seconds=25))
    wait(run, 2)
    run.vehicles[0].rover.receiver = receiver
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 5)
    assert any("GPS" in text for text in texts(run, EventName.HOME_WAITS))
    wait(run, 8)
    assert run.vehicles[0].mode == Mode.HOLD
    run.vehicles[0].rover.receiver = None
    assert home(run)


def test_a_worse_fix_that_leaves_a_way_is_planned_with_its_error():
    run = heading_home(on_the_way(conductor(), seconds=25))
    wait(run, 2)
    run.vehicles[0].rover.receiver = Receiver(3, 3.0)
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 5)
    assert home(run)
    assert run.director.plan.asked_m == pytest.approx(5.5)


def test_what_a_fix_has_room_for():
    run = heading_home(on_the_way(conductor()))
    plan, request = run.director.plan, run.director.orders.request
    room_m = plan.driven_clearance_m - plan.clearance_m
    for error_m, is_bad in ((room_m, False), (room_m + 0.31, True)):
        known = Situation(fix=Known(Fix(3, error_m), 0.0, ""))
        assert bool(fix_trouble(known, plan, request)) is is_bad
        assert not fix_trouble(known, plan, replace(request, position_error_m=1.0))
    assert fix_trouble(Situation(), plan, request) == ""
    assert is_better(Situation(fix=Known(Fix(6), 0.0, "")), Fix(3))
    assert not is_better(Situation(fix=Known(Fix(3, 1.0), 0.0, "")), Fix(3, 1.1))
    assert is_better(Situation(fix=Known(Fix(3), 0.0, "")), Fix(1))
    assert not is_better(Situation(), Fix(3))


# The way that is shown


def test_the_way_home_is_told_where_it_changes_and_made_anew_only_where_its_grounds_do():
    run = ready(conductor(rover(rally=(FAR,)), homing=Homing(is_kept=True)))
    trees, asked = [], WaysTask.made

    def made(task):
        trees.append(task.ways is None)
        return asked(task)

    WaysTask.made = made
    try:
        arm(run)
        run.director.take_target(FAR, run.now_s)
        run.run_until(lambda: run.director.state is State.ARRIVED, 200)
        wait(run, 5)
        at_rest = len(trees)
        wait(run, 20)
    finally:
        WaysTask.made = asked
    assert len(trees) == at_rest
    assert sum(trees) <= 1
    assert at_rest > 20
    told = [event.data["place"] for event in run.events if event.name is EventName.WAY_HOME]
    assert told == ["home", "rally point 1"]
    assert run.director.way_home.length_m < 3


def test_a_vehicle_that_is_not_heard_has_no_way_home():
    run = ready(conductor())
    wait(run, 3)
    assert run.director.way_home is not None
    run.is_cut = True
    run.run_until(lambda: run.director.state is State.LOST, 10)
    assert run.director.way_home is None
    run.is_cut = False
    run.run_until(lambda: run.director.way_home is not None, 20)


def test_a_defect_in_looking_for_ways_home_is_a_reason():
    made = WaysTask(Situation(), Request(), {}, None).made()
    assert "home is not known" in str(made)
    assert "bug in pbpp" in str(WaysTask(None, Request(), {}, None).made())


# Batteries


def told_by(watch: BatteryWatch, *messages, every_s: float = 1.0) -> list[str]:
    return [watch.receive(message, every_s * number) for number, message in enumerate(messages)]


def status(percent: int, *millivolts: int) -> m.BatteryStatus:
    return m.BatteryStatus(0, (*millivolts, *([65535] * (10 - len(millivolts)))), percent)


def test_a_battery_has_to_be_low_for_ten_seconds():
    watch = BatteryWatch(20, None)
    assert not any(told_by(watch, *[status(19)] * 10, status(30), *[status(20)] * 10))
    assert told_by(watch, *[status(20)] * 15)[-6:].count("battery 1 at 20 %") <= 1
    assert any(told_by(BatteryWatch(20, None), *[status(20)] * 12))
    assert not any(told_by(BatteryWatch(20, None), status(1), status(1), every_s=30))
    assert any(told_by(BatteryWatch(20, None), *[status(1)] * 3, every_s=6))


def test_volts_are_those_of_all_cells():
    cells = [3500, 3500, 3500]
    assert any("10.5 V" in text for text in told_by(BatteryWatch(None, 10.5), *[status(-1, *cells)] * 12))
    assert not any(told_by(BatteryWatch(None, 10.4), *[status(-1, *cells)] * 12))


@pytest.mark.parametrize("cells", [1, 9, 10, 11, 12, 14])
def test_volts_are_those_of_more_than_ten_cells_too(cells):
    vehicle = rover()
    codec, heard = Codec(1, 1), Codec(255, 190)
    volts = cells * 3.5

    def told(below: float) -> list[str]:
        watch, texts = BatteryWatch(None, below), []
        vehicle.rover.battery = Battery(-1, volts, cells)
        message = telemetry(147, TelemetrySource(vehicle.rover, 0, 0.0, is_ready=True))
        for number in range(12):
            (frame,) = heard.decode(codec.encode(message))
            texts.append(watch.receive(frame.message, 1.0 * number))
        return texts

    assert any(f"{volts:.1f} V" in text for text in told(volts + 0.05))
    assert not any(told(volts - 0.05))


def test_without_a_monitor_nothing_is_low():
    for message in (status(-1), status(0), status(0, 0), m.SysStatus(0, 0, 0), m.SysStatus(0, 0, 0, 0, 0)):
        assert not any(told_by(BatteryWatch(20, 10.0), *[message] * 20))
    assert not any(told_by(BatteryWatch(None, None), *[status(1)] * 20))
    assert not any(
        told_by(BatteryWatch(20, None), m.Statustext(2, "Battery failsafe options"), m.Heartbeat(10, 3))
    )


def test_sys_status_counts_where_no_battery_status_comes():
    weak = m.SysStatus(0, 0, 0, 11_000, 15)
    assert any("15 %, 11.0 V" in text for text in told_by(BatteryWatch(20, None), *[weak] * 12))
    mixed = [one for _ in range(20) for one in (weak, status(80))]
    assert not any(told_by(BatteryWatch(20, None), *mixed[1:]))


def test_no_volts_are_no_reading():
    for message in (status(60, 0), status(0, 65535), m.SysStatus(0, 0, 0, 0, 60), status(-1, 0)):
        assert not any(told_by(BatteryWatch(20, 10.5), *[message] * 20))


def test_what_sys_status_told_before_the_first_battery_status_does_not_count_for_ever():
    watch = BatteryWatch(20, None)
    watch.receive(m.SysStatus(0, 0, 0, 11_000, 15), 0.0)
    for begins_s in (20, 60):
        told = [watch.receive(status(15, 11_000), begins_s + second) for second in range(15)]
        assert sum(map(bool, told)) == 1
        assert not any(watch.receive(status(80, 12_000), begins_s + 20.0 + second) for second in range(5))


def test_what_a_battery_was_while_nothing_was_heard_of_it_is_not_known():
    watch = BatteryWatch(20, None)
    assert not any(watch.receive(status(15), time_s) for time_s in (0.0, 1.0, 3600.0, 3601.0))


def test_a_second_battery_that_is_low_calls_and_the_first_does_not_hide_it():
    watch = BatteryWatch(20, None)
    pair = [
        m.BatteryStatus(number % 2, (11_000, *[65535] * 9), 15 if number % 2 else 90) for number in range(40)
    ]
    assert [text for text in told_by(watch, *pair) if text] == ["battery 2 at 15 %, 11.0 V"]


@pytest.mark.parametrize(("system", "component", "kind"), [(1, 196, 18), (2, 1, 10), (2, 195, 18)])
def test_heartbeats_of_companions_and_other_vehicles_are_no_ground_station(system, component, kind):
    run = on_the_way(conductor(homing=replace(BY_ROUTE, gcs_timeout_s=5.0)))
    run.director.receive(STATION, run.now_s)
    heartbeat = m.Frame(system, component, m.Heartbeat(kind, 8))
    run.meddle = lambda run: run.director.receive(heartbeat, run.now_s)
    run.run_until(run.happened(EventName.CALLED_HOME), 6)


def test_without_orders_to_drive_nothing_calls_and_rtl_is_left_alone():
    everything = replace(BY_ROUTE, gcs_timeout_s=5.0, battery_percent=20)
    run = ready(conductor(drive=False, homing=everything))
    arm(run)
    run.director.take_target(FAR, run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 20)
    unheard(run, m.SetMode(1, 1, Mode.AUTO))
    wait(run, 3)
    run.vehicles[0].rover.battery = LOW
    run.director.receive(STATION, run.now_s)
    wait(run, 15)
    unheard(run, RTL)
    wait(run, 10)
    assert modes_sent(run) == []
    assert run.vehicles[0].mode == Mode.RTL


def test_the_autopilots_own_text_counts_at_once_and_it_is_told_again_only_after_it_was_full():
    watch = BatteryWatch(20, None)
    text = m.Statustext(2, "Battery 1 is low 10.20V used 1200 mAh")
    assert told_by(watch, text, text, status(90), text) == [text.text, "", "", text.text]


# Journals, notes


def test_a_journal_keeps_what_was_ordered(tmp_path):
    homing = Homing(is_kept=True, places={"shed": NEAR}, by_route=True, battery_volts=10.5)
    orders = Orders(upload=True, drive=True, homing=homing)
    file = StringIO()
    JournalWriter(file, orders, Situation())
    path = tmp_path / "run.journal.jsonl"
    path.write_text(file.getvalue())
    assert read_journal(path).orders == orders
    old = {**json.loads(file.getvalue())}
    del old["orders"]["homing"]
    path.write_text(json.dumps(old) + "\n")
    assert read_journal(path).orders.homing == Homing()
    assert asdict(Homing())["by_route"] is False


def test_an_adopted_drive_that_cannot_be_noted_goes_on_and_it_is_said():
    one = Killed(1, FAR, is_clean=True)
    one.drive_on(0.2)
    one.restart(one.note)
    run = one.run
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    run.director.note_failed(BackupError("no space left on device"), run.now_s)
    run.step()
    assert run.director.state is State.DRIVING
    assert run.last(EventName.TROUBLE).text == "no space left on device"


def test_an_adopted_drive_that_promises_less_than_is_asked_now_is_held_and_planned_anew():
    one = Killed(1, FAR, is_clean=True)
    one.drive_on(0.2)
    one.restart(one.note, request=Request(clearance_m=3.0))
    run = one.run
    run.run_until(run.happened(EventName.ROUTE_BROKEN), 20)
    run.run_until(run.happened(EventName.PLANNED), 30)
    assert run.last(EventName.PLANNED).data["clearance_m"] == 3.0
    run.run_until(lambda: run.director.state is State.DRIVING, 20)
    again = Killed(1, FAR, is_clean=True)
    again.drive_on(0.2)
    again.restart(again.note, request=Request(clearance_m=2.0))
    again.run.run_until(again.run.happened(EventName.DRIVING), 20)
    wait(again.run, 2)
    assert not again.run.happened(EventName.ROUTE_BROKEN)()


@pytest.mark.parametrize("refuses", [True, False])
def test_a_vehicle_without_rally_points_goes_home(refuses):
    vehicle = rover()
    receive, asked = vehicle.receive, []

    def without_rally(frame, now_s):
        is_rally = getattr(frame.message, "mission_type", 0) == m.MissionType.RALLY
        if not is_rally:
            receive(frame, now_s)
            return
        asked.append(now_s)
        if refuses:
            ack = m.MissionAck(
                frame.system, frame.component, m.MissionResult.UNSUPPORTED, m.MissionType.RALLY
            )
            vehicle._outbox.append(ack)

    vehicle.receive = without_rally
    run = conductor(vehicle)
    run.run_until(lambda: run.director.state is State.READY, 120)
    asked_before = len(asked)
    on_the_way(run)
    wait(run, 70)
    assert len(asked) == asked_before
    unheard(run, RTL)
    run.run_until(run.happened(EventName.CALLED_HOME), 5)
    assert home(run)


def test_a_single_job_keeps_no_ways_home():
    director = Director(Orders(once=True, request=Request(targets=(FAR,))))
    assert director.pending_ways is None
    assert director.way_home is None
