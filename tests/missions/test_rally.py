"""Rally points and their altitudes."""

from __future__ import annotations

import copy
import pickle

import pytest

from missions.geo import LatLon
from missions.items import Command, MissionItem
from missions.rally import RallyPoint, rally_from_items, rally_to_items

PLACE = RallyPoint(40.0714, -105.2299, 12.5)


def test_a_rally_point_is_a_place_with_an_altitude():
    assert (PLACE.lat_deg, PLACE.lon_deg, PLACE.alt_m) == (40.0714, -105.2299, 12.5)
    assert PLACE.position == LatLon(40.0714, -105.2299)
    assert RallyPoint(40.0714, -105.2299, 12.5) == PLACE
    assert RallyPoint(40.0714, -105.2299) == RallyPoint(40.0714, -105.2299, 0.0)


@pytest.mark.parametrize(
    "other", [RallyPoint(40.0714, -105.2299, 12.0), LatLon(40.0714, -105.2299), "x", None]
)
def test_another_altitude_is_another_rally_point(other):
    assert other != PLACE
    assert not other == PLACE  # noqa: SIM201 - each of the two is written out


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda point: pickle.loads(pickle.dumps(point))]
)
def test_a_copy_keeps_the_altitude(copied):
    assert copied(PLACE) == PLACE
    assert copied(PLACE).alt_m == 12.5


def test_items_carry_place_and_altitude():
    (item,) = rally_to_items([PLACE])
    assert (item.command, item.frame, item.lat_e7, item.lon_e7, item.alt_m) == (
        5100,
        3,
        400714000,
        -1052299000,
        12.5,
    )
    assert rally_from_items([item]) == (PLACE,)


def test_an_altitude_above_the_sea_is_left_out():
    item = MissionItem(Command.RALLY_POINT, 0, lat_e7=1, lon_e7=2, alt_m=1600.0)
    assert rally_from_items([item])[0].alt_m == 0.0
