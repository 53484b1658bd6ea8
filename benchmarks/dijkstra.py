"""Predicted times against the vehicle's own Dijkstra (OA_TYPE 2), measured on a real ArduPilot Rover of October 2025.

``python benchmarks/dijkstra.py``. Fields, vehicle and its times are in ``benchmarks/data/dijkstra/dijkstra.json``: steered, 5 m/s, WP_RADIUS 3, FENCE_MARGIN 2, avoidance on.
Our mission keeps 2.0 m, is planned, and driven by the simulated rover. A field counts as comparable where the vehicle's own way arrived. The floor is
1.10 × (length / WP_SPEED + WP_SPEED / acceleration), which may be taken where it is over 0.77 of Dijkstra's time; else 0.85 of that is wanted.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from drive import VEHICLES, drive_plan, parameters_of, situation_of
from drive_fields import Field

from missions.firmware import Firmware
from missions.formats import read_fence
from missions.geo import LatLon
from missions.planning.plan import plan
from missions.request import GoTo

DATA = Path(__file__).parent / "data" / "dijkstra"
CLEARANCE_M, MOST_SHARE, FLOOR_SHARE, FLOOR_FROM = 2.0, 0.85, 1.10, 0.77
NAME = "steered, 5 m/s, WP_RADIUS 3"


def main() -> None:
    """Print the table."""
    print(
        "| field | Dijkstra, real | keeps | planned, predicted | driven (simulated) | keeps | predicted / Dijkstra | driven / Dijkstra | wanted | |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, case in json.loads((DATA / "dijkstra.json").read_text(encoding="utf-8")).items():
        if not name.startswith("_") and case.get("dijkstra", {}).get("outcome") == "arrived":
            print(_row(name, case))


def _row(name: str, case: dict[str, dict[str, float]]) -> str:
    fence = read_fence(DATA / str(case["fence"]))
    start, target = (LatLon(*case[end]) for end in ("start", "target"))  # type: ignore[misc]
    field = Field(0, name, fence, start, float(case["heading_deg"]), target, CLEARANCE_M)  # type: ignore[arg-type]
    parameters = {**parameters_of(field, NAME), "FENCE_MARGIN": 2.0}
    planned = plan(situation_of(field, parameters), GoTo(target=target, clearance_m=CLEARANCE_M))
    driven_s, rover, arrived = drive_plan(field, planned, parameters, Firmware(4, 6))
    dijkstra = case["dijkstra"]
    speed_mps = VEHICLES[NAME]["WP_SPEED"]
    floor_s = FLOOR_SHARE * (planned.length_m / speed_mps + speed_mps / parameters["ATC_ACCEL_MAX"])
    wanted_s = MOST_SHARE * dijkstra["time_s"]
    if floor_s > FLOOR_FROM * dijkstra["time_s"]:
        wanted_s = max(wanted_s, floor_s)
    driven = f"{driven_s:.1f} s" if arrived else "not arrived"
    met = "met" if arrived and max(driven_s, planned.duration_s) <= wanted_s else "not met"
    return (
        f"| {name} | {dijkstra['time_s']:.1f} s | {dijkstra['clearance_m']:.2f} m | {planned.duration_s:.1f} s | {driven} | {rover.least_clearance_m:.2f} m "
        f"| {planned.duration_s / dijkstra['time_s']:.2f} | {driven_s / dijkstra['time_s']:.2f} | {wanted_s:.1f} s | {met} |"
    )


if __name__ == "__main__":
    main()
