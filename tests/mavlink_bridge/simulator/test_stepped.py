"""A rover whose time passes only while somebody waits for it: however slow the computer, the link is never silent."""

from __future__ import annotations

import time
from itertools import pairwise

from simulator.station import HOME

from mavlink_bridge.link import Link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig, SteppedRover

IDENTITY = (245, 190)


def rover(speedup=1000.0, **options):
    return SteppedRover(SimulatedVehicle(SimulatorConfig(home=HOME, **options)), speedup)


def listen(link, for_s):
    """Listen so long; return the times at which heartbeats came."""
    until_s = link.now_s() + for_s
    times_s = []
    while link.now_s() < until_s:
        came_s, frames = link.receive_at(until_s - link.now_s())
        times_s += [came_s for frame in frames if isinstance(frame.message, m.Heartbeat)]
    return times_s


def test_heartbeats_come_each_second_by_the_clock_of_both():
    other = rover(streams=False)
    with Link(other, IDENTITY, clock=other.now_s) as link:
        times_s = listen(link, 10.0)
    gaps_s = [after - before for before, after in pairwise(times_s)]
    assert len(times_s) >= 9
    assert all(0.95 < gap_s < 1.1 for gap_s in gaps_s)


def test_no_time_passes_while_nobody_waits():
    other = rover()
    other.receive(1.0)
    before_s = other.now_s()
    time.sleep(0.05)  # at 1,000 times the speed, 50 s
    assert other.now_s() == before_s
    with Link(other, IDENTITY, clock=other.now_s) as link:
        times_s = listen(link, 2.5)
    assert times_s[0] - before_s < 1.1


def test_time_that_was_lost_is_not_made_up_for():
    other = rover(speedup=10.0)
    time.sleep(0.3)
    begun_s = time.monotonic()
    until_s = other.now_s() + 3.0
    while other.now_s() < until_s:
        other.receive(until_s - other.now_s())
    assert time.monotonic() - begun_s >= 0.19  # 3 s, ten times as fast, less what may be made up for


def test_it_answers_what_is_sent():
    other = rover(streams=False)
    with Link(other, IDENTITY, clock=other.now_s) as link:
        link.send(m.MissionRequestList(1, 1, m.MissionType.MISSION))
        counts = []
        while not counts and other.now_s():
            frames = link.receive(1.0)
            counts = [frame.message for frame in frames if isinstance(frame.message, m.MissionCount)]
    assert counts[0].count == 1  # home


def test_waiting_for_no_time_gives_what_is_there():
    other = rover()
    other.receive(0.0)
    before_s = other.now_s()
    other.receive(0.0)
    assert other.now_s() == before_s
