"""AUTO, GUIDED, RTL, HOLD and fences as a ground station sees them, in the setting of the measured table: 80 m with something in the way."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from simulator.station import HOME, Bench, at, kept, line, placed, square, vertex

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MavResult, MissionType
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatorConfig
from mavlink_bridge.simulator.fence_watch import FenceArea
from mavlink_bridge.simulator.flat import FlatFrame, TrueFrame
from missions.geo import LatLon, distance_m
from missions.items import Command, CoordinateFrame, MissionItem, waypoint
from missions.rally import RallyPoint, rally_to_items

BLOCK = tuple(square(40, 0))
AHEAD = (kept(waypoint(at(80, 0))),)


def bench_of(mission=AHEAD, fence=(), **parameters) -> Bench:
    config = SimulatorConfig(
        mission=tuple(mission), fence=tuple(fence), parameters={"FENCE_ENABLE": 1.0, **parameters}
    )
    return Bench(config)


def command(number, *params) -> MissionItem:
    return MissionItem(number, CoordinateFrame.GLOBAL_RELATIVE_ALT, (*params, *[0.0] * (4 - len(params))))


def is_complete(bench):
    return lambda: bench.vehicle.rover.mission_run.is_complete


def north_m(bench) -> float:
    return FlatFrame(HOME).to_flat(bench.vehicle.position).real


def test_auto_drives_the_mission_and_stays_in_auto():
    bench = bench_of(line(3), FENCE_TYPE=4.0)
    bench.start_auto()
    bench.run_until(is_complete(bench), 60.0)
    bench.run(15.0)
    assert [reached.seq for reached in bench.of(m.MissionItemReached)] == [1, 2, 3]
    assert bench.texts()[-2:] == ["Reached waypoint #3", "Mission Complete"]
    assert bench.vehicle.mode == Mode.AUTO
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(0.0, abs=0.01)
    assert distance_m(bench.vehicle.position, at(30, 0)) < 1.0
    assert bench.vehicle.least_clearance_m == math.inf


def test_the_default_stops_a_margin_short_of_a_fence_and_stays():
    bench = bench_of(fence=BLOCK)
    bench.start_auto()
    bench.run(60.0)
    before_m = north_m(bench)
    bench.run(60.0)
    assert north_m(bench) == pytest.approx(before_m, abs=0.05)
    assert bench.vehicle.mode == Mode.AUTO
    assert bench.vehicle.least_clearance_m == pytest.approx(2.0, abs=0.35)
    assert bench.vehicle.breaches == 0


def test_without_avoidance_it_breaches_and_drives_home():
    bench = bench_of(fence=BLOCK, AVOID_ENABLE=0.0)
    bench.start_auto()
    bench.run_until(lambda: bench.vehicle.mode == Mode.RTL, 60.0)
    at_once = bench.of(m.FenceStatus)[-1]
    assert (at_once.breach_status, at_once.breach_count) == (1, 1)
    assert bench.of(m.Heartbeat)[-1].custom_mode == Mode.RTL
    assert not any("fence" in text.lower() for text in bench.texts())  # Rover has no text for it
    bench.run(1.0)
    status = bench.of(m.FenceStatus)[-1]
    assert (status.breach_status, status.breach_count, status.breach_type) == (1, 1, 3)
    assert not bench.of(m.SysStatus)[-1].onboard_control_sensors_health & 1 << 20
    bench.run_until(lambda: distance_m(bench.vehicle.position, HOME) < 2.0, 90.0)
    assert bench.of(m.FenceStatus)[-1].breach_status == 0
    assert bench.vehicle.breaches == bench.of(m.FenceStatus)[-1].breach_count >= 1
    assert bench.vehicle.least_clearance_m < 0


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, Mode.AUTO),
        (1, Mode.RTL),
        (2, Mode.HOLD),
        (3, Mode.SMART_RTL),
        (4, Mode.SMART_RTL),
        (5, Mode.AUTO),
        (6, Mode.LOITER),
    ],
)
def test_what_a_breach_does(action, mode):
    bench = bench_of(fence=BLOCK, AVOID_ENABLE=0.0, FENCE_ACTION=action)
    bench.start_auto()
    bench.run_until(lambda: bench.vehicle.breaches == 1, 60.0)
    assert bench.vehicle.mode == mode
    assert bench.vehicle.is_armed is (action != 5)


def test_far_outside_it_stops_instead_of_driving_home():
    fence = square(0, 0, 10.0, inclusion=True)
    far = at(500, 0)
    parameters = {"FENCE_TYPE": 4.0, "AVOID_ENABLE": 0.0}
    bench = Bench(SimulatorConfig(home=far, mission=AHEAD, fence=tuple(fence), parameters=parameters))
    bench.start_auto()
    bench.run(5.0)
    bench.ask(m.ParamSet(1, 1, "FENCE_ENABLE", 1.0, 9))
    bench.run(0.1)
    assert bench.vehicle.breaches == 1
    assert bench.vehicle.mode == Mode.HOLD
    assert bench.vehicle.least_clearance_m == pytest.approx(-492.0, abs=3.0)


def test_a_fence_that_is_not_enabled_is_only_measured():
    bench = bench_of(fence=BLOCK, FENCE_ENABLE=0.0)
    bench.start_auto()
    bench.run_until(is_complete(bench), 60.0)
    assert bench.vehicle.breaches == 0
    assert bench.vehicle.least_clearance_m == pytest.approx(-5.0, abs=0.2)
    assert not bench.of(m.FenceStatus)


def test_a_polygon_fence_needs_its_type():
    bench = bench_of(fence=BLOCK, FENCE_TYPE=2.0)
    bench.start_auto()
    bench.run_until(is_complete(bench), 60.0)
    assert bench.vehicle.breaches == 0


def test_the_home_circle_is_kept():
    bench = bench_of(FENCE_RADIUS=30.0)
    bench.start_auto()
    bench.run(60.0)
    assert north_m(bench) == pytest.approx(28.0, abs=0.5)
    assert bench.vehicle.breaches == 0


def test_disabled_avoidance_does_not_matter_beside_the_line():
    beside = tuple(square(40, 7.5))
    bench = bench_of(fence=beside)
    bench.start_auto()
    bench.run_until(is_complete(bench), 60.0)
    assert bench.vehicle.least_clearance_m == pytest.approx(2.6, abs=0.15)


def test_union_of_inclusions():
    fields = [*square(0, 0, 30.0, inclusion=True), *square(40, 0, 30.0, inclusion=True)]
    both, avoiding, one = (
        bench_of(kept_line(), fields, FENCE_OPTIONS=option, AVOID_ENABLE=avoid)
        for option, avoid in ((2.0, 0.0), (2.0, 3.0), (0.0, 0.0))
    )
    for bench in (both, avoiding, one):
        bench.start_auto()
        bench.run(40.0)
    assert both.vehicle.breaches == avoiding.vehicle.breaches == 0
    assert both.vehicle.rover.mission_run.is_complete
    assert north_m(avoiding) == pytest.approx(28.0, abs=0.2)  # a seam is a wall to its avoidance
    assert one.vehicle.least_clearance_m < 0


def kept_line():
    return (kept(waypoint(at(50, 0))),)


def test_a_self_crossing_fence_is_even_odd():
    bow = [vertex(at(n, e), 4) for n, e in ((0, 0), (20, 20), (20, 0), (0, 20))]
    area = FenceArea(bow, FlatFrame(HOME))
    assert area.clearance_m(complex(2, 10)) == pytest.approx(-2.0, abs=0.01)
    assert area.clearance_m(complex(18, 10)) == pytest.approx(-2.0, abs=0.01)
    assert area.clearance_m(complex(10, 5)) == pytest.approx(5 / math.sqrt(2), abs=0.01)
    assert area.clearance_m(complex(10, 15)) == pytest.approx(5 / math.sqrt(2), abs=0.01)


def test_an_infinite_circle_forbids_everything():
    circle = placed(Command.FENCE_CIRCLE_EXCLUSION, HOME, math.inf)
    assert FenceArea([circle], FlatFrame(HOME)).clearance_m(0j) < -1e5


def test_no_fence_is_far_away():
    area = FenceArea([], FlatFrame(HOME))
    assert area.is_empty
    assert area.clearance_m(0j) == math.inf


def test_a_fence_uploaded_under_way_counts_at_once():
    bench = bench_of()
    bench.start_auto()
    bench.run(3.0)
    bench.upload(BLOCK, MissionType.FENCE)
    bench.run(60.0)
    assert bench.vehicle.least_clearance_m == pytest.approx(2.0, abs=0.35)
    bench.ask(m.MissionClearAll(1, 1, MissionType.FENCE))
    bench.run_until(is_complete(bench), 60.0)
    assert distance_m(bench.vehicle.position, at(80, 0)) < 1.0


def test_a_delay_stops_the_rover():
    mission = [replace(item, params=(3.0, 0.0, 0.0, 0.0)) for item in line(1)] + [kept(waypoint(at(20, 0)))]
    bench = bench_of(mission)
    bench.start_auto()
    slowest = math.inf
    stood_s = 0.0
    while not bench.vehicle.rover.mission_run.is_complete:
        bench.run(0.1)
        speed = abs(bench.vehicle.rover.body.speed_mps)
        if 8.0 < north_m(bench) < 12.0:
            slowest = min(slowest, speed)
            stood_s += 0.1 * (speed < 0.2)
    assert slowest < 0.1
    assert stood_s > 2.0


def test_speed_changes_hold_from_their_place_on():
    mission = [*line(2), command(Command.DO_CHANGE_SPEED, 1.0, 1.0), *line(4)[2:]]
    bench = bench_of(mission)
    bench.start_auto()
    bench.run_until(lambda: bench.vehicle.rover.mission_run.seq == 4, 60.0)
    bench.run(6.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(1.0, abs=0.1)
    assert bench.command(Command.DO_CHANGE_SPEED, 1, 2.0) == MavResult.ACCEPTED
    assert bench.command(Command.DO_CHANGE_SPEED, 1, 0.0) == MavResult.DENIED


def test_a_speed_change_on_a_leg_takes_hold():
    bench = bench_of((kept(waypoint(at(150, 0))),))
    bench.start_auto()
    bench.run(2.0)
    bench.command(Command.DO_CHANGE_SPEED, 1, 2.0)  # while it gathers speed
    bench.run(12.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(2.0, abs=0.1)
    bench.command(Command.DO_CHANGE_SPEED, 1, 4.0)
    bench.run(8.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(4.0, abs=0.25)
    bench.run_until(lambda: north_m(bench) > 148.0, 60.0)
    bench.command(Command.DO_CHANGE_SPEED, 1, 5.0)  # too late: it slows down already
    bench.run_until(is_complete(bench), 10.0)


def test_jumps_are_counted_and_end():
    mission = [*line(2), command(Command.DO_JUMP, 1.0, 1.0), kept(waypoint(at(30, 0)))]
    bench = bench_of(mission)
    bench.start_auto()
    bench.run_until(is_complete(bench), 120.0)
    assert [reached.seq for reached in bench.of(m.MissionItemReached)] == [1, 2, 1, 2, 4]


def test_a_mission_of_jumps_only_is_complete():
    bench = bench_of([command(Command.DO_JUMP, 1.0, -1.0)])
    bench.start_auto()
    bench.run(1.0)
    assert bench.vehicle.rover.mission_run.is_complete


def test_a_jump_to_itself_ends_the_look_ahead():
    bench = bench_of([*line(1), command(Command.DO_JUMP, 2.0, -1.0)])
    bench.start_auto()
    bench.run_until(is_complete(bench), 60.0)
    assert "Mission Complete" in bench.texts()


def test_other_navigation_commands():
    mission = [
        replace(line(1)[0], command=Command.NAV_LOITER_TIME, params=(2.0, 0.0, 0.0, 0.0)),
        command(Command.NAV_DELAY, 2.0),
        replace(line(1)[0], lat_e7=0, lon_e7=0),
        command(Command.NAV_RETURN_TO_LAUNCH),
    ]
    bench = bench_of(mission)
    bench.start_auto()
    bench.run_until(is_complete(bench), 120.0)
    assert [reached.seq for reached in bench.of(m.MissionItemReached)] == [1, 2, 3, 4]
    assert distance_m(bench.vehicle.position, HOME) < 1.5


def test_loitering_without_limit_never_ends():
    bench = bench_of([replace(line(1)[0], command=Command.NAV_LOITER_UNLIM), *line(2)])
    bench.start_auto()
    bench.run(60.0)
    assert not bench.of(m.MissionItemReached)
    assert distance_m(bench.vehicle.position, at(10, 0)) < 1.0


def test_hold_stops_and_auto_resumes():
    bench = bench_of(line(6))
    bench.start_auto()
    bench.run_until(lambda: bench.vehicle.rover.mission_run.seq == 3, 60.0)
    bench.command(Command.DO_SET_MODE, 1, 4)
    bench.run(20.0)  # it rolls out
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(0.0, abs=0.01)
    assert bench.vehicle.rover.is_idle
    bench.command(Command.DO_SET_MODE, 1, 10)
    bench.run_until(is_complete(bench), 90.0)
    assert [reached.seq for reached in bench.of(m.MissionItemReached)] == [1, 2, 3, 4, 5, 6]
    bench.command(Command.DO_SET_MODE, 1, 4)
    bench.command(Command.DO_SET_MODE, 1, 10)
    assert bench.texts()[-1] == "Mission: 1 WP"


def test_disarming_lets_it_roll_out():
    bench = bench_of(line(6))
    bench.start_auto()
    bench.run(6.0)
    bench.command(Command.COMPONENT_ARM_DISARM, 0)
    bench.run(20.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(0.0, abs=0.01)
    assert not bench.vehicle.rover.mission_run.is_complete
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    bench.run_until(is_complete(bench), 120.0)


def test_a_mission_changed_under_way_restarts_the_item():
    bench = bench_of(line(6))
    bench.start_auto()
    bench.run(6.0)
    seq = bench.vehicle.rover.mission_run.seq
    bench.upload_mission([kept(waypoint(at(10.0 * (n + 1), 20.0))) for n in range(6)])
    assert "Auto mission changed, restarted command" in bench.texts()
    assert bench.vehicle.rover.mission_run.seq == seq
    bench.run_until(is_complete(bench), 90.0)
    assert distance_m(bench.vehicle.position, at(60, 20)) < 1.5


def test_a_mission_cleared_under_way_ends_it():
    bench = bench_of(line(6))
    bench.start_auto()
    bench.run(6.0)
    bench.count(0)
    bench.run(1.0)
    assert bench.vehicle.rover.mission_run.is_complete


def test_guided_goes_stops_and_says_so():
    bench = bench_of()
    bench.command(Command.DO_SET_MODE, 1, 15)
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    target = at(20, 20)
    x, y = round(target.lat_deg * 1e7), round(target.lon_deg * 1e7)
    assert bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, x=x, y=y) == MavResult.ACCEPTED
    bench.run_until(lambda: bool(bench.of(m.MissionItemReached)), 60.0)
    assert bench.of(m.MissionItemReached) == [m.MissionItemReached(0)]
    bench.run(10.0)
    assert distance_m(bench.vehicle.position, target) < 1.0
    assert bench.vehicle.rover.is_idle


def test_a_new_guided_target_replaces_the_old_one_under_way():
    bench = bench_of()
    bench.command(Command.DO_SET_MODE, 1, 15)
    bench.command(Command.COMPONENT_ARM_DISARM, 1)
    for north, east in ((40, 0), (20, 30)):
        target = at(north, east)
        x, y = round(target.lat_deg * 1e7), round(target.lon_deg * 1e7)
        bench.command(Command.DO_REPOSITION, -1, 1, as_int=True, x=x, y=y)
        bench.run(5.0)
    bench.run_until(lambda: bool(bench.of(m.MissionItemReached)), 60.0)
    bench.run(5.0)
    assert distance_m(bench.vehicle.position, at(20, 30)) < 1.0


def test_the_estimate_differs_from_the_truth_as_measured():
    bench = bench_of()
    bench.ask(m.RequestDataStream(1, 1, 0, 4, 1))
    bench.start_auto()
    bench.run(10.0)
    told, true = bench.of(m.GlobalPositionInt)[-1], bench.of(m.Simstate)[-1]
    away_m = distance_m(LatLon(told.lat / 1e7, told.lon / 1e7), LatLon(true.lat / 1e7, true.lng / 1e7))
    assert 0.03 <= away_m <= 0.25


def test_skid_steering_pivots_at_sharp_corners():
    skid = {
        "SERVO1_FUNCTION": 73.0,
        "SERVO3_FUNCTION": 74.0,
        "ATC_STR_RAT_FF": 0.2,
        "CRUISE_SPEED": 3.0,
        "CRUISE_THROTTLE": 75.0,
        "WP_SPEED": 2.0,
    }
    corner = [kept(waypoint(at(20, 0))), kept(waypoint(at(20, 20)))]
    bench = bench_of(corner, **skid)
    bench.start_auto()
    slowest = math.inf
    while not bench.vehicle.rover.mission_run.is_complete:
        bench.run(0.1)
        if distance_m(bench.vehicle.position, at(20, 0)) < 0.4:
            slowest = min(slowest, abs(bench.vehicle.rover.body.speed_mps))
    assert slowest < 0.1
    assert bench.vehicle.rover.heading_deg == pytest.approx(90.0, abs=5.0)


def test_flat_frames_agree_with_their_definitions():
    flat, true = FlatFrame(HOME), TrueFrame(HOME)
    for north, east in ((100.0, 50.0), (-300.0, 700.0)):
        there = flat.to_lat_lon(complex(north, east))
        assert flat.to_flat(there) == pytest.approx(complex(north, east), abs=1e-6)
        assert abs(true.to_flat(there)) == pytest.approx(distance_m(HOME, there), rel=2e-4)
    assert flat.to_flat(LatLon(HOME.lat_deg + 1e-3, HOME.lon_deg)).real == pytest.approx(111.3195)
    across = FlatFrame(LatLon(10.0, 179.9999))
    assert across.to_flat(LatLon(10.0, -179.9999)).imag == pytest.approx(
        2e-4 * 1.113195e5 * math.cos(math.radians(10))
    )
    assert across.to_lat_lon(complex(0, 100)).lon_deg < 0


def test_a_rover_within_the_margin_with_its_nose_to_the_fence_backs_out_of_it():
    bench = bench_of(fence=tuple(square(6.5, 0)))
    bench.start_auto()
    bench.run(20.0)
    assert north_m(bench) == pytest.approx(-0.5, abs=0.1)
    assert bench.vehicle.mode == Mode.AUTO


def test_a_fence_enabled_round_a_standing_rover_is_a_breach_at_once():
    bench = bench_of(fence=tuple(square(0, 0)), FENCE_ENABLE=0.0)
    assert bench.vehicle.least_clearance_m == pytest.approx(-5.0, abs=0.05)
    bench.ask(m.ParamSet(1, 1, "FENCE_ENABLE", 1.0, 9))
    bench.run(1.0)
    assert bench.of(m.FenceStatus)[-1].breach_status == 1
    assert bench.vehicle.mode == Mode.MANUAL  # nothing to be done about it while disarmed
    bench.ask(m.ParamSet(1, 1, "FENCE_ENABLE", 0.0, 9))
    assert not bench.vehicle.rover.breached


def test_a_new_waypoint_speed_takes_hold():
    bench = bench_of((kept(waypoint(at(150, 0))),))
    bench.start_auto()
    bench.run(8.0)
    bench.ask(m.ParamSet(1, 1, "WP_SPEED", 2.0, 9))
    bench.run(6.0)
    assert bench.vehicle.rover.body.speed_mps == pytest.approx(2.0, abs=0.2)


def test_a_pivot_may_be_followed_by_a_pause():
    skid = {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0, "ATC_STR_RAT_FF": 0.2, "CRUISE_SPEED": 3.0}
    times = []
    for delay_s in (0.0, 3.0):
        bench = bench_of(
            [kept(waypoint(at(0, 15)))], WP_PIVOT_DELAY=delay_s, WP_SPEED=2.0, CRUISE_THROTTLE=75.0, **skid
        )
        bench.start_auto()
        times.append(bench.run_until(is_complete(bench), 60.0))
    assert times[1] - times[0] == pytest.approx(3.0, abs=0.3)


def test_a_rover_that_stops_has_no_leg_to_be_off():
    bench = bench_of()
    assert bench.vehicle.rover.drive.cross_track_m == 0.0
    assert bench.vehicle.rover.drive.distance_m == 0.0


def rally_bench(*rally: LatLon, **parameters) -> Bench:
    config = SimulatorConfig(
        mission=(kept(waypoint(at(60, 0))), command(Command.NAV_RETURN_TO_LAUNCH)),
        rally=rally_to_items(RallyPoint(*place) for place in rally),
        parameters={"WP_SPEED": 2.0, **parameters},
    )
    return Bench(config)


@pytest.mark.parametrize(
    ("parameters", "east_m"),
    [({}, 40.0), ({"RALLY_LIMIT_KM": 0.02}, 0.0), ({"RALLY_INCL_HOME": 0.0, "RALLY_LIMIT_KM": 0.0}, 40.0)],
)
def test_rtl_drives_to_the_rally_point_that_ardupilot_chooses(parameters, east_m):
    """From 60 m north of home the one 40 m east of there is the nearest; beyond the limit it is home."""
    bench = rally_bench(at(60, 40), at(-90, 0), **parameters)
    bench.start_auto()
    bench.run_until(is_complete(bench), 120.0)
    north = 60.0 if east_m else 0.0
    assert distance_m(bench.vehicle.position, at(north, east_m)) < 2.5


def test_rtl_as_a_mode_chooses_where_it_begins():
    bench = rally_bench(at(20, 40), RALLY_INCL_HOME=0.0)
    bench.start_auto()
    bench.run_until(lambda: north_m(bench) > 15.0, 60.0)
    bench.vehicle.rover.set_mode(Mode.RTL, bench.now_s)
    bench.run(60.0)
    assert distance_m(bench.vehicle.position, at(20, 40)) < 2.5
