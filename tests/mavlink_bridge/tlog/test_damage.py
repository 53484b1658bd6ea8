"""Damaged logs: what was whole is found, what was not is counted."""

from __future__ import annotations

import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tlog.frames import LOGS, START_US, frame_v2, heartbeat, record, records
from tlog.fuzz_tlog import campaign

from mavlink_bridge.errors import LogError
from mavlink_bridge.mavlink.messages import MissionItemInt
from mavlink_bridge.tlog import Damage, TlogReader
from mavlink_bridge.tlog.wire import CLASS_OF_ID

YARD = next(log for log in LOGS if log.stem == "fence-change-yard")
PARTS = records(YARD.read_bytes())


@pytest.fixture
def log(tmp_path):
    def write(data, name="some.tlog"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write


def rows(entries):
    return [(entry.time_s, entry.link, repr(entry.frame)) for entry in entries]


@pytest.fixture(scope="module")
def whole():
    return rows(TlogReader(YARD))


class TestCounts:
    def test_an_undamaged_log_is_clean(self):
        reader = TlogReader(YARD)
        list(reader)
        assert reader.damage == Damage(frames=len(PARTS))
        assert reader.damage.is_clean
        assert str(reader.damage) == "8323 frames, no damage"

    def test_orphan_timestamps(self, log, whole):
        rng = random.Random(1)
        orphans, parts = 0, []
        for part in PARTS:
            count = rng.choice([0, 0, 0, 1, 2, 5])
            parts += [struct.pack(">Q", int.from_bytes(part[:8], "big") + n) for n in range(count)]
            parts.append(part)
            orphans += count
        reader = TlogReader(log(b"".join(parts) + PARTS[-1][:8]))
        assert rows(reader) == whole
        assert reader.damage == Damage(frames=len(PARTS), orphan_timestamps=orphans + 1)

    def test_a_wrong_checksum_loses_that_frame_alone(self, log, whole):
        place = next(n for n, part in enumerate(PARTS) if n > 3000 and part[15] == 33)
        broken = bytearray(PARTS[place])
        broken[25] ^= 4
        reader = TlogReader(log(b"".join([*PARTS[:place], broken, *PARTS[place + 1 :]])))
        assert len(rows(reader)) == len(whole) - 1
        assert reader.damage == Damage(frames=len(PARTS) - 1, bad_crcs=1)
        assert str(reader.damage) == "8322 frames, 1 bad crcs"

    def test_frames_that_are_not_wanted_are_not_checked(self, log):
        place = next(n for n, part in enumerate(PARTS) if part[15] == 33)
        broken = bytearray(PARTS[place])
        broken[25] ^= 4
        reader = TlogReader(log(b"".join([*PARTS[:place], broken, *PARTS[place + 1 :]])), [MissionItemInt])
        assert list(reader)
        assert reader.damage.is_clean

    def test_wrong_checksum_beside_a_time_jump_or_at_the_end(self, log):
        bad = bytearray(heartbeat(7))
        bad[11] ^= 1
        data = record(heartbeat(1)) + record(bad, START_US + 1) + record(heartbeat(2), 5) + record(bad, 6)
        reader = TlogReader(log(data))
        assert [entry.frame.message.custom_mode for entry in reader] == [1, 2]
        assert reader.damage == Damage(frames=2, bad_crcs=2)

    @pytest.mark.parametrize("junk_bytes", [1, 8, 9, 300, 700_000])
    def test_garbage_is_skipped_and_counted(self, log, whole, junk_bytes):
        junk = random.Random(junk_bytes).randbytes(junk_bytes)
        reader = TlogReader(log(junk + b"".join(PARTS[:4000]) + junk + b"".join(PARTS[4000:])))
        assert rows(reader) == whole
        assert reader.damage == Damage(frames=len(PARTS), gaps=2, skipped_bytes=2 * junk_bytes)

    def test_garbage_at_the_end(self, log, whole):
        reader = TlogReader(log(YARD.read_bytes() + b"the radio's farewell"))
        assert rows(reader) == whole
        assert reader.damage == Damage(frames=len(PARTS), gaps=1, skipped_bytes=20)

    def test_a_long_tail_of_magic_bytes_is_no_cut_record(self, log):
        reader = TlogReader(log(record(heartbeat()) + b"\xfd" * 900_000))
        assert len(list(reader)) == 1
        assert reader.damage == Damage(frames=1, gaps=1, skipped_bytes=900_000)

    def test_a_log_that_shrinks_while_it_is_read(self, log, small_windows, whole):
        path = log(YARD.read_bytes())
        reader = TlogReader(path)
        entries = iter(reader)
        first = [next(entries) for _ in range(100)]
        path.write_bytes(YARD.read_bytes()[:20])
        assert rows(first) == whole[:100]
        assert len(list(entries)) < 500

    def test_a_cut_at_any_byte_of_the_last_record(self, log, whole):
        before = PARTS[-100:-1]
        keep = b"".join(before)
        last = PARTS[-1]
        count = sum(part[15] in CLASS_OF_ID for part in before)
        kept = whole[-count - 1 : -1] if last[15] in CLASS_OF_ID else whole[-count:]
        for size in range(1, len(last)):
            reader = TlogReader(log(keep + last[:size]))
            assert rows(reader) == kept
            lost = Damage(frames=99, truncated_bytes=size)
            if size == 8:  # what may be cut off or an orphan
                lost = Damage(frames=99, orphan_timestamps=1)
            assert reader.damage == lost

    def test_a_damaged_length_is_skipped_with_its_record(self, log):
        bad = bytearray(record(heartbeat(7), START_US + 1))
        bad[9] ^= 0x40
        reader = TlogReader(log(record(heartbeat(1)) + bad + record(heartbeat(2), START_US + 2) * 5))
        assert [entry.frame.message.custom_mode for entry in reader] == [1, 2, 2, 2, 2, 2]
        assert reader.damage == Damage(frames=6, gaps=1, skipped_bytes=len(bad))

    def test_frames_without_a_timestamp_get_the_one_before(self, log):
        parts = [
            heartbeat(0),
            record(heartbeat(1), START_US),
            heartbeat(2),
            record(heartbeat(3), START_US + 9),
        ] + [record(heartbeat(n), START_US + 10) for n in range(4, 9)]
        reader = TlogReader(log(b"".join(parts)))
        assert [(round(e.time_s * 1e6) - START_US, e.frame.message.custom_mode) for e in reader] == [
            (0, 0), (0, 1), (0, 2), (9, 3), (10, 4), (10, 5), (10, 6), (10, 7), (10, 8),
        ]  # fmt: skip
        assert reader.damage == Damage(frames=9, untimed_frames=2)

    def test_an_unknown_frame_before_garbage(self, log):
        foreign = frame_v2(70_000, b"abc", seed=1)
        data = [
            record(heartbeat(1)),
            record(foreign, START_US + 1),
            b"noise",
            record(heartbeat(2), START_US + 2),
        ]
        reader = TlogReader(log(b"".join(data)))
        assert len(list(reader)) == 2
        assert reader.damage == Damage(frames=3, unknown_ids=1, gaps=1, skipped_bytes=5)

    def test_an_unknown_frame_with_a_damaged_length(self, log):
        bad = bytearray(record(frame_v2(70_000, b"abcdefgh", seed=1), START_US + 1))
        bad[9] += 30
        data = [record(heartbeat(1)), bad, *[record(heartbeat(n), START_US + n) for n in range(2, 6)]]
        reader = TlogReader(log(b"".join(data)))
        assert [entry.frame.message.custom_mode for entry in reader] == [1, 2, 3, 4, 5]
        assert reader.damage == Damage(frames=5, gaps=1, skipped_bytes=len(bad))

    def test_unknown_frames_are_found_again_after_garbage(self, log):
        foreign = [record(frame_v2(70_000, b"abc", seed=1), START_US + n) for n in range(3)]
        reader = TlogReader(
            log(b"".join([record(heartbeat(1)), b"noise", *foreign, record(heartbeat(2), START_US + 9)]))
        )
        assert len(list(reader)) == 2
        assert reader.damage == Damage(frames=5, unknown_ids=3, gaps=1, skipped_bytes=5)


class TestWindows:
    def test_window_borders_change_nothing(self, small_windows, whole):
        reader = TlogReader(YARD)
        assert rows(reader) == whole
        assert reader.damage == Damage(frames=len(PARTS))

    def test_garbage_across_windows(self, small_windows, log, whole):
        junk = random.Random(3).randbytes(3 * small_windows)
        reader = TlogReader(log(b"".join(PARTS[:4000]) + junk + b"".join(PARTS[4000:])))
        assert rows(reader) == whole
        assert reader.damage == Damage(frames=len(PARTS), gaps=1, skipped_bytes=len(junk))

    def test_damage_of_all_kinds_in_small_windows(self, small_windows, tmp_path):
        score = campaign(range(40), tmp_path)
        assert score.found >= 0.99 * score.far > 0


class TestFuzz:
    @pytest.mark.parametrize(
        "first", [0, pytest.param(250, marks=pytest.mark.campaign)]
    )  # `make fuzz` goes on
    def test_what_lies_away_from_damage_is_found(self, first, tmp_path):
        score = campaign(range(first, first + 250), tmp_path)
        assert score.far > 20_000
        assert score.found >= 0.99 * score.far
        assert score.invented <= 2  # a checksum of 16 bits lets one in 65,536 pass
        assert score.slowest_s < 5

    @given(data=st.binary(max_size=400))
    @settings(max_examples=150, deadline=None)
    def test_any_bytes_are_read_or_refused(self, data, tmp_path_factory):
        path = tmp_path_factory.getbasetemp() / "any.tlog"
        path.write_bytes(data)
        try:
            entries = list(TlogReader(path))
        except LogError:
            return
        assert all(isinstance(entry.link, int) for entry in entries)

    @given(
        pieces=st.lists(
            st.one_of(
                st.binary(max_size=40),
                st.integers(0, 200).map(lambda n: b"".join(PARTS[n : n + 3])),
                st.integers(0, 200).map(lambda n: PARTS[n][8:]),
                st.integers(0, 200).map(lambda n: PARTS[n][:9]),
                st.sampled_from([b"\xfd", b"\xfe", b"\xfd\xff\0", b"\xfe\x09", bytes(8)]),
            ),
            max_size=12,
        ),
        last=st.integers(0, 200),
    )
    @settings(max_examples=150, deadline=None)
    def test_a_good_stretch_after_anything_is_found(self, pieces, last, tmp_path_factory):
        path = tmp_path_factory.getbasetemp() / "pieces.tlog"
        good = PARTS[last : last + 60]
        path.write_bytes(b"".join([*pieces, bytes(300), *good]))
        expected = path.with_name("good.tlog")
        expected.write_bytes(b"".join(good))
        wanted = rows(TlogReader(expected))
        reader = TlogReader(path)
        assert rows(reader)[-len(wanted) :] == wanted


def test_the_far_rule_of_the_campaign_sees_a_lost_frame(tmp_path, monkeypatch):
    # The campaign itself must be able to fail: a reader that drops one frame in ten is caught.
    from tlog import fuzz_tlog

    class Lossy(TlogReader):
        def __iter__(self):
            kept = (entry for n, entry in enumerate(super().__iter__()) if n % 10)
            yield from kept

    for number in range(28):
        fuzz_tlog.original(number)
    monkeypatch.setattr(fuzz_tlog, "TlogReader", Lossy)
    score = campaign(range(10), tmp_path)
    assert score.found < 0.95 * score.far
