"""Missions with their ways home inside, driven by the simulated rover: chosen at random moments, and not chosen.

``python benchmarks/home_inside.py [--fields N] [--first SEED] [-o FILE.md]``. On each field a route is planned with ``--way-home-inside`` as ``pbpp plan`` does. One
rover drives it to its end and stands there for a minute more: it must not have entered a way home. Others drive it to a random moment, where the way home
of the item they drive to is chosen (MISSION_SET_CURRENT in AUTO, without stopping before): they must end at its place. None may come nearer to the fence than was promised;
the distance is the simulated rover's own, of its true track.
"""

from __future__ import annotations

import argparse
import math
import random
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from drive_fields import make_field
from drive_more_fields import make_more

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.rover import TICK_S
from missions.checking.home_part import home_parts
from missions.errors import MissionError
from missions.fence import fence_to_items
from missions.firmware import Firmware
from missions.geo import distance_m
from missions.planning.plan import plan
from missions.request import Tour
from missions.situation import Known, Pose, Situation

if TYPE_CHECKING:
    from drive_fields import Field

    from mavlink_bridge.simulator.rover import Rover
    from missions.checking.home_part import HomePart
    from missions.planned import Plan

PARAMETERS = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "FENCE_ACTION": 0.0, "FENCE_MARGIN": 0.2}
LATEST = Firmware(4, 7, 0)
_CHOICES = 3  # a field
_STANDS_S = 60.0
_MOST_S = 3600.0
_AT_M = (
    4.0  # WP_RADIUS 2, and as far again: a steered rover of 5 m/s that drives 3 m passes its place beside it
)


@dataclass(frozen=True)
class Drive:
    """What came of a drive."""

    kind: str
    seed: int
    chosen: str
    trouble: str
    over_m: float


def situation_of(field: Field) -> Situation:
    """Return what is known on a field: its start is home, the vehicle the simulated one with all of its parameters."""
    known = SimulatedVehicle(SimulatorConfig(parameters=PARAMETERS)).parameters
    return Situation(
        fence=Known(field.fence, None, "benchmark"),
        home=Known(field.start, None, "benchmark"),
        pose=Known(Pose(field.start, field.heading_deg), None, "benchmark"),
        parameters={name: known[name] for name in known},
        firmware=LATEST,
    )


def set_out(field: Field, planned: Plan) -> Rover:
    """Return a rover armed in AUTO at the start."""
    config = SimulatorConfig(
        home=field.start,
        heading_deg=field.heading_deg,
        mission=planned.items,
        fence=tuple(fence_to_items(field.fence)),
        parameters=PARAMETERS,
    )
    rover = SimulatedVehicle(config).rover
    rover.arm()
    rover.set_mode(Mode.AUTO, 0.0)
    return rover


def drives_of(field: Field, planned: Plan) -> list[Drive]:
    """Drive a plan to its end, and from random moments home."""
    promised_m = planned.clearance_m or 0.0
    if planned.start_clearance_m is not None:
        promised_m = min(promised_m, planned.start_clearance_m)
    parts = {part.leg_item: part for part in home_parts(planned.items)}
    last_item = planned.seqs[-1]
    rover = set_out(field, planned)
    now_s = 0.0
    while now_s < planned.duration_s + _STANDS_S and now_s < _MOST_S:
        now_s += TICK_S
        rover.step(now_s)
    ends = rover.mission_run.is_complete and rover.mission_run.seq == last_item
    trouble = "" if ends else f"is at item {rover.mission_run.seq}, and not at its end"
    away_m = distance_m(rover.position, planned.targets[-1])
    trouble = trouble or ("" if away_m < _AT_M else f"ends {away_m:.1f} m from the target")
    found = [_drive(field, "none", rover, trouble, promised_m)]
    chance = random.Random(field.seed)
    for _ in range(_CHOICES):
        at_s = chance.uniform(1.0, max(2.0, planned.duration_s))
        rover, now_s = set_out(field, planned), 0.0
        while now_s < at_s:
            now_s += TICK_S
            rover.step(now_s)
        part = parts.get(rover.mission_run.seq)
        if part is not None:
            found.append(_driven_home(field, rover, part, now_s, promised_m))
    return found


def _driven_home(field: Field, rover: Rover, part: HomePart, now_s: float, promised_m: float) -> Drive:
    rover.set_current_item(part.item, restart=False, now_s=now_s)
    until_s = now_s + _MOST_S
    while now_s < until_s and not (rover.mission_run.is_complete and rover.is_idle):
        now_s += TICK_S
        rover.step(now_s)
    away_m = distance_m(rover.position, part.place)
    trouble = "" if away_m < _AT_M else f"ends {away_m:.1f} m from the place, at item {rover.mission_run.seq}"
    return _drive(field, f"item {part.item} on the leg to item {part.leg_item}", rover, trouble, promised_m)


def _drive(field: Field, chosen: str, rover: Rover, trouble: str, promised_m: float) -> Drive:
    over_m = rover.least_clearance_m - promised_m
    if not trouble and over_m < 0:
        trouble = f"comes {-100 * over_m:.0f} cm nearer than promised"
    if rover.breaches:
        trouble = f"{rover.breaches} breaches; {trouble}"
    return Drive(field.kind, field.seed, chosen, trouble, over_m)


def planned_on(field: Field) -> Plan | None:
    """Return the plan of a field; None where there is none, or it promises nothing."""
    request = Tour(targets=(field.target,), clearance_m=field.clearance_m, way_home_inside=True)
    try:
        planned = plan(situation_of(field), request)
    except MissionError:
        return None
    return None if planned.extrapolated else planned


def main() -> None:
    """Run over fields and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    drives: list[Drive] = []
    without, legs, with_way, fields, seed = 0, 0, 0, 0, given.first
    while fields < given.fields:
        for make in (make_field, make_more):
            try:
                field = make(seed)
            except ValueError:  # a field without room
                continue
            planned = planned_on(field)
            if planned is None:
                without += 1
                continue
            fields += 1
            legs += len(planned.path) - 1
            with_way += len(home_parts(planned.items))
            for drive in drives_of(field, planned):
                drives.append(drive)
                print(
                    f"{drive.kind}, seed {drive.seed}, chosen {drive.chosen}: {drive.trouble or 'good'}",
                    flush=True,
                )
        seed += 1
    chosen = [drive for drive in drives if drive.chosen != "none"]
    bad = [drive for drive in drives if drive.trouble]
    kinds = Counter(drive.kind for drive in chosen)
    least_m = min((drive.over_m for drive in drives), default=math.inf)
    rows = [
        f"Seeds {given.first} to {seed - 1}: {fields} fields, {without} more without a route that promises something, or without a way home; {with_way} of {legs} legs have a way home.",
        "",
        f"{len(drives) - len(chosen)} drives to the end and a minute beyond, {len(chosen)} ways home chosen on the way ({', '.join(f'{kind} {count}' for kind, count in sorted(kinds.items()))}).",
        f"The least that was kept beyond the promise: {100 * least_m:.1f} cm. Troubles: {len(bad)}.",
        "",
        *(f"* {one.kind}, seed {one.seed}, chosen {one.chosen}: {one.trouble}" for one in bad),
    ]
    print("\n".join(rows))
    if given.output is not None:
        given.output.write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
