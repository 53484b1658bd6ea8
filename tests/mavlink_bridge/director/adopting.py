"""Bridges killed while they drive, and begun anew: `python tests/mavlink_bridge/director/adopting.py --runs 200 --foreign 50`.

Each run is seeded: a target, a link, a moment of the drive, how long nobody is there, and whether a fence is put across the rest of the route, while
nobody is there or after. Also the drives that are not to be adopted. The tests run a few of each.
"""

from __future__ import annotations

import argparse
import itertools
import json
import random
import sys
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from director.conducting import Conductor

from mavlink_bridge.backup.drive_note import DriveNote, note_from_json, note_to_json
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.director import Director, EventName, Orders, State
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.simulator import SimulatedVehicle, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, distance_m
from missions.items import Command
from missions.request import Request

YARD = read_fence(Path(__file__).parents[2] / "fields" / "yard-fence.waypoints")
HOME = LatLon(40.071374, -105.229930)
TARGETS = (
    LatLon(40.0720926, -105.2286152),
    LatLon(40.0712500, -105.2292000),
    LatLon(40.0719500, -105.2300500),
)
UID = b"rover one"
RADIUS_M = 2.0
AHEAD_M = 16.0
"""A rover of 3 m/s rolls on for 6 m, and on a bad link HOLD and fence take a second or two."""

HELD_S: dict[str, list[float]] = {"fence while away": [], "fence after": []}
"""How long each run took to HOLD: from when the drive was adopted, or from when the fence was complete on the vehicle."""

FOREIGN = (
    "no note",
    "other board",
    "no uid",
    "other mission",
    "one item",
    "one item less",
    "manual",
    "hold",
    "disarmed",
    "rebooted",
)


@dataclass
class Killed:
    """A bridge that drives, and can be killed and begun anew.

    Parameters
    ----------
    seed : int
        Of everything that happens.
    target : LatLon, optional
        Where it drives; default: by the seed.
    """

    seed: int
    target: LatLon | None = None
    is_clean: bool = False
    latency_s: float = 0.0

    def __post_init__(self) -> None:
        self.random = random.Random(self.seed)
        self.target = self.target or self.random.choice(TARGETS)
        loss = 0.0 if self.is_clean else self.random.choice((0.0, 0.0, 0.05))
        self.orders = Orders(request=Request(clearance_m=2.5), upload=True, drive=True, arm=True)
        config = SimulatorConfig(
            home=HOME,
            fence=fence_to_items(YARD),
            parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": self.random.choice((2.0, 3.0))},
            uid=UID,
        )
        faults = Faults(loss=loss, duplicate=loss / 2, latency_s=self.latency_s or 2 * loss, jitter_s=loss)
        self.vehicle = SimulatedVehicle(config)
        self.run = Conductor(Director(self.orders), [self.vehicle], faults)
        self.run.run_until(lambda: self.run.director.state is State.READY, 60)
        self.run.director.take_target(self.target, self.run.now_s)
        self.run.run_until(lambda: self.run.director.state is State.DRIVING, 120)
        self.plan = self.run.director.plan

    @property
    def note(self) -> DriveNote:
        """The note as it lies on disk."""
        return note_from_json(json.loads(json.dumps(note_to_json(self.run.note))))

    def drive_on(self, share: float) -> None:
        """Drive for a share of the way, or until shortly before the end."""
        at_s = self.run.now_s + share * 0.9 * self.plan.duration_s
        self.run.run_until(lambda: self.run.now_s >= at_s, 300)

    def be_away(self, time_s: float) -> None:
        """Let time pass with nobody there."""
        until_s = self.run.now_s + time_s
        self.run.director = _Nobody()
        self.run.run_until(lambda: self.run.now_s >= until_s, 300)

    def restart(self, *notes: DriveNote, until: State | None = None, **orders: object) -> None:
        """Begin anew, and go on until the vehicle is learnt or a state is reached."""
        self.run.sent.clear()
        self.run.events.clear()
        self.run.note = None
        self.run.director = Director(replace(self.orders, **orders), None, notes)
        self.run.is_started = False
        director = self.run.director
        is_there = self.run.happened(EventName.LEARNT) if until is None else lambda: director.state is until
        self.run.run_until(is_there, 120)

    def place_ahead(self) -> LatLon | None:
        """Return a place on what is left of the route, as far off as the vehicle needs to stop; None where there is none."""
        here, seq = self.vehicle.position, max(1, self.vehicle.rover.mission_run.seq)
        rest = [here, *self.plan.path[self.plan.path_index(seq) :]]
        along_m, places = 0.0, []
        for a, b in itertools.pairwise(rest):
            leg_m = distance_m(a, b)
            for step in range(int(leg_m)):
                place = LatLon(*(one + (other - one) * step / leg_m for one, other in zip(a, b, strict=True)))
                is_off = distance_m(place, here) > AHEAD_M and distance_m(place, self.target) > RADIUS_M + 4.0
                if along_m + step > AHEAD_M and is_off:
                    places.append(place)
            along_m += leg_m
        return self.random.choice(places) if places else None

    def put_fence(self, place: LatLon) -> None:
        """Let a ground station put a circle there."""
        fence = Fence((*YARD.zones, CircleZone(ZoneKind.EXCLUSION, place, RADIUS_M)))
        machine = Upload(Peer(1, 1, 255, 190), m.MissionType.FENCE, fence_to_items(fence))
        machine.start(self.run.now_s)
        run, vehicle = self.run, self.vehicle
        receive = run.director.receive

        def listen(frame: m.Frame, now_s: float) -> None:
            machine.receive(frame, now_s)
            receive(frame, now_s)

        def serve(run: Conductor) -> None:
            for message in machine.messages_to_send():
                vehicle.receive(m.Frame(255, 190, message), run.now_s)
            machine.handle_timer(run.now_s)

        run.director.receive, run.meddle = listen, serve
        run.run_until(lambda: machine.is_done, 60)
        run.director.receive, run.meddle = receive, None

    def switched(self) -> list[int]:
        """Return the modes that the bridge has asked for since it began anew."""
        commands = (one for one in self.run.sent if isinstance(one, m.CommandLong))
        return [int(one.param2) for one in commands if one.command == Command.DO_SET_MODE]


class _Nobody:
    """A bridge that is not there."""

    pending_backup = pending_plan = pending_ways = deadline_s = identity = drive_note = None
    is_done = False
    state = "nobody"

    def messages_to_send(self) -> list[m.Message]:
        return []

    def note_stored(self) -> None:
        pass

    def receive(self, frame: m.Frame, now_s: float) -> None:
        pass

    def take_events(self) -> list:
        return []


def adopted_run(seed: int) -> str:
    """Kill a bridge at a random moment of its drive and begin it anew; return what was seen, which begins with ``bad`` where it is not as it should be."""
    one = Killed(seed)
    chance, run, vehicle = one.random, one.run, one.vehicle
    one.drive_on(chance.random())
    note, when = one.note, chance.choice(("no fence", "while away", "after"))
    place = one.place_ahead() if when != "no fence" else None
    away_s = chance.uniform(0.0, 3.0)
    if place is not None and when == "while away":
        one.be_away(0.1)
        one.put_fence(place)
    else:
        one.be_away(away_s)
    one.restart(note)
    run.run_until(lambda: run.director.state is not State.READY, 10)
    if not run.happened(EventName.ADOPTED)():
        return f"bad: not adopted: {[event.text for event in run.events]}"
    if place is not None and when == "after":
        ahead = one.place_ahead()
        if ahead is None:
            place = None
        else:
            one.put_fence(ahead)
    adopted_s = next(event.time_s for event in run.events if event.name is EventName.ADOPTED)
    begun_s = run.now_s if when == "after" else adopted_s
    if place is not None:
        run.run_until(lambda: Mode.HOLD in one.switched(), 15)
        HELD_S[f"fence {when}"].append(run.now_s - begun_s)
        run.run_until(lambda: vehicle.mode == Mode.HOLD, 5)
    held_s = run.now_s - begun_s
    run.run_until(lambda: run.director.state is State.ARRIVED or run.happened(EventName.NO_PLAN)(), 300)
    if run.happened(EventName.NO_PLAN)():
        return f"held, no way left; fence {when}" if place is not None else "bad: no plan"
    run.run_until(lambda: run.director.drive_note is None, 10)
    bad = [f"breaches {vehicle.breaches}"] if vehicle.breaches else []
    bad += [f"ends in mode {vehicle.mode}"] if vehicle.mode != Mode.HOLD else []
    bad += (
        [f"ends {distance_m(vehicle.position, one.target):.1f} m off"]
        if distance_m(vehicle.position, one.target) > 4
        else []
    )
    if place is None:
        bad += [f"switched {one.switched()}"] if set(one.switched()) != {Mode.HOLD} else []
        return f"bad: {bad}" if bad else "arrived"
    return f"bad: {bad}, held after {held_s:.1f} s" if bad else f"held and arrived; fence {when}"


def foreign_run(seed: int, kind: str) -> str:
    """Begin anew beside a drive that is none of ours; return what was seen."""
    one = Killed(seed, TARGETS[0], is_clean=True)
    run, vehicle = one.run, one.vehicle
    one.drive_on(one.random.uniform(0.0, 0.6))
    note = one.note
    items = list(note.mission)
    changed = one.random.randrange(1, len(items))
    altered = replace(items[changed], lat_e7=items[changed].lat_e7 + 1)
    notes = {
        "other board": [replace(note, vehicle=VehicleMark(1, "another board"))],
        "no uid": [replace(note, vehicle=VehicleMark(1))],
        "other mission": [replace(note, mission=tuple(reversed(items)))],
        "one item": [replace(note, mission=(*items[:changed], altered, *items[changed + 1 :]))],
        "one item less": [replace(note, mission=(*items[:changed], *items[changed + 1 :]))],
        "no note": [],
    }.get(kind, [note])
    if kind in ("manual", "hold"):
        vehicle.receive(m.Frame(255, 190, m.SetMode(1, 1, Mode.HOLD if kind == "hold" else 0)), run.now_s)
    elif kind == "disarmed":
        vehicle.receive(m.Frame(255, 190, m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM)), run.now_s)
    elif kind == "rebooted":
        notes = [replace(note, boot_ms=note.boot_ms + 10_000_000)]
    one.be_away(one.random.uniform(0.1, 1.0))
    mode = vehicle.mode
    place = one.place_ahead()
    one.restart(*notes)
    if place is not None:
        one.put_fence(place)
    until_s = run.now_s + 12
    run.run_until(lambda: run.now_s >= until_s, 20)
    told = [event.data["reason"] for event in run.events if event.name is EventName.NOT_ADOPTED]
    is_left = not one.switched() and vehicle.mode == mode and not run.happened(EventName.ADOPTED)()
    return (
        f"{kind}: {told[0]}"
        if is_left and len(told) == 1
        else f"bad: {kind}: told {told}, switched {one.switched()}"
    )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--foreign", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    seen: Counter[str] = Counter()
    for number in range(options.runs + options.foreign):
        seed = options.seed + number
        is_foreign = number >= options.runs
        try:
            what = foreign_run(seed, FOREIGN[number % len(FOREIGN)]) if is_foreign else adopted_run(seed)
        except AssertionError as error:
            what = f"bad: {error}"
        if what.startswith("bad"):
            print(f"seed {seed}: {what}", flush=True)
            what = "bad"
        seen[what] += 1
    print("\n".join(f"{count:5d} {what}" for what, count in sorted(seen.items())))
    for name, held_s in HELD_S.items():
        held_s.sort()
        if held_s:
            middle_s, late_s = held_s[len(held_s) // 2], held_s[int(0.95 * (len(held_s) - 1))]
            print(
                f"{name}, to HOLD: {len(held_s)}, median {middle_s:.2f} s, 95 of 100 {late_s:.2f} s, most {held_s[-1]:.2f} s"
            )
    raise SystemExit(bool(seen["bad"]))


if __name__ == "__main__":
    main()
