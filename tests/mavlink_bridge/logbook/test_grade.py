"""Drives in logs, graded: made ones whose measures are known, and a recorded one."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from logbook.making import FIELD, ORIGIN, ROVER, Log, place

from mavlink_bridge.logbook import read_logbook
from mavlink_bridge.logbook.grade import way_of
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from missions.fence import Fence
from missions.firmware import Firmware
from missions.items import Command, MissionItem, change_speed, waypoint, with_home
from missions.vehicle import Autopilot, Pursuit, Vehicle

LINES = [(0.0, 0.0), (0.0, 30.0), (40.0, 30.0)]


def read(log, tmp_path):
    (vehicle,) = read_logbook(log.write(tmp_path / "made.tlog")).vehicles
    return vehicle


def begun(fence=FIELD, lines=LINES):
    log = Log()
    log.heartbeat()
    log.parameters()
    if fence is not None:
        log.fence(fence)
    log.mission(lines[1:])
    for _ in range(5):
        log.position(*lines[0])
        log.now_s += 0.2
    return log


def test_a_drive_along_the_lines(tmp_path):
    log = begun()
    log.drive(LINES)
    log.heartbeat(Mode.HOLD, armed=True)
    vehicle = read(log, tmp_path)
    (grade,) = vehicle.grades
    assert (grade.first_item, grade.last_item, grade.items) == (1, 2, 2)
    assert (grade.reached, grade.arrived) == (2, True)
    assert grade.driven_m == pytest.approx(70.0, abs=0.1)
    assert grade.took_s == pytest.approx(35.0, abs=1.0)
    assert grade.deviation_m < 0.03
    assert grade.mean_deviation_m <= grade.deviation_m
    # The exclusion's corner (10, 20) to (20, 20) is 10 m south of the second line, and 10 m east of the first.
    assert grade.least_clearance_m == pytest.approx(10.0, abs=0.05)
    assert vehicle.nearest.clearance_m == pytest.approx(10.0, abs=0.05)
    assert vehicle.driven_m == pytest.approx(70.0, abs=0.6)
    assert grade.foreseen.took_s == pytest.approx(35.0, abs=8.0)
    assert 8.0 < grade.foreseen.least_clearance_m < 10.0
    assert 0.0 < grade.foreseen.deviation_m < 5.0


def test_a_drive_off_its_lines(tmp_path):
    log = begun()
    log.drive([(0.0, 0.0), (4.0, 4.0), (4.0, 30.0), (40.0, 30.0)])
    vehicle = read(log, tmp_path)
    (grade, *_) = vehicle.grades
    assert grade.deviation_m == pytest.approx(4.0, abs=0.05)
    assert grade.outside_m > 1.0
    assert grade.is_as_foreseen is False
    assert grade.least_clearance_m == pytest.approx(6.0, abs=0.05)


def test_a_drive_through_an_exclusion(tmp_path):
    lines = [(0.0, 15.0), (40.0, 15.0)]
    log = begun(lines=lines)
    log.drive(lines)
    vehicle = read(log, tmp_path)
    (grade,) = vehicle.grades
    assert grade.least_clearance_m == 0.0
    assert grade.foreseen.least_clearance_m == 0.0
    (intrusion,) = vehicle.intrusions
    assert intrusion.zone == "exclusion polygon 1"
    assert intrusion.deepest_m == pytest.approx(5.0, abs=0.05)
    assert intrusion.ended_s - intrusion.begun_s == pytest.approx(5.0, abs=0.6)


def test_a_leap_across_an_exclusion_between_two_positions_counts(tmp_path):
    log = begun()
    log.heartbeat(0, armed=True)
    for east_m in (8.0, 21.5):  # 13.5 m within a second
        log.position(east_m, 19.0, 5.0)
        log.now_s += 0.5
    log.position(30.0, 19.0)
    vehicle = read(log, tmp_path)
    assert vehicle.nearest.clearance_m == 0.0
    (intrusion,) = vehicle.intrusions
    assert intrusion.deepest_m == 0.0


def test_no_fence_no_clearance(tmp_path):
    log = begun(fence=None)
    log.drive(LINES)
    vehicle = read(log, tmp_path)
    (grade,) = vehicle.grades
    assert grade.least_clearance_m is None
    assert grade.foreseen.least_clearance_m is None
    assert vehicle.nearest is None
    assert any("no fence" in note for note in vehicle.notes)


def test_exclusions_alone_do_not_bound_the_world(tmp_path):
    log = begun(fence=Fence(FIELD.zones[1:]), lines=[(0.0, 0.0), (2000.0, 0.0)])
    log.drive([(0.0, 0.0), (2000.0, 0.0)], speed_mps=20.0)
    vehicle = read(log, tmp_path)
    assert vehicle.intrusions == ()
    assert vehicle.grades[0].least_clearance_m == pytest.approx(10.0, abs=0.05)


def test_a_drive_in_another_mode_or_unarmed_is_none(tmp_path):
    log = begun()
    log.drive(LINES, mode=0)
    assert read(log, tmp_path).grades == ()


def test_a_drive_broken_off_is_compared_as_far_as_it_came(tmp_path):
    log = begun()
    log.drive([(0.0, 0.0), (0.0, 30.0)])
    log.heartbeat(Mode.HOLD, armed=True)
    log.position(0.0, 30.0)
    (grade,) = read(log, tmp_path).grades
    assert (grade.reached, grade.arrived, grade.last_item) == (1, False, 1)
    assert grade.took_s == pytest.approx(15.0, abs=0.7)
    assert grade.foreseen.took_s < 20.0


def test_going_back_to_an_earlier_item_begins_another_drive(tmp_path):
    log = begun()
    log.drive(LINES)
    log.drive([(40.0, 30.0), (0.0, 30.0), (40.0, 30.0)])
    first, second = read(log, tmp_path).grades
    assert second.begun_s > first.begun_s + 30
    assert second.deviation_m < 0.03


def test_the_recorded_drive(logs):
    (vehicle,) = read_logbook(logs / "mission-yard.tlog").vehicles
    (grade,) = vehicle.grades
    assert (grade.first_item, grade.last_item, grade.reached, grade.arrived) == (1, 2, 1, False)
    assert grade.is_as_foreseen
    assert grade.took_s == pytest.approx(grade.foreseen.took_s, rel=0.1)
    assert grade.deviation_m < grade.foreseen.deviation_m
    assert grade.foreseen.least_clearance_m == 0.0


def item(command, **changes):
    fields = {"params": (0.0, 0.0, 0.0, 0.0), **changes}
    return MissionItem(int(command), **fields)


def test_the_way_of_a_mission():
    stop = item(Command.NAV_WAYPOINT, params=(5.0, 0, 0, 0), lat_e7=400000000, lon_e7=-1050000000)
    items = [
        item(Command.DO_CHANGE_SPEED, params=(0.0, 3.0, 0, 0)),
        waypoint(place(0, 10)),
        stop,
        item(Command.NAV_DELAY, params=(2.0, 0, 0, 0)),
        waypoint(place(0, 20)),
    ]
    way = way_of(items, 1, home_first=True)
    assert way.seqs == (2, 3, 5)
    assert way.speeds == (3.0, 3.0, 3.0)
    assert way.stops == {2: 7.0}
    assert way.odd is None
    assert way_of(items, 3, home_first=False).seqs == (4,)
    assert way_of(items, 3, home_first=False).speeds == (3.0,)


PURSUIT = Vehicle(autopilot=Autopilot.PX4, pursuit=Pursuit())


@pytest.mark.parametrize(
    ("firmware", "odd"), [(None, True), (Firmware(1, 17), True), (Firmware(1, 18), False)]
)
def test_what_px4_makes_of_waits(firmware, odd):
    vehicle = replace(PURSUIT, firmware=firmware)
    held = item(Command.NAV_WAYPOINT, params=(5.0, 0, 0, 0), lat_e7=400000000, lon_e7=-1050000000)
    assert (
        way_of([held, waypoint(place(0, 20))], 0, home_first=False, vehicle=vehicle).stops == {}
    )  # it drives through
    way = way_of(
        [held, item(Command.NAV_DELAY, params=(2.0, 0, 0, 0)), waypoint(place(0, 20))],
        0,
        home_first=False,
        vehicle=vehicle,
    )
    assert (way.odd == "the wait at item 0, which PX4 drives as a circle") is odd
    assert odd or way.stops == {1: 2.0}


@pytest.mark.parametrize(
    "command", [Command.DO_JUMP, Command.NAV_LOITER_TURNS, Command.NAV_RETURN_TO_LAUNCH, 5]
)
def test_what_the_drive_model_does_not_know_is_said(command, tmp_path):
    items = [waypoint(place(0, 30)), item(command), waypoint(place(40, 30))]
    assert str(int(command)) in way_of(items, 1, home_first=True).odd
    log = begun()
    log.upload(m.MissionType.MISSION, with_home(items, ORIGIN))
    log.drive(LINES[:2])
    (grade,) = read(log, tmp_path).grades
    assert grade.foreseen is None
    assert grade.is_as_foreseen is None
    assert "no prediction" in grade.notes[0]


def test_a_drive_that_began_moving_is_noted(tmp_path):
    log = begun()
    log.heartbeat(0, armed=True)
    log.row(ROVER, m.MissionCurrent(1))
    for step in range(50):
        if step == 10:
            log.heartbeat(10, armed=True)
        log.position(0.0, -3.0 + step * 0.5, 2.0)
        log.now_s += 0.24
    (grade,) = read(log, tmp_path).grades
    assert "from rest" in grade.notes[0]
    assert math.isclose(grade.driven_m, 19.5, abs_tol=0.2)
    assert grade.took_s is None


def test_a_drive_begins_before_the_heartbeat_that_tells_of_it(tmp_path):
    log = begun()
    log.heartbeat(0, armed=True)
    log.row(ROVER, m.MissionCurrent(1))
    log.position(0.0, 0.0)
    log.now_s += 0.24
    for step in range(60):
        if step == 3:
            log.heartbeat(10, armed=True)
        log.position(0.0, 0.5 * (step + 1), 2.0)
        log.now_s += 0.24
    log.row(ROVER, m.MissionItemReached(1))
    (grade,) = read(log, tmp_path).grades
    assert grade.notes == ()
    assert grade.took_s == pytest.approx(15.0, abs=0.3)
    assert grade.driven_m == pytest.approx(30.0, abs=0.05)
    assert grade.least_clearance_m == pytest.approx(10.0, abs=0.05)


def test_a_mission_without_places_is_no_drive(tmp_path):
    log = begun()
    log.upload(m.MissionType.MISSION, with_home([item(Command.NAV_DELAY)], ORIGIN))
    log.drive(LINES)
    assert read(log, tmp_path).grades == ()


def test_hardly_moving_is_no_drive(tmp_path):
    log = begun()
    log.heartbeat(10, armed=True)
    for _ in range(5):
        log.position(0.0, 0.1)
    assert read(log, tmp_path).grades == ()


CORNERS = [(0.0, 0.0), (0.0, 30.0), (30.0, 30.0), (30.0, 0.0), (0.0, 0.0)]


def speeds_of(grade):
    return [leg.speed_mps for leg in grade.legs]


def test_a_speed_that_a_station_asked_for_is_that_of_its_legs(tmp_path):
    """DO_CHANGE_SPEED as a command, on the third leg: what was predicted for slower legs, and a corner that may have been driven at either speed is not bounded."""
    plain, slowed = begun(fence=None, lines=CORNERS), begun(fence=None, lines=CORNERS)
    for log in (plain, slowed):
        log.drive(CORNERS[:3])
        log.row(ROVER, m.MissionCurrent(3), 0.0)
        log.position(30.0, 25.0, 2.0)
        if log is slowed:
            log.change_speed(4.0, result=4)  # failed
            log.change_speed(-1.0)  # no change
            log.change_speed(1.0)
        log.drive([(30.0, 24.0), *CORNERS[3:]], speed_mps=1.0 if log is slowed else 2.0, first_item=3)
    (before,) = read(plain, tmp_path).grades
    (tmp_path / "slowed").mkdir()
    (after,) = read(slowed, tmp_path / "slowed").grades
    assert speeds_of(before) == [2.0, 2.0, 2.0, 2.0]
    assert speeds_of(after) == [2.0, 2.0, 1.0, 1.0]
    assert [leg.is_bounded for leg in before.legs] == [True, True, True, None]
    assert [leg.is_bounded for leg in after.legs] == [True, False, False, None]
    assert [leg.driven_mps for leg in after.legs] == [2.0, 2.0, 1.0, 1.0]
    assert [leg.foreseen_driven_mps for leg in after.legs] == pytest.approx([2.0, 2.0, 1.0, 1.0], abs=0.05)
    assert after.legs[0] == before.legs[0]
    assert after.legs[2].foreseen_inside_cut_m < before.legs[2].foreseen_inside_cut_m
    assert after.foreseen.took_s > before.foreseen.took_s + 20.0
    assert after.notes == before.notes


def test_a_speed_asked_for_before_the_first_position_holds_from_the_first_leg_on(tmp_path):
    log = begun(fence=None, lines=CORNERS)
    log.drive(CORNERS, speed_mps=1.0, asked_mps=1.0)
    (grade,) = read(log, tmp_path).grades
    assert speeds_of(grade) == [1.0] * 4
    assert [leg.is_bounded for leg in grade.legs] == [True, True, True, None]


def test_an_item_that_asks_for_a_speed_ends_that_of_a_station(tmp_path):
    items = [waypoint(place(*point)) for point in CORNERS[1:]]
    items.insert(2, change_speed(3.0))
    log = begun(fence=None)
    log.upload(m.MissionType.MISSION, with_home(items, ORIGIN))
    log.drive(CORNERS[:3], speed_mps=1.0, asked_mps=1.0)
    log.drive(CORNERS[2:], speed_mps=3.0, first_item=4)
    (grade,) = read(log, tmp_path).grades
    assert speeds_of(grade) == [1.0, 1.0, 3.0, 3.0]


def test_a_speed_asked_for_in_another_mode_changes_no_drive(tmp_path):
    log = begun(fence=None, lines=CORNERS)
    log.drive(CORNERS[:2], mode=Mode.GUIDED, asked_mps=1.0)
    log.drive(CORNERS)
    (grade,) = read(log, tmp_path).grades
    assert speeds_of(grade) == [2.0] * 4
