"""Signed links: keys, wrong keys, replays, and a key that shows itself nowhere."""

from __future__ import annotations

import base64
import hashlib
import os
import pickle
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavlink_bridge.errors import UsageError
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Heartbeat, MissionCount
from mavlink_bridge.mavlink.signing import Signing, SigningKey

SECRET = bytes(range(200, 232))
NOW_S = 1_800_000_000.0


def signing(secret=SECRET, clock=lambda: NOW_S, link_id=0):
    return Signing(SigningKey(secret), clock, link_id)


def key_file(tmp_path, content, mode=0o600):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def same_key(key, secret):
    return key.signature(b"x") == hashlib.sha256(secret + b"x").digest()[:6]


def test_signed_frames_go_through():
    sender, receiver = Codec(1, 1, signing()), Codec(245, 190, signing())
    for count in range(300):
        [frame] = receiver.decode(sender.encode(MissionCount(245, 190, count)))
        assert frame.message.count == count
    assert receiver.untrusted_frames == 0


def test_pymavlink_believes_our_frames_and_we_believe_its():
    theirs = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    theirs.signing.secret_key, theirs.signing.sign_outgoing = SECRET, True
    theirs.signing.timestamp = int((NOW_S - 1_420_070_400) * 1e5)
    ours = Codec(245, 190, signing())
    packed = theirs.heartbeat_encode(10, 3, 0, 0, 4).pack(theirs)
    assert [frame.message.type for frame in ours.decode(packed)] == [10]
    [back] = theirs.parse_buffer(ours.encode(Heartbeat(18, 8)))
    assert back.get_type() == "HEARTBEAT"
    assert back.get_signed()


@pytest.mark.parametrize(
    "sender", [Codec(1, 1), Codec(1, 1, signing(bytes(32)))], ids=["unsigned", "other key"]
)
def test_unsigned_and_wrongly_signed_frames_are_dropped_and_counted(sender):
    receiver = Codec(245, 190, signing())
    assert receiver.decode(sender.encode(Heartbeat(10, 3)) * 3) == []
    assert receiver.untrusted_frames == 3


def test_mavlink_1_frames_are_dropped():
    old = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    packed = old.heartbeat_encode(10, 3, 0, 0, 4).pack(old, force_mavlink1=True)
    receiver = Codec(245, 190, signing())
    assert receiver.decode(packed) == []
    assert receiver.untrusted_frames == 1


def test_a_replayed_frame_is_refused():
    sender, receiver = Codec(1, 1, signing()), Codec(245, 190, signing())
    first, second = sender.encode(Heartbeat(10, 3)), sender.encode(Heartbeat(10, 3))
    assert len(receiver.decode(first)) == 1
    assert receiver.decode(first) == []
    assert len(receiver.decode(second)) == 1
    assert receiver.decode(first) == []
    assert receiver.untrusted_frames == 2


def test_an_old_stream_is_refused():
    stale = Codec(1, 1, signing(clock=lambda: NOW_S - 61))
    fresh = Codec(1, 2, signing(clock=lambda: NOW_S - 59))
    receiver = Codec(245, 190, signing())
    assert receiver.decode(stale.encode(Heartbeat(10, 3))) == []
    assert len(receiver.decode(fresh.encode(Heartbeat(10, 3)))) == 1


def test_a_forged_time_does_not_lock_the_sender_out():
    sender, receiver = Codec(1, 1, signing()), Codec(245, 190, signing())
    forger = Codec(1, 1, signing(bytes(32), clock=lambda: NOW_S + 1e6))
    receiver.decode(forger.encode(Heartbeat(10, 3)))
    assert len(receiver.decode(sender.encode(Heartbeat(10, 3)))) == 1


def test_our_time_follows_the_newest_heard():
    ahead = Codec(1, 1, signing(clock=lambda: NOW_S + 1000))
    behind, third = Codec(245, 190, signing()), Codec(9, 9, signing(clock=lambda: NOW_S + 1000))
    behind.decode(ahead.encode(Heartbeat(10, 3)))
    assert len(third.decode(behind.encode(Heartbeat(18, 8)))) == 1


@given(st.integers(0, 10**6), st.integers(1, 255))
def test_any_changed_byte_is_noticed(position, change):
    frame = bytearray(Codec(1, 1, signing()).encode(MissionCount(245, 190, 7)))
    frame[position % len(frame)] ^= change
    assert not signing().accepts(bytes(frame))


@given(st.binary(max_size=40))
def test_noise_is_not_accepted(noise):
    assert not signing().accepts(noise)


@pytest.mark.parametrize(
    "content",
    [
        SECRET,
        SECRET.hex().encode(),
        SECRET.hex().upper().encode() + b"\n",
        base64.b64encode(SECRET),
        b"  " + base64.b64encode(SECRET) + b"\r\n",
    ],
    ids=["bytes", "hex", "HEX", "base64", "base64 with white space"],
)
def test_key_files(tmp_path, content):
    assert same_key(SigningKey.read(key_file(tmp_path, content)), SECRET)


@pytest.mark.parametrize("passphrase", ["correct horse", "x", "z" * 64, "A" * 40])
def test_a_passphrase_is_hashed_as_mavproxy_does(tmp_path, passphrase):
    key = SigningKey.read(key_file(tmp_path, passphrase.encode() + b"\n"))
    assert same_key(key, hashlib.sha256(passphrase.encode("ascii")).digest())


@pytest.mark.parametrize(
    ("content", "what"),
    [(b"", "empty"), (b" \n", "empty"), (b"\xff\xfe\xfd", "neither"), (b"x" * 5000, "longer")],
)
def test_unusable_key_files(tmp_path, content, what):
    with pytest.raises(UsageError, match=what):
        SigningKey.read(key_file(tmp_path, content))


def test_a_missing_key_file(tmp_path):
    with pytest.raises(UsageError, match="cannot be read"):
        SigningKey.read(tmp_path / "none")


@pytest.mark.skipif(os.name != "posix", reason="POSIX permissions")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o666, 0o610])
def test_a_key_that_others_may_read_is_refused(tmp_path, mode):
    with pytest.raises(UsageError, match="chmod 600"):
        SigningKey.read(key_file(tmp_path, SECRET, mode))


def test_a_key_of_another_length():
    with pytest.raises(UsageError, match="32 bytes, not 5"):
        SigningKey(b"12345")


def test_the_key_shows_itself_nowhere(tmp_path, caplog):
    caplog.set_level("DEBUG")
    key = SigningKey(SECRET)
    shown = [repr(key), str(key), f"{key}", repr(Signing(key, time.time).__dict__)]
    codec = Codec(245, 190, Signing(key, time.time))
    codec.decode(Codec(1, 1, signing(bytes(32))).encode(Heartbeat(10, 3)))
    shown += [caplog.text, repr(vars(codec))]
    with pytest.raises(TypeError, match="a signing key is not written anywhere") as pickling:
        pickle.dumps(key)
    shown.append(str(pickling.value))
    for content in (b"\xff" + SECRET, SECRET * 200):
        with pytest.raises(UsageError, match="signing key") as error:
            SigningKey.read(key_file(tmp_path, content))
        shown += [str(error.value), repr(error.value.details)]
    for text in shown:
        for form in (repr(SECRET)[2:-1], SECRET.hex(), base64.b64encode(SECRET).decode()):
            assert form not in text
