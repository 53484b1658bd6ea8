"""Numbers that a vehicle tells do not fill the screen, whatever they are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from missions.checking.recheck import straight_line
from missions.errors import FenceError, MissionError
from missions.fence import fence_from_items
from missions.firmware import Firmware
from missions.formats import read_fence
from missions.geo import LatLon
from missions.items import Command, MissionItem
from missions.planning.plan import plan
from missions.request import Request
from missions.situation import Known, Pose, Situation
from missions.words import metres

HOME, FAR = LatLon(40.071374, -105.229930), LatLon(40.0720926, -105.2286152)
FENCE = read_fence(Path(__file__).parents[1] / "fields" / "yard-fence.waypoints")


@pytest.mark.parametrize(
    ("value_m", "text"),
    [(2.0, "2.00 m"), (-0.126, "-0.13 m"), (1e8, "1e+08 m"), (3.4e38, "3.4e+38 m"), (float("inf"), "inf m")],
)
def test_metres(value_m, text):
    assert metres(value_m) == text


@pytest.mark.parametrize("margin_m", [3.4e38, 1e30, 1e15])
def test_a_margin_beyond_all_measure_is_refused_shortly(margin_m):
    parameters = {"FENCE_ENABLE": 1.0, "AVOID_ENABLE": 3.0, "FENCE_MARGIN": margin_m}
    situation = Situation(
        fence=Known(FENCE, 0.0, "test"),
        pose=Known(Pose(HOME), 0.0, "test"),
        parameters=parameters,
        firmware=Firmware(4, 6),
    )
    with pytest.raises(MissionError, match=r"FENCE_MARGIN is \S+; possible are 0 to 1000") as refusal:
        plan(situation, Request(targets=(FAR,)))
    assert not re.search(r"\d{10}", str(refusal.value))
    assert len(str(refusal.value)) < 200
    found = straight_line(situation, Request(), FAR)
    assert found is None or len(f"{metres(found.asked_m)}") < 16


@pytest.mark.parametrize("count", [3.4e38, 1e15, 84.0])
def test_a_polygon_of_more_vertices_than_there_are_is_refused_shortly(count):
    vertex = MissionItem(Command.FENCE_POLYGON_VERTEX_INCLUSION, 0, (count, 0.0, 0.0, 0.0), 400_000_000, 10)
    with pytest.raises(FenceError, match=r"has only 0 of them|has only 3 of them") as refusal:
        fence_from_items([vertex] * 3)
    assert not re.search(r"\d{10}", str(refusal.value))
