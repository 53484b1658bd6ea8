from __future__ import annotations

import pytest

from missions.geo import LatLon
from missions.items import (
    Command,
    CoordinateFrame,
    MissionItem,
    last_place,
    waypoint,
    with_home,
    without_home,
)
from missions.situation import ListTransfer

HOME = LatLon(40.071374, -105.22993)
THERE = LatLon(40.0726316, -105.2290497)


def test_a_waypoint_is_rounded_to_deg_e7_at_altitude_0_above_home() -> None:
    item = waypoint(LatLon(40.07263164, -105.22904966))
    assert (item.command, item.frame, item.lat_e7, item.lon_e7) == (16, 6, 400726316, -1052290497)
    assert (item.params, item.alt_m, item.current, item.autocontinue) == ((0, 0, 0, 0), 0, False, True)
    assert item.position == THERE


def test_home_goes_on_and_off_at_seq_0() -> None:
    items = (waypoint(THERE), MissionItem(Command.DO_CHANGE_SPEED, params=(1, 2, 0, 0)))
    listed = with_home(items, HOME)
    assert (listed[0].position, listed[0].frame, listed[0].current) == (HOME, 0, True)
    assert listed[1:] == items
    assert without_home(listed) == items
    assert without_home(()) == ()


@pytest.mark.parametrize(
    "last",
    [
        MissionItem(Command.DO_JUMP, params=(1, -1, 0, 0)),
        MissionItem(Command.NAV_RETURN_TO_LAUNCH),
        MissionItem(Command.NAV_LOITER_UNLIM),  # at (0, 0): "here"
        MissionItem(Command.NAV_WAYPOINT, lat_e7=2**31 - 1, lon_e7=2**31 - 1),  # "not set"
        MissionItem(Command.NAV_WAYPOINT, lat_e7=910_000_000),
        MissionItem(Command.NAV_WAYPOINT, CoordinateFrame.LOCAL_NED, lat_e7=100_000, lon_e7=50_000),
        MissionItem(Command.NAV_WAYPOINT, CoordinateFrame.MISSION, lat_e7=1, lon_e7=2),
    ],
)
def test_the_last_place_passes_over_what_is_none(last: MissionItem) -> None:
    assert last_place([waypoint(HOME), waypoint(THERE), last]) == THERE
    assert last_place([last]) is None


@pytest.mark.parametrize("command", [16, 17, 18, 19])
def test_navigation_commands_are_places(command: int) -> None:
    assert last_place([MissionItem(command, lat_e7=400726316, lon_e7=-1052290497)]) == THERE


def test_transfers_tell_when_they_are_complete() -> None:
    a, b = waypoint(HOME), waypoint(THERE)
    assert not ListTransfer(True, None, {0: a}).is_complete
    assert not ListTransfer(True, 2, {0: a, 2: b}).is_complete
    whole = ListTransfer(False, 2, {1: b, 0: a})
    assert whole.is_complete
    assert whole.in_order() == (a, b)
    assert ListTransfer(False, 0, {}).is_complete
