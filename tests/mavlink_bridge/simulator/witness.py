"""Drives of the measured tables done again by the simulated rover, and measured in the same way.

Places are metres along the first line and to its right, from the start; in `start_in_margin.csv` along leads away from the wall.
"""

from __future__ import annotations

import cmath
import csv
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from simulator.station import HOME, at, placed, vertex
from simulator.tracks import SKID, TICK_S

from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.parameters import ParameterStore
from mavlink_bridge.simulator.rover import Rover
from missions.items import Command, waypoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.items import MissionItem

DATA = Path(__file__).parent / "data"
STANDS_S = 10.0
"""A rover that stands so long in AUTO stands for good (20 s in the tables, which cost more time and change nothing)."""

_FAR_M = 600.0


def rows_of(name: str) -> list[dict[str, str]]:
    """Return the rows of a table in ``data/``; lines that begin with # say where it is from."""
    with (DATA / name).open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@dataclass
class Drive:
    """What is driven: points along and to the right of the line, its fence, its vehicle."""

    points: list[complex]
    parameters: dict[str, float] = field(default_factory=dict)
    fence: list[MissionItem] = field(default_factory=list)
    rings: list[shapely.Geometry] = field(default_factory=list)
    heading_deg: float = 0.0
    edge_m: float = math.nan
    limit_s: float = 60.0
    is_skid: bool = False
    ends_with_auto: bool = True

    def polygon(self, corners: Sequence[complex], *, inclusion: bool) -> None:
        """Add a polygon to the fence."""
        self.fence += [vertex(at(p.real, p.imag), len(corners), inclusion=inclusion) for p in corners]
        self.rings.append(shapely.LinearRing([(p.real, p.imag) for p in corners]))

    def box(self, low: complex, high: complex, *, inclusion: bool = False) -> None:
        """Add a rectangle between two corners."""
        corners = [low, complex(high.real, low.imag), high, complex(low.real, high.imag)]
        self.polygon(corners, inclusion=inclusion)

    def circle(self, centre: complex, radius_m: float, *, inclusion: bool = False) -> None:
        """Add a circle."""
        command = Command.FENCE_CIRCLE_INCLUSION if inclusion else Command.FENCE_CIRCLE_EXCLUSION
        self.fence.append(placed(command, at(centre.real, centre.imag), radius_m))
        self.rings.append(shapely.Point(centre.real, centre.imag).buffer(radius_m, 64).exterior)


@dataclass(frozen=True)
class Driven:
    """What came out: outcome as in the tables, times, places along and aside."""

    outcome: str
    time_s: float
    rest: complex
    furthest_m: float
    aside_m: float
    back_m: float
    short_m: float
    slow_at_m: float
    least_distance_m: float
    breaches: int
    mode: int
    track: np.ndarray = field(repr=False)
    speeds_mps: np.ndarray = field(repr=False)


def rover_of(drive: Drive) -> Rover:
    """Return a rover that has the drive's mission and fence, armed and in AUTO."""
    parameters = {
        "FENCE_ENABLE": 1.0,
        "FENCE_TYPE": 4.0,
        **(SKID if drive.is_skid else {}),
        **drive.parameters,
    }
    mission = [waypoint(HOME), *(waypoint(at(p.real, p.imag)) for p in drive.points)]
    rover = Rover(
        ParameterStore(parameters), HOME, drive.heading_deg, lambda: mission, lambda: tuple(drive.fence)
    )
    rover.mode = Mode.MANUAL
    rover.arm()
    assert rover.set_mode(Mode.AUTO, 0.0)
    return rover


def driven(drive: Drive) -> Driven:
    """Drive it."""
    rover = rover_of(drive)
    now_s, stood_s, outcome = 0.0, 0.0, "time"
    places, speeds = [], []
    speed_mps = rover.parameters["WP_SPEED"]
    while now_s < drive.limit_s:
        now_s += TICK_S
        rover.step(now_s)
        places.append(rover.body.position_m)
        speeds.append(rover.body.speed_mps)
        stood_s = stood_s + TICK_S if abs(rover.body.speed_mps) < 0.02 else 0.0
        if rover.mode != Mode.AUTO and drive.ends_with_auto:
            outcome = f"mode {rover.mode}"
            break
        if rover.mission_run.is_complete and rover.mode == Mode.AUTO:
            outcome = "arrived"
            break
        if stood_s >= STANDS_S:
            outcome = "stands"
            break
    track, fast = np.array(places), np.array(speeds)
    lines = shapely.MultiLineString(drive.rings) if drive.rings else None
    points = shapely.points(track.real, track.imag)
    reached = np.flatnonzero(fast >= 0.95 * speed_mps)
    slow = np.flatnonzero(fast[reached[0] :] < 0.8 * speed_mps) + reached[0] if len(reached) else []
    return Driven(
        outcome,
        now_s,
        complex(track[-1]),
        float(track.real.max()),
        float(abs(track.imag).max()),
        float(-min(0.0, track.real.min())),
        float(drive.edge_m - track.real.max()),
        float(track.real[slow[0]]) if len(slow) else math.nan,
        float(shapely.distance(lines, points).min()) if lines is not None else math.inf,
        rover.breaches,
        int(rover.mode),
        track,
        fast,
    )


@dataclass(frozen=True)
class Stopped:
    """How a rover came to rest: how far along its line, after what time, and where it had half its speed."""

    along_m: float
    time_s: float
    to_half_m: float


def stopped(row: dict[str, str]) -> Stopped:
    """Drive a row of stops.csv: get to speed on a straight line, then stop as it says."""
    parameters = {"WP_SPEED": float(row["set_speed_mps"]), "FENCE_ENABLE": 0.0}
    if row["atc_decel_max"]:
        parameters["ATC_DECEL_MAX"] = float(row["atc_decel_max"])
    # A bend of 1°, so that home does not lie exactly behind: there, where no estimate ever is, a steered rover balances between left and right.
    rover = rover_of(Drive([5 + 0j, 600 + 10.4j], parameters, is_skid=row["vehicle"] == "skid"))
    now_s = 0.0
    while now_s < 10.0 + 2 * parameters["WP_SPEED"]:
        now_s += TICK_S
        rover.step(now_s)
    begin_s, begin_m, speed_mps = now_s, rover.body.position_m.real, rover.body.speed_mps
    assert speed_mps == pytest.approx(float(row["speed_at_command_mps"]), abs=0.05)
    if row["how"] == "disarm":
        rover.disarm()
    else:
        rover.set_mode(Mode[row["how"].upper()], now_s)
    along_m, to_half_m = 0.0, math.nan
    turns = row["how"] == "rtl"  # how far it gets before it comes back
    while (turns or rover.body.speed_mps >= 0.02) and rover.body.position_m.real - begin_m >= along_m - 0.5:
        now_s += TICK_S
        rover.step(now_s)
        assert now_s - begin_s < 60.0
        along_m = max(along_m, rover.body.position_m.real - begin_m)
        if math.isnan(to_half_m) and rover.body.speed_mps <= speed_mps / 2:
            to_half_m = along_m
    return Stopped(along_m, now_s - begin_s, to_half_m)


def drive_of(row: dict[str, str]) -> Drive:
    """Return the drive that a row of fences.csv or start_in_margin.csv is about."""
    parameters = {
        "WP_SPEED": float(row["wp_speed_mps"]),
        "WP_RADIUS": float(row["wp_radius_m"]),
        "FENCE_MARGIN": float(row["fence_margin_m"]),
        "AVOID_ENABLE": float(row["avoid_enable"]),
        "OA_TYPE": float(row["oa_type"]),
        "FENCE_OPTIONS": float(row["fence_options"]),
        "FENCE_ACTION": float(row["fence_action"]),
    }
    drive = Drive([85 + 0j], parameters, is_skid=row["vehicle"] == "skid")
    case, value = row["case"], float(row["case_value"])
    for part in case.split("; "):
        name, _, number = part.partition(" ")
        if name in ("AVOID_BACKUP_SPD", "AVOID_BEHAVE", "FENCE_MARGIN") and number:
            parameters[name] = float(number)
    if "FENCE_MARGIN_XY" in case:
        number = case.rpartition("FENCE_MARGIN_XY")[2].strip()
        parameters["FENCE_MARGIN_XY"] = float(number) if number else value
    _MAKERS[row["test"]](drive, case, value)
    return drive


def _wall_ahead(drive: Drive, case: str, _: float) -> None:
    drive.edge_m = 40.0
    if "inclusion" in case:
        drive.box(-20 - 20j, 40 + 20j, inclusion=True)
    elif "circle" in case:
        drive.circle(50 + 0j, 10.0)
    else:
        drive.box(40 - 20j, 60 + 20j)


def _along_a_wall(drive: Drive, _: str, aside_m: float) -> None:
    drive.points = [90 + 0j]
    drive.box(complex(15, -aside_m - 20), complex(75, -aside_m))


def _corner_at_a_fence(drive: Drive, _: str, inside_m: float) -> None:
    drive.points = [50 + 0j, 50 - 70j]
    drive.limit_s = 70.0
    drive.box(complex(10, -60), complex(50 - inside_m, -inside_m))


def _oblique_wall(drive: Drive, _: str, angle_deg: float) -> None:
    drive.edge_m = 12.0 if drive.parameters["WP_SPEED"] < 5 else 20.0
    direction = cmath.rect(1.0, math.radians(90 - angle_deg))
    drive.points = [direction * (drive.edge_m + 10) / direction.real]
    drive.heading_deg = 90 - angle_deg
    drive.limit_s = 90.0
    drive.box(complex(drive.edge_m, -_FAR_M), complex(drive.edge_m + 50, _FAR_M))


def _fence_action(drive: Drive, _: str, __: float) -> None:
    drive.edge_m = 40.0
    drive.points = [140 + 0j]
    drive.ends_with_auto = False
    drive.limit_s = 80.0
    drive.box(-20 - 20j, 40 + 20j, inclusion=True)


def _intersection(drive: Drive, _: str, overlap_m: float) -> None:
    drive.edge_m = 40.0
    drive.box(-20 - 20j, 40 + 20j, inclusion=True)
    drive.box(complex(40 - overlap_m - 20, -20), 120 + 20j, inclusion=True)


def _notify(drive: Drive, case: str, _: float) -> None:
    if "beside" in case:
        _along_a_wall(drive, case, 1.0)
    else:
        _wall_ahead(drive, case, 0.0)


def _union(drive: Drive, case: str, overlap_m: float) -> None:
    drive.edge_m = 40.0
    drive.limit_s = 100.0 if drive.parameters["FENCE_MARGIN"] < 0.1 else 60.0
    if case.startswith("small"):
        drive.edge_m = 60.0
        drive.box(-20 - 20j, 120 + 20j, inclusion=True)
        drive.box(20 - 10j, 60 + 10j, inclusion=True)
    elif case.startswith("circle then circle"):
        drive.circle(10 + 0j, 30.0, inclusion=True)
        drive.circle(complex(90 - overlap_m), 50.0, inclusion=True)
    elif case.startswith("circle then polygon"):
        drive.circle(10 + 0j, 30.0, inclusion=True)
        drive.box(complex(40 - overlap_m, -20), 120 + 20j, inclusion=True)
    elif case.startswith("polygon then circle"):
        drive.box(-20 - 20j, 40 + 20j, inclusion=True)
        drive.circle(complex(90 - overlap_m), 50.0, inclusion=True)
    elif case.startswith("three"):
        drive.box(-20 - 20j, 40 + 20j, inclusion=True)
        drive.box(complex(40 - overlap_m, -20), 70 + 20j, inclusion=True)
        drive.box(complex(70 - overlap_m, -20), 120 + 20j, inclusion=True)
    elif case.startswith("start"):
        drive.box(-20 - 20j, 40 + 20j, inclusion=True)
        drive.box(complex(10 - overlap_m, -20), 120 + 20j, inclusion=True)
    else:
        drive.box(-20 - 20j, 40 + 20j, inclusion=True)
        drive.box(complex(40 - overlap_m, -20), 120 + 20j, inclusion=True)


_TARGETS = {
    "away": 30 + 0j,
    "away 45": 30 * cmath.rect(1.0, -math.pi / 4),
    "along": -30j,
    "toward 30": 1 - 29.5j,
}
_HEADINGS_DEG = {
    "back to the wall": 0.0,
    "faces the wall": 180.0,
    "along the wall": -90.0,
    "outside the margin": 0.0,
}
_HEADS_FOR_DEG = {"away": 0.0, "away 45": -45.0, "along": -90.0, "toward 30": -120.0}


def _start_inside_margin(drive: Drive, case: str, off_m: float) -> None:
    target, heading = case.split("; ")[:2]
    target = target.removeprefix("target ")
    drive.points = [_TARGETS[target]]
    drive.heading_deg = _HEADINGS_DEG.get(heading, _HEADS_FOR_DEG[target])
    drive.limit_s = 45.0
    if "inclusion" in case:
        drive.box(complex(-off_m, -60), 100 + 60j, inclusion=True)
    else:
        drive.box(complex(-off_m - 30, -60), complex(-off_m, 60))


_MAKERS = {
    "FENCE_MARGIN_XY": _wall_ahead,
    "along a wall": _along_a_wall,
    "corner at a fence": _corner_at_a_fence,
    "fence action": _fence_action,
    "intersection": _intersection,
    "notify": _notify,
    "oblique wall": _oblique_wall,
    "start inside margin": _start_inside_margin,
    "union": _union,
    "wall ahead": _wall_ahead,
}
