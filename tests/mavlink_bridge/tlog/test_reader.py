"""What the reader promises of whole logs: links, times, formats, choice of types, errors."""

from __future__ import annotations

import gzip
import random
import struct

import pytest
from tlog.frames import LOGS, START_US, frame_v1, frame_v2, heartbeat, record, records

from mavlink_bridge.errors import LogError
from mavlink_bridge.mavlink.messages import GlobalPositionInt, Heartbeat, Message, ParamValue, Statustext
from mavlink_bridge.tlog import Damage, TlogReader, survey

MAZE = next(log for log in LOGS if log.stem == "guided-maze")


@pytest.fixture
def log(tmp_path):
    def write(data, name="some.tlog"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write


def entries_of(path):
    return [(entry.time_s, entry.link, repr(entry.frame)) for entry in TlogReader(path)]


def position(boot_ms, *, v1=False, component=1):
    payload = struct.pack("<IiiiihhhH", boot_ms, 400713740, -1052299300, 1, 2, 3, 4, 5, 6)
    return (frame_v1 if v1 else frame_v2)(33, payload, component=component)


class TestTimesAndLinks:
    def test_time_and_link_are_the_timestamp_s(self, log):
        (entry,) = TlogReader(log(record(heartbeat(), START_US + 3)))
        assert entry.time_s == (START_US + 3) / 1e6
        assert entry.link == 3

    def test_timestamps_may_hold_magic_bytes(self, log):
        times = [0x0006_FDFD_FEFE_FDFE, 0x0006_FDFD_FEFE_FEFD, 0x0006_FDFD_FEFF_FDFD, 0x0006_FDFE_00FD_FE09]
        reader = TlogReader(log(b"".join(record(heartbeat(n), time_us) for n, time_us in enumerate(times))))
        assert [round(entry.time_s * 1e6) for entry in reader] == times
        assert reader.damage == Damage(frames=4)

    def test_a_jump_by_years_is_followed_and_is_no_damage(self, log):
        day_us = 86_400 * 10**6
        times = [
            5,
            6,
            START_US,
            START_US + 1,
            START_US - 900 * day_us,
            START_US - 900 * day_us + 9,
            2**62,
            2**62 + 256,
        ]
        reader = TlogReader(log(b"".join(record(heartbeat(n), time_us) for n, time_us in enumerate(times))))
        assert [entry.time_s for entry in reader] == [time_us / 1e6 for time_us in times]
        assert reader.damage == Damage(frames=8)

    def test_a_lone_timestamp_far_off_is_mended(self, log):
        parts = [record(heartbeat(n), START_US + n) for n in range(9)]
        parts[4] = record(heartbeat(4), START_US ^ 1 << 45)
        reader = TlogReader(log(b"".join(parts)))
        assert [round(e.time_s * 1e6) - START_US for e in reader] == [0, 1, 2, 3, 3, 5, 6, 7, 8]
        assert reader.damage == Damage(frames=9, wrong_timestamps=1)


class TestFormats:
    @pytest.mark.parametrize("suffix", [".tlog.gz", ".tlog", ""])
    def test_gzip_is_told_by_content(self, log, suffix):
        assert entries_of(log(gzip.compress(MAZE.read_bytes()), "packed" + suffix)) == entries_of(MAZE)

    def test_gzip_of_several_members(self, log):
        parts = records(MAZE.read_bytes())
        packed = gzip.compress(b"".join(parts[:4000])) + gzip.compress(b"".join(parts[4000:]))
        assert entries_of(log(packed, "packed.gz")) == entries_of(MAZE)

    def test_gzip_cut_off_gives_what_is_there(self, log):
        packed = gzip.compress(MAZE.read_bytes())
        reader = TlogReader(log(packed[: len(packed) // 2], "cut.tlog.gz"))
        entries = [(entry.time_s, entry.link, repr(entry.frame)) for entry in reader]
        whole = entries_of(MAZE)
        assert 0.3 * len(whole) < len(entries) < 0.8 * len(whole)
        assert entries == whole[: len(entries)]
        assert reader.damage.broken_gzip == 1

    def test_gzip_damaged_inside_gives_what_stands_before(self, log):
        packed = bytearray(gzip.compress(MAZE.read_bytes()))
        packed[len(packed) // 2 : len(packed) // 2 + 400] = bytes(400)
        reader = TlogReader(log(bytes(packed), "bad.tlog.gz"))
        assert len(list(reader)) > 1000
        assert reader.damage.broken_gzip == 1
        assert not reader.damage.is_clean

    @pytest.mark.parametrize("name", ["some.raw", "some.tlog"])
    def test_raw_logs_are_told_by_content(self, log, name):
        path = log(b"".join(part[8:] for part in records(MAZE.read_bytes())), name)
        reader = TlogReader(path)
        assert not reader.has_timestamps
        entries = list(reader)
        assert [repr(entry.frame) for entry in entries] == [frame for _, _, frame in entries_of(MAZE)]
        assert {entry.link for entry in entries} == {0}
        assert reader.damage == Damage(frames=8674)

    def test_raw_time_is_the_autopilot_s_since_boot(self, log):
        frames = [
            heartbeat(),
            position(1500),
            position(99, component=190),
            heartbeat(),
            position(2750, v1=True),
            heartbeat(),
        ]
        times = [entry.time_s for entry in TlogReader(log(b"".join(frames), "some.raw"))]
        assert times == [0.0, 1.5, 1.5, 1.5, 2.75, 2.75]

    def test_raw_noise_between_frames_is_skipped(self, log):
        reader = TlogReader(log(heartbeat(1) + b"\xfdnoise\xfe" + heartbeat(2) + heartbeat(3), "some.raw"))
        assert [entry.frame.message.custom_mode for entry in reader] == [1, 2, 3]
        assert reader.damage == Damage(frames=3, gaps=1, skipped_bytes=7)

    def test_raw_frames_of_unknown_ids_are_passed_over(self, log):
        foreign = frame_v2(70_000, b"abc", seed=1)
        reader = TlogReader(log(heartbeat(1) + foreign + heartbeat(2), "some.raw"))
        assert [entry.frame.message.custom_mode for entry in reader] == [1, 2]
        assert reader.damage == Damage(frames=3, unknown_ids=1)

    @pytest.mark.parametrize(
        ("name", "has_timestamps"), [("one.tlog", True), ("one.raw", False), ("one.raw.gz", False)]
    )
    def test_a_single_frame_after_noise_goes_by_the_name(self, log, name, has_timestamps):
        assert TlogReader(log(b"some noise" + heartbeat(), name)).has_timestamps is has_timestamps

    def test_mixed_versions_and_signed_frames(self, log):
        frames = [
            position(1),
            position(2, v1=True),
            frame_v2(0, b"\7", signature=bytes(13)),
            position(4, v1=True),
            heartbeat(),
        ]
        reader = TlogReader(log(b"".join(record(frame, START_US + n) for n, frame in enumerate(frames))))
        messages = [entry.frame.message for entry in reader]
        assert [type(message) for message in messages] == [
            GlobalPositionInt, GlobalPositionInt, Heartbeat, GlobalPositionInt, Heartbeat,
        ]  # fmt: skip
        assert messages[1] == GlobalPositionInt(2, 400713740, -1052299300, 1, 2, 3, 4, 5, 6)
        assert messages[2] == Heartbeat(0, 0, 0, 7, 0, 0)
        assert reader.damage.is_clean

    def test_unknown_ids_are_counted_and_passed_over(self, log):
        foreign = [frame_v2(number, b"abc", seed=1) for number in (70_000, 65_535, 16_777_215, 9999)]
        foreign.append(frame_v1(240, b"abc", seed=1))
        frames = [heartbeat(), *foreign, heartbeat(), foreign[0]]
        reader = TlogReader(log(b"".join(record(frame, START_US + n) for n, frame in enumerate(frames))))
        assert len(list(reader)) == 2
        assert reader.damage == Damage(frames=8, unknown_ids=6)

    def test_a_log_of_unknown_ids_alone_is_a_log(self, log):
        path = log(b"".join(record(frame_v2(70_000, b"abc", seed=1), START_US + n) for n in range(5)))
        assert list(TlogReader(path)) == []
        traffic, damage = survey(path)
        assert [(one.name, one.count) for one in traffic] == [("UNKNOWN_70000", 5)]
        assert damage == Damage(frames=5, unknown_ids=5)


class TestChoice:
    def test_wanted_types_are_those_of_the_whole(self):
        wanted = [ParamValue, Statustext]
        entries = list(TlogReader(MAZE, wanted))
        assert len(entries) > 1200
        assert entries == [entry for entry in TlogReader(MAZE) if type(entry.frame.message) in wanted]

    def test_nothing_wanted(self):
        reader = TlogReader(MAZE, [])
        assert list(reader) == []
        assert reader.damage == Damage(frames=8674)

    def test_a_class_that_is_no_message_is_refused(self):
        with pytest.raises(ValueError, match="MESSAGE is not a MAVLink message"):
            TlogReader(MAZE, [Message])

    def test_two_iterations_are_independent(self):
        reader = TlogReader(MAZE, [ParamValue])
        assert reader.damage == Damage()
        one, other = iter(reader), iter(reader)
        pairs = [(next(one), next(other)) for _ in range(20)]
        assert all(first == second for first, second in pairs)
        assert list(reader)[:20] == [first for first, _ in pairs]


class TestErrors:
    def test_missing(self, tmp_path):
        with pytest.raises(LogError, match=r"gone.tlog: No such file"):
            TlogReader(tmp_path / "gone.tlog")

    def test_empty(self, log):
        with pytest.raises(LogError, match="the file is empty"):
            TlogReader(log(b""))

    def test_a_folder(self, tmp_path):
        with pytest.raises(LogError, match="not a regular file"):
            TlogReader(tmp_path)

    @pytest.mark.parametrize("seed", range(5))
    @pytest.mark.parametrize("size", [1, 7, 8, 20, 700_000])
    def test_random_bytes(self, log, seed, size):
        with pytest.raises(LogError, match="no MAVLink messages in it"):
            TlogReader(log(random.Random(seed).randbytes(size)))

    @pytest.mark.parametrize(
        "data", [b"\xfd" * 5000, b"\xfe" * 5000, bytes(5000), b"time,lat,lon\n1,2,3\n" * 300]
    )
    def test_other_files(self, log, data):
        with pytest.raises(LogError, match="no MAVLink messages in it"):
            TlogReader(log(data))

    def test_gzip_of_nothing(self, log):
        with pytest.raises(LogError, match="no MAVLink messages in it"):
            TlogReader(log(gzip.compress(b"")))

    def test_error_is_one_line_and_tells_the_file(self, log):
        with pytest.raises(LogError, match=r"\A.*notes\.txt: no MAVLink messages in it\Z") as caught:
            TlogReader(log(b"x" * 99, "notes.txt"))
        assert caught.value.details["path"].endswith("notes.txt")


class TestSurvey:
    def test_counts_by_sender_and_type(self):
        traffic, damage = survey(MAZE)
        assert sum(one.count for one in traffic) == damage.frames == 8674
        by_name = {(one.system, one.component, one.name): one for one in traffic}
        fence_items = by_name[255, 230, "MISSION_ITEM_INT"]
        assert fence_items.count == 39
        assert by_name[1, 1, "GLOBAL_POSITION_INT"].rate_hz == pytest.approx(4, rel=0.05)
        assert by_name[1, 1, "HOME_POSITION"].rate_hz == 0
        assert [(one.system, one.component, one.message_id) for one in traffic] == sorted(
            (one.system, one.component, one.message_id) for one in traffic
        )

    def test_first_and_last_times_span_all_windows(self, small_windows):
        traffic, _ = survey(MAZE)
        positions = next(one for one in traffic if one.name == "GLOBAL_POSITION_INT")
        times = [entry.time_s for entry in TlogReader(MAZE, [GlobalPositionInt])]
        assert (positions.first_s, positions.last_s, positions.count) == (times[0], times[-1], len(times))
