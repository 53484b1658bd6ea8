"""The seeded bad link, and the splitter that lets it lose whole frames."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Heartbeat, ParamRequestList
from mavlink_bridge.simulator.faults import REORDER_S, Faults, FaultyLink
from mavlink_bridge.simulator.framing import FrameSplitter


def through(faults, payloads, seed=0, step_s=0.01):
    """Push one payload a step; return all that comes out with the time it does."""
    link = FaultyLink(faults, seed)
    came = []
    now_s = 0.0
    for payload in payloads:
        link.push(payload, now_s)
        came += [(now_s, out) for out in link.due(now_s)]
        now_s += step_s
    while link.deadline_s is not None:
        assert link.deadline_s >= now_s - step_s - 1e-9
        now_s = max(now_s, link.deadline_s)
        came += [(now_s, out) for out in link.due(now_s)]
    return came


def test_a_good_link_changes_nothing():
    came = through(Faults(), range(100))
    assert [out for _, out in came] == list(range(100))
    assert [time_s for time_s, _ in came] == pytest.approx([0.01 * step for step in range(100)])


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_loss_and_duplicates_come_as_often_as_asked(share):
    assert len(through(Faults(loss=share), range(20_000))) == pytest.approx(20_000 * (1 - share), rel=0.03)
    assert len(through(Faults(duplicate=share), range(20_000))) == pytest.approx(
        20_000 * (1 + share), rel=0.03
    )


def test_everything_can_be_lost():
    assert through(Faults(loss=1.0), range(100)) == []


def test_latency_and_jitter():
    link = FaultyLink(Faults(latency_s=0.1, jitter_s=0.3))
    for index in range(1000):
        link.push(index, 0.0)
    assert link.due(0.099) == []
    early = link.due(0.25)
    assert 400 < len(early) < 600
    assert early != sorted(early)
    assert sorted(early + link.due(0.4)) == list(range(1000))
    assert link.deadline_s is None


def test_reordering_lets_later_ones_overtake():
    came = [out for _, out in through(Faults(reorder=0.2), range(1000))]
    assert sorted(came) == list(range(1000))
    assert came != sorted(came)
    late = max(came.index(value) - value for value in came)
    assert late <= REORDER_S / 0.01 + 1


def test_bits_are_flipped_one_at_a_time():
    came = through(Faults(bit_error=0.3), [bytes(20)] * 1000)
    damaged = [out for _, out in came if out != bytes(20)]
    assert len(damaged) == pytest.approx(300, abs=60)
    assert {sum(byte.bit_count() for byte in out) for out in damaged} == {1}
    assert {len(out) for out in damaged} == {20}


def test_what_is_not_bytes_is_lost_where_a_bit_would_flip():
    assert len(through(Faults(bit_error=0.3), ["frame"] * 1000)) == pytest.approx(700, abs=60)
    assert through(Faults(bit_error=1.0), [b""]) == [(0.0, b"")]


def test_silence_has_a_beginning_and_an_end():
    came = through(Faults(silence=(0.2, 0.3)), range(100))
    assert [out for _, out in came] == [*range(20), *range(50, 100)]


@given(st.integers(), st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_the_same_seed_is_the_same_link(seed, loss, duplicate, jitter_s):
    faults = Faults(loss=loss, duplicate=duplicate, jitter_s=jitter_s)
    assert through(faults, range(50), seed) == through(faults, range(50), seed)


@pytest.mark.parametrize(
    "wrong",
    [{"loss": 1.1}, {"duplicate": -0.1}, {"latency_s": -1.0}, {"jitter_s": float("inf")}, {"bit_error": 2}],
)
def test_impossible_faults_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Faults(**wrong)


def frames(count):
    codec = Codec(255, 190)
    messages = [Heartbeat(6, 8) if index % 2 else ParamRequestList(1, 1) for index in range(count)]
    return [codec.encode(message) for message in messages]


@given(st.lists(st.integers(1, 40), max_size=40), st.binary(max_size=5))
def test_frames_are_found_however_they_are_cut(cuts, junk):
    wanted = frames(6)
    junk = bytes(byte & 0x7F for byte in junk)
    stream = junk + b"".join(wanted)
    splitter = FrameSplitter()
    found = []
    for cut in [*cuts, len(stream)]:
        found += splitter.split(stream[:cut])
        stream = stream[cut:]
    assert b"".join(found) == junk + b"".join(wanted)
    assert found[-6:] == wanted


def test_old_and_signed_frames_have_their_lengths():
    old = bytes([0xFE, 3, 0, 1, 1, 0, 7, 7, 7, 0, 0])
    signed = bytes([0xFD, 2, 1, 0, 0, 1, 1, 0, 0, 0, 5, 5, 0, 0]) + bytes(13)
    splitter = FrameSplitter()
    assert splitter.split(old + signed + old[:2]) == [old, signed]
    assert splitter.split(old[2:]) == [old]
