"""Lists compared in the form the autopilot stores; the simulator's own rules are the second opinion."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from protocol.twin import Vehicle, plain_fence, plain_mission

from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.mavlink.stored_form import Difference, differences, is_same_item, is_unfinished_write
from missions.items import MissionItem

MISSION, FENCE, RALLY = MissionType.MISSION, MissionType.FENCE, MissionType.RALLY
SMALL = st.floats(0.0, 250.0, width=32)
SIGNED = st.floats(-3000.0, 3000.0, width=32)
LOITERS = [17, 18, 19]
COMMANDS = [16, 17, 18, 19, 20, 21, 22, 92, 93, 112, 114, 178, 179, 194, 207, 213]


ANY = st.floats(width=32)


@given(
    st.sampled_from([MISSION, FENCE, RALLY]),
    st.sampled_from([*COMMANDS, 5000, 5001, 5003, 5100, 31000]),
    st.tuples(ANY, ANY, ANY, ANY),
    ANY,
    st.booleans(),
)
def test_every_item_is_the_same_as_itself(kind, command, params, alt_m, coarse):
    def anew():
        return MissionItem(
            command, 3, tuple(float(repr(param)) for param in params), 5, 6, float(repr(alt_m))
        )

    assert is_same_item(anew(), anew(), kind, coarse=coarse)
    assert differences([anew()] * 2, [anew()] * 2, kind) == ()


@pytest.mark.parametrize(
    ("a_m", "b_m", "is_same"),
    [
        (float("inf"), float("inf"), True),
        (float("-inf"), float("inf"), False),
        (float("nan"), 5.0, False),
        (5.0, float("inf"), False),
    ],
)
def test_altitudes_that_are_no_numbers_are_equal_only_to_themselves(a_m, b_m, is_same):
    item = MissionItem(16, 3, (0.0, float("nan"), 0.0, 0.0), 5, 6)
    assert is_same_item(replace(item, alt_m=a_m), replace(item, alt_m=b_m), MISSION) is is_same
    assert is_same_item(replace(item, alt_m=b_m), replace(item, alt_m=a_m), MISSION) is is_same


@given(
    st.sampled_from(COMMANDS),
    st.sampled_from([0, 2, 3, 5, 6, 10, 11]),
    st.tuples(SMALL, SMALL, SIGNED, SIGNED),
    st.integers(-900000000, 900000000),
    st.integers(-1800000000, 1800000000),
    st.floats(-1000.0, 8000.0, width=32),
)
@example(93, 0, (0.0, 0.0, 0.0, 1536.0), 0, 0, 0.0)
def test_what_the_vehicle_stores_is_the_same_item(command, frame, params, lat_e7, lon_e7, alt_m):
    if command not in LOITERS:  # others keep some of these in a byte
        params = (*params[:2], abs(params[2]) / 12, abs(params[3]) / 12)
    if command == 93:  # NAV_DELAY keeps hour, minute and second in signed ones
        params = (params[0], *(min(127.0, abs(value)) for value in params[1:]))
    item = MissionItem(command, frame, params, lat_e7, lon_e7, alt_m)
    stored = Vehicle().lists[MISSION]
    stored.begin(1)
    assert stored.write(1, item, 2) == MissionResult.ACCEPTED
    assert is_same_item(item, stored.read(1), MISSION)


@given(st.integers(0, 6), st.integers(1, 10**6))
def test_another_value_is_another_item(field, change):
    item = MissionItem(16, 6, (4.0, 0, 0, 0), 400713740, -1052299300, 10.0)
    other = [
        replace(item, lat_e7=item.lat_e7 + change),
        replace(item, lon_e7=item.lon_e7 - change),
        replace(item, alt_m=item.alt_m + 0.02 * change),
        replace(item, params=(4.0 + change, 0, 0, 0)),
        replace(item, command=17),
        replace(item, frame=5),
        replace(item, frame=11),
    ][field]
    assert not is_same_item(item, other, MISSION)


@pytest.mark.parametrize(
    ("a", "b", "same"),
    [
        (MissionItem(16, params=(2.9, 7, 8, 9)), MissionItem(16, 3, params=(2.0, 0, 0, 0)), True),
        (MissionItem(16, params=(0, 0, 0, float("nan"))), MissionItem(16, 3), True),
        (MissionItem(19, params=(5, 0, 0, 0)), MissionItem(19, 3, params=(5, 0, 1, 0)), True),
        (MissionItem(19, params=(5, 0, -2, 0)), MissionItem(19, 3, params=(5, 0, 1, 0)), False),
        (MissionItem(17, params=(0, 0, -7.9, 0)), MissionItem(17, 3, (0, 0, -7.0, 0)), True),
        (MissionItem(17, params=(0, 0, -7.0, 0)), MissionItem(17, 3, (0, 0, 7.0, 0)), False),
        (MissionItem(18, params=(0.7, 0, 304.0, 2)), MissionItem(18, 3, (0.69921875, 0, 300.0, 1)), True),
        (MissionItem(18, params=(0.7, 0, 9.0, 0)), MissionItem(18, 3, (0.5, 0, 9.0, 0)), False),
        (MissionItem(18, params=(2.7, 0, -9.0, 0)), MissionItem(18, 3, (2.0, 0, -9.0, 0)), True),
        (MissionItem(21, params=(0, 0, 0, -3)), MissionItem(21, 3, (0, 0, 0, -1)), True),
        (MissionItem(178, 6, (1, 3.3, 0, 0), 5, 6), MissionItem(178, 0, (1, 3.299999952316284, 0, 0)), True),
        (MissionItem(178, 6, (1, 3.3, 0, 0)), MissionItem(178, 0, (1, 3.31, 0, 0)), False),
        (
            MissionItem(31000, params=(0.1, 0, 0, 0)),
            MissionItem(31000, 3, (0.10000000149011612, 0, 0, 0)),
            True,
        ),
        (MissionItem(31000, params=(0.1, 0, 0, 0)), MissionItem(31000, 3, (0.2, 0, 0, 0)), False),
        (MissionItem(31000, params=(1e300, 0, 0, 0)), MissionItem(31000, 3, (float("inf"), 0, 0, 0)), True),
        (MissionItem(183, 6, (9, 1500, 0, 0), 4, 5, 6.0), MissionItem(183, 0, (9, 1500, 0, 0)), True),
        (MissionItem(183, 6, (9, 1500, 0, 0)), MissionItem(183, 0, (9, 1501, 0, 0)), False),
        (MissionItem(203, 0, lat_e7=1, lon_e7=2), MissionItem(203, 6, lat_e7=1, lon_e7=2), True),
        (MissionItem(203, 0, lat_e7=1, lon_e7=2), MissionItem(203, 0, lat_e7=1, lon_e7=3), False),
        (MissionItem(201, 6, lat_e7=1), MissionItem(201, 3), False),
        (MissionItem(16, params=(float("inf"), 0, 0, 0)), MissionItem(16), False),
        (MissionItem(16, alt_m=1.239), MissionItem(16, 3, alt_m=1.23), True),
        (MissionItem(16, current=True, autocontinue=False), MissionItem(16), True),
    ],
)
def test_stored_forms(a, b, same):
    assert is_same_item(a, b, MISSION) is same
    assert is_same_item(b, a, MISSION) is same


@pytest.mark.parametrize(
    ("a", "b", "same"),
    [
        (MissionItem(5001, 6, (4.9, 2, 3, 4), alt_m=7), MissionItem(5001, 0, (4.0, 0, 0, 0)), True),
        (MissionItem(5003, 0, (10.1, 0, 0, 0)), MissionItem(5003, 0, (10.100000381469727, 0, 0, 0)), True),
        (MissionItem(5003, 0, (10.1, 0, 0, 0)), MissionItem(5003, 0, (10.2, 0, 0, 0)), False),
        (MissionItem(5001, 0, (4, 0, 0, 0)), MissionItem(5002, 0, (4, 0, 0, 0)), False),
        (MissionItem(5000, 0, (4, 0, 0, 0)), MissionItem(5000, 0), True),
    ],
)
def test_stored_forms_of_fences(a, b, same):
    assert is_same_item(a, b, FENCE) is same


def test_rally_points_keep_whole_metres():
    point = MissionItem(5100, 6, (1, 2, 3, 4), 1, 2, 10.7)
    assert is_same_item(point, MissionItem(5100, 3, lat_e7=1, lon_e7=2, alt_m=10.0), RALLY)
    assert not is_same_item(point, MissionItem(5100, 3, lat_e7=1, lon_e7=2, alt_m=11.0), RALLY)


def test_coarse_positions_are_compared_as_floats_carry_them():
    exact = MissionItem(16, 3, lat_e7=400713741, lon_e7=-1052299301)
    coarse = MissionItem(16, 3, lat_e7=400713730, lon_e7=-1052299270)
    assert not is_same_item(exact, coarse, MISSION)
    assert is_same_item(exact, coarse, MISSION, coarse=True)
    assert not is_same_item(exact, replace(coarse, lat_e7=400714730), MISSION, coarse=True)


def test_differences_leave_home_out_and_name_the_ends():
    wanted, found = plain_mission(4), plain_mission(3)
    found[0] = replace(found[0], lat_e7=0)
    [missing] = differences(wanted, found, MISSION)
    assert (missing.seq, missing.found) == (3, None)
    [extra] = differences(found, wanted, MISSION)
    assert (extra.seq, extra.wanted) == (3, None)
    assert differences(wanted[:1], [], MISSION) == ()
    assert len(differences(plain_fence(1), [], FENCE)) == 4


def test_differences_speak():
    a, b = MissionItem(16, 3, lat_e7=10000000), MissionItem(16, 3, lat_e7=20000000)
    assert str(Difference(3, a, None)) == "item 3 is missing"
    assert str(Difference(3, None, a)) == "item 3 should not be there"
    assert "item 3 is command 16 (0, 0, 0, 0) at 2.0000000,0.0000000" in str(Difference(3, a, b))


@pytest.mark.parametrize("old_count", [1, 2, 12, 30])
@pytest.mark.parametrize("written", [0, 1, 2, 11, 12, 13, 19])
def test_an_abandoned_upload_is_known_by_what_it_leaves(old_count, written):
    vehicle = Vehicle()
    old, new = plain_mission(old_count, salt=1), plain_mission(20)
    vehicle.hold(MISSION, old)
    stored = vehicle.lists[MISSION]
    stored.begin(20)
    for seq in range(written):
        stored.write(seq, new[seq], 20)
    assert is_unfinished_write(vehicle.held(MISSION), old, new, MISSION)


def test_a_foreign_list_is_no_unfinished_write():
    old, new, foreign = plain_mission(12, 1), plain_mission(20), plain_mission(15, 7)
    assert not is_unfinished_write(foreign, old, new, MISSION)
    assert not is_unfinished_write([], old, new, MISSION)
    assert not is_unfinished_write(new + new, old, new, MISSION)
    assert not is_unfinished_write([*new[:5], foreign[5], *new[6:]], old, new, MISSION)
