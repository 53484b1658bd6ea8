from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from missions.firmware import Firmware
from missions.formats import read_situation
from missions.geo import LatLon
from missions.picture.plans import plan_scene
from missions.planning.plan import plan
from missions.request import Request

if TYPE_CHECKING:
    from pathlib import Path

    from missions.picture.scene import PictureScene
    from missions.planned import Plan

START = LatLon(40.071374, -105.22993)
REQUESTS = {
    "maze": Request(start=START, targets=(LatLon(40.0726316, -105.2290497),), clearance_m=2.0),
    "yard": Request(
        start=START,
        targets=(LatLon(40.07209265, -105.22861524), LatLon(40.0720, -105.2300)),
        clearance_m=2.0,
    ),
    "union": Request(start=START, targets=(LatLon(40.0721, -105.2285),), clearance_m=1.0),
}


@pytest.fixture(scope="session")
def plans(fields: Path) -> dict[str, Plan]:
    """A plan in each of three fields."""
    made = {}
    for name, request in REQUESTS.items():
        situation = read_situation(fields / f"{name}-fence.waypoints")
        parameters = {"WP_RADIUS": 2.0, "WP_SPEED": 4.0, "FENCE_OPTIONS": 2.0 if name == "union" else 0.0}
        made[name] = plan(replace(situation, parameters=parameters, firmware=Firmware(4, 6)), request)
    return made


@pytest.fixture(params=REQUESTS)
def any_plan(request: pytest.FixtureRequest, plans: dict[str, Plan]) -> Plan:
    return plans[request.param]


@pytest.fixture
def scene(any_plan: Plan) -> PictureScene:
    return plan_scene(any_plan)
