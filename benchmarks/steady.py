"""Whether plans are steady: a start moved by centimetres, or a heading known otherwise by a few degrees, may not cost much time.

``python benchmarks/steady.py [--fields N] [--first SEED] [--kinds usual|more] [--vehicles N ...] [--jobs N] [-o FILE]``. Each field of the
drive benchmark is planned from its start and from starts around it, up to 0.3 m and 10° away; the longest predicted time over the shortest
counts, and a start that is refused while another is not. Nothing is driven.

A start that a quicker mission leads on from, as far as `check` says, should have been given it: each start's way is compared with the missions of
the other starts, driven from it. One whose quicker missions all fail the check counts as met, and is listed with what fails.
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

from missions.checking.check import check_mission
from missions.errors import MissionError
from missions.geo import LocalPoint
from missions.ground.frame import frame_around
from missions.planning.plan import plan
from missions.request import GoTo
from missions.situation import Mission

if TYPE_CHECKING:
    from collections.abc import Iterator

    from drive_fields import Field

    from missions.planned import Plan
    from missions.situation import Situation

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
    """One field and one vehicle, planned from each of the starts.

    Parameters
    ----------
    times_s : tuple of float
        From each start; infinite where it is refused.
    others_s : tuple of float
        For each start, the quickest of the other starts' missions that hold from it; infinite where none does.
    why : tuple of str
        For each start, what the quickest mission of all does not keep from it; empty where it holds.
    """

    seed: int
    kind: str
    vehicle: str
    times_s: tuple[float, ...]
    planning_s: tuple[float, ...]
    others_s: tuple[float, ...]
    why: tuple[str, ...]

    @property
    def ratio(self) -> float:
        """The longest time over the shortest; nan where nothing was found."""
        found = [time_s for time_s in self.times_s if math.isfinite(time_s)]
        return max(found) / min(found) if found else math.nan

    @property
    def refused(self) -> int:
        """How many starts were refused."""
        return sum(not math.isfinite(time_s) for time_s in self.times_s)

    @property
    def missed(self) -> float:
        """The most that a start's time is over that of another start's mission that holds from it; infinite where such a start is refused."""
        pairs = zip(self.times_s, self.others_s, strict=True)
        return max((own_s / other_s for own_s, other_s in pairs if math.isfinite(other_s)), default=math.nan)

    @property
    def is_steady(self) -> bool:
        """Whether no start is slower than it must be."""
        return self.ratio <= MOST_RATIO and not 0 < self.refused < len(SHIFTS)

    @property
    def is_met(self) -> bool:
        """Whether no start could have had a mission that is clearly quicker."""
        return not self.missed > MOST_RATIO


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
    situations = [situation_of(moved, parameters) for moved in moved_starts(field)]
    plans: list[Plan | None] = []
    planning_s = []
    for situation in situations:
        begun_s = time.process_time()
        try:
            plans.append(plan(situation, request))
        except MissionError:
            plans.append(None)
        planning_s.append(time.process_time() - begun_s)
    others = [_others(situation, request, plans, own) for own, situation in enumerate(situations)]
    return Spread(
        field.seed,
        field.kind,
        name,
        tuple(one.duration_s if one else math.inf for one in plans),
        tuple(planning_s),
        tuple(time_s for time_s, _ in others),
        tuple(why for _, why in others),
    )


def _others(situation: Situation, request: GoTo, plans: list[Plan | None], own: int) -> tuple[float, str]:
    """Return the time of the quickest other mission that holds from a start, and what the quickest of all does not keep from it."""
    here = plans[own]
    quickest = sorted(
        (one for one in plans if one and not (here and one.duration_s * MOST_RATIO >= here.duration_s)),
        key=lambda one: one.duration_s,
    )
    least_s, why = math.inf, ""
    for number, other in enumerate(quickest):
        checked = check_mission(Mission(other.items, situation.home.value), situation, request)  # type: ignore[union-attr]
        if checked.holds:
            return checked.duration_s, why
        if not number:
            short = [
                f"leg {leg.name} keeps {leg.driven_clearance_m:.2f} of {leg.asked_m:.2f} m"
                for leg in checked.broken
            ]
            why = "; ".join([*short, *checked.dangers])
    return least_s, why


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
        f"| | planned | longest / shortest, p50 / p90 / max | above {MOST_RATIO} | refused from some starts | from all | a quicker mission holds | planning (CPU), median / p90 / max |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(spread.vehicle for spread in spreads):
        mine = [spread for spread in spreads if spread.vehicle == name]
        found = [spread for spread in mine if spread.refused < len(SHIFTS)]
        ratios = sorted(spread.ratio for spread in found)
        planning_s = sorted(took_s for spread in mine for took_s in spread.planning_s)
        lines.append(
            f"| {name} | {len(found)} | {_p(ratios, 0.5):.3f} / {_p(ratios, 0.9):.3f} / {_p(ratios, 1.0):.3f} "
            f"| {sum(ratio > MOST_RATIO for ratio in ratios)} | {sum(spread.refused > 0 for spread in found)} "
            f"| {len(mine) - len(found)} | {sum(not spread.is_met for spread in found)} | {_p(planning_s, 0.5):.2f} / {_p(planning_s, 0.9):.2f} / {_p(planning_s, 1.0):.2f} s |"
        )
    unsteady = [spread for spread in spreads if not spread.is_steady]
    lines += ["", "Slower than a mission that holds from there, or refused:", ""]
    lines += [_line(spread) for spread in unsteady if not spread.is_met] or ["- none"]
    lines += ["", "Not steady, and the quicker missions do not hold from the slower starts:", ""]
    lines += [
        f"{_line(spread)}: {'; '.join(dict.fromkeys(filter(None, spread.why)))}"
        for spread in unsteady
        if spread.is_met
    ] or ["- none"]
    return "\n".join(lines)


def _line(spread: Spread) -> str:
    times = " ".join(
        f"{own_s:.1f}" + (f" ({other_s:.1f})" if math.isfinite(other_s) else "")
        for own_s, other_s in zip(spread.times_s, spread.others_s, strict=True)
    )
    return f"- {spread.kind} {spread.seed}, {spread.vehicle}: {times} s"


def _p(values: list[float], share: float) -> float:
    return values[min(len(values) - 1, math.floor(share * len(values)))] if values else math.nan


if __name__ == "__main__":
    main()
