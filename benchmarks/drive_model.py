"""How the drive model bounds 5,270 measured corners, what room it wastes, and how well it tells times.

Run: ``python benchmarks/drive_model.py`` (``--by-turn`` for one line a turning angle, ``--drives DIR`` for recorded runs, ``--left-unused`` for the table of
`missions.vehicle.measured_corners`).

Each file of rows is a few long missions; rows that follow on one another are put together again, so that the tails of earlier corners
are where they were. Excess is measured minus foreseen (above 0: the model was too narrow), waste the other way round.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from missions.drive_model import Corner, Envelope, envelope
from missions.geo import LatLon
from missions.ground.frame import LocalFrame
from missions.vehicle import Steering, Vehicle
from missions.vehicle.calibration import speed_class, turn_class

HERE = Path(__file__).parent
DRIVES = HERE.parent / "tests" / "missions" / "drive_model" / "data" / "drives"
Row = dict[str, str]
LEAST_ROWS = (
    16  # of a class of corners, to say what they left unused; chosen: a class with fewer has four at most
)
SLOW = {"slow1at5": (1.0, 5.0), "slow1at10": (1.0, 10.0), "slow1at15": (1.0, 15.0), "slow2at10": (2.0, 10.0)}
"""Speed of the slow stretch, and how far before the corner it begins; it ends 6 m after it."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--by-turn", action="store_true")
    parser.add_argument("--left-unused", action="store_true")
    parser.add_argument("--drives", type=Path, default=DRIVES)
    options = parser.parse_args()
    if options.left_unused:
        for name, more_m in left_unused().items():
            print(f"    {name}: {more_m},")
        return
    cells: dict[tuple[str, ...], list[tuple[Row, Corner, float]]] = defaultdict(list)
    started, points = time.perf_counter(), 0
    for mission in missions():
        track, numbers, lost_s = foreseen(mission)
        points += len(track.points)
        corners = {corner.waypoint: corner for corner in track.corners}
        for row, number in zip(mission, numbers, strict=True):
            cells[cell(row, by_turn=options.by_turn)].append((row, corners[number], lost_s(number)))
    spent_s = time.perf_counter() - started
    print(HEADER)
    for name in sorted(cells):
        print(line(name, cells[name]))
    print(f"\n{sum(map(len, cells.values()))} corners; {points} points foreseen in {spent_s:.2f} s\n")
    print("recorded drive   time [s]: foreseen  measured  error   farthest outside the envelope [m]")
    for path in sorted(options.drives.glob("*.csv")):
        print(recorded(path))


HEADER = (
    f"{'cell':44s} rows | inside [m]: excess  n>0.1  waste med  p90 | outside: excess  n>0.1  waste med  p90"
    " | time error [s]: median  p10  p90"
)


def cell(row: Row, *, by_turn: bool) -> tuple[str, ...]:
    kind = "clean" if (row["set"], row["rep"]) == ("long", "1") else row["set"]
    # The measured skid-steer model could not reach 5 m/s.
    fair = (
        "too fast" if (row["vehicle"], row["wp_speed_mps"]) == ("skid", "5") else f"{row['wp_speed_mps']} m/s"
    )
    turn = (f"{abs(int(row['turn_deg'])):3d} deg",) if by_turn else ()
    return (row["vehicle"], kind, fair, *turn)


def left_unused() -> dict[tuple[str, int, int], tuple[float, float]]:
    """Return by steering, class of angle and class of speed how far the nearest row stayed within its bounds (negative), inside and outside; 0 where it did not."""
    found: dict[tuple[str, int, int], list[tuple[float, float]]] = defaultdict(list)
    for mission in missions():
        track, numbers, _ = foreseen(mission)
        corners = {corner.waypoint: corner for corner in track.corners}
        for row, number in zip(mission, numbers, strict=True):
            corner = corners[number]
            # The measured skid-steer model could not reach 5 m/s.
            if corner.stops or not corner.bounded or (row["vehicle"], row["wp_speed_mps"]) == ("skid", "5"):
                continue
            excess_m = (
                float(row["inside_cut_m"]) - corner.inside_cut_m,
                float(row["outside_overshoot_m"]) - corner.outside_overshoot_m,
            )
            classes = turn_class(float(row["turn_deg"])), speed_class(float(row["wp_speed_mps"]))
            found[row["vehicle"], *classes].append(excess_m)
    unused = {
        name: tuple(min(0.0, math.ceil(max(side) * 1000) / 1000) for side in zip(*rows, strict=True))
        for name, rows in sorted(found.items())
        if len(rows) >= LEAST_ROWS
    }
    return {name: more_m for name, more_m in unused.items() if any(more_m)}


def line(name: tuple[str, ...], found: list[tuple[Row, Corner, float]]) -> str:
    inside_m = np.array([float(row["inside_cut_m"]) - corner.inside_cut_m for row, corner, _ in found])
    outside_m = np.array(
        [float(row["outside_overshoot_m"]) - corner.outside_overshoot_m for row, corner, _ in found]
    )
    times_s = np.array([float(row["time_lost_s"]) - lost_s for row, _, lost_s in found if row["time_lost_s"]])
    text = f"{', '.join(name):44s} {len(found):4d} |"
    for excess_m in (inside_m, outside_m):
        low, high = np.percentile(-excess_m, [50, 90])
        text += f"  {excess_m.max():10.2f} {(excess_m > 0.1).sum():9d} {low:9.2f} {high:6.2f} |"
    return text + "".join(f" {value:9.2f}" for value in np.percentile(times_s, [50, 10, 90]))


def missions() -> Iterator[list[Row]]:
    """Return the rows mission by mission: those whose track goes on where the row before left off."""
    for name in ("corners.csv", "corners_extra.csv"):
        mission: list[Row] = []
        with (HERE / "data" / name).open(newline="") as file:
            for row in csv.DictReader(file):
                if mission and not follows(mission[-1], row):
                    yield mission
                    mission = []
                mission.append(row)
        yield mission


def follows(before: Row, row: Row) -> bool:
    same = all(before[key] == row[key] for key in ("vehicle", "wp_radius_m", "wp_speed_mps", "set", "rep"))
    if not same or before["leg_after_m"] != row["leg_before_m"]:
        return False
    left_off, goes_on = before["dev_window_end_m"], row["dev_window_start_m"]
    return bool(left_off and goes_on) and abs(abs(float(left_off)) - abs(float(goes_on))) < 0.002


def foreseen(mission: list[Row]) -> tuple[Envelope, list[int], Lost]:
    first = mission[0]
    speed_mps = float(first["wp_speed_mps"])
    vehicle = Vehicle(
        waypoint_radius_m=float(first["wp_radius_m"]),
        speed_mps=speed_mps,
        steering=Steering(first["vehicle"]),
    )
    walk = Walk()
    numbers = []
    slow_mps, before_m = SLOW.get(first["set"], (None, 0.0))
    after_m = 6.0 if slow_mps else 0.0
    for number, row in enumerate(mission):
        walk.go(float(row["leg_before_m"]) - before_m - (after_m if number else 0.0), None)
        if slow_mps:
            walk.go(before_m, slow_mps)
        numbers.append(len(walk.points) - 1)
        walk.bearing_rad += math.radians(float(row["turn_deg"]))
        if slow_mps:
            walk.go(after_m, slow_mps)
    walk.go(float(mission[-1]["leg_after_m"]) - after_m, None)
    stops = dict.fromkeys(numbers, 1.0) if first["set"] == "delay" else None
    track = envelope(walk.points, vehicle, heading_deg=0.0, speeds=walk.speeds, stops=stops)
    return track, numbers, Lost(track, slow=bool(slow_mps), ideal_s=(before_m + after_m) / speed_mps)


class Walk:
    """Points laid one after another."""

    def __init__(self) -> None:
        self.points = [(0.0, 0.0)]
        self.speeds: list[float | None] = []
        self.bearing_rad = 0.0

    def go(self, length_m: float, speed_mps: float | None) -> None:
        east_m, north_m = self.points[-1]
        east_m += length_m * math.sin(self.bearing_rad)
        north_m += length_m * math.cos(self.bearing_rad)
        self.points.append((east_m, north_m))
        self.speeds.append(speed_mps)


class Lost:
    """The time lost at a corner; for a slow stretch from its beginning to its end."""

    def __init__(self, track: Envelope, *, slow: bool, ideal_s: float) -> None:
        self.corners = {corner.waypoint: corner for corner in track.corners}
        self.track, self.slow, self.ideal_s = track, slow, ideal_s

    def __call__(self, number: int) -> float:
        if not self.slow:
            return self.corners[number].time_lost_s
        edges_s = sum(self.corners[edge].time_lost_s for edge in (number - 1, number + 1)) / 2
        return (
            float(self.track.arrivals_s[number + 1] - self.track.arrivals_s[number - 1])
            - self.ideal_s
            + edges_s
        )


def recorded(path: Path) -> str:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    places = [LatLon(float(row["lat_deg"]), float(row["lon_deg"])) for row in rows]
    local = LocalFrame(places[0]).to_local_array(places)
    count = sum(row["kind"] == "waypoint" for row in rows)
    bearing_deg = math.degrees(math.atan2(*(local[1] - local[0])))
    track = envelope(local[:count], Vehicle(waypoint_radius_m=3.0, speed_mps=5.0), heading_deg=bearing_deg)
    measured_s = float(rows[-1]["time_s"]) - float(rows[count]["time_s"])
    outside_m = shapely.distance(track.area, shapely.points(local[count:])).max()
    error = track.duration_s / measured_s - 1
    return f"{path.stem:28s} {track.duration_s:8.1f} {measured_s:9.1f} {error:+6.1%} {outside_m:12.2f}"


if __name__ == "__main__":
    main()
