"""Draw the pictures of this folder from the fields of the tests: ``python docs/pictures/draw.py``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from missions.firmware import Firmware
from missions.formats import read_situation
from missions.geo import LatLon
from missions.picture import draw_plan
from missions.planning.plan import plan
from missions.request import GoTo, Tour

HERE = Path(__file__).parent
FIELDS = HERE.parents[1] / "tests" / "fields"
START = LatLon(40.071374, -105.22993)
REQUESTS = {
    "maze": GoTo(start=START, target=LatLon(40.0726316, -105.2290497), clearance_m=2.0),
    "yard": Tour(
        start=START, targets=(LatLon(40.07209265, -105.22861524), LatLon(40.0720, -105.2300)), clearance_m=2.0
    ),
    "union": GoTo(start=START, target=LatLon(40.0721, -105.2285), clearance_m=1.0),
}

for name, request in REQUESTS.items():
    situation = read_situation(FIELDS / f"{name}-fence.waypoints")
    parameters = {"WP_RADIUS": 2.0, "WP_SPEED": 4.0, "FENCE_OPTIONS": 2.0 if name == "union" else 0.0}
    draw_plan(
        plan(replace(situation, parameters=parameters, firmware=Firmware(4, 6)), request),
        HERE / f"{name}.png",
    )
