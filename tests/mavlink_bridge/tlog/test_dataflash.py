"""DataFlash logs, made by a writer of our own and read a second time by pymavlink's reader; no log of a real rover was at hand."""

from __future__ import annotations

import gzip
import itertools
import math
import random
import struct
import tracemalloc
from typing import TYPE_CHECKING

import pytest
from pymavlink.DFReader import DFReader_binary
from tlog.dataflash_writer import FORMATS, declarations, message

from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook import read_logbook
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.tlog import TlogReader
from mavlink_bridge.tlog.dataflash import as_telemetry, messages_of

if TYPE_CHECKING:
    from pathlib import Path

HOME = (473977420, 85455940)  # degE7
M_E7 = 1e7 / 111_320  # degE7 of a metre northwards
LON_M_E7 = M_E7 / math.cos(math.radians(47.4))
SQUARE = [(0, 0), (0, 30), (30, 30), (30, 0)]
FENCE = [(-20, -20), (-20, 50), (50, 50), (50, -20)]
WEEK, MS = 2430, 100_000_000  # 2 August 2026


def place(north_m: float, east_m: float) -> tuple[int, int]:
    return HOME[0] + round(north_m * M_E7), HOME[1] + round(east_m * LON_M_E7)


def drive(*, name: str = "ArduRover V4.6.3 (3fc7011a)", fix: int = 6) -> bytes:
    """A rover that drives a square in AUTO at 2 m/s, ten positions a second."""
    parts = [declarations()]

    def put(kind: str, time_s: float, *values: object) -> None:
        parts.append(message(kind, round(time_s * 1e6), *values))

    put("MSG", 1, name)
    for number, (key, value) in enumerate(
        {"SYSID_THISMAV": 7.0, "WP_RADIUS": 2.0, "WP_SPEED": 2.0, "FENCE_TYPE": 4.0}.items()
    ):
        put("PARM", 1 + number / 100, key, value, 0.0)
    put("GPS", 2, 0, fix, MS, WEEK, 20, 0.7, *HOME, 400.0, 0.0, 0.0, 0.0)
    put("ORGN", 2, 1, *HOME, 400.0)
    items = [(16, *place(north_m, east_m)) for north_m, east_m in [(0, 0), *SQUARE[1:], (0, 0)]]
    for seq, (command, lat, lon) in enumerate(items):
        put("CMD", 2.1, len(items), seq, command, 0.0, 0.0, 0.0, 0.0, lat, lon, 0.0, 0)
    for seq, (north_m, east_m) in enumerate(FENCE):
        put("FNCE", 2.2, len(FENCE), seq, 98, *place(north_m, east_m), len(FENCE), 0.0)
    put("RALY", 2.3, 1, 0, *place(5, 5), 0, 0)
    put("MODE", 3, 4, 4, 1)
    put("ARM", 4, 1, 0, 0, 0)
    put("MODE", 5, 10, 10, 1)
    corners = [*SQUARE, (0, 0)]
    time_s, number = 5.0, 1
    for (north_m, east_m), (to_north_m, to_east_m) in itertools.pairwise(corners):
        put("MISE", time_s, len(items), number, 16, 0.0, 0.0, 0.0, 0.0, *items[number][1:], 0.0, 0)
        course_deg = math.degrees(math.atan2(to_east_m - east_m, to_north_m - north_m)) % 360
        for step in range(150):
            share = step / 150
            here = place(north_m + (to_north_m - north_m) * share, east_m + (to_east_m - east_m) * share)
            put("ATT", time_s, 0, 0, 0, 0, course_deg, course_deg, 0.0)
            if step % 2 == 0:
                put(
                    "GPS",
                    time_s,
                    0,
                    fix,
                    MS + round(time_s * 1000) - 2000,
                    WEEK,
                    20,
                    0.7,
                    *here,
                    400.0,
                    2.0,
                    course_deg,
                    0.0,
                )
            put("IMU", time_s, 0, 0.1, 0.2)
            put("POS", time_s, *here, 400.0, 0.0, 0.0)
            time_s += 0.1
        put("MSG", time_s, f"Reached waypoint #{number}")
        number += 1
    put("ARM", time_s, 0, 0, 0, 0)
    put("POS", time_s + 1, *HOME, 400.0, 0.0, 0.0)
    return b"".join(parts)


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "00000042.BIN"
    path.write_bytes(drive())
    return path


def test_the_messages_are_those_that_pymavlink_reads(log):
    wanted = frozenset(set(FORMATS) - {"RALY"})
    theirs = DFReader_binary(str(log))
    for name, fields in messages_of([log.read_bytes()], wanted):
        other = theirs.recv_match(type=list(wanted))
        assert other.get_type() == name
        told = other.to_dict()
        for label, value in fields.items():
            expected = told[label]
            if label in ("Lat", "Lng"):
                expected = round(expected * 1e7)
            assert value == (pytest.approx(expected, rel=1e-6) if isinstance(value, float) else expected), (
                name,
                label,
            )
    assert theirs.recv_match(type=list(wanted)) is None
    theirs.data_map.close()
    theirs.filehandle.close()


def test_what_a_drive_was(log):
    book = read_logbook(log)
    (vehicle,) = book.vehicles
    assert (vehicle.system, vehicle.mav_type) == (7, 10)
    assert str(vehicle.situation.firmware) == "4.6.3"
    assert book.has_timestamps
    assert book.begins_s == pytest.approx(315_964_800 + WEEK * 604_800 + MS / 1000 - 18 - 1, abs=0.01)
    assert vehicle.situation.mission.value.item_count() == 5
    assert len(vehicle.situation.rally.value) == 1
    assert vehicle.driven_m == pytest.approx(120, abs=1)
    assert vehicle.nearest.clearance_m == pytest.approx(20, abs=0.2)
    assert [span.name for span in vehicle.modes][-2:] == ["AUTO", "AUTO"]
    (grade,) = vehicle.grades
    assert (grade.reached, grade.arrived) == (4, True)
    assert grade.deviation_m < 0.1
    assert [leg.turn_deg for leg in grade.legs] == [pytest.approx(-90, abs=0.1)] * 3 + [None]
    assert all(leg.inside_cut_m < 0.1 and leg.is_whole for leg in grade.legs[:3])


def test_packed_it_is_the_same(log, tmp_path):
    packed = tmp_path / "flight.bin.gz"
    packed.write_bytes(gzip.compress(log.read_bytes()))
    assert [entry.frame for entry in TlogReader(packed)] == [entry.frame for entry in TlogReader(log)]


def test_before_a_fix_there_is_no_place(tmp_path):
    path = tmp_path / "nofix.bin"
    path.write_bytes(
        declarations()
        + message("MSG", 1, "ArduRover V4.5.7")
        + b"".join(
            message("GPS", second * 1_000_000, 0, 1, 0, 0, 0, 99.0, 0, 0, 0.0, 0.0, 0.0, 0.0)
            for second in range(5)
        )
    )
    (vehicle,) = read_logbook(path).vehicles
    assert (vehicle.positions, vehicle.positions_without_fix) == (5, 5)


def test_a_log_that_does_not_say_whose_it_is_is_refused(tmp_path):
    path = tmp_path / "unknown.bin"
    path.write_bytes(declarations() + message("MODE", 1, 4, 4, 1))
    with pytest.raises(LogError, match="no MSG or VER names ArduRover"):
        TlogReader(path)


def test_damage_costs_what_it_hits(log):
    data = drive()
    whole = list(messages_of([data], frozenset({"POS"})))
    rng = random.Random(3)
    for _ in range(60):
        at = rng.randrange(len(declarations()), len(data) - 200)
        cut = data[:at] + rng.randbytes(rng.randrange(80)) + data[at + rng.randrange(1, 150) :]
        found = list(messages_of([cut], frozenset({"POS"})))
        assert len(whole) - 8 <= len(found) <= len(whole) + 3
    for size in range(0, 2000, 37):
        list(messages_of([data[:size]], frozenset({"POS"})))


def test_the_size_of_pieces_changes_nothing(log):
    data = drive()[: len(declarations()) + 20_000] + b"\xa3" + drive()[-3000:]
    wanted = frozenset({"GPS", "POS", "CMD", "MSG"})
    whole = list(messages_of([data], wanted))
    for size in (1, 2, 3, 88, 89, 90, 1009):
        pieces = (data[begin : begin + size] for begin in range(0, len(data), size))
        assert list(messages_of(pieces, wanted)) == whole


def test_whatever_is_damaged_a_log_is_read_or_refused(log, tmp_path):
    """Bytes are changed everywhere, also where the log declares how its messages are laid out: no checksum would tell."""
    data, path = drive(), tmp_path / "damaged.bin"
    rng = random.Random(11)
    declared = len(declarations())
    for _ in range(100):
        damaged = bytearray(data[: declared + 10_000])
        for _ in range(rng.choice((1, 20, 300))):
            damaged[rng.randrange(declared if rng.random() < 0.5 else len(damaged))] = rng.choice(
                (rng.randrange(256), 0xFF, 0x7F, *b"fdQHBLZ")
            )
        path.write_bytes(damaged)
        try:
            frames = [entry.frame for entry in TlogReader(path)]
        except LogError:
            continue
        assert frames


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, 3e38], ids=["nan", "inf", "minus inf", "huge"]
)
def test_numbers_that_are_none(tmp_path, value):
    path = tmp_path / "odd.bin"
    path.write_bytes(
        declarations()
        + message("MSG", 1_000_000, "ArduRover V4.6.3")
        + message("PARM", 1_000_000, "WP_SPEED", value, 0.0)
        + message("GPS", 2_000_000, 0, 6, MS, WEEK, 20, 0.7, *HOME, value, value, value, value)
        + message("POS", 2_000_000, *HOME, value, value, value)
    )
    placed = [
        entry.frame.message
        for entry in TlogReader(path)
        if entry.frame and isinstance(entry.frame.message, m.GlobalPositionInt)
    ]
    assert [(one.lat, one.lon) for one in placed] == [HOME, HOME]


def test_doubles_that_no_telemetry_message_holds_are_passed_over(tmp_path):
    """A log that declares a parameter's value as a double may hold one that PARAM_VALUE cannot; no firmware writes doubles there."""
    kind, labels = 200, b"TimeUS,Name,Value"
    layout = struct.pack("<BB4s16s64s", kind, 3 + 8 + 16 + 8, b"PARM", b"QNd", labels)
    path = tmp_path / "double.bin"
    path.write_bytes(
        declarations()
        + message("MSG", 1_000_000, "ArduRover V4.6.3")
        + b"\xa3\x95\x80"
        + layout
        + b"\xa3\x95"
        + bytes([kind])
        + struct.pack("<Q16sd", 1_000_000, b"WP_SPEED", 1e300)
        + message("POS", 2_000_000, *HOME, 0.0, 0.0, 0.0)
    )
    told = [entry.frame.message for entry in TlogReader(path) if entry.frame]
    assert not any(isinstance(one, m.ParamValue) for one in told)
    assert any(isinstance(one, m.GlobalPositionInt) for one in told)


def test_a_damaged_time_ends_no_heartbeats(tmp_path):
    path = tmp_path / "time.bin"
    times_us = [1_000_000, 1 << 63, 9_000_000_000, 2_000_000, 3_500_000]
    path.write_bytes(
        declarations()
        + message("MSG", 1_000_000, "ArduRover V4.6.3")
        + b"".join(message("POS", time_us, *HOME, 0.0, 0.0, 0.0) for time_us in times_us)
    )
    found = [entry.frame.message for entry in TlogReader(path) if entry.frame]
    assert sum(isinstance(one, m.GlobalPositionInt) for one in found) == 4  # not that of 292,000 years
    assert sum(isinstance(one, m.Heartbeat) for one in found) == 4


def test_missions_whose_places_are_rounded_are_passed_over(tmp_path):
    """ArduPilot 3.6 wrote them as floats; a mission that is up to 0.8 m off must pass for none."""
    letters, labels = b"QHHHfffffffB", b"TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame"
    layout = struct.Struct("<QHHHfffffffB")
    path = tmp_path / "v3.6.bin"
    path.write_bytes(
        declarations()
        + b"\xa3\x95\x80"
        + struct.pack("<BB4s16s64s", 40, 3 + layout.size, b"CMD", letters, labels)
        + message("MSG", 1_000_000, "ArduRover V3.6.4")
        + b"\xa3\x95\x28"
        + layout.pack(2_000_000, 1, 0, 16, 0, 0, 0, 0, 47.3977420, 8.5455940, 0, 0)
        + message("POS", 2_000_000, *HOME, 0.0, 0.0, 0.0)
    )
    (vehicle,) = read_logbook(path).vehicles
    assert vehicle.situation.mission is None
    assert vehicle.positions == 1


def test_a_bomb_is_refused_in_little_memory(monkeypatch, tmp_path):
    monkeypatch.setattr("mavlink_bridge.tlog.dataflash._MOST_BYTES", 100_000)
    begin = declarations() + message("MSG", 1_000_000, "ArduRover V4.6.3")
    position = message("POS", 2_000_000, *HOME, 0.0, 0.0, 0.0)
    with pytest.raises(LogError, match="more than 0 MB of positions"):
        as_telemetry(
            lambda: itertools.chain([begin], itertools.repeat(position, 5000)), tmp_path / "endless.bin"
        )
    zeros = tmp_path / "zeros.bin"
    with gzip.open(zeros, "wb", 9) as file:
        file.write(b"\xa3\x95")
        for _ in range(40):
            file.write(bytes(1 << 20))
    tracemalloc.start()
    with pytest.raises(LogError, match="no MSG or VER names ArduRover"):
        TlogReader(zeros)
    _, most_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most_bytes < 20e6


@pytest.mark.parametrize(
    ("kind", "zones"), [(96, "exclusion"), (93, "exclusion"), (94, "inclusion"), (92, "inclusion")]
)
def test_circles_of_a_fence(tmp_path, kind, zones):
    path = tmp_path / "circle.bin"
    path.write_bytes(
        declarations()
        + message("MSG", 1_000_000, "ArduRover V4.6.3")
        + message("FNCE", 2_000_000, 1, 0, kind, *HOME, 0, 12.5)
    )
    (vehicle,) = read_logbook(path).vehicles
    ((_, fence),) = vehicle.fences
    (zone,) = fence.zones
    assert (str(zone.kind), zone.radius_m) == (zones, 12.5)


def test_a_list_of_which_an_item_is_missing_is_no_list(tmp_path):
    path = tmp_path / "gap.bin"
    rows = [message("FNCE", 2_000_000, 4, seq, 98, *place(*FENCE[seq]), 4, 0.0) for seq in (0, 1, 3)]
    path.write_bytes(declarations() + message("MSG", 1_000_000, "ArduRover V4.6.3") + b"".join(rows))
    assert read_logbook(path).vehicles[0].fences == ()


def test_older_firmware_tells_armed_by_events_and_boats_by_their_frame(tmp_path):
    path = tmp_path / "boat.bin"
    path.write_bytes(
        declarations()
        + message("MSG", 1_000_000, "ArduRover V4.4.0")
        + message("PARM", 1_000_000, "FRAME_CLASS", 2.0, 0.0)
        + message("EV", 2_000_000, 10)
        + message("EV", 9_000_000, 11)
    )
    (vehicle,) = read_logbook(path).vehicles
    assert vehicle.mav_type == 11
    assert [span.armed for span in vehicle.modes] == [False, True, False]
