"""Whether missions planned for a PX4 rover are driven as promised: the fields of `drive.py`, the simulated PX4 rover, in stepped time.

``python benchmarks/drive_px4.py [--firmware VERSION] [--fields N] [--first SEED] [--jobs N] [--lines FILE]``. Each field is planned for steered wheels at 1, 2 and 3 m/s, and for skid steering, which was
not measured: it is planned with the drive model trusted, and counted apart. The simulated rover's law was written apart from the drive model. Each run is kept as a line of JSON
in the file that ``--lines`` names; started again with it, seeds that stand in it are not run again.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from typing import TYPE_CHECKING

from drive import Run, read_lines, situation_of
from drive_fields import make_field

from mavlink_bridge.mavlink.messages import Autopilot
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.fence_watch import FenceArea
from mavlink_bridge.simulator.px4.rover import TICK_S
from mavlink_bridge.simulator.px4.vehicle import Px4Vehicle
from missions.errors import MissionError
from missions.fence import fence_to_items
from missions.firmware import Firmware
from missions.geo import distance_m
from missions.planning.plan import plan
from missions.request import GoTo

if TYPE_CHECKING:
    from drive_fields import Field

    from missions.planned import Plan

TOLERANCE_M = 0.15
STANDS_S = 60.0
FIRMWARES = {"1.17": Firmware(1, 17, 0), "1.18": Firmware(1, 18, 0, 0)}
AIRFRAME = {
    "CA_AIRFRAME": 5.0,
    "NAV_ACC_RAD": 0.5,
    "RA_ACC_RAD_GAIN": 2.0,
    "RA_ACC_RAD_MAX": 3.0,
    "RA_WHEEL_BASE": 0.321,
    "RA_MAX_STR_ANG": 0.5236,
    "RO_MAX_THR_SPEED": 3.2,
    "RO_ACCEL_LIM": 3.0,
    "RO_DECEL_LIM": 3.0,
    "RO_JERK_LIM": 10.0,
    "RO_SPEED_RED": 1.0,
    "RO_YAW_RATE_LIM": 180.0,
    "PP_LOOKAHD_GAIN": 1.0,
    "PP_LOOKAHD_MIN": 1.0,
    "PP_LOOKAHD_MAX": 10.0,
    "GF_ACTION": 2.0,
    "GF_MAX_HOR_DIST": 0.0,
}
"""Airframe 10045 of PX4's own simulation."""

VEHICLES = {
    "steered, 1 m/s": {"RO_SPEED_LIM": 1.0},
    "steered, 2 m/s": {"RO_SPEED_LIM": 2.0},
    "steered, 3 m/s": {"RO_SPEED_LIM": 3.0},
    "skid, 2 m/s (not measured)": {"RO_SPEED_LIM": 2.0, "CA_AIRFRAME": 6.0},
}


def runs_of(seed: int, firmware: Firmware) -> list[Run]:
    """Plan and drive one field with each vehicle."""
    field = make_field(seed)
    return [_run(field, name, AIRFRAME | changes, firmware) for name, changes in VEHICLES.items()]


def _run(field: Field, name: str, parameters: dict[str, float], firmware: Firmware) -> Run:
    begun_s = time.process_time()
    situation = situation_of(field, parameters, firmware)
    is_skid = parameters["CA_AIRFRAME"] == VEHICLES["skid, 2 m/s (not measured)"]["CA_AIRFRAME"]
    request = GoTo(target=field.target, clearance_m=field.clearance_m, trusts_model=is_skid)
    known = {"seed": field.seed, "kind": field.kind, "vehicle": name, "widest_m": math.nan}
    try:
        planned = plan(situation, request)
    except MissionError as error:
        found = Run(**known, promised_m=field.clearance_m, refusal=str(error))  # type: ignore[arg-type]
        return replace(found, cpu_s=time.process_time() - begun_s)
    if planned.clearance_m is None:
        found = Run(**known, promised_m=field.clearance_m, extrapolated=planned.extrapolated)  # type: ignore[arg-type]
        return replace(found, cpu_s=time.process_time() - begun_s)
    driven_s, driven_m, arrived = _drive(field, planned, parameters, firmware)
    return Run(
        **known,  # type: ignore[arg-type]
        promised_m=planned.clearance_m,
        leads_away_m=planned.start_clearance_m,
        extrapolated=planned.extrapolated,
        foreseen_m=planned.driven_clearance_m,
        driven_m=driven_m,
        foreseen_s=planned.duration_s,
        driven_s=driven_s,
        arrived=arrived,
        cpu_s=time.process_time() - begun_s,
    )


def _drive(
    field: Field, planned: Plan, parameters: dict[str, float], firmware: Firmware
) -> tuple[float, float, bool]:
    """Drive a plan to its end, or much longer than foreseen; return the time, the least clearance, and whether it arrived.

    The rover has no fence of its own: PX4 holds 64 items, and it would stop the rover where the promise is broken.
    """
    vehicle = Px4Vehicle(
        SimulatorConfig(
            autopilot=Autopilot.PX4,
            home=field.start,
            heading_deg=field.heading_deg,
            mission=planned.items,
            parameters=parameters,
            firmware=firmware,
            streams=False,
        )
    )
    rover = vehicle.rover
    area = FenceArea(fence_to_items(field.fence), rover.frame)
    rover.start_mission(0)
    now_s = 0.0
    limit_s = 3 * planned.duration_s + STANDS_S
    least_m = math.inf
    while now_s < limit_s and not (rover.progress.is_complete and rover.motion.speed_mps == 0):
        now_s += TICK_S
        rover.step(now_s)
        least_m = min(least_m, area.clearance_m(rover.motion.position_m))
    near = distance_m(rover.position, planned.targets[-1]) < 1.0
    return now_s, least_m, rover.progress.is_complete and near


def report(runs: list[Run]) -> str:
    """Return the table, and what did not end as it should."""
    lines = [
        f"{len({run.seed for run in runs})} fields, {len(runs)} runs, {sum(run.is_driven for run in runs)} of them driven; {sum(run.cpu_s for run in runs):.0f} s of CPU.",
        "",
        "| | routes | refused | promises nothing | least driven − promised, least / median | short by > 0.15 m | not arrived | predicted / driven time, median |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in VEHICLES:
        mine = [run for run in runs if run.vehicle == name]
        driven = [run for run in mine if run.is_driven]
        more_m = [-run.short_m for run in driven] or [math.nan]
        times = [run.foreseen_s / run.driven_s for run in driven] or [math.nan]
        lines.append(
            f"| {name} | {len(driven)} of {len(mine)} | {sum(run.refusal is not None for run in mine)} | {sum(run.refusal is None and not run.is_driven for run in mine)} "
            f"| {min(more_m):+.2f} / {statistics.median(more_m):+.2f} m | {sum(run.short_m > TOLERANCE_M for run in driven)} | {sum(not run.arrived for run in driven)} "
            f"| {statistics.median(times):.2f} |"
        )
    amiss = [run for run in runs if run.is_driven and (run.short_m > TOLERANCE_M or not run.arrived)]
    lines += ["", "Short of the promise, or not arrived:", ""]
    lines += [
        f"- {run.kind} {run.seed}, {run.vehicle}: promised {run.promised_m:g} m, foreseen {run.foreseen_m:.2f} m, driven {run.driven_m:.2f} m, {'arrived' if run.arrived else 'not arrived'}"
        for run in amiss
    ] or ["- none"]
    return "\n".join(lines)


def main() -> None:
    """Run the benchmark and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--firmware", choices=FIRMWARES, default="1.18")
    parser.add_argument("--fields", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lines", type=Path)
    options = parser.parse_args()
    runs = read_lines(options.lines)
    done = {run.seed for run in runs}
    seeds = [seed for seed in range(options.first, options.first + options.fields) if seed not in done]
    with ProcessPoolExecutor(options.jobs) as pool:
        for found in pool.map(partial(runs_of, firmware=FIRMWARES[options.firmware]), seeds):
            runs += found
            if options.lines:
                with options.lines.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(asdict(run)) + "\n" for run in found)
    print(f"PX4 {options.firmware}: {report(runs)}")


if __name__ == "__main__":
    main()
