"""Logs we write: read by ourselves and by pymavlink."""

from __future__ import annotations

import os
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavutil
from tlog.frames import LOGS, START_US, frame_v1, frame_v2, heartbeat, record, records

from mavlink_bridge.errors import LogError
from mavlink_bridge.tlog import SENT_LINK, Damage, TlogReader, TlogWriter


def test_a_recording_comes_out_byte_for_byte(tmp_path):
    data = LOGS[0].read_bytes()
    path = tmp_path / "copy.tlog"
    with TlogWriter(path) as writer:
        for part in records(data):
            time_us = int.from_bytes(part[:8], "big")
            writer.write(time_us / 1e6, part[8:], time_us & 3)
    assert path.read_bytes() == data


def test_pymavlink_reads_times_and_links(tmp_path):
    path = tmp_path / "ours.tlog"
    with TlogWriter(path) as writer:
        writer.write(1_795_314_272.5, heartbeat(1))
        writer.write(1_795_314_273.25, heartbeat(2), SENT_LINK)
    log = mavutil.mavlogfile(str(path))
    first, second = log.recv_msg(), log.recv_msg()
    log.close()
    assert (first._timestamp, first._link) == (1_795_314_272.5, 0)
    assert (second._timestamp, second._link) == (pytest.approx(1_795_314_273.25, abs=4e-6), 3)


def test_an_old_log_is_continued(tmp_path):
    path = tmp_path / "twice.tlog"
    for number in (1, 2):
        with TlogWriter(path) as writer:
            writer.write(START_US / 1e6 + number, heartbeat(number))
    reader = TlogReader(path)
    assert [entry.frame.message.custom_mode for entry in reader] == [1, 2]
    assert reader.damage == Damage(frames=2)


def test_a_record_is_there_before_the_writer_is_closed(tmp_path):
    path = tmp_path / "live.tlog"
    with TlogWriter(path) as writer:
        writer.write(START_US / 1e6, heartbeat())
        assert path.read_bytes() == record(heartbeat())


def test_several_frames_of_one_datagram_are_records_of_their_own(tmp_path):
    path = tmp_path / "datagram.tlog"
    frames = [heartbeat(1), frame_v1(46, b"\3\0"), frame_v2(46, b"\4", signature=bytes(13))]
    with TlogWriter(path) as writer:
        writer.write(START_US / 1e6, b"".join(frames))
    assert path.read_bytes() == b"".join(map(record, frames))


@given(cuts=st.lists(st.integers(0, 200), max_size=12), noise=st.binary(max_size=6))
@settings(max_examples=40, deadline=None)
def test_a_stream_in_any_pieces_gives_the_same_frames(cuts, noise, tmp_path_factory):
    path = tmp_path_factory.mktemp("pieces") / "stream.tlog"
    noise = noise.translate(bytes(range(0xFD)) + b"abc")
    stream = noise + heartbeat(1) + frame_v1(46, b"\3\0") + noise + frame_v2(46, b"\4", signature=bytes(13))
    edges = sorted({0, len(stream), *(cut for cut in cuts if cut < len(stream))})
    with TlogWriter(path) as writer:
        for begin, end in pairwise(edges):
            writer.write(START_US / 1e6, stream[begin:end], 1)
            writer.write(START_US / 1e6, b"\xfe", 2)  # another link's bytes do not mix in
    ours = [entry for entry in TlogReader(path) if entry.link == 1]
    assert [type(entry.frame.message).__name__ for entry in ours] == [
        "Heartbeat",
        "MissionItemReached",
        "MissionItemReached",
    ]


def test_a_link_number_has_two_bits(tmp_path):
    with TlogWriter(tmp_path / "some.tlog") as writer, pytest.raises(ValueError, match="0 to 3"):
        writer.write(0.0, heartbeat(), 4)


def test_a_file_that_cannot_be_written(tmp_path):
    with pytest.raises(LogError, match="No such file"):
        TlogWriter(tmp_path / "no" / "folder.tlog")


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
@pytest.mark.parametrize("aim", ["precious", "nowhere"])
def test_follows_no_link(tmp_path, aim):
    (tmp_path / "precious").write_bytes(b"precious")
    path = tmp_path / "run.tlog"
    path.symlink_to(tmp_path / aim)
    with pytest.raises(LogError, match=r"run\.tlog: it is a link; give the file itself"):
        TlogWriter(path)
    assert (tmp_path / "precious").read_bytes() == b"precious"
    assert not (tmp_path / "nowhere").exists()
