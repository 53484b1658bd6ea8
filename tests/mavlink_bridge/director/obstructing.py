"""Discs that move through the field of a driving rover: `python tests/mavlink_bridge/director/obstructing.py --runs 1000`.

Each run is seeded: a rover, a target, a link, and one to three discs of 0.5 to 2 m/s, which cross the route or appear shortly before the rover. What is
measured is measured on the true discs and the true track, by geometry of this file. The tests run a few.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from shapely import LineString, Point

sys.path.insert(0, str(Path(__file__).parents[1]))

from director.adopting import HOME, TARGETS, YARD
from director.conducting import Conductor

from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.orders import ObstacleSource
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import MovingDisc, SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.drive_model.stopping import MEASURED
from missions.fence import fence_to_items
from missions.planning.plan import plan as make_plan
from missions.request import Request
from missions.vehicle import Steering

SEES_M = 15.0
BODY_M = 0.5
"""Half of the rover: nearer to a disc's edge its middle is in contact."""

STANDS_MPS = 0.3
FASTEST_MPS = 2.0
TAKEN_S = 0.5
PLANNING_S = 0.5
"""What a plan is taken to cost; the longest that one did cost in a run is told."""

SKID = {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0}


@dataclass
class Seen:
    """What was measured in a run."""

    held_s: list[float] = field(default_factory=list)
    on_from_standing_s: list[float] = field(default_factory=list)
    on_from_report_s: list[float] = field(default_factory=list)
    went_on_first: int = 0
    waits: int = 0
    planning_s: float = 0.0
    contact: str = ""
    bad: list[str] = field(default_factory=list)
    what: str = ""
    least_gap_m: float = math.inf


class Obstructed:
    """A bridge that drives among discs.

    Parameters
    ----------
    seed : int
        Of everything that happens.
    """

    def __init__(self, seed: int) -> None:
        chance = self.random = random.Random(seed)
        self.seen = Seen()
        self.is_skid = chance.random() < 0.5
        self.speed_mps = chance.choice((2.0, 3.0))
        self.is_bad_link = chance.random() < 0.2
        orders = Orders(
            request=Request(clearance_m=2.5),
            upload=True,
            drive=True,
            arm=True,
            obstacle_sources=frozenset(ObstacleSource),
            obstacle_growth_mps=FASTEST_MPS,
        )
        self.vehicle = SimulatedVehicle(
            SimulatorConfig(
                home=HOME,
                fence=fence_to_items(YARD),
                parameters={
                    "FENCE_ENABLE": 1.0,
                    "WP_SPEED": self.speed_mps,
                    **(SKID if self.is_skid else {}),
                },
                sensor_m=SEES_M,
            )
        )
        loss = 0.05 if self.is_bad_link else 0.0
        faults = Faults(loss=loss, duplicate=loss / 2, latency_s=2 * loss or 0.02, jitter_s=loss)
        self.run = Conductor(
            Director(orders), [self.vehicle], faults, planning_s=PLANNING_S, planner=self._plan
        )
        self.run.run_until(lambda: self.run.director.state is State.READY, 60)
        self.run.director.take_target(chance.choice(TARGETS), self.run.now_s)
        self.run.run_until(lambda: self.run.director.state is State.DRIVING, 120)
        self._begun_s = self.run.now_s
        self._plan_s = self.run.director.plan.duration_s
        self._pop_up_s = []
        for _ in range(chance.choice((1, 1, 2, 3))):
            if chance.random() < 0.6:
                self.vehicle.discs.append(self._crossing())
            else:
                self._pop_up_s.append(self._begun_s + chance.uniform(0.05, 0.7) * self._plan_s)
        self._reported: dict[
            int, tuple[float, float, float]
        ] = {}  # by disc: when, how far off, how fast we were
        self._across_s: float | None = None
        self._report_s: float | None = None
        self._stood_s: float | None = None
        self._was_mode = Mode.AUTO
        self._has_waited = False
        self._events = 0

    def _plan(self, *arguments: object, **more: object) -> object:
        begun_s = time.thread_time()
        try:
            return make_plan(*arguments, **more)
        finally:
            self.seen.planning_s = max(self.seen.planning_s, time.thread_time() - begun_s)

    # Discs

    def _disc(self, centre_m: complex, heading: float, speed_mps: float) -> MovingDisc:
        frame = self.vehicle.rover.frame
        return MovingDisc(
            frame.to_lat_lon(centre_m),
            self.random.uniform(0.3, 1.2),
            speed_mps,
            math.degrees(heading),
            self.run.now_s,
        )

    def _crossing(self) -> MovingDisc:
        """Return a disc that crosses the route when the rover is about there."""
        chance = self.random
        line = LineString(
            [(p.real, p.imag) for p in map(self.vehicle.rover.frame.to_flat, self.run.director.plan.path)]
        )
        share = chance.uniform(0.15, 0.9)
        there = line.interpolate(share, normalized=True)
        in_s = max(5.0, share * self._plan_s + chance.uniform(-4.0, 4.0))
        heading, speed_mps = chance.uniform(0, 2 * math.pi), chance.uniform(0.5, FASTEST_MPS)
        way = complex(math.cos(heading), math.sin(heading))
        return self._disc(complex(there.x, there.y) - way * speed_mps * in_s, heading, speed_mps)

    def _pop_up(self) -> MovingDisc:
        """Return a disc that appears before the rover."""
        chance, body = self.random, self.vehicle.rover.body
        ahead = complex(chance.uniform(3.0, 14.0), chance.uniform(-4.0, 4.0))
        return self._disc(
            body.position_m + ahead * body.direction,
            chance.uniform(0, 2 * math.pi),
            chance.uniform(0.5, FASTEST_MPS),
        )

    # A run

    def drive(self) -> Seen:
        """Drive to the end; return what was seen."""
        seen, run = self.seen, self.run
        run.meddle = self._look
        try:
            run.run_until(lambda: bool(seen.contact) or run.director.state is State.ARRIVED, 400)
        except AssertionError as error:
            seen.bad.append(f"not arrived: {str(error)[:60]}")
        seen.waits = sum(event.name is EventName.WAITING for event in run.events)
        if self.vehicle.breaches:
            seen.bad.append(f"breaches {self.vehicle.breaches}")
        seen.what = seen.contact.split(":")[0] or "arrived" + " after waiting" * bool(seen.waits)
        return seen

    def _look(self, run: Conductor) -> None:
        """Measure after each step."""
        rover, now_s = self.vehicle.rover, run.now_s
        for due_s in [one for one in self._pop_up_s if now_s >= one]:
            self._pop_up_s.remove(due_s)
            if self.vehicle.mode == Mode.AUTO:
                self.vehicle.discs.append(self._pop_up())
        speed_mps = abs(rover.body.speed_mps)
        discs = self.vehicle.discs_at(now_s)
        for number, (centre_m, radius_m) in enumerate(discs):
            gap_m = abs(centre_m - rover.body.position_m) - radius_m - BODY_M
            self.seen.least_gap_m = min(self.seen.least_gap_m, gap_m)
            if (
                round(now_s / 0.02) % 5 == 0
                and number not in self._reported
                and gap_m + BODY_M < SEES_M
                and self._is_open(centre_m)
            ):
                self._reported[number] = now_s, gap_m, speed_mps
            if gap_m <= 0 and not self.seen.contact:
                self._touch(number, speed_mps)
        self._look_at_route(discs, now_s)
        self._look_at_mode(speed_mps, now_s)

    def _is_open(self, centre_m: complex) -> bool:
        place = (
            Point(self.run.director.plan.ground.frame.to_local(self.vehicle.rover.frame.to_lat_lon(centre_m)))
            if self.run.director.plan
            else None
        )
        return place is None or self.run.director.plan.ground.enforced.allowed.covers(place)

    def _touch(self, number: int, speed_mps: float) -> None:
        if speed_mps <= STANDS_MPS:
            self.seen.contact = "a disc drove against the standing rover"
            return
        disc = self.vehicle.discs[number]
        _, gap_m, then_mps = self._reported.get(number, (0.0, 0.0, speed_mps))
        rows = MEASURED[Steering.SKID if self.is_skid else Steering.ACKERMANN]
        rolls_m = float(np.interp(max(then_mps, speed_mps), *np.array([(0.0, 0.0), *rows]).T))
        stands_s = TAKEN_S + 2 * rolls_m / max(then_mps, speed_mps)
        needs_m = TAKEN_S * then_mps + rolls_m + disc.speed_mps * stands_s
        text = f"first seen {gap_m:.1f} m off at {then_mps:.1f} m/s, disc of {disc.speed_mps:.1f} m/s; standing before it takes {needs_m:.1f} m; touched at {speed_mps:.1f} m/s"
        self.seen.contact = f"contact inside the stopping distance: {text}"
        if gap_m >= needs_m:
            self.seen.bad.append(f"contact: {text}")

    def _look_at_route(self, discs: tuple[tuple[complex, float], ...], now_s: float) -> None:
        """Note since when a disc that the sensor sees is across what is left of the route."""
        director, rover = self.run.director, self.vehicle.rover
        if self._across_s is not None or director.state is not State.DRIVING or director.plan is None:
            return
        if self.vehicle.mode != Mode.AUTO or round(now_s / 0.02) % 5:
            return
        plan = director.plan
        item = max(1, rover.mission_run.seq)
        rest = [rover.body.position_m, *map(rover.frame.to_flat, plan.path[plan.path_index(item) :])]
        line = LineString([(one.real, one.imag) for one in rest])
        for centre_m, radius_m in discs:
            is_seen = abs(centre_m - rover.body.position_m) - radius_m < SEES_M - 0.2 and self._is_open(
                centre_m
            )
            if is_seen and line.distance(Point(centre_m.real, centre_m.imag)) - radius_m < plan.asked_m - 0.3:
                self._across_s = now_s
                self._across = f"disc {centre_m:.1f} {radius_m:.1f} rest {rest[0]:.1f} item {item} route {[f'{one:.0f}' for one in rest]}, keeps {line.distance(Point(centre_m.real, centre_m.imag)) - radius_m:.2f} of {plan.asked_m:.2f}"

    def _look_at_mode(self, speed_mps: float, now_s: float) -> None:
        mode, was = self.vehicle.mode, self._was_mode
        self._was_mode = mode
        told = self.run.events[self._events :]
        self._events = len(self.run.events)
        self._has_waited |= any(event.name in (EventName.WAITING, EventName.ROUTE_BROKEN) for event in told)
        if mode == Mode.HOLD:
            self._has_waited |= any(event.name is EventName.OBSTACLE_ACROSS for event in told)
        if any(event.name is EventName.OBSTACLE_ACROSS for event in told) and self._report_s is None:
            self._report_s = now_s
        if any(event.name is EventName.BREACH_AHEAD and event.data["best"] == "go_on" for event in told):
            self.seen.went_on_first += 1
            self._across_s = None
        if mode == Mode.HOLD and was == Mode.AUTO and self.run.director.state is not State.ARRIVED:
            self.seen.held_s.append(now_s - (self._across_s or self._report_s or now_s))
            self._stood_s, self._has_waited = None, False
        if mode == Mode.HOLD and self._stood_s is None and speed_mps <= STANDS_MPS:
            self._stood_s = now_s
        if mode == Mode.AUTO and was == Mode.HOLD and self._stood_s is not None:
            if not self._has_waited:
                self.seen.on_from_standing_s.append(now_s - self._stood_s)
                self.seen.on_from_report_s.append(now_s - (self._across_s or self._report_s or now_s))
            self._across_s = self._report_s = None
        if self._across_s is not None and mode == Mode.AUTO and now_s > self._across_s + 3.0:
            self.seen.bad.append(
                f"no HOLD for a disc across the route at {self._across_s:.1f}: {self._across}"
            )
            self._across_s = None


def record(seed: int) -> dict[str, object]:
    """Drive a run; return what was seen of it."""
    one = Obstructed(seed)
    kind = f"{'bad' if one.is_bad_link else 'good'} link, {'skid' if one.is_skid else 'steered'}"
    return {"seed": seed, "kind": kind, "speed_mps": one.speed_mps, **vars(one.drive())}


def summary(runs: list[dict]) -> None:
    """Print what came of runs."""
    for run in runs:
        head = f"seed {run['seed']} ({run['kind']}, {run['speed_mps']:g} m/s)"
        late = [round(value, 2) for value in run["held_s"] if value > TAKEN_S]
        if run["bad"] or run["contact"].startswith("contact"):
            print(f"{head}: {'; '.join(run['bad']) or run['contact']}")
        if late:
            print(f"{head}: HOLD after {late} s")
    what = Counter(run["what"] for run in runs)
    print("\n".join(f"{count:5d} {name}" for name, count in what.most_common()))
    waited = sum(bool(run["waits"]) for run in runs)
    went_on = sum(run["went_on_first"] for run in runs)
    longest_s = max(run["planning_s"] for run in runs)
    bad = sum(bool(run["bad"]) for run in runs)
    print(
        f"{len(runs)} runs, {bad} bad; {waited} waited, {went_on} HOLDs after going on first; longest plan {longest_s:.2f} s"
    )
    for name in ("held_s", "on_from_standing_s", "on_from_report_s"):
        for kind in sorted({run["kind"] for run in runs}):
            values = sorted(value for run in runs if run["kind"] == kind for value in run[name])
            if values:
                within = sum(value <= (TAKEN_S if name == "held_s" else 3.5) for value in values)
                print(
                    f"{name:20s} {kind:20s} n {len(values):5d}  median {values[len(values) // 2]:.2f}  "
                    f"99 % {values[int(len(values) * 0.99)]:.2f}  most {values[-1]:.2f}  in time {within}"
                )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--lines",
        type=Path,
        nargs="*",
        default=[],
        help="a line a run is kept there; with --runs 0 they are summed up",
    )
    options = parser.parse_args()
    runs = [
        json.loads(line)
        for path in options.lines
        if not options.runs
        for line in path.read_text().splitlines()
    ]
    for seed in range(options.seed, options.seed + options.runs):
        runs.append(record(seed))
        for path in options.lines:
            with path.open("a") as file:
                file.write(json.dumps(runs[-1]) + "\n")
    summary(runs)
    raise SystemExit(any(run["bad"] for run in runs))


if __name__ == "__main__":
    main()
