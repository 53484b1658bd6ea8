"""The tables of autopilots: PX4's stored form against the simulated PX4 vehicle's own rules, its encoder, its modes, and who gets which table."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_bridge.mavlink.autopilots import ARDUPILOT, PX4_1_17, PX4_1_18, autopilot_of, autopilot_table
from mavlink_bridge.mavlink.messages import MissionResult, MissionType, ParamValue
from mavlink_bridge.mavlink.modes import ARDUPILOT_MODES, PX4_MODES, px4_mode
from mavlink_bridge.mavlink.parameter_values import encoded_parameter, parameter_value
from mavlink_bridge.mavlink.px4_form import px4_commands
from mavlink_bridge.mavlink.stored_form import differences, is_same_item
from mavlink_bridge.simulator.px4.lists import Px4List
from missions.errors import MissionFormatError
from missions.firmware import Firmware
from missions.geo import LatLon
from missions.items import Command, MissionItem, change_speed, waypoint

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
TABLES = {"1.17": PX4_1_17, "1.18": PX4_1_18}
COMMANDS = {
    MISSION: [16, 17, 19, 20, 21, 22, 31, 93, 112, 177, 178, 179, 189],
    FENCE: [5000, 5001, 5002, 5003, 5004],
    RALLY: [5100],
}
KINDS = st.sampled_from([MISSION, FENCE, RALLY])
SMALL = st.one_of(st.just(0.0), st.just(math.nan), st.floats(-400.0, 400.0, width=32))
E7 = st.one_of(st.sampled_from([0, 2**31 - 1, -(2**31)]), st.integers(-900_000_000, 900_000_000))


@st.composite
def lists_of_items(draw):
    kind = draw(KINDS)
    items = []
    for _ in range(draw(st.integers(1, 4))):
        command = draw(st.sampled_from(COMMANDS[kind]))
        vertices = draw(st.floats(3.0, 60.0, width=32))
        params = [draw(SMALL) for _ in range(4)]
        if command in (5001, 5002):
            params[0] = vertices
        items.append(
            MissionItem(
                command,
                draw(st.sampled_from([0, 3, 5, 6])),
                tuple(params),
                draw(E7),
                draw(E7),
                draw(SMALL),
                autocontinue=draw(st.booleans()),
            )
        )
    return kind, items


def stored(kind, items, table):
    """Store a list in the simulated PX4's rules; return what reads back, or the first refusal."""
    held = Px4List(kind, checks_unused=table is PX4_1_18)
    held.begin()
    for item in items:
        result = held.take(item, current=int(item.current))
        if result is not MissionResult.ACCEPTED:
            return result
    held.finish()
    return held.items


@pytest.mark.parametrize("version", TABLES)
@given(lists_of_items())
def test_what_is_prepared_is_taken_and_reads_back_as_foreseen(version, drawn):
    kind, items = drawn
    form = TABLES[version].lists.form
    prepared = form.prepared(items, kind)
    held = stored(kind, prepared, TABLES[version])
    assert not isinstance(held, MissionResult), held
    assert differences(prepared, held, kind, form) == ()
    assert form.prepared(prepared, kind) == prepared or any(
        math.isnan(value) for item in prepared for value in (*item.params, item.alt_m)
    )
    assert differences(form.prepared(held, kind), held, kind, form) == ()  # so a backup can be put back


@pytest.mark.parametrize("version", TABLES)
@given(lists_of_items(), lists_of_items())
def test_two_lists_are_the_same_where_the_vehicle_keeps_the_same(version, drawn, other):
    kind, items = drawn
    if other[0] is not kind:
        return
    form = TABLES[version].lists.form
    one, two = form.prepared(items, kind), form.prepared(other[1], kind)
    held = stored(kind, two, TABLES[version])
    is_same = repr([replace(item, current=False) for item in held]) == repr(
        [replace(item, current=False) for item in stored(kind, one, TABLES[version])]
    )
    if not is_same:
        near = len(one) == len(two) and all(
            a.fixed == b.fixed and a.place == b.place
            for a, b in ((form.stored(x, kind), form.stored(y, kind)) for x, y in zip(one, two, strict=True))
        )
        assert near or differences(one, held, kind, form)


@pytest.mark.parametrize(
    "change",
    [
        {"params": (1.0, 2.0, 0.0, 30.0)},
        {"params": (0.0, 2.5, 0.0, 30.0)},
        {"params": (0.0, 2.0, 0.0, 30.01)},
        {"params": (0.0, 2.0, 0.0, math.nan)},
        {"lat_e7": 400_000_001},
        {"alt_m": 0.01},
        {"frame": 0},
        {"autocontinue": False},
        {"command": 19},
    ],
    ids=str,
)
def test_what_the_vehicle_keeps_makes_a_difference(change):
    item = MissionItem(16, 6, (0.0, 2.0, 0.0, 30.0), 400_000_000, -1_050_000_000)
    assert not is_same_item(item, replace(item, **change), MISSION, PX4_1_18.lists.form)


@pytest.mark.parametrize(
    "change",
    [{"params": (0.0, 2.0, 5.0, 30.0)}, {"params": (0.0, 2.0, 0.0, 390.0)}, {"current": True}, {"frame": 3}],
)
def test_what_it_does_not_keep_makes_none(change):
    item = MissionItem(16, 6, (0.0, 2.0, 0.0, 30.0), 400_000_000, -1_050_000_000)
    assert is_same_item(item, replace(item, **change), MISSION, PX4_1_18.lists.form)


def test_places_of_frame_2_are_compared_as_the_floats_they_come_back_as():
    item = MissionItem(179, 2, (0.0, 0.0, 0.0, 0.0), 400_713_740, 2**31 - 1)
    form = PX4_1_17.lists.form
    assert is_same_item(item, replace(item, lat_e7=400_713_728, lon_e7=-(2**31)), MISSION, form)
    assert not is_same_item(item, replace(item, lat_e7=400_713_800), MISSION, form)


def test_condition_delay_is_delay_only_since_1_18():
    wanted, found = (MissionItem(command, 2, (3.0, 0.0, 0.0, 0.0)) for command in (112, 93))
    assert is_same_item(wanted, found, MISSION, PX4_1_18.lists.form)
    assert not is_same_item(wanted, found, MISSION, PX4_1_17.lists.form)


def test_the_first_item_of_a_mission_is_the_current_one_and_circles_come_last():
    form = PX4_1_17.lists.form
    prepared = form.prepared(
        [change_speed(1.0), replace(waypoint(LatLon(40.0, -105.0)), current=True)], MISSION
    )
    assert [item.current for item in prepared] == [True, False]
    circle = MissionItem(Command.FENCE_CIRCLE_EXCLUSION, 0, (5.0, 0, 0, 0), 1, 1)
    corners = [
        MissionItem(Command.FENCE_POLYGON_VERTEX_INCLUSION, 0, (3.0, 0, 0, 0), n, n) for n in (2, 3, 4)
    ]
    arranged = form.prepared([circle, *corners, circle], FENCE)
    assert [item.lat_e7 for item in arranged] == [2, 3, 4, 1, 1]
    assert ARDUPILOT.lists.form.prepared([circle, *corners], FENCE) == (circle, *corners)


def test_every_command_of_the_table_is_one_that_the_simulated_vehicle_takes():
    for command, row in px4_commands().items():
        item = MissionItem(command, 6 if row.has_place else 2, (0.0,) * 4, 1, 1)
        held = stored(MISSION, PX4_1_17.lists.form.prepared([item], MISSION), PX4_1_17)
        assert not isinstance(held, MissionResult), command


class TestModes:
    @pytest.mark.parametrize("number", [4, 10, 11, 15, 0, 1, px4_mode(4, 3) | 1, px4_mode(1, 3), px4_mode(9)])
    def test_a_number_that_is_no_px4_mode_is_never_made_a_command(self, number):
        with pytest.raises(ValueError, match=f"{number} is not a mode of this autopilot"):
            PX4_MODES.command_params(number)

    @pytest.mark.parametrize("number", [px4_mode(4, 3), px4_mode(4, 4), px4_mode(1), 2, 99, -1])
    def test_nor_one_that_is_no_ardupilot_mode(self, number):
        with pytest.raises(ValueError, match="is not a mode of this autopilot"):
            ARDUPILOT_MODES.command_params(number)

    def test_hold_and_mission(self):
        assert PX4_MODES.command_params(PX4_MODES.hold) == (1.0, 4.0, 3.0)
        assert PX4_MODES.command_params(PX4_MODES.mission) == (1.0, 4.0, 4.0)
        assert ARDUPILOT_MODES.command_params(ARDUPILOT_MODES.hold) == (1.0, 4.0, 0.0)
        assert PX4_MODES.named(PX4_MODES.hold) == "AUTO.LOITER"
        assert ARDUPILOT_MODES.named(ARDUPILOT_MODES.mission) == "AUTO"


@pytest.mark.parametrize(
    ("autopilot", "firmware", "table"),
    [
        (3, None, ARDUPILOT),
        (12, Firmware(1, 17, 0), PX4_1_17),
        (12, Firmware(1, 17, 2), PX4_1_17),
        (12, Firmware(1, 18, 0, 0), PX4_1_18),
        (12, None, PX4_1_18),
        (0, None, None),
        (None, None, None),
    ],
)
def test_which_table(autopilot, firmware, table):
    assert autopilot_table(autopilot, firmware) is table


def test_where_only_little_is_known():
    assert autopilot_of(ardupilot=None) is autopilot_of(ardupilot=True) is ARDUPILOT
    assert autopilot_of(ardupilot=False) is PX4_1_18
    assert ARDUPILOT.remark(None) is None
    assert PX4_1_17.remark(Firmware(1, 17, 0)) is None
    assert PX4_1_17.remark(Firmware(1, 16, 1)) == (
        "the vehicle reports version 1.16.1, which was not measured: it is treated as PX4 1.17"
    )
    assert PX4_1_18.remark(None) == "the vehicle does not report its version: it is treated as PX4 1.18"
    assert str(PX4_1_18) == "PX4 1.18"


class TestParameters:
    @given(st.integers(-(2**31), 2**31 - 1).filter(lambda n: not 0x7F800000 < n & 0x7FFFFFFF < 0x7FC00000))
    def test_whole_numbers_by_their_bits(self, value):
        sent, kind = encoded_parameter(float(value), 6, bytewise=True)
        assert kind == 6
        assert parameter_value(ParamValue("A", sent, kind, 1, 0), bytewise=True) == value

    @pytest.mark.parametrize("value", [2.5, 2.0**31, math.nan, math.inf])
    def test_what_is_none_is_refused_before_it_is_sent(self, value):
        with pytest.raises(MissionFormatError, match="is not a whole number of this parameter's type"):
            encoded_parameter(value, 6, bytewise=True)

    def test_others_go_as_they_are(self):
        assert encoded_parameter(2.5, 9, bytewise=True) == (2.5, 9)
        assert encoded_parameter(2.0, 6, bytewise=False) == (2.0, 9)
