"""Commands that ArduPilot stores: all that its source takes, given back as it keeps them, and which of them the rover does not imitate."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator.station import Bench, at, kept

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.mavlink.stored_form import STORED_WITH_PLACE, is_same_item
from mavlink_bridge.simulator import SimulatorConfig
from mavlink_bridge.simulator.item_rules import kept_mission_item, mission_item_result
from mavlink_bridge.simulator.stored_commands import KEPT, NOT_DRIVEN
from missions.geo import distance_m, to_e7
from missions.items import MissionItem, waypoint

DOC = Path(__file__).parents[3] / "docs" / "simulator.md"

SOURCE = {
    *(16, 17, 18, 19, 20, 21, 22, 30, 31, 82, 83, 84, 85, 92, 93, 94, 112, 114, 115),
    *(177, 178, 179, 181, 182, 183, 184, 188, 189, 191, 193, 194, 195, 197),
    *(201, 202, 203, 205, 206, 207, 208, 210, 211, 212, 213, 215, 216, 217, 218, 222, 223),
    *(531, 532, 534, 600, 601, 1000, 2000, 2001, 2500, 2501, 3000, 42600, 42702, 42703),
}
"""The cases of AP_Mission::mavlink_int_to_mission_cmd (4.7.0-dev)."""

NOT_IMITATED = {
    *(
        30,
        31,
        82,
        83,
        84,
        85,
        92,
        94,
        112,
        114,
        115,
        179,
        181,
        182,
        183,
        184,
        188,
        189,
        191,
        193,
        194,
        195,
        197,
    ),
    *(201, 202, 203, 205, 206, 207, 208, 210, 211, 212, 213, 215, 216, 217, 218, 222, 223),
    *(531, 532, 534, 600, 601, 1000, 2000, 2001, 2500, 2501, 3000, 42600, 42702, 42703),
}


def item_of(command: int, params: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)) -> MissionItem:
    lat_e7, lon_e7 = to_e7(at(10, 5)) if command in STORED_WITH_PLACE else (0, 0)
    return MissionItem(command, 3, params, lat_e7, lon_e7)


def test_it_takes_what_the_source_takes_and_nothing_else():
    assert set(KEPT) == SOURCE
    taken = {
        command
        for command in range(65_536)
        if mission_item_result(item_of(command), 10) == MissionResult.ACCEPTED
    }
    assert taken == SOURCE
    assert mission_item_result(item_of(0), 10) == MissionResult.INVALID


def test_what_it_does_not_imitate_is_listed_here_and_in_the_documentation():
    assert set(NOT_DRIVEN) == NOT_IMITATED
    listed = DOC.read_text(encoding="utf-8").partition("## What it does not imitate")[2].partition("\n## ")[0]
    words = listed.replace(",", " ").replace(".", " ").replace(";", " ").replace(")", " ").split()
    assert {word for word in words if word.isdigit()} >= {str(command) for command in NOT_IMITATED}


MOWER = (181, 183, 203, 206, 211, 216, 218, 222, 600, 82)


@pytest.mark.parametrize("command", MOWER)
def test_commands_of_mowers_and_sprayers_are_stored_and_passed_over(command):
    bench = Bench(SimulatorConfig(streams=False))
    first, last = kept(waypoint(at(12, 0))), kept(waypoint(at(24, 0)))
    result, _ = bench.upload_mission([first, item_of(command), last])
    assert result == MissionResult.ACCEPTED
    assert bench.download()[2].command == command
    assert bench.download()[2].param1 == 1.0
    bench.start_auto()
    bench.run_until(lambda: distance_m(bench.vehicle.position, at(24, 0)) < 3.5, 60.0)
    assert bench.vehicle.mode == Mode.AUTO
    assert bench.vehicle.rover.mission_run.seq == 3


@pytest.mark.parametrize(
    ("command", "sent", "read"),
    [
        (181, (3.9, 1.0, 7.0, 8.0), (3.0, 1.0, 0.0, 0.0)),
        (183, (9.0, 1900.5, 7.0, 8.0), (9.0, 1900.0, 0.0, 0.0)),
        (206, (12.5, -1.0, 1.0, 8.0), (12.5, 0.0, 1.0, 0.0)),
        (218, (300.0, 2.0, 7.0, 8.0), (300.0, 2.0, 0.0, 0.0)),
        (222, (10.5, 1.5, 2.5, 3.5), (10.0, 1.5, 2.5, 3.5)),
        (601, (7.0, -1.0, 7.0, 8.0), (7.0, -1.0, 0.0, 0.0)),
        (31, (1.0, -20.7, 3.0, 1.0), (0.0, -20.0, 0.0, 1.0)),
        (94, (1.239, 2.0, 3.0, 4.0), (pytest.approx(1.23), 0.0, 0.0, 0.0)),
        (42702, (5.0, 9.0, 0.1, 2.0), (5.0, 9.0, 0.0999755859375, 2.0)),
        (42703, (5.0, 190.0, 30.9, 350.0), (5.0, 0.0, 30.0, 350.0)),
    ],
)
def test_what_is_kept_of_their_parameters(command, sent, read):
    assert kept_mission_item(item_of(command, sent)).params == read


def test_what_stands_in_the_place_of_a_place_is_kept_where_it_means_something_else():
    shot = replace(item_of(203), lat_e7=1, lon_e7=2, alt_m=3.0)
    assert kept_mission_item(shot) == replace(shot, frame=0, alt_m=0.0)
    relay = replace(item_of(181), lat_e7=1, lon_e7=2, alt_m=3.0)
    found = kept_mission_item(relay)
    assert (found.lat_e7, found.lon_e7, found.alt_m) == (0, 0, 0.0)


small = st.floats(0, 100, width=32)


@given(command=st.sampled_from(sorted(SOURCE)), params=st.tuples(small, small, small, small))
@settings(max_examples=300, deadline=None)
def test_the_uploading_side_knows_each_as_the_vehicle_keeps_it(command, params):
    item = item_of(command, params)
    stored = kept_mission_item(item)
    assert is_same_item(item, stored, MissionType.MISSION)
    assert kept_mission_item(stored) == stored
    assert all(math.isfinite(param) for param in stored.params)


odd = st.sampled_from([math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 4294967296.0, -1.0, 0.5])


@given(
    command=st.sampled_from([176, 192, 224, 300, 400, 178, 207, 410, 511, 512, 520]),
    params=st.tuples(odd, odd, odd, odd),
)
@settings(max_examples=150, deadline=None)
def test_commands_with_numbers_that_mean_nothing_are_answered(command, params):
    bench = Bench(SimulatorConfig(streams=False))
    answers = bench.ask(m.CommandLong(1, 1, command, 0, *params))
    answers += bench.ask(m.CommandInt(1, 1, 0, command, *params, 500_000_000, 100_000_000))
    bench.run(0.5)
    assert sum(isinstance(one, m.CommandAck) for one in answers) == 2
