"""A log's clock may jump and run backwards; ours only goes forward."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_bridge.logbook import Pulse, SteadyClock
from mavlink_bridge.mavlink.messages import Frame, Heartbeat
from mavlink_bridge.tlog import LogEntry

DAY_S = 86_400.0


def run(times_s):
    clock = SteadyClock()
    frame = Frame(1, 1, Heartbeat(10, 3))
    return clock, [now_s for _, now_s in clock.over(LogEntry(time_s, 0, frame) for time_s in times_s)]


@pytest.mark.parametrize(
    ("times_s", "expected", "jumps"),
    [
        ([], [], 0),
        ([7.0], [7.0], 0),
        ([1.0, 2.0, 3.5], [1.0, 2.0, 3.5], 0),
        ([1.0, 2.0, 1.5, 2.5], [1.0, 2.0, 2.0, 2.5], 0),  # a late record
        ([1.0, 2.0, 3602.0, 3603.0], [1.0, 2.0, 3602.0, 3603.0], 0),  # an hour of silence
        ([1.0, 2.0, 500.0, 2.5, 3.0], [1.0, 2.0, 2.0, 2.5, 3.0], 0),  # a lone wrong time
        ([100.0, 40.0, 41.0], [100.0, 100.0, 101.0], 1),  # set back
        ([1.0, 2 * DAY_S, 2 * DAY_S + 1], [1.0, 1.0, 2.0], 1),  # set when the first fix came
        ([1.0, 2 * DAY_S], [1.0, 1.0], 1),
    ],
)
def test_steps(times_s, expected, jumps):
    clock, found = run(times_s)
    assert found == expected
    assert clock.jumps == jumps


@given(st.lists(st.floats(0, 1e10)))
def test_never_runs_backwards_and_never_leaps_a_day(times_s):
    clock, found = run(times_s)
    steps = [after - before for before, after in itertools.pairwise(found)]
    assert all(0 <= step <= DAY_S + 1e-3 for step in steps)
    assert len(found) == len(times_s)
    assert clock.jumps <= len(times_s)


@given(st.lists(st.floats(0, 4.9), max_size=30))
def test_times_that_go_forward_stay_as_they_are(steps_s):
    times_s = [sum(steps_s[:count], 1.7e9) for count in range(len(steps_s) + 1)]
    assert run(times_s)[1] == times_s


@pytest.mark.parametrize(
    ("beats", "every_s", "stands_still"),
    [(9, 0.0, False), (10, 0.0, True), (40, 0.05, True), (40, 0.25, False)],
)
def test_heartbeats_tell_a_clock_that_stands_still(beats, every_s, stands_still):
    pulse = Pulse()
    assert pulse.trouble is None
    for number in range(beats):
        pulse.take(Frame(1, 1, Heartbeat(10, 3)), 100.0 + number * every_s)
        pulse.take(Frame(255, 190, Heartbeat(6, 8)), 100.0 + number * every_s)
    assert (pulse.trouble is not None) is stands_still
    if pulse.trouble is not None:
        assert f"{beats} heartbeats" in pulse.trouble
