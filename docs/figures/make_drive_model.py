"""Draw the figure of docs/drive-model.md: ``python docs/figures/make_drive_model.py``."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from shapely.plotting import plot_polygon

from missions.drive_model import envelope
from missions.geo import LatLon
from missions.ground.frame import LocalFrame
from missions.vehicle import Steering, Vehicle

HERE = Path(__file__).parent
DRIVE = HERE.parents[1] / "tests" / "missions" / "drive_model" / "data" / "drives" / "yard-3m.csv"
FAST = Vehicle(waypoint_radius_m=3.0, speed_mps=5.0)
SLOW = Vehicle(waypoint_radius_m=2.0, speed_mps=2.0)


def main() -> None:
    mpl.use("Agg")
    mpl.rcParams["svg.hashsalt"] = "drive-model"  # the same file from each run
    figure, panels = plt.subplots(2, 2, figsize=(11, 10), layout="constrained")
    cut, swing, start, drive = panels.flat
    draw(cut, bent(40, 60, 75), FAST, (-8, 20, -20, 8), "75° at 5 m/s, WP_RADIUS 3: it cuts the corner")
    note(cut, "blend of the two\nlegs' motions", (1.2, -1.2), (7, -9))
    note(cut, "0.30 m on the inside,\n0.45 m elsewhere", (-0.45, -15), (3, -16))
    draw(swing, bent(20, 40, 140), SLOW, (-4, 12, -14, 4), "140° at 2 m/s: steered wheels swing out …")
    note(swing, "swing and band", (2.6, -0.6), (5, 1.5))
    note(swing, "… and the tail is down\nto a third in 5 s", (6.2, -5.6), (6.8, -3))
    pivoted = Vehicle(waypoint_radius_m=2.0, speed_mps=2.0, steering=Steering.SKID)
    draw(
        start,
        bent(20, 40, 90),
        SLOW,
        (-5, 15, -24, 4),
        "Starting with the heading 120° off",
        120.0,
    )
    area = envelope(bent(20, 40, 90), pivoted, heading_deg=120.0).area
    plot_polygon(area, ax=start, add_points=False, facecolor="none", edgecolor="tab:green", linestyle="--")
    note(start, "start: swings to\nwhere it faces", (1.3, -18), (4, -20))
    note(start, "dashed: skid steer, pivots", (0.3, -0.3), (-4.5, 2.2))
    recorded(drive)
    figure.savefig(HERE / "drive-model.svg", metadata={"Date": None})


def bent(before_m: float, after_m: float, turn_deg: float) -> np.ndarray:
    turn_rad = math.radians(turn_deg)
    return np.array([(0, -before_m), (0, 0), (after_m * math.sin(turn_rad), after_m * math.cos(turn_rad))])


def draw(
    panel: plt.Axes,
    points: np.ndarray,
    vehicle: Vehicle,
    view: tuple[float, float, float, float],
    title: str,
    heading_deg: float = 0.0,
) -> None:
    area = envelope(points, vehicle, heading_deg=heading_deg).area
    plot_polygon(area, ax=panel, add_points=False, facecolor="tab:blue", edgecolor="tab:blue", alpha=0.3)
    panel.plot(*points.T, "k.-", linewidth=1)
    panel.set(
        xlim=view[:2], ylim=view[2:], aspect="equal", title=title, xlabel="east [m]", ylabel="north [m]"
    )


def note(panel: plt.Axes, text: str, at: tuple[float, float], text_at: tuple[float, float]) -> None:
    panel.annotate(text, at, text_at, arrowprops={"arrowstyle": "->"}, fontsize=9)


def recorded(panel: plt.Axes) -> None:
    with DRIVE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    places = [LatLon(float(row["lat_deg"]), float(row["lon_deg"])) for row in rows]
    local = LocalFrame(places[0]).to_local_array(places)
    count = sum(row["kind"] == "waypoint" for row in rows)
    first = local[1] - local[0]
    view = (-3, 42, 12, 47)
    heading_deg = math.degrees(math.atan2(*first))
    draw(panel, local[:count], FAST, view, "ArduPilot Rover (red) in its envelope", heading_deg)
    panel.plot(*local[count:].T, color="tab:red", linewidth=1.5)


if __name__ == "__main__":
    main()
