"""Whether a calibration holds what it says: a simulated rover whose steering law is worse than its parameters say, calibrated by its drives, then driven anew.

``python benchmarks/calibration.py [--samples 2400 8000 18000] [--kept-back 2000] [--corners 20000] [--drives 200] [--circle 2.6] [--jobs 2] [--lines FILE] [-o FILE]``. Drives of
ten corners each (20 to 135 degrees, legs of 12 to 40 m, 2 m/s) are simulated in stepped time; the vehicle's own positions, five a second, go through the grading of `pbpp log` and
the classes of `pbpp logs calibrate`, with so many corners to calibrate by. Then counted: of corners kept back those within the calibrated bounds (by the vehicle's own positions and
by the true ones), the bound against the 99 % quantile of all corners, and drives whose true track left the calibrated corridor by more than 0.10 m; at last, how many corners a class
needs until its bound is near that quantile, by samples drawn from all. ``--lines`` keeps each drive; started again it goes on.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import platform
import random
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np
import shapely

from mavlink_bridge.dataset.calibrate import NEARLY, corner_classes, leg_classes, ranks_of_bounds
from mavlink_bridge.logbook.grade import DriveGrader, GradedField, way_of
from mavlink_bridge.logbook.track import TrackFix
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator import body
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.rover import TICK_S
from mavlink_bridge.simulator.vehicle import SimulatedVehicle
from missions.drive_model import envelope
from missions.firmware import Firmware
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import LocalFrame
from missions.items import Command, CoordinateFrame, MissionItem
from missions.situation import Calibration
from missions.vehicle import vehicle_from_parameters
from missions.vehicle.calibration import speed_class, turn_class

HOME = LatLon(40.07, -105.23)
PARAMETERS = {
    "WP_SPEED": 2.0,
    "WP_RADIUS": 2.0,
    "TURN_RADIUS": 0.9,
    "SERVO1_FUNCTION": 26.0,
    "SERVO3_FUNCTION": 70.0,
    "FENCE_ENABLE": 0.0,
}
CORNERS = 10
EVERY_TICKS = 10  # five positions a second
ALLOWED_M = 0.10
NEAR = 1.3
"""A bound is wanted no farther out than so many times the 99 % quantile."""
DRAWS = 1000


def line(seed: int) -> list[tuple[float, float]]:
    """Return the places of a drive, metres east and north."""
    rng = random.Random(seed)
    places, bearing = [(0.0, 0.0)], 0.0
    for _ in range(CORNERS + 1):
        length_m = rng.uniform(12, 40)
        east_m, north_m = places[-1]
        places.append((east_m + length_m * math.sin(bearing), north_m + length_m * math.cos(bearing)))
        bearing += math.radians(rng.choice((-1, 1)) * rng.uniform(20, 135))
    return places


def mission(seed: int) -> list[MissionItem]:
    """Return the waypoints of a drive."""
    frame = LocalFrame(HOME)
    places = [frame.to_lat_lon(LocalPoint(*place)) for place in line(seed)]
    return [
        MissionItem(
            Command.NAV_WAYPOINT,
            CoordinateFrame.GLOBAL,
            (0.0, 0.0, 0.0, 0.0),
            *map(round, (p.lat_deg * 1e7, p.lon_deg * 1e7)),
            0.0,
        )
        for p in places[1:]
    ]


Track = list[tuple[tuple[float, int, float, float], LatLon]]
"""Of each position the time, the mission item, heading and speed; and the place."""


def drive(seed: int, circle_m: float) -> dict[str, object]:
    """Drive a line in AUTO with a turning circle that the parameters do not tell; return its legs as graded by own and by true positions, and the true track."""
    return told(seed, *tracks(seed, circle_m))


def tracks(seed: int, circle_m: float) -> tuple[Track, Track]:
    """Return the own and the true positions of a drive."""
    body._TURNING_CIRCLE_M = circle_m  # noqa: SLF001 - the law that is changed
    vehicle = SimulatedVehicle(
        SimulatorConfig(
            home=HOME,
            heading_deg=0.0,
            mission=tuple(mission(seed)),
            parameters=PARAMETERS,
            firmware=Firmware(4, 6),
            streams=False,
        )
    )
    rover = vehicle.rover
    rover.arm()
    rover.set_mode(Mode.AUTO, 1.0)
    own, true = [], []
    tick = 0
    while rover.mode == Mode.AUTO and not rover.mission_run.is_complete and tick < 40_000:
        if tick % EVERY_TICKS == 0:
            now = (
                1.0 + tick * TICK_S,
                rover.mission_run.seq,
                math.degrees(rover.body.heading_rad) % 360,
                abs(rover.body.speed_mps),
            )
            own.append((now, rover.estimate))
            true.append((now, rover.position))
        tick += 1
        rover.step(1.0 + tick * TICK_S)
    return own, true


def told(seed: int, own: Track, true: Track) -> dict[str, object]:
    """Return what is kept of a drive."""
    frame = LocalFrame(HOME)
    known = vehicle_from_parameters(PARAMETERS, firmware=Firmware(4, 6))
    way = way_of(mission(seed), 1, home_first=True)
    legs = {
        name: graded(track, way, GradedField(frame, None, known), frame)
        for name, track in (("own", own), ("true", true))
    }
    return {
        "seed": seed,
        **legs,
        "track": frame.to_local_array([place for _, place in true]).round(3).tolist(),
    }


def graded(track: list, way: object, field: GradedField, frame: LocalFrame) -> list[dict[str, object]]:
    """Return the legs of a track as `pbpp log` grades them."""
    fixes = [
        TrackFix(time_s, time_s, place, speed_mps, item, heading_deg)
        for (time_s, item, heading_deg, speed_mps), place in track
    ]
    grader = DriveGrader(way, fixes[0], field)
    grader.drive(fixes, frame.to_local_array([fix.position for fix in fixes]), None)
    grade = grader.finish()
    return [asdict(leg) for leg in grade.legs] if grade else []


def columns(drives: list[dict], which: str) -> dict[str, np.ndarray]:
    """Return the corners of drives as `corner_classes` takes them."""
    pairs = [
        (leg, after)
        for one in drives
        for leg, after in itertools.pairwise(one[which])
        if leg["turn_deg"] is not None and leg["is_whole"]
    ]
    legs = [leg for leg, _ in pairs]

    def more(side: str) -> np.ndarray:
        bound = {"inside": "inside_cut_m", "outside": "outside_overshoot_m"}[side]
        return np.array([leg[bound] - leg[f"foreseen_{bound}"] for leg in legs])

    return {
        "turn_deg": np.array([abs(leg["turn_deg"]) for leg in legs]),
        "speed_mps": np.array([leg["speed_mps"] for leg in legs]),
        "stands": np.array([leg["stands"] for leg in legs]),
        "inside_m": more("inside"),
        "outside_m": more("outside"),
        "beyond_m": np.array([max(leg["inside_beyond_m"], leg["outside_beyond_m"]) for leg in legs]),
        "gap_m": np.array([leg["gap_m"] for leg in legs]),
        "is_bounded": np.array([leg["is_bounded"] for leg in legs]),
        "is_at_speed": np.array([all(map(at_speed, pair)) for pair in pairs]),
        "cut": np.array([leg["inside_cut_m"] for leg in legs]),
        "overshoot": np.array([leg["outside_overshoot_m"] for leg in legs]),
        "cut_bound": np.array([leg["foreseen_inside_cut_m"] for leg in legs]),
        "overshoot_bound": np.array([leg["foreseen_outside_overshoot_m"] for leg in legs]),
    }


def at_speed(leg: dict) -> bool:
    """Return whether a leg was driven at the speed in force, as `pbpp logs calibrate` asks."""
    driven_mps = leg["driven_mps"]
    return driven_mps is not None and abs(driven_mps / leg["foreseen_driven_mps"] - 1) <= NEARLY


def calibration_of(drives: list[dict]) -> Calibration:
    """Return the calibration that the drives give."""
    found = columns(drives, "own")
    legs = [leg for one in drives for leg in one["own"] if leg["is_whole"] and leg["straight_m"] is not None]
    straight = {
        "speed_mps": np.array([leg["speed_mps"] for leg in legs]),
        "more_m": np.array([leg["straight_m"] - leg["foreseen_straight_m"] for leg in legs]),
    }
    classes = corner_classes(
        found, vehicle_from_parameters(PARAMETERS), np.ones(len(found["turn_deg"]), bool)
    )
    return Calibration(1, len(drives), "ackermann", tuple(classes), tuple(leg_classes(straight)), PARAMETERS)


def simulated(count: int, first: int, options: argparse.Namespace, kept: dict[int, dict]) -> list[dict]:
    """Return so many drives, those that are kept already not driven again."""
    seeds = range(first, first + count)
    missing = [seed for seed in seeds if seed not in kept]
    with ProcessPoolExecutor(options.jobs) as pool:
        for found in pool.map(partial(drive, circle_m=options.circle), missing, chunksize=4):
            kept[found["seed"]] = found
            if options.lines:
                with options.lines.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(found) + "\n")
    return [kept[seed] for seed in seeds]


def main() -> None:
    """Run it and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--samples", type=int, nargs="+", default=[2400, 8000, 18_000], help="corners to calibrate by"
    )
    parser.add_argument("--kept-back", type=int, default=2000)
    parser.add_argument(
        "--corners", type=int, default=20_000, help="corners whose quantile counts, those above included"
    )
    parser.add_argument("--drives", type=int, default=200)
    parser.add_argument(
        "--circle", type=float, default=2.6, help="turning circle, metres; the parameters tell 1.8"
    )
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lines", type=Path)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    begun_s = time.process_time()
    kept = {}
    if options.lines and options.lines.exists():
        kept = {
            one["seed"]: one
            for one in map(json.loads, options.lines.read_text(encoding="utf-8").splitlines())
        }
    back_drives, *samples = (math.ceil(number / CORNERS) for number in (options.kept_back, *options.samples))
    every = simulated(max(math.ceil(options.corners / CORNERS), back_drives + max(samples)), 0, options, kept)
    back = every[:back_drives]
    fresh = simulated(options.drives, 1_000_000, options, kept)
    parts = [head(options, len(back), len(columns(every, "own")["turn_deg"]))]
    for count in samples:
        calibration = calibration_of(every[back_drives : back_drives + count])
        parts.append(f"{count} drives to calibrate by:")
        parts.append("\n".join(classes(calibration, every)))
        parts.append("\n".join([*kept_back(calibration, back), *driven_anew(calibration, fresh)]))
    parts.append("\n".join(needed(every)))
    parts.append(f"{time.process_time() - begun_s:.0f} CPU s in this process")
    text = "\n\n".join(parts) + "\n"
    print(text)
    if options.output:
        options.output.write_text(text, encoding="utf-8")


def head(options: argparse.Namespace, back: int, corners: int) -> str:
    """Return what was driven, with what."""
    versions = f"Python {platform.python_version()}, numpy {np.__version__}"
    drives = f"{back} drives kept back, {CORNERS} corners each; 99 % quantiles of {corners} corners"
    return f"{versions}; turning circle {options.circle} m where the parameters tell 1.8 m; {drives}"


def classes(calibration: Calibration, every: list[dict]) -> Iterator[str]:
    """Yield the table of a calibration's classes: each bound beside what 99 % of all corners kept; of the bounds told for its corners, which depend on the legs, their 99 % quantile."""
    yield "| turn | corners | adds inside | adds outside | corridor grows | cut: bound / 99 % | overshoot: bound / 99 % |"
    yield "|---|---|---|---|---|---|---|"
    everything = columns(every, "own")
    turns = np.array([turn_class(turn) for turn in everything["turn_deg"]])
    for one in calibration.corners:
        these = turns == turn_class(one.turn_from_deg)
        cells = [
            f"{one.turn_from_deg:.0f} to {one.turn_to_deg:.0f}°",
            str(one.corners),
            f"{one.inside_more_m:.3f} m",
            f"{one.outside_more_m:.3f} m",
            f"{one.beyond_m:.3f} m",
        ]
        for name, more_m in (("cut", one.inside_more_m), ("overshoot", one.outside_more_m)):
            q99 = float(np.quantile(everything[name][these], 0.99))
            bound = float(np.quantile(everything[f"{name}_bound"][these], 0.99)) + more_m
            cells.append(f"{bound:.2f} / {q99:.2f} = {bound / q99:.2f}")
        yield f"| {' | '.join(cells)} |"


def needed(every: list[dict]) -> Iterator[str]:
    """Yield how far out bounds are by the number of corners of a class, of samples drawn from all corners of it."""
    everything = columns(every, "own")
    turns = np.array([turn_class(turn) for turn in everything["turn_deg"]])
    rng = np.random.default_rng(1)
    yield f"| corners of the class | bound / 99 %: median, 95 % of {DRAWS} samples, of the worst class | samples of the worst class with at most {NEAR} |"
    yield "|---|---|---|"
    for count in (300, 473, 773, 1000, 1500, 2000, 3000):
        ratios = []
        for turn in np.unique(turns):
            these = turns == turn
            if these.sum() < 1000:  # a stray corner beside the classes that are driven
                continue
            for name, side, rank in zip(
                ("cut", "overshoot"), ("inside_m", "outside_m"), ranks_of_bounds(count), strict=True
            ):
                drawn = rng.choice(everything[side][these], (DRAWS, count))
                more_m = np.partition(drawn, rank - 1, axis=1)[:, rank - 1]
                bound_m = np.quantile(everything[f"{name}_bound"][these], 0.99) + more_m
                ratios.append(bound_m / np.quantile(everything[name][these], 0.99))
        worst = [max(float(np.quantile(ratio, share)) for ratio in ratios) for share in (0.5, 0.95)]
        least = min(float((ratio <= NEAR).mean()) for ratio in ratios)
        yield f"| {count} | {worst[0]:.2f}, {worst[1]:.2f} | {least:.1%} |"


def kept_back(calibration: Calibration, back: list[dict]) -> Iterator[str]:
    """Yield how many of the corners kept back were within the bounds and the corridor."""
    more = {
        (turn_class(one.turn_from_deg), speed_class(one.speed_from_mps)): one for one in calibration.corners
    }
    for which in ("own", "true"):
        found = columns(back, which)
        mine = [
            more.get((turn_class(t), speed_class(s)))
            for t, s in zip(found["turn_deg"], found["speed_mps"], strict=True)
        ]
        inside = sum(
            one is not None and i <= one.inside_more_m and o <= max(one.outside_more_m, 0.0)
            for one, i, o in zip(mine, found["inside_m"], found["outside_m"], strict=True)
        )
        held = sum(
            one is not None and far <= one.beyond_m for one, far in zip(mine, found["beyond_m"], strict=True)
        )
        without = int(((found["inside_m"] <= 0) & (found["outside_m"] <= 0)).sum())
        yield (
            f"- of {len(mine)} corners kept back, by the {which} positions: {inside} ({inside / len(mine):.2%}) within both bounds, {held} ({held / len(mine):.2%}) within the corridor; "
            f"without calibration {without} ({without / len(mine):.2%}) and {int((found['beyond_m'] <= 0).sum())}"
        )


def driven_anew(calibration: Calibration, fresh: list[dict]) -> Iterator[str]:
    """Yield how many new drives left the corridor, with the calibration and without."""
    plain = vehicle_from_parameters(PARAMETERS, firmware=Firmware(4, 6))
    for name, known in (("with", replace(plain, calibration=calibration)), ("without", plain)):
        beyond = []
        for one in fresh:
            area = envelope(line(one["seed"]), known, heading_deg=0.0).area
            shapely.prepare(area)
            beyond.append(float(shapely.distance(area, shapely.points(np.array(one["track"]))).max()))
        yield f"- of {len(fresh)} fresh drives {sum(far > ALLOWED_M for far in beyond)} left the corridor {name} calibration by more than {ALLOWED_M} m (the farthest by {max(beyond):.2f} m), by their true track"


if __name__ == "__main__":
    main()
