"""Reported obstacles: held for, planned round, waited for, forgotten; and nobody is overruled for them."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from director.adopting import HOME, TARGETS, YARD
from director.conducting import Conductor
from director.obstructing import Obstructed, record, summary
from shapely import LineString

from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.obstacle_watch import FRONT_M, TYPED_S
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import MovingDisc, SimulatedVehicle, SimulatorConfig
from missions.fence import fence_to_items
from missions.geo import LocalPoint, distance_m
from missions.request import Request

ORDERS = Orders(
    request=Request(clearance_m=2.5),
    upload=True,
    drive=True,
    arm=True,
    obstacle_sources=frozenset(ObstacleSource),
)


def driving(orders=ORDERS, *, target=TARGETS[0], sensor_m=15.0, **parameters):
    """Return a bridge whose rover drives."""
    config = SimulatorConfig(
        home=HOME,
        fence=fence_to_items(YARD),
        parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 2.0, **parameters},
        sensor_m=sensor_m,
    )
    run = Conductor(Director(orders), [SimulatedVehicle(config)])
    run.run_until(lambda: run.director.state is State.READY, 60)
    run.director.take_target(target, run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 120)
    return run


def on_route(run, share):
    """Return a place on the route."""
    plan = run.director.plan
    place = LineString(plan.points).interpolate(share, normalized=True)
    return plan.ground.frame.to_lat_lon(LocalPoint(place.x, place.y))


def switched(run):
    commands = (one for one in run.sent if isinstance(one, m.CommandLong) and one.command == 176)
    return [int(one.param2) for one in commands]


def names(run):
    return [event.name for event in run.events]


def test_one_on_the_route_is_held_for_and_driven_round():
    run = driving()
    disc = MovingDisc(on_route(run, 0.5), 0.8)
    run.vehicles[0].discs.append(disc)
    nearest_m = []
    run.meddle = lambda run: nearest_m.append(distance_m(run.vehicles[0].position, disc.centre) - 0.8)
    run.run_until(run.happened(EventName.OBSTACLE_ACROSS), 60)
    told_s = run.now_s
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 1)
    assert run.now_s - told_s <= 0.5
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert min(nearest_m) > 2.5
    assert names(run).count(EventName.HOLDING) == 1
    told = run.last(EventName.OBSTACLE_ACROSS)
    assert told.data["clearance_m"] < told.data["asked_m"]
    assert "OBSTACLE_DISTANCE" in told.data["obstacle"]
    planned = [event for event in run.events if event.name is EventName.PLANNED][-1]
    assert any("obstacle reported at" in text for text in planned.data["info"])
    assert EventName.WAITING not in names(run)


def test_a_thing_beside_the_route_changes_nothing():
    run = driving()
    plan = run.director.plan
    place = LineString(plan.points).interpolate(0.7, normalized=True)
    beside = plan.ground.frame.to_lat_lon(LocalPoint(place.x - 4.0, place.y + 9.0))
    run.vehicles[0].discs.append(MovingDisc(beside, 0.5))
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert EventName.OBSTACLE_ACROSS not in names(run)
    assert run.director.situation.obstacles.known == () or EventName.HOLDING not in names(run)


def test_without_orders_for_it_nothing_is_heeded():
    run = driving(replace(ORDERS, obstacle_sources=frozenset()))
    run.vehicles[0].discs.append(MovingDisc(on_route(run, 0.3), 0.8))
    run.director.take_obstacle(on_route(run, 0.6), 2.0, run.now_s)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    assert run.director.situation.obstacles.known == ()
    assert set(switched(run)) == {Mode.HOLD, Mode.AUTO}


def test_without_drive_it_is_only_told():
    run = driving()
    run.director.orders = replace(ORDERS, drive=False, arm=False)
    run.sent.clear()
    run.vehicles[0].discs.append(MovingDisc(on_route(run, 0.5), 0.8))
    run.run_until(run.happened(EventName.OBSTACLE_ACROSS), 60)
    until_s = run.now_s + 3
    run.run_until(lambda: run.now_s >= until_s)
    assert switched(run) == []
    assert names(run).count(EventName.OBSTACLE_ACROSS) == 1


@pytest.mark.parametrize("confirm", [False, True])
def test_without_drive_a_route_that_stands_is_not_made_anew(confirm):
    orders = replace(ORDERS, drive=False, arm=False, confirm=confirm)
    config = SimulatorConfig(home=HOME, fence=fence_to_items(YARD), parameters={"FENCE_ENABLE": 1.0})
    run = Conductor(Director(orders), [SimulatedVehicle(config)])
    run.run_until(lambda: run.director.state is State.READY, 60)
    run.director.take_target(TARGETS[0], run.now_s)
    stands = State.PROPOSED if confirm else State.VERIFIED
    run.run_until(lambda: run.director.state is stands, 30)
    run.director.take_obstacle(on_route(run, 0.5), 2.0, run.now_s)
    until_s = run.now_s + 5
    run.run_until(lambda: run.now_s >= until_s)
    run.director.confirm(run.now_s)
    run.run_until(lambda: run.director.state is State.VERIFIED, 10)
    until_s = run.now_s + 5
    run.run_until(lambda: run.now_s >= until_s)
    told = names(run)
    assert [
        told.count(name) for name in (EventName.OBSTACLE_ACROSS, EventName.PLANNED, EventName.UPLOADING)
    ] == [1, 1, 1]


def block(run):
    """Type a wall across the only way; return its obstacles' count."""
    plan = run.director.plan
    frame = plan.ground.frame
    place = LineString(plan.points).interpolate(0.5, normalized=True)
    for number, step in enumerate(range(-90, 91, 9)):
        run.director.take_obstacle(
            frame.to_lat_lon(LocalPoint(place.x + step, place.y - step / 2)), 6.0, run.now_s + number / 1e6
        )


def test_where_no_way_is_left_it_says_what_it_waits_for_and_drives_on_by_itself():
    run = driving()
    block(run)
    run.run_until(run.happened(EventName.WAITING), 60)
    told = run.last(EventName.WAITING)
    assert told.text.startswith("waiting: the obstacle reported at ")
    assert "keyboard" in told.data["obstacle"]
    assert told.data["forgotten_in_s"] == pytest.approx(TYPED_S, abs=20)
    assert EventName.NO_PLAN not in names(run)
    until_s = run.now_s + 20
    run.run_until(lambda: run.now_s >= until_s)
    assert run.vehicles[0].mode == Mode.HOLD
    assert names(run).count(EventName.WAITING) == 1
    cleared_s = run.now_s
    run.director.clear_obstacles(run.now_s)
    run.run_until(lambda: run.director.state is State.DRIVING, 10)
    assert run.now_s - cleared_s <= 3.5
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)


def test_it_drives_on_once_what_was_typed_is_forgotten(monkeypatch):
    kept_s = 60.0  # ten minutes of waiting show no more
    monkeypatch.setattr("mavlink_bridge.director.obstacle_watch.TYPED_S", kept_s)
    run = driving()
    block(run)
    run.run_until(run.happened(EventName.WAITING), 60)
    waited_s = run.now_s
    run.run_until(lambda: run.director.state is State.DRIVING, kept_s + 20)
    assert run.now_s - waited_s > kept_s - 20
    assert run.director.situation.obstacles.known == ()


def test_who_takes_over_while_it_waits_keeps_the_vehicle():
    run = driving()
    block(run)
    run.run_until(run.happened(EventName.WAITING), 60)
    run.ground_station(m.SetMode(1, 1, 0))
    run.run_until(lambda: run.director.state is State.LET_GO, 5)
    run.sent.clear()
    run.director.clear_obstacles(run.now_s)
    until_s = run.now_s + 10
    run.run_until(lambda: run.now_s >= until_s)
    assert switched(run) == []
    assert run.vehicles[0].mode == 0


def test_where_the_fence_itself_leaves_no_way_that_is_the_reason_that_is_told():
    run = driving()
    run.director.take_obstacle(on_route(run, 0.4), 1.0, run.now_s)
    run.run_until(run.happened(EventName.OBSTACLE_ACROSS), 5)
    run.run_until(lambda: run.director.state is State.ARRIVED, 200)
    outside = YARD.zones[0].vertices[0]
    run.director.take_obstacle(
        run.director.situation.pose.value.position._replace(lat_deg=40.0715), 0.5, run.now_s
    )
    run.director.take_target(outside, run.now_s)
    run.run_until(run.happened(EventName.NO_PLAN), 20)
    assert EventName.WAITING not in names(run)


def test_blocked_is_right_before_the_vehicle_and_held_for_at_once():
    run = driving(sensor_m=0.0)
    until_s = run.now_s + 8
    run.run_until(lambda: run.now_s >= until_s)
    run.director.take_obstacle(None, 1.5, run.now_s)
    pose = run.director.situation.pose.value
    (one,) = run.director.situation.obstacles.known
    assert distance_m(pose.position, one.position) == pytest.approx(FRONT_M + 1.5, abs=0.01)
    begun_s = run.now_s
    run.run_until(lambda: run.vehicles[0].mode == Mode.HOLD, 1)
    assert run.now_s - begun_s <= 0.5
    run.run_until(run.happened(EventName.BREACH_AHEAD), 1)
    text = run.last(EventName.BREACH_AHEAD).text
    assert re.match(
        r"obstacle inside the stopping distance: -?\d+\.\d m ahead, stops in \d+\.\d m from ", text
    )
    assert " m beyond the edge of the obstacle reported at " in text


def heard(run, message, *, component=196, system=1):
    run.director.receive(m.Frame(system, component, message), run.now_s)
    return run.director.situation.obstacles.known


def scan(distances=None, **more):
    cm = [1501] * 72
    for sector, value in (distances or {}).items():
        cm[sector] = value
    return m.ObstacleDistance(
        0, 0, tuple(cm), **{"increment": 5, "min_distance": 20, "max_distance": 1500, "frame": 12, **more}
    )


@pytest.fixture(scope="module")
def standing():
    """Return a bridge beside a rover that stands, without a sensor."""
    config = SimulatorConfig(home=HOME, heading_deg=90.0, fence=fence_to_items(YARD))
    run = Conductor(Director(ORDERS), [SimulatedVehicle(config)])
    run.run_until(lambda: run.director.state is State.READY, 60)
    return run


@pytest.fixture
def fresh(standing):
    """Return it with no obstacle known, and a scan due."""
    standing.director.clear_obstacles(standing.now_s)
    standing.director._parts.obstacles._has_refused = False
    standing.director._parts.obstacles._attitude = None
    until_s = standing.now_s + 0.3
    standing.run_until(lambda: standing.now_s >= until_s)
    standing.events.clear()
    return standing


@pytest.mark.parametrize(
    ("message", "bearing_deg"),
    [
        (scan({0: 500}), 90.0),
        (scan({3: 500}), 105.0),
        (scan({0: 500}, angle_offset=-40.0), 50.0),
        (scan({2: 500}, increment_f=10.0), 110.0),
        (scan({2: 500}, increment_f=-5.0), 80.0),
        (scan({2: 500}, increment=5, increment_f=5.0, angle_offset=20.0), 120.0),
    ],
)
def test_a_scan_is_read_as_ardupilot_reads_it(fresh, message, bearing_deg):
    (one,) = heard(fresh, message)
    frame = fresh.director._parts.obstacles._ground().frame
    east, north = (a - b for a, b in zip(frame.to_local(one.position), frame.to_local(HOME), strict=True))
    assert math.degrees(math.atan2(east, north)) % 360 == pytest.approx(bearing_deg, abs=0.5)
    assert math.hypot(east, north) == pytest.approx(5.0 + one.radius_m, abs=0.05)
    assert one.growth_mps == ORDERS.obstacle_growth_mps


@pytest.mark.parametrize("value", [0, 19, 1501, 1502, 65535])
def test_what_is_no_distance_is_nothing_seen(fresh, value):
    assert heard(fresh, scan({0: value})) == ()


@pytest.mark.parametrize(
    "message",
    [
        scan({0: 500}, frame=0),
        scan({0: 500}, frame=1),
        scan({0: 500}, increment=0),
        scan({0: 500}, increment_f=math.nan),
        scan({0: 500}, angle_offset=math.inf),
    ],
)
def test_what_cannot_be_read_for_sure_is_refused_and_it_is_said_once(fresh, message):
    assert heard(fresh, message) == ()
    fresh.now_s += 0.2
    assert heard(fresh, message) == ()
    assert [event.name for event in fresh.director.take_events()] == [EventName.TROUBLE]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "settings",
    [
        {"increment": 255},
        {"increment": 45},
        {"increment_f": 180.0},
        {"increment_f": 360.0},
        {"increment_f": 400.0},
        {"increment_f": 1e30},
        {"increment_f": 1.4e-45},
        {"angle_offset": 3e38},
        {"min_distance": 1500, "max_distance": 20},
        {"min_distance": 0, "max_distance": 65535},
    ],
)
def test_nonsense_in_a_scan_stops_nothing_and_stays_bounded(fresh, settings):
    for value in (1, 25, 400, 1500, 65534):
        fresh.director.clear_obstacles(fresh.now_s)
        fresh.now_s += 0.1
        for one in heard(fresh, scan(dict.fromkeys(range(72), value), **settings)):
            assert math.isfinite(one.position.lat_deg + one.position.lon_deg)
            assert 0 < one.radius_m <= 4.0
    assert len(fresh.director.situation.obstacles.known) <= 64


def test_thousands_of_obstacles_are_no_more_than_the_newest(fresh):
    place = fresh.director.situation.pose.value.position
    for number in range(2000):
        fresh.director.take_obstacle(place._replace(lat_deg=40.07 + number * 1e-6), 0.5, fresh.now_s)
    assert len(fresh.director.situation.obstacles.known) == 64
    for number in range(60):
        fresh.now_s += 0.1
        heard(fresh, scan({i: 300 + (i * 131 + number * 397) % 1100 for i in range(0, 72, 2)}))
    assert len(fresh.director.situation.obstacles.known) <= 128
    assert len(fresh.director._parts.obstacles._tracks) <= 64


def test_a_scan_of_another_system_or_too_soon_after_another_counts_for_nothing(fresh):
    assert heard(fresh, scan({0: 500}), system=2) == ()
    heard(fresh, scan())
    assert heard(fresh, scan({0: 500})) == ()


def test_attitude_is_newer_than_the_heading_of_a_position(fresh):
    heard(fresh, m.Attitude(0, 0.0, 0.0, 0.0), component=1)
    (one,) = heard(fresh, scan({0: 500}))
    assert one.position.lat_deg > HOME.lat_deg
    assert one.position.lon_deg == pytest.approx(HOME.lon_deg, abs=1e-6)
    until_s = fresh.now_s + 0.6
    fresh.run_until(lambda: fresh.now_s >= until_s)
    heard(fresh, m.Attitude(0, 0.0, 0.0, math.nan), component=1)
    fresh.director.clear_obstacles(fresh.now_s)
    assert heard(fresh, scan({0: 500})) == ()


def test_attitude_is_asked_for_where_it_does_not_come(fresh):
    fresh.director._parts.obstacles._asked_s = -math.inf
    heard(fresh, scan({0: 500}))
    asked = [one for one in fresh.director.messages_to_send() if isinstance(one, m.RequestDataStream)]
    assert asked == [m.RequestDataStream(1, 1, 10, 10, 1)]


def test_nothing_is_asked_for_while_somebody_speaks_with_our_ids():
    run = driving(sensor_m=0.0)
    run.director.receive(m.Frame(1, 195, m.Heartbeat(6, 8)), run.now_s)
    run.run_until(lambda: run.director.state is State.CLASHED, 5)
    until_s = run.now_s + 3
    run.run_until(lambda: run.now_s >= until_s)
    run.sent.clear()
    heard(run, scan({0: 500}))
    assert run.director.situation.obstacles.known
    until_s = run.now_s + 3
    run.run_until(lambda: run.now_s >= until_s)
    assert not any(isinstance(one, m.RequestDataStream) for one in run.sent)


def test_a_thing_that_is_seen_ten_times_a_second_is_one_that_stands_and_it_is_forgotten(fresh):
    first_s = fresh.now_s
    for _ in range(30):
        known = heard(fresh, scan({0: 500, 1: 510}))
        until_s = fresh.now_s + 0.1
        fresh.run_until(lambda until_s=until_s: fresh.now_s >= until_s)
    (one,) = known
    assert one.reported_s == pytest.approx(first_s)
    assert one.growth_mps == pytest.approx(0.2)
    assert one.time_to_live_s == ORDERS.obstacle_keep_s
    until_s = fresh.now_s + ORDERS.obstacle_keep_s + 0.1
    fresh.run_until(lambda: fresh.now_s >= until_s)
    assert fresh.director.situation.obstacles.known == ()


def test_it_grows_as_fast_as_it_is_seen_to_move(fresh):
    for step in range(40):
        known = heard(fresh, scan({0: 900 - 10 * step}))  # 1 m/s, straight on
        until_s = fresh.now_s + 0.1
        fresh.run_until(lambda until_s=until_s: fresh.now_s >= until_s)
    (one,) = known
    assert one.growth_mps == pytest.approx(1.0, abs=0.2)


def test_there_are_no_obstacles_where_no_fence_is_known():
    config = SimulatorConfig(home=HOME, sensor_m=15.0, discs=(MovingDisc(TARGETS[1], 1.0),))
    run = Conductor(Director(ORDERS), [SimulatedVehicle(config)])
    run.run_until(lambda: run.director.state is State.READY, 60)
    assert heard(run, scan({0: 500})) == ()
    assert run.director.situation.obstacles.known == ()


@pytest.mark.parametrize("seed", [1, 5, 8])
def test_among_moving_discs_it_holds_in_time_and_touches_none(seed, capsys):
    seen = record(seed)
    assert not seen["bad"]
    assert all(one <= (0.5 if "good" in seen["kind"] else 1.5) for one in seen["held_s"])
    summary([seen])
    assert "1 runs, 0 bad" in capsys.readouterr().out


def test_the_campaign_would_notice_a_rover_that_does_not_hold():
    one = Obstructed(1)
    one.run.director.orders = replace(one.run.director.orders, obstacle_sources=frozenset())
    seen = one.drive()
    assert seen.bad or seen.contact
