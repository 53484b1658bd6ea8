"""Whether plans are steady: a start moved by centimetres, or a heading known otherwise by a few degrees, may not cost much time.

``python benchmarks/steady.py [--fields N] [--first SEED] [--kinds usual|more] [--vehicles N ...] [--jobs N] [-o FILE]``. Each field of the
drive benchmark is planned from its start and from starts around it, up to 0.3 m and 10° away; the longest predicted time over the shortest
counts, and a start that is refused while another is not. Nothing is driven.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from typing import TYPE_CHECKING

from drive import KINDS, VEHICLES, parameters_of, situation_of

from missions.errors import MissionError
from missions.geo import LocalPoint
from missions.ground.frame import frame_around
from missions.planning.plan import plan
from missions.request import GoTo

if TYPE_CHECKING:
    from collections.abc import Iterator

    from drive_fields import Field

SHIFT_M, TURN_DEG = 0.3, 10.0
"""How far starts are moved and turned at the most."""

MOST_RATIO = 1.05
"""The longest predicted time over the shortest that still counts as steady."""

# East, north, in metres, and degrees: nothing, the millimetres of a new fix, and the corners of what is allowed.
SHIFTS = (
    (0.0, 0.0, 0.0),
    (0.009, 0.0, 0.0),
    (0.0, -0.1, 0.0),
    (SHIFT_M, 0.0, TURN_DEG),
    (-SHIFT_M, 0.0, -TURN_DEG),
    (0.0, SHIFT_M, -TURN_DEG),
    (0.0, -SHIFT_M, TURN_DEG),
)


@dataclass(frozen=True)
class Spread:
    """One field and one vehicle, planned from each of the starts."""

    seed: int
    kind: str
    vehicle: str
    times_s: tuple[float, ...]
    planning_s: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """The longest time over the shortest; nan where nothing was found."""
        found = [time_s for time_s in self.times_s if math.isfinite(time_s)]
        return max(found) / min(found) if found else math.nan

    @property
    def refused(self) -> int:
        """How many starts were refused."""
        return sum(not math.isfinite(time_s) for time_s in self.times_s)


def main() -> None:
    """Run the benchmark and print what is not steady."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kinds", choices=tuple(KINDS), default="usual")
    parser.add_argument("--vehicles", type=int, nargs="*", default=list(range(len(VEHICLES))))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    names = [list(VEHICLES)[number] for number in options.vehicles]
    seeds = range(options.first, options.first + options.fields)
    with ProcessPoolExecutor(options.jobs) as pool:
        spreads = [
            spread
            for found in pool.map(partial(spreads_of, kinds=options.kinds, names=names), seeds)
            for spread in found
        ]
    text = report(spreads)
    print(text)
    if options.output:
        options.output.write_text(f"{text}\n", encoding="utf-8")


def spreads_of(seed: int, kinds: str, names: list[str]) -> list[Spread]:
    """Plan one field from all starts, with each vehicle."""
    field = KINDS[kinds](seed)
    return [_spread(field, name) for name in names]


def _spread(field: Field, name: str) -> Spread:
    parameters = parameters_of(field, name)
    request = GoTo(target=field.target, clearance_m=field.clearance_m)
    times_s, planning_s = [], []
    for moved in moved_starts(field):
        begun_s = time.process_time()
        try:
            times_s.append(plan(situation_of(moved, parameters), request).duration_s)
        except MissionError:
            times_s.append(math.inf)
        planning_s.append(time.process_time() - begun_s)
    return Spread(field.seed, field.kind, name, tuple(times_s), tuple(planning_s))


def moved_starts(field: Field) -> Iterator[Field]:
    """Return the field with each of the starts."""
    frame = frame_around([field.start])
    east_m, north_m = frame.to_local(field.start)
    for east, north, turn_deg in SHIFTS:
        start = frame.to_lat_lon(LocalPoint(east_m + east, north_m + north))
        yield replace(field, start=start, heading_deg=(field.heading_deg + turn_deg) % 360.0)


def report(spreads: list[Spread]) -> str:
    """Return the table, and each field that is not steady."""
    lines = [
        f"{len({spread.seed for spread in spreads})} fields, {len(SHIFTS)} starts each.",
        "",
        f"| | planned | longest / shortest, p50 / p90 / max | above {MOST_RATIO} | refused from some starts | from all | planning (CPU), median / p90 / max |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(spread.vehicle for spread in spreads):
        mine = [spread for spread in spreads if spread.vehicle == name]
        found = [spread for spread in mine if spread.refused < len(SHIFTS)]
        ratios = sorted(spread.ratio for spread in found)
        planning_s = sorted(took_s for spread in mine for took_s in spread.planning_s)
        lines.append(
            f"| {name} | {len(found)} | {_p(ratios, 0.5):.3f} / {_p(ratios, 0.9):.3f} / {_p(ratios, 1.0):.3f} "
            f"| {sum(ratio > MOST_RATIO for ratio in ratios)} | {sum(spread.refused > 0 for spread in found)} "
            f"| {len(mine) - len(found)} | {_p(planning_s, 0.5):.2f} / {_p(planning_s, 0.9):.2f} / {_p(planning_s, 1.0):.2f} s |"
        )
    lines += ["", "Not steady:", ""]
    lines += [
        f"- {spread.kind} {spread.seed}, {spread.vehicle}: {' '.join(f'{time_s:.1f}' for time_s in spread.times_s)} s"
        for spread in spreads
        if spread.ratio > MOST_RATIO or 0 < spread.refused < len(SHIFTS)
    ] or ["- none"]
    return "\n".join(lines)


def _p(values: list[float], share: float) -> float:
    return values[min(len(values) - 1, math.floor(share * len(values)))] if values else math.nan


if __name__ == "__main__":
    main()
