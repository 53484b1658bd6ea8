"""What a plan tells of itself."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from missions.formats import read_situation
from missions.geo import LatLon
from missions.planning.plan import plan
from missions.request import Request

if TYPE_CHECKING:
    from pathlib import Path

START = LatLon(40.071374, -105.22993)


@pytest.mark.parametrize(
    ("metres_north_east", "turns"),
    [
        ([(0, 0), (10, 0)], 0),
        ([(0, 0), (10, 0), (20, 0)], 0),  # a long line in pieces
        ([(0, 0), (10, 0), (10, 10)], 1),
        ([(0, 0), (10, 0), (10, 0), (10, 10), (0, 10)], 2),  # one place twice
        ([(0, 0), (10, 0), (0, 0)], 1),
        ([(0, 0), (10, 5), (20, 0), (30, 5)], 2),
    ],
)
def test_turns_are_counted_where_the_lines_bend(fields: Path, metres_north_east, turns) -> None:
    made = plan(
        read_situation(fields / "yard-fence.waypoints"),
        Request(start=START, targets=(LatLon(40.0716, -105.2300),), clearance_m=1.0),
    )
    path = tuple(
        LatLon(START.lat_deg + north_m / 111_000, START.lon_deg + east_m / 85_000)
        for north_m, east_m in metres_north_east
    )
    assert replace(made, path=path).turn_count == turns
