"""Every row of the measured table "Mission protocol, server side" that is about downloads."""

from __future__ import annotations

import pytest
from simulator.station import HOME, TICK_S, Bench, at, line, placed, square

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.simulator import SimulatorConfig
from missions.items import Command


@pytest.fixture(scope="module")
def config():
    return SimulatorConfig(streams=False, mission=line(499))


def test_past_the_end_the_count_comes_and_then_invalid_sequence():
    bench = Bench(SimulatorConfig(streams=False, mission=line(4)))
    count, ack = bench.ask(m.MissionRequestInt(1, 1, 5))
    assert count == m.MissionCount(255, 190, 5, MissionType.MISSION)
    assert ack == m.MissionAck(255, 190, MissionResult.INVALID_SEQUENCE, MissionType.MISSION)


def test_a_float_request_brings_a_float_item_and_a_reproof():
    bench = Bench(SimulatorConfig(streams=False, mission=line(4)))
    item, text = bench.ask(m.MissionRequest(1, 1, 2))
    assert isinstance(item, m.MissionItem)
    assert (item.seq, item.command, item.frame) == (2, 16, 3)
    assert item.x == pytest.approx(at(20, 0).lat_deg, abs=4e-6)
    assert text.text == "got MISSION_REQUEST; use MISSION_REQUEST_INT!"


@pytest.mark.parametrize(
    ("window", "seconds"), [(1, 10.0), (5, 2.0), (10, 1.0), (20, 0.52), (50, 0.22), (100, 0.116)]
)
def test_the_pace_of_a_window(config, window, seconds):
    bench = Bench(config)
    begin_s = bench.now_s
    (count,) = bench.ask(m.MissionRequestList(1, 1))
    assert count.count == 500
    got, asked = set(), 0
    while len(got) < 500:
        burst = range(asked, min(500, asked + window))
        asked = burst.stop
        got |= {item.seq for item in bench.ask(*[m.MissionRequestInt(1, 1, seq) for seq in burst])}
    assert got == set(range(500))
    assert bench.now_s - begin_s == pytest.approx(seconds, abs=0.05)


def test_500_requests_at_once_overflow_the_input(config):
    bench = Bench(config)
    answers = bench.ask(*[m.MissionRequestInt(1, 1, seq) for seq in range(500)])
    assert len(answers) == 500 - 166
    assert bench.ask(m.MissionRequestInt(1, 1, 499))[0].seq == 499


def test_a_download_of_the_fence_is_as_the_autopilot_sends_it():
    fence = [*square(50, 0), placed(Command.FENCE_CIRCLE_EXCLUSION, at(0, 30), 7.3)]
    bench = Bench(SimulatorConfig(streams=False, fence=tuple(fence)))
    items = bench.download(MissionType.FENCE)
    assert [(item.frame, item.z, item.autocontinue, item.current) for item in items] == [(0, 0.0, 0, 0)] * 5
    assert [(item.x, item.y) for item in items] == [(item.lat_e7, item.lon_e7) for item in fence]
    assert [item.param1 for item in items[:4]] == [4.0] * 4
    assert items[4].param1 != 7.3
    assert items[4].param1 == pytest.approx(7.3, abs=1e-6)


def test_a_download_is_answered_in_the_tick_after_it(config):
    bench = Bench(config)
    bench.send(m.MissionRequestInt(1, 1, 7))
    begin_s = bench.now_s
    bench.run(1.0)
    answered_s = next(time_s for time_s, message in bench.heard if isinstance(message, m.MissionItemInt))
    assert 0 < answered_s - begin_s <= TICK_S + 1e-9


def test_home_moves_with_the_vehicles_home():
    bench = Bench(SimulatorConfig(streams=False, home=at(100, 100), mission=line(2)))
    home = bench.download()[0]
    assert (home.x, home.y) != (round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7))
    assert home.x == round(at(100, 100).lat_deg * 1e7)
