"""Drives of the simulated PX4 rover, measured as the real ones were: metres off the lines, by its own position."""

from __future__ import annotations

import cmath
import csv
import itertools
import math
from dataclasses import dataclass
from pathlib import Path

from simulator.station import Bench, at

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.simulator import SimulatorConfig
from missions.firmware import Firmware
from missions.items import Command, waypoint

OLD, NEW = Firmware(1, 17, 0), Firmware(1, 18, 0, 0)
ROWS_FILE = Path(__file__).parents[3] / "missions" / "drive_model" / "data" / "px4_corners.csv"


def rows():
    """Return the measured corners."""
    with ROWS_FILE.open(encoding="ascii", newline="") as file:
        return list(csv.DictReader(file))


def parameters_of(row):
    """Return what differed from the airframe's defaults in a row."""
    name = row["run"]
    changes = {"RO_SPEED_LIM": float(row["speed_mps"])}
    if name.startswith("noacc"):
        changes["RA_ACC_RAD_MAX"] = -1.0
    if name.startswith("acc"):
        changes["NAV_ACC_RAD"] = float(name.split()[1])
    if name.startswith("nored"):
        changes["RO_SPEED_RED"] = -1.0
    return changes


def rover(firmware=NEW, *, heading_deg=0.0, **parameters):
    """Return a bench with a PX4 rover at home."""
    return Bench(
        SimulatorConfig(
            autopilot=m.Autopilot.PX4,
            firmware=firmware,
            streams=False,
            heading_deg=heading_deg,
            parameters=parameters,
        )
    )


def placed_way(*places_m):
    """Return waypoints at places, north + east j."""
    return [waypoint(at(place.real, place.imag)) for place in places_m]


def start(bench, items):
    """Upload a mission and start it."""
    bench.upload(items)
    assert bench.command(Command.MISSION_START) == m.MavResult.ACCEPTED


def follow(bench, limit_s, *, until=lambda _bench: False, every_s=0.05):
    """Let time pass; return each place with the item under way and the speed."""
    track = []
    end_s = bench.now_s + limit_s
    while bench.now_s < end_s and not until(bench):
        bench.run(every_s)
        motion = bench.vehicle.rover.motion
        track.append((motion.position_m, bench.vehicle.rover.progress.seq, motion.speed_mps))
    return track


def is_done(bench):
    """Whether the mission is over and the rover stands."""
    rover_ = bench.vehicle.rover
    return rover_.progress.is_complete and rover_.motion.speed_mps == 0


@dataclass(frozen=True)
class DrivenCorner:
    """What was measured of a corner."""

    switch_m: float
    inside_m: float
    outside_m: float


def corner(turn_deg, leg_m, firmware=NEW, **parameters):
    """Drive one corner and measure it."""
    bench = rover(firmware, **parameters)
    wp, turn_rad = complex(leg_m, 0.0), math.radians(turn_deg)
    after = cmath.rect(1.0, turn_rad)
    start(bench, placed_way(wp, wp + leg_m * after))
    track = follow(bench, 90.0, until=is_done)
    switched = next(n for n, (_, seq, _) in enumerate(track) if seq == 1)
    later = [(place - wp) for place, *_ in track[switched:]]
    inside_m = max(
        0.0,
        *(min(_off(place, -1.0 + 0j), _off(place, after)) for place in later if _is_inside(place, after)),
        0.0,
    )
    outside_m = max((-(place / after).imag for place in later if (place / after).real > -1.0), default=0.0)
    return DrivenCorner(abs(track[switched][0] - wp), inside_m, max(0.0, outside_m))


def _off(place, direction):
    """Return the distance of a place from a ray from 0."""
    turned = place / direction
    return abs(turned.imag) if turned.real > 0 else abs(turned)


def _is_inside(place, after):
    """Whether a place lies between the legs of a turn to the right: to the right of the first and of the second."""
    return place.imag > 0 and (place / after).imag > 0


@dataclass(frozen=True)
class DrivenHold:
    """What was measured of a HOLD on the way north."""

    ahead_m: float
    aside_m: float
    rest_m: float
    took_s: float


def hold(speed_mps, firmware=NEW):
    """Switch to HOLD on a straight leg and measure where it goes."""
    bench = rover(firmware, RO_SPEED_LIM=speed_mps)
    start(bench, placed_way(60 + 0j))
    follow(bench, 8.0)
    here = bench.vehicle.rover.motion.position_m
    begin_s = bench.now_s
    bench.command(Command.DO_SET_MODE, 1, 4, 3)
    track = follow(bench, 15.0, until=lambda one: one.vehicle.rover.is_idle)
    places = [place - here for place, *_ in track]
    return DrivenHold(
        max(place.real for place in places),
        max(abs(place.imag) for place in places),
        abs(places[-1]),
        bench.now_s - begin_s,
    )


@dataclass(frozen=True)
class DrivenWait:
    """What was measured of a wait of 10 s on the way north, from the waypoint."""

    before_m: float
    past_m: float
    aside_m: float
    driven_m: float
    stood_s: float
    stood_off_m: float


def wait(speed_mps, items, firmware):
    """Wait 20 m to the north, then go on to the east; measure the wait."""
    bench = rover(firmware, RO_SPEED_LIM=speed_mps)
    start(bench, [*items, *placed_way(20 + 30j)])
    progress = bench.vehicle.rover.progress
    follow(bench, 60.0, until=lambda one: one.vehicle.rover.progress.wait_until_s is not None)
    track = follow(bench, 30.0, until=lambda one: one.vehicle.rover.progress.wait_until_s is None)
    assert progress is not None
    places = [place - 20 for place, *_ in track]
    standing = [place for place, _, speed in track if speed == 0]
    return DrivenWait(
        -min(place.real for place in places),
        max(place.real for place in places),
        max(abs(place.imag) for place in places),
        sum(abs(b - a) for a, b in itertools.pairwise(places)),
        0.05 * len(standing),
        abs(standing[-1] - 20) if standing else math.nan,
    )
