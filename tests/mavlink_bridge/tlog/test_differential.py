"""The reader's messages against pymavlink's: on all recordings, and on random payloads of every type."""

from __future__ import annotations

import dataclasses
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect
from tlog.frames import LOGS, START_US, frame_v1, frame_v2, record

from mavlink_bridge.mavlink.codec import to_frame
from mavlink_bridge.mavlink.messages import MESSAGES
from mavlink_bridge.tlog import TlogReader, read_columns

IDS = {cls.msgname: number for number, cls in dialect.mavlink_map.items() if cls.msgname in MESSAGES}


def by_pymavlink(path):
    log = mavutil.mavlogfile(str(path))
    found = []
    while (raw := log.recv_msg()) is not None:
        frame = to_frame(raw)
        if frame is not None:
            found.append((round(raw._timestamp * 1e6), raw._link, repr(frame)))
    log.close()
    return found


def by_reader(path):
    return [(round(entry.time_s * 1e6), entry.link, repr(entry.frame)) for entry in TlogReader(path)]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_recordings_read_as_pymavlink_reads_them(path):
    theirs = by_pymavlink(path)
    assert len(theirs) > 2000
    assert by_reader(path) == theirs


@pytest.mark.parametrize("name", sorted(MESSAGES))
def test_random_payloads_decode_as_pymavlink_decodes_them(name, tmp_path):
    rng = random.Random(name)
    number = IDS[name]
    base, full = _v1_sizes(number), dialect.mavlink_map[number].unpacker.size
    frames = []
    for size in [*range(1, min(full + 8, 255)), full, full, base, 255]:
        payload = rng.randbytes(size)
        frames.append(frame_v2(number, payload, system=rng.randrange(256), component=rng.randrange(256)))
        frames.append(frame_v2(number, payload, signature=rng.randbytes(13)))
        if size in {base, full} and number < 256:  # MAVLink 1 has no others
            frames.append(frame_v1(number, payload, system=rng.randrange(256)))
    path = tmp_path / "one.tlog"
    path.write_bytes(b"".join(record(frame, START_US + place) for place, frame in enumerate(frames)))
    reader = TlogReader(path)
    ours = [repr(entry.frame) for entry in reader]
    decoder = dialect.MAVLink(None)
    assert ours == [repr(to_frame(decoder.decode(bytearray(frame)))) for frame in frames]
    assert reader.damage.is_clean


def _v1_sizes(number):
    # MAVLink 1's own dialect knows the lengths without extensions.
    from pymavlink.dialects.v10 import ardupilotmega as old

    cls = old.mavlink_map.get(number)
    return cls.unpacker.size if cls else dialect.mavlink_map[number].unpacker.size


def test_lengths_without_extensions_are_those_of_the_mavlink_1_dialect():
    from pymavlink.dialects.v10 import ardupilotmega as old

    from mavlink_bridge.tlog.wire import BASE_BYTES

    shared = [number for number in old.mavlink_map if number in dialect.mavlink_map and number < 256]
    assert len(shared) > 150
    wrong = {number for number in shared if BASE_BYTES[number] != old.mavlink_map[number].unpacker.size}
    assert wrong <= {
        0
    }  # HEARTBEAT's version has a default in pymavlink, which looks like an extension; its full length fits


@given(text=st.binary(max_size=50))
@settings(max_examples=60, deadline=None)
def test_texts_end_at_nul_and_replace_what_is_not_ascii(text, tmp_path_factory):
    path = tmp_path_factory.mktemp("text") / "one.tlog"
    frame = frame_v2(253, b"\x06" + text.ljust(50, b"\0"))
    path.write_bytes(record(frame))
    (entry,) = TlogReader(path)
    assert entry.frame.message.text == text.split(b"\0")[0].decode("ascii", "replace")


@pytest.mark.parametrize("name", ["GLOBAL_POSITION_INT", "PARAM_VALUE", "STATUSTEXT", "AUTOPILOT_VERSION"])
def test_columns_hold_what_the_entries_hold(name):
    message_class = MESSAGES[name]
    entries = list(TlogReader(LOGS[1], [message_class]))
    columns = read_columns(LOGS[1], message_class)
    assert columns["time_s"].tolist() == [entry.time_s for entry in entries]
    assert columns["link"].tolist() == [entry.link for entry in entries]
    assert columns["system"].tolist() == [entry.frame.system for entry in entries]
    assert columns["component"].tolist() == [entry.frame.component for entry in entries]
    for field in (one.name for one in dataclasses.fields(message_class)):
        values = [getattr(entry.frame.message, field) for entry in entries]
        assert columns[field].tolist() == [
            list(value) if isinstance(value, tuple) else value for value in values
        ]
