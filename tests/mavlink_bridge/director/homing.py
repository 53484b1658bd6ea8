"""Vehicles called home at random: `python tests/mavlink_bridge/director/homing.py --runs 1000`.

Each run is seeded: a field, places to go home to, a link, a moment, and what calls: RTL that is heard or not, SMART_RTL, a low battery by percent, volts or the
autopilot's text with its RTL, the silence of the ground station; some lose their fix for a while. After the call the rover may enter no exclusion and breach
nothing; it has to go to the nearest place that can be reached from where it came to rest, by an exhaustive search over a visibility graph of the tests'
own, and where there is none it has to hold. The tests run a few of each.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter, defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "missions"))

import shapely
from director.conducting import Conductor
from routing.test_way_home import BOX, at, flat, lengths, random_field

from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.director.orders import Homing
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import Battery, Receiver, SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.errors import RouteError
from missions.fence import Fence, fence_to_items
from missions.geo import distance_m
from missions.planning.plan import plan as make_plan
from missions.rally import RallyPoint, rally_to_items
from missions.request import GoTo, Request
from missions.situation import Known, Pose

CLEARANCE_M = 1.6
CLEAN, BAD = Faults(), Faults(loss=0.05, latency_s=0.1)
"""The bad link of the benchmark: 5 % loss, a round trip of 200 ms."""

CALLS = ("rtl heard", "rtl unheard", "smart rtl", "percent", "volts", "battery failsafe", "silence")
MOMENTS = ("driving", "driving", "driving", "driving", "early", "standing")
CLEAN_S, BAD_S = 3.5, 10.0


@dataclass
class Called:
    """What was seen of a run."""

    seed: int
    call: str = ""
    moment: str = ""
    is_bad_link: bool = False
    speed_mps: float = 0.0
    what: str = ""
    to_call_s: float = 0.0
    to_drive_s: float | None = None
    after_rest_s: float | None = None
    moved_mps: float = 0.0
    in_rtl_s: float = 0.0
    bad: list[str] = field(default_factory=list)


class CalledHome:
    """One run."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        chance = self.chance = random.Random(seed)
        self.zones, places, points = random_field(seed)
        names = ("home", "rally", "rally", "shed", "gate")
        self.places = list(zip(names, places, strict=False))
        if seed % 8 == 5:  # the only place lies in an exclusion: there is nowhere to go
            corners = [flat(place) for place in self.zones[0].vertices]
            middle = shapely.Polygon(corners).buffer(0).representative_point()
            self.places = [("home", (middle.x, middle.y))]
        self.speed_mps = chance.choice((1.5, 2.0, 3.0))
        self.is_bad_link = chance.random() < 0.5
        self.call = CALLS[seed % len(CALLS)]
        self.moment = chance.choice(MOMENTS)
        self.loses_fix = chance.random() < 0.1
        self.allowed = shapely.Polygon([flat(place) for place in BOX.vertices])
        for zone in self.zones:
            self.allowed = self.allowed.difference(
                shapely.Polygon([flat(place) for place in zone.vertices]).buffer(0)
            )
        free = shapely.get_parts(self.allowed.buffer(-CLEARANCE_M - 1.5))
        self.part = max(free, key=lambda one: one.area, default=shapely.Polygon())
        self.points = [point for point in points if self.part.covers(shapely.Point(point))]

    @property
    def is_possible(self) -> bool:
        """Whether there is ground to drive on, and a way there and somewhere else."""
        return len(self.points) >= 2

    def prepare(self) -> None:
        """Make the vehicle and its bridge; in half of the runs home is where it was switched on, in half anywhere, in an eighth in an exclusion."""
        start, self.target = self.points[0], self.points[-1]
        rally = tuple(RallyPoint(*at(*point)) for name, point in self.places if name == "rally")
        given = {name: at(*point) for name, point in self.places if name in ("shed", "gate")}
        self.all_places = {"home": start, **{name: flat(place) for name, place in given.items()}}
        self.all_places |= {
            f"rally point {n}": point
            for n, point in enumerate((p for name, p in self.places if name == "rally"), 1)
        }
        parameters = {
            "FENCE_ENABLE": 1.0,
            "FENCE_MARGIN": 1.0,
            "WP_SPEED": self.speed_mps,
            "FENCE_ACTION": 1.0,
        }
        self.vehicle = SimulatedVehicle(
            SimulatorConfig(
                home=at(*start),
                heading_deg=self.chance.uniform(0, 360),
                fence=fence_to_items(Fence((BOX, *self.zones))),
                rally=rally_to_items(rally),
                parameters=parameters,
                battery=Battery(90, 12.5),
            )
        )
        if self.seed % 2:
            home = self.places[0][1]
            self.vehicle.rover.home = self.vehicle._home = at(*home)
            self.all_places["home"] = home
        homing = Homing(
            is_kept=True,
            places=given,
            by_route=True,
            battery_percent=20 if self.call in ("percent", "battery failsafe") else None,
            battery_volts=10.5 if self.call == "volts" else None,
            gcs_timeout_s=5.0 if self.call == "silence" else None,
        )
        request = Request(clearance_m=CLEARANCE_M)
        orders = Orders(request=request, upload=True, drive=True, arm=True, homing=homing)
        self.run = Conductor(Director(orders), [self.vehicle], BAD if self.is_bad_link else CLEAN)
        self.run.up = type(self.run.up)(self.run.faults, 2 * self.chance.randrange(10**6))
        self.run.down = type(self.run.down)(self.run.faults, 2 * self.chance.randrange(10**6) + 1)
        self.run.planning_s = self.chance.choice((0.0, 0.1))
        self._station_s = -1e9
        self.heading_deg: float | None = None
        self.is_station_there = True
        self.track: list[tuple[float, float]] = []
        self.called_s: float | None = None
        self.in_rtl_s = 0.0
        self.rest_s: float | None = None
        self.run.meddle = self._meddle

    def _meddle(self, run: Conductor) -> None:
        if self.is_station_there and run.now_s >= self._station_s + 1.0:
            self._station_s = run.now_s
            run.down.push(m.Frame(255, 190, m.Heartbeat(m.MavType.GCS, 8)), run.now_s)
        if (task := run.director.pending_plan) is not None and task.situation.pose is not None:
            self.heading_deg = task.situation.pose.value.heading_deg
        if self.called_s is None:
            return
        self.in_rtl_s += 0.02 * (self.vehicle.mode in (Mode.RTL, Mode.SMART_RTL))
        if (
            self.rest_s is None
            and self.vehicle.rover.body.speed_mps <= 0.3
            and self.vehicle.mode == Mode.HOLD
        ):
            self.rest_s = run.now_s
        place = flat(self.vehicle.position)
        if not self.track or abs(complex(*place) - complex(*self.track[-1])) > 0.05:
            self.track.append(place)

    def begin(self) -> str:
        """Drive until the moment; return why that is not possible, else nothing."""
        run, director = self.run, self.run.director
        run.run_until(lambda: director.state is State.READY, 120)
        if self.moment == "standing":
            self._do(m.CommandLong(1, 1, 400, param1=1.0))
            run.run_until(lambda: director.situation.armed, 10)
            if self.call not in ("rtl heard", "rtl unheard", "smart rtl"):
                self.call = "rtl unheard"
            self._wait(self.chance.uniform(0, 3))
            return ""
        director.take_target(at(*self.target), run.now_s)
        run.run_until(
            lambda: (
                director.state is State.DRIVING or any(one.name is EventName.NO_PLAN for one in run.events)
            ),
            60,
        )
        if director.state is not State.DRIVING:
            return "no way to the target"
        duration_s = director.plan.duration_s
        if self.moment == "early":  # another target: the call comes while the bridge is at something
            self._wait(self.chance.uniform(0, 0.5) * duration_s)
            director.take_target(at(*self.points[0]), run.now_s)
            self._wait(self.chance.uniform(0, 6))
        else:
            self._wait(self.chance.uniform(0.02, 0.85) * duration_s)
        return "" if director.state is not State.ARRIVED else "arrived before the call"

    def raise_call(self) -> None:
        """Let happen what calls it home."""
        run, vehicle = self.run, self.vehicle
        self.called_s = run.now_s
        if self.loses_fix:
            vehicle.rover.receiver = Receiver(1)
            self.fix_back_s = run.now_s + self.chance.uniform(1, 15)
        if self.call == "rtl heard":
            run.ground_station(m.SetMode(1, 1, Mode.RTL))
            run.ground_station(m.SetMode(1, 1, Mode.RTL))  # as Mission Planner does
        elif self.call in ("rtl unheard", "smart rtl"):
            self._do(m.SetMode(1, 1, Mode.SMART_RTL if self.call == "smart rtl" else Mode.RTL))
        elif self.call == "percent":
            vehicle.rover.battery = Battery(15, 11.9)
        elif self.call == "volts":
            vehicle.rover.battery = Battery(-1, 10.2)
        elif self.call == "battery failsafe":
            vehicle.rover.texts.append((2, "Battery 1 is low 10.20V used 4000 mAh"))
            self._do(m.SetMode(1, 1, Mode.RTL))
        else:
            self.is_station_there = False

    def _do(self, message: m.Message) -> None:
        self.vehicle.receive(m.Frame(255, 190, message), self.run.now_s)

    def _wait(self, seconds: float) -> None:
        until_s = self.run.now_s + seconds
        self.run.run_until(lambda: self.run.now_s >= until_s, seconds + 1)

    def end(self) -> None:
        """Go on until it is home, or holds."""
        run, director = self.run, self.run.director
        before = len(run.events)

        def is_over() -> bool:
            if self.loses_fix and run.now_s >= self.fix_back_s:
                self.vehicle.rover.receiver = None
            names = [event.name for event in run.events[before:]]
            has_answer = EventName.CALLED_HOME in names
            is_refused = (
                EventName.NO_PLAN in names or EventName.AT_HOME in names
            ) and director.state is State.READY
            is_home = EventName.ARRIVED in names and director.state is State.ARRIVED
            return (has_answer and (is_refused or is_home)) or EventName.CALL_IGNORED in names

        run.run_until(is_over, 900)
        self.events = run.events[before:]
        self._wait(4.0)

    def seen(self, seed: int) -> Called:
        """Judge what was seen."""
        run, vehicle = self.run, self.vehicle
        first = {event.name: event for event in reversed(self.events)}
        seen = Called(seed, self.call, self.moment, self.is_bad_link, self.speed_mps)
        if EventName.CALL_IGNORED in first:
            seen.what = "ignored: not in hand"
            return seen
        called_s = first[EventName.CALLED_HOME].time_s
        seen.to_call_s, seen.in_rtl_s = called_s - self.called_s, self.in_rtl_s
        seen.bad += [f"{vehicle.breaches} breaches"] if vehicle.breaches else []
        if len(self.track) > 1 and not self.allowed.covers(shapely.LineString(self.track)):
            seen.bad.append("its track leaves allowed ground")
        if EventName.AT_HOME in first:
            seen.what = "at home already"
            here = flat(vehicle.position)
            away_m = shapely.Point(here).distance(
                shapely.Point(self.all_places[first[EventName.AT_HOME].data["place"]])
            )
            seen.bad += [f"{away_m:.1f} m off"] if away_m > 4 else []
            seen.bad += ["not in HOLD"] if vehicle.mode != Mode.HOLD else []
            return seen
        going = [event for event in self.events if event.name is EventName.GOING_HOME]
        if not going:
            seen.what = "held: no place can be reached"
            seen.bad += ["not in HOLD"] if vehicle.mode != Mode.HOLD else []
            seen.bad += ["it did not say that it waits"] if EventName.HOME_WAITS not in first else []
            self._compare(flat(vehicle.position), None, seen)
            return seen
        if len(going) > 1:
            seen.what = "home, asked twice"
        driving = [
            event for event in self.events if event.name is EventName.DRIVING and event.time_s >= called_s
        ]
        if not self.loses_fix:
            seen.to_drive_s = driving[0].time_s - called_s
            seen.after_rest_s = driving[0].time_s - self.rest_s if self.rest_s is not None else None
        plan = run.director.plan
        if plan is None:
            seen.bad.append("left on the way")
            return seen
        name = going[-1].data["place"]
        off_m = distance_m(vehicle.position, plan.targets[-1])
        seen.bad += [f"ends {off_m:.1f} m off"] if off_m > 4 else []
        seen.bad += [f"ends in mode {vehicle.mode}"] if vehicle.mode != Mode.HOLD else []
        seen.what = seen.what or "home" + (", the fix was lost" if self.loses_fix else "")
        self._compare(flat(plan.start), name, seen)
        return seen

    def _compare(self, here: tuple[float, float], name: str | None, seen: Called) -> None:
        """Compare with every place there is, over a visibility graph."""
        kept_m = CLEARANCE_M + 0.3
        free = self.allowed.buffer(-kept_m, join_style="mitre", mitre_limit=100.0)
        if not free.covers(shapely.Point(here)):
            seen.what += "; from near a fence"
            return
        most_m = dict(zip(self.all_places, lengths(free, here, list(self.all_places.values())), strict=True))
        least_m = min(most_m.values())
        if name is None:
            if least_m < float("inf"):
                seen.what += ", though one is connected: every route to it is refused"
            return
        # The planner cuts mitred corners: its way is no shorter than round round ones, and no longer than round whole mitres.
        wider = self.allowed.buffer(-kept_m, quad_segs=4)
        chosen_m = lengths(wider, here, [self.all_places[name]])[0]
        if chosen_m > 1.1 * least_m * 1.001 + 0.05:
            better = min(most_m, key=most_m.__getitem__)
            seen.what += "; the nearest refused"
            if not self._is_refused(better):
                seen.bad.append(f"{name} {chosen_m:.1f} m, but {better} {least_m:.1f} m")

    def _is_refused(self, name: str) -> bool:
        """Return whether a plan to a place is refused from where the way home began."""
        made = self.run.director.plan
        situation = self.run.director.situation
        situation = replace(situation, pose=Known(Pose(made.start, self.heading_deg), None, ""))
        try:
            make_plan(situation, GoTo(target=at(*self.all_places[name]), clearance_m=CLEARANCE_M))
        except RouteError:
            return True
        return False


def called_run(seed: int) -> Called:
    """Run one; return what was seen."""
    one = CalledHome(seed)
    if not one.is_possible:
        return Called(seed, what="skipped: no ground to drive on")
    one.prepare()
    if why_not := one.begin():
        return Called(seed, what=f"skipped: {why_not}")
    speed_mps = one.vehicle.rover.body.speed_mps
    one.raise_call()
    one.end()
    seen = one.seen(seed)
    seen.moved_mps = speed_mps
    return seen


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--step", type=int, default=1, help="of the seeds, for several processes")
    options = parser.parse_args()
    seen: Counter[str] = Counter()
    times: dict[str, list[float]] = defaultdict(list)
    bad, done, seed = 0, 0, options.seed
    while done < options.runs:
        try:
            one = called_run(seed)
        except AssertionError as error:
            one = Called(seed, what="no end", bad=[str(error)[:300]])
        seed += options.step
        if one.what.startswith("skipped"):
            continue
        done += 1
        seen[f"{one.call}: {one.what}"] += 1
        if one.bad:
            bad += 1
        late = one.to_drive_s is not None and one.to_drive_s > (BAD_S if one.is_bad_link else CLEAN_S)
        if one.to_drive_s is not None:
            times[
                f"{'bad' if one.is_bad_link else 'clean'} link, from {round(2 * one.moved_mps) / 2:.1f} m/s: to driving"
            ].append(one.to_drive_s)
            if one.after_rest_s is not None:
                times[f"{'bad' if one.is_bad_link else 'clean'} link: from standing to driving"].append(
                    one.after_rest_s
                )
        times["in RTL"].append(one.in_rtl_s)
        print(
            f"seed {one.seed}: {one.call}, {one.moment}, {'bad' if one.is_bad_link else 'clean'} link, {one.moved_mps:.1f} m/s: {one.what}; "
            f"drove {'-' if one.to_drive_s is None else f'{one.to_drive_s:.2f} s'} after the call{', LATE' if late else ''}"
            + (f"; BAD {one.bad}" if one.bad else ""),
            flush=True,
        )
    print("\n".join(f"{count:5d} {what}" for what, count in sorted(seen.items())))
    for name, values in sorted(times.items()):
        values.sort()
        print(
            f"{name}: {len(values)}, median {values[len(values) // 2]:.2f} s, 95 of 100 {values[int(0.95 * (len(values) - 1))]:.2f} s, most {values[-1]:.2f} s"
        )
    print(f"bad: {bad} of {done}")
    raise SystemExit(bool(bad))


if __name__ == "__main__":
    main()
