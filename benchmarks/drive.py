"""Whether planned missions are driven as promised: seeded fields, three vehicles, the simulator's drive law in stepped time.

``python benchmarks/drive.py [--fields N] [--first SEED] [--kinds usual|more|table] [--firmware VERSION] [--jobs N] [--lines FILE] [-o FILE]``. Each run plans a mission, hands
its items to the simulated rover, drives it in AUTO with the fence enabled, and measures the true track against the fence. ``--lines`` keeps each run as a line of
JSON; started again with that file, seeds that stand in it are not run again. ``python benchmarks/drive.py --page usual.jsonl more.jsonl table.jsonl -o FILE`` makes the
page from what was kept (each is named by its kinds).
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import math
import platform
import re
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from typing import TYPE_CHECKING

from drive_fields import Field, make_field
from drive_more_fields import make_more
from drive_table import make_case

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.rover import TICK_S
from mavlink_bridge.simulator.vehicle import SimulatedVehicle
from missions.drive_model import beyond_measured
from missions.errors import MissionError
from missions.fence import fence_to_items
from missions.firmware import Firmware, read_firmware
from missions.geo import distance_m
from missions.ground.from_situation import route_ground
from missions.planning.plan import plan
from missions.promise import promise
from missions.request import GoTo
from missions.routing.bottleneck import widest_clearance_m
from missions.situation import Known, Pose, Situation
from missions.vehicle import vehicle_from_parameters

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.planned import Plan

TOLERANCE_M = 0.10
SPARE_M = 0.5
STANDS_S, STANDS_M = 60.0, 0.05
"""A rover that came no farther than this in so long, in AUTO, is stuck: the longest turn on the spot takes 3 s."""

VEHICLES: dict[str, dict[str, float]] = {
    "steered, 2 m/s, WP_RADIUS 2": {"WP_SPEED": 2.0, "WP_RADIUS": 2.0},
    "steered, 5 m/s, WP_RADIUS 3": {
        "WP_SPEED": 5.0,
        "WP_RADIUS": 3.0,
        "CRUISE_SPEED": 5.0,
        "CRUISE_THROTTLE": 30.0,
    },
    "skid, 2 m/s, WP_RADIUS 2": {
        "WP_SPEED": 2.0,
        "WP_RADIUS": 2.0,
        "SERVO1_FUNCTION": 73.0,
        "SERVO3_FUNCTION": 74.0,
        "ATC_STR_RAT_FF": 0.2,
        "CRUISE_SPEED": 3.0,
        "CRUISE_THROTTLE": 75.0,
    },
}
KINDS: dict[str, Callable[[int], Field]] = {"usual": make_field, "more": make_more}
_KNOWN = {
    "TURN_RADIUS": 0.9,
    "ATC_TURN_MAX_G": 0.6,
    "ATC_ACCEL_MAX": 1.0,
    "WP_PIVOT_ANGLE": 60.0,
    "SERVO1_FUNCTION": 26.0,
    "SERVO3_FUNCTION": 70.0,
    "FENCE_ENABLE": 1.0,
    "FENCE_TYPE": 4.0,
    "AVOID_ENABLE": 3.0,
    "BRD_SD_FENCE": 64.0,  # so that fences of many vertices fit into the storage
}


@dataclass(frozen=True)
class Run:
    """One field and one vehicle."""

    seed: int
    kind: str
    vehicle: str
    promised_m: float
    widest_m: float
    refusal: str | None = None
    extrapolated: tuple[str, ...] = ()
    planning_s: float = 0.0
    leads_away_m: float | None = None
    length_m: float = 0.0
    shortest_m: float = 0.0
    waypoints: int = 0
    slow: int = 0
    foreseen_s: float = 0.0
    foreseen_m: float = 0.0
    driven_m: float = 0.0
    driven_s: float = 0.0
    breaches: int = 0
    arrived: bool = False
    cpu_s: float = 0.0

    @property
    def is_driven(self) -> bool:
        """Whether it was driven."""
        return self.driven_s > 0

    @property
    def group(self) -> str:
        """Which row of the table it counts in."""
        if self.vehicle in VEHICLES:
            return self.vehicle
        return "extrapolated: promises nothing" if self.extrapolated else "inside what was measured"

    @property
    def short_m(self) -> float:
        """How much less than promised was kept."""
        return (self.promised_m if self.leads_away_m is None else self.leads_away_m) - self.driven_m

    @property
    def is_wide(self) -> bool:
        """Whether the widest route there is keeps clearly more than promised."""
        return self.widest_m >= self.promised_m + SPARE_M

    @property
    def is_amiss(self) -> bool:
        """Whether it was short of the promise, breached the fence or did not arrive."""
        return self.short_m > TOLERANCE_M or bool(self.breaches) or not self.arrived


TITLES = {
    "usual": "Usual fields",
    "more": "More kinds of fields",
    "table": "Vehicles over the whole table",
}
HEAD = """# Planned, and driven

`make bench-drive` plans 200 seeded fields for three vehicles, hands each mission to the simulated rover, drives it in AUTO with the fence
and the vehicle's avoidance on (`FENCE_MARGIN` is the promise less 0.1 m), and measures the true track against the fence. The fields
(`benchmarks/drive_fields.py`) are yards with buildings, circles, walls with gates and hairpins of 80 to 220 m; the promise is 1, 1.5, 2
or 3 m, the start faces any way. The rover's drive law ([simulator](simulator.md)) was written apart from the [drive model](drive-model.md)
that the plans rest on. `--first SEED` gives other fields of these kinds, `--kinds more` other kinds (starts near a fence, targets
behind the vehicle, short routes, corridors, zigzag walls, mazes, woods of small circles, gates hardly wider than need be).

`--kinds table` draws a vehicle for each field over the whole table of parameters (`benchmarks/drive_table.py`: 0.2 to 8 m/s, both steerings, radii, pivots,
margins, avoidance, S-curves, one inclusion, two or a union). What lies outside the measured range is driven too, with `--trust-model`, and counted apart.
"""


def main() -> None:
    """Run the benchmark and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", choices=(*KINDS, "table"), default="usual")
    parser.add_argument("--firmware", type=read_firmware, default=Firmware(4, 6))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lines", type=Path)
    parser.add_argument("--page", type=Path, nargs="+", default=())
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    kept = options.page or [options.lines]
    found = {path.stem if path else options.kinds: read_lines(path) for path in kept}
    if not options.page:
        found = {options.kinds: _run_all(options, *found.values())}
    text = "\n\n".join(f"## {TITLES[kinds]}\n\n{report(runs)}" for kinds, runs in found.items())
    print(text)
    if options.output:
        options.output.write_text(f"{HEAD}\n{_made()}\n\n{text}\n", encoding="utf-8")


def _run_all(options: argparse.Namespace, kept: list[Run]) -> list[Run]:
    """Return the runs that are kept, and those of the seeds that are not, which are kept then."""
    done = {run.seed for run in kept}
    seeds = [one for one in range(options.first, options.first + options.fields) if one not in done]
    runs = list(kept)
    with ProcessPoolExecutor(options.jobs) as pool:
        for found in pool.map(partial(runs_of, kinds=options.kinds, firmware=options.firmware), seeds):
            runs += found
            if options.lines:
                with options.lines.open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(asdict(run)) + "\n" for run in found)
    return runs


def read_lines(lines: Path | None) -> list[Run]:
    """Return the runs that a file of lines holds, none if there is no such file."""
    if lines is None or not lines.exists():
        return []
    found = [json.loads(line) for line in lines.read_text(encoding="utf-8").splitlines()]
    return [Run(**{**one, "extrapolated": tuple(one["extrapolated"])}) for one in found]


def runs_of(seed: int, kinds: str = "usual", firmware: Firmware = Firmware(4, 6)) -> list[Run]:  # noqa: B008 - frozen
    """Plan and drive one field with each vehicle."""
    if kinds == "table":
        field, name, parameters, firmware = _case(seed, firmware)
        return [_run(field, name, parameters, firmware, trusts_model=True)]
    field = KINDS[kinds](seed)
    return [_run(field, name, parameters_of(field, name), firmware) for name in VEHICLES]


def table_case(seed: int) -> tuple[Situation, GoTo]:
    """Return the situation and the request of one drive over the table."""
    field, _, parameters, firmware = _case(seed, Firmware(4, 6))
    return situation_of(field, parameters, firmware), GoTo(target=field.target, clearance_m=field.clearance_m)


def _case(seed: int, firmware: Firmware) -> tuple[Field, str, dict[str, float], Firmware]:
    """Return a field, a vehicle in words and as parameters, and its firmware: 4.7 where it has FENCE_MARGIN_XY, which only that knows."""
    field, name, parameters = make_case(seed)
    firmware = Firmware(4, 7) if "FENCE_MARGIN_XY" in parameters else firmware
    return replace(field, seed=seed), name, {**_KNOWN, **parameters}, firmware


def parameters_of(field: Field, name: str) -> dict[str, float]:
    """Return a vehicle's parameters on a field."""
    return {**_KNOWN, **VEHICLES[name], "FENCE_MARGIN": field.clearance_m - 0.1}


def situation_of(
    field: Field,
    parameters: dict[str, float],
    firmware: Firmware = Firmware(4, 6),  # noqa: B008 - frozen
) -> Situation:
    """Return what a plan on a field has to go by."""
    return Situation(
        fence=Known(field.fence, None, "bench"),
        pose=Known(Pose(field.start, field.heading_deg), None, "bench"),
        home=Known(field.start, None, "bench"),
        parameters=parameters,
        firmware=firmware,
    )


def _run(
    field: Field, name: str, parameters: dict[str, float], firmware: Firmware, *, trusts_model: bool = False
) -> Run:
    begun_s = time.process_time()
    run = _planned_and_driven(field, name, parameters, firmware, trusts_model=trusts_model)
    return replace(run, cpu_s=time.process_time() - begun_s)


def _planned_and_driven(
    field: Field, name: str, parameters: dict[str, float], firmware: Firmware, *, trusts_model: bool
) -> Run:
    situation = situation_of(field, parameters, firmware)
    vehicle = vehicle_from_parameters(parameters, firmware=firmware)
    ground = route_ground(situation, vehicle, (field.start, field.target))
    widest_m = widest_clearance_m(
        ground, [ground.frame.to_local(field.start), ground.frame.to_local(field.target)]
    )
    request = GoTo(target=field.target, clearance_m=field.clearance_m, trusts_model=trusts_model)
    known = {
        "seed": field.seed,
        "kind": field.kind,
        "vehicle": name,
        "promised_m": promise(situation, request, vehicle).promised_m,
        "widest_m": widest_m,
    }
    begun_s = time.process_time()
    try:
        planned = plan(situation, request)
    except MissionError as error:
        beyond = beyond_measured(vehicle) if trusts_model else ()
        took_s = time.process_time() - begun_s
        return Run(**known, refusal=str(error), planning_s=took_s, extrapolated=beyond)  # type: ignore[arg-type]
    planning_s = time.process_time() - begun_s
    promised_m = planned.clearance_m
    if promised_m is None:
        return Run(**known, extrapolated=planned.extrapolated, planning_s=planning_s)  # type: ignore[arg-type]
    shortest_m = (
        math.nan if trusts_model else plan(situation, replace(request, corner_allowance_m=0.0)).length_m
    )
    driven_s, rover, arrived = drive_plan(field, planned, parameters, firmware)
    return Run(
        **known,  # type: ignore[arg-type]
        planning_s=planning_s,
        leads_away_m=planned.start_clearance_m,
        length_m=planned.length_m,
        shortest_m=shortest_m,
        waypoints=len(planned.path) - 1,
        slow=sum(speed is not None for speed in planned.speeds),
        foreseen_s=planned.duration_s,
        foreseen_m=planned.driven_clearance_m,
        driven_m=rover.least_clearance_m,
        driven_s=driven_s,
        breaches=rover.breaches,
        arrived=arrived,
        extrapolated=planned.extrapolated,
    )


def drive_plan(
    field: Field, planned: Plan, parameters: dict[str, float], firmware: Firmware
) -> tuple[float, SimulatedVehicle, bool]:
    """Drive a plan in AUTO until it is complete, or much longer than foreseen."""
    vehicle = SimulatedVehicle(
        SimulatorConfig(
            home=field.start,
            heading_deg=field.heading_deg,
            mission=planned.items,
            fence=fence_to_items(field.fence),
            parameters=parameters,
            firmware=firmware,
            streams=False,
        )
    )
    rover = vehicle.rover
    rover.arm()
    now_s = 1.0
    rover.set_mode(Mode.AUTO, now_s)
    limit_s = 3 * planned.duration_s + STANDS_S
    place, place_s = vehicle.position, now_s
    while rover.mode == Mode.AUTO and not rover.mission_run.is_complete and now_s < limit_s:
        now_s += TICK_S
        rover.step(now_s)
        if now_s - place_s > STANDS_S:
            if distance_m(place, vehicle.position) < STANDS_M:
                break
            place, place_s = vehicle.position, now_s
    near = distance_m(vehicle.position, planned.targets[-1]) < max(parameters["WP_RADIUS"], 1.5) + 1.0
    return now_s - 1.0, vehicle, rover.mission_run.is_complete and near


def _made() -> str:
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "shapely"))
    today = dt.datetime.now(tz=dt.UTC).date()
    return f"Made on {today} by `benchmarks/drive.py`, Python {platform.python_version()}, {versions}, {platform.machine()}."


def report(runs: list[Run]) -> str:
    """Return the tables, and what did not end as it should, run by run; of extrapolated ones in counts."""
    vehicles = len({run.vehicle for run in runs})
    lines = [
        f"{len({run.seed for run in runs})} fields, {vehicles} vehicles, {len(runs)} runs, {sum(run.is_driven for run in runs)} of them driven; {sum(run.cpu_s for run in runs):.0f} s of CPU.",
        "",
        (
            "| | routes | refused, widest ≥ promised + 0.5 m | least driven − promised | short by > 0.10 m | breaches | not arrived "
            "| longer than the shortest, median / p90 | predicted / driven time, p10 … p90 | planning (CPU), median / max |"
        ),
        "|---|---|---|---|---|---|---|---|---|---|",
        *(
            _row(name, [run for run in runs if run.group == name])
            for name in sorted({run.group for run in runs})
        ),
        "",
        f"{sum(run.leads_away_m is not None for run in runs)} runs begin where turning leaves less than the promise (counted against what the plan says of them).",
    ]
    told = [run for run in runs if not run.extrapolated]
    parts = {
        "Refused although the widest route keeps 0.5 m more than promised:": [
            f"- {_named(run)}, widest {run.widest_m:.2f} m: {run.refusal}"
            for run in told
            if run.is_wide and run.refusal is not None
        ],
        "Short of the promise, or not arrived:": [
            f"- {_named(run)}: promised {run.promised_m:g} m, foreseen {run.foreseen_m:.2f} m, driven {run.driven_m:.2f} m, "
            f"{'arrived' if run.arrived else 'not arrived'}, {run.breaches} breaches"
            for run in told
            if run.is_driven and run.is_amiss
        ],
        "Extrapolated, by why: how many of those driven were short, breached or stuck, and the most that was missing:": _amiss(
            runs
        ),
    }
    for title, found in parts.items():
        lines += ["", title, "", *(found or ["- none"])]
    return "\n".join(lines)


def _row(name: str, mine: list[Run]) -> str:
    routes = [run for run in mine if run.is_driven]
    wide = [run for run in mine if run.is_wide]
    refused = [run for run in wide if run.refusal is not None]
    longer = sorted(run.length_m / run.shortest_m - 1 for run in routes if run.shortest_m > 0)
    times = sorted(run.foreseen_s / run.driven_s for run in routes if run.arrived)
    shortest = f"{statistics.median(longer):.1%} / {_p(longer, 0.9):.1%}" if longer else "not planned"
    return (
        f"| {name} | {len(routes)} of {len(mine)} | {len(refused)} of {len(wide)} ({len(refused) / max(1, len(wide)):.1%}) "
        f"| {min((-run.short_m for run in routes), default=math.nan):+.2f} m | {sum(run.short_m > TOLERANCE_M for run in routes)} "
        f"| {sum(run.breaches for run in routes)} | {sum(not run.arrived for run in routes)} "
        f"| {shortest} "
        f"| {_p(times, 0.1):.2f} … {_p(times, 0.9):.2f} "
        f"| {statistics.median(run.planning_s for run in mine):.2f} / {max(run.planning_s for run in mine):.2f} s |"
    )


def _amiss(runs: list[Run]) -> list[str]:
    """Return a line for each reason for which drives are extrapolated: the parameter, or the words up to the first comma."""
    by_reason: dict[str, list[Run]] = {}
    for run in (run for run in runs if run.is_driven):
        for reason in run.extrapolated:
            by_reason.setdefault(re.findall(r"^[A-Z_]{2,}|^[^,]+", reason)[0], []).append(run)
    lines = []
    for what, mine in sorted(by_reason.items()):
        amiss = [run for run in mine if run.is_amiss]
        most = f", by up to {max(run.short_m for run in amiss):.2f} m" if amiss else ""
        lines.append(f"- {what}: {len(amiss)} of {len(mine)}{most}")
    return lines


def _named(run: Run) -> str:
    return f"{run.kind} {run.seed}, {run.vehicle}"


def _p(values: list[float], share: float) -> float:
    return values[min(len(values) - 1, math.floor(share * len(values)))] if values else math.nan


if __name__ == "__main__":
    main()
