"""Whether ``--clearance`` is one coherent thing: every clearance of a ladder asked on the recorded maze and yard, and on seeded fields.

``python benchmarks/ladder.py [--fields N] [--first SEED] [--step M] [--jobs N] [--places NAME …]
[--kept FILE] [--progress] [-o FILE]``. For each place the widest route is planned, and every rung from 0.5 to
8 m; counted is what contradicts: less promised than asked, a clearance refused below one that is planned, a time that falls by more than 2 %
as the clearance grows, a rung that keeps more than the widest route. ``--kept`` keeps each place as a line of JSON and goes on where it was interrupted.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import platform
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent))

from drive import VEHICLES, parameters_of, situation_of
from drive_fields import make_field

from mavlink_bridge.logbook.log_situation import situation_from_log
from missions.errors import RouteError
from missions.planning.plan import plan
from missions.request import GoTo

if TYPE_CHECKING:
    from missions.situation import Situation

_LOGS = Path(__file__).parent.parent / "sitl_logs"
LOGS = {"maze": "guided-maze.tlog", "yard": "position-target-yard.tlog"}
FIRST_M, LAST_M = 0.5, 8.0
TIME_TOLERANCE = 0.02
TOLD_SHARES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.5)
MARGIN_M = 0.3
"""FENCE_MARGIN of the fields' vehicles: what is asked for is not raised to it."""


@dataclass(frozen=True)
class Rung:
    """One clearance asked, and what came of it; the widest route where none was asked."""

    asked_m: float | None
    promised_m: float | None
    start_m: float | None
    duration_s: float
    planning_s: float


@dataclass(frozen=True)
class Ladder:
    """All rungs of one place."""

    place: str
    widest: Rung
    rungs: tuple[Rung, ...]

    def with_quickest(self) -> list[tuple[Rung, Rung]]:
        """Return each planned rung, and the quickest of it and those above."""
        planned = [rung for rung in self.rungs if rung.promised_m is not None]
        return [
            (rung, min(planned[number:], key=lambda one: one.duration_s))
            for number, rung in enumerate(planned)
        ]

    def contradictions(self) -> dict[str, list[str]]:
        """Return what contradicts, by kind: promises, feasibility, times, the widest."""
        planned = [rung for rung in self.rungs if rung.promised_m is not None]
        least = [
            f"{rung.asked_m:g} → {rung.promised_m:g} m"
            for rung in planned
            if rung.promised_m < rung.asked_m - 1e-9
        ]
        most_asked_m = max((rung.asked_m for rung in planned), default=0.0)
        holes = [
            f"{rung.asked_m:g} m"
            for rung in self.rungs
            if rung.promised_m is None and rung.asked_m < most_asked_m
        ]
        slower = [
            f"{rung.asked_m:g} m {rung.duration_s:.1f} s, {quickest.asked_m:g} m {quickest.duration_s:.1f} s"
            for rung, quickest in self.with_quickest()
            if rung.duration_s > quickest.duration_s * (1 + TIME_TOLERANCE)
        ]
        widest_m = self.widest.promised_m or 0.0
        wider = [f"{rung.asked_m:g} m" for rung in planned if rung.promised_m > widest_m + 1e-9]
        return {"promise": least, "feasibility": holes, "time": slower, "widest": wider}


def ladder_of(place: str, step_m: float, last_m: float = LAST_M) -> Ladder:
    """Plan every rung of a place: a log's name, or a field's seed."""
    situation, request = asked_of(place)
    widest = _rung(situation, GoTo(**request, widest=True), None)
    count = round((last_m - FIRST_M) / step_m)
    asked = [round(FIRST_M + number * step_m, 3) for number in range(count + 1)]
    return Ladder(
        place, widest, tuple(_rung(situation, GoTo(**request, clearance_m=one), one) for one in asked)
    )


def asked_of(place: str) -> tuple[Situation, dict[str, object]]:
    """Return what is known at a place, and what is asked there beside a clearance."""
    if place in LOGS:
        return situation_from_log(_LOGS / LOGS[place]), {}
    seed = int(place.removeprefix("field "))
    field = make_field(seed)
    vehicle = list(VEHICLES)[seed % len(VEHICLES)]
    parameters = {**parameters_of(field, vehicle), "FENCE_MARGIN": MARGIN_M}
    return situation_of(field, parameters), {"target": field.target}


def _rung(situation: Situation, request: GoTo, asked_m: float | None) -> Rung:
    begun_s = time.process_time()
    try:
        made = plan(situation, request)
    except RouteError:
        return Rung(asked_m, None, None, 0.0, time.process_time() - begun_s)
    took_s = time.process_time() - begun_s
    return Rung(asked_m, made.clearance_m, made.start_clearance_m, made.duration_s, took_s)


def read_kept(kept: Path | None) -> dict[str, Ladder]:
    """Read the places that were done before, by name."""
    lines = kept.read_text(encoding="utf-8").splitlines() if kept is not None and kept.exists() else []
    rows = [json.loads(line) for line in lines]
    return {
        row["place"]: Ladder(
            row["place"], Rung(**row["widest"]), tuple(Rung(**rung) for rung in row["rungs"])
        )
        for row in rows
    }


HEAD = """# The clearance ladder

`make bench-ladder` asks every clearance from 0.5 to 8 m, and the widest route, on the recorded maze and yard and on the seeded fields of the
[drive benchmark](drive-bench.md), its three vehicles in turn. A *rung* is one of these clearances on one place. Counted is what would contradict:

- less is promised than was asked;
- a clearance is refused, and a larger one is planned;
- a route is slower by more than 2 % than that of a larger clearance;
- a route keeps more than that of `--clearance max`.

That no plan promises less than was asked holds by construction. The rest does not: lines are fitted to a drive by a heuristic, so
a smaller clearance may come out slower than a larger one. To rule that out, each plan would have to be fitted for every larger clearance. What is done is less:

- Where a route does not fit, or is driven slowly (1.6 times the time at full speed), the next larger clearances are fitted, too. The quickest route that keeps enough is taken.
- Before a clearance is refused, the widest ones are tried; where the start refuses, those whose routes begin otherwise.
- Where fitting had to mend more than a metre in all, or cost more than 2 % of the time, up to five of the next whole and half metres (*the grid*) are fitted as well, while what is drawn there may still be quicker. On a grid,
  so that plans for neighbouring clearances look at the same routes.
"""


def main() -> None:
    """Run the ladder and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--step", type=float, default=0.1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--places", nargs="*", help="these only, such as maze or 'field 3'")
    parser.add_argument("--kept", type=Path)
    parser.add_argument("--progress", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    fields = (f"field {seed}" for seed in range(options.first, options.first + options.fields))
    places = options.places or [*LOGS, *fields]
    done = read_kept(options.kept)
    with ProcessPoolExecutor(options.jobs) as pool:
        missing = [place for place in places if place not in done]
        waiting = [pool.submit(ladder_of, place, options.step) for place in missing]
        for ended in as_completed(waiting):
            found = ended.result()
            done[found.place] = found
            if options.kept:
                with options.kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(found)) + "\n")
            if options.progress:
                told = {kind: texts for kind, texts in found.contradictions().items() if texts}
                print(found.place, found.widest, told, file=sys.stderr, flush=True)
    ladders = [done[place] for place in places]
    text = report(ladders, options.step)
    print(text)
    if options.output:
        options.output.write_text(f"{HEAD}\n{_made()}\n\n{text}\n", encoding="utf-8")


def report(ladders: list[Ladder], step_m: float) -> str:
    """Return the tables."""
    rungs = [rung for one in ladders for rung in one.rungs]
    planned = [rung for rung in rungs if rung.promised_m is not None]
    refused = [rung for rung in rungs if rung.promised_m is None]
    found = {one.place: one.contradictions() for one in ladders}
    lines = [
        f"{len(ladders)} places, {len(rungs)} rungs of {step_m:g} m: {len(planned)} planned, {len(refused)} refused.",
        "",
        "| contradiction | rungs | places |",
        "|---|---|---|",
    ]
    names = {
        "promise": "less promised than asked",
        "feasibility": "refused below one that is planned",
        "widest": "keeps more than the widest route",
        "time": f"slower by more than {TIME_TOLERANCE:.0%} than a greater clearance",
    }
    for kind, name in names.items():
        counts = [len(texts[kind]) for texts in found.values()]
        lines.append(f"| {name} | {sum(counts)} | {sum(map(bool, counts))} |")
    shares = [
        rung.duration_s / quickest.duration_s - 1 for one in ladders for rung, quickest in one.with_quickest()
    ]
    lines += ["", "| slower than a greater clearance by more than | rungs | places |", "|---|---|---|"]
    for told in TOLD_SHARES:
        counts = [
            sum(
                rung.duration_s > quickest.duration_s * (1 + told) + 1e-6
                for rung, quickest in one.with_quickest()
            )
            for one in ladders
        ]
        lines.append(f"| {told:.0%} | {sum(counts)} | {sum(map(bool, counts))} |")
    lines += [f"| the most: {max(shares, default=0.0):.0%} | | |"]
    usual_s = statistics.median([rung.planning_s for rung in planned] or [1.0])
    lines += ["", "| CPU time, in medians of the planned rungs | median | p90 | max |", "|---|---|---|---|"]
    for name, some in (
        ("planned", planned),
        ("refused", refused),
        ("widest", [one.widest for one in ladders]),
    ):
        times = [one / usual_s for one in sorted(rung.planning_s for rung in some) or [0.0]]
        lines.append(
            f"| {name} | {statistics.median(times):.1f} | {times[int(0.9 * (len(times) - 1))]:.0f} | {times[-1]:.0f} |"
        )
    told = [
        f"- {place}, {names[kind]}: {'; '.join(texts[kind])}"
        for place, texts in found.items()
        for kind in names
        if texts[kind]
    ]
    return "\n".join([*lines, *(["", "All contradictions:", "", *told] if told else [])])


def _made() -> str:
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "shapely"))
    today = dt.datetime.now(tz=dt.UTC).date()
    return f"Made on {today} by `benchmarks/ladder.py`, Python {platform.python_version()}, {versions}, {platform.machine()}."


if __name__ == "__main__":
    main()
