"""Logs unlike our recordings: other vehicles, wrong clocks, late fences, damage, batches."""

from __future__ import annotations

import json

import pytest
from logbook.making import BEGIN_S, FIELD, FRAME, PARAMETERS, ROVER, STATION, Log, place

from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook import read_logbook, recorder, track
from mavlink_bridge.logbook.document import as_document
from mavlink_bridge.logbook.track import Odometer, TrackFix
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.modes import drives_mission, mode_name
from missions.fence import Fence, fence_to_items

DAY_S = 86_400.0


def driven(log, points=((0.0, 0.0), (0.0, 40.0)), mode=0):
    log.heartbeat()
    log.parameters()
    log.drive(list(points), mode=mode)
    return log


def book_of(log, tmp_path, **options):
    return read_logbook(log.write(tmp_path / "made.tlog"), **options)


def test_a_fence_that_is_read_back_later_held_before(tmp_path):
    log = driven(Log())
    log.read_back(MissionType.FENCE, fence_to_items(FIELD))
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert vehicle.nearest.clearance_m == pytest.approx(10.0, abs=0.05)
    assert [time_s for time_s, _ in vehicle.fences] == [0.0]


def test_a_fence_that_is_uploaded_later_did_not(tmp_path):
    log = driven(Log())
    log.fence()
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert vehicle.nearest is None
    assert len(vehicle.fences) == 1


def test_a_parameter_that_is_told_later_held_before(tmp_path):
    log = Log()
    log.heartbeat()
    log.fence(Fence((FIELD.zones[0], FIELD.zones[0])))
    log.drive([(0.0, 0.0), (0.0, 20.0)], mode=0)
    log.parameters({**PARAMETERS, "FENCE_OPTIONS": 2.0})
    log.parameters({"WP_SPEED": 3.0})
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert vehicle.parameters.values["FENCE_OPTIONS"] == 2.0
    assert [(change.name, change.before, change.after) for change in vehicle.parameters.changes] == [
        ("WP_SPEED", 2.0, 3.0)
    ]


def test_a_home_circle_without_home_is_left_out_and_said(tmp_path):
    log = Log()
    log.heartbeat()
    log.parameters({"FENCE_ENABLE": 1.0, "FENCE_TYPE": 6.0, "FENCE_RADIUS": 20.0})
    log.fence()
    log.drive([(0.0, 0.0), (0.0, 30.0)], mode=0)
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert vehicle.nearest.clearance_m == pytest.approx(10.0, abs=0.05)
    assert any("home circle" in note for note in vehicle.notes)
    log.row(ROVER, m.HomePosition(*(round(value * 1e7) for value in place(0, 0))))
    (vehicle,) = read_logbook(log.write(tmp_path / "home.tlog")).vehicles
    assert vehicle.nearest.clearance_m == 0.0
    assert "home circle" in vehicle.intrusions[0].zone
    assert not any("left out" in note for note in vehicle.notes)


def test_a_vehicle_value_that_is_none_is_said_not_raised(tmp_path):
    log = Log()
    log.heartbeat()
    log.parameters({"PSC_POS_P": -5.0})
    log.fence()
    log.drive([(0.0, 0.0), (0.0, 30.0)], mode=0)
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert vehicle.nearest is None
    assert any("PSC_POS_P" in note for note in vehicle.notes)


def test_batches_change_nothing(tmp_path, monkeypatch):
    log = Log()
    log.fence()
    log.mission([(0.0, 40.0), (30.0, 40.0)])
    driven(log, ((0.0, 0.0), (0.0, 40.0), (30.0, 40.0)), mode=10)
    whole = as_document(book_of(log, tmp_path))
    monkeypatch.setattr(recorder, "_BATCH", 3)
    assert as_document(read_logbook(tmp_path / "made.tlog")) == whole
    assert json.loads(json.dumps(whole, allow_nan=False)) == whole


def test_the_clock_may_jump_and_run_backwards(tmp_path):
    straight, crooked = driven(Log()), driven(Log())
    middle = len(crooked.rows) // 2
    for index, (time_s, sender, message) in enumerate(crooked.rows):
        shift_s = -3 * DAY_S if index < middle // 2 else (-900.0 if index > middle else 0.0)
        crooked.rows[index] = (time_s + shift_s, sender, message)
    one = book_of(straight, tmp_path)
    other = read_logbook(crooked.write(tmp_path / "crooked.tlog"))
    assert (one.clock_jumps, other.clock_jumps) == (0, 2)
    assert other.duration_s == pytest.approx(one.duration_s, abs=1.0)
    assert other.vehicles[0].driven_m == pytest.approx(one.vehicles[0].driven_m, abs=0.01)
    assert other.begins_s == pytest.approx(BEGIN_S - 3 * DAY_S, abs=0.1)


def test_several_vehicles(tmp_path):
    log = driven(Log())
    log.row((7, 1), m.Heartbeat(2, 12, 1, 4 << 16 | 3 << 24))
    log.row((7, 33), m.Heartbeat(2, 12, 1, 0))
    log.row((7, 1), m.GlobalPositionInt(1, 900000000, 0))
    book = book_of(log, tmp_path)
    assert [(vehicle.system, vehicle.component) for vehicle in book.vehicles] == [(1, 1), (7, 1)]
    assert book.vehicles[1].modes[0].name == "AUTO.LOITER"
    assert book.vehicles[1].driven_m == 0.0
    assert [vehicle.system for vehicle in book_of(log, tmp_path, system=7).vehicles] == [7]
    with pytest.raises(LogError, match="system 9 was not heard, only system 1, system 7"):
        book_of(log, tmp_path, system=9)


def test_a_log_without_a_vehicle(tmp_path):
    log = Log()
    log.row(STATION, m.Heartbeat(6, 8))
    book = book_of(log, tmp_path)
    assert book.vehicles == ()
    assert book.traffic[0].count == 1
    with pytest.raises(LogError, match="no vehicle"):
        book_of(log, tmp_path, system=1)


def test_breaches_that_the_autopilot_reports(tmp_path):
    log = driven(Log())
    for count in (0, 0, 1, 1, 2):
        log.row(ROVER, m.FenceStatus(int(count > 0), count, 3, 0))
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert [(breach.count, breach.breach_type) for breach in vehicle.reported_breaches] == [(1, 3), (2, 3)]


def test_a_target_said_again_and_again_is_one(tmp_path):
    log = driven(Log())
    for east_m in (5.0, 5.0, 5.0, 9.0):
        lat_e7, lon_e7 = (round(value * 1e7) for value in place(east_m, 0.0))
        log.row(STATION, m.SetPositionTargetGlobalInt(0, *ROVER, 6, 0, lat_e7, lon_e7, 0.0), 1.0)
    log.now_s += 10
    log.row(STATION, m.SetPositionTargetGlobalInt(0, *ROVER, 6, 0, lat_e7, lon_e7, 0.0))
    (vehicle,) = book_of(log, tmp_path).vehicles
    assert [target.said for target in vehicle.targets] == [3, 1, 1]
    assert vehicle.targets_seen == 3


def test_a_damaged_log_still_tells(tmp_path, logs):
    data = bytearray((logs / "mission-yard.tlog").read_bytes())
    data[50_000:50_400] = bytes(400)
    path = tmp_path / "damaged.tlog"
    path.write_bytes(data)
    book = read_logbook(path)
    assert not book.damage.is_clean
    assert book.vehicles[0].grades


def test_a_raw_log_has_the_vehicles_time(tmp_path):
    log = driven(Log())
    log.write(tmp_path / "made.tlog")
    data = (tmp_path / "made.tlog").read_bytes()
    frames, at = [], 0
    while at < len(data):
        end = at + 8 + 12 + data[at + 9]
        frames.append(data[at + 8 : end])
        at = end
    (tmp_path / "made.raw").write_bytes(b"".join(frames))
    book = read_logbook(tmp_path / "made.raw")
    assert not book.has_timestamps
    assert book.vehicles[0].driven_m == pytest.approx(40.0, abs=0.6)


def test_the_drawn_track_stays_small(monkeypatch):
    monkeypatch.setattr(track, "_MOST_POINTS", 100)
    odometer = Odometer()
    total_m = 0.0
    for begin in range(0, 5000, 50):
        points = [(float(east_m), 0.0) for east_m in range(begin, begin + 50)]
        fixes = [TrackFix(0.0, 0.0, place(*point), 1.0, 0, None) for point in points]
        array = FRAME.to_local_array([fix.position for fix in fixes])
        total_m += odometer.drive("AUTO", fixes, array)
    ((_, _, positions),) = odometer.parts
    assert total_m == pytest.approx(4999.0, abs=1.0)
    assert 20 < len(positions) <= 151
    assert FRAME.to_local(positions[0]).east_m == pytest.approx(0.0, abs=0.1)
    assert FRAME.to_local(positions[-1]).east_m > 4800


@pytest.mark.parametrize(
    ("mode", "mav_type", "ardupilot", "name", "is_auto"),
    [
        (10, 10, True, "AUTO", True),
        (10, 11, None, "AUTO", True),
        (3, 2, True, "mode 3", False),
        (10, 2, True, "mode 10", False),
        (99, 10, True, "mode 99", False),
        (4 << 16 | 4 << 24, 10, False, "AUTO.MISSION", True),
        (4 << 16 | 77 << 24, 10, False, "AUTO.77", False),
        (1 << 16, 10, False, "MANUAL", False),
        (99 << 16, 10, False, f"mode {99 << 16}", False),
    ],
)
def test_modes_by_name(mode, mav_type, ardupilot, name, is_auto):
    assert mode_name(mode, mav_type, ardupilot=ardupilot) == name
    assert drives_mission(mode, mav_type, ardupilot=ardupilot) is is_auto
    assert not drives_mission(None, mav_type, ardupilot=ardupilot)
