"""Frames to bytes and back, against pymavlink's own field types."""

from __future__ import annotations

import struct
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from pymavlink.generator.mavcrc import x25crc

from mavlink_bridge.mavlink.codec import DIALECT, Codec
from mavlink_bridge.mavlink.messages import (
    MESSAGES,
    Frame,
    Heartbeat,
    Message,
    MissionCurrent,
    Statustext,
    wire_name,
)

CLASSES = {one.msgname: one for one in DIALECT.values()}
RANGES = {
    "uint8_t": (0, 2**8 - 1), "int8_t": (-(2**7), 2**7 - 1), "uint16_t": (0, 2**16 - 1), "int16_t": (-(2**15), 2**15 - 1),
    "uint32_t": (0, 2**32 - 1), "int32_t": (-(2**31), 2**31 - 1), "uint64_t": (0, 2**64 - 1),
}  # fmt: skip


def values(message_class: type[Message], name: str) -> st.SearchStrategy:
    wire = CLASSES[wire_name(message_class)]
    kind = wire.fieldtypes[wire.fieldnames.index(name)]
    if kind == "float":
        return st.floats(width=32, allow_nan=False)
    if kind == "char":
        length = wire.array_lengths[wire.ordered_fieldnames.index(name)]
        return st.text(st.characters(codec="ascii", exclude_characters="\0"), max_size=length)
    if length := wire.array_lengths[wire.ordered_fieldnames.index(name)]:
        return st.tuples(*[st.integers(*RANGES[kind])] * length)
    return st.integers(*RANGES[kind])


any_message = st.sampled_from(sorted(MESSAGES.values(), key=str)).flatmap(
    lambda one: st.builds(one, **{field.name: values(one, field.name) for field in fields(one)})
)
identities = st.tuples(st.integers(0, 255), st.integers(0, 255))


@given(
    st.lists(st.tuples(identities, any_message), min_size=1, max_size=5),
    st.lists(st.integers(1, 40), max_size=10),
)
def test_what_is_sent_is_received(sent: list[tuple[tuple[int, int], Message]], cuts: list[int]) -> None:
    """Whatever way the bytes are cut on their way."""
    data = b"".join(Codec(*identity).encode(message) for identity, message in sent)
    receiver = Codec(255, 190)
    frames: list[Frame] = []
    for cut in cuts:
        frames += receiver.decode(data[:cut])
        data = data[cut:]
    frames += receiver.decode(data)
    assert frames == [Frame(*identity, message) for identity, message in sent]
    assert receiver.bad_bytes == 0


@pytest.mark.parametrize("name", sorted(MESSAGES))
def test_every_message_has_its_fields_on_the_wire(name: str) -> None:
    assert {field.name for field in fields(MESSAGES[name])} <= set(CLASSES[name].fieldnames)


def test_frames_are_mavlink_2_and_numbered() -> None:
    codec = Codec(7, 8)
    assert codec.identity == (7, 8)
    frames = [codec.encode(Heartbeat(10, 3)) for _ in range(258)]
    assert {frame[0] for frame in frames} == {0xFD}
    assert [frame[4] for frame in frames] == [*range(256), 0, 1]
    assert {tuple(frame[5:7]) for frame in frames} == {(7, 8)}


def test_mavlink_1_is_understood() -> None:
    sender = dialect.MAVLink(None, srcSystem=3, srcComponent=4)
    data = sender.heartbeat_encode(10, 3, 0, 5, 6).pack(sender, force_mavlink1=True)
    assert data[0] == 0xFE
    assert Codec(1, 1).decode(data) == [Frame(3, 4, Heartbeat(10, 3, 0, 5, 6))]


def test_damage_is_passed_over() -> None:
    codec = Codec(1, 1)
    good, bad = codec.encode(Heartbeat(10, 3)), bytearray(codec.encode(Statustext(4, "hello")))
    bad[12] ^= 1
    receiver = Codec(2, 2)
    noise = b"\x00\x01noise"
    assert [frame.message for frame in receiver.decode(noise + good + bytes(bad) + good)] == [
        Heartbeat(10, 3)
    ] * 2
    assert receiver.bad_bytes >= len(noise) + 1
    assert receiver.decode(b"") == []


@given(st.binary(max_size=400))
def test_random_bytes_never_raise(data: bytes) -> None:
    Codec(1, 1).decode(data)


def test_types_nobody_speaks_are_left_out() -> None:
    sender = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    data = sender.scaled_pressure_encode(1, 0.0, 0.0, 0).pack(sender)
    decoded = Codec(1, 1).decode_with_bytes(data)
    assert decoded == [(bytes(data), None)]
    assert struct.unpack("<B", bytes(data)[:1]) == (0xFD,)


@pytest.mark.parametrize("kept_bytes", [2, 6, 7, 13, 14, 18])
def test_the_ids_in_mission_current_which_pymavlink_leaves_out(kept_bytes: int) -> None:
    payload = struct.pack("<HHBBIII", 3, 7, 2, 1, 0x11223344, 0x55667788, 0x99AABBCC)[:kept_bytes]
    header = struct.pack("<BBBBBBBHB", 0xFD, len(payload), 0, 0, 0, 1, 1, 42, 0)
    crc = x25crc(header[1:] + payload + bytes([28]))
    (frame,) = Codec(255, 190).decode(header + payload + struct.pack("<H", crc.crc))
    whole = payload.ljust(18, b"\0")
    assert frame == Frame(1, 1, MissionCurrent(*struct.unpack("<HHBBIII", whole)))
